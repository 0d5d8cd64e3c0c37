//! Error bars of a worn state.

use super::RunError;
use super::contact_state::required_column;
use super::dynamic_response::UNKNOWN_CHANGE;
use super::grid_twin::error_of_grid;
use super::stage_inputs::StageInputs;
use crate::model_update::PRELOAD_TOLERANCE;
use crate::recipe::Wear;
use crate::tables::TableName;
use crate::tables::typed::{self, Summary};
use crate::wear::coarse::ERROR_PER_DIFFERENCE;
use crate::wear::error_bar::{self, VolumeError};

/// Relative error of an unknown result, for example of a zero that is possibly wrong.
pub(super) const UNKNOWN: f64 = 1.0;

/// Reads a result from a summary.
type Figure = fn(&Summary) -> Option<f64>;

/// The current response of the vibrating joint, with its last update.
pub struct ResponseInForce {
    pub response: typed::DynamicResponse,
    pub update: typed::ModelUpdate,
}

impl ResponseInForce {
    /// Combines both tables; `None` where the motion is prescribed.
    pub fn of(
        response: Option<typed::DynamicResponse>,
        update: Option<typed::ModelUpdate>,
    ) -> Option<ResponseInForce> {
        let both = response.zip(update);
        both.map(|(response, update)| ResponseInForce { response, update })
    }
}

/// The iteration from which a step starts.
pub struct PreviousIteration {
    pub cycles: i64,
    /// Worn volume \[m³\].
    pub volume: f64,
    /// Dissipated energy \[J\].
    pub energy: f64,
    /// Sum of the error estimates of all steps \[m³\].
    error: f64,
    /// Error bar of the volume, by source.
    bar: VolumeError,
    /// Energy per area of the cycle \[J/m²\].
    dissipation: Vec<f64>,
    in_force: Option<ResponseInForce>,
    cycle: Option<typed::FrettingCycle>,
    summary: Summary,
}

impl PreviousIteration {
    /// Reads the previous iteration; `None` in the unworn iteration.
    pub fn of(reads: &StageInputs) -> Result<Option<PreviousIteration>, RunError> {
        let Some(summary) = reads.optional_previous_table::<Summary>()? else {
            return Ok(None);
        };
        let fields: typed::ContactField = reads.before()?;
        let value_of = |value: Option<f64>, column| -> Result<f64, RunError> {
            Ok(*required_column(TableName::Summary, &value, column)?)
        };
        let volume = value_of(summary.wear_volume, "wear_volume")?;
        // A prescribed motion has no error of the harmonics and no error of the closure.
        let harmonics = summary.error_harmonics.unwrap_or(0.0);
        let closure = summary.error_closure.unwrap_or(0.0);
        let cycles = summary.error_cycles.unwrap_or(0.0);
        let whole = value_of(summary.error_wear_volume, "error_wear_volume")?;
        let propagation = summary.error_propagation.unwrap_or(0.0);
        let grid = summary.error_grid.unwrap_or(0.0);
        let dissipation =
            required_column(TableName::ContactField, &fields.dissipation, "dissipation")?;
        Ok(Some(PreviousIteration {
            cycles: *required_column(TableName::Summary, &summary.cycles, "cycles")?,
            volume,
            energy: value_of(summary.dissipated_energy_total, "dissipated_energy_total")?,
            error: value_of(summary.error_wear, "error_wear")? * volume,
            bar: VolumeError {
                steps: (whole - propagation - harmonics - closure - cycles - grid) * volume,
                cycles: cycles * volume,
                // Each iteration computes the propagation error from the coarse trajectory of the iteration.
                propagation: 0.0,
                harmonics: harmonics * volume,
                closure: closure * volume,
                // Each iteration computes the grid error from the run on half the grid.
                grid: 0.0,
            },
            dissipation: dissipation.clone(),
            in_force: ResponseInForce::of(
                reads.optional_previous_table()?,
                reads.optional_previous_table()?,
            ),
            cycle: reads.optional_previous_table()?,
            summary,
        }))
    }
}

