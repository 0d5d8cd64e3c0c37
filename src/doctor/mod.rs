//! Whether this machine can compute runs and keep them: what `fretwear doctor` looks at.
//!
//! The checks use what runs use (the store's file system, the solvers' transforms and factors, the tables' Parquet), so that
//! what fails here would fail there. Nothing is left behind.

pub mod closed_forms;
mod disk;
mod machine;

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use crate::store::FileSystem;

pub use machine::{seconds_of_operation, seconds_of_pair};

/// How a check ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// As it should be.
    Ok,
    /// Runs are right, but slow, short of room, or computed twice.
    Warning,
    /// Runs would fail or could be wrong.
    Failed,
}

/// One check and what it found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// What was looked at.
    pub name: &'static str,
    /// How it ended.
    pub state: State,
    /// What was found, in words.
    pub found: String,
    /// What to do, unless it is as it should be.
    pub advice: Option<String>,
    /// The numbers in it, in SI units, by name.
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
        Check::ok(name, found).but(State::Failed, advice)
    }

    /// The check with a state that calls for something to be done.
    fn but(mut self, state: State, advice: &str) -> Check {
        self.state = state;
        self.advice = Some(advice.to_owned());
        self
    }

    fn number(mut self, name: &'static str, value: f64) -> Check {
        self.numbers.insert(name, value);
        self
    }
}

/// Looks at the folder where runs go, at the processor and the numerics, at the solvers against closed forms, and at the cache of
/// structures (none: it is switched off). A folder that is not there yet is looked at where it would be created.
pub fn examine(fs: &dyn FileSystem, folder: &Path, cache: Option<&Path>) -> Vec<Check> {
    let mut checks = disk::folder(fs, folder);
    checks.extend(machine::numerics());
    checks.extend(closed_forms::checks());
    checks.push(disk::cache(fs, cache));
    checks
}
