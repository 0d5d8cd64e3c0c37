//! The coarse trajectory against the trajectory whose error it estimates.

use fretwear::grid::{Grid, Patch};
use fretwear::wear::coarse::{self, RunTrajectory, TrajectoryDifference};
use fretwear::wear::cycle::{CycleSolution, March};
use fretwear::wear::joint::WornState;
use fretwear::wear::{FrettingJoint, Motion};

use super::{LAW, LOAD, after, difference_l1, joint, step_of, unworn, wear_by_equal_steps};

/// Number of cycles. The orbit in partial slip wears far into its running-in.
const CYCLES: u64 = 1_200_000;
/// Steps of the reference trajectory and of the own trajectory. The coarse trajectory has half the steps of the own trajectory.
const STEPS: [u64; 2] = [16, 8];
/// Bounds of the ratio of the trajectory difference to the error of the own trajectory. For short steps the ratio is 4.5. The few steps of
/// this test need wider bounds.
const OVER_ERROR: (f64, f64) = (1.5, 12.0);

fn orbit() -> FrettingJoint {
    let motion = Motion::harmonic(&[(0.5e-6, 0.0), (0.35e-6, 1.2)], LOAD, 0.0, 32);
    joint(motion, March::Stepped)
}

/// States of the joint after `steps` steps and after half as many coarse steps.
fn own_and_coarse(joint: &mut FrettingJoint, steps: u64) -> [WornState; 2] {
    let mut own = unworn(joint);
    let mut coarse = own.clone();
    let cycles = CYCLES / steps;
    for _ in 0..steps / 2 {
        let begin = own;
        let middle = step_of(joint, &begin, cycles);
        let middle = after(joint, middle);
        let end = step_of(joint, &middle, cycles);
        own = after(joint, end);
        let along = RunTrajectory {
            begin: &begin,
            end: &own.wear,
        };
        coarse = coarse::advance(joint, &coarse, along, LAW, 2 * cycles).expect("a coarse step");
    }
    [own, coarse]
}

#[test]
#[ignore = "long: 15 seconds"]
fn the_difference_of_the_coarse_trajectory_is_above_the_error_of_the_own_one() {
    let mut joint = orbit();
    let motion = joint.motion.clone();
    let [fine, steps] = STEPS;
    joint.motion = Motion::harmonic(&[(0.5e-6, 0.0), (0.35e-6, 1.2)], LOAD, 0.0, 64);
    let (truth, _) = wear_by_equal_steps(&mut joint, CYCLES, fine);
    joint.motion = motion.clone();
    let [own, coarse] = own_and_coarse(&mut joint, steps);
    assert_eq!(joint.motion, motion, "the joint keeps its motion");
    let error = difference_l1(&own.wear, &truth.wear);
    let of = TrajectoryDifference::between(&own, &coarse, &joint.patch, 1e-3);
    let difference = of.field / joint.volume(&own.wear);
    println!("error {error:.2e}, difference {difference:.2e}: {of:?}");
    assert!(
        difference > OVER_ERROR.0 * error && difference < OVER_ERROR.1 * error,
        "error {error:e}, difference {difference:e}"
    );
    assert!(of.volume <= of.field);
}

fn state(wear: &[f64], pressure: &[f64], dissipation: f64) -> WornState {
    let none = vec![0.0; wear.len()];
    WornState {
        wear: wear.to_vec(),
        pressure: pressure.to_vec(),
        cycle: CycleSolution {
            shear: vec![none.clone()],
            slip_path: none.clone(),
            energy: none,
            dissipation,
            instants: Vec::new(),
            steps: 0,
            error: 0.0,
            dissipation_error: 0.0,
        },
    }
}

#[test]
fn differences_are_those_of_the_figures() {
    let own = state(&[0.0, 1.0, 4.0, 3.0, 1.0], &[0.0, 10.0, 2.2, 1.9, 0.5], 8.0);
    let coarse = state(&[0.0, 1.5, 1.0, 3.0, 2.5], &[0.0, 9.0, 2.0, 1.7, 0.5], 10.0);
    let patch = Patch::full(Grid::over([2.0, 5.0], [1, 5]));
    let of = TrajectoryDifference::between(&own, &coarse, &patch, 0.2);
    // The run minus the coarse trajectory: −0.5, 3, 0, −1.5.
    assert_eq!((of.volume, of.field), (2.0, 10.0));
    // Two cells carry more than the threshold of 2. A change by 1.5 times the difference moves the cell with 2.2 below the threshold and
    // the cell with 1.9 above the threshold.
    assert_eq!(of.loaded_area, 1.0);
    assert_eq!((of.max_pressure, of.dissipation), (0.1, 0.25));
    // The largest depths are 4 and 3.
    assert_eq!((of.largest_depth, of.depth_99), (0.25, 0.25));
    // The mean depth of the worn cells is 2.25. Only the third cell differs by more than the mean and by more than half.
    assert_eq!(of.undecided, 1);
    assert_eq!(
        TrajectoryDifference::between(&own, &own, &patch, 0.2),
        TrajectoryDifference::default(),
        "equal trajectories have no difference"
    );
    let unworn = state(&[0.0; 5], &[0.0; 5], 0.0);
    assert_eq!(
        TrajectoryDifference::between(&unworn, &unworn, &patch, 0.2),
        TrajectoryDifference::default()
    );
}
