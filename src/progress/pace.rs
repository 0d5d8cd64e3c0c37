//! How long a run will still take: before it has worn by what runs take, then from what it has done since this start.

use std::collections::VecDeque;
use std::time::Instant;

use fretwear::stages::Stage;

use super::prior::{Prior, WORN};

/// Steps from which the growth of steps is taken: an even number, of which each half is one length.
const OF_LATE: usize = 4;
/// By how much one step of the wear is longer than the one before, until steps have shown it: what the shipped scenes have.
const GROWTH: f64 = 1.35;
/// More than that is an exception and does not go on.
const MOST_GROWTH: f64 = 1.6;
/// What takes longer than expected has at least this part left of what it took so far.
const LAST: f64 = 0.05;
/// Points from which on the pace of a forced response tells when it ends.
const TELLING: u64 = 3;
/// A forced response whose points say this part of what the one before makes expect is a quick one.
const QUICK: f64 = 0.25;
/// Steps after which a run is known by its own alone: before, what runs take counts too.
const KNOWN: usize = 4;

/// The pace of a run.
#[derive(Debug, Default)]
pub struct Pace {
    /// What is known before the run has shown it.
    prior: Option<Prior>,
    /// The last iterations: what part of the run was behind each.
    parts: VecDeque<f64>,
    /// The stage that is computed, and since when.
    stage: Option<(Stage, Instant)>,
    /// Seconds and points of the longest forced response: they are computed at the first iteration and at the last, and where they are
    /// asked for.
    response: (f64, u64),
    /// Seconds of all other stages of iterations that wear, and how many of these there were.
    seconds: f64,
    iterations: usize,
    /// Cycles behind the first iteration of this start, and of the last.
    cycles: Option<[u64; 2]>,
    /// When the first iteration of this start was committed.
    first: Option<Instant>,
}

/// Seconds to go, counted down from an instant.
#[derive(Debug, Clone, Copy)]
pub struct Left {
    since: Instant,
    /// Of what is being computed.
    seconds: f64,
    /// Of the run after it.
    after: f64,
    /// By what runs take, not yet by what this one took.
    pub rough: bool,
    /// Points of the forced response before; 0 of what is none, or is not known.
    points: u64,
}

impl Pace {
    /// The pace of a run of which nothing is known but what runs take.
    pub fn new(prior: Option<Prior>) -> Pace {
        Pace {
            prior,
            ..Pace::default()
        }
    }

    /// What earlier starts of a run have recorded: the part that was behind each of the last iterations but the very last, their seconds
    /// without forced responses, and the seconds of the first forced response.
    pub fn recorded(&mut self, iterations: &[(f64, f64)], response: f64) {
        let late = iterations.len().saturating_sub(OF_LATE);
        for (part, seconds) in &iterations[late..] {
            self.parts.push_back(*part);
            self.seconds += seconds;
            self.iterations += 1;
        }
        self.response = (response, 0);
    }

    /// A stage begins, in a run that may have `more` forced responses; that before had so many points. What is left, where this
    /// says it anew.
    pub fn enters(&mut self, stage: Stage, points: u64, more: bool) -> Option<Left> {
        self.leaves(points);
        self.stage = Some((stage, Instant::now()));
        let is_response = stage == Stage::ForcedResponse;
        if self.first.is_none() {
            let prior = self.prior.as_ref()?;
            return Some(Left {
                rough: true,
                ..Left::new(prior.stage(stage), prior.after(stage))
            });
        }
        let (seconds, points) = self.response;
        if !is_response || seconds == 0.0 {
            return None;
        }
        // One of the steps is being made, and after the last nothing is left.
        let steps = match more {
            true => (self.steps().unwrap_or(1.0) - 1.0).round(),
            false => 0.0,
        };
        let last = if steps > 0.0 { WORN * seconds } else { 0.0 };
        Some(Left {
            points,
            ..Left::new(WORN * seconds, steps * self.step() + last)
        })
    }

    fn leaves(&mut self, points: u64) {
        let Some((stage, since)) = self.stage.take() else {
            return;
        };
        let seconds = since.elapsed().as_secs_f64();
        if let (Some(prior), None) = (&mut self.prior, self.first) {
            prior.took(stage, seconds);
        }
        match stage {
            Stage::ForcedResponse if seconds > self.response.0 => self.response = (seconds, points),
            Stage::ForcedResponse => (),
            // What comes before the first commit is not part of a step.
            _ if self.first.is_none() => (),
            _ => self.seconds += seconds,
        }
    }

    /// An iteration is committed: the part of the run, and the cycles, that are behind it.
    pub fn committed(&mut self, part: f64, cycles: u64, points: u64) {
        self.leaves(points);
        match self.first {
            None => self.first = Some(Instant::now()),
            Some(_) => self.iterations += 1,
        }
        self.cycles = Some([self.cycles.map_or(cycles, |[first, _]| first), cycles]);
        self.parts.push_back(part);
        if self.parts.len() > OF_LATE + 1 {
            self.parts.pop_front();
        }
    }

    /// Cycles a second since the first commit of this start; none before a step is done.
    pub fn rate(&self) -> Option<f64> {
        let [from, to] = self.cycles.filter(|[from, to]| to > from)?;
        Some((to - from) as f64 / self.first?.elapsed().as_secs_f64())
    }

