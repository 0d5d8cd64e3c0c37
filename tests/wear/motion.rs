use std::f64::consts::{FRAC_PI_2, TAU};

use fretwear::wear::{Channel, Motion};

const TOLERANCE: f64 = 0.01;
const N: f64 = 30e3;

#[test]
fn what_is_straight() {
    let waves = |axes: &[(f64, f64)], load| Motion::harmonic(axes, N, load, 32);
    let series = |values: &[f64]| Motion {
        time: (0..values.len())
            .map(|k| k as f64 / values.len() as f64)
            .collect(),
        drive: vec![Channel::Displacement(values.to_vec())],
        normal_load: vec![1.0; values.len()],
        ..Motion::at_rest(1.0)
    };
    let varying = waves(&[(5e-6, 0.0)], 1e3);
    assert!(!varying.constant_load());
    assert!((varying.mean_load - N).abs() < 1e-9 * N);
    for (what, motion, is_straight) in [
        ("a cosine", waves(&[(5e-6, 0.0)], 0.0), true),
        ("in phase", waves(&[(5e-6, 0.4), (2e-6, 0.4)], 0.0), true),
        (
            "out of phase",
            waves(&[(5e-6, 0.0), (2e-6, FRAC_PI_2)], 0.0),
            false,
        ),
        ("a load that varies", varying, false),
        ("ends about zero", series(&[1.0, 0.0, -1.0, 0.0]), true),
        ("a nonzero mean", series(&[2.0, 1.0, 0.0, 1.0]), false),
        (
            "reversals in between",
            series(&[1.0, 0.0, 0.5, -1.0, 0.0, 0.2]),
            false,
        ),
    ] {
        assert_eq!(motion.straight().is_some(), is_straight, "{what}");
    }
    let straight = waves(&[(5e-6, 0.0)], 0.0).straight().expect("straight");
    assert_eq!((straight.top, straight.bottom), (0, 16));
    assert_eq!(straight.end, vec![5e-6]);
}

/// Samples of a displacement along x and y and of a load, given as functions of the phase in 0..1.
fn sampled(samples: usize, at: impl Fn(f64) -> (f64, f64, f64)) -> Motion {
    let time: Vec<f64> = (0..samples).map(|k| k as f64 / samples as f64).collect();
    let values: Vec<_> = time.iter().map(|t| at(*t)).collect();
    let load: Vec<f64> = values.iter().map(|v| v.2).collect();
    Motion {
        mean_load: mean(&load),
        drive: vec![
            Channel::Displacement(values.iter().map(|v| v.0).collect()),
            Channel::Displacement(values.iter().map(|v| v.1).collect()),
        ],
        normal_load: load,
        time,
        ..Motion::at_rest(N)
    }
}

fn mean(samples: &[f64]) -> f64 {
    samples.iter().sum::<f64>() / samples.len() as f64
}

