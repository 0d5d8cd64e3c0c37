//! `fretwear campaign run`.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use fretwear::campaign::{About, Campaign, CampaignError, Failure, Folder, KeepRuns, State};
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

/// What became of a row.
pub enum RowOutcome {
    /// It is done.
    Done,
    /// It was done before.
    Before,
    /// It was stopped, and can be continued.
    Stopped,
    /// Another process computes it.
    InUse,
    /// It failed.
    Failed(CliError),
}

/// What became of many.
#[derive(Default)]
pub struct RowCounts {
    pub done: usize,
    pub before: usize,
    pub stopped: Vec<usize>,
    pub in_use: Vec<usize>,
    pub failed: Vec<usize>,
    /// Rows that were not come to.
    pub left: usize,
}

impl RowCounts {
    pub fn add(&mut self, index: usize, ended: &RowOutcome) {
        match ended {
            RowOutcome::Done => self.done += 1,
            RowOutcome::Before => self.before += 1,
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
    let tally = match (arguments.jobs, &rows[..]) {
        (Some(jobs), _) => jobs::run(arguments, &folder, &about, &campaign, &rows, jobs)?,
        (None, [index]) => match alone(arguments, &folder, &about, &campaign, *index)? {
            // The code says why.
            RowOutcome::Failed(error) => return Err(error),
            ended => {
                let mut tally = RowCounts::default();
                tally.add(*index, &ended);
                tally
            }
        },
        (None, rows) => one_by_one(arguments, &folder, &about, &campaign, rows)?,
    };
    if arguments.json {
        out.json(&json!({
            "rows": rows.len(),
            "done": tally.done,
            "done_before": tally.before,
            "failed": tally.failed,
            "stopped": tally.stopped,
            "in_use": tally.in_use,
            "left": tally.left,
        }));
    } else if !arguments.execution.quiet {
        let mut parts = vec![format!("{} done", tally.done + tally.before)];
        let counts = [
            (tally.failed.len(), "failed"),
            (tally.stopped.len(), "stopped"),
            (tally.in_use.len(), "computed by other processes"),
            (tally.left, "not begun"),
        ];
        let told = counts.into_iter().filter(|(count, _)| *count > 0);
        parts.extend(told.map(|(count, what)| format!("{count} {what}")));
        say(&format!("{} rows: {}", rows.len(), parts.join(", ")));
        let exit = tally.exit(arguments.resumable_exit);
        if matches!(exit, Exit::StoppedAs(_)) {
            say("run the same command again to continue");
        }
        if !tally.failed.is_empty() {
            say("why rows failed:  fretwear campaign status --dir DIR");
        }
    }
    Ok(tally.exit(arguments.resumable_exit))
}

/// A row, watched as a run of its own.
fn alone(
    arguments: &RunArguments,
    folder: &Folder,
    about: &About,
    campaign: &Campaign,
    index: usize,
) -> Result<RowOutcome, CliError> {
    if let Some(ended) = ended_before(arguments, folder, about, campaign, index)? {
        return Ok(ended);
    }
    if arguments.attached {
        stop_with_parent();
    }
    let execution = &arguments.execution;
    let exit = i32::from(arguments.resumable_exit);
    let stopping = Stopping::listen(execution.max_wall, exit).map_err(CliError::Signals)?;
    // Who started this process shows its notices.
    let rows = arguments.attached.then(|| Rows::new(1, 0, false));
    let rows = rows.as_ref();
    row(arguments, folder, about, campaign, index, &stopping, rows)
}

fn one_by_one(
    arguments: &RunArguments,
    folder: &Folder,
    about: &About,
    campaign: &Campaign,
    rows: &[usize],
) -> Result<RowCounts, CliError> {
    let execution = &arguments.execution;
    let exit = i32::from(arguments.resumable_exit);
    let stopping = Stopping::listen(execution.max_wall, exit).map_err(CliError::Signals)?;
    let progress = Rows::new(rows.len(), 0, execution.quiet);
    let mut tally = RowCounts::default();
    for (place, &index) in rows.iter().enumerate() {
        let worked = tally.done > 0;
        // A start computes something in any case, so that one with little time after another gets through.
        if stopping.is_asked() || (worked && stopping.is_late()) {
            tally.left = rows.len() - place;
            break;
        }
        let ended = match ended_before(arguments, folder, about, campaign, index)? {
            Some(ended) => ended,
            None => {
                let rows = Some(&progress);
                row(arguments, folder, about, campaign, index, &stopping, rows)?
            }
        };
        tally.add(index, &ended);
        match &ended {
            RowOutcome::Done => progress.ended(&format!("row {index}: done")),
            RowOutcome::Before => progress.ended(&format!("row {index}: done before")),
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
                tally.left = rows.len() - place - 1;
                break;
            }
        }
    }
    progress.finish();
    Ok(tally)
}

/// Where a row is computed.
fn place_of(
    arguments: &RunArguments,
    folder: &Folder,
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

/// Removes what a row that has ended does not keep.
pub fn tidy(
    arguments: &RunArguments,
    folder: &Folder,
    about: &About,
    campaign: &Campaign,
    index: usize,
) {
    let key = &campaign.rows[index].content_key;
    let kept = about.keep == KeepRuns::All;
    let own = (!kept).then(|| folder.run(index));
    folder.tidy_ended(index, key, own.as_deref());
    if arguments.scratch.is_some() {
        let scratch = place_of(arguments, folder, campaign, index);
        // A folder that stays does no harm: the row has ended.
        drop(remove_run(&RealFileSystem, &scratch, key));
    }
}

/// What became of a row that needs no computing, if it is one.
fn ended_before(
    arguments: &RunArguments,
    folder: &Folder,
    about: &About,
    campaign: &Campaign,
    index: usize,
) -> Result<Option<RowOutcome>, CliError> {
    Ok(match folder.state(index)? {
        State::Done => {
            tidy(arguments, folder, about, campaign, index);
            Some(RowOutcome::Before)
        }
        State::Failed => {
            let failure = folder.failure(index)?;
            let lasts = failure.filter(|failure| !(failure.again || arguments.retry));
            lasts.map(|Failure { message, code, .. }| {
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

/// Computes a row, and keeps what became of it. A row of many shows its notices alone, through `rows`.
fn row(
    arguments: &RunArguments,
    folder: &Folder,
    about: &About,
    campaign: &Campaign,
    index: usize,
    stopping: &Stopping,
    rows: Option<&Rows>,
) -> Result<RowOutcome, CliError> {
    let claim = match folder.claim(index) {
        Ok(LockAttempt::Taken(claim)) => claim,
        Ok(LockAttempt::Held { .. }) => return Ok(RowOutcome::InUse),
        Err(error) => return kept(folder, index, error.into()),
    };
    // Another start may have ended it until now.
    let ended = match folder.state(index)? {
        State::Done => Ok(RowOutcome::Before),
        state => {
            if state == State::Failed {
                folder.forget(index)?;
            }
            let computed = compute(arguments, folder, about, campaign, index, stopping, rows);
            computed.or_else(|error| kept(folder, index, error))
        }
    };
    // A lock's file that stays keeps nobody out, and what became of the row stands.
    drop(folder.release(index, claim));
    ended
}

/// Keeps why a row failed.
fn kept(folder: &Folder, index: usize, error: CliError) -> Result<RowOutcome, CliError> {
    if let CliError::Run(RunError::Store(StoreError::Locked { .. })) = &error {
        return Ok(RowOutcome::InUse);
    }
    // The disk, the machine and files that scenes name may be better next time; a scene computes to the same failure.
    let again = match &error {
        CliError::Run(error) => matches!(error, RunError::Store(_)),
        _ => true,
    };
    let failure = Failure::now(error.to_string(), again, error.exit().code());
    if let Err(unkept) = folder.fail(index, &failure) {
        say(&format!(
            "warning: why row {index} failed cannot be kept: {unkept}"
        ));
    }
    Ok(RowOutcome::Failed(error))
}

fn compute(
    arguments: &RunArguments,
    folder: &Folder,
    about: &About,
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
                "row {index} is not what was planned: a file that its scene names has changed since, or the program (it was planned by version {}); put the file back, or plan the campaign in another folder",
                about.program_version
            ),
        });
    }
    let mut files: Arc<dyn FileSystem> = Arc::new(RealFileSystem);
    // Of a run whose folder goes in the end nothing needs to be on the disk before.
    let durability = plan.inputs.recipe.output.durability;
    if (about.keep, durability) == (KeepRuns::History, Durability::End) {
        files = Arc::new(UnsyncedFileSystem(files));
    }
    let root = place_of(arguments, folder, campaign, index);
    let quiet = arguments.execution.quiet || rows.is_some();
    let watcher = Watcher::new(&plan.inputs.recipe, &root, quiet);
    let mut watcher = watcher.stopped_by(stopping, "the same command");
    if let Some(rows) = rows {
        watcher = watcher.of_row(index, rows);
    }
    let options = RunOptions {
        inputs: &plan.inputs,
        root: root.clone(),
        source: None,
        until: None,
        // Rows share the cores.
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
    folder.end(index, &bytes)?;
    if about.keep == KeepRuns::History {
        // A folder that stays does no harm: the row has ended, and the next start removes it.
        drop(remove_run(&RealFileSystem, &root, &planned.content_key));
    }
    Ok(RowOutcome::Done)
}

/// The history in a run folder, if it is that of the run which this process has ended: it has all rows up to the last iteration, and the same
/// commit there. Where locks have no effect, another process may have written or removed the folder; then there is none.
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
