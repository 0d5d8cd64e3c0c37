//! Limit on the cost of a search, counted in evaluations of the balance. The search ends at the same place on every
//! machine.

use std::sync::atomic::{AtomicU64, Ordering};

/// Counter of evaluations with an upper bound.
#[derive(Debug)]
pub(super) struct EvaluationBudget {
    spent: AtomicU64,
    bound: AtomicU64,
}

impl Clone for EvaluationBudget {
    fn clone(&self) -> EvaluationBudget {
        EvaluationBudget {
            spent: self.spent().into(),
            bound: self.bound.load(Ordering::Relaxed).into(),
        }
    }
}

impl Default for EvaluationBudget {
    fn default() -> EvaluationBudget {
        EvaluationBudget {
            spent: 0.into(),
            bound: u64::MAX.into(),
        }
    }
}

impl EvaluationBudget {
    /// Sets the bound to the evaluations that are already spent plus `evaluations`.
    pub(super) fn allow(&self, evaluations: u64) {
        let bound = self.spent().saturating_add(evaluations);
        self.bound.store(bound, Ordering::Relaxed);
    }

    /// Removes the bound.
    pub(super) fn unbound(&self) {
        self.bound.store(u64::MAX, Ordering::Relaxed);
    }

    /// Counts evaluations.
    pub(super) fn add(&self, evaluations: u64) {
        self.spent.fetch_add(evaluations, Ordering::Relaxed);
    }

    /// Returns the number of evaluations so far.
    pub(super) fn spent(&self) -> u64 {
        self.spent.load(Ordering::Relaxed)
    }

    /// Returns true if the number of evaluations has reached the bound.
    pub(super) fn is_spent(&self) -> bool {
        self.spent() >= self.bound.load(Ordering::Relaxed)
    }
}
