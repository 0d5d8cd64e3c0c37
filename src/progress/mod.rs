//! What a person sees of a run: a bar of cycles in a terminal, one line an iteration elsewhere. All on stderr.

mod rows;
mod stopping;

use std::cell::{Cell, RefCell};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use fretwear::gauge::Gauge;
use fretwear::recipe::{Check, Recipe, Wear};
use fretwear::report::quantity::VOLUME;
use fretwear::report::{figure_with_bar, visible};
use fretwear::stages::{Observer, Pace, Progress, Stage};
use fretwear::store::{Opening, RealFileSystem, RunReader};
use indicatif::{ProgressBar, ProgressState, ProgressStyle};

use crate::terminal::{is_watched, log_into, note, say};
pub use rows::Rows;
pub use stopping::{ForwardedSignals, Stopping, stop_with_parent};

/// Redraws of the bar between iterations, so that a long stage is seen to be alive.
const TICK: Duration = Duration::from_millis(200);

/// Watches a run for a person.
pub struct Watcher {
    root: PathBuf,
    quiet: bool,
    bar: Option<ProgressBar>,
    wear: Option<Wear>,
    pace: RefCell<Pace>,
    /// The stage that is computed, and since when.
    stage: Cell<Option<(Stage, Instant)>>,
    gauge: Gauge,
    at: Arc<Mutex<StageInProgress>>,
    end: Arc<Mutex<Option<End>>>,
    /// Degrees of freedom of the structure's mesh.
    unknowns: Option<usize>,
    stopping: Option<Stopping>,
    /// The index of the row that the run is, and the rows.
    row: Option<(usize, Rows)>,
    /// What is said of the scene once a run begins.
    checks: Vec<Check>,
    notices: RefCell<Vec<String>>,
}

