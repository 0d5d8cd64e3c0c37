//! Steps cut to end at an event.

use fretwear::wear::landing::Landing;

const BAND: f64 = 0.01;
/// Steps made for one event, the first included, where the way to it is a power of the cycles.
const STEPS: usize = 4;

/// Makes steps of a run that would go on for `cycles`, and gives the lengths tried.
fn land(begin: f64, cycles: u64, reached: impl Fn(u64) -> f64) -> Vec<u64> {
    let mut landing = Landing::new(begin, BAND);
    let mut lengths = vec![cycles];
    while let Some(next) = landing.next(
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
                let lengths = land(begin, 1_000_000, reached);
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

/// Stiffness that rises and levels off, as that of a joint in running-in.
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
    // An event behind the beginning is not in the step.
    assert_eq!(land(1.3, 500, |n| 1.3 + n as f64), [500]);
}

/// A jump has no end within the band: the step ends with the cycle that jumps, or gives up beyond it.
#[test]
fn a_jump_is_in_the_last_cycle() {
    for jump in [1, 2, 17, 30] {
        let lengths = land(0.0, 30, |n| if n < jump { 0.5 } else { f64::INFINITY });
        assert_eq!(lengths[lengths.len() - 1], jump, "{lengths:?}");
    }
}
