//! Checks of `fretwear doctor`: can the machine compute runs and store the results?
//!
//! The checks use the code of runs: the store's file system, the solvers' transforms and factorisations, and the
//! tables' Parquet. The checks detect failures that a run would have. The checks leave no files on the disk.

pub mod closed_forms;
mod disk;
mod machine;

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use crate::store::FileSystem;

pub use machine::{seconds_of_operation, seconds_of_pair};

/// Result of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// No problem.
    Ok,
    /// Runs give correct results. Runs can be slow, lack disk space, or be computed twice.
    Warning,
    /// Runs would fail or could be wrong.
    Failed,
}

/// A check of the doctor, with the result of the check.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// Name of the checked item.
    pub name: &'static str,
    /// State of the item.
    pub state: State,
    /// Description of the result.
    pub found: String,
    /// Advice, unless the state is `Ok`.
    pub advice: Option<String>,
    /// Numbers of the result by name, in SI units.
    pub numbers: BTreeMap<&'static str, f64>,
}

impl Check {
    fn ok(name: &'static str, found: impl Into<String>) -> Check {
        Check {
            name,
            state: State::Ok,
            found: found.into(),
            advice: None,
            numbers: BTreeMap::new(),
        }
    }

    fn failed(name: &'static str, found: impl Into<String>, advice: &str) -> Check {
        Check::ok(name, found).with_advice(State::Failed, advice)
    }

    /// Sets a state other than `Ok`, with advice.
    fn with_advice(mut self, state: State, advice: &str) -> Check {
        self.state = state;
        self.advice = Some(advice.to_owned());
        self
    }

    fn number(mut self, name: &'static str, value: f64) -> Check {
        self.numbers.insert(name, value);
        self
    }
}

/// Checks the folder for runs, the processor, the numerics, and the cache of structures. Compares the solvers with
/// closed forms. `cache` is `None` if the cache is switched off. If a folder does not exist yet, the doctor checks the
/// nearest parent of the folder that exists.
pub fn examine(fs: &dyn FileSystem, folder: &Path, cache: Option<&Path>) -> Vec<Check> {
    let mut checks = disk::folder(fs, folder);
    checks.extend(machine::numerics());
    checks.extend(closed_forms::checks());
    checks.push(disk::cache(fs, cache));
    checks
}
