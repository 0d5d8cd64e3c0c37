//! Computes several rows at once, each row in a separate process. If one process ends, for example by a lack of memory,
//! the other processes continue.

use std::collections::VecDeque;
use std::io::Read;
#[cfg(unix)]
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use fretwear::campaign::{Campaign, CampaignFolder, Failure, State, StoredCampaign};

use super::super::cost;
use super::run::{RowCounts, RowOutcome};
use super::{CliError, RunArguments};
use crate::progress::{ForwardedSignals, Rows};

/// Time between two checks of the processes.
const TICK: Duration = Duration::from_millis(3);
/// Share of the free memory that rows may take. The estimate for a row is accurate to some per cent.
const MEMORY: f64 = 0.9;

/// Smallest time limit of a process \[s\].
const LEAST_LEFT: f64 = 1e-3;

/// Row that is being computed.
struct Running {
    index: usize,
    memory: u64,
    child: Child,
}

pub fn run(
    arguments: &RunArguments,
    folder: &CampaignFolder,
    about: &StoredCampaign,
    campaign: &Campaign,
    rows: &[usize],
    jobs: usize,
) -> Result<RowCounts, CliError> {
    let signals = ForwardedSignals::listen().map_err(CliError::Signals)?;
    let begin = Instant::now();
    let execution = &arguments.execution;
    let states = folder.states(campaign.rows.len())?;
    let mut counts = RowCounts::default();
    let mut waiting: VecDeque<usize> = VecDeque::new();
    for &index in rows {
        match states[index] {
            State::Complete => {
                super::run::tidy(arguments, folder, about, campaign, index);
                counts.before += 1;
            }
            _ => waiting.push_back(index),
        }
    }
    let memory_limit = cost::free_memory().map(|free| (MEMORY * free as f64) as u64);
    let progress = Rows::new(rows.len(), counts.before, execution.quiet);
    let time_left = || {
        execution
            .max_wall
            .map(|limit| limit - begin.elapsed().as_secs_f64())
    };
    let mut running: Vec<Running> = Vec::new();
    let mut stopping = false;
    loop {
        let signal = signals.take();
        if signal || (!stopping && time_left().is_some_and(|time_left| time_left <= 0.0)) {
            if !stopping {
                progress.say("stopping: running rows end within their iteration or stage");
            }
            stopping = true;
        }
        if signal {
            running.iter().for_each(|row| request_stop(&row.child));
        }
        while !stopping && running.len() < jobs {
            let Some(&index) = waiting.front() else {
                break;
            };
            let memory = campaign.rows[index].memory.max(0) as u64;
            let memory_in_use: u64 = running.iter().map(|row| row.memory).sum();
            if let Some(memory_limit) =
                memory_limit.filter(|memory_limit| memory_in_use + memory > *memory_limit)
            {
                if !running.is_empty() {
                    break;
                }
                progress.say(&format!(
                    "warning: row {index} needs about {:.1} GB of memory, but only {:.1} GB are free",
                    memory as f64 / 1e9,
                    memory_limit as f64 / 1e9
                ));
            }
            let child = start(arguments, index, time_left())?;
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
            let mut stderr_text = String::new();
            if let Some(stderr) = &mut row.child.stderr {
                // If reading fails, the text stays empty.
                drop(stderr.read_to_string(&mut stderr_text));
            }
            let notice = format!("row {}: note: ", row.index);
            let (notices, stderr_text): (Vec<&str>, Vec<&str>) = stderr_text
                .lines()
                .partition(|line| line.starts_with(&notice));
            notices.iter().for_each(|text| progress.notice(text));
            let code = status.as_ref().ok().and_then(|status| status.code());
            let outcome = match code {
                Some(0) => RowOutcome::Done,
                Some(code) if code == i32::from(arguments.resumable_exit) => {
                    match folder.holder(row.index) {
                        Some(_) => RowOutcome::InUse,
                        None => RowOutcome::Stopped,
                    }
                }
                code => failure_outcome(folder, row.index, &stderr_text, code, &status)?,
            };
            counts.add(row.index, &outcome);
            match &outcome {
                RowOutcome::Failed(error) => {
                    progress.say(&error.to_string());
                    progress.ended(&format!("row {}: failed", row.index));
                }
                RowOutcome::Done | RowOutcome::AlreadyDone => {
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
    counts.left = waiting.len();
    Ok(counts)
}

/// Returns the failure that the process of a row has stored. If the process has stored no failure, the function stores
/// and returns a failure with the exit status and the last line on stderr.
fn failure_outcome(
    folder: &CampaignFolder,
    index: usize,
    stderr_lines: &[&str],
    code: Option<i32>,
    status: &std::io::Result<std::process::ExitStatus>,
) -> Result<RowOutcome, CliError> {
    if let (Some(1..=4), Some(failure)) = (code, folder.failure(index)?) {
        let reason = failure.message;
        return Ok(RowOutcome::Failed(CliError::RowFailedNow { index, reason }));
    }
    let ending = match status {
        Ok(status) => format!("its process ended with {status}"),
        Err(error) => format!("waiting for its process failed: {error}"),
    };
    let last = stderr_lines.iter().rfind(|line| !line.trim().is_empty());
    let reason = last.map_or(ending.clone(), |last| format!("{ending}: {last}"));
    // Allow a retry: the system may have killed the process because of another process.
    drop(folder.store_failure(index, &Failure::now(reason.clone(), true, 1)));
    Ok(RowOutcome::Failed(CliError::RowFailedNow { index, reason }))
}

/// Starts the process of a row.
fn start(
    arguments: &RunArguments,
    index: usize,
    time_left: Option<f64>,
) -> Result<Child, CliError> {
    let spawn_error = |source| CliError::Spawn { index, source };
    let program = std::env::current_exe().map_err(spawn_error)?;
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
    if let Some(time_left) = time_left {
        // The time may be over by now, but `--max-wall` must be above 0.
        let time_left = time_left.max(LEAST_LEFT);
        command.arg("--max-wall").arg(format!("{time_left} s"));
    }
    // In a process group of its own, the child gets no signal from the terminal. The parent process passes the signal
    // to the child.
    #[cfg(unix)]
    command.process_group(0);
    command.spawn().map_err(spawn_error)
}

/// Requests a process to stop.
#[cfg(unix)]
fn request_stop(child: &Child) {
    use rustix::process::{Pid, Signal, kill_process};
    if let Some(pid) = Pid::from_raw(child.id().cast_signed()) {
        // Ignore the error of a process that has just ended.
        let _ = kill_process(pid, Signal::TERM);
    }
}

#[cfg(not(unix))]
fn request_stop(_child: &Child) {}
