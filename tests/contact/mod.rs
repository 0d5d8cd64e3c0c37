//! Tests of the contact solvers by integrals, direct sums and closed forms, without shared code.

mod area;
mod battery;
mod capped;
mod cattaneo_mindlin;
mod certificate;
mod convolution;
mod cost;
mod coupled;
mod coupling;
mod drawn;
mod driven;
mod extremes;
mod hertz;
mod hostile_steps;
mod kernels;
mod motions;
pub mod nodes;
mod pairs;
mod random;
mod sliding;
mod stiffness;
mod westergaard;

use std::f64::consts::PI;

use fretwear::contact::tangential::{Drive, TangentialProblem};
use fretwear::contact::{Boundary, Elastic, HalfSpace, Pair, cell_integrals};
use fretwear::grid::{ByAxis, Grid, Patch};

/// Material of the published case.
pub const STEEL: Elastic = Elastic {
    youngs_modulus: 198.4e9,
    poisson_ratio: 0.3,
};

/// Two different bodies. A kernel that ignores one body fails the tests.
pub const PAIR: Pair = Pair {
    lower: STEEL,
    upper: Elastic {
        youngs_modulus: 71.0e9,
        poisson_ratio: 0.34,
    },
};

pub fn half_space(patch: &Patch) -> HalfSpace {
    HalfSpace::new(patch.grid, PAIR, Boundary::Free)
}

/// Heights of a paraboloid with its apex at height 0 and at `centre`, relative to the centre of the grid \[m\].
pub fn paraboloid(grid: Grid, radius: f64, centre: (f64, f64)) -> Vec<f64> {
    (0..grid.len())
        .map(|index| -0.5 * distance(grid, index, centre).powi(2) / radius)
        .collect()
}

/// Distance of a cell's centre from `centre` \[m\].
pub fn distance(grid: Grid, index: usize, centre: (f64, f64)) -> f64 {
    let (i, j) = grid.cell(index);
    let (x, y) = grid.centre(i, j);
    (x - centre.0).hypot(y - centre.1)
}

/// Tangential step without rotation, from the former shear, if any.
pub fn sheared<'a>(
    patch: &'a Patch,
    limit: &'a [f64],
    previous: Option<&'a ByAxis<Vec<f64>>>,
    drive: &'a ByAxis<Drive>,
) -> TangentialProblem<'a> {
    TangentialProblem {
        patch,
        limit,
        previous,
        drive,
        rotation: None,
        offset: None,
    }
}

/// Given displacements along the axes \[m\].
pub fn moved_by(displacement: &[f64]) -> ByAxis<Drive> {
    let along = displacement.iter().map(|d| Drive::Displacement(*d));
    along.collect()
}

/// The friction limit under a pressure \[Pa\].
pub fn limit_of(friction_coefficient: f64, pressure: &[f64]) -> Vec<f64> {
    let limit = pressure.iter().map(|p| friction_coefficient * p);
    limit.collect()
}

/// Displacement along the normal, x and y of a cell under unit tractions on another cell, by Boussinesq and Cerruti, without the coupling
/// of pressure and shear \[m/Pa\].
pub fn influence(pair: Pair, grid: Grid, at: usize, from: usize) -> [[f64; 3]; 3] {
    let of_both = |part: fn(f64) -> f64| -> f64 {
        let bodies = [pair.lower, pair.upper];
        let terms = bodies.map(|body| part(body.poisson_ratio) / (PI * body.youngs_modulus));
        terms.iter().sum()
    };
    let (round, lobed) = (of_both(|nu| 1.0 - nu * nu), of_both(|nu| nu * (1.0 + nu)));
    let ((i, j), (k, l)) = (grid.cell(at), grid.cell(from));
    let away = |a: usize, b: usize, side: f64| (a as f64 - b as f64) * side;
    let (x, y) = (away(i, k, grid.dx), away(j, l, grid.dy));
    let cell = cell_integrals(x, y, grid.dx, grid.dy);
    let across = lobed * cell.xy;
    [
        [round * cell.inverse, 0.0, 0.0],
        [0.0, round * cell.inverse + lobed * cell.xx, across],
        [0.0, across, round * cell.inverse + lobed * cell.yy],
    ]
}

/// √(Σ(found − expected)² / Σ expected²).
pub fn relative_l2(found: &[f64], expected: &[f64]) -> f64 {
    let difference: f64 = found
        .iter()
        .zip(expected)
        .map(|(a, b)| (a - b) * (a - b))
        .sum();
    let scale: f64 = expected.iter().map(|b| b * b).sum();
    (difference / scale).sqrt()
}
