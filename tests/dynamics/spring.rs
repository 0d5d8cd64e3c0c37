//! Cubic springs and one-sided stops of oscillators against closed forms, differences and integration in time.

use std::f64::consts::TAU;

use fretwear::dynamics::forced_response::FoundBy;
use fretwear::dynamics::{
    ContactElement, FrictionLaw, HarmonicBalance, Harmonics, Load, Oscillator, Sampling, Settings,
    Spring, Vibration,
};

/// Undamped first resonance at 159.15 Hz.
fn oscillator(springs: Vec<Spring>) -> Oscillator {
    Oscillator {
        mass: [1.0, 2.0, 3.0],
        damping: [2.0, 4.0, 6.0],
        stiffness: [1e6, 3e6, 5e6],
        element: ContactElement {
            area: 0.0,
            friction_coefficient: 0.0,
            law: FrictionLaw::Cone,
            sliders: Vec::new(),
            springs,
        },
    }
}

fn cubic(direction: usize, stiffness: f64) -> Spring {
    Spring::Cubic {
        direction,
        stiffness,
    }
}

fn stop(direction: usize, stiffness: f64, gap: f64) -> Spring {
    Spring::Stop {
        direction,
        stiffness,
        gap,
    }
}

fn balance(
    oscillator: &Oscillator,
    loads: Vec<Load>,
    highest: u32,
) -> HarmonicBalance<ContactElement> {
    let settings = Settings {
        samples: 512,
        ..Settings::default()
    };
    let model = oscillator.model().expect("an oscillator");
    let elements = vec![oscillator.element.clone()];
    HarmonicBalance::new(&model, elements, Harmonics::up_to(highest), loads, settings)
        .expect("a balance")
}

/// With the first harmonic alone m ω² = k + ¾ k₃ a² at the phase resonance, and c ω a = F.
#[test]
fn the_backbone_of_duffing_is_its_closed_form() {
    /// What Newton's method leaves.
    const LEFT: f64 = 1e-8;
    for k3 in [3e11, -1e10] {
        let oscillator = oscillator(vec![cubic(0, k3)]);
        for force in [0.2, 1.0, 3.0] {
            let balance = balance(&oscillator, vec![Oscillator::load(0, force, 0.0)], 1);
            let range = (TAU * 100.0, TAU * 400.0);
            let resonance = balance.phase_resonance(range, None).expect("a resonance");
            let (amplitude, _) = balance.amplitude(&resonance, 0).expect("an amplitude");
            let square = (1e6 + 0.75 * k3 * amplitude * amplitude) / 1.0;
            let omega = resonance.omega;
            assert!((omega * omega / square - 1.0).abs() < LEFT, "{omega}");
            assert!((2.0 * omega * amplitude / force - 1.0).abs() < LEFT);
        }
    }
}

/// A stop without a gap makes the free oscillation one of two halves: its frequency is 2 ω₁ ω₂ / (ω₁ + ω₂).
#[test]
fn a_stop_without_a_gap_has_the_bilinear_frequency() {
    /// What the harmonics above 15 and the damping of 0.1 % leave.
    const LEFT: f64 = 2e-4;
    let oscillator = oscillator(vec![stop(0, 3e6, 0.0)]);
    let balance = balance(&oscillator, vec![Oscillator::load(0, 1.0, 0.0)], 15);
    let range = (TAU * 150.0, TAU * 300.0);
    let resonance = balance.phase_resonance(range, None).expect("a resonance");
    let (first, second) = (1e3, 2e3);
    let exact = 2.0 * first * second / (first + second);
    let error = (resonance.omega / exact - 1.0).abs();
    assert!(error < LEFT, "{error:e}");
}

/// Coefficients of a motion along all directions, large against the gaps.
fn motion(n: usize) -> Vec<f64> {
    let wave = |k: usize| 1e-5 * ((k * k) as f64 * 1.7 + 0.3).sin();
    (0..3 * n).map(wave).collect()
}

