use std::f64::consts::FRAC_PI_2;

use fretwear::reference::elliptic::complete;

use crate::quadrature::integrate;

#[test]
fn both_kinds_are_their_integrals() {
    for m in [0.0, 1e-6, 0.3, 0.9, 0.999] {
        let (first, second) = complete(m);
        let root = |phi: f64| (1.0 - m * phi.sin().powi(2)).sqrt();
        let expected = [
            integrate(0.0, FRAC_PI_2, 64, |phi| 1.0 / root(phi)),
            integrate(0.0, FRAC_PI_2, 64, root),
        ];
        assert!((first / expected[0] - 1.0).abs() < 1e-13, "K({m})");
        assert!((second / expected[1] - 1.0).abs() < 1e-13, "E({m})");
    }
    assert_eq!(complete(1.0), (f64::INFINITY, 1.0));
}

#[test]
fn legendres_relation_holds() {
    for m in [1e-9, 0.2, 0.5, 0.93] {
        let ((k, e), (k_other, e_other)) = (complete(m), complete(1.0 - m));
        assert!((e * k_other + e_other * k - k * k_other - FRAC_PI_2).abs() < 1e-13);
    }
}
