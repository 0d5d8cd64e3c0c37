use fretwear::reference::elastic;
use std::f64::consts::PI;

use super::{QUADRATURE, cattaneo_mindlin};
use crate::quadrature::{integrate, integrate_annulus};

const FORCES: [f64; 4] = [0.05, 0.4, 0.8, 0.99];

#[test]
fn traction_carries_the_force_within_the_friction_limit() {
    let case = cattaneo_mindlin();
    let hertz = case.hertz();
    let a = hertz.contact_radius();
    for share in FORCES {
        let force = share * case.sliding_force();
        let c = case.stick_radius(force);
        let q = |r: f64, _: f64| case.traction(force, r);
        let found = integrate_annulus(0.0, c, q) + integrate_annulus(c, a, q);
        assert!(
            (found / force - 1.0).abs() < QUADRATURE,
            "T = {share} µN: {found:e}"
        );
        for r in [0.0, 0.5 * c, 0.5 * (a + c)] {
            let limit = case.friction_coefficient * hertz.pressure(r);
            let q = case.traction(force, r);
            assert!(q >= 0.0 && q <= limit * (1.0 + 1e-14));
            assert!(
                (r > c) == (q > limit * (1.0 - 1e-14)),
                "slip at the limit, stick below it"
            );
        }
    }
}

#[test]
fn limits_are_full_stick_and_full_sliding() {
    let case = cattaneo_mindlin();
    let a = case.hertz().contact_radius();
    assert_eq!(case.stick_radius(0.0), a);
    assert_eq!(case.stick_radius(1.5 * case.sliding_force()), 0.0);
    assert_eq!(case.displacement(0.0), 0.0);
    assert_eq!(
        case.displacement(case.sliding_force()),
        case.sliding_displacement()
    );
    let small = 1e-6 * case.sliding_force();
    // The relative truncation error of the linear term is T/6µN.
    assert!((case.displacement(small) * case.tangential_stiffness() / small - 1.0).abs() < 1e-6);
    for share in FORCES {
        let force = share * case.sliding_force();
        assert!((case.force(case.displacement(force)) / force - 1.0).abs() < 1e-12);
    }
}

/// Displacement of both bodies by Cerruti's integral, in polar coordinates about the field point.
fn cerruti(
    case: &fretwear::reference::CattaneoMindlin,
    peak: f64,
    radius: f64,
    x: f64,
    y: f64,
) -> f64 {
    let (isotropic, directional) = (
        1.0 / elastic::tangential_modulus(&case.pair),
        elastic::directional_compliance(&case.pair),
    );
    let (r, bearing) = (x.hypot(y), y.atan2(x));
    let chord = |theta: f64| {
        let discriminant = radius * radius - (r * (theta - bearing).sin()).powi(2);
        if discriminant <= 0.0 {
            return 0.0;
        }
        let (half, middle) = (discriminant.sqrt(), -r * (theta - bearing).cos());
        if middle + half <= 0.0 {
            return 0.0;
        }
        // The traction on the chord is peak/radius·√(half² − (t − middle)²).
        let from = (-middle / half).max(-1.0).asin();
        let primitive = |phi: f64| 0.5 * (phi + 0.5 * (2.0 * phi).sin());
        peak / radius * half * half * (primitive(0.5 * PI) - primitive(from))
    };
    // Identity of the kernel: (1 − ν)/ρ + ν cos²θ/ρ = (2 − ν)/2ρ + ν cos 2θ/2ρ.
    let weighted =
        |theta: f64| chord(theta) * 0.5 * (isotropic + directional * (2.0 * theta).cos());
    let total = if r < radius {
        integrate(0.0, 2.0 * PI, 16, weighted)
    } else {
        let limit = (radius / r).asin();
        integrate(-0.5 * PI, 0.5 * PI, 8, |phi| {
            weighted(bearing + PI + limit * phi.sin()) * limit * phi.cos()
        })
    };
    total / (2.0 * PI)
}

