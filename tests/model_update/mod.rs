//! Tests of contact elements from the fine contact, against double loops, closed forms, and contact solutions.

mod bolt;
mod bolt_compliance;
mod criterion;
mod elements;
mod end_loads;
mod motion_energy;
mod parameters;
mod sliders;
mod stiffness;
mod trend;

use fretwear::contact::{Boundary, HalfSpace, Pair};
use fretwear::grid::Grid;
use fretwear::model_update::{ContactElements, Sliders};
use fretwear::structure::resonator::{FacingFaces, Resonator};

pub use crate::contact::STEEL;

/// Relative rounding of a sum over the cells of a grid.
pub const ROUNDING: f64 = 1e-12;

/// The 340 contact elements of the shipped resonator, from its mesh.
pub fn facings() -> Vec<FacingFaces> {
    Resonator::default().mesh().expect("the resonator").contacts
}

/// Contact elements of the shipped resonator over a fine grid.
pub fn resonator(grid: Grid) -> ContactElements {
    let cells: Vec<[usize; 2]> = facings().iter().map(|f| f.cell).collect();
    ContactElements::new(grid, [19, 19], &cells).expect("the resonator's elements")
}

/// 5 × 3 elements without the middle element and one corner element, over 17 × 14 cells of 6 × 4 mm.
pub fn small() -> ContactElements {
    let grid = Grid::over([6e-3, 4e-3], [17, 14]);
    ContactElements::new(grid, [5, 3], &small_faces()).expect("elements")
}

pub fn small_faces() -> Vec<[usize; 2]> {
    let faces = (0..15).map(|c| [c / 3, c % 3]);
    faces.filter(|&c| c != [2, 1] && c != [4, 0]).collect()
}

/// Sliders with the given element, load \[N\], gap \[m\], kn and kt \[N/m\].
pub fn sliders(of: &[(usize, [f64; 4])]) -> Sliders {
    let column = |k: usize| of.iter().map(|(_, values)| values[k]).collect();
    Sliders {
        element: of.iter().map(|(element, _)| *element).collect(),
        normal_load: column(0),
        gap: column(1),
        kn: column(2),
        kt: column(3),
    }
}

pub fn half_space(grid: Grid) -> HalfSpace {
    HalfSpace::new(grid, Pair::same(STEEL), Boundary::Free)
}

/// Field without any regularity, in [0, 1).
pub fn noise(cells: usize) -> Vec<f64> {
    (0..cells)
        .map(|c| ((c as f64 + 0.5) * 12.9898).sin() * 43_758.545_3)
        .map(|x| x - x.floor())
        .collect()
}

pub fn assert_close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!(
        (found - expected).abs() <= tolerance * expected.abs(),
        "{what}: {found:e}, expected {expected:e}"
    );
}
