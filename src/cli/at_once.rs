//! Some runs at a time, each in a process of its own: each goes on where it was stopped.

use std::ffi::OsString;
use std::process::{self, Child};
use std::thread;
use std::time::{Duration, Instant};

use super::arguments::Execution;
use super::{CliError, Exit};
use crate::progress::{Stopping, duration};
use crate::terminal::{say, silenced};

/// How long processes are waited for before they are looked at again.
const TICK: Duration = Duration::from_millis(50);
/// What a process that was asked to stop has to end by itself.
const GRACE: Duration = Duration::from_millis(1000);

/// A run as a command: its name, and what `fretwear run` is given.
pub struct Command {
    pub name: String,
    pub arguments: Vec<OsString>,
}

/// Computes runs in processes of their own, `at_once` at a time. What fails is left to who computes them one after another; true if it was
/// asked to stop.
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
    // Runs at the same time share the cores.
    let threads = execution.threads.unwrap_or(1);
    let mut running: Vec<(usize, Instant, Child)> = Vec::new();
    let mut waiting = (0..commands.len()).peekable();
    let mut asked: Option<Instant> = None;
    let mut stopped = false;
    while !running.is_empty() || (waiting.peek().is_some() && !stopped) {
        let left = execution
            .max_wall
            .map(|wall| wall - began.elapsed().as_secs_f64());
        stopped |= left.is_some_and(|left| left <= 0.0);
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
            if let Some(left) = left {
                child.args(["--max-wall", &format!("{left:.3} s")]);
            }
            let child = silenced(&mut child).spawn().map_err(CliError::Processes)?;
            running.push((next, Instant::now(), child));
        }
        if stopping.is_asked() {
            stopped = true;
            let since = *asked.get_or_insert_with(Instant::now);
            if since.elapsed() > GRACE {
                // Nothing exists until it is committed.
                running
                    .iter_mut()
                    .for_each(|(_, _, child)| drop(child.kill()));
            }
        }
        let mut at = 0;
        while at < running.len() {
            let ended = running[at].2.try_wait().map_err(CliError::Processes)?;
            let Some(status) = ended else {
                at += 1;
                continue;
            };
            let (which, since, _) = running.remove(at);
            stopped |= status.code() == Some(i32::from(Exit::Stopped.code()));
            if !execution.quiet && status.success() {
                let took = duration(since.elapsed().as_secs_f64());
                say(&format!("{} took {took}", commands[which].name));
            }
        }
        thread::sleep(TICK);
    }
    Ok(stopped)
}
