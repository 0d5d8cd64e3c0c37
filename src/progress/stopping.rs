//! Handling of Ctrl-C, SIGTERM and `--max-wall`.
//!
//! The running iteration may finish if it needs at most a short time. If the iteration needs more time, the process
//! ends within a stage. The process may end safely at any time, since a run consists only of its commits.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use indicatif::ProgressBar;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use super::duration;
use crate::terminal::say;

/// Interval between checks for a signal.
const TICK: Duration = Duration::from_millis(50);
/// Time in which the running iteration may finish after a stop request.
const GRACE: Duration = Duration::from_millis(1500);

/// Current work of the process, for the thread that ends it.
#[derive(Default)]
pub struct ProcessPhase {
    /// Name of the stage and iteration, whether the stage continues after an interruption, and its start; `None`
    /// between runs.
    stage: Option<(String, bool, Instant)>,
    /// Total number of stages that the process has started, summed over all runs.
    begun: u64,
    /// Command that continues the run.
    continuation: String,
    bar: Option<ProgressBar>,
    /// True after the last stage. After the last stage, only the final report remains.
    over: bool,
}

/// Forwarding of signals by a command that starts other processes. The command forwards each signal to the processes
/// that compute.
pub struct ForwardedSignals(Arc<AtomicBool>);

impl ForwardedSignals {
    /// Listens to signals.
    pub fn listen() -> io::Result<ForwardedSignals> {
        let signalled = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            flag::register(signal, signalled.clone())?;
        }
        Ok(ForwardedSignals(signalled))
    }

    /// Listens to the first signal. A second signal ends the process with `exit`.
    ///
    /// # Errors
    /// Returns errors of the operating system.
    pub fn listen_once(exit: i32) -> io::Result<ForwardedSignals> {
        let signalled = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // The order matters: the first signal must find the flag unset.
            flag::register_conditional_shutdown(signal, exit, signalled.clone())?;
            flag::register(signal, signalled.clone())?;
        }
        Ok(ForwardedSignals(signalled))
    }

    /// Returns true after a signal.
    pub fn is_asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Returns true if a signal has arrived since the last call.
    pub fn take(&self) -> bool {
        self.0.swap(false, Ordering::Relaxed)
    }
}

/// Requests that the operating system sends the signal `TERM` to this process when the parent process ends.
pub fn stop_with_parent() {
    #[cfg(target_os = "linux")]
    {
        let signal = rustix::process::Signal::TERM;
        // Without the signal, the process would continue to compute after its parent process has ended.
        let _ = rustix::process::set_parent_process_death_signal(Some(signal));
    }
}

/// Ends a command on a stop request. After the last clone is dropped, it no longer ends the process.
#[derive(Clone)]
pub struct Stopping {
    asked: Arc<AtomicBool>,
    begin: Instant,
    limit: Option<Duration>,
    at: Arc<Mutex<ProcessPhase>>,
    /// The thread that ends the process runs as long as a clone of `alive` exists.
    alive: Arc<()>,
}

impl Stopping {
    /// Listens to signals and to a limit of time \[s\]. If the running iteration takes too long after a stop request,
    /// the thread ends the process with the exit code `exit`.
    pub fn listen(limit: Option<f64>, exit: i32) -> io::Result<Stopping> {
        let signalled = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            flag::register(signal, signalled.clone())?;
        }
        let stopping = Stopping {
            asked: Arc::default(),
            begin: Instant::now(),
            limit: limit.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok()),
            at: Arc::default(),
            alive: Arc::default(),
        };
        let watch = Watch {
            signalled,
            asked: stopping.asked.clone(),
            at: stopping.at.clone(),
            end: stopping.limit.map(|limit| stopping.begin + limit),
            exit,
        };
        let alive = Arc::downgrade(&stopping.alive);
        thread::spawn(move || watch.run(|| alive.strong_count() > 0));
        Ok(stopping)
    }

    /// Returns true after a signal.
    pub fn is_asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }

    /// Returns true after the limit of time.
    pub fn is_late(&self) -> bool {
        self.limit
            .is_some_and(|limit| self.begin.elapsed() >= limit)
    }

    /// Registers a new run, with the progress bar of the run and the command that continues the run.
    pub fn open_run(&self, continuation: &str, bar: Option<ProgressBar>) {
        let mut at = self.at();
        at.stage = None;
        at.continuation = continuation.to_owned();
        at.bar = bar;
    }

    /// Registers the start of a stage. `goes_on` is true if the stage continues after an interruption.
    pub fn enter_stage(&self, stage: String, goes_on: bool) {
        let mut at = self.at();
        at.begun += 1;
        at.stage = Some((stage, goes_on, Instant::now()));
    }

    /// Registers the end of the last stage. From then on, the thread neither prints messages nor ends the process.
    pub fn close(&self) {
        self.at().over = true;
    }

    fn at(&self) -> std::sync::MutexGuard<'_, ProcessPhase> {
        self.at.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Data of the thread that handles stop requests.
struct Watch {
    signalled: Arc<AtomicBool>,
    asked: Arc<AtomicBool>,
    at: Arc<Mutex<ProcessPhase>>,
    /// Time of the limit.
    end: Option<Instant>,
    exit: i32,
}

impl Watch {
    fn run(&self, is_wanted: impl Fn() -> bool) {
        let mut deadline: Option<Instant> = None;
        let mut has_warned = false;
        while is_wanted() {
            thread::sleep(TICK);
            let now = Instant::now();
            let signal = self.signalled.swap(false, Ordering::Relaxed);
            if signal && self.asked.swap(true, Ordering::Relaxed) {
                self.end_now(false);
            }
            if signal {
                deadline = Some(now + GRACE);
                self.report("stopping: waiting up to 2 s for the end of the iteration; press Ctrl-C again to stop at once");
            }
            let late = self.end.is_some_and(|end| now >= end);
            if late && deadline.is_none() {
                deadline = Some(now + GRACE);
            }
            if late && !has_warned && !signal {
                has_warned = true;
                self.report(
                    "--max-wall is reached: waiting up to 2 s for the end of the iteration",
                );
            }
            if deadline.is_some_and(|deadline| now >= deadline) && is_wanted() {
                self.end_now(late);
            }
        }
    }

    fn report(&self, text: &str) {
        let at = self.at.lock().unwrap_or_else(PoisonError::into_inner);
        if at.over {
            return;
        }
        match &at.bar {
            Some(bar) => bar.suspend(|| say(text)),
            None => say(text),
        }
    }

    /// Ends the process, unless the process has finished its last stage.
    fn end_now(&self, late: bool) {
        // A thread that holds the lock `at` is about to report the state of the run and does not compute.
        let at = self.at.lock().unwrap_or_else(PoisonError::into_inner);
        if at.over {
            return;
        }
        if let Some(bar) = &at.bar {
            bar.finish_and_clear();
        }
        if let Some((stage, goes_on, since)) = &at.stage {
            let consequence = match goes_on {
                true => "it continues after the solved points",
                false => "it is computed again",
            };
            say(&format!(
                "stopped within {stage}, {} after it began: {consequence}; earlier results are kept",
                duration(since.elapsed().as_secs_f64())
            ));
            // With the same limit of time, each start would end in its first stage.
            if late && at.begun == 1 && !goes_on {
                say(
                    "this is the first stage of this start: increase --max-wall, or no start can finish the stage",
                );
            }
        }
        match at.continuation.as_str() {
            "" => say("stopped before a run began; repeat the command to begin it"),
            continuation => say(&format!("stopped; continue with: {continuation}")),
        }
        std::process::exit(self.exit)
    }
}
