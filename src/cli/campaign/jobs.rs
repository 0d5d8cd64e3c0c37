//! Rows in processes of their own, so many at once: what ends one, a lack of memory too, ends no other.

use std::collections::VecDeque;
use std::io::Read;
#[cfg(unix)]
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use fretwear::campaign::{About, Campaign, Failure, Folder, State};

use super::super::cost;
use super::run::{RowCounts, RowOutcome};
use super::{CliError, RunArguments};
use crate::progress::{ForwardedSignals, Rows};

/// How often processes are looked at.
const TICK: Duration = Duration::from_millis(3);
/// Part of the free memory that rows may take: the count of a row's is good to some per cent.
const MEMORY: f64 = 0.9;

/// Seconds that a process is given at least.
const LEAST_LEFT: f64 = 1e-3;

/// A row that is being computed.
struct Running {
    index: usize,
    memory: u64,
    child: Child,
}

pub fn run(
    arguments: &RunArguments,
    folder: &Folder,
    about: &About,
    campaign: &Campaign,
    rows: &[usize],
    jobs: usize,
) -> Result<RowCounts, CliError> {
    let asked = ForwardedSignals::listen().map_err(CliError::Signals)?;
    let begin = Instant::now();
    let execution = &arguments.execution;
    let states = folder.states(campaign.rows.len())?;
    let mut tally = RowCounts::default();
    let mut waiting: VecDeque<usize> = VecDeque::new();
    for &index in rows {
        match states[index] {
            State::Done => {
                super::run::tidy(arguments, folder, about, campaign, index);
                tally.before += 1;
            }
            _ => waiting.push_back(index),
        }
    }
    let room = cost::free_memory().map(|free| (MEMORY * free as f64) as u64);
    let progress = Rows::new(rows.len(), tally.before, execution.quiet);
    let left = || {
        execution
            .max_wall
            .map(|limit| limit - begin.elapsed().as_secs_f64())
    };
    let mut running: Vec<Running> = Vec::new();
    let mut stopping = false;
    loop {
        let signal = asked.taken();
        if signal || (!stopping && left().is_some_and(|left| left <= 0.0)) {
            if !stopping {
                progress.say("stopping: rows that go on end within their iteration or stage");
            }
            stopping = true;
        }
        if signal {
            running.iter().for_each(|row| ask(&row.child));
        }
        while !stopping && running.len() < jobs {
            let Some(&index) = waiting.front() else {
                break;
            };
            let memory = campaign.rows[index].memory.max(0) as u64;
            let taken: u64 = running.iter().map(|row| row.memory).sum();
            if let Some(room) = room.filter(|room| taken + memory > *room) {
                if !running.is_empty() {
                    break;
                }
                progress.say(&format!(
                    "warning: row {index} takes some {:.1} GB of memory, and {:.1} GB are free for it",
                    memory as f64 / 1e9,
                    room as f64 / 1e9
                ));
            }
            let child = start(arguments, index, left())?;
            running.push(Running {
                index,
                memory,
                child,
            });
            waiting.pop_front();
        }
        let mut k = 0;
        while k < running.len() {
            let status = running[k].child.try_wait();
            let status = match status {
                Ok(None) => {
                    k += 1;
                    continue;
                }
                Ok(Some(status)) => Ok(status),
                Err(error) => Err(error),
            };
            let mut row = running.swap_remove(k);
            let mut said = String::new();
            if let Some(stderr) = &mut row.child.stderr {
                // A pipe that cannot be read gives an empty text.
                drop(stderr.read_to_string(&mut said));
            }
            let notice = format!("row {}: note: ", row.index);
            let (notices, said): (Vec<&str>, Vec<&str>) =
                said.lines().partition(|line| line.starts_with(&notice));
            notices.iter().for_each(|text| progress.notice(text));
            let code = status.as_ref().ok().and_then(|status| status.code());
            let ended = match code {
                Some(0) => RowOutcome::Done,
                Some(code) if code == i32::from(arguments.resumable_exit) => {
                    match folder.holder(row.index) {
                        Some(_) => RowOutcome::InUse,
                        None => RowOutcome::Stopped,
                    }
                }
                code => failed(folder, row.index, &said, code, &status)?,
            };
            tally.add(row.index, &ended);
            match &ended {
                RowOutcome::Failed(error) => {
                    progress.say(&error.to_string());
                    progress.ended(&format!("row {}: failed", row.index));
                }
                RowOutcome::Done | RowOutcome::Before => {
                    progress.ended(&format!("row {}: done", row.index))
                }
                RowOutcome::InUse => {
                    progress.say(&format!("row {} is computed by another process", row.index));
                }
                RowOutcome::Stopped => (),
            }
        }
        if running.is_empty() && (stopping || waiting.is_empty()) {
            break;
        }
        thread::sleep(TICK);
    }
    progress.finish();
    tally.left = waiting.len();
    Ok(tally)
}

/// Why a process failed: what it kept, else what it said, or how it ended.
fn failed(
    folder: &Folder,
    index: usize,
    said: &[&str],
    code: Option<i32>,
    status: &std::io::Result<std::process::ExitStatus>,
) -> Result<RowOutcome, CliError> {
    if let (Some(1..=4), Some(failure)) = (code, folder.failure(index)?) {
        let reason = failure.message;
        return Ok(RowOutcome::Failed(CliError::RowFailedNow { index, reason }));
    }
    let how = match status {
        Ok(status) => format!("its process ended with {status}"),
        Err(error) => format!("its process cannot be waited for: {error}"),
    };
    let last = said.iter().rfind(|line| !line.trim().is_empty());
    let reason = last.map_or(how.clone(), |last| format!("{how}: {last}"));
    // A process that was killed may have been the victim of another.
    drop(folder.fail(index, &Failure::now(reason.clone(), true, 1)));
    Ok(RowOutcome::Failed(CliError::RowFailedNow { index, reason }))
}

/// The process of a row.
fn start(arguments: &RunArguments, index: usize, left: Option<f64>) -> Result<Child, CliError> {
    let failed = |source| CliError::Spawn { index, source };
    let program = std::env::current_exe().map_err(failed)?;
    let mut command = Command::new(program);
    command
        .args(["campaign", "run", "--attached", "--quiet", "--index"])
        .arg(index.to_string())
        .arg("--dir")
        .arg(&arguments.dir)
        .arg("--threads")
        .arg(arguments.execution.threads.unwrap_or(1).to_string())
        .arg("--resumable-exit")
        .arg(arguments.resumable_exit.to_string())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    if arguments.retry {
        command.arg("--retry");
    }
    if let Some(scratch) = &arguments.scratch {
        command.arg("--scratch").arg(scratch);
    }
    if let Some(left) = left {
        // It may be over by now, and no time is no time to give.
        let left = left.max(LEAST_LEFT);
        command.arg("--max-wall").arg(format!("{left} s"));
    }
    // A signal of the terminal comes once, through this process.
    #[cfg(unix)]
    command.process_group(0);
    command.spawn().map_err(failed)
}

/// Asks a process to stop.
#[cfg(unix)]
fn ask(child: &Child) {
    use rustix::process::{Pid, Signal, kill_process};
    if let Some(pid) = Pid::from_raw(child.id().cast_signed()) {
        // One that has just ended needs no asking.
        let _ = kill_process(pid, Signal::TERM);
    }
}

#[cfg(not(unix))]
fn ask(_child: &Child) {}
