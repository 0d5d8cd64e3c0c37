//! The twin of a run: the same scene on half the grid. The twin estimates the error of the worn volume due to the grid.

use std::sync::Arc;

use serde_json::json;

use super::RunError;
use super::declaration::Declaration;
use super::half_grid::HalfGrid;
use super::observer::{Observer, Progress};
use super::run::{Ending, RunOptions, run};
use super::solvers::Solvers;
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use crate::gauge::Gauge;
use crate::recipe::{GridTwin, Inputs, Keep, Part, ResonanceOf};
use crate::store::{Opening, RunReader};
use crate::surface::prepare::{Fit, PreparedSurface};
use crate::tables::{TableName, typed};

/// Folder of the twin inside the folder of its run.
pub const FOLDER: &str = "grid_twin";

/// Content of the scene file of the twin.
const TWIN_SCENE: &str = "half_grid_of = \"the run in the folder above, which runs it\"\n";

/// The error of the grid is `SAFETY_FACTOR` times the change of the worn volume on half the grid. Rough contacts have
/// no order of convergence with the number of cells. In the published case, volumes on coarser grids lie on both sides
/// of the volume on the finest grid.
const SAFETY_FACTOR: f64 = 3.0;
/// Lower bound of the relative error of a grid, since two grids may agree by chance.
const LEAST_ERROR: f64 = 0.015;

/// The wear of the twin, once per run.
pub const DECLARATION: Declaration = Declaration {
    stage: Stage::GridTwin,
    when: When::Once,
    recipe: &[Part::GridCheck],
    reads: &[],
    before: &[],
    writes: &[TableName::GridTwin],
    is_due: |_| true,
    shared: false,
    compute,
};

fn compute(reads: &StageInputs, _: &mut Solvers) -> Result<Outputs, RunError> {
    let mut outputs = Outputs::default();
    let twin = reads.grid_twin().ok_or(RunError::NoGridTwin)?;
    outputs.add_table(&typed::GridTwin {
        cycles: twin.cycles.clone(),
        wear_volume: twin.volume.clone(),
    })?;
    Ok(outputs)
}

/// Runs or continues the twin in a folder inside the folder of the run. Returns the inputs with the wear of the twin,
/// or `None` if the twin was asked to stop.
pub fn with_twin(
    options: &RunOptions,
    observer: &dyn Observer,
) -> Result<Option<Inputs>, RunError> {
    let inputs = options.inputs;
    let Some(twin) = half_grid_inputs(inputs)? else {
        return Err(RunError::GridCheck {
            reason: "joint.grid cannot be halved: it needs even numbers of cells, at least 64 per side, and at least two cells per contact element",
        });
    };
    observer.notice("fidelity.grid_check: the same scene is run on half the grid first, in the folder grid_twin of the run");
    let options = RunOptions {
        inputs: &twin,
        root: options.root.join(FOLDER),
        source: None,
        until: None,
        cache: options.cache.clone(),
        file_system: options.file_system.clone(),
        ..*options
    };
    if run(&options, &TwinObserver(observer))?.ending != Ending::Done {
        return Ok(None);
    }
    let reader = RunReader::open(options.file_system.clone(), &options.root)?;
    let mut twin_wear = GridTwin::default();
    for wear_iteration in reader.iterations() {
        let summary: typed::Summary = reader.typed(wear_iteration)?;
        twin_wear.cycles.push(summary.cycles.unwrap_or(0));
        twin_wear.volume.push(summary.wear_volume.unwrap_or(0.0));
    }
    Ok(Some(Inputs {
        grid_twin: Some(Arc::new(twin_wear)),
        ..inputs.clone()
    }))
}

/// Observer of the twin. The observer reports the stages of the twin. The observer does not report the progress of the
/// twin, which a user could mistake for the progress of the run.
struct TwinObserver<'a>(&'a dyn Observer);

impl Observer for TwinObserver<'_> {
    fn opened(&self, _: &Opening) {}
    fn notice(&self, _: &str) {}
    fn stage(&self, stage: Stage, wear_iteration: u64) {
        self.0.stage(stage, wear_iteration);
    }
    fn ends_before(&self, stage: Stage) -> bool {
        self.0.ends_before(stage)
    }
    fn gauge(&self) -> Gauge {
        self.0.gauge()
    }
    fn committed(&self, _: &Progress) {}
}

