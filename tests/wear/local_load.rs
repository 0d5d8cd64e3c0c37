//! Cycles with a local load at each place, and their approximation by reversals.

use std::f64::consts::TAU;
use std::sync::Arc;

use fretwear::contact::nodes::Interpolation;
use fretwear::contact::normal::{self, Control, NormalProblem};
use fretwear::wear::cycle::CycleSolution;
use fretwear::wear::cycle::March;
use fretwear::wear::{Channel, FrettingJoint, Motion, NodalMotion};

use super::{LOAD, joint};

/// Samples per cycle.
const SAMPLES: usize = 16;

/// Half range of the joint's displacement \[m\], in partial slip.
const REACH: f64 = 4e-7;

/// Motion of the nodes of 3 x 2 boxes. The nodes move along x by `reach`, and by more towards +y. During the motion, the nodes at the edge
/// +x approach by `approach`.
fn motion(approach: f64, samples: usize) -> Motion {
    let at_rest = joint(Motion::at_rest(LOAD), March::Reversal);
    let counts = [3, 2];
    let interpolation = Arc::new(Interpolation::new(at_rest.patch.grid, counts));
    let time: Vec<f64> = (0..samples).map(|k| k as f64 / samples as f64).collect();
    let wave = |t: &f64| (TAU * t).cos();
    let nodes = |of: &dyn Fn(f64, f64) -> f64| -> Vec<Vec<f64>> {
        let place = |n: usize| {
            let (i, j) = (n / (counts[1] + 1), n % (counts[1] + 1));
            (2.0 * i as f64 / 3.0 - 1.0, j as f64 - 1.0)
        };
        let at = |t: &f64| {
            let all = 0..interpolation.nodes();
            all.map(|n| wave(t) * of(place(n).0, place(n).1)).collect()
        };
        time.iter().map(at).collect()
    };
    let own = NodalMotion {
        displacement: nodes(&|_, y| 0.3 * REACH * y),
        approach: match approach {
            0.0 => Vec::new(),
            _ => nodes(&|x, _| approach * x),
        },
        work_ratio: Vec::new(),
        total_work_ratio: 1.0,
        force_ratio: 1.0,
        direction: nodes(&|_, y| REACH * (1.0 + 0.3 * y)).swap_remove(0),
        interpolation: interpolation.clone(),
    };
    Motion {
        drive: vec![Channel::Displacement(
            time.iter().map(|t| REACH * wave(t)).collect(),
        )],
        normal_load: vec![LOAD; samples],
        nodal_motion: Some(own),
        time,
        ..Motion::at_rest(LOAD)
    }
}

fn cycle(joint: &mut FrettingJoint) -> CycleSolution {
    let wear = vec![0.0; joint.patch.grid.len()];
    let contact = joint.static_contact(&wear, None).expect("contact");
    joint.cycle(&wear, &contact, None).expect("a cycle")
}

/// Local loads change the work of friction.
#[test]
fn loads_of_single_places_change_the_work_of_friction() {
    let of =
        |approach: f64| cycle(&mut joint(motion(approach, SAMPLES), March::Stepped)).dissipation;
    let (none, little, much) = (of(0.0), of(1e-10), of(3e-7));
    assert!(
        (little / none - 1.0).abs() < 0.01,
        "{little:e} for {none:e}"
    );
    assert!((much / none - 1.0).abs() > 0.05, "{much:e} for {none:e}");
}

/// If all nodes approach by the same amount, every place has the result of the whole joint under the load of this approach.
#[test]
fn places_that_come_closer_alike_share_the_load_of_the_joint() {
    const APPROACH: f64 = 1e-7;
    let mut by_place = motion(0.0, SAMPLES);
    let wave: Vec<f64> = by_place.time.iter().map(|t| (TAU * t).cos()).collect();
    let own = by_place.nodal_motion.as_mut().expect("own motion");
    let nodes = own.interpolation.nodes();
    own.approach = wave.iter().map(|w| vec![APPROACH * w; nodes]).collect();
    let mut joint = joint(motion(0.0, SAMPLES), March::Stepped);
    let wear = vec![0.0; joint.patch.grid.len()];
    let rest = joint.static_contact(&wear, None).expect("contact").approach;
    let of_joint = |joint: &mut FrettingJoint, w: &f64| {
        let problem = NormalProblem {
            control: Control::Approach(rest + APPROACH * w),
            ..NormalProblem::new(&joint.patch, &joint.height, LOAD)
        };
        let options = joint.options.normal;
        normal::solve(&mut joint.half_space, &problem, None, options)
            .expect("contact")
            .load
    };
    let loads: Vec<f64> = wave.iter().map(|w| of_joint(&mut joint, w)).collect();
    let largest = loads.iter().copied().fold(0.0, f64::max);
    assert!(largest > 1.05 * LOAD, "{largest:e}");
    joint.motion.normal_load = loads;
    let expected = cycle(&mut joint);
    joint.motion = by_place;
    let found = cycle(&mut joint);
    let off = (found.dissipation / expected.dissipation - 1.0).abs();
    assert!(off < SOLVED, "{off:e}");
    let sum: f64 = expected.slip_path.iter().sum();
    let pairs = found.slip_path.iter().zip(&expected.slip_path);
    let off: f64 = pairs.map(|(a, b)| (a - b).abs()).sum();
    assert!(off < SOLVED * sum, "{off:e} of {sum:e}");
}

/// Relative tolerance. Both computations of a cycle close to a millionth of the largest shear.
const SOLVED: f64 = 1e-4;

/// With a work ratio, each place dissipates the given part of its work and slips less by the same ratio. The forces do not change.
#[test]
fn parts_of_the_work_count_where_they_are() {
    let ends = || motion(0.0, SAMPLES).reversals(0.01, 0.0).expect("straight");
    let whole = cycle(&mut joint(ends(), March::Reversal));
    let mut in_part = ends();
    let own = in_part.nodal_motion.as_mut().expect("own motion");
    // The ratio increases towards +x with the index of the node.
    let width = 3;
    own.work_ratio = (0..own.interpolation.nodes())
        .map(|n| 0.5 + 0.25 * (n / width) as f64)
        .collect();
    let mut of_cells = vec![0.0; whole.slip_path.len()];
    own.interpolation
        .add_interpolated(1.0, &own.work_ratio, &mut of_cells);
    let work = whole.energy.iter().zip(&of_cells);
    let in_parts = work.map(|(energy, part)| energy * part).sum::<f64>();
    let all = in_parts / whole.energy.iter().sum::<f64>();
    // The total work ratio equals the sum of the places, or is 10 % lower.
    for less in [1.0, 0.9] {
        let own = in_part.nodal_motion.as_mut().expect("own motion");
        own.total_work_ratio = less * all;
        let found = cycle(&mut joint(in_part.clone(), March::Reversal));
        assert_eq!(found.shear, whole.shear);
        for (found, whole) in [
            (&found.slip_path, &whole.slip_path),
            (&found.energy, &whole.energy),
        ] {
            for ((found, whole), part) in found.iter().zip(whole).zip(&of_cells) {
                let expected = less * whole * part;
                assert!(
                    (found - expected).abs() <= 1e-12 * expected,
                    "{found} {expected}"
                );
            }
        }
        // The error adds 0.4 times the change of the total.
        let expected = whole.dissipation_error + 0.4 * (1.0 - less) * all * whole.dissipation;
        let off = (found.dissipation_error - expected).abs();
        assert!(
            off <= 1e-9 * expected,
            "{} {expected}",
            found.dissipation_error
        );
        assert!(found.dissipation < 0.95 * whole.dissipation);
    }
}
