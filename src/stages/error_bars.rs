//! The error bars of a worn state.

use super::RunError;
use super::contact_state::there;
use super::dynamic_response::UNKNOWN_CHANGE;
use super::grid_twin::error_of_grid;
use super::stage_inputs::StageInputs;
use crate::model_update::PRELOAD_TOLERANCE;
use crate::recipe::Wear;
use crate::tables::TableName;
use crate::tables::typed::{self, Summary};
use crate::wear::coarse::SPREAD;
use crate::wear::error_bar::{self, VolumeError};

/// Relative error of a figure of which nothing is known, as of what is 0 and should perhaps not be.
pub(super) const ALL: f64 = 1.0;

/// A figure of a summary.
type Figure = fn(&Summary) -> Option<f64>;

/// The response in force.
pub struct ResponseInForce {
    pub response: typed::DynamicResponse,
    pub update: typed::ModelUpdate,
}

impl ResponseInForce {
    /// Of both its tables; none where the motion is prescribed.
    pub fn of(
        response: Option<typed::DynamicResponse>,
        update: Option<typed::ModelUpdate>,
    ) -> Option<ResponseInForce> {
        let both = response.zip(update);
        both.map(|(response, update)| ResponseInForce { response, update })
    }
}

/// The iteration that a step was made from.
pub struct PreviousIteration {
    pub cycles: i64,
    /// Volume worn away \[m³\].
    pub volume: f64,
    /// Energy dissipated \[J\].
    pub energy: f64,
    /// Sum of what all steps estimate of their errors \[m³\].
    error: f64,
    /// The error bar of the volume, by source.
    bar: VolumeError,
    /// Energy per area of its cycle \[J/m²\].
    dissipation: Vec<f64>,
    in_force: Option<ResponseInForce>,
    cycle: Option<typed::FrettingCycle>,
    summary: Summary,
}

impl PreviousIteration {
    /// None of the unworn iteration.
    pub fn of(reads: &StageInputs) -> Result<Option<PreviousIteration>, RunError> {
        let Some(summary) = reads.optional_before::<Summary>()? else {
            return Ok(None);
        };
        let fields: typed::ContactField = reads.before()?;
        let of = |value: Option<f64>, column| -> Result<f64, RunError> {
            Ok(*there(TableName::Summary, &value, column)?)
        };
        let volume = of(summary.wear_volume, "wear_volume")?;
        // A motion that is prescribed has neither.
        let harmonics = summary.error_harmonics.unwrap_or(0.0);
        let closure = summary.error_closure.unwrap_or(0.0);
        let cycles = summary.error_cycles.unwrap_or(0.0);
        let whole = of(summary.error_wear_volume, "error_wear_volume")?;
        let propagation = summary.error_propagation.unwrap_or(0.0);
        let grid = summary.error_grid.unwrap_or(0.0);
        let dissipation = there(TableName::ContactField, &fields.dissipation, "dissipation")?;
        Ok(Some(PreviousIteration {
            cycles: *there(TableName::Summary, &summary.cycles, "cycles")?,
            volume,
            energy: of(summary.dissipated_energy_total, "dissipated_energy_total")?,
            error: of(summary.error_wear, "error_wear")? * volume,
            bar: VolumeError {
                steps: (whole - propagation - harmonics - closure - cycles - grid) * volume,
                cycles: cycles * volume,
                // That of an iteration follows from the coarse trajectory as it is then.
                propagation: 0.0,
                harmonics: harmonics * volume,
                closure: closure * volume,
                // That of an iteration follows from the twin.
                grid: 0.0,
            },
            dissipation: dissipation.clone(),
            in_force: ResponseInForce::of(reads.optional_before()?, reads.optional_before()?),
            cycle: reads.optional_before()?,
            summary,
        }))
    }
}

/// What the error bars of an iteration follow from.
pub struct Sources<'a> {
    /// The iteration that it was worn from.
    pub before: Option<&'a PreviousIteration>,
    /// The step that led to it.
    pub step: &'a typed::WearStep,
    /// What moves the joint; none where its motion is prescribed.
    pub in_force: Option<&'a ResponseInForce>,
    /// The unworn state and its response, where there is wear since and they are of this scene.
    pub unworn: Option<&'a Summary>,
    pub unworn_response: Option<&'a typed::DynamicResponse>,
    /// Load that wear has taken away \[N\], where it may.
    pub lost_load: Option<f64>,
    /// The cycle.
    pub cycle: &'a typed::FrettingCycle,
    /// The response of the worn joint, where it is asked for.
    pub worn: Option<&'a typed::WornResponse>,
    /// The coarse trajectory; none where there is none.
    pub coarse: Option<&'a typed::CoarseStep>,
    /// The same scene on half the grid; none where it is not run.
    pub twin: Option<&'a typed::GridTwin>,
    /// Cells that are loaded, that touch, and that are not known to.
    pub cells: Cells,
    /// Energy per area of the cycle \[J/m²\].
    pub dissipation: &'a [f64],
    /// Area of a cell \[m²\].
    pub cell_area: f64,
    /// Volume worn in all iterations \[m³\].
    pub volume: f64,
}

