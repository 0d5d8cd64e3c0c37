//! From courses of wear on coarser grids to that on the grid of the scene.

use serde::Serialize;

use super::rehearsed_run::{Iteration, RehearsedRun};
use crate::recipe::Wear;

/// What chance makes of a count on a surface of a finite number of asperities, and of a grid that they lie on otherwise. A safety
/// factor: iterations and pairs of the same surface on grids a tenth apart differ by some tenth.
const CHANCE: f64 = 0.2;
/// By which the power may be off by which steps grow with what is behind them. A safety: that of an implicit step rises from one half to
/// beyond one in the course of wear, that of an explicit one hangs on what wears fastest.
const POWER: f64 = 0.3;
/// Most by which an extrapolation may change what was rehearsed on the finer grid.
const MOST: f64 = 2.0;
/// How far beyond the finer grid numbers go on, in steps of that from the coarser one: chance grows as far.
const FARTHEST: f64 = 1.0;

/// An expected number, and between which it should lie.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Range {
    /// What is expected.
    pub expected: f64,
    /// At least.
    pub least: f64,
    /// At most.
    pub most: f64,
}

impl Range {
    /// A number that may be as many times less or more.
    pub(super) fn within(expected: f64, factor: f64) -> Range {
        Range {
            expected,
            least: expected / factor,
            most: expected * factor,
        }
    }

    /// Every one of its numbers changed.
    pub(super) fn map(self, change: impl Fn(f64) -> f64) -> Range {
        Range {
            expected: change(self.expected),
            least: change(self.least),
            most: change(self.most),
        }
    }
}

/// Three digits, more than there are right.
pub(super) fn digits(value: f64) -> f64 {
    // The decimal that is nearest, the same on every machine.
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// What a whole run takes on one grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Totals {
    /// Wear iterations.
    pub steps: Range,
    /// Transform pairs of the unworn iteration, and of another in the mean.
    pub first: f64,
    pub step: f64,
}

impl Totals {
    /// Of a course; the steps of a part of one go on as those of the `whole` one do, and its pairs too if that is marched alike, else as
    /// its last steps did. None of a part that says nothing of the rest.
    pub fn of(
        course: &RehearsedRun,
        wear: Option<&Wear>,
        whole: Option<(&RehearsedRun, bool)>,
    ) -> Option<Totals> {
        let own = Totals::so_far(&course.iterations)?;
        let done = course.iterations.len() - 1;
        if course.broken_off.is_none() {
            return Some(own);
        }
        if done == 0 {
            // Of the unworn iteration alone is known how many times the pairs of the other course it takes.
            let other = Totals::of(whole?.0, wear, None)?;
            let step = other.step * own.first / other.first;
            return Some(Totals {
                step,
                first: own.first,
                ..other
            });
        }
        let last = course.iterations.last()?;
        let Some((whole, alike)) = whole.filter(|(whole, _)| whole.broken_off.is_none()) else {
            let steps = to_the_end(&course.iterations, wear?)?;
            return Some(Totals { steps, ..own });
        };
        // Where the other one was at this time, and what it took until then and in all.
        let others = &whole.iterations;
        let at = others.iter().rposition(|i| i.cycles <= last.cycles)?;
        let part = others.get(at + 1).map_or(0.0, |next| {
            (last.cycles - others[at].cycles) / (next.cycles - others[at].cycles)
        });
        let left = (others.len() - 1 - at) as f64 - part;
        let all = Totals::so_far(others)?.step;
        let begun = Totals::so_far(&others[..=at.max(1).min(others.len() - 1)])?.step;
        let later = if alike && begun > 0.0 {
            all / begun
        } else {
            1.0
        };
        let expected = done as f64 + left;
        Some(Totals {
            steps: Range::within(expected, 1.0 + CHANCE * left / expected),
            step: own.step * later,
            ..own
        })
    }

    fn so_far(iterations: &[Iteration]) -> Option<Totals> {
        let pairs = |of: &Iteration| of.pairs.values().sum::<f64>();
        let (first, steps) = iterations.split_first()?;
        Some(Totals {
            steps: Range::within(steps.len() as f64, 1.0),
            first: pairs(first),
            step: steps.iter().map(pairs).sum::<f64>() / steps.len().max(1) as f64,
        })
    }

    /// On a grid whose cells along a side are in logarithms `ratio` times as far from those of this one as they are from the coarser.
    pub fn extrapolated(&self, coarser: &Totals, ratio: f64) -> Totals {
        let on = |finer: f64, coarser: f64| {
            let extrapolated = finer + ratio.min(FARTHEST) * (finer - coarser);
            extrapolated.clamp(finer / MOST, finer * MOST)
        };
        let expected = on(self.steps.expected, coarser.steps.expected);
        let scale = expected / self.steps.expected.max(1.0);
        Totals {
            steps: self.steps.map(|steps| scale * steps),
            first: on(self.first, coarser.first),
            step: on(self.step, coarser.step),
        }
    }

    /// With as many times the samples of a cycle: the nearer they are to each other, the fewer pairs a sample takes, so that pairs grow by
    /// something between that number and its root.
    pub fn with_samples(&self, times: f64) -> Totals {
        let more = times.powf(0.75);
        Totals {
            steps: self.steps,
            first: more * self.first,
            step: more * self.step,
        }
    }

    /// All pairs of a run with so many wear iterations.
    pub fn pairs(&self, steps: f64) -> f64 {
        self.first + steps * self.step
    }
}

/// By which factor an extrapolated number may be off: by chance, and by as much again as it was extrapolated.
pub(super) fn doubt(expected: f64, rehearsed: f64) -> f64 {
    match rehearsed > 0.0 && expected > 0.0 {
        true => (1.0 + CHANCE) * (expected / rehearsed).max(rehearsed / expected),
        false => 1.0 + CHANCE,
    }
}

/// Wear iterations to the end if steps go on to grow with what is behind them by the power of the last half of them.
fn to_the_end(iterations: &[Iteration], wear: &Wear) -> Option<Range> {
    let course = |of: fn(&Iteration) -> f64, end: f64| {
        let done: Vec<f64> = iterations.iter().map(of).collect();
        let steps = done.len() - 1;
        let length = |k: usize| done[k] - done[k - 1];
        let half = steps.div_ceil(2);
        let behind = (done[steps] / done[half]).ln();
        let growth = match steps > 2 && behind > 0.0 {
            true => ((length(steps) / length(half)).ln() / behind).clamp(0.0, 1.0),
            false => 0.5,
        };
        let reach = end / done[steps];
        // ∫ dn / step(n) with step(n) = step · (n/now)^growth.
        let all = |growth: f64| {
            let power = 1.0 - growth;
            let left = match power.abs() > 1e-3 {
                true => (reach.powf(power) - 1.0) / power,
                false => reach.ln(),
            };
            steps as f64 + done[steps] / length(steps) * left
        };
        let range = Range {
            expected: all(growth),
            least: all(growth + POWER),
            most: all(growth - POWER),
        };
        (range.most.is_finite() && range.least >= steps as f64).then_some(range)
    };
    let cycles = wear.cycles.and_then(|end| course(|i| i.cycles, end as f64));
    let volume = wear.volume.and_then(|end| course(|i| i.volume, end));
    match (cycles, volume) {
        (Some(a), Some(b)) if a.expected > b.expected => Some(b),
        (a, b) => a.or(b),
    }
}
