//! Tests of forced responses of banks of sliders that start at their phase resonance in both directions, against forced responses from one
//! end of the range.

use std::f64::consts::TAU;

use fretwear::dynamics::{ForcedPoint, FrictionLaw, HarmonicBalance, Oscillator, Start, Vibration};
use fretwear::journal::Journal;
use fretwear::threads::Threads;

use super::bank::bank;
use super::{drive, oscillator, vibration};

/// Error of linear interpolation between points, relative to the peak; steps of a seventh on a circle of diameter 1 have the same error.
const BETWEEN_POINTS: f64 = 0.02;

const RANGE: (f64, f64) = (TAU * 700.0, TAU * 1100.0);

fn joint() -> Oscillator {
    let oscillator = oscillator(FrictionLaw::Cone);
    Oscillator {
        element: bank(&oscillator.element, 8),
        ..oscillator
    }
}

fn of(threads: usize) -> Vibration {
    Vibration {
        threads: Threads::new(threads),
        ..vibration(&joint(), 3, drive(120.0), RANGE)
    }
}

fn balance(vibration: &Vibration) -> HarmonicBalance<fretwear::dynamics::ContactElement> {
    let balance = vibration.balance(vec![joint().element]);
    balance.expect("a balance")
}

fn resonance(vibration: &Vibration) -> Start {
    let found = balance(vibration).phase_resonance(RANGE, None);
    found.expect("a resonance").start()
}

fn points(vibration: &Vibration, start: Option<&Start>) -> Vec<ForcedPoint> {
    let found = vibration.forced_response_through(&balance(vibration), start);
    found.expect("points")
}

/// Amplitude between the points, by linear interpolation.
fn between(points: &[ForcedPoint], frequency: f64) -> f64 {
    let amplitude = |point: &ForcedPoint| point.response.as_ref().expect("a response").amplitude;
    let pair = points
        .windows(2)
        .find(|pair| (pair[0].frequency..=pair[1].frequency).contains(&frequency));
    let [low, high] = pair.expect("within the range") else {
        unreachable!("pairs");
    };
    let share = (frequency - low.frequency) / (high.frequency - low.frequency);
    amplitude(low) + share * (amplitude(high) - amplitude(low))
}

#[test]
fn it_is_the_curve_from_one_end_in_fewer_points() {
    let vibration = of(1);
    let start = resonance(&vibration);
    let (whole, halves) = (points(&vibration, None), points(&vibration, Some(&start)));
    assert!(
        halves.len() as f64 <= 0.7 * whole.len() as f64,
        "{} of {}",
        halves.len(),
        whole.len()
    );
    let ends = [&halves[0], &halves[halves.len() - 1]].map(|point| TAU * point.frequency);
    assert!((ends[0] / RANGE.0 - 1.0).abs() < 1e-12 && (ends[1] / RANGE.1 - 1.0).abs() < 1e-12);
    assert!(
        halves
            .iter()
            .any(|point| (TAU * point.frequency / start.omega - 1.0).abs() < 1e-6)
    );
    let top = whole
        .iter()
        .filter_map(|point| point.response.as_ref())
        .map(|response| response.amplitude)
        .fold(0.0, f64::max);
    for point in &whole {
        let own = point.response.as_ref().expect("a response").amplitude;
        let other = between(&halves, point.frequency);
        assert!(
            (own - other).abs() < BETWEEN_POINTS * top,
            "{} Hz: {own} {other}",
            point.frequency
        );
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let alone = of(1);
    let start = resonance(&alone);
    let expected = points(&alone, Some(&start));
    for threads in [2, 3, 8] {
        let vibration = of(threads);
        assert_eq!(resonance(&vibration), start, "{threads} threads");
        assert_eq!(
            points(&vibration, Some(&start)),
            expected,
            "{threads} threads"
        );
    }
}

#[test]
fn it_is_kept_and_read_back() {
    let vibration = of(1);
    let start = resonance(&vibration);
    let with = |kept: &[u8]| {
        let journal = Journal::default();
        let (send, receive) = std::sync::mpsc::channel();
        let keep = Box::new(move |bytes: &[u8]| send.send(bytes.to_vec()).is_ok());
        let results = journal.open(kept, std::time::Duration::ZERO, keep);
        let vibration = Vibration {
            journal: journal.clone(),
            ..of(2)
        };
        let points = points(&vibration, Some(&start));
        journal.close();
        (
            points,
            results,
            receive.try_iter().flatten().collect::<Vec<u8>>(),
        )
    };
    let (first, _, kept) = with(&[]);
    let (second, results, rest) = with(&kept);
    assert!(results >= 2, "{results} results");
    assert_eq!(second, first);
    assert!(rest.is_empty(), "all of it was kept");
}
