//! A decision, as text.

use serde::Serialize;

/// One decision of the plan, with the reason for the decision.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decision {
    /// Subject of the decision.
    pub what: String,
    /// The choice.
    pub choice: String,
    /// Reason for the choice.
    pub why: String,
}

/// Decisions collected so far.
#[derive(Default)]
pub(super) struct Decisions(pub(super) Vec<Decision>);

impl Decisions {
    /// Adds a decision.
    pub(super) fn add(&mut self, what: &str, choice: impl Into<String>, why: &str) {
        self.0.push(Decision {
            what: what.to_owned(),
            choice: choice.into(),
            why: why.to_owned(),
        });
    }
}
