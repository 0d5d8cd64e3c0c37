//! What a cycle between two reversals leaves out of the work of friction.

use std::f64::consts::TAU;
use std::sync::Arc;

use fretwear::contact::nodes::Interpolation;
use fretwear::grid::Grid;
use fretwear::wear::{Channel, Motion, OwnMotion};

const SAMPLES: usize = 512;
/// Sums over so many samples of half waves are right to their square.
const SAMPLED: f64 = 1e-4;

/// cos along x under a load that varies by `share` at `order`; with a node of two that lags by `lag`, if it is given.
fn motion(share: f64, order: f64, lag: Option<f64>) -> Motion {
    let time: Vec<f64> = (0..SAMPLES).map(|k| k as f64 / SAMPLES as f64).collect();
    let wave = |order: f64, lag: f64| move |t: &f64| (TAU * order * t - lag).cos();
    let drive: Vec<f64> = time.iter().map(wave(1.0, 0.0)).collect();
    let load = time.iter().map(|t| 1.0 + share * wave(order, 0.0)(t));
    let own = lag.map(|lag| {
        let interpolation = Arc::new(Interpolation::new(Grid::over([4.0, 3.0], [8, 9]), [1, 1]));
        let nodes = interpolation.nodes();
        let own = |t: &f64| {
            let mut of = vec![0.0; nodes];
            of[0] = wave(1.0, lag)(t) - wave(1.0, 0.0)(t);
            of
        };
        OwnMotion {
            displacement: time.iter().map(own).collect(),
            interpolation,
        }
    });
    Motion {
        normal_load: load.collect(),
        drive: vec![Channel::Displacement(drive)],
        rotation: None,
        own,
        time,
    }
}

fn left_out(motion: &Motion) -> f64 {
    let straight = motion.reversals(0.01, 0.1).expect("a straight motion");
    motion.left_out_by_reversals(&straight)
}

/// ∮ (1 + ε cos 2θ) |d cos θ| = 4 − 4ε/3; a load of the motion's own frequency has no part in it.
#[test]
fn a_load_of_twice_the_frequency_is_left_out_by_a_third() {
    for share in [0.0, 0.01, 0.04] {
        let found = left_out(&motion(share, 2.0, None));
        assert!((found - share / 3.0).abs() < SAMPLED, "{share}: {found:e}");
        let found = left_out(&motion(share, 1.0, None));
        assert!(found < SAMPLED, "{share}: {found:e}");
    }
}

/// A node that lags by φ goes 4 cos φ between the two ends of the others, of four in all.
#[test]
fn a_node_that_turns_elsewhere_goes_its_way_in_part() {
    for lag in [0.0, 0.3, 0.6_f64] {
        let motion = motion(0.0, 2.0, Some(lag));
        let nodes = 4.0;
        let expected = (1.0 - lag.cos()) / nodes;
        let found = left_out(&motion);
        assert!(
            (found - expected).abs() < SAMPLED,
            "{lag}: {found:e} for {expected:e}"
        );
    }
}
