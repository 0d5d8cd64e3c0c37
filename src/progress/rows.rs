//! Progress of a campaign: a bar in a terminal, otherwise one line per run.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::terminal::{is_watched, note, say};

/// Interval between redraws of the bar, which keep its clock running.
const TICK: Duration = Duration::from_millis(200);

/// Progress of the rows of a campaign that the running command computes.
#[derive(Clone)]
pub struct Rows {
    bar: Option<ProgressBar>,
    quiet: bool,
}

impl Rows {
    /// Creates the progress of `all` rows, of which `done` are already done.
    pub fn new(all: usize, done: usize, quiet: bool) -> Rows {
        let bar = (!quiet && is_watched()).then(|| {
            let bar = ProgressBar::new(all as u64).with_position(done as u64);
            let template = "{spinner} {wide_msg}\n  [{bar:24}] {pos} of {len} rows, {elapsed_precise}, {eta} left";
            let style = ProgressStyle::with_template(template);
            let style = style.expect("the template is a constant");
            bar.set_style(style.progress_chars("=> "));
            bar.enable_steady_tick(TICK);
            bar.reset_eta();
            bar
        });
        Rows { bar, quiet }
    }

    /// Reports the end of a row.
    pub fn ended(&self, text: &str) {
        match &self.bar {
            Some(bar) => {
                bar.inc(1);
                bar.set_message(text.to_owned());
                note(text);
            }
            None if self.quiet => note(text),
            None => say(text),
        }
    }

    /// Reports a notice about a row.
    pub fn notice(&self, text: &str) {
        match self.quiet {
            true => note(text),
            false => self.say(text),
        }
    }

    /// Reports a message that is not about a row.
    pub fn say(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| say(text)),
            None => say(text),
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
