//! Checks of every contact law: derivative against differences, closed cycle, dissipation, symmetry, limits.

use fretwear::dynamics::{
    ContactElement, ElementState, FrictionLaw, Harmonics, InterfaceElement, Sampling,
};
use fretwear::reference::Jenkins;

use super::bank::bank;
use super::spring::stop;
use super::{BOTH, changed, cubic, element};

/// Coefficients (H 0–3) of an orbital motion with varying normal displacement; `size` scales it to the slip limit.
pub fn motion(size: f64) -> Vec<f64> {
    let x = [0.3, 2.0, -0.4, 0.3, 0.2, -0.1, 0.25];
    let y = [-0.2, 0.5, 1.4, -0.2, 0.1, 0.15, -0.3];
    let n = [0.1, 0.6, -0.5, 0.2, 0.3, 0.1, 0.05];
    [x, y, n].concat().iter().map(|v| v * size).collect()
}

fn check_derivative(element: &ContactElement, at: &[f64], what: &str) {
    let sampling = Sampling::new(Harmonics::up_to(3), 48).expect("enough samples");
    let mut work = sampling.workspace();
    let mut force = vec![0.0; 21];
    let mut jacobian = vec![0.0; 21 * 21];
    sampling.evaluate(element, at, &mut force, Some(&mut jacobian), &mut work);
    let largest = jacobian.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let scale = at.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let step = 1e-6 * scale;
    for column in 0..21 {
        let mut shifted = |sign: f64| {
            let mut there = at.to_vec();
            there[column] += sign * step;
            let mut out = vec![0.0; 21];
            sampling.evaluate(element, &there, &mut out, None, &mut work);
            out
        };
        let (above, below) = (shifted(1.0), shifted(-1.0));
        for row in 0..21 {
            let difference = (above[row] - below[row]) / (2.0 * step);
            let exact = jacobian[row * 21 + column];
            assert!(
                (difference - exact).abs() < 1e-6 * largest,
                "{what}: entry ({row}, {column}) {exact} against {difference}"
            );
        }
    }
}

#[test]
fn jacobian_is_that_of_the_samples() {
    // The sizes cover sticking, partial slip, mostly sliding and lift-off; sliders of a bank open one after the other.
    let sizes = [2e-8, 2e-7, 1e-6, 1.5e-6, 2e-6, 2.3e-6, 6e-6];
    for law in BOTH {
        let loaded = element(law);
        let open = changed(&loaded, |slider| {
            (slider.normal_load, slider.gap) = (0.0, 4e-7);
        });
        let unloaded = changed(&loaded, |slider| slider.normal_load = 0.0);
        let full = bank(&loaded, 8);
        let mut gaps = full.clone();
        for slider in &mut gaps.sliders[5..] {
            (slider.normal_load, slider.gap) = (0.0, 3e-7);
        }
        let beside_springs = ContactElement {
            springs: vec![cubic(0, 2e15), cubic(2, -1e15), stop(1, 4e5, 2e-6)],
            ..loaded.clone()
        };
        // Elements without load have no force under a small motion.
        let large = &sizes[4..];
        for (what, element, sizes) in [
            ("loaded", &loaded, &sizes[..]),
            ("with a gap", &open, large),
            ("without load", &unloaded, large),
            ("a bank", &full, &sizes),
            ("a bank with gaps", &gaps, &sizes),
            ("beside springs", &beside_springs, &sizes),
        ] {
            for &size in sizes {
                check_derivative(
                    element,
                    &motion(size),
                    &format!("{what}, {law:?} at {size}"),
                );
            }
        }
    }
}

#[test]
fn forces_stay_inside_the_law_and_dissipate() {
    let sampling = Sampling::new(Harmonics::up_to(3), 96).expect("enough samples");
    for law in BOTH {
        let element = element(law);
        for (size, state) in [
            (2e-7, ElementState::Stick),
            (1.5e-6, ElementState::Slip),
            (6e-6, ElementState::Open),
        ] {
            let cycle = element.cycle(&sampling.synthesise(&motion(size)));
            assert_eq!(cycle.state, state, "{law:?} at {size}");
            assert!(cycle.closure.change <= 1e-13, "{:?}", cycle.closure);
            for [x, y, n] in &cycle.force {
                let limit = 0.6 * n * (1.0 + 1e-12);
                match law {
                    FrictionLaw::Cone => assert!(x.hypot(*y) <= limit),
                    FrictionLaw::Box => assert!(x.abs() <= limit && y.abs() <= limit),
                }
                assert!(*n >= 0.0);
            }
            let slips = state > ElementState::Stick;
            assert_eq!(
                cycle.dissipated_energy > 0.0,
                slips,
                "{}",
                cycle.dissipated_energy
            );
            assert_eq!(cycle.slip_path > 0.0, slips);
        }
    }
}

