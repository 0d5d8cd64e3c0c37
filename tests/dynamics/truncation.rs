//! Tests of the estimated truncation error against a balance with many harmonics, and of the extension of harmonics up to a tolerance.

use std::slice::from_ref;

use fretwear::dynamics::{
    ContactElement, FrictionLaw, Harmonics, Oscillator, TruncationError, Vibration,
};

use super::{BOTH, drive, oscillator, samples};

/// The range begins below the sliding resonance along x and ends above the stuck one.
const RANGE: (f64, f64) = (4000.0, 7500.0);
/// Highest harmonic of the reference: its truncation error is below a thousandth of the measured errors.
const ALL: u32 = 63;
/// Relative error of the reference.
const OWN: f64 = 2e-5;

fn vibration(oscillator: &Oscillator, force: f64, harmonics: Harmonics) -> Vibration {
    Vibration {
        harmonics,
        settings: samples(16 * ALL as usize),
        ..super::vibration(oscillator, 1, drive(force), RANGE)
    }
}

/// Frequency, amplitude and dissipation of a resonance, their estimated errors, and the highest harmonic.
fn resolved(
    elements: &[ContactElement],
    vibration: &Vibration,
    tolerance: Option<f64>,
) -> ([f64; 3], TruncationError, u32) {
    let resolved = vibration
        .resolve(elements.to_vec(), None, tolerance)
        .unwrap_or_else(|error| panic!("{error}"));
    let resonance = &resolved.resonance;
    let figures = [
        resonance.governing().omega,
        resonance.amplitude,
        resonance.governing().energy.friction,
    ];
    let highest = resolved.balance.harmonics().highest();
    (figures, resolved.truncation, highest)
}

fn off(found: [f64; 3], truth: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| (found[k] / truth[k] - 1.0).abs())
}

#[test]
fn estimates_hold_the_truth() {
    let sets = [&[0, 1][..], &[0, 1, 3], &[0, 1, 2, 3], &[0, 1, 3, 5]];
    for law in BOTH {
        let oscillator = oscillator(law);
        let elements = [oscillator.element.clone()];
        // The elements slip occasionally, most of the time, and nearly always.
        for force in [60.0, 150.0, 400.0] {
            let all = vibration(&oscillator, force, Harmonics::up_to(ALL));
            let (truth, own, _) = resolved(&elements, &all, None);
            assert!(own.amplitude < OWN, "{own:?}");
            for orders in sets {
                let harmonics = Harmonics::new(orders).expect("harmonics");
                let few = vibration(&oscillator, force, harmonics);
                let (found, errors, _) = resolved(&elements, &few, None);
                let [frequency, amplitude, energy] = off(found, truth);
                let bars = [errors.frequency, errors.amplitude, errors.friction_energy];
                println!(
                    "{law:?} {force} N {orders:?}: {:?} of {bars:?}",
                    off(found, truth)
                );
                for (error, bar) in [frequency, amplitude, energy].into_iter().zip(bars) {
                    assert!(
                        error <= bar + OWN,
                        "{law:?}, {force} N, {orders:?}: off by {error:e}, estimated {bar:e}"
                    );
                }
                // The estimate must not be much larger than the error.
                let largest = frequency.max(amplitude).max(energy);
                assert!(errors.amplitude < 20.0 * largest + OWN, "{errors:?}");
            }
        }
    }
}

#[test]
fn a_joint_that_sticks_leaves_nothing_out() {
    let oscillator = oscillator(FrictionLaw::Cone);
    let stuck = vibration(&oscillator, 0.5, Harmonics::up_to(1));
    let (_, errors, _) = resolved(from_ref(&oscillator.element), &stuck, None);
    assert_eq!(errors, TruncationError::NONE);
}

#[test]
fn harmonics_are_extended_until_they_suffice() {
    let oscillator = oscillator(FrictionLaw::Cone);
    let elements = [oscillator.element.clone()];
    let vibration_of = |harmonics| vibration(&oscillator, 150.0, harmonics);
    let (truth, ..) = resolved(&elements, &vibration_of(Harmonics::up_to(ALL)), None);
    let mut before = 0;
    for tolerance in [0.1, 1e-3, 2e-4] {
        let begin = vibration_of(Harmonics::up_to(1));
        let (found, errors, highest) = resolved(&elements, &begin, Some(tolerance));
        println!("{tolerance:e}: harmonics 0 to {highest}, {errors:?}");
        assert!(highest >= before, "{highest} after {before}");
        // The error of the sampling adds to the truncation error.
        let most = tolerance + 2.0 * OWN;
        assert!(errors.amplitude <= most && errors.friction_energy <= most);
        let [_, amplitude, energy] = off(found, truth);
        assert!(amplitude <= tolerance && energy <= tolerance);
        before = highest;
    }
    assert!(before > 3);
    // The estimate reports a tolerance that the largest number of harmonics does not reach.
    let begin = vibration_of(Harmonics::up_to(3));
    let (_, errors, highest) = resolved(&elements, &begin, Some(1e-14));
    assert_eq!(highest, 31);
    assert!(errors.amplitude > 1e-14);
}

