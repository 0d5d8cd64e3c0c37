//! Sampled cycles of one cell (a spring and a slider) against a closed form and against a computation with many steps.

use std::f64::consts::{FRAC_PI_2, TAU};

use fretwear::contact::{Boundary, Elastic, HalfSpace, Pair};
use fretwear::grid::{Grid, Patch};
use fretwear::wear::cycle::{CycleSolution, March};
use fretwear::wear::{Channel, FrettingJoint, Motion};

use super::{EXACT, FRICTION, LOAD, joint, unworn};
use crate::contact::STEEL;

/// Numbers of samples, doubled each time.
const SAMPLES: [usize; 3] = [32, 64, 128];
/// Ratio of the first-order error without extrapolation to [`BALANCED`]. The ratio separates both errors clearly.
const FIRST_ORDER: f64 = 5.0;
/// Ratio of the error from closing a cycle to the cycle tolerance.
const CLOSING: f64 = 10.0;
/// Largest ratio of errors per doubling of the samples: an error of second order falls to 1/4, an error of first order to 1/2.
const SECOND_ORDER: f64 = 0.35;
/// Largest relative error of the energy with 64 samples, the number of the preset `balanced`.
const BALANCED: f64 = 3e-3;
/// Amplitude over the displacement at which the cell slides.
const REACH: f64 = 1.7;

/// One square cell of a flat joint. With a Poisson ratio of 0, the compliances along x and y are equal.
fn one_cell(motion: Motion, extrapolate: bool) -> FrettingJoint {
    let grid = Grid::over([2e-3, 1e-3], [4, 3]);
    let mut patch = Patch::full(grid);
    let only = grid.index(1, 1);
    for c in 0..grid.len() {
        patch.is_in_joint[c] = c == only;
    }
    let mut joint = joint(motion, March::Stepped);
    let body = Elastic {
        poisson_ratio: 0.0,
        ..STEEL
    };
    joint.half_space = HalfSpace::new(grid, Pair::same(body), Boundary::Free);
    joint.height = vec![0.0; grid.len()];
    joint.patch = patch;
    joint.options.extrapolate = extrapolate;
    joint
}

/// Displacement at which the cell slides under the mean load \[m\], from the compliance under a force far below the limit.
fn onset() -> f64 {
    let small = 1e-3 * FRICTION * LOAD;
    let grid = Grid::over([2e-3, 1e-3], [4, 3]);
    let mut joint = one_cell(Motion::harmonic(&[(0.0, 0.0)], LOAD, 0.0, 4), false);
    let mut shear = vec![0.0; grid.len()];
    shear[grid.index(1, 1)] = small / grid.cell_area();
    let mut field = vec![0.0; grid.len()];
    joint.half_space.shear_x(&shear, &mut field);
    field[grid.index(1, 1)] / small * FRICTION * LOAD
}

fn cycle(motion: Motion, extrapolate: bool) -> CycleSolution {
    unworn(&mut one_cell(motion, extrapolate)).cycle
}

/// For each number of samples: the error of the energy relative to `exact`, and the estimated error of the cycle.
fn errors(motion: impl Fn(usize) -> Motion, extrapolate: bool, exact: f64) -> Vec<[f64; 2]> {
    SAMPLES
        .iter()
        .map(|&samples| {
            let cycle = cycle(motion(samples), extrapolate);
            [
                (cycle.dissipation / exact - 1.0).abs(),
                cycle.relative_error(),
            ]
        })
        .collect()
}

/// A spring pulls a slider around a circle of radius A. The spring deflects by ρ under µN along the slip, so the slip has the radius √(A² −
/// ρ²).
#[test]
fn a_circle_has_its_closed_form() {
    let onset = onset();
    let reach = REACH * onset;
    let exact = TAU * FRICTION * LOAD * (reach * reach - onset * onset).sqrt();
    let circle =
        |samples| Motion::harmonic(&[(reach, 0.0), (reach, -FRAC_PI_2)], LOAD, 0.0, samples);
    let plain = errors(circle, false, exact);
    assert!(
        plain[1][0] > FIRST_ORDER * BALANCED,
        "first order: {plain:?}"
    );
    let extrapolated = errors(circle, true, exact);
    for pair in extrapolated.windows(2) {
        let ratio = pair[1][0] / pair[0][0];
        assert!(ratio < SECOND_ORDER, "energies {extrapolated:?}");
    }
    assert!(extrapolated[1][0] < BALANCED, "energies {extrapolated:?}");
    for [error, estimate] in extrapolated {
        assert!(error <= estimate, "error {error:e}, estimated {estimate:e}");
    }
}

