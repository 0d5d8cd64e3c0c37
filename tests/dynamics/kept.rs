//! An interrupted forced response continues after its stored results and ends in the same bits.

use std::f64::consts::TAU;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use fretwear::dynamics::forced_response::ForcedPoint;
use fretwear::dynamics::{FrictionLaw, Vibration};
use fretwear::journal::Journal;

use super::{drive, oscillator, vibration};

const RANGE: (f64, f64) = (TAU * 700.0, TAU * 1100.0);

/// Points of a start that reads `kept`, the number of results in `kept`, and the results that the start stores.
fn start(
    kept: &[u8],
    respond: impl Fn(&Journal) -> Vec<ForcedPoint>,
) -> (Vec<ForcedPoint>, usize, Vec<Vec<u8>>) {
    let parts: Arc<Mutex<Vec<Vec<u8>>>> = Arc::default();
    let theirs = parts.clone();
    let journal = Journal::default();
    let keep = move |part: &[u8]| {
        theirs.lock().expect("parts").push(part.to_vec());
        true
    };
    let count = journal.open(kept, Duration::ZERO, Box::new(keep));
    let points = respond(&journal);
    journal.close();
    let parts = parts.lock().expect("parts").clone();
    (points, count, parts)
}

fn goes_on(respond: impl Fn(&Journal) -> Vec<ForcedPoint>) {
    let whole = respond(&Journal::default());
    let (first, count, parts) = start(&[], &respond);
    assert_eq!((count, &first), (0, &whole));
    let cut = parts.len() / 2;
    assert!(cut > 2, "{} parts", parts.len());
    // The last result is incomplete.
    let mut kept = parts[..cut].concat();
    kept.extend(&parts[cut][..parts[cut].len() / 2]);
    let (second, count, rest) = start(&kept, &respond);
    assert_eq!((count, &second), (cut, &whole));
    assert_eq!(
        rest,
        parts[cut..],
        "the start solves the remaining points only"
    );
    let (third, count, rest) = start(&parts.concat(), &respond);
    assert_eq!((count, &third), (parts.len(), &whole));
    assert!(rest.is_empty());
    // The program rejects results of other inputs.
    let mut other = kept.clone();
    other[0] ^= 1;
    let (fourth, _, rest) = start(&other, &respond);
    assert_eq!(fourth, whole);
    assert!(
        rest.is_empty(),
        "the start appended to results of other inputs"
    );
}

#[test]
fn an_interrupted_forced_response_goes_on() {
    let oscillator = oscillator(FrictionLaw::Cone);
    for points in [None, Some(9)] {
        goes_on(|journal| {
            let vibration = Vibration {
                journal: journal.clone(),
                points,
                ..vibration(&oscillator, 3, drive(120.0), RANGE)
            };
            let balance = vibration.balance(vec![oscillator.element.clone()]);
            let points = vibration.forced_response(&balance.expect("a balance"));
            points.expect("points")
        });
    }
}

/// The error search of the points has the same budget of evaluations, including the evaluations of an earlier start.
#[test]
fn an_interrupted_search_ends_at_the_same_place() {
    let oscillator = oscillator(FrictionLaw::Cone);
    goes_on(|journal| {
        let vibration = Vibration {
            journal: journal.clone(),
            ..vibration(&oscillator, 3, drive(120.0), RANGE)
        };
        let found = vibration.resolve_over_range(vec![oscillator.element.clone()], Some(0.005));
        found.expect("a resonance").points.expect("points")
    });
}