#[test]
fn jacobians_of_springs_are_their_differences() {
    /// Of a central difference; a sample between both sides of a kink would leave more.
    const LEFT: f64 = 1e-6;
    let element = ContactElement {
        springs: vec![cubic(0, 2e15), cubic(2, -1e15), stop(1, 4e5, 2e-6)],
        ..super::element(FrictionLaw::Cone)
    };
    let sampling = Sampling::new(Harmonics::up_to(3), 50).expect("samples");
    let n = 7;
    let mut work = sampling.workspace();
    let u = motion(n);
    let (mut force, mut jacobian) = (vec![0.0; 3 * n], vec![0.0; 9 * n * n]);
    sampling.evaluate(&element, &u, &mut force, Some(&mut jacobian), &mut work);
    let largest = jacobian.iter().fold(0.0_f64, |m, j| m.max(j.abs()));
    for column in 0..3 * n {
        let mut at = |shift: f64| {
            let (mut moved, mut force) = (u.clone(), vec![0.0; 3 * n]);
            moved[column] += shift;
            sampling.evaluate(&element, &moved, &mut force, None, &mut work);
            force
        };
        let step = 1e-10;
        let (up, down) = (at(step), at(-step));
        for row in 0..3 * n {
            let difference = (up[row] - down[row]) / (2.0 * step);
            let error = (jacobian[row * 3 * n + column] - difference).abs() / largest;
            assert!(error < LEFT, "{row} {column}: {error:e}");
        }
    }
}

/// Springs store what they take, however few the samples are and wherever a stop touches between them.
#[test]
fn springs_do_no_work() {
    /// Rounding of the sums.
    const ROUNDING: f64 = 1e-13;
    let element = ContactElement {
        sliders: Vec::new(),
        springs: vec![
            cubic(0, 2e15),
            stop(0, 4e5, 2e-6),
            cubic(2, -1e15),
            stop(1, 4e5, 2e-6),
        ],
        ..super::element(FrictionLaw::Cone)
    };
    let harmonics = Harmonics::up_to(3);
    let sampling = Sampling::new(harmonics.clone(), 8).expect("samples");
    let u = motion(7);
    let mut force = vec![0.0; 21];
    sampling.evaluate(&element, &u, &mut force, None, &mut sampling.workspace());
    let size = |row: &[f64]| row.iter().map(|v| v * v).sum::<f64>().sqrt();
    let work = harmonics.work(&force, &u);
    assert!(size(&force) > 1.0);
    assert!(work.abs() <= ROUNDING * size(&force) * size(&u), "{work:e}");
}

/// Forced responses with both kinds of springs, by the balance and in time.
#[test]
fn springs_in_time_are_those_of_the_balance() {
    /// What the harmonics above 15 leave of the first one.
    const HARMONICS: f64 = 2e-3;
    let oscillator = oscillator(vec![cubic(0, 1e11), stop(0, 5e5, 1e-4), stop(2, 1e6, 1e-5)]);
    let loads = vec![
        Oscillator::load(0, 20.0, 0.0),
        Oscillator::load(2, 40.0, 0.5),
    ];
    let vibration = Vibration {
        model: oscillator.model().expect("an oscillator"),
        loads,
        response_port: 0,
        harmonics: Harmonics::up_to(15),
        settings: Settings {
            samples: 512,
            ..Settings::default()
        },
        range: (TAU * 60.0, TAU * 120.0),
        points: Some(5),
        gauge: Default::default(),
        journal: Default::default(),
        surveyed: Default::default(),
        inertial_loads: Vec::new(),
    };
    let of = || {
        let balance = vibration.balance(vec![oscillator.element.clone()]);
        balance.expect("a balance")
    };
    let ours = vibration.forced_response(of()).expect("points");
    let theirs = vibration.forced_response_in_time(&of()).expect("points");
    for (ours, theirs) in ours.iter().zip(&theirs) {
        assert_eq!(
            (ours.found_by, theirs.found_by),
            (FoundBy::Balance, FoundBy::Time)
        );
        let amplitude = |point: &fretwear::dynamics::ForcedPoint| {
            let response = point.response.as_ref();
            response.expect("a response").amplitude
        };
        let apart = (amplitude(ours) / amplitude(theirs) - 1.0).abs();
        assert!(apart < HARMONICS, "{apart:e} at {} Hz", ours.frequency);
    }
}
