//! How far a run is, read from what it has committed and drafted: the same for who computes it and for who only looks.

use super::RunError;
use super::pace::Pace;
use super::run::has_lost_before;
use super::runner::stages_in;
use super::stage::Stage;
use crate::recipe::Recipe;
use crate::store::{RunReader, StoreError};
use crate::tables::typed;

/// The last renewal of the contact elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LastUpdate {
    /// The iteration.
    pub wear_iteration: u64,
    /// Cycles behind it; none where the row of that iteration is lost.
    pub cycles: Option<u64>,
    /// Renewals so far, the first elements not counted.
    pub updates: u64,
}

/// How far a run is.
#[derive(Debug, Clone, PartialEq)]
pub struct RunStatus {
    /// The last committed iteration; none before the first.
    pub wear_iteration: Option<u64>,
    /// True if the scene is computed.
    pub done: bool,
    /// True if it is since `wear.until.preload` ended it.
    pub has_lost_preload: bool,
    /// The stage that comes next, or is being computed; the last one while the iteration is committed. None of a run that is done.
    pub stage: Option<Stage>,
    /// The stages that are passed already of the iteration after the last.
    pub draft: Vec<Stage>,
    /// Cycles behind the last iteration; none without wear.
    pub cycles: Option<u64>,
    /// Cycles that end the run.
    pub cycles_goal: Option<u64>,
    /// Worn volume that ends the run \[m³\].
    pub volume_goal: Option<f64>,
    /// Part done of the cycles or of the volume, whichever is further.
    pub part: f64,
    /// When the contact elements became those of a worn joint, in a run that has them.
    pub last_update: Option<LastUpdate>,
    /// Cycles per second of computing, over the last steps.
    pub cycles_per_second: Option<f64>,
    /// Seconds of computing to the end; none before a fifth of the run is done.
    pub seconds_left: Option<f64>,
}

impl RunStatus {
    /// Looks at the run of a recipe.
    ///
    /// # Errors
    /// Those of reading it.
    pub fn of(reader: &RunReader, recipe: &Recipe) -> Result<RunStatus, RunError> {
        let latest = reader.latest();
        let next = latest.map_or(0, |k| k + 1);
        let drafted = reader.drafted(next)?;
        let of_next: Vec<Stage> = stages_in(recipe, next).map(|s| s.stage).collect();
        let is_drafted = |stage: &Stage| drafted.iter().any(|name| name == stage.name());
        let draft: Vec<Stage> = of_next.iter().copied().filter(is_drafted).collect();
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
        let stage = of_next.iter().find(is_ahead).or(of_next.last()).copied();
        let mut standing = RunStatus {
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
        standing.part = if done { 1.0 } else { pace.part() };
        if wear.is_some() {
            standing.cycles_per_second = pace.cycles_per_second();
            standing.seconds_left = pace.seconds_left();
        }
        Ok(standing)
    }

    /// Cycles that are left, where cycles end the run.
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