/// Returns the inputs of the run on half the grid. Returns `None` if half the grid has too few cells.
fn half_grid_inputs(inputs: &Inputs) -> Result<Option<Inputs>, RunError> {
    let Some(surface) = inputs.recipe.surface() else {
        return Ok(None);
    };
    let (patch, heights) = match &inputs.measured {
        Some(measured) => (measured.patch.clone(), measured.heights.clone()),
        None => {
            let patch = surface.patch()?;
            let generated = surface.heights.generate(&patch)?;
            let generated = generated.expect("the inputs hold what a file gives");
            (patch, generated.heights)
        }
    };
    let Some(half) = HalfGrid::of(&inputs.recipe, &patch) else {
        return Ok(None);
    };
    let measured = PreparedSurface {
        patch: half.patch().clone(),
        heights: half.coarsen(&heights),
        notices: Vec::new(),
        faces: None,
        // The run on the whole grid reports how the map fits the joint.
        fit: Fit {
            points: [0.0; 2],
            aspect: 1.0,
            is_assumed: false,
            unmeasured: 0.0,
            correlation: [None; 2],
            side: None,
            range: 0.0,
        },
    };
    let mut recipe = half.recipe;
    recipe.grid_check = false;
    recipe.output.keep = Keep::All;
    recipe.output.curves_every = 0;
    recipe.output.cycle_fields = None;
    recipe.output.response_at = Vec::new();
    recipe.output.resonance = ResonanceOf::default();
    let mut identity = inputs.identity.clone();
    // No other run can begin from the twin, and the twin cannot be continued alone.
    identity.scene_toml = TWIN_SCENE.to_owned();
    if let Some(grid) = identity.scene.pointer_mut("/joint/grid") {
        *grid = json!(recipe.surface().map(|surface| surface.grid));
    }
    Ok(Some(Inputs {
        recipe,
        identity,
        measured: Some(Arc::new(measured)),
        ..inputs.clone()
    }))
}

/// Returns the relative error of a worn volume \[m³\] after `cycles` due to the grid. If the twin ran at least `cycles`
/// cycles, the function compares the worn volumes after `cycles`. If the twin ended earlier, the function compares the
/// numbers of cycles to the same worn volume.
pub fn error_of_grid(twin: &typed::GridTwin, cycles: i64, volume: f64) -> f64 {
    if volume <= 0.0 {
        return 0.0;
    }
    let (twin_cycles, cycles) = (twin.cycles.iter().map(|n| *n as f64), cycles as f64);
    let twin_cycles: Vec<f64> = twin_cycles.collect();
    let is_within = twin_cycles.last().is_some_and(|last| cycles <= *last);
    let ratio = match is_within {
        true => interpolate(&twin_cycles, &twin.wear_volume, cycles) / volume,
        false => cycles / interpolate(&twin.wear_volume, &twin_cycles, volume),
    };
    (SAFETY_FACTOR * (ratio - 1.0).abs()).max(LEAST_ERROR)
}

/// Interpolates linearly at `x` between points with ascending `xs`, and extrapolates beyond the last point.
fn interpolate(xs: &[f64], ys: &[f64], x: f64) -> f64 {
    let last = xs.len().saturating_sub(1);
    let after = (1..last).find(|&k| xs[k] >= x).unwrap_or(last);
    let before = after.saturating_sub(1);
    match xs[after] > xs[before] {
        true => ys[before] + (ys[after] - ys[before]) * (x - xs[before]) / (xs[after] - xs[before]),
        false => ys[after],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_is_three_times_what_the_twin_differs_by() {
        let twin = typed::GridTwin {
            cycles: vec![0, 100, 300],
            wear_volume: vec![0.0, 1.0, 2.0],
        };
        let error = |cycles, volume| error_of_grid(&twin, cycles, volume);
        assert_eq!(error(0, 0.0), 0.0);
        assert!((error(50, 0.4) - 0.75).abs() < 1e-12);
        assert!((error(200, 1.6) - 0.1875).abs() < 1e-12);
        // The twin has ended earlier with the same volume.
        assert!((error(400, 2.0) - 1.0).abs() < 1e-12);
    }
}
