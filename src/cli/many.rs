//! Many runs, one after another: each goes on where it was stopped.

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

/// One of the runs.
pub struct Job<'a> {
    pub name: &'a str,
    pub root: PathBuf,
    pub inputs: &'a Inputs,
}

/// What came of them.
pub struct RunOutcomes {
    /// Of each run that came to an end, in order, why it failed if it did.
    pub ended: Vec<Option<RunError>>,
    /// True if it was stopped before the end.
    pub stopped: bool,
}

/// The scenes in a folder, by name.
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

/// How many runs go on.
const SAME: &str = "the same command";

/// Runs them all. One that fails does not keep the others from running, but for a run that belongs to another scene or is damaged. A run
/// that another process computes stops them, as a signal does.
pub fn run_all(execution: &Execution, what: &str, jobs: &[Job]) -> Result<RunOutcomes, CliError> {
    let stopping = Stopping::listen(execution.max_wall, i32::from(Exit::Stopped.code()));
    let stopping = stopping.map_err(CliError::Signals)?;
    let latest = |root: &Path| {
        let reader = RunReader::open(Arc::new(RealFileSystem), root);
        reader.ok().and_then(|reader| reader.latest())
    };
    let mut ran = RunOutcomes {
        ended: Vec::new(),
        stopped: true,
    };
    let mut worked = false;
    for (k, Job { name, root, inputs }) in jobs.iter().enumerate() {
        // A start computes something in any case, so that one with little time after another gets through.
        if stopping.is_asked() || (worked && stopping.is_late()) {
            return Ok(ran);
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
        let watcher = watcher.stopped_by(&stopping, SAME);
        let result = stages::run(&options, &watcher);
        watcher.finish();
        worked |= latest(root) != before;
        let failure = match result {
            Ok(outcome) if outcome.ending == Ending::Stopped => return Ok(ran),
            Ok(_) => None,
            // Another process computes it, maybe one that an earlier start has left.
            Err(RunError::Store(error @ StoreError::Locked { .. })) => {
                say(&error.to_string());
                return Ok(ran);
            }
            // No property of this scene.
            Err(error @ RunError::Store(_)) => return Err(error.into()),
            Err(error) => {
                if !execution.quiet {
                    say(&format!("{name} failed: {error}"));
                }
                Some(error)
            }
        };
        ran.ended.push(failure);
    }
    ran.stopped = false;
    Ok(ran)
}
