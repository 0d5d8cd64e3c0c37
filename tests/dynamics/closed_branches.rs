//! Branches that close upon themselves, and what is found on them alone.

use std::f64::consts::TAU;

use super::survey::vibration;
use fretwear::dynamics::{
    ContactElement, ContinuationSettings, FrictionLaw, Load, Oscillator, Response, Slider,
};

/// Pressed, and driven below the resonance of its closed contact by less than what opens it: near half of that frequency it bounces twice in a
/// period. Damping is of the ratio 0.00883974 with its contact stuck.
fn twice_in_a_period() -> (Oscillator, Vec<Load>, (f64, f64)) {
    let oscillator = Oscillator {
        mass: [1.0; 3],
        damping: [4.375_74, 4.375_74, 9.286_09],
        stiffness: [55_400.1, 55_400.1, 93_112.4],
        element: ContactElement {
            springs: Vec::new(),
            area: 0.0,
            friction_coefficient: 0.484,
            law: FrictionLaw::Box,
            sliders: vec![Slider {
                normal_load: 2.862_13,
                gap: 0.0,
                tangential_stiffness: 5_857.2,
                normal_stiffness: 182_772.0,
            }],
        },
    };
    let constant = Load {
        port: 2,
        harmonic: 0,
        cosine: 0.510_638,
        sine: 0.0,
    };
    let loads = vec![
        Oscillator::load(0, 0.190_967, (-28.9_f64).to_radians()),
        Oscillator::load(2, 2.174_84, (-82.8_f64).to_radians()),
        constant,
    ];
    (oscillator, loads, (26.2724, 44.5667))
}

#[test]
fn a_mass_that_bounces_twice_in_a_period_is_found() {
    // By `tests/dynamics/time_integration.py`, at 39.0845 Hz.
    const IN_TIME: f64 = 1.423_205_235e-5;
    const KNOWN: f64 = 0.02;
    let (oscillator, loads, range) = twice_in_a_period();
    let vibration = vibration(&oscillator, loads, 2, range);
    let resolved = vibration
        .resolve(vec![oscillator.element], None, None)
        .expect("a resonance");
    let (peak, bar) = (
        resolved.resonance.peak_amplitude,
        resolved.truncation.amplitude,
    );
    let off = (peak / IN_TIME - 1.0).abs();
    assert!((off..KNOWN).contains(&bar), "{peak} m, {bar}, off by {off}");
}

/// Wherever it is begun, a closed branch passes each frequency twice, ends where it begins, and is the same.
#[test]
fn a_closed_branch_goes_around_once() {
    // Points lie elsewhere, and the branch is curved between them.
    const SAME: f64 = 1e-3;
    let (oscillator, loads, range) = twice_in_a_period();
    let vibration = vibration(&oscillator, loads, 2, range);
    let balance = vibration
        .balance(vec![oscillator.element.clone()])
        .expect("a balance");
    let survey = vibration.survey(&balance).expect("a survey");
    let closed = |branch: &&Vec<Response>| branch.first() == branch.last();
    let rings: Vec<&Vec<Response>> = survey.branches.iter().filter(closed).collect();
    let [ring] = rings[..] else {
        panic!("{} closed branches", rings.len());
    };
    let extent = |branch: &[Response]| {
        let omegas = branch.iter().map(|response| response.omega);
        let [low, high] = [f64::INFINITY, f64::NEG_INFINITY];
        omegas.fold([low, high], |[low, high], omega| {
            [low.min(omega), high.max(omega)]
        })
    };
    let [low, high] = extent(ring);
    let middle = 0.5 * (low + high);
    let passes = |branch: &[Response]| {
        let pairs = branch.windows(2);
        let across = pairs.filter(|pair| (pair[0].omega < middle) != (pair[1].omega < middle));
        across.count()
    };
    assert_eq!(passes(ring), 2);
    let along = ContinuationSettings::over(TAU * range.0, TAU * range.1, 2);
    for seed in ring.iter().step_by(ring.len() / 5) {
        let again = balance.through(seed, along).expect("a branch");
        assert_eq!(again.first(), again.last());
        assert_eq!(passes(&again), 2);
        for (a, b) in extent(&again).into_iter().zip([low, high]) {
            assert!((a / b - 1.0).abs() < SAME, "{a} for {b}");
        }
    }
}

/// With more harmonics, peak and phase resonance are each looked for by itself: neither is below the other.
#[test]
fn no_phase_resonance_is_above_the_peak() {
    let oscillator = Oscillator {
        mass: [1.0; 3],
        damping: [0.164_683, 0.145_631, 0.090_886_4],
        stiffness: [84_882.2, 66_378.4, 25_853.3],
        element: ContactElement {
            springs: Vec::new(),
            area: 0.0,
            friction_coefficient: 0.643,
            law: FrictionLaw::Cone,
            sliders: vec![Slider {
                normal_load: 0.0,
                gap: 0.013_216_2,
                tangential_stiffness: 19_811.8,
                normal_stiffness: 15_085.1,
            }],
        },
    };
    let constant = Load {
        port: 2,
        harmonic: 0,
        cosine: -16.8897,
        sine: 0.0,
    };
    let loads = vec![
        Oscillator::load(0, 16.0963, (-111.0_f64).to_radians()),
        Oscillator::load(1, 31.4303, (-90.0_f64).to_radians()),
        Oscillator::load(2, 166.734, (-164.0_f64).to_radians()),
        constant,
    ];
    let mut vibration = vibration(&oscillator, loads, 2, (23.18, 77.25));
    vibration.points = Some(53);
    vibration.harmonics = fretwear::dynamics::Harmonics::up_to(3);
    let resolved = vibration
        .resolve(vec![oscillator.element], None, Some(0.005))
        .expect("a resonance");
    let resonance = resolved.resonance;
    assert!(resonance.phase.is_some());
    assert!(
        resonance.peak_amplitude >= resonance.amplitude,
        "{} below {}",
        resonance.peak_amplitude,
        resonance.amplitude
    );
}
