//! The limit on the cost of a search, as a number of evaluations of the balance: it ends at the same place on every machine.

use std::cell::Cell;

/// A count of evaluations, with a bound.
#[derive(Debug, Clone)]
pub(super) struct Effort {
    spent: Cell<u64>,
    bound: Cell<u64>,
}

impl Default for Effort {
    fn default() -> Effort {
        Effort {
            spent: Cell::new(0),
            bound: Cell::new(u64::MAX),
        }
    }
}

impl Effort {
    /// So many evaluations may be made from now on.
    pub(super) fn allow(&self, evaluations: u64) {
        self.bound.set(self.spent().saturating_add(evaluations));
    }

    /// There is no bound from now on.
    pub(super) fn unbound(&self) {
        self.bound.set(u64::MAX);
    }

    /// So many evaluations were made.
    pub(super) fn add(&self, evaluations: u64) {
        self.spent.set(self.spent() + evaluations);
    }

    /// Evaluations so far.
    pub(super) fn spent(&self) -> u64 {
        self.spent.get()
    }

    /// Whether all that is allowed is spent.
    pub(super) fn is_spent(&self) -> bool {
        self.spent() >= self.bound.get()
    }
}
