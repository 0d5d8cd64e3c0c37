//! A decision in words.

use serde::Serialize;

/// One decision: what, whether it will exist, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decision {
    /// What it is about.
    pub what: String,
    /// What was decided.
    pub choice: String,
    /// Why.
    pub why: String,
}

/// The decisions that were told so far.
#[derive(Default)]
pub(super) struct Decisions(pub(super) Vec<Decision>);

impl Decisions {
    pub(super) fn add(&mut self, what: &str, choice: impl Into<String>, why: &str) {
        self.0.push(Decision {
            what: what.to_owned(),
            choice: choice.into(),
            why: why.to_owned(),
        });
    }
}