/// Motions that are equivalent to two reversals, and motions that are not. Each pair lies just within and just beyond the tolerance.
#[test]
fn what_amounts_to_two_reversals() {
    let c = |t: f64| (TAU * t).cos();
    let s = |t: f64| (TAU * t).sin();
    type Cycle<'a> = Box<dyn Fn(f64) -> (f64, f64, f64) + 'a>;
    // Half ranges of the two reversals along x and y; `None` for a motion that is not straight.
    type Case<'a> = (&'static str, Cycle<'a>, Option<(f64, f64)>);
    let cases: Vec<Case> = vec![
        (
            "straight along x",
            Box::new(|t| (c(t), 0.0, N)),
            Some((1.0, 0.0)),
        ),
        (
            "along y",
            Box::new(|t| (0.0, -2.0 * c(t), N)),
            Some((0.0, 2.0)),
        ),
        (
            "oblique",
            Box::new(|t| (3.0 * c(t), -4.0 * c(t), N)),
            Some((3.0, -4.0)),
        ),
        (
            "about an offset",
            Box::new(|t| (7.0 + c(t), -5.0, N)),
            Some((1.0, 0.0)),
        ),
        (
            "begun in between",
            Box::new(|t| (s(t), 0.5 * s(t), N)),
            Some((1.0, 0.5)),
        ),
        (
            "a thin ellipse",
            Box::new(|t| (c(t), 0.009 * s(t), N)),
            Some((1.0, 0.0)),
        ),
        (
            "a thicker ellipse",
            Box::new(|t| (c(t), 0.011 * s(t), N)),
            None,
        ),
        ("a circle", Box::new(|t| (c(t), s(t), N)), None),
        (
            "a load that varies little",
            Box::new(|t| (c(t), 0.0, N * (1.0 + 0.0099 * s(t)))),
            Some((1.0, 0.0)),
        ),
        (
            "a load that varies more",
            Box::new(|t| (c(t), 0.0, N * (1.0 + 0.0101 * s(t)))),
            None,
        ),
        (
            "a ripple without a reversal",
            Box::new(|t| (c(t) + 0.1 * c(3.0 * t), 0.0, N)),
            Some((1.1, 0.0)),
        ),
        // At t = 1/4, the slope of x is -1 + 3·0.5: the motion reverses there, by 0.14.
        (
            "a reversal in between",
            Box::new(|t| (c(t) - 0.5 * c(3.0 * t), 0.0, N)),
            None,
        ),
        (
            "a ripple within the tolerance",
            Box::new(|t| (c(t) + 0.004 * c(50.0 * t), 0.0, N)),
            Some((1.004, 0.0)),
        ),
        (
            "a ripple beyond the tolerance",
            Box::new(|t| (c(t) + 0.02 * c(50.0 * t), 0.0, N)),
            None,
        ),
        ("twice a cycle", Box::new(|t| (c(2.0 * t), 0.0, N)), None),
        ("a bow", Box::new(|t| (c(t), 0.05 * c(2.0 * t), N)), None),
        ("no motion", Box::new(|_| (3.0, -2.0, N)), Some((0.0, 0.0))),
        (
            "no motion, a load that varies",
            Box::new(|t| (0.0, 0.0, N * (1.0 + 0.1 * c(t)))),
            None,
        ),
    ];
    for (name, cycle, expected) in cases {
        let found = sampled(400, &cycle).reversals(TOLERANCE, TOLERANCE);
        let Some((x, y)) = expected else {
            assert!(found.is_none(), "{name}: {found:?}");
            continue;
        };
        let found = found.unwrap_or_else(|| panic!("{name} is not straight"));
        assert_eq!(found.time, [0.0, 0.5], "{name}");
        for (axis, end) in [x, y].into_iter().enumerate() {
            let series = found.drive[axis].values();
            assert_eq!(series[1], -series[0], "{name}");
            // The ends of a thin ellipse differ from its axis by less than its thickness.
            let off = (series[0].abs() - end.abs()).abs();
            assert!(
                off < 1e-12 + 0.01 * f64::from(name.contains("thin")),
                "{name}: {series:?}"
            );
        }
        // Both axes reverse together, and the motion begins at the maximum of the larger half range.
        let [ex, ey] = [0, 1].map(|axis| found.drive[axis].values()[0]);
        assert!(ex * ey * x * y >= 0.0, "{name}: {ex}, {ey}");
        assert!(
            if x.abs() > y.abs() { ex } else { ey } >= 0.0,
            "{name}: {ex}, {ey}"
        );
        for load in &found.normal_load {
            assert!((load / N - 1.0).abs() < 1e-12, "{name}: {load}");
        }
        assert!(found.straight().is_some(), "{name} is not straight");
    }
}

/// The result does not depend on the unit of the motion or on the beginning of the cycle.
#[test]
fn reversals_do_not_depend_on_unit_or_beginning() {
    let cycle = |t: f64| {
        let turn = std::f64::consts::TAU * t;
        (turn.cos() + 0.05 * (2.0 * turn).cos(), 0.3 * turn.cos(), N)
    };
    for ripple in [0.0, 0.004, 0.05] {
        let mut verdicts = Vec::new();
        for (unit, shift) in [(1.0, 0.0), (1e-9, 0.0), (1e-6, 0.31), (1e3, 0.77)] {
            let motion = sampled(360, |t| {
                let (x, y, load) = cycle(t + shift);
                let shiver = ripple * (40.0 * std::f64::consts::TAU * (t + shift)).cos();
                (unit * (x + shiver), unit * y, load)
            });
            verdicts.push(motion.reversals(TOLERANCE, TOLERANCE).is_some());
        }
        assert!(
            verdicts.iter().all(|v| *v == verdicts[0]),
            "ripple {ripple}: {verdicts:?}"
        );
    }
}

#[test]
fn a_joint_without_an_axis_has_no_reversals() {
    assert_eq!(Motion::at_rest(N).reversals(TOLERANCE, TOLERANCE), None);
}

#[test]
fn about_its_middle_and_at_another_load() {
    let motion = sampled(8, |t| (3.0 + (8.0 * t - 2.0).abs(), -1.0, N + 800.0 * t));
    let moved = motion.clone().about_its_middle();
    // x ranges over 3 … 8. The middle is 5.5 and differs from the mean.
    for (now, before) in moved.drive[0].values().iter().zip(motion.drive[0].values()) {
        assert_eq!(*now, before - 5.5);
    }
    assert_eq!(moved.drive[1].values(), &vec![0.0; 8]);
    assert_eq!(
        (&moved.time, &moved.normal_load),
        (&motion.time, &motion.normal_load)
    );
    let loaded = motion.clone().with_mean_load(2e4);
    assert_eq!(loaded.mean_load, 2e4);
    assert!((mean(&loaded.normal_load) - 2e4).abs() < 1e-11 * 2e4);
    for k in 0..8 {
        let (now, before) = (loaded.normal_load[k], motion.normal_load[k]);
        assert!((now - loaded.normal_load[0] - (before - motion.normal_load[0])).abs() < 1e-8);
    }
    assert_eq!((&loaded.time, &loaded.drive), (&motion.time, &motion.drive));
}