/// Inputs of the error bars of an iteration.
pub struct Sources<'a> {
    /// The previous iteration.
    pub before: Option<&'a PreviousIteration>,
    /// The wear step from the previous iteration to the current iteration.
    pub step: &'a typed::WearStep,
    /// The response that drives the joint; `None` for a prescribed motion.
    pub in_force: Option<&'a ResponseInForce>,
    /// Summary of the unworn state. `None` in the unworn iteration, and if another scene computed the unworn state.
    /// `unworn_response` is the response of the unworn state.
    pub unworn: Option<&'a Summary>,
    pub unworn_response: Option<&'a typed::DynamicResponse>,
    /// Load lost by wear \[N\]; `None` if the load cannot fall.
    pub lost_load: Option<f64>,
    /// The cycle of the current iteration.
    pub cycle: &'a typed::FrettingCycle,
    /// The response of the worn joint, if the scene requests this response.
    pub worn: Option<&'a typed::WornResponse>,
    /// The coarse trajectory; `None` if the run has no coarse trajectory.
    pub coarse: Option<&'a typed::CoarseStep>,
    /// The run on half the grid; `None` if the scene requests no grid check.
    pub twin: Option<&'a typed::GridTwin>,
    /// Numbers of loaded, touching and undecided cells.
    pub cells: Cells,
    /// Energy per area of the cycle \[J/m²\].
    pub dissipation: &'a [f64],
    /// Area of a cell \[m²\].
    pub cell_area: f64,
    /// Worn volume of all iterations \[m³\].
    pub volume: f64,
}

/// Numbers of cells.
#[derive(Debug, Clone, Copy)]
pub struct Cells {
    pub loaded: f64,
    pub touching: f64,
    pub undecided: f64,
}

