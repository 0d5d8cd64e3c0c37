//! What a run has cost, read from its history: the same whether it was computed in one go or in many.

use std::collections::BTreeMap;

use crate::store::{RunReader, StoreError};

/// What a run has cost, over all its starts: sums over its iterations, those that are pruned too.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunCost {
    /// Wear iterations committed, the unworn state not among them.
    pub wear_iterations: u64,
    /// How many of those are pruned.
    pub pruned: u64,
    /// Seconds by stage, and by part of a stage that is told apart (`stage.part`).
    pub seconds: BTreeMap<String, f64>,
    /// Forward and inverse transform pairs, the same way.
    pub fft_pairs: BTreeMap<String, f64>,
    /// Bytes of the tables of all iterations that are kept.
    pub disk: u64,
}

impl RunCost {
    /// Sums up a run.
    ///
    /// # Errors
    /// Those of reading it; a `timing` table that is damaged, or was and is gone, counts nothing: no result depends on it.
    pub fn of(reader: &RunReader) -> Result<RunCost, StoreError> {
        let mut spent = RunCost {
            wear_iterations: reader.latest().unwrap_or(0),
            ..RunCost::default()
        };
        for wear_iteration in reader.iterations() {
            spent.disk += reader.commit_of(wear_iteration)?.bytes();
        }
        let history = reader.history()?;
        spent.pruned = (history.len() - reader.iterations().count()) as u64;
        for (stage, cost) in history.cost() {
            spent.seconds.insert(stage.clone(), cost.seconds);
            spent.fft_pairs.insert(stage, cost.fft_pairs);
        }
        Ok(spent)
    }

    /// Seconds of all stages.
    pub fn total_seconds(&self) -> f64 {
        self.seconds.values().sum()
    }

    /// Transform pairs of all stages.
    pub fn total_pairs(&self) -> f64 {
        self.fft_pairs.values().sum()
    }
}
