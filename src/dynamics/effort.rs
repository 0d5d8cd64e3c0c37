//! The limit on the cost of a search, as a number of evaluations of the balance: it ends at the same place on every machine.

use std::sync::atomic::{AtomicU64, Ordering};

/// A count of evaluations, with a bound.
#[derive(Debug)]
pub(super) struct Effort {
    spent: AtomicU64,
    bound: AtomicU64,
}

impl Clone for Effort {
    fn clone(&self) -> Effort {
        Effort {
            spent: self.spent().into(),
            bound: self.bound.load(Ordering::Relaxed).into(),
        }
    }
}

impl Default for Effort {
    fn default() -> Effort {
        Effort {
            spent: 0.into(),
            bound: u64::MAX.into(),
        }
    }
}

impl Effort {
    /// So many evaluations may be made from now on.
    pub(super) fn allow(&self, evaluations: u64) {
        let bound = self.spent().saturating_add(evaluations);
        self.bound.store(bound, Ordering::Relaxed);
    }

    /// There is no bound from now on.
    pub(super) fn unbound(&self) {
        self.bound.store(u64::MAX, Ordering::Relaxed);
    }

    /// So many evaluations were made.
    pub(super) fn add(&self, evaluations: u64) {
        self.spent.fetch_add(evaluations, Ordering::Relaxed);
    }

    /// Evaluations so far.
    pub(super) fn spent(&self) -> u64 {
        self.spent.load(Ordering::Relaxed)
    }

    /// Whether all that is allowed is spent.
    pub(super) fn is_spent(&self) -> bool {
        self.spent() >= self.bound.load(Ordering::Relaxed)
    }
}