/// Adds error bars to a summary that contains results. The error bars belong to the worn volume, the contact and the
/// vibration.
pub fn error_bars(wear: &Wear, sources: &Sources, summary: &mut Summary) {
    let &Sources {
        before,
        step,
        in_force,
        unworn,
        cycle,
        coarse,
        cells,
        volume,
        ..
    } = sources;
    let relative = |error: f64| match volume {
        volume if volume > 0.0 => error / volume,
        _ if error > 0.0 => UNKNOWN,
        _ => 0.0,
    };
    let estimate = estimate(wear, sources);
    // The vibration of the previous iteration drove the wear of the current step.
    let last = before.and_then(|b| b.in_force.as_ref());
    let response_error =
        |value: fn(&typed::DynamicResponse) -> f64| last.map_or(0.0, |l| value(&l.response));
    let step_error = error_bar::step_error(estimate, coarse.is_some());
    let mut bar = before.map_or(VolumeError::default(), |b| b.bar)
        + VolumeError {
            steps: step_error,
            cycles: 0.0,
            propagation: 0.0,
            harmonics: step.volume * response_error(|row| row.error_friction_energy),
            closure: 0.0,
            grid: 0.0,
        };
    bar.closure = closure_error(sources);
    bar.cycles = cycle_error(sources);
    let grid_error = sources.twin.map(|twin| {
        let cycles = before.map_or(0, |before| before.cycles) + step.n_cycles;
        error_of_grid(twin, cycles, volume)
    });
    let spread = |value: fn(&typed::CoarseStep) -> f64| {
        coarse.map_or(0.0, |c| ERROR_PER_DIFFERENCE * value(c))
    };
    let field = spread(|c| c.difference_wear_field).max(bar.total());
    bar.propagation = (spread(|c| c.difference_wear_volume) - bar.contact_error()).max(0.0);
    bar.grid = grid_error.unwrap_or(0.0) * volume;
    let bar = bar;
    // Fraction of a result that wear has changed since the unworn state.
    let changed = |figure: Figure| match unworn.and_then(figure).zip(figure(summary)) {
        Some((unworn, now)) if (unworn / now).is_finite() => (1.0 - unworn / now).abs(),
        _ => 1.0,
    };
    // `by_wear` is the error of a result due to the error of the wear. `by_wear` follows from the volume worn from the
    // previous iteration to the current iteration, in which the result changed. An inherited iteration may lack the
    // result. The callers add the error of the result itself.
    let by_wear = |figure: Figure, wears: f64, meanwhile: f64| {
        let now = figure(summary).unwrap_or(0.0);
        let earlier = before.and_then(|b| figure(&b.summary));
        let ends = [earlier.unwrap_or(now), now];
        error_bar::figure_error(ends, wears, bar, meanwhile, volume)
    };
    let with_own_error =
        |figure: Figure, meanwhile: f64, own: f64| Some(by_wear(figure, 1.0, meanwhile) + own);
    // The error of a contact result follows from the coarse trajectory. In a run without a coarse trajectory, the error
    // of a contact result follows from the error of the wear.
    let contact_error =
        |figure: Figure, wears: f64, difference: Option<f64>, own: f64| match difference {
            Some(difference) => Some(
                relative(error_bar::LEAST_FIGURE_ERROR * wears * bar.contact_error())
                    + difference
                    + own,
            ),
            None => Some(by_wear(figure, wears, step.volume) + own),
        };
    let part = |count: f64, total: f64| {
        if total > 0.0 {
            (count / total).min(UNKNOWN)
        } else {
            0.0
        }
    };
    // Neither a contact solve nor the coarse trajectory shows whether one more cell touches.
    let undecided = part(cells.undecided + 1.0, cells.touching);
    let coarse_difference =
        |value: fn(&typed::CoarseStep) -> f64| coarse.map(|c| ERROR_PER_DIFFERENCE * value(c));
    // An omitted stiffness has no error bar.
    let stiffness_error = |figure: Figure, value: fn(&typed::CoarseStep) -> Option<f64>| {
        figure(summary)?;
        let difference = coarse.map(|c| ERROR_PER_DIFFERENCE * value(c).unwrap_or(0.0));
        contact_error(figure, changed(figure), difference, undecided)
    };
    // Depths scale with the volume, and single cells may deviate further.
    let depth_error = |figure: Figure, value: fn(&typed::CoarseStep) -> f64| {
        let bar = relative(bar.total()).max(by_wear(figure, 1.0, step.volume));
        Some(bar.max(spread(value)))
    };
    let load_error = sources.lost_load.map(|lost| {
        let load = summary.normal_load.unwrap_or(0.0);
        let lost = relative(bar.total()) * lost.abs() / load;
        let error = lost.max(by_wear(|s| s.normal_load, 0.0, step.volume));
        error + PRELOAD_TOLERANCE
    });
    let (mut meanwhile, own) = (step.volume, error_of_energy(cycle, in_force));
    let mut vibration_errors = [None; 2];
    let mut resonance_change_error = None;
    if let Some(ResponseInForce { response, update }) = in_force {
        // The current response does not change between updates.
        let since = volume - last.map_or(0.0, |last| last.update.wear_volume);
        if update.updated {
            meanwhile = since;
        }
        let resonance_error = response.error_resonance_frequency.map(|own| {
            let figure: Figure = |s| s.resonance_frequency;
            let by_wear = by_wear(figure, changed(figure), since);
            let frequency = figure(summary).unwrap_or(0.0);
            resonance_change_error = Some(match before {
                Some(_) => {
                    by_wear * frequency + truncation_of_change(response, sources.unworn_response)
                }
                None => 0.0,
            });
            by_wear + own
        });
        vibration_errors = [
            resonance_error,
            with_own_error(|s| s.peak_amplitude, since, response.error_peak_amplitude),
        ];
    }
    let energy = |s: &Summary| s.dissipated_energy;
    let least = relative(error_bar::LEAST_ENERGY_ERROR * bar.contact_error()) + own;
    let energy_error = match (before.and_then(|b| energy(&b.summary)), energy(summary)) {
        (Some(before), Some(0.0)) if before > 0.0 => UNKNOWN,
        _ => with_own_error(energy, meanwhile, own)
            .unwrap_or(0.0)
            .max(least)
            .max(spread(|c| c.difference_dissipated_energy)),
    };
    let bars = Summary {
        error_largest_depth: depth_error(|s| s.largest_depth, |c| c.difference_largest_depth),
        error_depth_99: depth_error(|s| s.depth_99, |c| c.difference_depth_99),
        error_normal_load: load_error,
        error_resonance_change: resonance_change_error,
        error_loaded_area: contact_error(
            |s| s.loaded_area_fraction,
            1.0,
            coarse.map(|c| c.difference_loaded_area),
            part(1.0, cells.loaded),
        ),
        error_kn: stiffness_error(|s| s.kn, |c| c.difference_kn),
        error_kt: stiffness_error(|s| s.kt, |c| c.difference_kt),
        error_max_pressure: contact_error(
            |s| s.max_pressure,
            1.0,
            coarse_difference(|c| c.difference_max_pressure),
            0.0,
        ),
        error_dissipated_energy: Some(energy_error),
        error_dissipated_energy_absolute: energy(summary).map(|now| match before {
            // A relative error bar of zero energy is meaningless. The energy and the error bar of the previous
            // iteration bound the error.
            Some(before) if now == 0.0 => {
                let earlier = before.summary.error_dissipated_energy_absolute;
                let earlier = earlier.unwrap_or(0.0);
                earlier.max(energy(&before.summary).unwrap_or(0.0))
            }
            _ => energy_error * now,
        }),
        error_resonance_frequency: vibration_errors[0],
        error_peak_amplitude: vibration_errors[1],
        error_cycles: Some(relative(bar.cycles)),
        error_harmonics: in_force.map(|_| relative(bar.harmonics)),
        error_grid: grid_error,
        error_closure: in_force.map(|_| relative(bar.closure)),
        error_wear: Some(relative(before.map_or(0.0, |b| b.error) + estimate)),
        error_wear_volume: Some(relative(bar.total())),
        error_wear_field: Some(relative(field)),
        error_propagation: coarse.map(|_| relative(bar.propagation)),
        ..summary.clone()
    };
    *summary = bars;
}

