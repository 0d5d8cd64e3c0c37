//! Steps that end at an event.

use fretwear::wear::event_search::EventSearch;

const TOLERANCE: f64 = 0.1;
/// Largest relative distance of the end of a step beyond the event.
const BAND: f64 = 0.01;
/// Largest number of steps for one event, including the first, if the quantity is a power of the cycles.
const STEPS: usize = 4;

/// Largest number of steps for one event, including the first, for any quantity.
const MOST: usize = 9;

/// Lengths of the steps tried for one event, beginning with `cycles`.
fn land(begin: f64, cycles: u64, reached: impl Fn(u64) -> f64) -> Vec<u64> {
    let mut landing = EventSearch::new(begin, TOLERANCE);
    let mut lengths = vec![cycles];
    while let Some(next) = landing.next_length(
        lengths[lengths.len() - 1],
        reached(lengths[lengths.len() - 1]),
    ) {
        lengths.push(next);
    }
    lengths
}

#[test]
fn a_power_of_the_cycles_is_met_in_a_few_steps() {
    for power in [0.3, 0.5, 0.7, 1.0, 1.6] {
        for begin in [0.0, 0.4, 0.97] {
            for event in [1e4, 3e5, 9.9e5] {
                let reached = |n: u64| begin + (1.0 - begin) * (n as f64 / event).powf(power);
                let lengths = land(begin, (5.0 * event) as u64, reached);
                let end = reached(lengths[lengths.len() - 1]);
                assert!(
                    (1.0..=1.0 + BAND).contains(&end),
                    "{power} {begin} {event}: {end}"
                );
                assert!(
                    lengths.len() <= STEPS,
                    "{power} {begin} {event}: {lengths:?}"
                );
            }
        }
    }
}

/// A stiffness that rises and saturates, as in running-in.
#[test]
fn a_curve_that_levels_off_is_met() {
    for event in [2e4, 8e4, 4e5] {
        let level = |n: f64| n / (n + 1e5);
        let reached = |n: u64| level(n as f64) / level(event);
        let lengths = land(0.0, 2_000_000, reached);
        let end = reached(lengths[lengths.len() - 1]);
        assert!((1.0..=1.0 + BAND).contains(&end), "{event}: {lengths:?}");
    }
}

#[test]
fn a_step_that_does_not_pass_the_event_stands() {
    assert_eq!(land(0.2, 500, |n| 0.2 + 0.001 * n as f64), [500]);
    assert_eq!(land(0.0, 500, |_| 1.0), [500]);
    // The event lies before the beginning of the step.
    assert_eq!(land(1.3, 500, |n| 1.3 + n as f64), [500]);
}

/// At a discontinuity, no step ends within the band. The search accepts a step beyond the event and never tries a step that is longer than
/// needed.
#[test]
fn a_jump_is_passed() {
    for jump in [1, 2, 17, 30, 700_000] {
        let cycles = if jump < 31 { 30 } else { 1_000_000 };
        let lengths = land(0.0, cycles, |n| if n < jump { 0.5 } else { 1.5 });
        let (last, others) = lengths.split_last().expect("a step");
        assert!(*last >= jump, "{lengths:?}");
        assert!(others.iter().all(|n| *n < jump || n >= last), "{lengths:?}");
        assert!(lengths.len() <= MOST, "{lengths:?}");
    }
}

/// Dozens of events within one step are finer than the steps. The search does not shorten the step.
#[test]
fn dozens_of_events_do_not_cut_a_step() {
    assert_eq!(land(0.0, 900, |n| n as f64), [900]);
    assert!(land(0.0, 9, |n| n as f64).len() > 1);
}
