//! The contact solvers against integrals, direct sums and closed forms that share no code with them.

mod battery;
mod capped;
mod cattaneo_mindlin;
mod certificate;
mod conditions;
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
mod nodes;
mod pairs;
mod random;
mod sliding;
mod stiffness;
mod westergaard;

use fretwear::contact::{Boundary, Elastic, HalfSpace, Pair};
use fretwear::grid::{Grid, Patch};

/// Two different bodies, so that a kernel that forgets one of them fails.
pub const PAIR: Pair = Pair {
    lower: Elastic {
        youngs_modulus: 198.4e9,
        poisson_ratio: 0.3,
    },
    upper: Elastic {
        youngs_modulus: 71.0e9,
        poisson_ratio: 0.34,
    },
};

pub fn half_space(patch: &Patch) -> HalfSpace {
    HalfSpace::new(patch.grid, PAIR, Boundary::Free)
}

/// Heights of a paraboloid whose apex lies at height 0 and at `centre`, measured from the grid's centre \[m\].
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
