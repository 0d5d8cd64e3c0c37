//! Error of the friction energy of a cycle that is computed between two reversals.

use std::f64::consts::TAU;

use fretwear::wear::{Channel, Motion};

const SAMPLES: usize = 512;
/// Relative error of sums of half waves with this number of samples. The error falls with the square of the number.
const SAMPLED: f64 = 1e-4;

/// cos along x under a load that varies by `share` at harmonic `order`.
fn motion(share: f64, order: f64) -> Motion {
    let time: Vec<f64> = (0..SAMPLES).map(|k| k as f64 / SAMPLES as f64).collect();
    let wave = |order: f64| move |t: &f64| (TAU * order * t).cos();
    let load = time.iter().map(|t| 1.0 + share * wave(order)(t));
    Motion {
        normal_load: load.collect(),
        drive: vec![Channel::Displacement(time.iter().map(wave(1.0)).collect())],
        time,
        ..Motion::at_rest(1.0)
    }
}

/// ∮ (1 + ε cos 2θ) |d cos θ| = 4 − 4ε/3. A load at the frequency of the motion does not contribute.
#[test]
fn a_load_of_twice_the_frequency_is_left_out_by_a_third() {
    for share in [0.0, 0.01, 0.04] {
        let found = motion(share, 2.0).reversal_energy_error();
        assert!((found - share / 3.0).abs() < SAMPLED, "{share}: {found:e}");
        let found = motion(share, 1.0).reversal_energy_error();
        assert!(found < SAMPLED, "{share}: {found:e}");
    }
}