/// Spring and slider under a load that varies a quarter of a cycle after the motion, with steps of a millionth of a cycle. With the limit
/// at the end of each step instead of the mean limit, the error at 64 samples is 0.5 %.
#[test]
fn a_load_that_varies_is_that_of_many_steps() {
    const STEPS: usize = 1_000_000;
    let onset = onset();
    let (reach, varies) = (REACH * onset, 0.4 * LOAD);
    let stiffness = FRICTION * LOAD / onset;
    let (mut force, mut energy) = (0.0f64, 0.0);
    for _ in 0..3 {
        energy = 0.0;
        for k in 0..STEPS {
            let phase = |k: usize| TAU * k as f64 / STEPS as f64;
            let at = |k: usize| reach * (phase(k) + FRAC_PI_2).cos();
            let limit = FRICTION * (LOAD + varies * phase(k + 1).cos());
            let trial = force + stiffness * (at(k + 1) - at(k));
            force = trial.clamp(-limit, limit);
            energy += (trial - force) / stiffness * force;
        }
    }
    let motion = |samples| Motion::harmonic(&[(reach, FRAC_PI_2)], LOAD, varies, samples);
    let errors = errors(motion, true, energy);
    assert!(errors[1][0] < BALANCED, "errors {errors:?}");
    for [error, said] in errors {
        assert!(error <= said, "error {error:e}, estimated {said:e}");
    }
}

/// A straight motion under constant load needs no extrapolation, because its slip does not change direction.
#[test]
fn a_straight_motion_is_left_as_it_is() {
    let straight = Motion::harmonic(&[(3e-6, 0.4)], LOAD, 0.0, 16);
    let mut of_samples = joint(straight.clone(), March::Stepped);
    let extrapolated = unworn(&mut of_samples).cycle;
    of_samples.options.extrapolate = false;
    let plain = unworn(&mut of_samples).cycle;
    let by_reversal = unworn(&mut joint(straight, March::Reversal)).cycle;
    for cycle in [extrapolated, plain] {
        let off = (cycle.dissipation / by_reversal.dissipation - 1.0).abs();
        assert!(off < CLOSING * EXACT.cycle_tolerance, "off by {off:e}");
    }
}

/// An odd number of samples cannot be halved. The solver computes the cycle once, with steps of second order.
#[test]
fn an_odd_number_of_samples_is_marched_once() {
    const ODD: usize = 15;
    const SECOND: f64 = 0.03;
    let onset = onset();
    let reach = 3.0 * onset;
    let series = |of: &dyn Fn(f64) -> f64| (0..ODD).map(|k| of(k as f64 / ODD as f64)).collect();
    let motion = Motion {
        time: series(&|t| t),
        drive: vec![
            Channel::Displacement(series(&|t| reach * (TAU * t).cos())),
            Channel::Displacement(series(&|t| reach * (TAU * t).sin())),
        ],
        normal_load: vec![LOAD; ODD],
        ..Motion::at_rest(LOAD)
    };
    let exact = TAU * FRICTION * LOAD * (reach * reach - onset * onset).sqrt();
    let [second, first] = [true, false].map(|order| cycle(motion.clone(), order));
    let [second_off, first_off] = [&second, &first].map(|c| (c.dissipation / exact - 1.0).abs());
    assert!(
        second_off < SECOND && second_off < 0.5 * first_off,
        "{second_off:e}, {first_off:e}"
    );
    assert_eq!(second.instants.len(), ODD + 1);
}

/// At a gap of 1e-6, the shear varies by more than the requested 1e-5. The cycle closes by its energy and reports the remaining error.
#[test]
fn a_shear_that_only_trembles_closes_by_energy() {
    const ASKED: f64 = 1e-5;
    let circle = Motion::harmonic(&[(3e-6, 0.0), (2e-6, -FRAC_PI_2)], LOAD, 0.0, 128);
    let cycle = |cycle_tolerance: f64, gap: f64| {
        let mut joint = joint(circle.clone(), March::Stepped);
        joint.options.cycle_tolerance = cycle_tolerance;
        joint.options.tangential.tolerance = gap;
        unworn(&mut joint).cycle
    };
    let trembling = cycle(ASKED, 1e-6);
    let exact = cycle(ASKED, 1e-10);
    let off = (trembling.dissipation - exact.dissipation).abs();
    assert!(off <= trembling.dissipation_error, "off by {off:e} J");
}

