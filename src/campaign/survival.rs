//! Kaplan–Meier estimate of the lifetimes of runs, some of which end before the milestone [J. Am. Stat. Assoc. 53,
//! 1958, 457], and the quantiles of the estimate.

use statrs::distribution::{Binomial, DiscreteCDF};

/// Lifetime of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lifetime {
    /// Cycles at which the run passed the milestone, or cycles at its end (a censored run).
    pub cycles: f64,
    /// True if the run passed the milestone; false if it ended before.
    pub passed: bool,
}

/// A quantile of the cycles at which runs pass. The cycles of the quantile are `None` beyond the range of the runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantile {
    /// Share of the runs that has passed.
    pub probability: f64,
    /// Number of cycles at which the share `probability` of the runs has passed the milestone.
    pub cycles: Option<f64>,
    /// Lower bound of the 95 % confidence interval, from the order statistics of the runs that were not censored
    /// before. With too few runs, the lower bound is 0. `high` is the upper bound. With too few runs, `high` is `None`.
    pub low: Option<f64>,
    pub high: Option<f64>,
}

/// Share of the runs that have passed, as a function of the cycles.
#[derive(Debug, Clone, PartialEq)]
pub struct Survival {
    /// Number of runs, including censored runs.
    pub runs: usize,
    /// Pairs (cycles, share), ascending: `share` of the runs have passed the milestone after `cycles` cycles.
    steps: Vec<(f64, f64)>,
    /// Numbers of cycles at which runs are censored, ascending.
    left: Vec<f64>,
    /// Largest number of cycles of all runs.
    pub end: f64,
}

/// Probability of each side of the confidence interval: that a quantile is below the lower bound, or above the upper
/// bound.
const TAIL_PROBABILITY: f64 = 0.025;
/// Tolerance of comparisons between shares.
const ROUNDING: f64 = 1e-12;

impl Survival {
    /// Computes the estimate. If one run passes and another run is censored at the same number of cycles, the passing
    /// run counts first.
    pub fn estimate(lives: &[Lifetime]) -> Survival {
        let mut lives = lives.to_vec();
        lives.sort_by(|a, b| a.cycles.total_cmp(&b.cycles).then(b.passed.cmp(&a.passed)));
        let mut steps: Vec<(f64, f64)> = Vec::new();
        let mut survival = 1.0;
        for (before, life) in lives.iter().enumerate() {
            if !life.passed {
                continue;
            }
            let at_risk = (lives.len() - before) as f64;
            survival *= 1.0 - 1.0 / at_risk;
            match steps.last_mut() {
                Some(last) if last.0 == life.cycles => last.1 = 1.0 - survival,
                _ => steps.push((life.cycles, 1.0 - survival)),
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

    /// Returns the fraction of the runs that have passed the milestone at `cycles`.
    pub fn share_passed(&self, cycles: f64) -> f64 {
        let before = self.steps.iter().take_while(|step| step.0 <= cycles);
        before.last().map_or(0.0, |step| step.1)
    }

    /// Returns the cycles at which a share of the runs has passed. Returns `None` beyond the range of the runs.
    fn at(&self, part: f64) -> Option<f64> {
        let mut steps = self.steps.iter();
        steps
            .find(|step| step.1 >= part - ROUNDING)
            .map(|step| step.0)
    }

    /// Returns the cycles at which a share of the runs has passed, with confidence bounds.
    pub fn quantile(&self, part: f64) -> Quantile {
        let cycles = self.at(part);
        // A run that was censored before the quantile carries no information about it.
        let last = cycles
            .or(self.steps.last().map(|step| step.0))
            .unwrap_or(self.end);
        let informative_runs = self.runs - self.left.iter().filter(|end| **end < last).count();
        let [low, high] = ranks(informative_runs, part).map(|rank| {
            rank.map(|rank| match rank {
                0 => Some(0.0),
                rank => self.at(rank as f64 / informative_runs as f64),
            })
        });
        Quantile {
            probability: part,
            cycles,
            low: low.flatten(),
            high: high.flatten(),
        }
    }
}

/// Returns the ranks of the order statistics that bound the quantile with 95 % confidence. Rank 0 is below the first
/// value; `None` is above the last value.
fn ranks(count: usize, part: f64) -> [Option<usize>; 2] {
    let Ok(below) = Binomial::new(part, count as u64) else {
        return [Some(0), None];
    };
    // Probability that at most `rank` values lie below the quantile.
    let at_most = |rank: usize| below.cdf(rank as u64);
    let low = (0..count)
        .take_while(|rank| at_most(*rank) <= TAIL_PROBABILITY)
        .count();
    let high = (0..count).find(|rank| at_most(*rank) >= 1.0 - TAIL_PROBABILITY);
    [Some(low), high.map(|rank| rank + 1)]
}
