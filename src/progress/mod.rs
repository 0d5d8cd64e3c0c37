//! What a person sees of a run: a bar of cycles in a terminal, one line an iteration elsewhere. All on stderr.

mod pace;
mod stopping;

use std::cell::RefCell;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use fretwear::gauge::Gauge;
use fretwear::recipe::{Check, Recipe};
use fretwear::report::visible;
use fretwear::stages::{Observer, Progress, Stage};
use fretwear::store::Opening;
use indicatif::{ProgressBar, ProgressState, ProgressStyle};

use crate::terminal::{is_watched, log_into, note, say};
use pace::Pace;
pub use stopping::Stopping;

/// Redraws of the bar between iterations, so that a long stage is seen to be alive.
const TICK: Duration = Duration::from_millis(200);

/// Watches a run for a person.
pub struct Watcher {
    root: PathBuf,
    quiet: bool,
    bar: Option<ProgressBar>,
    cycles: Option<u64>,
    volume: Option<f64>,
    pace: RefCell<Pace>,
    gauge: Gauge,
    /// When the stage that is computed began.
    since: Arc<Mutex<Instant>>,
    /// When the run will be done, and what it does a second, in words.
    end: Arc<Mutex<Option<(Instant, String)>>>,
    stopping: Option<Stopping>,
    /// What is said of the scene once a run begins.
    checks: Vec<Check>,
}

impl Watcher {
    pub fn new(recipe: &Recipe, root: &Path, quiet: bool) -> Self {
        let wear = recipe.wear.as_ref();
        let (cycles, volume) = (wear.and_then(|w| w.cycles), wear.and_then(|w| w.volume));
        let (gauge, since) = (Gauge::default(), Arc::new(Mutex::new(Instant::now())));
        let end = Arc::new(Mutex::new(None));
        let bar = (!quiet && is_watched()).then(|| {
            let bar = ProgressBar::new(1000);
            // Three short lines, which are whole on 80 columns.
            let template =
                "{spinner} {wide_msg}\n  [{bar:24}] {elapsed_precise}{left}\n  {prefix}{within}";
            let within = within(gauge.clone(), since.clone());
            let left = left(end.clone());
            bar.set_style(
                ProgressStyle::with_template(template)
                    .expect("the template is a constant")
                    .with_key("within", within)
                    .with_key("left", left)
                    .progress_chars("=> "),
            );
            bar.enable_steady_tick(TICK);
            bar
        });
        Watcher {
            root: root.to_owned(),
            quiet,
            bar,
            cycles,
            volume,
            pace: RefCell::default(),
            gauge,
            since,
            end,
            stopping: None,
            checks: Vec::new(),
        }
    }

    /// A run that begins says what an engineer would look at.
    pub fn telling(self, checks: &[Check]) -> Self {
        Watcher {
            checks: checks.to_vec(),
            ..self
        }
    }

    /// The run may be ended by `stopping`, which then says how to go on.
    pub fn stopped_by(self, stopping: &Stopping, continuation: &str) -> Self {
        stopping.opens(continuation, self.bar.clone());
        Watcher {
            stopping: Some(stopping.clone()),
            ..self
        }
    }

    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    fn say(&self, text: &str) {
        match &self.bar {
            _ if self.quiet => note(text),
            Some(bar) => bar.suspend(|| say(text)),
            None => say(text),
        }
    }

    /// Part of the run that is done: of the cycles, or of the volume, whichever is further.
    fn part(&self, progress: &Progress) -> f64 {
        let cycles = self
            .cycles
            .map_or(0.0, |all| progress.cycles as f64 / all as f64);
        let volume = self.volume.map_or(0.0, |all| progress.volume / all);
        cycles.max(volume).min(1.0)
    }

    /// Where the run is, and how long it will take: in one line, or beside the bar.
    fn line(&self, progress: &Progress) -> (String, String) {
        let mut line = format!("iteration {}", progress.wear_iteration);
        if self.cycles.is_none() && self.volume.is_none() {
            return (line, String::new());
        }
        let of = self
            .cycles
            .map_or(String::new(), |all| format!(" of {}", grouped(all)));
        line += &format!(
            ", {}{of} cycles, worn {} mm³",
            grouped(progress.cycles),
            significant(progress.volume * 1e9)
        );
        if progress.error > 0.0 {
            line += &format!(" ±{:.2} %", progress.error * 100.0);
        }
        let part = self.part(progress);
        let mut pace = self.pace.borrow_mut();
        pace.committed(part, progress.cycles);
        let mut end = self.end.lock().unwrap_or_else(PoisonError::into_inner);
        *end = None;
        let mut left_of = String::new();
        if let (Some((cycles, left)), true) = (pace.left(), part < 1.0) {
            let pace = format!(", {} cycles/s", grouped(cycles as u64));
            left_of = format!("{pace}, {} left", duration(left));
            let left = Duration::try_from_secs_f64(left).ok();
            *end = left.map(|left| (Instant::now() + left, pace));
        }
        (line, left_of)
    }
}

