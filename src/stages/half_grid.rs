//! A joint on a grid with half as many cells per axis. The height of each coarse cell is the mean over four cells of
//! the whole grid.

use crate::grid::Patch;
use crate::recipe::{FEWEST_CELLS, Recipe};

/// A joint on a grid with half as many cells per axis.
pub struct HalfGrid {
    /// The recipe with half as many cells along x and y.
    pub recipe: Recipe,
    /// Patches of the whole grid and of the half grid.
    patches: [Patch; 2],
}

impl HalfGrid {
    /// Halves the grid of a recipe whose surface is on the `whole` grid. The function returns `None` if the half grid
    /// has too few cells, or if a number of cells is odd.
    pub fn of(recipe: &Recipe, whole: &Patch) -> Option<HalfGrid> {
        let mut recipe = recipe.clone();
        let surfaces = recipe.joints.iter_mut();
        for surface in surfaces.flat_map(|joint| &mut joint.surface) {
            let [nx, ny] = surface.grid;
            if [nx, ny].iter().any(|n| n % 2 == 1 || n / 2 < FEWEST_CELLS) {
                return None;
            }
            surface.grid = [nx / 2, ny / 2];
        }
        let mut half = recipe.surface()?.patch().ok()?;
        let grid = half.grid;
        for cell in 0..grid.len() {
            half.is_in_joint[cell] &= kept_cells(whole, grid.cell(cell)).next().is_some();
        }
        Some(HalfGrid {
            recipe,
            patches: [whole.clone(), half],
        })
    }

    /// Returns the cells of the half grid.
    pub fn patch(&self) -> &Patch {
        &self.patches[1]
    }

    /// Returns a field on the half grid: the mean over the kept cells of the whole grid in each cell.
    pub fn coarsen(&self, field: &[f64]) -> Vec<f64> {
        let [whole, half] = &self.patches;
        let cells = (0..half.grid.len()).map(|cell| {
            let fine_cells = kept_cells(whole, half.grid.cell(cell));
            let (sum, count) =
                fine_cells.fold((0.0, 0), |(sum, count), c| (sum + field[c], count + 1));
            sum / f64::from(count.max(1))
        });
        cells.collect()
    }
}

/// Returns the kept cells of the whole grid inside cell (i, j) of the half grid.
fn kept_cells(whole: &Patch, (i, j): (usize, usize)) -> impl Iterator<Item = usize> {
    let cells = [(0, 0), (0, 1), (1, 0), (1, 1)];
    let cells = cells.map(|(a, b)| whole.grid.index(2 * i + a, 2 * j + b));
    cells.into_iter().filter(|&c| whole.is_in_joint[c])
}
