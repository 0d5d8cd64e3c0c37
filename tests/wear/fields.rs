//! Fields over a cycle against the result of the cycle and against separate solves.

use std::f64::consts::FRAC_PI_2;

use fretwear::wear::cycle::{CycleSolution, March};
use fretwear::wear::fields::InstantFields;
use fretwear::wear::{FrettingJoint, Harmonic, Motion};

use super::{EXACT, FRICTION, LOAD, difference, driven, joint};

/// Half range of the motions \[m\]. Some cells slip and other cells stick.
const REACH: f64 = 0.25e-6;
/// Relative error of shear and slip of a step, over the largest value. The gap is 1e-8, and the error is proportional to the root of the
/// gap.
const SOLVED: f64 = 1e-3;
/// Rounding error of sums and differences in another order.
const ROUNDING: f64 = 1e-12;

fn harmonic(amplitude: f64, phase: f64) -> Harmonic {
    Harmonic {
        amplitude,
        phase,
        is_force: false,
    }
}

/// The cycle of the unworn joint, and the fields of the `wanted` instants.
fn cycle(
    joint: &mut FrettingJoint,
    wanted: impl Fn(usize) -> bool,
) -> (CycleSolution, Vec<InstantFields>) {
    let wear = vec![0.0; joint.patch.grid.len()];
    let contact = joint.static_contact(&wear, None).expect("static contact");
    let found = joint.cycle_with_fields(&wear, &contact, None, &wanted);
    found.expect("a cycle")
}

fn largest(field: &[f64]) -> f64 {
    field.iter().fold(0.0, |m, v| m.max(v.abs()))
}

#[test]
fn the_cycle_does_not_hang_on_what_is_kept_of_it() {
    let orbit = [harmonic(REACH, 0.0), harmonic(0.7 * REACH, FRAC_PI_2)];
    let line = [harmonic(REACH, 0.3)];
    for (motion, march) in [
        (driven(&line, None), March::Reversal),
        (driven(&line, None), March::Superposition),
        (driven(&orbit, None), March::Stepped),
        (
            Motion::harmonic(&[(REACH, 0.3)], LOAD, 0.4 * LOAD, 16),
            March::Stepped,
        ),
    ] {
        let mut joint = joint(motion, march);
        let (without, none) = cycle(&mut joint, |_| false);
        assert!(none.is_empty());
        let (with, all) = cycle(&mut joint, |_| true);
        assert_eq!(with, without, "{march:?}");
        let instants: Vec<usize> = all.iter().map(|of| of.instant).collect();
        assert_eq!(
            instants,
            Vec::from_iter(0..with.instants.len()),
            "{march:?}"
        );
        // The fields of some instants equal the fields from all instants.
        let (_, some) = cycle(&mut joint, |instant| instant % 2 == 1);
        let odd: Vec<&InstantFields> = all.iter().filter(|of| of.instant % 2 == 1).collect();
        assert_eq!(some.iter().collect::<Vec<_>>(), odd, "{march:?}");
        // The shear at t = 0 is the start of a later cycle. The sum of the shear is the force.
        assert_eq!(all[0].shear, with.shear);
        let area = joint.patch.grid.cell_area();
        for (of, instant) in all.iter().zip(&with.instants) {
            for (q, force) in of.shear.iter().zip(&instant.force) {
                let sum = q.iter().sum::<f64>() * area;
                assert!(
                    (sum - force).abs() < ROUNDING * FRICTION * LOAD,
                    "{march:?}"
                );
            }
        }
    }
}

/// A line along x, computed by reversal. A slipping cell is at its limit at both ends, and its slip path is twice the slip between the
/// ends.
#[test]
fn a_line_turns_at_its_ends() {
    for phase in [0.0, 0.3] {
        let mut joint = joint(driven(&[harmonic(REACH, phase)], None), March::Reversal);
        let (solution, all) = cycle(&mut joint, |_| true);
        assert_eq!(all.len(), if phase == 0.0 { 3 } else { 4 });
        let (last, ends) = (
            &all[all.len() - 1],
            [&all[all.len() - 3], &all[all.len() - 2]],
        );
        // The cycle closes.
        assert_eq!(last.shear, all[0].shear);
        assert!(largest(&last.slip[0]) < ROUNDING * REACH);
        let limit = joint.limit(&last.pressure);
        let (mut slipping, mut sticking) = (0, 0);
        for c in 0..limit.len() {
            let [there, here] = ends.map(|of| (of.shear[0][c], of.slip[0][c]));
            assert!(there.0.abs() <= limit[c] * (1.0 + ROUNDING));
            let slipped = (there.1 - here.1).abs();
            let error = (2.0 * slipped - solution.slip_path[c]).abs();
            assert!(
                error < SOLVED * largest(&solution.slip_path),
                "{c}: {error:e}"
            );
            if limit[c] > 0.0 && solution.slip_path[c] > 0.0 {
                assert!(there.0.abs() > limit[c] * (1.0 - ROUNDING), "{c}");
                assert!((there.0 - here.0) * (there.1 - here.1) > 0.0, "{c}");
                slipping += 1;
            } else if limit[c] > 0.0 {
                sticking += 1;
            }
        }
        assert!(slipping > 10 && sticking > 30, "{slipping} {sticking}");
    }
}

