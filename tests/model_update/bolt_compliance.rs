//! Tests of the compliances of bolts and clamped parts against examples worked by hand from the standard.

use fretwear::model_update::{BoltHead, BoltedJoint, Clamping, metric_thread};

/// Joint of a metric bolt; lengths in mm, moduli in GPa.
fn joint(size: &str, [clamp, shank]: [f64; 2], [bearing, hole, outer]: [f64; 3]) -> BoltedJoint {
    let [diameter, core_diameter] = metric_thread(size).expect("a thread");
    BoltedJoint {
        diameter,
        core_diameter,
        clamp_length: 1e-3 * clamp,
        shank_length: 1e-3 * shank,
        bearing_diameter: 1e-3 * bearing,
        hole_diameter: 1e-3 * hole,
        outer_diameter: 1e-3 * outer,
        bolt_modulus: 205e9,
        plate_modulus: 198.4e9,
        head: BoltHead::Hexagon,
        clamping: Clamping::Through,
    }
}

/// Both compliances, worked by hand \[mm/N\].
fn assert_worked(joint: BoltedJoint, bolt: f64, plates: f64) {
    let found = [joint.bolt(), joint.plates().expect("it fits")];
    for (found, worked) in found.into_iter().zip([bolt, plates]) {
        let found = 1e3 * found;
        assert!(
            (found / worked - 1.0).abs() < 1e-5,
            "{found:e}, by hand {worked:e}: {joint:?}"
        );
    }
}

#[test]
fn examples_by_hand_are_met() {
    // The examples are a cone without a sleeve, a cone with a sleeve, a tapped part, and a sleeve without a cone.
    assert_worked(
        joint("M10", [20.0, 8.0], [14.6, 11.0, 60.0]),
        2.64169e-6,
        5.43971e-7,
    );
    let cylinder = BoltedJoint {
        head: BoltHead::Cylinder,
        ..joint("M12x1.5", [65.0, 40.0], [17.2, 13.5, 30.0])
    };
    assert_worked(cylinder, 4.00465e-6, 9.19308e-7);
    let tapped = BoltedJoint {
        head: BoltHead::Cylinder,
        clamping: Clamping::Tapped,
        plate_modulus: 70e9,
        ..joint("M8", [24.0, 0.0], [12.3, 9.0, 25.0])
    };
    assert_worked(tapped, 5.21983e-6, 1.50959e-6);
    assert_worked(
        joint("M16", [80.0, 30.0], [24.0, 17.5, 22.0]),
        3.04032e-6,
        2.88834e-6,
    );
}

/// M12 bolt of a hydraulic cylinder, as taught at Hochschule Anhalt: the clamped parts have a compliance of 0.3546e-6 mm/N. The bolt, with
/// a nut of 0.33 d, has 2.95e-6 mm/N.
#[test]
fn a_published_example_is_met() {
    let joint = BoltedJoint {
        bolt_modulus: 210e9,
        plate_modulus: 210e9,
        head: BoltHead::Cylinder,
        ..joint("M12", [42.0, 20.5], [21.11, 13.5, 80.0])
    };
    let plates = 1e3 * joint.plates().expect("it fits");
    assert!((plates / 0.3546e-6 - 1.0).abs() < 1e-3, "{plates:e}");
    let nut = 0.07 * 12.0 / (std::f64::consts::PI * 36.0 * 210e3);
    let bolt = 1e3 * joint.bolt() - nut;
    assert!((bolt / 2.95e-6 - 1.0).abs() < 1e-3, "{bolt:e}");
}

#[test]
fn where_the_cones_meet_the_sleeve_nothing_jumps() {
    for clamping in [Clamping::Through, Clamping::Tapped] {
        let of = |outer: f64| {
            let joint = joint("M10", [40.0, 10.0], [14.6, 11.0, outer]);
            BoltedJoint { clamping, ..joint }.plates().expect("it fits")
        };
        let mut last = of(14.0);
        for step in 1..400 {
            let next = of(14.0 + 0.2 * f64::from(step));
            // The cone of the standard begins steeper than its sleeve ends; from this point on, a wider part is never softer.
            assert!(
                next < 1.001 * last && next > 0.9 * last,
                "at {step}: {last:e}, {next:e}"
            );
            last = next;
        }
    }
}

#[test]
fn lengths_that_do_not_fit_are_named() {
    let fits = joint("M10", [40.0, 20.0], [14.6, 11.0, 40.0]);
    let cases = [
        (
            BoltedJoint {
                hole_diameter: 9e-3,
                ..fits
            },
            "hole is 9e-3; it must be at least as wide as the bolt",
        ),
        (
            BoltedJoint {
                bearing_diameter: 11e-3,
                ..fits
            },
            "bearing_diameter is 1.1e-2; it must be wider than the hole",
        ),
        (
            BoltedJoint {
                outer_diameter: 10e-3,
                ..fits
            },
            "outer_diameter is 1e-2; it must be wider than the hole",
        ),
        (
            BoltedJoint {
                shank_length: 41e-3,
                ..fits
            },
            "shank_length is 4.1e-2; it must be 0 to clamp_length",
        ),
        (
            BoltedJoint {
                core_diameter: 10e-3,
                ..fits
            },
            "core_diameter is 1e-2; it must be less than the diameter",
        ),
    ];
    for (joint, says) in cases {
        assert_eq!(joint.plates().expect_err(says).to_string(), says);
    }
}

#[test]
fn threads_are_read_as_they_are_written() {
    let core = |size: &str| metric_thread(size).map(|[_, core]| 1e3 * core);
    let near = |found: Option<f64>, core: f64| {
        assert!((found.expect("a thread") - core).abs() < 1e-3, "{found:?}");
    };
    // d3 from the tables of the standard.
    near(core("M10"), 8.160);
    near(core("m10 x 1.25"), 8.466);
    near(core("M6"), 4.773);
    near(core("M24\u{d7}2"), 21.546);
    for wrong in ["10", "M11", "M", "M10x", "M10x0", "M10x9", "3/8-16 UNC"] {
        assert_eq!(metric_thread(wrong), None, "{wrong}");
    }
}
