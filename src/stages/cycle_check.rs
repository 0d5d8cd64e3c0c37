//! Compares the energy of a reversal cycle with the energy of a stepped cycle. Both cycles belong to the same response
//! and use half the grid.

use super::RunError;
use super::computed_motion::{ElementMotion, set_motion};
use super::contact_state::tangential_compliance;
use super::half_grid::HalfGrid;
use super::solvers::{Solvers, patch_and_height};
use super::stage_inputs::StageInputs;
use crate::gauge::Gauge;
use crate::tables::{Table, TableName, Tables, TypedTable, typed};
use crate::wear::Motion;
use crate::wear::cycle::March;

/// Steps of the stepped cycle: 32 steps would have an error of about 3 %.
const STEPS: usize = 64;
/// Relative error of the energy ratio due to half the grid and to the finite number of steps.
pub const REMAINING_ERROR: f64 = 0.006;
/// Tolerances of the pressure solves and of the closure of the stepped cycle. Each tolerance is a tenth of
/// [`REMAINING_ERROR`].
const NORMAL_TOLERANCE: f64 = 1e-4;
const CYCLE_TOLERANCE: f64 = 3e-3;

/// Returns the energy of a stepped cycle, divided by the energy of a reversal cycle. The joint has the worn depths
/// `wear` \[m\] and the motion `element_motion`. Returns `None` if half the grid has too few cells, or if the solver
/// finds no stepped or no reversal cycle.
///
/// # Errors
/// Errors of the contact solves.
pub fn stepped_part(
    reads: &StageInputs,
    threads: usize,
    wear: &[f64],
    element_motion: &ElementMotion,
) -> Result<Option<f64>, RunError> {
    let (whole, height) = patch_and_height(reads)?;
    let Some(half) = HalfGrid::of(&reads.recipe, &whole) else {
        return Ok(None);
    };
    let tables = Tables::from([(TableName::Surface, surface_of(&half, &height)?)]);
    let reads = reads.with_recipe(&half.recipe, &tables);
    let mut solvers = Solvers::new(threads, Gauge::default());
    let wear = half.coarsen(wear);
    let static_contact: typed::StaticContact = reads.table()?;
    let (load, preload) = (static_contact.normal_load, static_contact.preload);
    solvers.pressed_joint(&reads, preload.unwrap_or(0.0))?;
    let (contact, _) = solvers.timed(&reads, None, |joint| {
        joint.motion = Motion::at_rest(load);
        Ok(joint.static_contact(&wear, None)?)
    })?;
    let compliance = tangential_compliance(&static_contact);
    let mut energy = |reads: &StageInputs| -> Result<Option<f64>, RunError> {
        match set_motion(reads, &mut solvers, load, Some(element_motion), compliance) {
            Ok(_) => {}
            Err(RunError::Cycle(_)) => return Ok(None),
            Err(error) => return Err(error),
        }
        let options = &mut solvers.joint(reads)?.options;
        options.extrapolate = false;
        options.normal.tolerance = options.normal.tolerance.max(NORMAL_TOLERANCE);
        options.cycle_tolerance = options.cycle_tolerance.max(CYCLE_TOLERANCE);
        let cycle = solvers.timed(reads, None, |joint| Ok(joint.cycle(&wear, &contact, None)?));
        Ok(Some(cycle?.0.dissipation))
    };
    let Some(between_ends) = energy(&reads)? else {
        return Ok(None);
    };
    let mut stepped_recipe = half.recipe.clone();
    for cycle in stepped_recipe
        .joints
        .iter_mut()
        .flat_map(|joint| &mut joint.cycle)
    {
        cycle.asked = Some(March::Stepped);
        cycle.steps = STEPS;
    }
    let Some(stepped) = energy(&reads.with_recipe(&stepped_recipe, &tables))? else {
        return Ok(None);
    };
    Ok((between_ends > 0.0 && stepped > 0.0).then(|| stepped / between_ends))
}

/// Returns the surface on half the grid, from the heights on the whole grid.
fn surface_of(half: &HalfGrid, height: &[f64]) -> Result<Table, RunError> {
    let patch = half.patch();
    let cells = (0..patch.grid.len()).map(|cell| patch.grid.cell(cell));
    let (i, j) = cells.map(|(i, j)| (i as i32, j as i32)).unzip();
    let surface = typed::Surface {
        i,
        j,
        height: half.coarsen(height),
        height_first: None,
        height_second: None,
        kept: patch.is_in_joint.clone(),
    };
    Ok(surface.to_table()?)
}
