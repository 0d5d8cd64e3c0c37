//! Cycles with given forces and moments and with free directions: the solver finds the displacements.

use std::f64::consts::TAU;

use fretwear::contact::normal::Rotation;
use fretwear::wear::cycle::{CycleSolution, March};
use fretwear::wear::{Harmonic, Motion};

use super::{FRICTION, LOAD, driven, harmonic, joint, unworn};

/// Relative error of energies, forces and displacements at the tolerances of [`super::EXACT`].
const SOLVER: f64 = 1e-5;
/// Largest force or moment in a free direction, relative to µN or to µN times the lever.
const FREE: f64 = 1e-6;
/// Half the side of the small joint \[m\].
const LEVER: f64 = 2e-3;

fn cycle(axes: &[Harmonic], rotation: Option<Harmonic>, march: March) -> CycleSolution {
    let motion = driven(axes, rotation);
    unworn(&mut joint(motion, march)).cycle
}

/// The force that a displacement requires, given as the drive, reproduces the displacement and the dissipation.
#[test]
fn a_force_gives_back_the_displacement_that_it_came_from() {
    let displaced = cycle(&[harmonic(0.35e-6, false)], None, March::Reversal);
    let force = displaced.instants[0].force[0];
    for march in [March::Reversal, March::Stepped] {
        let forced = cycle(&[harmonic(force, true)], None, march);
        let first = &forced.instants[0];
        assert!(
            (first.displacement[0] / 0.35e-6 - 1.0).abs() < 10.0 * SOLVER,
            "{march:?}: {:e} m",
            first.displacement[0]
        );
        let ratio = forced.dissipation / displaced.dissipation;
        assert!((ratio - 1.0).abs() < 10.0 * SOLVER, "{march:?}: {ratio}");
        for instant in &forced.instants {
            let asked = force * (TAU * instant.time).cos();
            assert!((instant.force[0] - asked).abs() < FREE * force, "{march:?}");
        }
    }
}

#[test]
fn a_free_transverse_direction_bears_no_force_and_moves() {
    for march in [March::Reversal, March::Stepped] {
        let free = cycle(
            &[harmonic(0.35e-6, false), harmonic(0.0, true)],
            None,
            march,
        );
        for instant in &free.instants {
            assert!(
                instant.force[1].abs() < FREE * FRICTION * LOAD,
                "{march:?}: {:e} N along y",
                instant.force[1]
            );
        }
        let moved = free.instants[0].displacement[1].abs();
        assert!(
            moved > 0.0 && moved < 0.1 * 0.35e-6,
            "{march:?}: {moved:e} m along y"
        );
        assert!(free.shear[1].iter().any(|q| *q != 0.0));
    }
    let held = cycle(
        &[harmonic(0.35e-6, false), harmonic(0.0, false)],
        None,
        March::Reversal,
    );
    assert!(held.instants[0].force[1].abs() > FREE * FRICTION * LOAD);
}

/// A rotation and the moment that it requires describe the same motion. Both methods of the cycle agree.
#[test]
fn a_rotation_and_its_moment() {
    let held = [harmonic(0.0, false); 2];
    let turned = cycle(&held, Some(harmonic(2e-4, false)), March::Reversal);
    let [angle, moment] = turned.instants[0].torsion.expect("a rotation");
    assert_eq!(angle, 2e-4);
    assert!(moment > 0.0 && moment < FRICTION * LOAD * LEVER * 2f64.sqrt());
    assert!(turned.dissipation > 0.0);
    for march in [March::Reversal, March::Stepped] {
        let twisted = cycle(&held, Some(harmonic(moment, true)), march);
        let [found, given] = twisted.instants[0].torsion.expect("a rotation");
        assert!(
            (given / moment - 1.0).abs() < FREE,
            "{march:?}: {given} N m"
        );
        assert!(
            (found / angle - 1.0).abs() < 100.0 * SOLVER,
            "{march:?}: {found} rad"
        );
        let ratio = twisted.dissipation / turned.dissipation;
        assert!((ratio - 1.0).abs() < 1e-3, "{march:?}: {ratio}");
    }
    assert_eq!(
        cycle(&held[..1], None, March::Reversal).instants[0].torsion,
        None
    );
}

#[test]
fn free_rotations_leave_no_moment() {
    let motion = || Motion::harmonic(&[(0.35e-6, 0.0)], LOAD, 0.0, 16);
    let wear = vec![0.0; 40 * 32];
    let mut fixed = joint(motion(), March::Reversal);
    let held = fixed.static_contact(&wear, None).expect("solved");
    assert_eq!(held.rotation, [0.0; 2]);
    assert!(held.moment.iter().all(|m| m.abs() > 1e-6 * LOAD * LEVER));
    for moment in [[0.0; 2], [0.05 * LOAD * LEVER, -0.02 * LOAD * LEVER]] {
        let mut free = joint(motion(), March::Reversal);
        free.rotation = Rotation::Free { moment };
        let contact = free.static_contact(&wear, None).expect("solved");
        for axis in 0..2 {
            let off = (contact.moment[axis] - moment[axis]).abs();
            assert!(off < 1e-9 * LOAD * LEVER, "off by {off:e} N m");
            assert!(contact.rotation[axis] != 0.0);
        }
    }
}

/// The straightness check scales a rotation against the displacements. A rotation in proportion to the displacements is straight.
#[test]
fn a_rotation_in_phase_is_straight() {
    let motion = |phase: f64| {
        let turn = Harmonic {
            phase,
            ..harmonic(2e-4, false)
        };
        driven(&[harmonic(1e-6, false); 2], Some(turn))
    };
    let straight = motion(0.0).straight().expect("straight");
    assert_eq!(straight.end, vec![1e-6, 1e-6, 2e-4]);
    assert!(motion(0.5).straight().is_none());
}
