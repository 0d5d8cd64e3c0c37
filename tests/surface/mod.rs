//! Surfaces: generation, measurement files, preparation, statistics.

mod al3d;
mod cases;
mod correlation;
mod damaged;
mod foreign;
mod generate;
mod limits;
mod malformed;
mod prepare;
mod readers;
mod real_files;
mod resample;
mod sdf;
mod statistics;
pub mod writers;

use fretwear::grid::{Grid, Patch};
use fretwear::surface::readers::{Correction, ReadOptions};

/// Options for a file that states its units.
const AS_STATED: ReadOptions = ReadOptions {
    height_unit: None,
    lateral_unit: None,
    spacing: None,
    transpose: false,
    correct: Correction {
        unit: None,
        spacing: None,
    },
};

/// Options for a file without units, with heights in micrometres.
const MICROMETRES: ReadOptions = ReadOptions {
    height_unit: Some(1e-6),
    ..AS_STATED
};

/// Joint that is not square and has no square cells.
fn joint(cells: [usize; 2]) -> Grid {
    Grid::over([8e-3, 5e-3], cells)
}

/// Joint with a bolt hole that is not square and has no square cells.
fn bored(cells: [usize; 2]) -> Patch {
    Patch::with_hole(joint(cells), 2e-3)
}

/// Field of a function of the cell's position \[m\], measured from the centre of the grid.
fn field(grid: &Grid, height: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    (0..grid.len())
        .map(|index| {
            let (i, j) = grid.cell(index);
            let (x, y) = grid.centre(i, j);
            height(x, y)
        })
        .collect()
}

/// Largest absolute difference.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |m, (a, b)| m.max((a - b).abs()))
}
