use std::f64::consts::PI;

use fretwear::reference::CappedHertz;

use super::hertz;

fn capped(cap: f64) -> CappedHertz {
    let hertz = hertz();
    CappedHertz {
        radius: hertz.radius,
        load: hertz.load,
        effective_modulus: hertz.effective_modulus,
        cap,
    }
}

#[test]
fn without_a_cap_it_is_hertz() {
    let hertz = hertz();
    for (rings, tolerance) in [(100, 1e-4), (400, 1e-4 / 8.0)] {
        // The error has an order between 1 and 2 in the width of a ring (measured 1.9). Four times as many rings divide the error by more
        // than 8.
        let found = capped(f64::INFINITY).solve(rings).unwrap();
        let a = hertz.contact_radius();
        assert_eq!(found.plateau_radius, 0.0);
        assert!((found.approach / hertz.approach() - 1.0).abs() < tolerance);
        assert!((found.pressure_at(0.0) / hertz.peak_pressure() - 1.0).abs() < tolerance);
        assert!((found.pressure_at(0.6 * a) / hertz.pressure(0.6 * a) - 1.0).abs() < tolerance);
        assert!(
            (found.contact_radius / a - 1.0).abs() < 1e-4,
            "{}",
            found.contact_radius / a
        );
        assert!((found.load() / hertz.load - 1.0).abs() < 1e-12);
    }
}

#[test]
fn a_cap_above_the_peak_changes_nothing() {
    let peak = hertz().peak_pressure();
    assert_eq!(
        capped(1.01 * peak).solve(150).unwrap(),
        capped(f64::INFINITY).solve(150).unwrap()
    );
}

#[test]
fn a_lower_cap_widens_plateau_and_contact() {
    let hertz = hertz();
    let mut last = (hertz.contact_radius(), 0.0, hertz.approach());
    for share in [0.95, 0.8, 0.6, 0.4] {
        let cap = share * hertz.peak_pressure();
        let found = capped(cap).solve(300).unwrap();
        let (a, b) = (found.contact_radius, found.plateau_radius);
        assert!((found.load() / hertz.load - 1.0).abs() < 1e-12);
        assert_eq!(found.pressure.iter().copied().fold(0.0, f64::max), cap);
        assert!(found.pressure.iter().all(|&p| p >= 0.0));
        assert!(
            a > last.0 && b > last.1 && found.approach > last.2,
            "{share}"
        );
        // The cap over the plateau carries less than the load. The cap over the whole contact carries more. Both edges are uncertain by two
        // rings.
        let doubt = 2.0 * found.width;
        assert!(
            cap * PI * (b - doubt).powi(2) < hertz.load
                && cap * PI * (a + doubt).powi(2) > hertz.load
        );
        last = (a, b, found.approach);
    }
}

#[test]
fn rings_converge_under_a_cap() {
    let hertz = hertz();
    for share in [0.95, 0.6] {
        let case = capped(share * hertz.peak_pressure());
        let (coarse, fine) = (case.solve(200).unwrap(), case.solve(600).unwrap());
        let close = |found: f64, expected: f64, tolerance: f64| {
            assert!(
                (found / expected - 1.0).abs() < tolerance,
                "{share}: {found:e}, {expected:e}"
            );
        };
        close(coarse.approach, fine.approach, 1e-5);
        // The position of an edge is exact to one ring, 0.6 % of the radius. The elastic annulus is thin at a share of 0.6 and has few
        // rings.
        close(coarse.contact_radius, fine.contact_radius, 3e-3);
        close(coarse.plateau_radius, fine.plateau_radius, 1e-2);
    }
}
