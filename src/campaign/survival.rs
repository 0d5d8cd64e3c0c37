//! How long runs last of which some ended before: Kaplan and Meier's estimate [J. Am. Stat. Assoc. 53, 1958, 457], and its quantiles.

use statrs::distribution::{Binomial, DiscreteCDF};

/// How long a run lasted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Life {
    /// Cycles at which it passed the milestone, or at which it was left.
    pub cycles: f64,
    /// True if it passed; false if it was only followed so far.
    pub passed: bool,
}

/// A quantile of the cycles at which runs pass; none beyond what they were followed to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantile {
    /// Part of the runs that has passed by then.
    pub part: f64,
    /// Cycles.
    pub cycles: Option<f64>,
    /// Between these the quantile of all such runs lies with 95 %, by the order statistics of those runs that were not left before. The lower one is 0 where too few are there to tell.
    pub low: Option<f64>,
    pub high: Option<f64>,
}

/// The part of the runs that passes over the cycles.
#[derive(Debug, Clone, PartialEq)]
pub struct Survival {
    /// Runs that were followed.
    pub runs: usize,
    /// Cycles at which some pass, and the part that has passed then.
    steps: Vec<(f64, f64)>,
    /// Cycles at which runs are left, ascending.
    left: Vec<f64>,
    /// Cycles to which the last run was followed.
    pub end: f64,
}

/// Probability that a quantile is beyond either of its bounds.
const BEYOND: f64 = 0.025;
/// Parts that differ by less are the same.
const ROUNDING: f64 = 1e-12;

impl Survival {
    /// Of some runs. Those that pass at the cycles at which others are left do so before.
    pub fn of(lives: &[Life]) -> Survival {
        let mut lives = lives.to_vec();
        lives.sort_by(|a, b| a.cycles.total_cmp(&b.cycles).then(b.passed.cmp(&a.passed)));
        let mut steps: Vec<(f64, f64)> = Vec::new();
        let mut left = 1.0;
        for (before, life) in lives.iter().enumerate() {
            if !life.passed {
                continue;
            }
            let at_risk = (lives.len() - before) as f64;
            left *= 1.0 - 1.0 / at_risk;
            match steps.last_mut() {
                Some(last) if last.0 == life.cycles => last.1 = 1.0 - left,
                _ => steps.push((life.cycles, 1.0 - left)),
            }
        }
        Survival {
            runs: lives.len(),
            steps,
            left: lives
                .iter()
                .filter(|life| !life.passed)
                .map(|life| life.cycles)
                .collect(),
            end: lives.last().map_or(0.0, |life| life.cycles),
        }
    }

    /// The part that has passed by then.
    pub fn passed(&self, cycles: f64) -> f64 {
        let before = self.steps.iter().take_while(|step| step.0 <= cycles);
        before.last().map_or(0.0, |step| step.1)
    }

    /// Cycles by which a part of the runs has passed; none where it is beyond what they were followed to.
    fn at(&self, part: f64) -> Option<f64> {
        let mut steps = self.steps.iter();
        steps
            .find(|step| step.1 >= part - ROUNDING)
            .map(|step| step.0)
    }

    /// The cycles by which a part of the runs has passed, between bounds.
    pub fn quantile(&self, part: f64) -> Quantile {
        let cycles = self.at(part);
        // Runs that were left before say nothing of it.
        let last = cycles
            .or(self.steps.last().map(|step| step.0))
            .unwrap_or(self.end);
        let known = self.runs - self.left.iter().filter(|left| **left < last).count();
        let [low, high] = ranks(known, part).map(|rank| {
            rank.map(|rank| match rank {
                0 => Some(0.0),
                rank => self.at(rank as f64 / known as f64),
            })
        });
        Quantile {
            part,
            cycles,
            low: low.flatten(),
            high: high.flatten(),
        }
    }
}

/// The order statistics of so many values between which a quantile of all lies with 95 %: 0 is before the first, none behind the last.
fn ranks(count: usize, part: f64) -> [Option<usize>; 2] {
    let Ok(below) = Binomial::new(part, count as u64) else {
        return [Some(0), None];
    };
    // So many values lie below the quantile at most.
    let at_most = |rank: usize| below.cdf(rank as u64);
    let low = (0..count)
        .take_while(|rank| at_most(*rank) <= BEYOND)
        .count();
    let high = (0..count).find(|rank| at_most(*rank) >= 1.0 - BEYOND);
    [Some(low), high.map(|rank| rank + 1)]
}