/// Numbers of cells.
#[derive(Debug, Clone, Copy)]
pub struct Cells {
    pub loaded: f64,
    pub touching: f64,
    pub undecided: f64,
}

/// Adds the error bars to a summary that has its figures: of the volume, of figures of the contact, and of those of the vibration.
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
        _ if error > 0.0 => ALL,
        _ => 0.0,
    };
    let estimate = estimate(wear, sources);
    // The vibration that the step was worn under is that of the iteration before.
    let last = before.and_then(|b| b.in_force.as_ref());
    let wrong = |of: fn(&typed::DynamicResponse) -> f64| last.map_or(0.0, |l| of(&l.response));
    let of_step = error_bar::of_step(estimate, coarse.is_some());
    let mut bar = before.map_or(VolumeError::default(), |b| b.bar)
        + VolumeError {
            steps: of_step,
            cycles: 0.0,
            propagation: 0.0,
            harmonics: step.volume * wrong(|row| row.error_friction_energy),
            closure: 0.0,
            grid: 0.0,
        };
    bar.closure = closure_of(sources);
    bar.cycles = of_cycles(sources);
    let of_grid = sources.twin.map(|twin| {
        let cycles = before.map_or(0, |before| before.cycles) + step.n_cycles;
        error_of_grid(twin, cycles, volume)
    });
    let spread = |of: fn(&typed::CoarseStep) -> f64| coarse.map_or(0.0, |c| SPREAD * of(c));
    let field = spread(|c| c.difference_wear_field).max(bar.total());
    bar.propagation = (spread(|c| c.difference_wear_volume) - bar.of_contact()).max(0.0);
    bar.grid = of_grid.unwrap_or(0.0) * volume;
    let bar = bar;
    // The part of a figure that wear has changed since the unworn state.
    let changed = |figure: Figure| match unworn.and_then(figure).zip(figure(summary)) {
        Some((unworn, now)) if (unworn / now).is_finite() => (1.0 - unworn / now).abs(),
        _ => 1.0,
    };
    // The bar of a figure of this and of the iteration before, which what was inherited may not have had: by the volume worn while the
    // figure changed, and by an error that is in it by itself, not through wear.
    let by_wear = |figure: Figure, wears: f64, meanwhile: f64| {
        let now = figure(summary).unwrap_or(0.0);
        let earlier = before.and_then(|b| figure(&b.summary));
        let ends = [earlier.unwrap_or(now), now];
        error_bar::of_figure(ends, wears, bar, meanwhile, volume)
    };
    let followed =
        |figure: Figure, meanwhile: f64, own: f64| Some(by_wear(figure, 1.0, meanwhile) + own);
    // That of a figure of the contact alone: by the coarse trajectory, or as above.
    let of_contact =
        |figure: Figure, wears: f64, difference: Option<f64>, own: f64| match difference {
            Some(difference) => {
                Some(relative(error_bar::LEAST * wears * bar.of_contact()) + difference + own)
            }
            None => Some(by_wear(figure, wears, step.volume) + own),
        };
    let part = |count: f64, of: f64| if of > 0.0 { (count / of).min(ALL) } else { 0.0 };
    // Whether one more touches no solve tells, nor the coarse trajectory.
    let undecided = part(cells.undecided + 1.0, cells.touching);
    let coarse_by = |of: fn(&typed::CoarseStep) -> f64| coarse.map(|c| SPREAD * of(c));
    // None of a stiffness that is left out.
    let of_stiffness = |figure: Figure, of: fn(&typed::CoarseStep) -> Option<f64>| {
        figure(summary)?;
        let difference = coarse.map(|c| SPREAD * of(c).unwrap_or(0.0));
        of_contact(figure, changed(figure), difference, undecided)
    };
    // Depths follow the volume, and cells may do so by themselves.
    let of_depth = |figure: Figure, of: fn(&typed::CoarseStep) -> f64| {
        let bar = relative(bar.total()).max(by_wear(figure, 1.0, step.volume));
        Some(bar.max(spread(of)))
    };
    let of_load = sources.lost_load.map(|lost| {
        let load = summary.normal_load.unwrap_or(0.0);
        let lost = relative(bar.total()) * lost.abs() / load;
        let error = lost.max(by_wear(|s| s.normal_load, 0.0, step.volume));
        error + PRELOAD_TOLERANCE
    });
    let (mut meanwhile, own) = (step.volume, error_of_energy(cycle, in_force));
    let mut of_vibration = [None; 2];
    let mut of_change = None;
    if let Some(ResponseInForce { response, update }) = in_force {
        // The vibration in force stays from one update to the next.
        let since = volume - last.map_or(0.0, |last| last.update.wear_volume);
        if update.updated {
            meanwhile = since;
        }
        let of_resonance = response.error_resonance_frequency.map(|own| {
            let figure: Figure = |s| s.resonance_frequency;
            let by_wear = by_wear(figure, changed(figure), since);
            let frequency = figure(summary).unwrap_or(0.0);
            of_change = Some(match before {
                Some(_) => by_wear * frequency + left_out(response, sources.unworn_response),
                None => 0.0,
            });
            by_wear + own
        });
        of_vibration = [
            of_resonance,
            followed(|s| s.peak_amplitude, since, response.error_peak_amplitude),
        ];
    }
    let energy = |s: &Summary| s.dissipated_energy;
    let least = relative(error_bar::LEAST_OF_ENERGY * bar.of_contact()) + own;
    let of_energy = match (before.and_then(|b| energy(&b.summary)), energy(summary)) {
        (Some(before), Some(0.0)) if before > 0.0 => ALL,
        _ => followed(energy, meanwhile, own)
            .unwrap_or(0.0)
            .max(least)
            .max(spread(|c| c.difference_dissipated_energy)),
    };
    let bars = Summary {
        error_largest_depth: of_depth(|s| s.largest_depth, |c| c.difference_largest_depth),
        error_depth_99: of_depth(|s| s.depth_99, |c| c.difference_depth_99),
        error_normal_load: of_load,
        error_resonance_change: of_change,
        error_loaded_area: of_contact(
            |s| s.loaded_area_fraction,
            1.0,
            coarse.map(|c| c.difference_loaded_area),
            part(1.0, cells.loaded),
        ),
        error_kn: of_stiffness(|s| s.kn, |c| c.difference_kn),
        error_kt: of_stiffness(|s| s.kt, |c| c.difference_kt),
        error_max_pressure: of_contact(
            |s| s.max_pressure,
            1.0,
            coarse_by(|c| c.difference_max_pressure),
            0.0,
        ),
        error_dissipated_energy: Some(of_energy),
        error_dissipated_energy_absolute: energy(summary).map(|now| match before {
            // In parts of nothing no bar says anything; what the iteration before may have had does.
            Some(before) if now == 0.0 => {
                let earlier = before.summary.error_dissipated_energy_absolute;
                let earlier = earlier.unwrap_or(0.0);
                earlier.max(energy(&before.summary).unwrap_or(0.0))
            }
            _ => of_energy * now,
        }),
        error_resonance_frequency: of_vibration[0],
        error_peak_amplitude: of_vibration[1],
        error_cycles: Some(relative(bar.cycles)),
        error_harmonics: in_force.map(|_| relative(bar.harmonics)),
        error_grid: of_grid,
        error_closure: in_force.map(|_| relative(bar.closure)),
        error_wear: Some(relative(before.map_or(0.0, |b| b.error) + estimate)),
        error_wear_volume: Some(relative(bar.total())),
        error_wear_field: Some(relative(field)),
        error_propagation: coarse.map(|_| relative(bar.propagation)),
        ..summary.clone()
    };
    *summary = bars;
}

