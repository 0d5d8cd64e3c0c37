//! The twin of a run on half of its grid: what the grid makes of the worn volume.

use std::sync::Arc;

use super::RunError;
use super::declaration::Declaration;
use super::half_grid::HalfGrid;
use super::observer::Observer;
use super::reads::{Outputs, Reads};
use super::run::{Ending, RunOptions, run};
use super::solvers::Solvers;
use super::stage::{Stage, When};
use crate::recipe::{GridTwin, Inputs, Keep, Part};
use crate::store::RunReader;
use crate::surface::prepare::{Fit, Prepared};
use crate::tables::{TableName, typed};

/// The folder of the twin in that of its run.
pub const FOLDER: &str = "grid_twin";

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

fn compute(reads: &Reads, _: &mut Solvers) -> Result<Outputs, RunError> {
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
    if options.source.is_some() {
        return Err(RunError::GridCheck {
            reason: "it runs the scene from its beginning on half the grid, and this run begins from another one",
        });
    }
    let Some(twin) = on_half_the_grid(inputs)? else {
        return Err(RunError::GridCheck {
            reason: "the joint needs an even number of cells along x and y, 64 or more",
        });
    };
    observer.notice("fidelity.grid_check: first the same scene on half the grid");
    let options = RunOptions {
        inputs: &twin,
        root: options.root.join(FOLDER),
        source: None,
        until: None,
        cache: options.cache.clone(),
        file_system: options.file_system.clone(),
        ..*options
    };
    if run(&options, observer)?.ending != Ending::Done {
        return Ok(None);
    }
    let reader = RunReader::open(options.file_system.clone(), &options.root)?;
    let mut worn = GridTwin::default();
    for wear_iteration in reader.iterations() {
        let summary: typed::Summary = reader.typed(wear_iteration)?;
        worn.cycles.push(summary.cycles.unwrap_or(0));
        worn.volume.push(summary.wear_volume.unwrap_or(0.0));
    }
    observer.notice("fidelity.grid_check: now on the whole grid");
    Ok(Some(Inputs {
        grid_twin: Some(Arc::new(worn)),
        ..inputs.clone()
    }))
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
    let measured = Prepared {
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
    Ok(Some(Inputs {
        recipe,
        measured: Some(Arc::new(measured)),
        ..inputs.clone()
    }))
}

/// Relative error of a worn volume \[m³\] after these cycles by the grid.
pub fn error_of_grid(twin: &typed::GridTwin, cycles: i64, volume: f64) -> f64 {
    if volume <= 0.0 {
        return 0.0;
    }
    let there = volume_at(twin, cycles as f64);
    (OF_DIFFERENCE * (there / volume - 1.0).abs()).max(LEAST)
}

/// The volume that the twin has worn after these cycles, along straight lines between its iterations and beyond the last \[m³\].
fn volume_at(twin: &typed::GridTwin, cycles: f64) -> f64 {
    let point = |k: usize| (twin.cycles[k] as f64, twin.wear_volume[k]);
    let last = twin.cycles.len().saturating_sub(1);
    let after = (1..last).find(|&k| point(k).0 >= cycles).unwrap_or(last);
    let ((n0, v0), (n1, v1)) = (point(after.saturating_sub(1)), point(after));
    match n1 > n0 {
        true => v0 + (v1 - v0) * (cycles - n0) / (n1 - n0),
        false => v1,
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
        // Beyond its end it wears on.
        assert!((error(500, 3.0) - LEAST).abs() < 1e-12);
    }
}
