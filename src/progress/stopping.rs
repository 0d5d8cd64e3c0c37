//! Ctrl-C, SIGTERM and `--max-wall`.
//!
//! The iteration that is being computed is ended if that takes no longer than a person waits. Else the process ends within its stage,
//! as it may at any instant: nothing exists until it is committed.

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

/// How often a signal is looked for.
const TICK: Duration = Duration::from_millis(50);
/// What an iteration that is being computed has left once a stop is asked for.
const GRACE: Duration = Duration::from_millis(1500);

/// What a process is at, for who ends it.
#[derive(Default)]
pub struct ProcessPhase {
    /// Stage and iteration in words, and since when; none between runs.
    /// With whether it goes on from where it is interrupted.
    stage: Option<(String, bool, Instant)>,
    /// Stages that this start has begun, over all runs.
    begun: u64,
    /// How to go on.
    continuation: String,
    bar: Option<ProgressBar>,
    /// The last stage is over: what is left to do is to say how it ended.
    over: bool,
}

/// Signals to a command that computes nothing itself, and hands them on to those that do.
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

    /// Listens to the first signal; a second ends the process with `exit`.
    ///
    /// # Errors
    /// Those of the operating system.
    pub fn listen_once(exit: i32) -> io::Result<ForwardedSignals> {
        let signalled = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // In this order: the first signal finds the flag down.
            flag::register_conditional_shutdown(signal, exit, signalled.clone())?;
            flag::register(signal, signalled.clone())?;
        }
        Ok(ForwardedSignals(signalled))
    }

    /// True once a signal has come.
    pub fn is_asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// True if a signal has come since this was asked last.
    pub fn taken(&self) -> bool {
        self.0.swap(false, Ordering::Relaxed)
    }
}

/// Asks this process to stop when the process that started it ends.
pub fn stop_with_parent() {
    #[cfg(target_os = "linux")]
    {
        let signal = rustix::process::Signal::TERM;
        // Without it, the process computes to its end and nobody waits for it.
        let _ = rustix::process::set_parent_process_death_signal(Some(signal));
    }
}

/// Ends a command that is asked to stop. Dropped, it ends nothing any more.
#[derive(Clone)]
pub struct Stopping {
    asked: Arc<AtomicBool>,
    begin: Instant,
    limit: Option<Duration>,
    at: Arc<Mutex<ProcessPhase>>,
    /// The thread looks on as long as somebody has it.
    alive: Arc<()>,
}

impl Stopping {
    /// Listens to signals, and to a limit of time \[s\]; where an iteration takes too long, the process ends with `exit`.
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

    /// True once a signal has come.
    pub fn is_asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }

    /// True once the limit of time is over.
    pub fn is_late(&self) -> bool {
        self.limit
            .is_some_and(|limit| self.begin.elapsed() >= limit)
    }

    /// A run begins: its bar, and how it is continued.
    pub fn opens(&self, continuation: &str, bar: Option<ProgressBar>) {
        let mut at = self.at();
        at.stage = None;
        at.continuation = continuation.to_owned();
        at.bar = bar;
    }

    /// A stage begins, which may go on from where it is interrupted.
    pub fn enters(&self, stage: String, goes_on: bool) {
        let mut at = self.at();
        at.begun += 1;
        at.stage = Some((stage, goes_on, Instant::now()));
    }

    /// The last stage is over: from here on, nothing is said or ended from aside.
    pub fn closes(&self) {
        self.at().over = true;
    }

    fn at(&self) -> std::sync::MutexGuard<'_, ProcessPhase> {
        self.at.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What the thread looks at.
struct Watch {
    signalled: Arc<AtomicBool>,
    asked: Arc<AtomicBool>,
    at: Arc<Mutex<ProcessPhase>>,
    /// When the limit of time is over.
    end: Option<Instant>,
    exit: i32,
}

impl Watch {
    fn run(&self, is_wanted: impl Fn() -> bool) {
        let mut hard: Option<Instant> = None;
        let mut told = false;
        while is_wanted() {
            thread::sleep(TICK);
            let now = Instant::now();
            let signal = self.signalled.swap(false, Ordering::Relaxed);
            if signal && self.asked.swap(true, Ordering::Relaxed) {
                self.end_now(false);
            }
            if signal {
                hard = Some(now + GRACE);
                self.tell("stopping: the iteration is ended if it takes less than 2 s; Ctrl-C again ends at once");
            }
            let late = self.end.is_some_and(|end| now >= end);
            if late && hard.is_none() {
                hard = Some(now + GRACE);
            }
            if late && !told && !signal {
                told = true;
                self.tell("--max-wall is over: the iteration is ended if it takes less than 2 s");
            }
            if hard.is_some_and(|hard| now >= hard) && is_wanted() {
                self.end_now(late);
            }
        }
    }

    fn tell(&self, text: &str) {
        let at = self.at.lock().unwrap_or_else(PoisonError::into_inner);
        if at.over {
            return;
        }
        match &at.bar {
            Some(bar) => bar.suspend(|| say(text)),
            None => say(text),
        }
    }

    /// Ends the process, unless its last stage is over.
    fn end_now(&self, late: bool) {
        // Whoever holds it is about to say where the run is, and not to compute.
        let at = self.at.lock().unwrap_or_else(PoisonError::into_inner);
        if at.over {
            return;
        }
        if let Some(bar) = &at.bar {
            bar.finish_and_clear();
        }
        if let Some((stage, goes_on, since)) = &at.stage {
            let again = match goes_on {
                true => "it continues after the solved points",
                false => "it is computed again",
            };
            say(&format!(
                "stopped within {stage}, {} after it began: {again}; what comes before it is kept",
                duration(since.elapsed().as_secs_f64())
            ));
            // One start after another would get nowhere.
            if late && at.begun == 1 && !goes_on {
                say(
                    "it is the first stage of this start: give --max-wall more time, or no start gets past it",
                );
            }
        }
        match at.continuation.as_str() {
            "" => say("stopped before a run began; the same command begins it"),
            continuation => say(&format!("stopped; continue with: {continuation}")),
        }
        std::process::exit(self.exit)
    }
}
