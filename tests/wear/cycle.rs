use fretwear::contact::tangential::CellState;
use fretwear::wear::cycle::{CycleSolution, March};
use fretwear::wear::{FrettingJoint, Motion, WearError};

use super::{EXACT, FRICTION, LOAD, difference, joint, unworn};

/// Amplitude in partial slip \[m\]: a fraction of the displacement at which the joint slides.
const PARTIAL: f64 = 0.35e-6;
/// Amplitude in gross slip \[m\].
const GROSS: f64 = 3e-6;
/// Relative difference of two solves of one cycle along different paths. The change of the transverse shear along a branch causes the
/// difference.
const PATH: f64 = 2e-3;
/// Relative error of energies and forces at the tolerances of [`EXACT`].
const SOLVER: f64 = 1e-5;

fn cycle(joint: &mut FrettingJoint) -> CycleSolution {
    unworn(joint).cycle
}

fn along_x(amplitude: f64, phase: f64) -> Motion {
    Motion::harmonic(&[(amplitude, phase)], LOAD, 0.0, 16)
}

#[test]
fn reversal_and_stepped_agree_along_one_axis() {
    for amplitude in [PARTIAL, GROSS] {
        let by_reversal = cycle(&mut joint(along_x(amplitude, 0.0), March::Reversal));
        let by_steps = cycle(&mut joint(along_x(amplitude, 0.0), March::Stepped));
        let ratio = by_steps.dissipation / by_reversal.dissipation;
        assert!(
            (ratio - 1.0).abs() < SOLVER,
            "amplitude {amplitude}: energies differ by {ratio}"
        );
        assert!(difference(&by_steps.shear[0], &by_reversal.shear[0]) < PATH);
    }
}

#[test]
fn reversal_and_stepped_agree_with_a_transverse_shear() {
    let motion = Motion::harmonic(&[(PARTIAL, 0.0), (0.0, 0.0)], LOAD, 0.0, 16);
    let by_reversal = cycle(&mut joint(motion.clone(), March::Reversal));
    let by_steps = cycle(&mut joint(motion, March::Stepped));
    let ratio = by_steps.dissipation / by_reversal.dissipation;
    assert!((ratio - 1.0).abs() < PATH, "energies differ by {ratio}");
    assert!(
        by_reversal.shear[1].iter().any(|q| q.abs() > 0.0),
        "the transverse shear is not 0"
    );
}

#[test]
fn the_phase_moves_the_start_and_nothing_else() {
    let reference = cycle(&mut joint(along_x(PARTIAL, 0.0), March::Reversal));
    for phase in [0.9, 2.5, -1.3] {
        let shifted = cycle(&mut joint(along_x(PARTIAL, phase), March::Reversal));
        let stepped = cycle(&mut joint(along_x(PARTIAL, phase), March::Stepped));
        let ratio = shifted.dissipation / reference.dissipation;
        assert!(
            (ratio - 1.0).abs() < SOLVER,
            "phase {phase}: energies differ by {ratio}"
        );
        let (first, last) = (
            &shifted.instants[0],
            &shifted.instants[shifted.instants.len() - 1],
        );
        assert_eq!((first.time, last.time), (0.0, 1.0));
        assert_eq!(first.force, last.force);
        assert!(
            (first.force[0] / stepped.instants[0].force[0] - 1.0).abs() < PATH,
            "phase {phase}"
        );
    }
}

#[test]
fn the_loop_area_is_the_dissipated_energy() {
    // The trapezoids are inscribed in the loop, so the error falls with the square of the step.
    let mut errors = Vec::new();
    for samples in [16, 32, 64] {
        let motion = Motion::harmonic(&[(PARTIAL, 0.0)], LOAD, 0.0, samples);
        let cycle = cycle(&mut joint(motion, March::Stepped));
        let area: f64 = cycle
            .instants
            .windows(2)
            .map(|w| {
                0.5 * (w[0].force[0] + w[1].force[0])
                    * (w[1].displacement[0] - w[0].displacement[0])
            })
            .sum();
        errors.push((area / cycle.dissipation - 1.0).abs());
    }
    let order = (errors[0] / errors[2]).log2() / 2.0;
    assert!(
        order > 1.5,
        "loop area against dissipation: errors {errors:?}"
    );
}

