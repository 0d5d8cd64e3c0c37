//! Where an iteration stands in its run: what it leaves to be done.

use super::RunError;
use crate::recipe::{Recipe, ResonanceOf};
use crate::tables::{TableName, Tables, TypedTable, typed};

/// Parts of the run at which cycles between two ends are held against stepped ones, beside its end.
const CHECKED: [f64; 2] = [0.25, 0.5];

/// What is written of some iterations only: every so many, and the last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct OutputSchedule {
    /// The curves behind the stiffnesses.
    pub curves: bool,
    /// Fields of the cycle.
    pub cycle_fields: bool,
    /// What the end of the run alone has.
    pub end: bool,
    /// A forced response: of the first iteration, those asked for, and the last.
    pub forced_response: bool,
    /// The cycle between two ends beside a stepped one.
    pub cycle_check: bool,
}

/// Where an iteration stands in its run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// The iteration.
    pub wear_iteration: u64,
    /// Cycles behind the iteration before; none of the unworn one.
    pub cycles_before: Option<u64>,
    /// Cycles behind it.
    pub cycles: u64,
    /// Volume worn away \[m³\].
    pub volume: f64,
    /// True if it reaches the end of the scene.
    pub is_last: bool,
    /// What else is written of it.
    pub due: OutputSchedule,
    /// True if a resonance of the worn joint belongs to it: where a forced response does, or to all.
    pub resonance_due: bool,
}

impl Moment {
    /// From the step that led to an iteration, among its `tables`, and from the summary of the one before.
    pub fn of(
        recipe: &Recipe,
        wear_iteration: u64,
        tables: &Tables,
        before: &Tables,
    ) -> Result<Moment, RunError> {
        let step = tables.get(&TableName::WearStep);
        let step = step.map(typed::WearStep::of).transpose()?;
        let step = step.unwrap_or_default();
        let summary = before.get(&TableName::Summary);
        let summary = summary.map(typed::Summary::of).transpose()?;
        let cycles_before = summary.as_ref().and_then(|summary| summary.cycles);
        let cycles_before = cycles_before.map(|cycles| cycles as u64);
        let volume_before = summary.as_ref().and_then(|summary| summary.wear_volume);
        let has_lost =
            summary.is_some_and(|of| recipe.ends_after(of.normal_load, of.error_normal_load));
        let cycles = cycles_before.unwrap_or(0) + step.n_cycles as u64;
        let volume = volume_before.unwrap_or(0.0) + step.volume;
        let wear = recipe.wear.as_ref();
        let is_last = has_lost || wear.is_none_or(|wear| wear.is_reached(cycles, volume));
        let is_due = |every: u64| every > 0 && (is_last || wear_iteration.is_multiple_of(every));
        let part = |cycles, volume| wear.map_or(0.0, |wear| wear.part(cycles, volume));
        let begin = part(cycles_before.unwrap_or(0), volume_before.unwrap_or(0.0));
        let now = part(cycles, volume);
        let is_checked = CHECKED.iter().any(|&at| begin < at && at <= now);
        let output = &recipe.output;
        let fields_every = output
            .cycle_fields
            .as_ref()
            .map_or(0, |fields| fields.every);
        let asked = &recipe.output.response_at;
        let passes = |before: u64| asked.iter().any(|&at| before < at && at <= cycles);
        let forced_response = is_last || cycles_before.is_none_or(passes);
        Ok(Moment {
            wear_iteration,
            cycles_before,
            cycles,
            volume,
            is_last,
            due: OutputSchedule {
                curves: is_due(output.curves_every),
                cycle_fields: is_due(fields_every),
                end: is_last,
                forced_response,
                cycle_check: cycles_before.is_some() && (is_last || is_checked),
            },
            resonance_due: forced_response || output.resonance == ResonanceOf::All,
        })
    }
}