/// A start in other harmonics keeps the values of common orders and is 0 in the other orders.
#[test]
fn rows_in_other_harmonics() {
    let (from, to) = (Harmonics::new(&[0, 1, 3]), Harmonics::up_to(2));
    let (from, to) = (from.expect("harmonics"), to);
    let rows = [1.0, 2.0, 3.0, 4.0, 5.0, -1.0, -2.0, -3.0, -4.0, -5.0];
    assert_eq!(
        from.transfer(&rows, &to),
        [1.0, 2.0, 3.0, 0.0, 0.0, -1.0, -2.0, -3.0, 0.0, 0.0]
    );
    let there = from.transfer(&rows, &from.beyond());
    assert_eq!(from.beyond().highest(), 7);
    assert_eq!(from.beyond().transfer(&there, &from), rows);
}

/// The extension doubles the highest order, but adds few orders to a few high ones, and not many to very many.
#[test]
fn orders_beyond() {
    let beyond = |orders: &[u32]| Harmonics::new(orders).expect("harmonics").beyond();
    assert_eq!(beyond(&[0, 1]), Harmonics::up_to(3));
    assert_eq!(beyond(&[0, 1, 3, 5]), Harmonics::up_to(11));
    assert_eq!(beyond(&[0, 1, 1000]).orders().len(), 14);
    let many: Vec<u32> = (0..=100).collect();
    assert_eq!(beyond(&many), Harmonics::up_to(108));
}

/// An element without friction that opens dissipates nothing: sampled work of its normal force is entirely error.
#[test]
fn no_friction_has_no_energy() {
    let mut opening = oscillator(FrictionLaw::Cone);
    opening.element.friction_coefficient = 0.0;
    opening.element.sliders[0].tangential_stiffness = 0.0;
    opening.element.sliders[0].normal_load = 10.0;
    let mut vibration = vibration(&opening, 100.0, Harmonics::up_to(5));
    vibration.settings.samples = 64;
    vibration.loads = vec![Oscillator::load(2, 100.0, 0.0)];
    vibration.response_port = 2;
    vibration.range = (3000.0, 9000.0);
    let ([_, _, work], errors, _) = resolved(from_ref(&opening.element), &vibration, None);
    println!("{work:e} J, {errors:?}");
    assert!(
        errors.amplitude > 0.0 && errors.amplitude < 0.1,
        "{errors:?}"
    );
    assert!(work != 0.0 && errors.friction_energy >= 1.0, "{errors:?}");
}

/// The response across the motion is zero: the error 0 over 0 is not a NaN.
#[test]
fn a_response_that_is_zero() {
    let oscillator = oscillator(FrictionLaw::Cone);
    let mut vibration = vibration(&oscillator, 150.0, Harmonics::up_to(3));
    vibration.response_port = 1;
    let elements = vec![oscillator.element.clone()];
    let balance = vibration.balance(elements.clone()).expect("a balance");
    let along = balance
        .phase_resonance(RANGE, None)
        .unwrap_or_else(|error| panic!("{error}"));
    let (across, _) = balance.amplitude(&along, 1).expect("a port");
    assert_eq!(across, 0.0);
    // The solver may not find the peak of a zero response; if it does, the errors are numbers.
    if let Ok(resolved) = vibration.resolve(elements, None, None) {
        let errors = resolved.truncation;
        assert!(errors.amplitude.is_finite() && errors.friction_energy.is_finite());
    }
}

#[test]
fn points_of_a_forced_response_know_what_they_leave_out() {
    let law = FrictionLaw::Box;
    let oscillator = oscillator(law);
    let points = |orders: Harmonics| {
        let vibration = Vibration {
            points: Some(9),
            ..vibration(&oscillator, 150.0, orders)
        };
        let balance = vibration.balance(vec![oscillator.element.clone()]);
        let balance = balance.expect("a balance");
        let mut points = vibration.forced_response(&balance).expect("a response");
        vibration.estimate_errors(&balance, &mut points);
        points
    };
    let all = points(Harmonics::up_to(ALL));
    for orders in [&[0, 1][..], &[0, 1, 3], &[0, 1, 3, 5]] {
        let few = points(Harmonics::new(orders).expect("harmonics"));
        let mut slipping = 0;
        for (few, all) in few.iter().zip(&all) {
            let [few, truth] = [few, all].map(|point| point.response.as_ref().expect("a response"));
            let figures = [
                (few.amplitude, truth.amplitude, few.error),
                (
                    few.solution.energy.friction,
                    truth.solution.energy.friction,
                    few.friction_error,
                ),
            ];
            for (figure, truth, bar) in figures {
                let bar = bar.expect("an error that is known");
                let off = (truth - figure).abs();
                assert!(
                    off <= bar * figure.abs() + OWN * truth.abs(),
                    "{orders:?}: {figure:e} for {truth:e}, bar {bar:e}"
                );
            }
            match few.solution.active_elements() {
                0 => assert_eq!((few.error, few.friction_error), (Some(0.0), Some(0.0))),
                _ => slipping += 1,
            }
        }
        assert!(slipping > 2, "{slipping} points slip");
    }
}
