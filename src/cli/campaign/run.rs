//! `fretwear campaign run`.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use fretwear::campaign::{
    Campaign, CampaignError, CampaignFolder, Failure, KeepRuns, State, StoredCampaign,
};
use fretwear::recipe::Durability;
use fretwear::stages::{self, Ending, Outcome, RunError, RunOptions};
use fretwear::store::{
    Cache, FileSystem, History, LockAttempt, RealFileSystem, RunReader, StoreError,
    UnsyncedFileSystem, remove_run,
};
use serde_json::json;

use super::super::run::cache_folder;
use super::{CliError, Exit, RunArguments, content_key, folder, jobs, plan_of};
use crate::progress::{Rows, Stopping, Watcher, stop_with_parent};
use crate::terminal::{Results, say};

/// Outcome of a row.
pub enum RowOutcome {
    /// The row was completed now.
    Done,
    /// The row was already complete.
    AlreadyDone,
    /// The row was stopped and can be continued.
    Stopped,
    /// Another process computes the row.
    InUse,
    /// The row failed.
    Failed(CliError),
}

/// Outcomes of many rows.
#[derive(Default)]
pub struct RowCounts {
    pub done: usize,
    pub before: usize,
    pub stopped: Vec<usize>,
    pub in_use: Vec<usize>,
    pub failed: Vec<usize>,
    /// Number of rows that were not started.
    pub left: usize,
}

impl RowCounts {
    pub fn add(&mut self, index: usize, ended: &RowOutcome) {
        match ended {
            RowOutcome::Done => self.done += 1,
            RowOutcome::AlreadyDone => self.before += 1,
            RowOutcome::Stopped => self.stopped.push(index),
            RowOutcome::InUse => self.in_use.push(index),
            RowOutcome::Failed(_) => self.failed.push(index),
        }
    }

    fn exit(&self, resumable: u8) -> Exit {
        let is_whole = self.stopped.is_empty() && self.in_use.is_empty() && self.left == 0;
        match (is_whole, self.failed.is_empty()) {
            (false, _) => Exit::StoppedAs(resumable),
            (true, false) => Exit::Failure,
            (true, true) => Exit::Done,
        }
    }
}

pub fn run(arguments: &RunArguments, out: &mut Results) -> Result<Exit, CliError> {
    let folder = folder(&arguments.dir);
    let (about, campaign) = folder.open()?;
    if arguments.scratch.is_some() && about.keep != KeepRuns::History {
        return Err(CliError::ScratchOfRuns);
    }
    let last = campaign.rows.len().saturating_sub(1);
    let [first, end] = arguments.index.unwrap_or([0, last]);
    if end > last {
        let asked = match first == end {
            true => first.to_string(),
            false => format!("{first}-{end}"),
        };
        return Err(CampaignError::NoRow {
            path: folder.root,
            asked,
            last: last as u64,
        }
        .into());
    }
    let rows: Vec<usize> = (first..=end).collect();
    let counts = match (arguments.jobs, &rows[..]) {
        (Some(jobs), _) => jobs::run(arguments, &folder, &about, &campaign, &rows, jobs)?,
        (None, [index]) => match run_single(arguments, &folder, &about, &campaign, *index)? {
            // Return the error, because the exit code of the error gives the reason of the failure.
            RowOutcome::Failed(error) => return Err(error),
            ended => {
                let mut counts = RowCounts::default();
                counts.add(*index, &ended);
                counts
            }
        },
        (None, rows) => one_by_one(arguments, &folder, &about, &campaign, rows)?,
    };
    if arguments.json {
        out.json(&json!({
            "rows": rows.len(),
            "done": counts.done,
            "done_before": counts.before,
            "failed": counts.failed,
            "stopped": counts.stopped,
            "in_use": counts.in_use,
            "left": counts.left,
        }));
    } else if !arguments.execution.quiet {
        let mut parts = vec![format!("{} done", counts.done + counts.before)];
        let named_counts = [
            (counts.failed.len(), "failed"),
            (counts.stopped.len(), "stopped"),
            (counts.in_use.len(), "computed by other processes"),
            (counts.left, "not started"),
        ];
        let nonzero_counts = named_counts.into_iter().filter(|(count, _)| *count > 0);
        parts.extend(nonzero_counts.map(|(count, what)| format!("{count} {what}")));
        say(&format!("{} rows: {}", rows.len(), parts.join(", ")));
        let exit = counts.exit(arguments.resumable_exit);
        if matches!(exit, Exit::StoppedAs(_)) {
            say("run the same command again to continue");
        }
        if !counts.failed.is_empty() {
            say("to see why rows failed:  fretwear campaign status --dir DIR");
        }
    }
    Ok(counts.exit(arguments.resumable_exit))
}

