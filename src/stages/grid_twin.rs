//! The twin of a run on half of its grid: what the grid makes of the worn volume.

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

/// The folder of the twin in that of its run.
pub const FOLDER: &str = "grid_twin";

/// What stands in place of its scene.
const TWIN_SCENE: &str = "half_grid_of = \"the run in the folder above, which runs it\"\n";

/// What half the grid changes times this is taken for the error of the grid. There is no order by which more cells change a rough contact: volumes of
/// the published case lie on both sides of that of the finest grid.
const OF_DIFFERENCE: f64 = 3.0;
/// The least relative error of a grid: two may agree by chance.
const LEAST: f64 = 0.015;

/// The wear of the twin, once a run.
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
    outputs.put(&typed::GridTwin {
        cycles: twin.cycles.clone(),
        wear_volume: twin.volume.clone(),
    })?;
    Ok(outputs)
}

/// Inputs with the wear of their twin, which is run, or run on, in a folder in that of the run; none where it was asked to stop.
pub fn with_twin(
    options: &RunOptions,
    observer: &dyn Observer,
) -> Result<Option<Inputs>, RunError> {
    let inputs = options.inputs;
    let Some(twin) = on_half_the_grid(inputs)? else {
        return Err(RunError::GridCheck {
            reason: "half of joint.grid does not fit the joint: it needs even numbers of cells, 64 or more, and half of them no less than contact elements",
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
    if run(&options, &Aside(observer))?.ending != Ending::Done {
        return Ok(None);
    }
    let reader = RunReader::open(options.file_system.clone(), &options.root)?;
    let mut worn = GridTwin::default();
    for wear_iteration in reader.iterations() {
        let summary: typed::Summary = reader.typed(wear_iteration)?;
        worn.cycles.push(summary.cycles.unwrap_or(0));
        worn.volume.push(summary.wear_volume.unwrap_or(0.0));
    }
    Ok(Some(Inputs {
        grid_twin: Some(Arc::new(worn)),
        ..inputs.clone()
    }))
}

/// Who watches a run is told what its twin does, not how far it is: that would be taken for the run's own.
struct Aside<'a>(&'a dyn Observer);

impl Observer for Aside<'_> {
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

/// The inputs of the twin; none where the grid has no half of enough cells.
fn on_half_the_grid(inputs: &Inputs) -> Result<Option<Inputs>, RunError> {
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
        heights: half.means(&heights),
        notices: Vec::new(),
        faces: None,
        // How a map fits to its joint is told of the whole grid.
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
    // It is no run to begin another one from, or to go on with by itself.
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

/// Relative error of a worn volume \[m³\] after these cycles by the grid. A twin that has worn as much in fewer cycles has ended before; it is compared by the
/// cycles that it took to this volume.
pub fn error_of_grid(twin: &typed::GridTwin, cycles: i64, volume: f64) -> f64 {
    if volume <= 0.0 {
        return 0.0;
    }
    let (all, cycles) = (twin.cycles.iter().map(|n| *n as f64), cycles as f64);
    let all: Vec<f64> = all.collect();
    let is_within = all.last().is_some_and(|last| cycles <= *last);
    let ratio = match is_within {
        true => line(&all, &twin.wear_volume, cycles) / volume,
        false => cycles / line(&twin.wear_volume, &all, volume),
    };
    (OF_DIFFERENCE * (ratio - 1.0).abs()).max(LEAST)
}

/// The value at `x` on straight lines through points of ascending `xs`, and beyond the last.
fn line(xs: &[f64], ys: &[f64], x: f64) -> f64 {
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
        // It has ended before, with as much worn.
        assert!((error(400, 2.0) - 1.0).abs() < 1e-12);
    }
}
