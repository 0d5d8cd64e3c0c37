//! The cost of a run, read from its history. The result does not depend on the number of starts.

use std::collections::BTreeMap;

use crate::store::{RunReader, StoreError};

/// Cost of a run over all starts of the run. The cost includes all iterations, even pruned iterations.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunCost {
    /// Number of committed wear iterations, without the unworn state.
    pub wear_iterations: u64,
    /// Number of pruned iterations.
    pub pruned: u64,
    /// Seconds by stage, and by named part of a stage (`stage.part`).
    pub seconds: BTreeMap<String, f64>,
    /// Pairs of forward and inverse transforms, by the same names.
    pub fft_pairs: BTreeMap<String, f64>,
    /// Bytes of the tables of all stored iterations.
    pub disk: u64,
}

impl RunCost {
    /// Sums up the cost of a run.
    ///
    /// # Errors
    /// Errors of reading the run. A damaged or missing `timing` table counts as zero, since no result depends on it.
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

    /// Returns the seconds of all stages.
    pub fn total_seconds(&self) -> f64 {
        self.seconds.values().sum()
    }

    /// Returns the transform pairs of all stages.
    pub fn total_pairs(&self) -> f64 {
        self.fft_pairs.values().sum()
    }
}