/// Returns the truncation error of the change of the resonance between two responses \[Hz\]. If both responses have the
/// same harmonics, the error is twice the difference of their expected truncation errors. For other pairs of responses,
/// the error is the sum of the bounds of both responses.
fn truncation_of_change(
    now: &typed::DynamicResponse,
    unworn: Option<&typed::DynamicResponse>,
) -> f64 {
    let frequency = |row: &typed::DynamicResponse| row.resonance_frequency.unwrap_or(0.0);
    let at_most = |row: &typed::DynamicResponse| {
        row.error_resonance_frequency.unwrap_or(UNKNOWN) * frequency(row)
    };
    let Some(unworn) = unworn else {
        return at_most(now);
    };
    let expected = |row: &typed::DynamicResponse| {
        let change = row.expected_resonance_change?;
        (change != UNKNOWN_CHANGE).then(|| change * frequency(row))
    };
    let bound = at_most(now) + at_most(unworn);
    match expected(now).zip(expected(unworn)) {
        Some((now_expected, then)) if now.highest_harmonic == unworn.highest_harmonic => {
            (SAFETY_FACTOR * (now_expected - then).abs()).min(bound)
        }
        _ => bound,
    }
}

/// Safety factor on the difference of two estimates.
const SAFETY_FACTOR: f64 = 2.0;

/// Returns the relative error of the energy per cycle, without the error of the earlier wear. The energy error contains
/// the errors of the solves and samples, and of the truncated harmonics of the vibration. The energy error includes the
/// difference between the dissipated energy and the friction energy of the contact elements.
pub(super) fn error_of_energy(
    cycle: &typed::FrettingCycle,
    in_force: Option<&ResponseInForce>,
) -> f64 {
    let Some(ResponseInForce { response, .. }) = in_force else {
        return cycle.error_cycle;
    };
    let energy = cycle.dissipated_energy;
    let closure = relative_energy_error((energy - friction(response)).abs(), energy);
    cycle.error_cycle + response.error_friction_energy + closure
}

/// Returns the error of the volume worn in the current step \[m³\]. If the scheme estimates errors, returns the
/// estimate of the step. Otherwise returns the effect of the change of the wear rates within the step.
fn estimate(wear: &Wear, sources: &Sources) -> f64 {
    let step = sources.step;
    match sources.before {
        Some(before) if !wear.scheme.estimates_error() => {
            let energies = [&before.dissipation[..], sources.dissipation];
            let cycles = step.n_cycles as u64;
            error_bar::constant_rate_error(energies, wear.law(), cycles, sources.cell_area)
        }
        _ => step.error,
    }
}