/// A stepped line has the same fields at its ends as a line by reversal. Between the ends, slip has one direction.
#[test]
fn steps_along_a_line_pass_through_the_ends_of_its_reversals() {
    let line = || driven(&[harmonic(REACH, 0.0)], None);
    let (_, ends) = cycle(&mut joint(line(), March::Reversal), |_| true);
    let (_, all) = cycle(&mut joint(line(), March::Stepped), |_| true);
    assert_eq!(all.len(), 17);
    for (instant, end) in [(0, 0), (8, 1), (16, 2)] {
        let [stepped, exact] = [&all[instant], &ends[end]];
        assert!(difference(&stepped.shear[0], &exact.shear[0]) < SOLVED);
        if end == 1 {
            let error = difference(&stepped.slip[0], &exact.slip[0]);
            assert!(error < SOLVED, "{error:e}");
        }
    }
    // A cell that sticks at the end sticks at every instant before.
    let scale = largest(&all[8].slip[0]);
    for pair in all[..9].windows(2) {
        for c in 0..pair[0].pressure.len() {
            let step = pair[1].slip[0][c] - pair[0].slip[0][c];
            assert!(step < SOLVED * scale, "{}: {c} {step:e}", pair[1].instant);
        }
    }
}

#[test]
fn an_orbit_has_opposite_halves() {
    let orbit = [harmonic(REACH, 0.0), harmonic(0.7 * REACH, 1.0)];
    let (_, all) = cycle(&mut joint(driven(&orbit, None), March::Stepped), |_| true);
    assert!(all.iter().all(|of| of.gap.is_none()));
    let half = all.len() / 2;
    let middle = &all[half].slip;
    for k in 0..half {
        for axis in 0..2 {
            let (here, there) = (&all[k], &all[k + half]);
            let scale = largest(&middle[axis]);
            for c in 0..here.pressure.len() {
                assert_eq!(here.shear[axis][c], -there.shear[axis][c]);
                let sum = here.slip[axis][c] + there.slip[axis][c] - middle[axis][c];
                assert!(
                    sum.abs() < ROUNDING.sqrt() * scale,
                    "{k} {axis} {c}: {sum:e}"
                );
            }
        }
    }
}

/// Under a varying load, the pressure of an instant depends only on the load of the instant. Gaps open where the pressure vanishes.
#[test]
fn a_load_that_varies_has_the_pressure_of_each_instant() {
    let motion = Motion::harmonic(&[(REACH, 0.4)], LOAD, 0.5 * LOAD, 16);
    let loads = motion.normal_load.clone();
    let mut joint = joint(motion, March::Stepped);
    let (_, some) = cycle(&mut joint, |instant| [0, 5, 8].contains(&instant));
    assert_eq!(some.len(), 3);
    let wear = vec![0.0; joint.patch.grid.len()];
    // Relative difference of the pressure between two solves from different starts.
    let solved = EXACT.normal.tolerance.sqrt();
    let mut opened = 0;
    for of in &some {
        let load = loads[of.instant];
        let alone = joint.contact(&wear, None, load, None).expect("a contact");
        assert!(difference(&of.pressure, &alone.pressure) < solved, "{load}");
        let gap = of.gap.as_ref().expect("a gap");
        assert!(difference(gap, &alone.gap) < solved, "{load}");
        opened += (0..gap.len())
            .filter(|&c| some[0].pressure[c] > 0.0 && of.pressure[c] == 0.0 && gap[c] > 0.0)
            .count();
    }
    assert!(opened > 10, "{opened} cells open");
}