    /// What is left after a commit; none where nothing is known.
    pub fn left(&self) -> Option<Left> {
        let last = WORN * self.response.0;
        let own = self.steps().map(|steps| steps * self.step());
        // Of a run that goes on the prior knows no part.
        let begun = self.parts.front().is_some_and(|part| *part == 0.0);
        let prior = self.prior.as_ref().filter(|_| begun);
        let prior = prior.map(|prior| {
            let last_of_prior = WORN * prior.stage(Stage::ForcedResponse);
            (prior.worn() - last_of_prior - self.seconds).max(0.0)
        });
        let seconds = match (own, prior) {
            (Some(own), Some(prior)) if self.iterations < KNOWN && prior > 0.0 => {
                // The logarithms of both, by how many steps have shown it.
                let weight = self.iterations as f64 / KNOWN as f64;
                (weight * own.ln() + (1.0 - weight) * prior.ln()).exp()
            }
            (Some(own), _) => own,
            (None, prior) => prior?,
        };
        Some(Left {
            rough: own.is_none(),
            ..Left::new(seconds, last)
        })
    }

    fn steps(&self) -> Option<f64> {
        steps_left(self.parts.iter().copied().collect::<Vec<f64>>().as_slice())
    }

    /// Seconds of an iteration without its forced response.
    fn step(&self) -> f64 {
        self.seconds / self.iterations.max(1) as f64
    }
}

impl Left {
    fn new(seconds: f64, after: f64) -> Left {
        Left {
            since: Instant::now(),
            seconds,
            after,
            rough: false,
            points: 0,
        }
    }

    /// Seconds to the end of the run, with as many points of a forced response done.
    pub fn now(&self, points: u64) -> f64 {
        self.at(self.since.elapsed().as_secs_f64(), points)
    }

    fn at(&self, elapsed: f64, points: u64) -> f64 {
        let least = LAST * elapsed;
        let by_time = (self.seconds - elapsed).max(least);
        if self.points == 0 {
            return by_time + self.after;
        }
        let part = self.points as f64 / points.max(1) as f64 - 1.0;
        let by_points = (elapsed * part).max(least);
        let (is_quick, is_late) = (by_points < QUICK * by_time, by_time == least);
        let own = match points >= TELLING && (is_quick || is_late) {
            true => by_points,
            // The nearer the end, the more its points tell.
            false => {
                let done = (points as f64 / self.points as f64).min(1.0).powi(2);
                by_time + done * (by_points - by_time)
            }
        };
        own + self.after
    }
}

/// Steps to 1 from the last of `parts`, if their lengths go on growing as they do; none if there is no step, or none that is any.
fn steps_left(parts: &[f64]) -> Option<f64> {
    let steps = parts.len().checked_sub(1).filter(|steps| *steps > 0)?;
    let [first, last] = [parts[0], parts[steps]];
    let half = steps / 2;
    let growth = match half {
        // Of two steps the second may be short for an update of the model.
        0 | 1 => GROWTH,
        _ => {
            let middle = parts[steps - half];
            let before = parts[steps - 2 * half];
            ((last - middle) / (middle - before)).powf(1.0 / half as f64)
        }
    };
    // No wear in the first half: nothing is known of growth.
    let growth = if growth.is_finite() {
        growth.clamp(1.0, MOST_GROWTH)
    } else {
        GROWTH
    };
    let next = (last - first) / steps as f64 * growth.powf((steps + 1) as f64 / 2.0);
    let ratio = Some((1.0 - last) / next).filter(|ratio| ratio.is_finite() && *ratio >= 0.0)?;
    Some(if growth - 1.0 < 1e-3 {
        ratio.max(1.0)
    } else {
        ((1.0 + ratio * (growth - 1.0)).ln() / growth.ln()).max(1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::{Left, steps_left};

    #[test]
    fn a_forced_response_is_timed_by_its_points_and_never_over() {
        let response = Left {
            points: 50,
            ..Left::new(30.0, 2.0)
        };
        let close = |elapsed, points, expected: f64| {
            let left = response.at(elapsed, points);
            assert!((left - expected).abs() < 1e-9, "{left} of {expected}");
        };
        close(0.0, 0, 32.0);
        // Between the 10 s of the time and the 20 s of the points.
        close(20.0, 25, 14.5);
        // Half of the points after more than was expected: as long again.
        close(40.0, 25, 42.0);
        // Half of the points in a tenth of the time.
        close(3.0, 25, 5.0);
        // More points than the one before had.
        close(40.0, 60, 4.0);
    }

    #[test]
    fn what_is_no_forced_response_is_counted_down_and_never_over() {
        let left = Left::new(10.0, 5.0);
        assert_eq!(left.at(4.0, 0), 11.0);
        assert_eq!(left.at(20.0, 0), 6.0);
    }

    #[test]
    fn steps_that_grow_by_a_ratio_are_counted_to_the_end() {
        // 0.01 (1 + 1.3 + …): the sum of n is 0.01 (1.3ⁿ − 1) / 0.3.
        let part = |n: i32| 0.01 * (1.3f64.powi(n) - 1.0) / 0.3;
        let parts: Vec<f64> = (3..8).map(part).collect();
        let all = (1.0f64 + 0.3 / 0.01).ln() / 1.3f64.ln();
        let left = steps_left(&parts).expect("steps");
        assert!((left - (all - 7.0)).abs() < 0.5, "{left} of {}", all - 7.0);
    }

    #[test]
    fn equal_steps_are_counted_and_none_are_unknown() {
        let left = steps_left(&[0.1, 0.2, 0.3, 0.4, 0.5]).expect("steps");
        assert!((left - 5.0).abs() < 1e-9, "{left}");
        assert_eq!(steps_left(&[0.1]), None);
        assert_eq!(steps_left(&[0.1, 0.1]), None);
        assert_eq!(steps_left(&[]), None);
    }
}