impl Watcher {
    pub fn new(recipe: &Recipe, root: &Path, quiet: bool) -> Self {
        let (gauge, at) = (
            Gauge::default(),
            Arc::new(Mutex::new(StageInProgress::default())),
        );
        let end = Arc::new(Mutex::new(None));
        if !quiet && !is_watched() {
            beat(gauge.clone(), &at);
        }
        let bar = (!quiet && is_watched()).then(|| {
            let bar = ProgressBar::new(1000);
            // Three short lines, which are whole on 80 columns.
            let template =
                "{spinner} {wide_msg}\n  [{bar:24}] {elapsed_precise}{left}\n  {prefix}{within}";
            let within = within(gauge.clone(), at.clone());
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
            wear: recipe.wear.clone(),
            pace: RefCell::new(Pace::new(recipe.wear.as_ref())),
            stage: Cell::default(),
            gauge,
            at,
            end,
            unknowns: unknowns_of(recipe),
            stopping: None,
            row: None,
            checks: Vec::new(),
            notices: RefCell::default(),
        }
    }

    /// What has been said of the results so far.
    pub fn notices(&self) -> Vec<String> {
        self.notices.borrow().clone()
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

    /// The run is a row of a campaign, which shows the notices of its start.
    pub fn of_row(self, index: usize, rows: &Rows) -> Self {
        Watcher {
            row: Some((index, rows.clone())),
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

    /// Takes the pace of earlier starts from the history of the run.
    fn take_up(&self) {
        let reader = RunReader::open(Arc::new(RealFileSystem), &self.root);
        let history = reader.and_then(|reader| reader.history()).ok();
        let pace = history.and_then(|history| Pace::of(&history, self.wear.as_ref()).ok());
        // No result depends on it: a damage is reported where it matters.
        if let Some(pace) = pace {
            self.pace.replace(pace);
        }
    }

    /// Ends the stage that is computed.
    fn leave(&self) {
        if let Some((stage, since)) = self.stage.take() {
            let seconds = since.elapsed().as_secs_f64();
            self.pace.borrow_mut().spend(stage.name(), seconds);
        }
    }

    /// Where the run is, and how long it will take: in one line, or beside the bar.
    fn line(&self, progress: &Progress) -> (String, String) {
        let mut line = format!("iteration {}", progress.wear_iteration);
        let Some(wear) = &self.wear else {
            return (line, String::new());
        };
        let of = wear
            .cycles
            .map_or(String::new(), |all| format!(" of {}", grouped(all)));
        line += &format!(
            ", {}{of} cycles, worn {}",
            grouped(progress.cycles),
            figure_with_bar(progress.volume, progress.error, 0.0, |volume| {
                format!("{} mm³", VOLUME[0].rounded(volume, 4))
            })
        );
        let pace = self.pace.borrow();
        let mut left_of = String::new();
        if let Some(rate) = pace.cycles_per_second() {
            left_of = format!(", {} cycles/s", grouped(rate as u64));
        }
        let seconds = pace.seconds_left().filter(|_| pace.part() < 1.0);
        *locked(&self.end) = seconds.map(|seconds| (Instant::now(), seconds));
        if let Some(seconds) = seconds {
            left_of += &format!(", about {} left", duration(seconds));
        }
        (line, left_of)
    }
}

/// Degrees of freedom of the structure's mesh, if it has one.
fn unknowns_of(recipe: &Recipe) -> Option<usize> {
    let resonator = recipe.structure.as_ref()?.source.resonator()?;
    Some(3 * resonator.mesh().ok()?.mesh.nodes.len())
}

/// A stage that takes no time is not told of.
const SHORT: Duration = Duration::from_secs(1);

/// The stage that is computed.
#[derive(Default)]
struct StageInProgress {
    words: String,
    since: Option<Instant>,
    /// After how long more is said of it, where nobody sees a bar.
    next: Duration,
}

impl StageInProgress {
    fn begun(words: String) -> Self {
        StageInProgress {
            words,
            since: Some(Instant::now()),
            next: FIRST_BEAT,
        }
    }

    fn elapsed(&self) -> Duration {
        self.since.map_or(Duration::ZERO, |since| since.elapsed())
    }
}

fn locked<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// How far a stage is: what its solvers have done, and its seconds.
fn how_far(gauge: &Gauge, elapsed: Duration) -> String {
    let words = gauge.words();
    let comma = if words.is_empty() { "" } else { ", " };
    format!(": {words}{comma}{}", duration(elapsed.as_secs_f64()))
}

fn within(
    gauge: Gauge,
    at: Arc<Mutex<StageInProgress>>,
) -> impl Fn(&ProgressState, &mut dyn Write) + Clone + Send + Sync {
    move |_, to| {
        let elapsed = locked(&at).elapsed();
        if elapsed >= SHORT {
            let _ = write!(to, "{}", how_far(&gauge, elapsed));
        }
    }
}

/// A stage that takes so long says how far it is where there is no bar, and again after twice the time.
const FIRST_BEAT: Duration = Duration::from_secs(4);

/// Says so as long as somebody has `at`.
fn beat(gauge: Gauge, at: &Arc<Mutex<StageInProgress>>) {
    let at = Arc::downgrade(at);
    thread::spawn(move || {
        while let Some(at) = at.upgrade() {
            let mut now = locked(&at);
            let elapsed = now.elapsed();
            if elapsed >= FIRST_BEAT && elapsed >= now.next {
                now.next = 2 * elapsed;
                say(&format!("{}{}", now.words, how_far(&gauge, elapsed)));
            }
            drop(now);
            drop(at);
            thread::sleep(TICK);
        }
    });
}

/// An estimate of the remaining time, and when it was made.
type End = (Instant, f64);

/// The remaining time, counted down between iterations. Nothing is shown once it is over.
fn left(
    end: Arc<Mutex<Option<End>>>,
) -> impl Fn(&ProgressState, &mut dyn Write) + Clone + Send + Sync {
    move |_, to| {
        if let Some((since, seconds)) = *locked(&end) {
            let seconds = seconds - since.elapsed().as_secs_f64();
            if seconds > 0.0 {
                let _ = write!(to, ", about {} left", duration(seconds));
            }
        }
    }
}

impl Observer for Watcher {
    fn opened(&self, opening: &Opening) {
        log_into(&self.root);
        for notice in opening.notices() {
            match &self.row {
                Some((index, rows)) => rows.notice(&format!("row {index}: note: {notice}")),
                None => self.say(&format!("note: {notice}")),
            }
        }
        let root = self.root.display();
        match (opening.created, opening.latest) {
            (true, None) => self.say(&format!("begins {root}")),
            (true, Some(latest)) => self.say(&format!("begins {root} from iteration {latest}")),
            (false, Some(latest)) => {
                self.say(&format!("continues {root} after iteration {latest}"))
            }
            (false, None) => self.say(&format!(
                "continues {root}, which has no committed iteration yet"
            )),
        }
        if !opening.created && opening.latest.is_some() {
            self.take_up();
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
        self.notices.borrow_mut().push(text.to_owned());
        self.say(&format!("note: {text}"));
    }

    fn stage(&self, stage: Stage, wear_iteration: u64) {
        self.leave();
        self.stage.set(Some((stage, Instant::now())));
        let at = format!("{stage} of iteration {wear_iteration}");
        if let Some(stopping) = &self.stopping {
            stopping.enters(at.clone(), stage.keeps_solves());
        }
        note(&at);
        let unknowns = self.unknowns.filter(|_| stage == Stage::Structure);
        let at = unknowns.map_or(at.clone(), |all| {
            format!("{at}, {} unknowns", grouped(all as u64))
        });
        *locked(&self.at) = StageInProgress::begun(at.clone());
        if let Some(bar) = &self.bar {
            bar.set_prefix(at);
        }
    }

    fn gauge(&self) -> Gauge {
        self.gauge.clone()
    }

    fn committed(&self, progress: &Progress) {
        self.leave();
        let mut pace = self.pace.borrow_mut();
        pace.commit(progress.cycles, progress.volume);
        let part = pace.part();
        drop(pace);
        let (line, left) = self.line(progress);
        if let Some(bar) = &self.bar {
            bar.set_position((1000.0 * part) as u64);
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

pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => "< 1 s".to_owned(),
        s if s < 100.0 => format!("{s:.0} s"),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}