#[test]
fn elliptical_traction_displaces_as_cerrutis_integral_says() {
    let case = cattaneo_mindlin();
    let (peak, radius) = (3.0e8, 4.0e-4);
    for share in [0.1, 0.8, 1.1, 1.7, 4.0] {
        for angle in [0.0, 0.7, 0.5 * PI, 2.5] {
            let (x, y) = (
                share * radius * f64::cos(angle),
                share * radius * f64::sin(angle),
            );
            let found = case.elliptical_displacement(peak, radius, x, y);
            let expected = cerruti(&case, peak, radius, x, y);
            assert!(
                (found / expected - 1.0).abs() < QUADRATURE,
                "r = {share} a, θ = {angle}: {found:e}, {expected:e}"
            );
        }
    }
}

#[test]
fn nothing_slips_within_the_stick_circle_and_slip_follows_traction_outside() {
    let case = cattaneo_mindlin();
    let a = case.hertz().contact_radius();
    for share in FORCES {
        let force = share * case.sliding_force();
        let c = case.stick_radius(force);
        for angle in [0.0, 0.9, 0.5 * PI] {
            let point = |r: f64| (r * f64::cos(angle), r * f64::sin(angle));
            let (x, y) = point(0.7 * c);
            let peak = case.friction_coefficient * case.hertz().peak_pressure();
            let elastic = case.elliptical_displacement(peak, a, x, y)
                - case.elliptical_displacement(peak * c / a, c, x, y);
            assert!((elastic / case.displacement(force) - 1.0).abs() < 1e-12);
            let slips: Vec<f64> = [0.2, 0.6, 1.0]
                .iter()
                .map(|t| {
                    let (x, y) = point(c + t * (a - c));
                    case.slip(force, x, y)
                })
                .collect();
            assert!(
                slips[0] > 0.0 && slips.windows(2).all(|s| s[1] > s[0]),
                "{slips:?}"
            );
        }
    }
}

#[test]
fn energy_is_the_area_of_masings_loop() {
    let case = cattaneo_mindlin();
    // Beyond full sliding, each branch has a kink. A panel of the quadrature ends at the kink.
    for share in [0.05, 0.4, 1.0, 1.7] {
        let amplitude = share * case.sliding_displacement();
        let kink = (amplitude - 2.0 * case.sliding_displacement()).max(-amplitude);
        let loading = |u: f64| -case.unloading_force(amplitude, -u);
        let width = |u: f64| loading(u) - case.unloading_force(amplitude, u);
        let ends = [-amplitude, kink, -kink, amplitude];
        let area: f64 = ends
            .windows(2)
            .map(|pair| {
                integrate(pair[0].min(pair[1]), pair[0].max(pair[1]), 16, width)
                    * (pair[1] - pair[0]).signum()
            })
            .sum();
        let found = case.energy_per_cycle(amplitude);
        // Each branch ends with a power of 3/2 at the onset of sliding. The quadrature therefore converges algebraically, to 2e-8 here.
        assert!(
            (found / area - 1.0).abs() < 1e-6,
            "δ = {share} δₛ: {found:e} against {area:e}"
        );
    }
}

#[test]
fn energy_is_the_integral_of_friction_over_slip() {
    let case = cattaneo_mindlin();
    let a = case.hertz().contact_radius();
    for share in [0.05, 0.4, 0.8, 1.0] {
        let force = share * case.sliding_force();
        let local = integrate_annulus(case.stick_radius(force), a, |r, angle| {
            case.energy_density(force, r * angle.cos(), r * angle.sin())
        });
        let found = case.energy_per_cycle_at_force(force);
        assert!(
            (found / local - 1.0).abs() < 1e-8,
            "T = {share} µN: {found:e} against {local:e}"
        );
    }
}

#[test]
fn small_amplitudes_dissipate_with_the_cube_of_the_force() {
    let case = cattaneo_mindlin();
    let force = 1e-3 * case.sliding_force();
    let cube = force.powi(3)
        / (36.0
            * case.hertz().contact_radius()
            * elastic::tangential_modulus(&case.pair)
            * case.sliding_force());
    // The next term has the relative order T/µN. The bracket cancels to the third order and loses digits, too.
    assert!((case.energy_per_cycle_at_force(force) / cube - 1.0).abs() < 2e-3);
}