#[test]
fn straight_motion_is_the_jenkins_loop() {
    let jenkins = Jenkins {
        stiffness: 2.5e7,
        limit: 54.0,
    };
    let harmonics = Harmonics::up_to(7);
    let sampling = Sampling::new(harmonics.clone(), 4096).expect("enough samples");
    for law in BOTH {
        for axis in [0, 1] {
            for amplitude in [1e-6, 2.5e-6, 9e-6, 4e-4] {
                let n = harmonics.coefficients();
                let mut motion = vec![0.0; 3 * n];
                motion[axis * n + 1] = amplitude;
                let displacement = sampling.synthesise(&motion);
                let cycle = element(law).cycle(&displacement);
                for (j, force) in cycle.force.iter().enumerate() {
                    let theta = 2.0 * std::f64::consts::PI * j as f64 / 4096.0;
                    let expected = jenkins.force(amplitude, theta);
                    assert!(
                        (force[axis] - expected).abs() < 1e-9,
                        "{} {expected}",
                        force[axis]
                    );
                }
                let energy = jenkins.dissipated_energy(amplitude);
                assert!((cycle.dissipated_energy - energy).abs() <= 1e-12 + 1e-9 * energy);
                // The tolerance is the quadrature error of 4096 samples of a kinked function.
                let force = sampling.analyse(&cycle.force);
                for order in 1..=7 {
                    let (a, b) = jenkins.coefficients(amplitude, order);
                    let slot = axis * n + 2 * order as usize - 1;
                    for (found, expected) in [(force[slot], a), (force[slot + 1], b)] {
                        assert!(
                            (found - expected).abs() < 2e-5 * 54.0,
                            "{order}: {found} {expected}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn cone_is_isotropic_and_box_is_not() {
    let sampling = Sampling::new(Harmonics::up_to(3), 64).expect("enough samples");
    let displacement = sampling.synthesise(&motion(1.8e-6));
    let (sin, cos) = 0.7_f64.sin_cos();
    let turned: Vec<[f64; 3]> = displacement
        .iter()
        .map(|[x, y, n]| [cos * x - sin * y, sin * x + cos * y, *n])
        .collect();
    let difference = |law| {
        let (plain, turned) = (
            element(law).cycle(&displacement),
            element(law).cycle(&turned),
        );
        let pairs = plain.force.iter().zip(&turned.force);
        pairs.fold(0.0_f64, |worst, (p, t)| {
            worst.max((cos * p[0] - sin * p[1] - t[0]).hypot(sin * p[0] + cos * p[1] - t[1]))
        })
    };
    assert!(
        difference(FrictionLaw::Cone) < 1e-11,
        "{}",
        difference(FrictionLaw::Cone)
    );
    assert!(
        difference(FrictionLaw::Box) > 1.0,
        "{}",
        difference(FrictionLaw::Box)
    );
}

#[test]
fn opposite_motion_has_opposite_friction() {
    let sampling = Sampling::new(Harmonics::up_to(3), 64).expect("enough samples");
    let displacement = sampling.synthesise(&motion(1.8e-6));
    let mirrored: Vec<[f64; 3]> = displacement.iter().map(|[x, y, n]| [-x, -y, *n]).collect();
    for law in BOTH {
        let (a, b) = (
            element(law).cycle(&displacement),
            element(law).cycle(&mirrored),
        );
        for (a, b) in a.force.iter().zip(&b.force) {
            assert!((a[0] + b[0]).abs().max((a[1] + b[1]).abs()) < 1e-12 && a[2] == b[2]);
        }
    }
}

#[test]
fn a_stuck_mean_is_that_of_the_way_from_the_preload() {
    // The element never slips, so force and displacement are proportional, including their means.
    let sampling = Sampling::new(Harmonics::up_to(2), 32).expect("enough samples");
    let mut motion = vec![0.0; 15];
    (motion[0], motion[1]) = (5e-7, 6e-7);
    let force = sampling.analyse(
        &element(FrictionLaw::Cone)
            .cycle(&sampling.synthesise(&motion))
            .force,
    );
    assert!((force[0] - 2.5e7 * 5e-7).abs() < 1e-9 && (force[1] - 2.5e7 * 6e-7).abs() < 1e-9);
    // The force exceeds its limit of 54 N before the first sample. From this sample on the cycle sticks, with its largest force at the
    // limit.
    motion[0] = 8e-6;
    motion[1] = 1e-6;
    let force = sampling.analyse(
        &element(FrictionLaw::Cone)
            .cycle(&sampling.synthesise(&motion))
            .force,
    );
    assert!((force[0] - (54.0 - 25.0)).abs() < 1e-9, "{}", force[0]);
}

#[test]
fn parameters_out_of_range_are_named() {
    let right = element(FrictionLaw::Cone);
    let wrong = [
        (
            ContactElement {
                springs: Vec::new(),
                friction_coefficient: -0.1,
                ..right.clone()
            },
            "the friction coefficient",
        ),
        (
            ContactElement {
                springs: Vec::new(),
                sliders: Vec::new(),
                ..right.clone()
            },
            "the number of sliders",
        ),
        (
            changed(&right, |slider| slider.normal_load = f64::NAN),
            "the normal load",
        ),
        (
            changed(&right, |slider| slider.normal_stiffness = f64::INFINITY),
            "the normal stiffness",
        ),
        (changed(&right, |slider| slider.gap = 1e-6), "the gap"),
    ];
    for (element, name) in wrong {
        let message = element.check(17).expect_err("wrong").to_string();
        assert!(
            message.contains(name) && message.contains("element 17"),
            "{message}"
        );
    }
}

/// A constant force acts across a motion whose reach equals the friction limit to a few parts in a million, and the drift per cycle
/// decreases. A slider comes to rest where both ends of the motion are at its limit, or it slips a little in every cycle.
#[test]
fn a_motion_as_wide_as_friction_has_its_steady_cycle() {
    // Tolerance against a closed form of the samples, and the number of cycles within which a robust iteration converges.
    const EXACT: f64 = 1e-9;
    const FEW: usize = 80;
    let samples = 512;
    let loaded = element(FrictionLaw::Cone);
    let slider = &loaded.sliders[0];
    let limit = loaded.friction_coefficient * slider.normal_load;
    let reach = limit / slider.tangential_stiffness;
    let cycle = |beyond: f64, across: f64| {
        let motion: Vec<[f64; 3]> = (0..samples)
            .map(|j| {
                let (sin, cos) = (std::f64::consts::TAU * j as f64 / samples as f64).sin_cos();
                let along = reach * (1.0 + beyond) * cos;
                [along, reach * (2.0 + across * sin), 0.0]
            })
            .collect();
        loaded.cycle(&motion)
    };
    let within = -3e-6_f64;
    let rest = cycle(within, 0.05);
    assert!(rest.closure.change <= 1e-12, "{:?}", rest.closure);
    assert!(rest.closure.cycles <= FEW, "{:?}", rest.closure);
    // The force lies on the limit circles of both ends: x is ± the reach of the motion, and y is the remainder of the limit.
    let left = limit * (1.0 - (1.0 + within).powi(2)).sqrt();
    for (j, sign) in [(0, 1.0), (samples / 2, -1.0)] {
        let [x, y, _] = rest.force[j];
        let along = sign * limit * (1.0 + within);
        assert!((x - along).abs() <= EXACT * limit, "{x} against {along}");
        assert!((y - left).abs() <= 1e-6 * limit, "{y} against {left}");
    }
    for beyond in [1e-7, 1e-5, 1e-3] {
        let slips = cycle(beyond, 0.05);
        assert!(
            slips.closure.change <= 1e-12,
            "{beyond}: {:?}",
            slips.closure
        );
        assert!(slips.closure.cycles <= FEW, "{beyond}: {:?}", slips.closure);
        assert!(
            slips.dissipated_energy > 0.0,
            "{beyond}: {}",
            slips.dissipated_energy
        );
    }
}
