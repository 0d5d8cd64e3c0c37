//! Tests of cubic springs and one-sided stops of oscillators against closed forms and differences.

use std::f64::consts::{PI, TAU};

use fretwear::dynamics::{Harmonics, Oscillator, Sampling, Spring};
use fretwear::reference::Duffing;

use super::element::motion;
use super::{balance, cubic, drive, samples, springs};

/// Undamped first resonance at 159.15 Hz.
fn oscillator(spring: Spring) -> Oscillator {
    Oscillator {
        mass: [1.0, 2.0, 3.0],
        damping: [2.0, 4.0, 6.0],
        stiffness: [1e6, 3e6, 5e6],
        element: springs(vec![spring]),
    }
}

pub fn stop(direction: usize, stiffness: f64, gap: f64) -> Spring {
    Spring::Stop {
        direction,
        stiffness,
        gap,
    }
}

/// The closed form contains the first harmonic only.
#[test]
fn the_backbone_of_duffing_is_its_closed_form() {
    /// Tolerance for the error of Newton's method.
    const LEFT: f64 = 1e-8;
    for k3 in [3e11, -1e10] {
        let oscillator = oscillator(cubic(0, k3));
        let exact = Duffing {
            mass: 1.0,
            damping: 2.0,
            stiffness: 1e6,
            cubic: k3,
        };
        for force in [0.2, 1.0, 3.0] {
            let balance = balance(&oscillator, 1, &drive(force), samples(512));
            let range = (TAU * 100.0, TAU * 400.0);
            let resonance = balance.phase_resonance(range, None).expect("a resonance");
            let (amplitude, _) = balance.amplitude(&resonance, 0).expect("an amplitude");
            let omega = resonance.omega;
            let square = (omega / exact.backbone(amplitude)).powi(2);
            assert!((square - 1.0).abs() < LEFT, "{omega}");
            assert!((exact.resonant_force(amplitude) / force - 1.0).abs() < LEFT);
        }
    }
}

/// With a stop without a gap, the free oscillation consists of two half periods: its frequency is 2 ω₁ ω₂ / (ω₁ + ω₂).
#[test]
fn a_stop_without_a_gap_has_the_bilinear_frequency() {
    /// Tolerance for the harmonics above 15 and for the damping of 0.1 %.
    const LEFT: f64 = 2e-4;
    let oscillator = oscillator(stop(0, 3e6, 0.0));
    let balance = balance(&oscillator, 15, &drive(1.0), samples(512));
    let range = (TAU * 150.0, TAU * 300.0);
    let resonance = balance.phase_resonance(range, None).expect("a resonance");
    let (first, second) = (1e3, 2e3);
    let exact = 2.0 * first * second / (first + second);
    let error = (resonance.omega / exact - 1.0).abs();
    assert!(error < LEFT, "{error:e}");
}

/// The work of a cubic spring over a cycle is zero, even with few samples.
#[test]
fn cubic_springs_do_no_work() {
    /// Rounding of the sums.
    const ROUNDING: f64 = 1e-13;
    let element = springs(vec![cubic(0, 2e15), cubic(2, -1e15)]);
    let harmonics = Harmonics::up_to(3);
    let sampling = Sampling::new(harmonics.clone(), 8).expect("samples");
    let u = motion(5e-6);
    let mut force = vec![0.0; 21];
    sampling.evaluate(&element, &u, &mut force, None, &mut sampling.workspace());
    let size = |row: &[f64]| row.iter().map(|v| v * v).sum::<f64>().sqrt();
    let work = harmonics.work(&force, &u);
    assert!(size(&force) > 1.0);
    assert!(work.abs() <= ROUNDING * size(&force) * size(&u), "{work:e}");
}

/// The force of a stop on u = a cos ωt has closed forms: with c = arccos(g/a), its mean is k (a sin c − g c)/π, and the amplitude of its
/// first harmonic is k (a c − ½ a sin 2c)/π.
#[test]
fn a_sampled_stop_has_its_closed_form() {
    /// Relative sampling error.
    const LEFT: f64 = 1e-3;
    let (k, gap, a) = (4e5, 2e-6, 5e-6);
    let element = springs(vec![stop(1, k, gap)]);
    let harmonics = Harmonics::up_to(3);
    let sampling = Sampling::new(harmonics, 64).expect("samples");
    let (mut u, mut force) = (vec![0.0; 21], vec![0.0; 21]);
    u[7 + 1] = a;
    sampling.evaluate(&element, &u, &mut force, None, &mut sampling.workspace());
    let c = f64::acos(gap / a);
    let mean = k * (a * c.sin() - gap * c) / PI;
    let first = k * (a * c - 0.5 * a * (2.0 * c).sin()) / PI;
    for (found, exact) in [(force[7], mean), (force[7 + 1], first)] {
        assert!((found / exact - 1.0).abs() < LEFT, "{found} for {exact}");
    }
    assert!(force[7 + 2].abs() < LEFT * first);
}
