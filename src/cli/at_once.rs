//! Several runs at the same time, each in its own process.

use std::ffi::OsString;
use std::process::{self, Child};
use std::thread;
use std::time::{Duration, Instant};

use super::arguments::Execution;
use super::{CliError, Exit};
use crate::progress::{Stopping, duration};
use crate::terminal::{say, without_output};

/// Time between two checks of the processes.
const TICK: Duration = Duration::from_millis(50);
/// Time that a process has to end by itself after a request to stop.
const GRACE: Duration = Duration::from_millis(1000);

/// Command of a run: the name of the run, and the arguments of `fretwear run`.
pub struct Command {
    pub name: String,
    pub arguments: Vec<OsString>,
}

/// Computes each run in a separate process, with up to `at_once` processes at a time. A stopped run continues from the
/// last commit of the run. `run_at_once` ignores a failed run, because the caller computes all runs again one after
/// another and then reports the failure. Returns true after a request to stop.
pub fn run_at_once(
    execution: &Execution,
    what: &str,
    commands: &[Command],
    at_once: usize,
) -> Result<bool, CliError> {
    let began = Instant::now();
    let stopping =
        Stopping::listen(None, i32::from(Exit::Stopped.code())).map_err(CliError::Signals)?;
    let program = std::env::current_exe().map_err(CliError::Processes)?;
    // The runs share the cores.
    let threads = execution.threads.unwrap_or(1);
    let mut running: Vec<(usize, Instant, Child)> = Vec::new();
    let mut waiting = (0..commands.len()).peekable();
    let mut stop_time: Option<Instant> = None;
    let mut stopped = false;
    while !running.is_empty() || (waiting.peek().is_some() && !stopped) {
        let remaining = execution
            .max_wall
            .map(|wall| wall - began.elapsed().as_secs_f64());
        stopped |= remaining.is_some_and(|remaining| remaining <= 0.0);
        while !stopped
            && running.len() < at_once
            && let Some(next) = waiting.next()
        {
            let command = &commands[next];
            if !execution.quiet {
                say(&format!(
                    "{what} {} of {}: {}",
                    next + 1,
                    commands.len(),
                    command.name
                ));
            }
            let mut child = process::Command::new(&program);
            child.arg("run").args(&command.arguments);
            child.args(["--attached", "--quiet", "--threads", &threads.to_string()]);
            if let Some(remaining) = remaining {
                child.args(["--max-wall", &format!("{remaining:.3} s")]);
            }
            let child = without_output(&mut child)
                .spawn()
                .map_err(CliError::Processes)?;
            running.push((next, Instant::now(), child));
        }
        if stopping.is_asked() {
            stopped = true;
            let since = *stop_time.get_or_insert_with(Instant::now);
            if since.elapsed() > GRACE {
                // Killing is safe: only committed results exist.
                running
                    .iter_mut()
                    .for_each(|(_, _, child)| drop(child.kill()));
            }
        }
        let mut position = 0;
        while position < running.len() {
            let exit_status = running[position]
                .2
                .try_wait()
                .map_err(CliError::Processes)?;
            let Some(status) = exit_status else {
                position += 1;
                continue;
            };
            let (index, since, _) = running.remove(position);
            stopped |= status.code() == Some(i32::from(Exit::Stopped.code()));
            if !execution.quiet && status.success() {
                let time = duration(since.elapsed().as_secs_f64());
                say(&format!("{} took {time}", commands[index].name));
            }
        }
        thread::sleep(TICK);
    }
    Ok(stopped)
}