/// For each number of samples: the error of the dissipated energy of a rough joint relative to [`MANY`] samples, and the estimated error.
fn errors_of_rough_joint(motion: impl Fn(usize) -> Motion) -> Vec<[f64; 2]> {
    let cycle = |samples: usize| {
        let mut joint = joint(motion(samples), March::Stepped);
        joint.options.cycle_tolerance = SETTLED;
        joint.options.tangential.tolerance = SETTLED;
        unworn(&mut joint).cycle
    };
    let exact = cycle(MANY).dissipation;
    let error = |cycle: CycleSolution| {
        [
            (cycle.dissipation / exact - 1.0).abs(),
            cycle.relative_error(),
        ]
    };
    SAMPLES.map(|samples| error(cycle(samples))).into()
}

/// Number of samples of the reference solution.
const MANY: usize = 512;
/// Closure and gap of the rough joint. Both errors are far below the error of 32 samples.
const SETTLED: f64 = 1e-5;
/// Largest relative error of the energy of a rough joint with 64 samples.
const ROUGH: f64 = 5e-3;

/// Orbits from partial to gross slip. With steps of first order, the error at 64 samples is 4 %.
#[test]
fn an_orbit_of_a_rough_joint_is_that_of_many_samples() {
    for reach in [0.2e-6, 0.6e-6, 3e-6] {
        let errors = errors_of_rough_joint(|samples| {
            Motion::harmonic(&[(reach, 0.0), (0.6 * reach, -1.0)], LOAD, 0.0, samples)
        });
        let [_, [error, _], _] = errors[..] else {
            unreachable!("three numbers of samples");
        };
        assert!(error < ROUGH, "reach {reach}: {errors:?}");
        for [error, said] in errors {
            assert!(error <= said, "reach {reach}: {error:e} of {said:e}");
        }
    }
}

/// Under a load that varies by 40 %, most cells close and open in every cycle. If a cell stuck at its position from the beginning of the
/// closing step, the error at 64 samples would be 0.7 % and of first order.
#[test]
#[ignore = "long: 9 seconds"]
fn cells_stick_to_where_they_closed() {
    for (reach, phase) in [(0.2e-6, FRAC_PI_2), (0.6e-6, 0.3), (0.6e-6, FRAC_PI_2)] {
        let errors = errors_of_rough_joint(|samples| {
            Motion::harmonic(&[(reach, phase), (0.0, 0.0)], LOAD, 0.4 * LOAD, samples)
        });
        let [_, [error, _], _] = errors[..] else {
            unreachable!("three numbers of samples");
        };
        assert!(error < ROUGH, "reach {reach}, phase {phase}: {errors:?}");
        // Half of 32 samples are too few for a reliable error bar.
        for [error, said] in errors.into_iter().skip(1) {
            assert!(error <= said, "reach {reach}: {error:e} of {said:e}");
        }
    }
}

/// Relative difference of the energy between two computations of the cycle in nearly complete sliding.
const ANOTHER_WAY: f64 = 1e-4;

/// The solver computes half the cycle of an orbit. An orbit about another centre needs the whole cycle and gives the same result in
/// complete sliding. The displacement refers to the other centre.
#[test]
fn half_an_orbit_says_what_the_whole_does() {
    let orbit = Motion::harmonic(&[(3e-6, 0.3), (2e-6, -1.0)], LOAD, 0.0, 32);
    let mut moved = orbit.clone();
    if let Channel::Displacement(x) = &mut moved.drive[0] {
        x.iter_mut().for_each(|x| *x += 1e-6);
    }
    assert!(orbit.is_antiperiodic(1) && !moved.is_antiperiodic(1));
    let [half, whole] =
        [orbit, moved].map(|motion| unworn(&mut joint(motion, March::Stepped)).cycle);
    let off = (half.dissipation / whole.dissipation - 1.0).abs();
    assert!(off < ANOTHER_WAY, "off by {off:e}");
    assert_eq!(half.instants.len(), whole.instants.len());
    for (a, b) in half.instants.iter().zip(&whole.instants) {
        assert!((a.time - b.time).abs() < 1e-12);
        assert!((a.displacement[0] + 1e-6 - b.displacement[0]).abs() < 1e-15);
        for axis in 0..2 {
            let off = (a.force[axis] - b.force[axis]).abs();
            assert!(off < 1e-3 * FRICTION * LOAD, "time {}: {off} N", a.time);
        }
    }
}

