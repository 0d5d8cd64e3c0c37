//! A joint on half of its grid: the same surface, each cell with the mean of four.

use crate::grid::Patch;
use crate::recipe::{FEWEST_CELLS, Recipe};

/// A joint on half of its grid.
pub struct HalfGrid {
    /// The recipe with half as many cells along x and y.
    pub recipe: Recipe,
    /// The whole grid, and half of it.
    patches: [Patch; 2],
}

impl HalfGrid {
    /// Of a recipe with a surface on the `whole` grid; none where that has no half of enough cells.
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
            half.kept[cell] &= kept_of(whole, grid.cell(cell)).next().is_some();
        }
        Some(HalfGrid {
            recipe,
            patches: [whole.clone(), half],
        })
    }

    /// The cells.
    pub fn patch(&self) -> &Patch {
        &self.patches[1]
    }

    /// Means of a field over the kept cells of the whole grid in each of half of it.
    pub fn means(&self, field: &[f64]) -> Vec<f64> {
        let [whole, half] = &self.patches;
        let cells = (0..half.grid.len()).map(|cell| {
            let kept = kept_of(whole, half.grid.cell(cell));
            let (sum, count) = kept.fold((0.0, 0), |(sum, count), c| (sum + field[c], count + 1));
            sum / f64::from(count.max(1))
        });
        cells.collect()
    }
}

/// The kept cells of the whole grid that lie in cell (i, j) of half of it.
fn kept_of(whole: &Patch, (i, j): (usize, usize)) -> impl Iterator<Item = usize> {
    let of = [(0, 0), (0, 1), (1, 0), (1, 1)];
    let of = of.map(|(a, b)| whole.grid.index(2 * i + a, 2 * j + b));
    of.into_iter().filter(|&c| whole.kept[c])
}