#[test]
fn every_so_many_samples() {
    let motion = sampled(12, |t| (t, 2.0 * t, N + t));
    let thin = motion.thinned(4);
    assert_eq!(thin.samples(), 3);
    for k in 0..3 {
        assert_eq!(thin.time_of(k), motion.time_of(4 * k));
        assert_eq!(thin.state_at(k), motion.state_at(4 * k));
        assert_eq!(thin.normal_load[k], motion.normal_load[4 * k]);
    }
    assert_eq!(motion.thinned(1), motion);
}

/// The solver also computes the cycle from every other sample. The thinned motion is a complete motion with the same ends.
#[test]
fn every_other_sample_is_half_the_motion() {
    for phase in [0.0, 0.9] {
        let motion = Motion::harmonic(&[(5e-6, phase)], 30e3, 0.0, 32);
        let half = motion.thinned(2);
        let ends = half.straight().expect("straight");
        assert_eq!(ends.end, motion.straight().expect("straight").end);
        assert_eq!(half.samples(), if phase == 0.0 { 16 } else { 18 });
        assert!(motion.time.windows(2).all(|pair| pair[0] < pair[1]));
    }
}

#[test]
fn a_halved_motion_passes_its_samples_and_their_middles() {
    let motion = sampled(5, |t| (t, 1.0 - t, 100.0 * t));
    let halved = motion.with_midpoints();
    assert_eq!(halved.thinned(2), motion);
    let middles = [0.1, 0.3, 0.5, 0.7, 0.9];
    for (k, middle) in middles.into_iter().enumerate() {
        assert!((halved.time[2 * k + 1] - middle).abs() < 1e-15);
        // The last midpoint lies between the last and the first sample.
        let along = if k == 4 { 0.4 } else { middle };
        assert!((halved.state_at(2 * k + 1)[0] - along).abs() < 1e-15);
    }
}

/// The cosine of the turn of a motion at its samples does not depend on the size of the channels.
#[test]
fn a_motion_goes_ahead_along_a_line_and_bends_on_an_orbit() {
    let along =
        |phases: [f64; 2]| Motion::harmonic(&[(5e-6, phases[0]), (5e-6, phases[1])], 30e3, 3e3, 32);
    // A line continues straight between its ends, also without passing zero. At the ends, a line reverses.
    let line = sampled(32, |t| {
        let reach = (TAU * t).cos();
        (1.0 + reach, 2.0 - 3.0 * reach, 1.0)
    });
    for k in 0..32 {
        let expected = if k % 16 == 0 { -1.0 } else { 1.0 };
        assert!(
            (line.turn_cosine(k, 1) - expected).abs() < 1e-9,
            "sample {k}"
        );
    }
    // A circle turns by the angle of its steps.
    for stride in [1, 2] {
        let bend = (TAU * stride as f64 / 32.0).cos();
        let circle = along([0.4, 0.4 - FRAC_PI_2]);
        for k in (0..32).step_by(stride) {
            assert!(
                (circle.turn_cosine(k, stride) - bend).abs() < 1e-9,
                "sample {k}"
            );
        }
    }
    // Each channel is scaled by its range. A force in place of a displacement gives the same circle.
    let mut mixed = along([0.4, 0.4 - FRAC_PI_2]);
    let force: Vec<f64> = mixed.drive[1].values().iter().map(|v| 1e9 * v).collect();
    mixed.drive[1] = Channel::Force(force);
    assert!((mixed.turn_cosine(5, 1) - (TAU / 32.0).cos()).abs() < 1e-9);
    assert_eq!(Motion::at_rest(30e3).turn_cosine(0, 1), 0.0);
}

/// The program computes half of a cycle if the other half is its opposite.
#[test]
fn the_second_half_of_an_orbit_is_the_first_with_all_signs_turned() {
    let orbit = |load_amplitude: f64, samples: usize| {
        Motion::harmonic(&[(5e-6, 0.4), (2e-6, -0.9)], 30e3, load_amplitude, samples)
    };
    assert!(orbit(0.0, 32).is_antiperiodic(1) && orbit(0.0, 32).is_antiperiodic(2));
    assert!(!orbit(3e3, 32).is_antiperiodic(1), "the load varies");
    assert!(
        !orbit(0.0, 34).is_antiperiodic(2),
        "no sample is half a cycle later"
    );
    let shifted = sampled(8, |t| ((TAU * t).cos() + 0.1, (TAU * t).sin(), 1.0));
    assert!(!shifted.is_antiperiodic(1));
    let doubled = sampled(8, |t| ((TAU * t).cos(), (2.0 * TAU * t).sin(), 1.0));
    assert!(!doubled.is_antiperiodic(1));
}