/// What harmonics and samples leave out of the change of the resonance from one response to another \[Hz\]: the difference of what they are expected to
/// leave out, twice, where both have the same harmonics; else what either leaves out at most.
fn left_out(now: &typed::DynamicResponse, unworn: Option<&typed::DynamicResponse>) -> f64 {
    let frequency = |of: &typed::DynamicResponse| of.resonance_frequency.unwrap_or(0.0);
    let at_most =
        |of: &typed::DynamicResponse| of.error_resonance_frequency.unwrap_or(ALL) * frequency(of);
    let Some(unworn) = unworn else {
        return at_most(now);
    };
    let expected = |of: &typed::DynamicResponse| {
        let change = of.expected_resonance_change?;
        (change != UNKNOWN_CHANGE).then(|| change * frequency(of))
    };
    let all = at_most(now) + at_most(unworn);
    match expected(now).zip(expected(unworn)) {
        Some((now_expected, then)) if now.highest_harmonic == unworn.highest_harmonic => {
            (OF_DIFFERENCE * (now_expected - then).abs()).min(all)
        }
        _ => all,
    }
}

/// Times the difference of two estimates that it may be wrong by.
const OF_DIFFERENCE: f64 = 2.0;

/// Relative error of the energy of a cycle by itself, whatever has worn before: by its solves and samples, by harmonics that the vibration leaves out, and by
/// what the friction of its contact elements differs by.
pub(super) fn error_of_energy(
    cycle: &typed::FrettingCycle,
    in_force: Option<&ResponseInForce>,
) -> f64 {
    let Some(ResponseInForce { response, .. }) = in_force else {
        return cycle.error_cycle;
    };
    let energy = cycle.dissipated_energy;
    let closure = closure((energy - friction(response)).abs(), energy);
    cycle.error_cycle + response.error_friction_energy + closure
}