#[test]
fn gross_slip_carries_the_friction_force() {
    let cycle = cycle(&mut joint(along_x(GROSS, 0.0), March::Reversal));
    let force = cycle.instants[0].force[0];
    assert!(
        (force / (FRICTION * LOAD) - 1.0).abs() < SOLVER,
        "T = {force} N"
    );
}

#[test]
fn stick_cells_have_no_slip_and_slip_cells_the_limit() {
    let mut joint = joint(along_x(PARTIAL, 0.0), March::Reversal);
    let state = unworn(&mut joint);
    let limit = joint.limit(&state.pressure);
    let step = joint
        .step(&limit, None, [&[0.0], &[PARTIAL]], None)
        .expect("step");
    let mut counts = [0; 2];
    for (c, cell) in step.state.iter().enumerate() {
        match cell {
            CellState::Stick => {
                assert_eq!(state.cycle.slip_path[c], 0.0);
                assert_eq!(state.cycle.energy[c], 0.0);
                counts[0] += 1;
            }
            CellState::Slip => {
                assert!((step.shear[0][c].abs() / limit[c] - 1.0).abs() < SOLVER);
                counts[1] += 1;
            }
            CellState::Open => assert_eq!((limit[c], state.cycle.energy[c]), (0.0, 0.0)),
        }
    }
    assert!(
        counts.iter().all(|&n| n > 5),
        "stick and slip cells: {counts:?}"
    );
}

#[test]
fn a_changing_load_in_phase_dissipates_otherwise_than_a_constant_one() {
    let energy = |load_amplitude: f64, phase: f64| {
        let motion = Motion::harmonic(&[(GROSS, phase)], LOAD, load_amplitude, 32);
        cycle(&mut joint(motion, March::Stepped)).dissipation
    };
    let constant = energy(0.0, 0.0);
    // Load and speed are in quadrature. The mean of N|v| over a sliding cycle equals the mean under constant load, except for the sticking
    // part after each reversal.
    let in_phase = energy(0.3 * LOAD, 0.0);
    assert!(
        (in_phase / constant - 1.0).abs() < 0.1,
        "{in_phase} against {constant}"
    );
    // Opposite motions pass the same loads in opposite order. The energies are equal by symmetry.
    let opposite = energy(0.3 * LOAD, std::f64::consts::PI);
    assert!((opposite / in_phase - 1.0).abs() < SOLVER);
}

#[test]
fn turning_the_motion_by_a_right_angle_in_time_makes_an_orbit() {
    let orbit = Motion::harmonic(
        &[(GROSS, 0.0), (GROSS, -std::f64::consts::FRAC_PI_2)],
        LOAD,
        0.0,
        32,
    );
    let cycle = cycle(&mut joint(orbit, March::Stepped));
    // Gross slip along a circle of radius r dissipates less than µN·2πr, because the elastic deformation of the joint takes a part of the
    // path.
    let rigid = FRICTION * LOAD * std::f64::consts::TAU * GROSS;
    assert!(
        cycle.dissipation < rigid && cycle.dissipation > 0.5 * rigid,
        "{} of {rigid}",
        cycle.dissipation
    );
    for instant in &cycle.instants {
        let force = instant.force[0].hypot(instant.force[1]);
        assert!(force <= FRICTION * LOAD * (1.0 + SOLVER));
    }
}

#[test]
fn a_motion_that_is_not_straight_is_refused_by_reversal() {
    let orbit = Motion::harmonic(&[(GROSS, 0.0), (GROSS, 1.0)], LOAD, 0.0, 16);
    let mut joint = joint(orbit, March::Reversal);
    let wear = vec![0.0; joint.patch.grid.len()];
    let contact = joint.static_contact(&wear, None).expect("static contact");
    assert_eq!(
        joint.cycle(&wear, &contact, None),
        Err(WearError::NotStraight)
    );
}

#[test]
fn every_tangential_step_is_certified() {
    for amplitude in [0.1 * PARTIAL, PARTIAL, 2.0 * PARTIAL, GROSS] {
        let cycle = cycle(&mut joint(along_x(amplitude, 0.0), March::Stepped));
        assert!(
            cycle.error <= EXACT.tangential.tolerance,
            "amplitude {amplitude}: gap {}",
            cycle.error
        );
    }
}
