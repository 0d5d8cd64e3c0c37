//! What a person sees of many runs: a bar in a terminal, a line a run elsewhere.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::terminal::{is_watched, note, say};

/// Redraws of the bar, so that its clock goes on.
const TICK: Duration = Duration::from_millis(200);

/// The rows of a campaign that are run by this command.
#[derive(Clone)]
pub struct Rows {
    bar: Option<ProgressBar>,
    quiet: bool,
}

impl Rows {
    /// So many rows, of which some are done already.
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

    /// A row has come to an end.
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

    /// A row has a notice.
    pub fn notice(&self, text: &str) {
        match self.quiet {
            true => note(text),
            false => self.say(text),
        }
    }

    /// Something else is to be said.
    pub fn say(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| say(text)),
            None => say(text),
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
