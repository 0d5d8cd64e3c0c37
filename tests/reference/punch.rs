use fretwear::reference::elastic;
use fretwear::reference::{CattaneoMindlin, CircularPunch, Hertz};

use super::PAIR;
use crate::quadrature::integrate;

#[test]
fn a_hertz_contact_is_as_stiff_as_the_punch_of_its_radius() {
    let hertz = Hertz {
        radius: 0.03,
        load: 77.0,
        effective_modulus: elastic::effective_modulus(&PAIR),
    };
    let sheared = CattaneoMindlin {
        radius: 0.03,
        load: 77.0,
        friction_coefficient: 0.4,
        pair: PAIR,
    };
    let punch = CircularPunch {
        radius: hertz.contact_radius(),
        pair: PAIR,
    };
    assert!((punch.normal_stiffness() / hertz.normal_stiffness() - 1.0).abs() < 1e-14);
    assert!((punch.tangential_stiffness() / sheared.tangential_stiffness() - 1.0).abs() < 1e-14);
}

#[test]
fn traction_carries_the_force() {
    let punch = CircularPunch {
        radius: 2.0e-3,
        pair: PAIR,
    };
    // The substitution r = a sin φ removes the singularity at the rim: 2π r dr / √(1 − r²/a²) = 2πa² sin φ dφ.
    let total = integrate(0.0, 0.5 * std::f64::consts::PI, 2, |phi| {
        let r = punch.radius * phi.sin();
        punch.traction(51.0, r) * 2.0 * std::f64::consts::PI * r * punch.radius * phi.cos()
    });
    assert!((total / 51.0 - 1.0).abs() < 1e-10);
    assert_eq!(punch.traction(51.0, punch.radius), 0.0);
}
