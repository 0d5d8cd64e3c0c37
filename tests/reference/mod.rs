//! Closed forms, compared with each other, with quadrature and with their limits.

mod axisymmetric;
mod cattaneo_mindlin;
mod elliptic;
mod hertz;
mod jenkins_oscillator;
mod punch;
mod wear;
mod westergaard;

use fretwear::contact::Pair;
use fretwear::reference::{CattaneoMindlin, Hertz, elastic};

use crate::contact::STEEL;

pub use crate::contact::PAIR;

/// Tolerance for a quadrature that converges geometrically: only rounding errors remain.
pub const QUADRATURE: f64 = 1e-10;

pub fn hertz() -> Hertz {
    Hertz {
        radius: 0.05,
        load: 320.0,
        effective_modulus: elastic::effective_modulus(&PAIR),
    }
}

pub fn cattaneo_mindlin() -> CattaneoMindlin {
    CattaneoMindlin {
        radius: 0.05,
        load: 320.0,
        friction_coefficient: 0.6,
        pair: PAIR,
    }
}

#[test]
fn a_pair_of_one_material_reduces_to_the_textbook_moduli() {
    let (e, nu) = (STEEL.youngs_modulus, STEEL.poisson_ratio);
    let pair = Pair::same(STEEL);
    let shear = e / (2.0 * (1.0 + nu));
    let close = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-14;
    assert!(close(
        elastic::effective_modulus(&pair),
        e / (2.0 * (1.0 - nu * nu))
    ));
    assert!(close(
        elastic::tangential_modulus(&pair),
        shear / (2.0 * (2.0 - nu))
    ));
    assert!(close(
        elastic::directional_compliance(&pair),
        2.0 * nu / shear
    ));
    assert!(close(
        pair.effective_modulus(),
        elastic::effective_modulus(&pair)
    ));
    assert!(close(
        PAIR.effective_modulus(),
        elastic::effective_modulus(&PAIR)
    ));
}