/// A stage that takes no time is not told of.
const SHORT: Duration = Duration::from_secs(1);

/// How far a stage is: what its solvers have done, and its seconds.
fn within(
    gauge: Gauge,
    since: Arc<Mutex<Instant>>,
) -> impl Fn(&ProgressState, &mut dyn Write) + Clone + Send + Sync {
    move |_, to| {
        let elapsed = since
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .elapsed();
        let words = gauge.words();
        let comma = if words.is_empty() { "" } else { ", " };
        if elapsed >= SHORT {
            let seconds = duration(elapsed.as_secs_f64());
            let _ = write!(to, ": {words}{comma}{seconds}");
        }
    }
}

/// Time to go, counted down between iterations; nothing once it is over, since it was too short then.
fn left(
    end: Arc<Mutex<Option<(Instant, String)>>>,
) -> impl Fn(&ProgressState, &mut dyn Write) + Clone + Send + Sync {
    move |_, to| {
        let end = end.lock().unwrap_or_else(PoisonError::into_inner);
        let Some((end, pace)) = end.as_ref() else {
            return;
        };
        let left = end.saturating_duration_since(Instant::now());
        if !left.is_zero() {
            let _ = write!(to, ", {} left{pace}", duration(left.as_secs_f64()));
        }
    }
}

impl Observer for Watcher {
    fn opened(&self, opening: &Opening) {
        log_into(&self.root);
        for notice in opening.notices() {
            self.say(&format!("note: {notice}"));
        }
        let root = self.root.display();
        match (opening.created, opening.latest) {
            (true, None) => self.say(&format!("begins {root}")),
            (true, Some(latest)) => self.say(&format!("begins {root} from iteration {latest}")),
            (false, Some(latest)) => {
                self.say(&format!("continues {root} after iteration {latest}"))
            }
            (false, None) => self.say(&format!(
                "continues {root}, of which no iteration is committed yet"
            )),
        }
        if opening.created {
            for line in lines_of(&self.checks) {
                self.say(&line);
            }
        }
        if !opening.drafts_kept.is_empty() {
            self.say(&format!(
                "uses again what was computed of the next iteration: {}",
                opening.drafts_kept.join(", ")
            ));
        }
    }

    fn notice(&self, text: &str) {
        self.say(&format!("note: {text}"));
    }

    fn stage(&self, stage: Stage, wear_iteration: u64) {
        self.pace.borrow_mut().enters(stage);
        let at = format!("{stage} of iteration {wear_iteration}");
        if let Some(stopping) = &self.stopping {
            stopping.enters(at.clone());
        }
        note(&at);
        *self.since.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
        if let Some(bar) = &self.bar {
            bar.set_prefix(at);
        }
    }

    fn gauge(&self) -> Gauge {
        self.gauge.clone()
    }

    fn committed(&self, progress: &Progress) {
        let (line, left) = self.line(progress);
        if let Some(bar) = &self.bar {
            bar.set_position((1000.0 * self.part(progress)) as u64);
            bar.set_message(visible(&line));
            note(&(line + &left));
        } else {
            self.say(&(line + &left));
        }
    }
}

/// The figures that an engineer would look at, a line each, and then what is to be remarked of them.
pub fn lines_of(checks: &[Check]) -> Vec<String> {
    let mut lines = Vec::new();
    if !checks.is_empty() {
        lines.push("to look at, by rules of thumb".to_owned());
    }
    lines.extend(checks.iter().map(|check| {
        let mark = if check.warning.is_some() {
            "  <- see the warning"
        } else {
            ""
        };
        format!("    {}: {}{mark}", check.what, check.value)
    }));
    let remarks = checks.iter().filter_map(|check| check.remark.as_ref());
    lines.extend(remarks.map(|remark| format!("note: {remark}")));
    lines
}

/// 10000000 as 10 000 000.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// Four significant digits.
pub fn significant(value: f64) -> String {
    match value {
        0.0 => "0".to_owned(),
        v if (0.01..1000.0).contains(&v) => {
            format!("{v:.*}", (3 - v.log10().floor() as i32) as usize)
        }
        v => format!("{v:.3e}"),
    }
}

pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => "< 1 s".to_owned(),
        s if s < 100.0 => format!("{s:.0} s"),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}
