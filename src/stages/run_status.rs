//! How far a run is, read from what it has committed and drafted: the same for who computes it and for who only looks.

use super::RunError;
use super::runner::stages_in;
use super::stage::Stage;
use crate::recipe::Recipe;
use crate::store::{RunReader, StoreError};
use crate::tables::typed;

/// Wear steps whose pace counts as that of late.
const OF_LATE: usize = 3;

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
    /// Cycles a second of computing, over the last steps.
    pub cycles_per_second: Option<f64>,
    /// Seconds of computing to the end at that pace.
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
        let done = match (wear, cycles, volume) {
            (Some(wear), Some(cycles), Some(volume)) => wear.is_reached(cycles, volume),
            (Some(_), ..) => false,
            (None, ..) => latest.is_some(),
        };
        let is_ahead = |stage: &&Stage| draft.last().is_none_or(|last| *stage > last);
        let stage = of_next.iter().find(is_ahead).or(of_next.last()).copied();
        let mut standing = RunStatus {
            wear_iteration: latest,
            done,
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
        let of_cycles = |cycles: f64| goals.0.map_or(0.0, |goal| cycles / goal as f64);
        let of_volume = |volume: f64| goals.1.map_or(0.0, |goal| volume / goal);
        let (cycles, volume) = (cycles.unwrap_or(0) as f64, volume.unwrap_or(0.0));
        standing.part = if done {
            1.0
        } else {
            of_cycles(cycles).max(of_volume(volume)).min(1.0)
        };
        if let Some(pace) = Pace::of(reader)? {
            standing.cycles_per_second = Some(pace.cycles / pace.seconds);
            let part = of_cycles(pace.cycles).max(of_volume(pace.volume));
            if part > 0.0 {
                standing.seconds_left = Some((1.0 - standing.part) * pace.seconds / part);
            }
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

/// What the last wear steps did, and the time that their iterations took.
struct Pace {
    cycles: f64,
    volume: f64,
    seconds: f64,
}

impl Pace {
    /// None before the first step.
    fn of(reader: &RunReader) -> Result<Option<Pace>, RunError> {
        let mut pace = Pace {
            cycles: 0.0,
            volume: 0.0,
            seconds: 0.0,
        };
        let iterations: Vec<u64> = reader.iterations().filter(|k| *k > 0).collect();
        for &k in iterations.iter().rev().take(OF_LATE) {
            let step: typed::WearStep = match reader.typed(k) {
                Ok(step) => step,
                Err(StoreError::NoTable { .. }) => return Ok(None),
                Err(error) => return Err(error.into()),
            };
            pace.cycles += step.n_cycles as f64;
            pace.volume += step.volume;
            match reader.typed::<typed::Timing>(k) {
                Ok(timing) => pace.seconds += timing.seconds.iter().sum::<f64>(),
                // No result depends on it: then there is no pace.
                Err(StoreError::Damaged(_) | StoreError::NoTable { .. }) => return Ok(None),
                Err(error) => return Err(error.into()),
            }
        }
        Ok((pace.seconds > 0.0 && pace.cycles > 0.0).then_some(pace))
    }
}
