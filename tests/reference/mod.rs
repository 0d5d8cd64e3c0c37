//! The closed forms against one another, against quadrature and against their own limits.

mod axisymmetric;
mod cattaneo_mindlin;
mod elliptic;
mod hertz;
mod punch;
mod wear;
mod westergaard;

use fretwear::reference::{Bodies, CattaneoMindlin, Hertz};

/// Two different bodies, so that a formula that forgets one of them fails.
pub const BODIES: Bodies = Bodies {
    youngs_modulus: [198.4e9, 71.0e9],
    poisson_ratio: [0.3, 0.34],
};

/// Closed forms against quadrature that converges geometrically: what is left is rounding.
pub const QUADRATURE: f64 = 1e-10;

pub fn hertz() -> Hertz {
    Hertz {
        radius: 0.05,
        load: 320.0,
        effective_modulus: BODIES.effective_modulus(),
    }
}

pub fn cattaneo_mindlin() -> CattaneoMindlin {
    CattaneoMindlin {
        radius: 0.05,
        load: 320.0,
        friction_coefficient: 0.6,
        bodies: BODIES,
    }
}

#[test]
fn bodies_alike_reduce_to_the_textbook_moduli() {
    let (e, nu) = (198.4e9, 0.3);
    let bodies = Bodies::alike(e, nu);
    let shear = e / (2.0 * (1.0 + nu));
    let close = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-14;
    assert!(close(
        bodies.effective_modulus(),
        e / (2.0 * (1.0 - nu * nu))
    ));
    assert!(close(
        bodies.tangential_modulus(),
        shear / (2.0 * (2.0 - nu))
    ));
    assert!(close(bodies.directional_compliance(), 2.0 * nu / shear));
}
