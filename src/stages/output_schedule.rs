//! Position of an iteration in a run, and the outputs that are due in the iteration.

use super::RunError;
use crate::recipe::{Recipe, ResonanceOf};
use crate::tables::{TableName, Tables, TypedTable, typed};

/// Fractions of the run at which reversal cycles are compared with stepped cycles, besides the end of the run.
const CHECK_FRACTIONS: [f64; 2] = [0.25, 0.5];

/// Outputs that are written in some iterations only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct OutputSchedule {
    /// The curves behind the stiffnesses.
    pub curves: bool,
    /// Fields of the cycle.
    pub cycle_fields: bool,
    /// Outputs of the last iteration.
    pub end: bool,
    /// The forced response of the first, the requested and the last iterations.
    pub forced_response: bool,
    /// The comparison of a reversal cycle with a stepped cycle.
    pub cycle_check: bool,
}

/// Position of an iteration in a run, and the outputs that are due in the iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IterationSchedule {
    /// The iteration.
    pub wear_iteration: u64,
    /// Cycles up to the previous iteration; `None` in the unworn iteration.
    pub cycles_before: Option<u64>,
    /// Number of cycles from the unworn joint to the iteration.
    pub cycles: u64,
    /// Worn volume \[m³\].
    pub volume: f64,
    /// True if the iteration reaches the end of the scene.
    pub is_last: bool,
    /// Outputs that are due.
    pub due: OutputSchedule,
    /// True if the resonance of the worn joint is due: with a forced response, or in all iterations.
    pub resonance_due: bool,
}

impl IterationSchedule {
    /// Computes the position from the wear step in the `tables` of the iteration and from the summary of the previous
    /// iteration.
    pub fn of(
        recipe: &Recipe,
        wear_iteration: u64,
        tables: &Tables,
        before: &Tables,
    ) -> Result<IterationSchedule, RunError> {
        let step = tables.get(&TableName::WearStep);
        let step = step.map(typed::WearStep::of).transpose()?;
        let step = step.unwrap_or_default();
        let summary = before.get(&TableName::Summary);
        let summary = summary.map(typed::Summary::of).transpose()?;
        let cycles_before = summary.as_ref().and_then(|summary| summary.cycles);
        let cycles_before = cycles_before.map(|cycles| cycles as u64);
        let volume_before = summary.as_ref().and_then(|summary| summary.wear_volume);
        let has_lost = summary.is_some_and(|summary| {
            recipe.ends_after(summary.normal_load, summary.error_normal_load)
        });
        let cycles = cycles_before.unwrap_or(0) + step.n_cycles as u64;
        let volume = volume_before.unwrap_or(0.0) + step.volume;
        let wear = recipe.wear.as_ref();
        let is_last = has_lost || wear.is_none_or(|wear| wear.is_reached(cycles, volume));
        let is_due = |every: u64| every > 0 && (is_last || wear_iteration.is_multiple_of(every));
        let part = |cycles, volume| wear.map_or(0.0, |wear| wear.part(cycles, volume));
        let part_before = part(cycles_before.unwrap_or(0), volume_before.unwrap_or(0.0));
        let part_now = part(cycles, volume);
        let is_checked = CHECK_FRACTIONS
            .iter()
            .any(|&at| part_before < at && at <= part_now);
        let output = &recipe.output;
        let fields_every = output
            .cycle_fields
            .as_ref()
            .map_or(0, |fields| fields.every);
        let response_cycles = &recipe.output.response_at;
        let passes = |before: u64| {
            response_cycles
                .iter()
                .any(|&at| before < at && at <= cycles)
        };
        let forced_response = is_last || cycles_before.is_none_or(passes);
        Ok(IterationSchedule {
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