/// What the wear step makes wrong by its own estimate, or by the change of its rates \[m³\].
fn estimate(wear: &Wear, sources: &Sources) -> f64 {
    let step = sources.step;
    match sources.before {
        Some(before) if !wear.scheme.estimates_error() => {
            let energies = [&before.dissipation[..], sources.dissipation];
            let cycles = step.n_cycles as u64;
            error_bar::of_constant_rate(energies, wear.law(), cycles, sources.cell_area)
        }
        _ => step.error,
    }
}

/// What the vibration has worn more or less than one that is found anew on every surface would have \[m³\]. At each update, and at the end, the whole
/// difference between the energies of a cycle under the motion before and under the one found counts for all that was worn since the last update,
/// although that motion was true at its beginning; so does what the update leaves between both scales. What is worn since the last update is
/// taken to be wrong by as much as what was worn before that, or by what the fine contact differs from the elements under the same motion.
fn closure_of(sources: &Sources) -> f64 {
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
    let pending = |cycle: &typed::FrettingCycle, since: f64| since * not_yet_known(cycle);
    let at_update = |of: &ResponseInForce| of.update.wear_volume;
    let (Some(last), Some(cycle_before)) = (&before.in_force, &before.cycle) else {
        return before.bar.closure;
    };
    // What an iteration is inherited with counts as worn before its update.
    let settled = before.bar.closure - pending(cycle_before, before.volume - at_update(last));
    let since = volume - at_update(last);
    let of_worn = worn.and_then(|worn| worn.fine_energy);
    let open = match of_worn {
        _ if now.update.updated => since * of_update(cycle),
        Some(energy) => {
            let jump = relative_difference(energy, cycle.dissipated_energy);
            since * (jump + cycle.update_gap.unwrap_or(0.0).abs())
        }
        None => pending(cycle, since),
    };
    settled.max(0.0) + open
}

/// What an update has changed the energy of a cycle by, and leaves between both scales, relative to it.
fn of_update(cycle: &typed::FrettingCycle) -> f64 {
    [cycle.update_jump, cycle.update_gap]
        .map(|part| part.unwrap_or(0.0).abs())
        .iter()
        .sum()
}

/// What the energy of cycles has worn more or less than that of exact ones would have \[m³\]. Where this iteration has found what cycles between two ends miss,
/// all that was worn since this was last found is wrong by it.
fn of_cycles(sources: &Sources) -> f64 {
    let now = sources.cycle;
    let Some(before) = sources.before else {
        return sources.step.volume * now.error_cycle;
    };
    let found_at = |cycle: &typed::FrettingCycle| cycle.check_volume.unwrap_or(0.0);
    match &before.cycle {
        Some(cycle) if found_at(now) != found_at(cycle) => {
            let unknown = (before.volume - found_at(cycle)) * cycle.error_cycle;
            let settled = (before.bar.cycles - unknown).max(0.0);
            settled + (sources.volume - found_at(cycle)) * now.error_cycle
        }
        _ => before.bar.cycles + sources.step.volume * now.error_cycle,
    }
}

/// Relative error of the wear since the last update, of which the next one will say more.
fn not_yet_known(cycle: &typed::FrettingCycle) -> f64 {
    let of_elements = cycle.elements_energy.unwrap_or(cycle.dissipated_energy);
    of_update(cycle).max(relative_difference(of_elements, cycle.dissipated_energy))
}

/// How far an energy is off another one, relative to this; nothing where both are nothing.
fn relative_difference(energy: f64, of: f64) -> f64 {
    closure((energy - of).abs(), of)
}

/// What friction takes in the elements \[J\]; nothing where that is rounding of what the exciter supplies.
pub(super) fn friction(response: &typed::DynamicResponse) -> f64 {
    let energy = response.friction_energy;
    match energy.abs() > ROUNDING * response.input_energy.abs() {
        true => energy,
        false => 0.0,
    }
}

/// Part of the exciter's energy below which friction is rounding: its sums have some thousands of terms.
const ROUNDING: f64 = 1e-11;

/// An energy that is `wrong` of the `energy` of a cycle \[J\], relative to it.
fn closure(wrong: f64, energy: f64) -> f64 {
    if wrong <= 0.0 {
        0.0
    } else if energy > 0.0 {
        wrong / energy
    } else {
        ALL
    }
}
