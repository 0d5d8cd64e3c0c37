//! What a person sees of a run: a bar of cycles in a terminal, one line an iteration elsewhere. All on stderr.

mod pace;
mod prior;
mod rows;
mod stopping;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use fretwear::gauge::Gauge;
use fretwear::recipe::{Check, Recipe};
use fretwear::report::{told, visible};
use fretwear::stages::{Observer, Progress, Stage};
use fretwear::store::{Opening, RealFileSystem, RunReader, StoreError};
use fretwear::tables::typed;
use indicatif::{ProgressBar, ProgressState, ProgressStyle};

use crate::terminal::{is_watched, log_into, note, say};
use pace::{Left, Pace};
use prior::Prior;
pub use rows::Rows;
pub use stopping::{Asked, Stopping, stop_with_parent};

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
    at: Arc<Mutex<At>>,
    end: Arc<Mutex<Option<End>>>,
    /// Whether forced responses are computed between the first iteration and the last.
    responds_between: bool,
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
        let wear = recipe.wear.as_ref();
        let (cycles, volume) = (wear.and_then(|w| w.cycles), wear.and_then(|w| w.volume));
        let (gauge, at) = (Gauge::default(), Arc::new(Mutex::new(At::default())));
        let end = Arc::new(Mutex::new(None));
        if !quiet && !is_watched() {
            beat(gauge.clone(), &at);
        }
        let unknowns = unknowns_of(recipe);
        let bar = (!quiet && is_watched()).then(|| {
            let bar = ProgressBar::new(1000);
            // Three short lines, which are whole on 80 columns.
            let template =
                "{spinner} {wide_msg}\n  [{bar:24}] {elapsed_precise}{left}\n  {prefix}{within}";
            let within = within(gauge.clone(), at.clone());
            let left = left(gauge.clone(), end.clone());
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
            pace: RefCell::new(Pace::new(
                Prior::of(recipe, unknowns),
                recipe.output.curves_every,
                prior::updates(recipe),
            )),
            gauge,
            at,
            end,
            responds_between: !recipe.output.response_at.is_empty(),
            unknowns,
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

    /// Part of the run that is done: of the cycles, or of the volume, whichever is further.
    fn part(&self, progress: &Progress) -> f64 {
        let cycles = self
            .cycles
            .map_or(0.0, |all| progress.cycles as f64 / all as f64);
        let volume = self.volume.map_or(0.0, |all| progress.volume / all);
        cycles.max(volume).min(1.0)
    }

    /// Takes up what earlier starts have recorded of the time they took.
    fn take_up(&self, latest: u64) -> Result<(), StoreError> {
        let reader = RunReader::open(Arc::new(RealFileSystem), &self.root)?;
        let mut iterations = Vec::new();
        for k in reader.iterations().filter(|k| *k <= latest) {
            let summary: typed::Summary = reader.typed(k)?;
            let timing: typed::Timing = reader.typed(k)?;
            let stage_of = |name: &str| {
                let stage = name.split('.').next();
                Stage::ALL.into_iter().find(|s| Some(s.name()) == stage)
            };
            // A stage and its parts have rows of their own.
            let mut stages: BTreeMap<Stage, f64> = BTreeMap::new();
            for (name, seconds) in timing.stage.iter().zip(&timing.seconds) {
                if let Some(stage) = stage_of(name) {
                    *stages.entry(stage).or_default() += seconds;
                }
            }
            let part = self.part(&Progress {
                wear_iteration: k,
                cycles: summary.cycles.unwrap_or(0) as u64,
                volume: summary.wear_volume.unwrap_or(0.0),
                error: 0.0,
            });
            iterations.push((stages.into_iter().collect(), part));
        }
        self.pace.borrow_mut().recorded(&iterations);
        Ok(())
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
            ", {}{of} cycles, worn {}",
            grouped(progress.cycles),
            told(1e9 * progress.volume, progress.error, 0.0, |volume| {
                format!("{} mm³", significant(volume))
            })
        );
        let part = self.part(progress);
        let mut pace = self.pace.borrow_mut();
        let mut end = locked(&self.end);
        *end = None;
        pace.committed(part, progress.cycles, self.gauge.points());
        let mut left_of = String::new();
        if let (Some(left), true) = (pace.left(progress.wear_iteration), part < 1.0) {
            let rate = pace.rate();
            let rate = rate.map_or(String::new(), |rate| {
                format!(", {} cycles/s", grouped(rate as u64))
            });
            left_of = format!("{rate}, {}", told_left(&left, 0));
            *end = Some((left, rate));
        }
        (line, left_of)
    }
}

/// Degrees of freedom of the structure's mesh, if it has one.
fn unknowns_of(recipe: &Recipe) -> Option<usize> {
    let resonator = recipe.structure.as_ref()?.source.resonator()?;
    Some(3 * resonator.mesh().ok()?.mesh.nodes.len())
}

/// Seconds of a whole run by what runs take, with the reduction of its structure: what it says before it has done anything. None where
/// nothing is known.
pub fn expected_seconds(recipe: &Recipe) -> Option<f64> {
    Some(Prior::of(recipe, unknowns_of(recipe))?.whole())
}

/// A stage that takes no time is not told of.
const SHORT: Duration = Duration::from_secs(1);

/// The stage that is computed.
#[derive(Default)]
struct At {
    words: String,
    since: Option<Instant>,
    /// After how long more is said of it, where nobody sees a bar.
    next: Duration,
}

impl At {
    fn begun(words: String) -> Self {
        At {
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
    at: Arc<Mutex<At>>,
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
fn beat(gauge: Gauge, at: &Arc<Mutex<At>>) {
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

/// When the run will be done, and what it does a second in words: nothing before it has worn.
type End = (Left, String);

/// Time to go in words, with as many points of a forced response done.
fn told_left(left: &Left, points: u64) -> String {
    let text = duration(left.now(points));
    match left.rough && !text.starts_with('<') {
        true => format!("about {text} left"),
        false => format!("{text} left"),
    }
}

/// Time to go, counted down between iterations.
fn left(
    gauge: Gauge,
    end: Arc<Mutex<Option<End>>>,
) -> impl Fn(&ProgressState, &mut dyn Write) + Clone + Send + Sync {
    move |_, to| {
        if let Some((left, rate)) = locked(&end).as_ref() {
            let _ = write!(to, ", {}{rate}", told_left(left, gauge.points()));
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
                "continues {root}, of which no iteration is committed yet"
            )),
        }
        if let (false, Some(latest)) = (opening.created, opening.latest) {
            // No result depends on it: what cannot be read is told where it matters.
            let _ = self.take_up(latest);
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
        let mut pace = self.pace.borrow_mut();
        if let Some(left) = pace.enters(stage, self.gauge.points(), self.responds_between) {
            *locked(&self.end) = Some((left, String::new()));
        }
        let at = format!("{stage} of iteration {wear_iteration}");
        if let Some(stopping) = &self.stopping {
            stopping.enters(at.clone(), stage.goes_on());
        }
        note(&at);
        let unknowns = self.unknowns.filter(|_| stage == Stage::Structure);
        let at = unknowns.map_or(at.clone(), |all| {
            format!("{at}, {} unknowns", grouped(all as u64))
        });
        *locked(&self.at) = At::begun(at.clone());
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
