//! What a person sees of a run: a bar of cycles in a terminal, one line an iteration elsewhere. All on stderr.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use fretwear::recipe::Recipe;
use fretwear::report::visible;
use fretwear::stages::{Observer, Progress, Stage};
use fretwear::store::Opening;
use indicatif::{ProgressBar, ProgressStyle};

use crate::terminal::{is_watched, say};

/// Redraws of the bar between iterations, so that a long stage is seen to be alive.
const TICK: Duration = Duration::from_millis(200);

/// Watches a run for a person.
pub struct Watcher {
    root: PathBuf,
    quiet: bool,
    bar: Option<ProgressBar>,
    cycles: Option<u64>,
    volume: Option<f64>,
    /// The last iterations: when each was committed, and what was behind it.
    recent: RefCell<VecDeque<Mark>>,
}

/// Where a run was at a time.
#[derive(Debug, Clone, Copy)]
struct Mark {
    time: Instant,
    part: f64,
    cycles: u64,
}

/// Iterations whose pace is that of late.
const OF_LATE: usize = 3;

impl Watcher {
    pub fn new(recipe: &Recipe, root: &Path, quiet: bool) -> Self {
        let wear = recipe.wear.as_ref();
        let (cycles, volume) = (wear.and_then(|w| w.cycles), wear.and_then(|w| w.volume));
        let bar = (!quiet && is_watched()).then(|| {
            let bar = ProgressBar::new(1000);
            // What is cut where the terminal is narrow is the end of a line, never the stage.
            let template = "{spinner} {wide_msg}\n  [{elapsed_precise}] [{bar:32}] {prefix}";
            bar.set_style(
                ProgressStyle::with_template(template)
                    .expect("the template is a constant")
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
            recent: RefCell::default(),
        }
    }

    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    fn say(&self, text: &str) {
        match &self.bar {
            _ if self.quiet => (),
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

    fn line(&self, progress: &Progress) -> String {
        let mut line = format!("iteration {}", progress.wear_iteration);
        if self.cycles.is_none() && self.volume.is_none() {
            return line;
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
        let now = Mark {
            time: Instant::now(),
            part: self.part(progress),
            cycles: progress.cycles,
        };
        let mut recent = self.recent.borrow_mut();
        recent.push_back(now);
        if recent.len() > OF_LATE + 1 {
            recent.pop_front();
        }
        let first = recent[0];
        if first.part < now.part && now.part < 1.0 {
            let seconds = (now.time - first.time).as_secs_f64();
            let left = seconds * (1.0 - now.part) / (now.part - first.part);
            let rate = (now.cycles - first.cycles) as f64 / seconds;
            line += &format!(
                ", {} cycles/s, {} left",
                grouped(rate as u64),
                duration(left)
            );
        }
        line
    }
}

impl Observer for Watcher {
    fn opened(&self, opening: &Opening) {
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
        if let Some(bar) = &self.bar {
            bar.set_prefix(format!("{stage} of iteration {wear_iteration}"));
        }
    }

    fn committed(&self, progress: &Progress) {
        let line = self.line(progress);
        if let Some(bar) = &self.bar {
            bar.set_position((1000.0 * self.part(progress)) as u64);
            bar.set_message(visible(&line));
        } else if !self.quiet {
            say(&line);
        }
    }
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
