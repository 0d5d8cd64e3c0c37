//! The unworn surface, once per run.

use super::RunError;
use super::declaration::Declaration;
use super::solvers::Solvers;
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use crate::grid::Patch;
use crate::recipe::{self, Part};
use crate::tables::{TableName, typed};

/// The cells of the joint and their unworn heights.
pub const DECLARATION: Declaration = Declaration {
    stage: Stage::Surface,
    when: When::Once,
    recipe: &[Part::Surface],
    reads: &[],
    before: &[],
    writes: &[TableName::Surface],
    is_due: |_| true,
    shared: false,
    compute,
};

fn compute(reads: &StageInputs, _: &mut Solvers) -> Result<Outputs, RunError> {
    let Some(surface) = reads.recipe.surface() else {
        unreachable!("a run with this stage has a surface");
    };
    let mut outputs = Outputs::default();
    let (patch, height, notices) = heights(reads, surface)?;
    let faces = reads.measured().and_then(|measured| measured.faces.clone());
    let [height_first, height_second] = match faces {
        Some(faces) => faces.map(Some),
        None => [None, None],
    };
    for notice in notices {
        outputs.notice(format!("[surface]: {notice}"));
    }
    let grid = surface.grid();
    let cells = (0..grid.len()).map(|cell| grid.cell(cell));
    let (i, j) = cells.map(|(i, j)| (i as i32, j as i32)).unzip();
    outputs.add_table(&typed::Surface {
        i,
        j,
        height,
        height_first,
        height_second,
        kept: patch.is_in_joint,
    })?;
    Ok(outputs)
}

/// Returns the cells, the unworn heights, and notices for the user.
fn heights(
    reads: &StageInputs,
    surface: &recipe::Surface,
) -> Result<(Patch, Vec<f64>, Vec<String>), RunError> {
    if let Some(measured) = reads.measured() {
        let notices = measured.notices.iter().map(ToString::to_string).collect();
        return Ok((measured.patch.clone(), measured.heights.clone(), notices));
    }
    let patch = surface.patch()?;
    let Some(generated) = surface.heights.generate(&patch)? else {
        unreachable!("the inputs hold what a file gives");
    };
    let notices = generated.warnings.iter().map(ToString::to_string);
    Ok((patch, generated.heights, notices.collect()))
}