/// Computes a single row with the progress of a run.
fn run_single(
    arguments: &RunArguments,
    folder: &CampaignFolder,
    about: &StoredCampaign,
    campaign: &Campaign,
    index: usize,
) -> Result<RowOutcome, CliError> {
    if let Some(outcome) = previous_outcome(arguments, folder, about, campaign, index)? {
        return Ok(outcome);
    }
    if arguments.attached {
        stop_with_parent();
    }
    let execution = &arguments.execution;
    let exit = i32::from(arguments.resumable_exit);
    let stopping = Stopping::listen(execution.max_wall, exit).map_err(CliError::Signals)?;
    // The parent process shows the notices of an attached child process.
    let rows = arguments.attached.then(|| Rows::new(1, 0, false));
    let rows = rows.as_ref();
    compute_and_store(arguments, folder, about, campaign, index, &stopping, rows)
}

fn one_by_one(
    arguments: &RunArguments,
    folder: &CampaignFolder,
    about: &StoredCampaign,
    campaign: &Campaign,
    rows: &[usize],
) -> Result<RowCounts, CliError> {
    let execution = &arguments.execution;
    let exit = i32::from(arguments.resumable_exit);
    let stopping = Stopping::listen(execution.max_wall, exit).map_err(CliError::Signals)?;
    let progress = Rows::new(rows.len(), 0, execution.quiet);
    let mut counts = RowCounts::default();
    for (place, &index) in rows.iter().enumerate() {
        let has_computed = counts.done > 0;
        // Compute at least one row per start, so that repeated starts with little time make progress.
        if stopping.is_asked() || (has_computed && stopping.is_late()) {
            counts.left = rows.len() - place;
            break;
        }
        let outcome = match previous_outcome(arguments, folder, about, campaign, index)? {
            Some(outcome) => outcome,
            None => {
                let rows = Some(&progress);
                compute_and_store(arguments, folder, about, campaign, index, &stopping, rows)?
            }
        };
        counts.add(index, &outcome);
        match &outcome {
            RowOutcome::Done => progress.ended(&format!("row {index}: done")),
            RowOutcome::AlreadyDone => progress.ended(&format!("row {index}: done before")),
            RowOutcome::Failed(error) => {
                let reason = match error {
                    CliError::RowFailed { .. } => error.to_string(),
                    error => format!("row {index} failed: {error}"),
                };
                progress.say(&reason);
                progress.ended(&format!("row {index}: failed"));
            }
            RowOutcome::InUse => {
                progress.say(&format!("row {index} is computed by another process"))
            }
            RowOutcome::Stopped => {
                counts.left = rows.len() - place - 1;
                break;
            }
        }
    }
    progress.finish();
    Ok(counts)
}

/// Returns the folder in which a row is computed.
fn run_folder(
    arguments: &RunArguments,
    folder: &CampaignFolder,
    campaign: &Campaign,
    index: usize,
) -> PathBuf {
    match &arguments.scratch {
        None => folder.run(index),
        Some(scratch) => {
            let key = campaign.rows[index].content_key.chars().take(16);
            scratch.join(format!("{index:06}-{}", key.collect::<String>()))
        }
    }
}

/// Removes the files that a completed row does not keep.
pub fn tidy(
    arguments: &RunArguments,
    folder: &CampaignFolder,
    about: &StoredCampaign,
    campaign: &Campaign,
    index: usize,
) {
    let key = &campaign.rows[index].content_key;
    let keeps_run = about.keep == KeepRuns::All;
    let run = (!keeps_run).then(|| folder.run(index));
    folder.tidy_ended(index, key, run.as_deref());
    if arguments.scratch.is_some() {
        let scratch = run_folder(arguments, folder, campaign, index);
        // Ignore errors: a leftover folder does no harm to a completed row.
        drop(remove_run(&RealFileSystem, &scratch, key));
    }
}

/// Returns the outcome of a row that need not be computed: a completed row, or a failed row without retry.
fn previous_outcome(
    arguments: &RunArguments,
    folder: &CampaignFolder,
    about: &StoredCampaign,
    campaign: &Campaign,
    index: usize,
) -> Result<Option<RowOutcome>, CliError> {
    Ok(match folder.state(index)? {
        State::Complete => {
            tidy(arguments, folder, about, campaign, index);
            Some(RowOutcome::AlreadyDone)
        }
        State::Failed => {
            let failure = folder.failure(index)?;
            let final_failure = failure.filter(|failure| !(failure.again || arguments.retry));
            final_failure.map(|Failure { message, code, .. }| {
                let reason = message;
                RowOutcome::Failed(CliError::RowFailed {
                    index,
                    reason,
                    code,
                })
            })
        }
        _ => None,
    })
}

/// Computes a row and stores the outcome of the row. If `rows` is given (one of many rows), the function prints only
/// notices.
fn compute_and_store(
    arguments: &RunArguments,
    folder: &CampaignFolder,
    about: &StoredCampaign,
    campaign: &Campaign,
    index: usize,
    stopping: &Stopping,
    rows: Option<&Rows>,
) -> Result<RowOutcome, CliError> {
    let claim = match folder.lock_row(index) {
        Ok(LockAttempt::Taken(claim)) => claim,
        Ok(LockAttempt::Held { .. }) => return Ok(RowOutcome::InUse),
        Err(error) => return store_failure(folder, index, error.into()),
    };
    // Another process may have completed the row in the meantime.
    let outcome = match folder.state(index)? {
        State::Complete => Ok(RowOutcome::AlreadyDone),
        state => {
            if state == State::Failed {
                folder.remove_failure(index)?;
            }
            let computed = compute(arguments, folder, about, campaign, index, stopping, rows);
            computed.or_else(|error| store_failure(folder, index, error))
        }
    };
    // Ignore errors: a leftover lock file blocks nobody, and the outcome is already stored.
    drop(folder.unlock_row(index, claim));
    outcome
}

