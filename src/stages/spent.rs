//! What a run has cost, read from what it committed: the same whether it was computed in one go or in many.

use std::collections::BTreeMap;

use super::RunError;
use crate::store::{RunReader, StoreError};
use crate::tables::typed;

/// What a run has cost, over all its starts: sums over the iterations that it keeps.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spent {
    /// Wear iterations committed, the unworn state not among them.
    pub wear_iterations: u64,
    /// How many of those are pruned: their time, pairs and bytes are not in the sums.
    pub pruned: u64,
    /// Seconds by stage, and by part of a stage that is told apart (`stage.part`).
    pub seconds: BTreeMap<String, f64>,
    /// Forward and inverse transform pairs, the same way.
    pub fft_pairs: BTreeMap<String, f64>,
    /// Bytes of the tables of all iterations.
    pub disk: u64,
}

impl Spent {
    /// Sums up a run.
    ///
    /// # Errors
    /// Those of reading it; a `timing` table that is damaged, or was and is gone, counts nothing: no result depends on it.
    pub fn of(reader: &RunReader) -> Result<Spent, RunError> {
        let mut spent = Spent {
            wear_iterations: reader.latest().unwrap_or(0),
            pruned: reader.record().pruned.len() as u64,
            ..Spent::default()
        };
        for wear_iteration in reader.iterations() {
            spent.disk += reader.commit_of(wear_iteration)?.bytes();
            let timing: typed::Timing = match reader.typed(wear_iteration) {
                Ok(table) => table,
                Err(StoreError::Damaged(_) | StoreError::NoTable { .. }) => continue,
                Err(error) => return Err(error.into()),
            };
            for (column, sums) in [
                (&timing.seconds, &mut spent.seconds),
                (&timing.fft_pairs, &mut spent.fft_pairs),
            ] {
                for (name, value) in timing.stage.iter().zip(column) {
                    *sums.entry(name.to_owned()).or_insert(0.0) += value;
                }
            }
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
