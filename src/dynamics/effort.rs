//! What a search for responses may cost, counted in what it evaluates: the same on every machine, whatever its speed.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::aft::Closure;

// By what each takes, in 0.17 microseconds of a common processor; fitted to parts of searches of oscillators of every kind.
/// Units of an evaluation of a balance, whatever its elements.
const EVALUATION: u64 = 100;
/// Units of a step of the integration in time.
const STEP: u64 = 7;
/// Units of a cycle of an element that is not sampled, beyond its coefficients.
const CYCLE: u64 = 5;
/// Samples that are marched over, or whose force and derivatives by a coefficient are analysed, at the cost of a unit.
const MARCHED: u64 = 10;
const ANALYSED: u64 = 12;
/// Cubes of the coefficients along a direction that a solve with them takes at the cost of a unit.
const SOLVED: u64 = 40;
/// Units of a survey but for what it looks for in gaps, and of one with more harmonics than are asked for; of its first branches, and of all that is
/// looked for beside them: a million takes a fifth of a second.
pub(super) const SURVEY: u64 = 12_500_000;
pub(super) const FINER_SURVEY: u64 = 6_500_000;
pub(super) const BRANCHES: u64 = 4_000_000;
pub(super) const BESIDE_BRANCHES: u64 = 1_400_000;
/// Units of following branches with more harmonics, and of one response with them.
pub(super) const FINER: u64 = 1_200_000;
pub(super) const NEAR_FINER: u64 = FINER / 4;
/// Units of finding what bounces as responses of all coordinates, of looking along its paths for what is highest along other axes, and of climbing
/// to that; and of looking along one path at least.
pub(super) const BOUNCING: u64 = 1_400_000;
pub(super) const ALONG: u64 = 2_800_000;
pub(super) const LEAST_ALONG: u64 = ALONG / 4;
/// Units that all surveys of a resonance may have cost before another one with more harmonics is begun.
pub(super) const AGAIN: u64 = 4_000_000;
/// Units of all points of a forced response at given frequencies, of a small model.
pub(super) const POINTS: u64 = 3_000_000;
/// Units by which the errors of its points are found.
pub(super) const ERRORS: u64 = 2_000_000;

/// A count of what is evaluated, with a bound. Clones count together.
#[derive(Debug, Clone)]
pub(super) struct Effort {
    spent: Arc<AtomicU64>,
    bound: Arc<AtomicU64>,
    most: Arc<AtomicU64>,
}

impl Default for Effort {
    fn default() -> Effort {
        Effort {
            spent: Arc::default(),
            bound: Arc::new(AtomicU64::new(u64::MAX)),
            most: Arc::new(AtomicU64::new(u64::MAX)),
        }
    }
}

impl Effort {
    /// So many units may be spent from now on, of those that may be at all.
    pub(super) fn allow(&self, units: u64) {
        let most = self.most.load(Ordering::Relaxed);
        let bound = self.spent().saturating_add(units).min(most);
        self.bound.store(bound, Ordering::Relaxed);
    }

    /// No more than so many units may be spent from now on, whatever is allowed, until there is no bound.
    pub(super) fn limit(&self, units: u64) {
        let most = self.spent().saturating_add(units);
        self.most.store(most, Ordering::Relaxed);
        self.bound.store(most, Ordering::Relaxed);
    }

    /// There is no bound from now on.
    pub(super) fn unbound(&self) {
        self.most.store(u64::MAX, Ordering::Relaxed);
        self.bound.store(u64::MAX, Ordering::Relaxed);
    }

    /// A balance was evaluated, beside its elements.
    pub(super) fn add_evaluation(&self) {
        self.add(EVALUATION);
    }

    /// An element was evaluated with so many coefficients along each direction, over the cycles until its friction closed.
    pub(super) fn add_element(&self, closure: &Closure, coefficients: usize) {
        let [cycles, samples] = [closure.cycles, closure.samples].map(|count| count as u64);
        let n = coefficients as u64;
        self.add(match samples {
            0 => n * n + CYCLE * cycles,
            _ => {
                let sampled = samples * cycles / MARCHED + samples * n / ANALYSED;
                sampled + n.pow(3) / SOLVED
            }
        });
    }

    /// Steps in time were made.
    pub(super) fn add_steps(&self, steps: usize) {
        self.add(STEP * steps as u64);
    }

    /// So many units were spent.
    pub(super) fn add_units(&self, units: u64) {
        self.add(units);
    }

    fn add(&self, units: u64) {
        self.spent.fetch_add(units, Ordering::Relaxed);
    }

    pub(super) fn spent(&self) -> u64 {
        self.spent.load(Ordering::Relaxed)
    }

    /// Steps in time that are left of what is allowed.
    pub(super) fn steps_left(&self) -> usize {
        let left = self
            .bound
            .load(Ordering::Relaxed)
            .saturating_sub(self.spent());
        usize::try_from(left / STEP).unwrap_or(usize::MAX)
    }

    /// Whether all that is allowed is spent.
    pub(super) fn is_spent(&self) -> bool {
        self.spent() >= self.bound.load(Ordering::Relaxed)
    }
}
