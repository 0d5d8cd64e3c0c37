//! How long a run will still take, from what it has done since this start.

use std::collections::VecDeque;
use std::time::Instant;

use fretwear::stages::Stage;

/// Steps from which the growth of steps is taken: an even number, of which each half is one length.
const OF_LATE: usize = 4;
/// By how much one step of the wear is longer than the one before, until steps have shown it: what the shipped scenes have.
const GROWTH: f64 = 1.35;
/// More than that is an exception and does not go on.
const MOST_GROWTH: f64 = 1.6;
/// Forced response of the worn joint over that of the unworn one, in seconds: it has as many points, and more of its elements slide.
const WORN: f64 = 2.6;
/// Points from which on the pace of a forced response tells when it ends.
const TELLING: u64 = 3;
/// Points over the peak are slow: what a forced response has left is at least this part of what it took so far.
const LAST: f64 = 0.1;
/// A forced response whose points say this part of what the one before makes expect is a quick one.
const QUICK: f64 = 0.25;

/// The pace of a run.
#[derive(Debug, Default)]
pub struct Pace {
    /// The last iterations: what part of the run was behind each.
    parts: VecDeque<f64>,
    /// The stage that is computed, and since when.
    stage: Option<(Stage, Instant)>,
    /// Seconds and points of the longest forced response: they are computed at the first iteration and at the last, and where they are
    /// asked for.
    response: (f64, u64),
    /// Seconds of all other stages of iterations that wear, and how many of these there were.
    seconds: f64,
    iterations: f64,
    /// Cycles behind the first iteration of this start, and of the last.
    cycles: Option<[u64; 2]>,
    /// When the first iteration of this start was committed.
    first: Option<Instant>,
}

impl Pace {
    /// A stage begins; that before had as many points of a forced response.
    pub fn enters(&mut self, stage: Stage, points: u64) {
        self.leaves(points);
        self.stage = Some((stage, Instant::now()));
    }

    fn leaves(&mut self, points: u64) {
        let Some((stage, since)) = self.stage.take() else {
            return;
        };
        let seconds = since.elapsed().as_secs_f64();
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
            Some(_) => self.iterations += 1.0,
        }
        self.cycles = Some([self.cycles.map_or(cycles, |[first, _]| first), cycles]);
        self.parts.push_back(part);
        if self.parts.len() > OF_LATE + 1 {
            self.parts.pop_front();
        }
    }

    /// Cycles a second since the first commit of this start, and the seconds to go; none before a step is done.
    pub fn left(&self) -> Option<(f64, f64)> {
        let elapsed = self.first?.elapsed().as_secs_f64();
        let [from, to] = self.cycles?;
        let left = self.steps()? * self.step() + WORN * self.response.0;
        Some(((to - from) as f64 / elapsed, left))
    }

    fn steps(&self) -> Option<f64> {
        steps_left(self.parts.iter().copied().collect::<Vec<f64>>().as_slice())
    }

    /// Seconds of an iteration without its forced response.
    fn step(&self) -> f64 {
        self.seconds / self.iterations.max(1.0)
    }

    /// What is known of a forced response that begins, in a run that may have `more` of them; none of the first of a start.
    pub fn response(&self, more: bool) -> Option<Responding> {
        let (seconds, points) = self.response;
        let known = self.first.is_some() && points > 0;
        // One of the steps is being made, and after the last nothing is left.
        let steps = match more {
            true => (self.steps().unwrap_or(1.0) - 1.0).round(),
            false => 0.0,
        };
        let last = if steps > 0.0 { WORN * seconds } else { 0.0 };
        known.then(|| Responding {
            since: Instant::now(),
            seconds: WORN * seconds,
            points,
            after: steps * self.step() + last,
        })
    }
}

/// A forced response that is computed.
#[derive(Debug, Clone, Copy)]
pub struct Responding {
    since: Instant,
    /// What it will take, by the one before.
    seconds: f64,
    /// Points of the one before.
    points: u64,
    /// Seconds of the run after it.
    after: f64,
}

impl Responding {
    /// Seconds to the end of the run, with as many points done.
    pub fn left(&self, points: u64) -> f64 {
        self.left_after(self.since.elapsed().as_secs_f64(), points)
    }

    fn left_after(&self, elapsed: f64, points: u64) -> f64 {
        let least = LAST * elapsed;
        let by_time = (self.seconds - elapsed).max(least);
        let part = self.points as f64 / points.max(1) as f64 - 1.0;
        let by_points = (elapsed * part).max(least);
        let is_quick = by_points < QUICK * by_time;
        let is_late = by_time == least;
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
    use std::time::Instant;

    use super::{Responding, steps_left};

    #[test]
    fn a_forced_response_is_timed_by_its_points_and_never_over() {
        let response = Responding {
            since: Instant::now(),
            seconds: 30.0,
            points: 50,
            after: 2.0,
        };
        let left = |elapsed, points| response.left_after(elapsed, points);
        assert!((left(0.0, 0) - 32.0).abs() < 1e-9);
        // Between the 10 s of the time and the 20 s of the points.
        assert!((left(20.0, 25) - 14.5).abs() < 1e-9);
        // Half of the points after more than was expected: as long again.
        assert!((left(40.0, 25) - 42.0).abs() < 1e-9);
        // Half of the points in a tenth of the time.
        assert!((left(3.0, 25) - 5.0).abs() < 1e-9);
        // More points than the one before had.
        assert!((left(45.0, 60) - 6.5).abs() < 1e-9);
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
