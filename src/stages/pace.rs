//! The pace of a run, measured from its computed iterations.

use super::stage::Stage;
use crate::recipe::Wear;
use crate::store::History;
use crate::tables::{TableError, typed};

/// Number of last wear steps in the average of the pace.
const LATE_STEPS: usize = 3;
/// Part of a run without an estimate of the remaining time. In this part of the run, the steps still lengthen and the
/// vibration still changes.
const FIRST_PART: f64 = 0.2;

/// The pace of a run.
#[derive(Debug, Clone, Default)]
pub struct Pace {
    wear: Option<Wear>,
    /// The unworn state and the wear steps recorded so far.
    iterations: Vec<Iteration>,
    current: Seconds,
}

/// An iteration.
#[derive(Debug, Clone, Copy)]
struct Iteration {
    cycles: u64,
    /// Completed part of the run.
    part: f64,
    seconds: Seconds,
}

/// Seconds of an iteration.
#[derive(Debug, Clone, Copy, Default)]
struct Seconds {
    vibration: f64,
    forced_response: f64,
    others: f64,
}

impl Seconds {
    fn total(&self) -> f64 {
        self.vibration + self.forced_response + self.others
    }
}

impl Pace {
    /// Creates the pace of a run that has computed nothing.
    pub fn new(wear: Option<&Wear>) -> Pace {
        Pace {
            wear: wear.cloned(),
            ..Pace::default()
        }
    }

    /// Reads the pace of a run from its history.
    ///
    /// # Errors
    /// [`TableError`] for a history that lacks a column.
    pub fn of(history: &History, wear: Option<&Wear>) -> Result<Pace, TableError> {
        let mut pace = Pace::new(wear);
        for k in 0..history.len() as u64 {
            let Some(summary) = history.row::<typed::Summary>(k)? else {
                continue;
            };
            for (stage, seconds) in history.seconds(k) {
                pace.spend(&stage, seconds);
            }
            let cycles = summary.cycles.unwrap_or(0) as u64;
            pace.commit(cycles, summary.wear_volume.unwrap_or(0.0));
        }
        Ok(pace)
    }

    /// Adds the seconds of a stage, or of a part of one, to the current iteration.
    pub fn spend(&mut self, stage: &str, seconds: f64) {
        let name = stage.split('.').next();
        let own = match name {
            Some(name) if name == Stage::DynamicResponse.name() => &mut self.current.vibration,
            Some(name) if name == Stage::ForcedResponse.name() => &mut self.current.forced_response,
            _ => &mut self.current.others,
        };
        *own += seconds;
    }

    /// Closes the current iteration at the number `cycles` of cycles and the worn volume `volume` \[m³\]. A continued
    /// run can commit an iteration again, with an unchanged number of cycles. The pace ignores a repeated iteration.
    pub fn commit(&mut self, cycles: u64, volume: f64) {
        let seconds = std::mem::take(&mut self.current);
        if self
            .iterations
            .last()
            .is_some_and(|last| last.cycles == cycles)
        {
            return;
        }
        let part = self
            .wear
            .as_ref()
            .map_or(0.0, |wear| wear.part(cycles, volume));
        self.iterations.push(Iteration {
            cycles,
            part,
            seconds,
        });
    }

    /// Returns the completed part of the run: of the cycles or of the worn volume, whichever is larger.
    pub fn part(&self) -> f64 {
        self.iterations.last().map_or(0.0, |last| last.part)
    }

    /// Returns the last wear steps, at most `LATE_STEPS`, and the iteration before the first of the returned wear
    /// steps.
    fn last_steps(&self) -> Option<(&Iteration, &[Iteration])> {
        let steps = self.iterations.len().checked_sub(1)?;
        let (before, late) = self.iterations[steps.saturating_sub(LATE_STEPS)..].split_first()?;
        (!late.is_empty()).then_some((before, late))
    }

    /// Returns the cycles per second of the last wear steps; `None` before the first step.
    pub fn cycles_per_second(&self) -> Option<f64> {
        let (before, late) = self.last_steps()?;
        let cycles = late.last()?.cycles - before.cycles;
        let seconds: f64 = late.iter().map(|step| step.seconds.total()).sum();
        (cycles > 0 && seconds > 0.0).then(|| cycles as f64 / seconds)
    }

    /// Estimates the remaining time \[s\]. The estimate assumes that wear steps do not become shorter. The remaining
    /// vibrations take at most as long as all vibrations so far. The last forced response takes as long as the first
    /// forced response. Returns `None` before two wear steps and a fifth of the run.
    pub fn seconds_left(&self) -> Option<f64> {
        let (before, late) = self.last_steps()?;
        let [first, .., penultimate, last] = &self.iterations[..] else {
            return None;
        };
        let (done, rest) = (last.part - first.part, 1.0 - last.part);
        let count = late.len() as f64;
        let mean = late.iter().map(|step| step.seconds.others).sum::<f64>() / count;
        let length = ((last.part - before.part) / count).max(last.part - penultimate.part);
        if last.part < FIRST_PART || length <= 0.0 {
            return None;
        }
        let steps = &self.iterations[1..];
        let vibrations: f64 = steps.iter().map(|step| step.seconds.vibration).sum();
        let response = match rest > 0.0 {
            true => first.seconds.forced_response,
            false => 0.0,
        };
        Some(rest / length * mean + (rest / done).min(1.0) * vibrations + response)
    }
}