/// Stores the failure of a row.
fn store_failure(
    folder: &CampaignFolder,
    index: usize,
    error: CliError,
) -> Result<RowOutcome, CliError> {
    if let CliError::Run(RunError::Store(StoreError::Locked { .. })) = &error {
        return Ok(RowOutcome::InUse);
    }
    // Retry failures of the disk, the machine and the files that scenes name. A failure of the computation would
    // repeat.
    let again = match &error {
        CliError::Run(error) => matches!(error, RunError::Store(_)),
        _ => true,
    };
    let failure = Failure::now(error.to_string(), again, error.exit().code());
    if let Err(write_error) = folder.store_failure(index, &failure) {
        say(&format!(
            "warning: cannot store the failure of row {index}: {write_error}"
        ));
    }
    Ok(RowOutcome::Failed(error))
}

fn compute(
    arguments: &RunArguments,
    folder: &CampaignFolder,
    about: &StoredCampaign,
    campaign: &Campaign,
    index: usize,
    stopping: &Stopping,
    rows: Option<&Rows>,
) -> Result<RowOutcome, CliError> {
    let planned = &campaign.rows[index];
    let plan = plan_of(folder, about, &planned.settings)?;
    if content_key(&plan) != planned.content_key {
        return Err(CliError::RowChanged {
            reason: format!(
                "row {index} differs from its plan: a file that its scene names has changed, or the program (the plan is by version {}); restore the file, or plan the campaign in another folder",
                about.program_version
            ),
        });
    }
    let mut files: Arc<dyn FileSystem> = Arc::new(RealFileSystem);
    // The run folder is removed at the end, so nothing in it needs to be synced.
    let durability = plan.inputs.recipe.output.durability;
    if (about.keep, durability) == (KeepRuns::History, Durability::End) {
        files = Arc::new(UnsyncedFileSystem(files));
    }
    let root = run_folder(arguments, folder, campaign, index);
    let quiet = arguments.execution.quiet || rows.is_some();
    let watcher = Watcher::new(&plan.inputs.recipe, &root, quiet);
    let mut watcher = watcher.with_stopping(stopping, "the same command");
    if let Some(rows) = rows {
        watcher = watcher.of_row(index, rows);
    }
    let options = RunOptions {
        inputs: &plan.inputs,
        root: root.clone(),
        source: None,
        until: None,
        // The rows share the cores.
        threads: arguments.execution.threads.unwrap_or(1),
        cache: cache_folder().map(|folder| Cache::new(Arc::new(RealFileSystem), &folder)),
        file_system: files.clone(),
        stop: &|commits| stopping.is_asked() || (commits > 0 && stopping.is_late()),
    };
    let result = stages::run(&options, &watcher);
    watcher.finish();
    let outcome = result?;
    if outcome.ending == Ending::Stopped {
        return Ok(RowOutcome::Stopped);
    }
    let Some(history) = own_history(files, &root, &outcome)? else {
        return Ok(RowOutcome::InUse);
    };
    let bytes = history
        .to_bytes_of(Some(&planned.content_key))
        .map_err(|source| CampaignError::Table {
            path: root.clone(),
            source: Box::new(source),
        })?;
    folder.complete(index, &bytes)?;
    if about.keep == KeepRuns::History {
        // Ignore errors: a leftover folder does no harm, and the next start removes it.
        drop(remove_run(&RealFileSystem, &root, &planned.content_key));
    }
    Ok(RowOutcome::Done)
}

/// Reads the history of a run folder, if the history belongs to the run of the present process. The history belongs to
/// the present run under two conditions. The history has all rows up to the last iteration. The commit of the last row
/// is the commit of the run. Without working locks, another process may have written or removed the folder. If the
/// folder does not have the history of the present run, the function returns `None`.
fn own_history(
    files: Arc<dyn FileSystem>,
    root: &Path,
    outcome: &Outcome,
) -> Result<Option<History>, CliError> {
    let history = RunReader::open(files, root).and_then(|run| run.history());
    let history = match history {
        Ok(history) => history,
        Err(StoreError::Io { source, .. }) if source.kind() == ErrorKind::NotFound => {
            return Ok(None);
        }
        Err(error @ StoreError::Io { .. }) => return Err(RunError::from(error).into()),
        Err(_) => return Ok(None),
    };
    let last = outcome.wear_iteration.unwrap_or(0);
    let is_own =
        history.len() as u64 == last + 1 && history.commit_of(last) == outcome.commit.as_deref();
    Ok(is_own.then_some(history))
}
