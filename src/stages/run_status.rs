//! The progress of a run, read from its committed and drafted iterations. The process that computes the run and an
//! observer get the same result.

use super::RunError;
use super::pace::Pace;
use super::run::has_lost_before;
use super::runner::stages_in;
use super::stage::Stage;
use crate::recipe::Recipe;
use crate::store::{RunReader, StoreError};
use crate::tables::typed;

/// The last update of the contact elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LastUpdate {
    /// Iteration of the update.
    pub wear_iteration: u64,
    /// Number of cycles from the unworn joint to the iteration. `None` if the history lacks the row of the iteration.
    pub cycles: Option<u64>,
    /// Number of updates so far, without the first elements.
    pub updates: u64,
}

/// Progress of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunStatus {
    /// The last committed iteration; `None` before the first commit.
    pub wear_iteration: Option<u64>,
    /// True if the scene is complete.
    pub done: bool,
    /// True if `wear.until.preload` ended the run.
    pub has_lost_preload: bool,
    /// The next stage, or the stage that is running. While the run commits an iteration, `stage` is the last stage.
    /// After the run is done, `stage` is `None`.
    pub stage: Option<Stage>,
    /// Finished stages of the next iteration.
    pub draft: Vec<Stage>,
    /// Cycles up to the last iteration; `None` without wear.
    pub cycles: Option<u64>,
    /// Number of cycles that ends the run.
    pub cycles_goal: Option<u64>,
    /// Worn volume that ends the run \[m³\].
    pub volume_goal: Option<f64>,
    /// Completed part of the cycles or of the volume, whichever is larger.
    pub part: f64,
    /// The last update of the contact elements; `None` in a run without them.
    pub last_update: Option<LastUpdate>,
    /// Cycles per second of computing time, over the last steps.
    pub cycles_per_second: Option<f64>,
    /// Remaining seconds of computing time; `None` before a fifth of the run is done.
    pub seconds_left: Option<f64>,
}

impl RunStatus {
    /// Reads the status of the run of a recipe.
    ///
    /// # Errors
    /// Errors of reading the run.
    pub fn of(reader: &RunReader, recipe: &Recipe) -> Result<RunStatus, RunError> {
        let latest = reader.latest();
        let next = latest.map_or(0, |k| k + 1);
        let drafted = reader.drafted_stages(next)?;
        let next_stages: Vec<Stage> = stages_in(recipe, next).map(|s| s.stage).collect();
        let is_drafted = |stage: &Stage| drafted.iter().any(|name| name == stage.name());
        let draft: Vec<Stage> = next_stages.iter().copied().filter(is_drafted).collect();
        let summary = latest.map(|k| reader.typed::<typed::Summary>(k));
        let summary = summary.transpose()?.unwrap_or_default();
        let wear = recipe.wear.as_ref();
        let cycles = summary.cycles.filter(|_| wear.is_some());
        let cycles = cycles.map(|cycles| cycles as u64);
        let volume = summary.wear_volume.filter(|_| wear.is_some());
        let goals = (
            wear.and_then(|wear| wear.cycles),
            wear.and_then(|wear| wear.volume),
        );
        let is_reached = match (wear, cycles, volume) {
            (Some(wear), Some(cycles), Some(volume)) => wear.is_reached(cycles, volume),
            (Some(_), ..) => false,
            (None, ..) => latest.is_some(),
        };
        let has_lost_preload = match latest {
            Some(latest) if !is_reached => has_lost_before(reader, recipe, latest)?,
            _ => false,
        };
        let done = is_reached || has_lost_preload;
        let is_ahead = |stage: &&Stage| draft.last().is_none_or(|last| *stage > last);
        let stage = next_stages
            .iter()
            .find(is_ahead)
            .or(next_stages.last())
            .copied();
        let mut status = RunStatus {
            wear_iteration: latest,
            done,
            has_lost_preload,
            stage: stage.filter(|_| !done),
            draft,
            cycles,
            cycles_goal: goals.0,
            volume_goal: goals.1,
            part: 0.0,
            last_update: latest
                .map(|k| last_update(reader, k))
                .transpose()?
                .flatten(),
            cycles_per_second: None,
            seconds_left: None,
        };
        let pace = Pace::of(&reader.history()?, wear)?;
        status.part = if done { 1.0 } else { pace.part() };
        if wear.is_some() {
            status.cycles_per_second = pace.cycles_per_second();
            status.seconds_left = pace.seconds_left();
        }
        Ok(status)
    }

    /// Returns the remaining cycles, if a number of cycles ends the run.
    pub fn cycles_left(&self) -> Option<u64> {
        Some(self.cycles_goal?.saturating_sub(self.cycles?))
    }
}

fn last_update(reader: &RunReader, latest: u64) -> Result<Option<LastUpdate>, RunError> {
    let row: typed::ModelUpdate = match reader.typed(latest) {
        Ok(row) => row,
        Err(StoreError::NoTable { .. }) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    let wear_iteration = row.update_iteration as u64;
    let summary = reader.history()?.row::<typed::Summary>(wear_iteration)?;
    let cycles = summary.and_then(|summary| summary.cycles);
    Ok(Some(LastUpdate {
        wear_iteration,
        cycles: cycles.map(|cycles| cycles as u64),
        updates: row.updates as u64,
    }))
}
