//! Progress of a run on stderr: a bar in a terminal, otherwise one line per iteration.

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
use fretwear::report::{escape_controls, figure_with_bar};
use fretwear::stages::{Observer, Pace, Progress, Stage};
use fretwear::store::{Opening, RealFileSystem, RunReader};
use indicatif::{ProgressBar, ProgressState, ProgressStyle};

use crate::terminal::{is_watched, log_into, note, say};
pub use rows::Rows;
pub use stopping::{ForwardedSignals, Stopping, stop_with_parent};

/// Interval between redraws of the progress bar. The redraws show that a long stage is running.
const TICK: Duration = Duration::from_millis(200);

/// Observer that reports a run to the user.
pub struct Watcher {
    root: PathBuf,
    quiet: bool,
    bar: Option<ProgressBar>,
    wear: Option<Wear>,
    pace: RefCell<Pace>,
    /// The running stage, and the time at which the stage started.
    stage: Cell<Option<(Stage, Instant)>>,
    gauge: Gauge,
    at: Arc<Mutex<StageInProgress>>,
    end: Arc<Mutex<Option<End>>>,
    /// Degrees of freedom of the finite element mesh of the structure.
    unknowns: Option<usize>,
    stopping: Option<Stopping>,
    /// Index of the run in a campaign, and the rows of the campaign.
    row: Option<(usize, Rows)>,
    /// Checks of the scene, printed when a run begins.
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
            report_regularly(gauge.clone(), &at);
        }
        let bar = (!quiet && is_watched()).then(|| {
            let bar = ProgressBar::new(1000);
            // Three short lines, which fit into 80 columns.
            let template =
                "{spinner} {wide_msg}\n  [{bar:24}] {elapsed_precise}{left}\n  {prefix}{within}";
            let within = stage_progress(gauge.clone(), at.clone());
            let remaining = remaining_time(end.clone());
            bar.set_style(
                ProgressStyle::with_template(template)
                    .expect("the template is a constant")
                    .with_key("within", within)
                    .with_key("left", remaining)
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

    /// Returns the notices about the results so far.
    pub fn notices(&self) -> Vec<String> {
        self.notices.borrow().clone()
    }

    /// Sets the checks that are printed when a run begins.
    pub fn with_checks(self, checks: &[Check]) -> Self {
        Watcher {
            checks: checks.to_vec(),
            ..self
        }
    }

    /// Lets `stopping` end the run. `stopping` then prints the command `continuation`, which continues the run.
    pub fn with_stopping(self, stopping: &Stopping, continuation: &str) -> Self {
        stopping.open_run(continuation, self.bar.clone());
        Watcher {
            stopping: Some(stopping.clone()),
            ..self
        }
    }

    /// Marks the run as a row of a campaign. The campaign prints the notices at its start.
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

    /// Loads the pace of earlier starts from the history of the run.
    fn load_pace(&self) {
        let reader = RunReader::open(Arc::new(RealFileSystem), &self.root);
        let history = reader.and_then(|reader| reader.history()).ok();
        let pace = history.and_then(|history| Pace::of(&history, self.wear.as_ref()).ok());
        // The pace affects no result, so `load_pace` ignores damaged files. Functions whose results need a damaged file
        // report the damage.
        if let Some(pace) = pace {
            self.pace.replace(pace);
        }
    }

    /// Ends the running stage and records its time.
    fn end_stage(&self) {
        if let Some((stage, since)) = self.stage.take() {
            let seconds = since.elapsed().as_secs_f64();
            self.pace.borrow_mut().spend(stage.name(), seconds);
        }
    }

    /// Returns the position of the run, and its rate and remaining time. The watcher prints both texts in one line, or
    /// the position of the run next to the bar.
    fn line(&self, progress: &Progress) -> (String, String) {
        let mut line = format!("iteration {}", progress.wear_iteration);
        let Some(wear) = &self.wear else {
            return (line, String::new());
        };
        let goal = wear
            .cycles
            .map_or(String::new(), |all| format!(" of {}", grouped(all)));
        line += &format!(
            ", {}{goal} cycles, worn {}",
            grouped(progress.cycles),
            figure_with_bar(progress.volume, progress.error, 0.0, |volume| {
                format!("{} mm³", VOLUME[0].rounded(volume, 4))
            })
        );
        let pace = self.pace.borrow();
        let mut rate = String::new();
        if let Some(cycles_per_second) = pace.cycles_per_second() {
            rate = format!(", {} cycles/s", grouped(cycles_per_second as u64));
        }
        let seconds = pace.seconds_left().filter(|_| pace.part() < 1.0);
        *locked(&self.end) = seconds.map(|seconds| (Instant::now(), seconds));
        if let Some(seconds) = seconds {
            rate += &format!(", about {} left", duration(seconds));
        }
        (line, rate)
    }
}

/// Returns the degrees of freedom of the finite element mesh of the structure, if it has one.
fn unknowns_of(recipe: &Recipe) -> Option<usize> {
    let resonator = recipe.structure.as_ref()?.source.resonator()?;
    Some(3 * resonator.mesh().ok()?.mesh.nodes.len())
}

/// Time from the start of a stage before which the progress bar shows no progress of the stage.
const SHORT: Duration = Duration::from_secs(1);

/// The running stage.
#[derive(Default)]
struct StageInProgress {
    words: String,
    since: Option<Instant>,
    /// Elapsed time at which the next line is printed if there is no bar.
    next: Duration,
}

impl StageInProgress {
    fn start(words: String) -> Self {
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

/// Describes the progress of a stage: the work of its solvers, and its time.
fn progress_text(gauge: &Gauge, elapsed: Duration) -> String {
    let words = gauge.describe();
    let comma = if words.is_empty() { "" } else { ", " };
    format!(": {words}{comma}{}", duration(elapsed.as_secs_f64()))
}

fn stage_progress(
    gauge: Gauge,
    at: Arc<Mutex<StageInProgress>>,
) -> impl Fn(&ProgressState, &mut dyn Write) + Clone + Send + Sync {
    move |_, to| {
        let elapsed = locked(&at).elapsed();
        if elapsed >= SHORT {
            let _ = write!(to, "{}", progress_text(&gauge, elapsed));
        }
    }
}

/// Without a progress bar, a stage first reports its progress after the time `FIRST_BEAT`. Each further report of the
/// stage follows when the time since the start of the stage has doubled.
const FIRST_BEAT: Duration = Duration::from_secs(4);

/// Reports the progress of a stage as long as `at` is in use.
fn report_regularly(gauge: Gauge, at: &Arc<Mutex<StageInProgress>>) {
    let at = Arc::downgrade(at);
    thread::spawn(move || {
        while let Some(at) = at.upgrade() {
            let mut now = locked(&at);
            let elapsed = now.elapsed();
            if elapsed >= FIRST_BEAT && elapsed >= now.next {
                now.next = 2 * elapsed;
                say(&format!("{}{}", now.words, progress_text(&gauge, elapsed)));
            }
            drop(now);
            drop(at);
            thread::sleep(TICK);
        }
    });
}

/// Estimate of the remaining time \[s\], and the time of the estimate.
type End = (Instant, f64);

/// Shows the remaining time, counted down between iterations. The display is empty after the remaining time has passed.
fn remaining_time(
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
            self.load_pace();
        }
        if opening.created {
            for line in lines_of(&self.checks) {
                self.say(&line);
            }
        }
        if !opening.drafts_kept.is_empty() {
            self.say(&format!(
                "reuses completed stages of the next iteration: {}",
                opening.drafts_kept.join(", ")
            ));
        }
    }

    fn notice(&self, text: &str) {
        self.notices.borrow_mut().push(text.to_owned());
        self.say(&format!("note: {text}"));
    }

    fn stage(&self, stage: Stage, wear_iteration: u64) {
        self.end_stage();
        self.stage.set(Some((stage, Instant::now())));
        let at = format!("{stage} of iteration {wear_iteration}");
        if let Some(stopping) = &self.stopping {
            stopping.enter_stage(at.clone(), stage.keeps_solves());
        }
        note(&at);
        let unknowns = self.unknowns.filter(|_| stage == Stage::Structure);
        let at = unknowns.map_or(at.clone(), |all| {
            format!("{at}, {} unknowns", grouped(all as u64))
        });
        *locked(&self.at) = StageInProgress::start(at.clone());
        if let Some(bar) = &self.bar {
            bar.set_prefix(at);
        }
    }

    fn gauge(&self) -> Gauge {
        self.gauge.clone()
    }

    fn committed(&self, progress: &Progress) {
        self.end_stage();
        let mut pace = self.pace.borrow_mut();
        pace.commit(progress.cycles, progress.volume);
        let part = pace.part();
        drop(pace);
        let (line, left) = self.line(progress);
        if let Some(bar) = &self.bar {
            bar.set_position((1000.0 * part) as u64);
            bar.set_message(escape_controls(&line));
            note(&(line + &left));
        } else {
            self.say(&(line + &left));
        }
    }
}

/// Returns one line for each check, and then the remarks.
pub fn lines_of(checks: &[Check]) -> Vec<String> {
    let mut lines = Vec::new();
    if !checks.is_empty() {
        lines.push("plausibility checks, by rules of thumb".to_owned());
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

/// Formats 10000000 as `10 000 000`.
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

/// Formats a duration \[s\] with a suitable unit.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => "< 1 s".to_owned(),
        s if s < 100.0 => format!("{s:.0} s"),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}
