use std::f64::consts::PI;

use fretwear::reference::Hertz;

use super::{QUADRATURE, hertz};
use crate::quadrature::{integrate, integrate_annulus};

#[test]
fn pressure_carries_the_load() {
    let hertz = hertz();
    let load = integrate_annulus(0.0, hertz.contact_radius(), |r, _| hertz.pressure(r));
    assert!((load / hertz.load - 1.0).abs() < QUADRATURE, "{load}");
    assert_eq!(hertz.pressure(1.0001 * hertz.contact_radius()), 0.0);
}

/// Displacement by Boussinesq's integral of the pressure, in polar coordinates about the field point, which remove the singularity.
fn boussinesq(hertz: &Hertz, x: f64) -> f64 {
    let a = hertz.contact_radius();
    // Chord through the field point at the angle θ: p²(t) is a parabola with the roots t₁ and t₂, and ∫p dt is half an ellipse.
    let chord = |theta: f64| {
        let discriminant = a * a - (x * theta.sin()).powi(2);
        if discriminant <= 0.0 {
            return 0.0;
        }
        let (start, end) = (
            -x * theta.cos() - discriminant.sqrt(),
            -x * theta.cos() + discriminant.sqrt(),
        );
        let (middle, half) = (0.5 * (start + end), 0.5 * (end - start));
        let from = if start < 0.0 {
            ((-middle / half).max(-1.0)).asin()
        } else {
            -0.5 * PI
        };
        if end <= 0.0 {
            return 0.0;
        }
        integrate(from, 0.5 * PI, 4, |phi| {
            let t = middle + half * phi.sin();
            let r = (x * x + t * t + 2.0 * x * t * theta.cos()).sqrt();
            hertz.pressure(r) * half * phi.cos()
        })
    };
    let total = if x < a {
        2.0 * integrate(0.0, PI, 8, chord)
    } else {
        // From a point outside, the disc spans ±asin(a/x) about the direction of the centre. The substitution sin φ removes the root at the
        // rim.
        let limit = (a / x).asin();
        2.0 * integrate(0.0, 0.5 * PI, 8, |phi| {
            let theta = PI - limit * phi.sin();
            chord(theta) * limit * phi.cos()
        })
    };
    total / (PI * hertz.effective_modulus)
}

#[test]
fn displacement_is_boussinesqs_integral_of_the_pressure() {
    let hertz = hertz();
    let a = hertz.contact_radius();
    for share in [0.0, 0.35, 0.9, 1.2, 2.5] {
        let (found, expected) = (hertz.displacement(share * a), boussinesq(&hertz, share * a));
        // The integrand has a kink at chords that graze the rim. The kink limits the quadrature; the closed form is exact.
        assert!(
            (found / expected - 1.0).abs() < 1e-7,
            "r = {share} a: {found:e} against {expected:e}"
        );
    }
}

#[test]
fn contact_closes_the_gap_and_nothing_penetrates_outside() {
    let hertz = hertz();
    let a = hertz.contact_radius();
    for share in [0.0, 0.3, 0.99] {
        let r = share * a;
        let gap = 0.5 * r * r / hertz.radius - hertz.approach() + hertz.displacement(r);
        assert!(
            gap.abs() < 1e-13 * hertz.approach(),
            "r = {share} a: {gap:e}"
        );
    }
    let gaps: Vec<f64> = [1.0, 1.01, 1.1, 1.5, 3.0]
        .iter()
        .map(|s| hertz.gap(s * a))
        .collect();
    assert_eq!(gaps[0], 0.0);
    assert!(gaps.windows(2).all(|pair| pair[1] > pair[0]), "{gaps:?}");
}

#[test]
fn stiffness_is_the_slope_of_load_over_approach() {
    let hertz = hertz();
    let load = |approach: f64| Hertz::load_at(hertz.radius, hertz.effective_modulus, approach);
    assert!((load(hertz.approach()) / hertz.load - 1.0).abs() < 1e-13);
    let step = 1e-4 * hertz.approach();
    let slope = (load(hertz.approach() + step) - load(hertz.approach() - step)) / (2.0 * step);
    // A central difference of the relative step h = 1e-4 has a relative error of h²/24.
    assert!((slope / hertz.normal_stiffness() - 1.0).abs() < 1e-8);
}