/// Returns the error of the worn volume \[m³\] because the vibration is not computed anew on every surface.
///
/// At each update, the energy per cycle jumps between the old and the new motion. The jump counts for all wear since
/// the last update, both at an update and at the end of the run. The full jump overestimates the error, since the old
/// motion was exact at first. The gap between fine contact and contact elements after the update counts in the same
/// way. Between updates, the error since the last update is at least the jump and the gap of that update. The error
/// since the last update increases with the difference between the fine contact and the elements under the same motion.
fn closure_error(sources: &Sources) -> f64 {
    let &Sources {
        before,
        in_force: Some(now),
        cycle,
        worn,
        volume,
        ..
    } = sources
    else {
        return 0.0;
    };
    let Some(before) = before else {
        return 0.0;
    };
    let pending = |cycle: &typed::FrettingCycle, since: f64| since * pending_error(cycle);
    let update_volume = |response: &ResponseInForce| response.update.wear_volume;
    let (Some(last), Some(cycle_before)) = (&before.in_force, &before.cycle) else {
        return before.bar.closure;
    };
    // For an inherited iteration, all earlier wear counts as worn before its update.
    let settled = before.bar.closure - pending(cycle_before, before.volume - update_volume(last));
    let since = volume - update_volume(last);
    let worn_energy = worn.and_then(|worn| worn.fine_energy);
    let unsettled = match worn_energy {
        _ if now.update.updated => since * update_error(cycle),
        Some(energy) => {
            let jump = relative_difference(energy, cycle.dissipated_energy);
            since * (jump + cycle.update_gap.unwrap_or(0.0).abs())
        }
        None => pending(cycle, since),
    };
    settled.max(0.0) + unsettled
}

/// Returns the relative error of the energy per cycle at an update. The error is the jump of the energy, plus the
/// remaining gap between fine contact and contact elements.
fn update_error(cycle: &typed::FrettingCycle) -> f64 {
    [cycle.update_jump, cycle.update_gap]
        .map(|part| part.unwrap_or(0.0).abs())
        .iter()
        .sum()
}

/// Returns the error of the worn volume due to inexact cycles \[m³\]. If the current iteration compares a cycle with a
/// stepped cycle, the comparison measures an error. The measured error counts for all wear since the previous
/// comparison.
fn cycle_error(sources: &Sources) -> f64 {
    let now = sources.cycle;
    let Some(before) = sources.before else {
        return sources.step.volume * now.error_cycle;
    };
    let check_volume = |cycle: &typed::FrettingCycle| cycle.check_volume.unwrap_or(0.0);
    match &before.cycle {
        Some(cycle) if check_volume(now) != check_volume(cycle) => {
            let unknown = (before.volume - check_volume(cycle)) * cycle.error_cycle;
            let settled = (before.bar.cycles - unknown).max(0.0);
            settled + (sources.volume - check_volume(cycle)) * now.error_cycle
        }
        _ => before.bar.cycles + sources.step.volume * now.error_cycle,
    }
}

/// Returns the relative error of the wear since the last update. The next update of the contact elements replaces the
/// relative error.
fn pending_error(cycle: &typed::FrettingCycle) -> f64 {
    let element_energy = cycle.elements_energy.unwrap_or(cycle.dissipated_energy);
    update_error(cycle).max(relative_difference(element_energy, cycle.dissipated_energy))
}

/// Returns the difference of an energy from a `reference`, relative to the reference; 0 if both are 0.
fn relative_difference(energy: f64, reference: f64) -> f64 {
    relative_energy_error((energy - reference).abs(), reference)
}

/// Returns the friction energy of the contact elements \[J\]. Returns 0 if the friction energy is within the rounding
/// errors of the energy of the exciter.
pub(super) fn friction(response: &typed::DynamicResponse) -> f64 {
    let energy = response.friction_energy;
    match energy.abs() > ROUNDING * response.input_energy.abs() {
        true => energy,
        false => 0.0,
    }
}

/// Part of the energy of the exciter below which friction counts as rounding error. The sums of the friction energy
/// have some thousands of terms.
const ROUNDING: f64 = 1e-11;

/// Returns the `error` of the `energy` of a cycle \[J\], relative to the energy.
fn relative_energy_error(error: f64, energy: f64) -> f64 {
    if error <= 0.0 {
        0.0
    } else if energy > 0.0 {
        error / energy
    } else {
        UNKNOWN
    }
}
