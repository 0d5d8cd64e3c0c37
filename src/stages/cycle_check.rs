//! What a cycle between two ends misses: the energy of a stepped one under the same response, on half the grid, beside that between the ends there.

use super::RunError;
use super::computed_motion::{ElementMotion, let_move};
use super::contact_state::tangential_compliance;
use super::reads::Reads;
use super::solvers::{Solvers, patch_and_height};
use crate::gauge::Gauge;
use crate::grid::Patch;
use crate::recipe::Recipe;
use crate::tables::{TableName, Tables, TypedTable, typed};
use crate::wear::Motion;
use crate::wear::cycle::March;

/// Steps of the stepped cycle: 32 miss some 3 % by themselves.
const STEPS: usize = 64;
/// What half the grid and so many steps leave of the difference, in parts of the energy.
const LEFT: f64 = 0.006;
/// Tolerances of the solves, of the pressures and of the closure of the stepped cycle: a tenth of what is left.
const NORMAL_TOLERANCE: f64 = 1e-4;
const CYCLE_TOLERANCE: f64 = 3e-3;
/// Fewer cells a side than this resolve no roughness.
const FEWEST_CELLS: usize = 32;

/// The relative error of the energy of the cycle between two ends, for a joint of this `wear` \[m\] that moves as `moved` says; none where the grid has no half
/// of enough cells, or no such cycles.
///
/// # Errors
/// Those of the contact solves.
pub fn error_between_ends(
    reads: &Reads,
    threads: usize,
    wear: &[f64],
    moved: &ElementMotion,
) -> Result<Option<f64>, RunError> {
    let Some(half) = HalfGrid::of(reads)? else {
        return Ok(None);
    };
    let reads = reads.with(&half.recipe, &half.tables);
    let mut solvers = Solvers::new(threads, Gauge::default());
    let wear = half.means(wear);
    let of_contact: typed::StaticContact = reads.table()?;
    let (load, preload) = (of_contact.normal_load, of_contact.preload);
    solvers.pressed_joint(&reads, preload.unwrap_or(0.0))?;
    let (contact, _) = solvers.work(&reads, None, |joint| {
        joint.motion = Motion::none(load);
        Ok(joint.static_contact(&wear, None)?)
    })?;
    let compliance = tangential_compliance(&of_contact);
    let mut energy = |reads: &Reads| -> Result<Option<f64>, RunError> {
        match let_move(reads, &mut solvers, load, Some(moved), compliance) {
            Ok(_) => {}
            Err(RunError::Cycle(_)) => return Ok(None),
            Err(error) => return Err(error),
        }
        let options = &mut solvers.joint(reads)?.options;
        options.extrapolate = false;
        options.normal.tolerance = options.normal.tolerance.max(NORMAL_TOLERANCE);
        options.cycle_tolerance = options.cycle_tolerance.max(CYCLE_TOLERANCE);
        let cycle = solvers.work(reads, None, |joint| Ok(joint.cycle(&wear, &contact, None)?));
        Ok(Some(cycle?.0.dissipation))
    };
    let Some(between_ends) = energy(&reads)? else {
        return Ok(None);
    };
    let mut stepped = half.recipe.clone();
    for cycle in stepped.joints.iter_mut().flat_map(|joint| &mut joint.cycle) {
        cycle.asked = Some(March::Stepped);
        cycle.steps = STEPS;
    }
    let Some(stepped) = energy(&reads.with(&stepped, &half.tables))? else {
        return Ok(None);
    };
    Ok((stepped > 0.0).then(|| (between_ends / stepped - 1.0).abs() + LEFT))
}

/// A joint on half of its grid.
struct HalfGrid {
    recipe: Recipe,
    /// The surface on it.
    tables: Tables,
    /// The whole grid, and half of it.
    patches: [Patch; 2],
}

impl HalfGrid {
    fn of(reads: &Reads) -> Result<Option<HalfGrid>, RunError> {
        let mut recipe = reads.recipe.clone();
        for surface in recipe
            .joints
            .iter_mut()
            .flat_map(|joint| &mut joint.surface)
        {
            let [nx, ny] = surface.grid;
            if [nx, ny].iter().any(|n| n % 2 == 1 || n / 2 < FEWEST_CELLS) {
                return Ok(None);
            }
            surface.grid = [nx / 2, ny / 2];
        }
        let patch = recipe.surface().and_then(|surface| surface.patch().ok());
        let Some(patch) = patch else {
            return Ok(None);
        };
        let (whole, height) = patch_and_height(reads)?;
        let mut half = HalfGrid {
            recipe,
            tables: Tables::new(),
            patches: [whole, patch],
        };
        let grid = half.patches[1].grid;
        let cells = (0..grid.len()).map(|cell| grid.cell(cell));
        let (i, j) = cells.map(|(i, j)| (i as i32, j as i32)).unzip();
        let surface = typed::Surface {
            i,
            j,
            height: half.means(&height),
            height_first: None,
            height_second: None,
            kept: half.patches[1].kept.clone(),
        };
        half.tables.insert(TableName::Surface, surface.to_table()?);
        Ok(Some(half))
    }

    /// Means of a field over the kept cells of the whole grid in each of half of it.
    fn means(&self, field: &[f64]) -> Vec<f64> {
        let [whole, half] = &self.patches;
        let cells = (0..half.grid.len()).map(|cell| {
            let (i, j) = half.grid.cell(cell);
            let of = [(0, 0), (0, 1), (1, 0), (1, 1)];
            let of = of.map(|(a, b)| whole.grid.index(2 * i + a, 2 * j + b));
            let kept = of.into_iter().filter(|&c| whole.kept[c]);
            let (sum, count) = kept.fold((0.0, 0), |(sum, count), c| (sum + field[c], count + 1));
            sum / f64::from(count.max(1))
        });
        cells.collect()
    }
}
