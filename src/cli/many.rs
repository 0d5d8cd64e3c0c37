//! Many runs, one after another. Stopped runs continue.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use fretwear::recipe::Inputs;
use fretwear::stages::{self, Ending, RunError, RunOptions};
use fretwear::store::{Cache, EntryKind, FileSystem, RealFileSystem, RunReader, StoreError};

use super::arguments::{Execution, threads_or_cores};
use super::run::cache_folder;
use super::{CliError, Exit};
use crate::progress::{Stopping, Watcher};
use crate::terminal::say;

/// Name, folder and inputs of a run.
pub struct Job<'a> {
    pub name: &'a str,
    pub root: PathBuf,
    pub inputs: &'a Inputs,
}

/// Outcomes of the runs.
pub struct RunOutcomes {
    /// For each run that ended, in order: its error, if it failed.
    pub failures: Vec<Option<RunError>>,
    /// True if the command was stopped before all runs ended.
    pub stopped: bool,
}

/// Lists the scenes in a folder, sorted by name.
pub fn scenes_in(folder: &Path) -> Result<Vec<PathBuf>, CliError> {
    let entries = RealFileSystem.list(folder);
    let entries = entries.map_err(|source| CliError::Scenes {
        path: folder.to_owned(),
        source,
    })?;
    let scenes: Vec<PathBuf> = entries
        .iter()
        .filter(|entry| entry.kind != EntryKind::Folder && entry.name.ends_with(".toml"))
        .map(|entry| folder.join(&entry.name))
        .collect();
    if scenes.is_empty() {
        return Err(CliError::NoScenes {
            path: folder.to_owned(),
        });
    }
    Ok(scenes)
}

/// Command that continues the runs, for messages.
const SAME: &str = "the same command";

/// Computes all runs. After a failed run, the others continue, except if the run folder belongs to another scene or is
/// damaged. A run that another process computes stops the sequence, as a signal does.
pub fn run_all(execution: &Execution, what: &str, jobs: &[Job]) -> Result<RunOutcomes, CliError> {
    let stopping = Stopping::listen(execution.max_wall, i32::from(Exit::Stopped.code()));
    let stopping = stopping.map_err(CliError::Signals)?;
    let latest = |root: &Path| {
        let reader = RunReader::open(Arc::new(RealFileSystem), root);
        reader.ok().and_then(|reader| reader.latest())
    };
    let mut outcomes = RunOutcomes {
        failures: Vec::new(),
        stopped: true,
    };
    let mut has_computed = false;
    for (k, Job { name, root, inputs }) in jobs.iter().enumerate() {
        // Compute something in every start, so that repeated starts with little time make progress.
        if stopping.is_asked() || (has_computed && stopping.is_late()) {
            return Ok(outcomes);
        }
        if !execution.quiet {
            say(&format!("{what} {} of {}: {name}", k + 1, jobs.len()));
        }
        let options = RunOptions {
            inputs,
            root: root.clone(),
            source: None,
            until: None,
            threads: threads_or_cores(execution.threads),
            cache: cache_folder().map(|folder| Cache::new(Arc::new(RealFileSystem), &folder)),
            file_system: Arc::new(RealFileSystem),
            stop: &|commits| stopping.is_asked() || (commits > 0 && stopping.is_late()),
        };
        let before = latest(root);
        let watcher = Watcher::new(&inputs.recipe, root, execution.quiet);
        let watcher = watcher.with_stopping(&stopping, SAME);
        let result = stages::run(&options, &watcher);
        watcher.finish();
        has_computed |= latest(root) != before;
        let failure = match result {
            Ok(outcome) if outcome.ending == Ending::Stopped => return Ok(outcomes),
            Ok(_) => None,
            // Another process computes the run, perhaps a leftover of an earlier start.
            Err(RunError::Store(error @ StoreError::Locked { .. })) => {
                say(&error.to_string());
                return Ok(outcomes);
            }
            // Return an error of the store at once, because the scene does not cause the error.
            Err(error @ RunError::Store(_)) => return Err(error.into()),
            Err(error) => {
                if !execution.quiet {
                    say(&format!("{name} failed: {error}"));
                }
                Some(error)
            }
        };
        outcomes.failures.push(failure);
    }
    outcomes.stopped = false;
    Ok(outcomes)
}