/// A force alone does not determine the mean displacement. The solver places the middle of the displacement range at zero, as the middle of
/// the force.
#[test]
fn an_orbit_of_a_force_is_about_its_middle() {
    let force = |phase: f64| {
        let values = (0..32).map(|k| 0.5 * FRICTION * LOAD * (TAU * k as f64 / 32.0 + phase).cos());
        Channel::Force(values.collect())
    };
    let motion = Motion {
        time: (0..32).map(|k| k as f64 / 32.0).collect(),
        drive: vec![force(0.0), force(-FRAC_PI_2)],
        normal_load: vec![LOAD; 32],
        ..Motion::at_rest(LOAD)
    };
    let cycle = unworn(&mut joint(motion, March::Stepped)).cycle;
    let [first, last] = [0, 32].map(|k| &cycle.instants[k]);
    assert_eq!(first.displacement, last.displacement);
    for k in 0..16 {
        let [now, then] = [k, k + 16].map(|k| &cycle.instants[k]);
        for axis in 0..2 {
            assert!((now.displacement[axis] + then.displacement[axis]).abs() < 1e-15);
            assert!((now.force[axis] + then.force[axis]).abs() < 1e-9 * LOAD);
        }
    }
    // The joint moves along the force, with a displacement that half the sliding force can cause.
    assert!(cycle.instants[0].displacement[0] > 0.0);
    assert!(cycle.dissipation > 0.0);
}

/// For very few samples, the error bar of a cycle exceeds the error against a cycle of many samples.
#[test]
fn a_cycle_of_few_samples_says_that_it_knows_little() {
    let orbit = |samples| {
        let motion = Motion::harmonic(&[(0.5e-6, 0.0), (0.35e-6, 1.2)], LOAD, 0.0, samples);
        unworn(&mut joint(motion, March::Stepped)).cycle
    };
    let truth = orbit(128).dissipation;
    for samples in [4, 6] {
        let cycle = orbit(samples);
        let error = (cycle.dissipation / truth - 1.0).abs();
        let bar = cycle.relative_error();
        println!("{samples} samples: off by {error:.3}, bar {bar:.3}");
        assert!(
            error < bar,
            "{samples} samples: off by {error:e}, bar {bar:e}"
        );
    }
}

/// History of points on a circle. The distances between neighbours alternate between `share` and `2 − share`. `time` gives the times of the
/// points.
fn history(share: f64, time: impl Fn(f64) -> f64) -> Motion {
    const PLACES: usize = 64;
    let part = |k: usize| (k as f64 + if k % 2 == 1 { share - 1.0 } else { 0.0 }) / PLACES as f64;
    let parts: Vec<f64> = (0..PLACES).map(part).collect();
    let along = |phase: f64| {
        let values = parts.iter().map(|t| 0.5e-6 * (TAU * t + phase).cos());
        Channel::Displacement(values.collect())
    };
    Motion {
        time: parts.iter().map(|t| time(*t)).collect(),
        drive: vec![along(0.0), along(-FRAC_PI_2)],
        normal_load: vec![LOAD; PLACES],
        by_order: true,
        ..Motion::at_rest(LOAD)
    }
}

/// Friction does not depend on time. The times of a history do not change the result, and uneven points change the result little.
#[test]
fn only_the_order_of_places_counts() {
    let of = |motion| unworn(&mut joint(motion, March::Stepped)).cycle;
    // The first motion takes half of the path in 1/10 of the period and the rest in the last 1/10. The second motion slows down. Even times
    // would compute only half of the cycle.
    let hurried = of(history(1.0, |t| match t < 0.5 {
        true => 0.1 * t,
        false => 0.9 + 0.1 * (t - 0.5),
    }));
    let slowing = of(history(1.0, |t| t * t));
    assert!(hurried.energy == slowing.energy && hurried.slip_path == slowing.slip_path);
    let smooth = [(0.5e-6, 0.0), (0.5e-6, -FRAC_PI_2)];
    let truth = of(Motion::harmonic(&smooth, LOAD, 0.0, 256)).dissipation;
    for share in [1.0, 0.7, 0.3] {
        let cycle = of(history(share, |t| t.sqrt()));
        let error = (cycle.dissipation / truth - 1.0).abs();
        println!(
            "{share}: off by {error:.1e}, bar {:.1e}",
            cycle.relative_error()
        );
        assert!(error < cycle.relative_error(), "{share}: off by {error:e}");
    }
}
