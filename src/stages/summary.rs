//! One row of results per iteration.

use super::RunError;
use super::declaration::Declaration;
use super::error_bars::{
    Cells, PreviousIteration, ResponseInForce, Sources, UNKNOWN, error_bars, error_of_energy,
    friction,
};
use super::solvers::{Solvers, patch_and_height};
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use crate::contact::Boundary;
use crate::contact::area::ContactArea;
use crate::recipe::Part;
use crate::surface::statistics::roughness;
use crate::tables::{TableName, typed};
use crate::wear::coarse::depth_quantile;

/// A cell counts as loaded if the pressure of the cell exceeds `LOADED_PRESSURE` times the largest pressure. The area
/// with p > 0 alone depends on cells that carry almost no load.
pub(super) const LOADED_PRESSURE: f64 = 1e-3;

/// The results of an iteration, with the error bars of a worn state.
pub const DECLARATION: Declaration = Declaration {
    stage: Stage::Summary,
    when: When::Always,
    recipe: &[
        Part::Surface,
        Part::Contact,
        Part::WearLaw,
        Part::ForcedResponse,
    ],
    reads: &[
        TableName::GridTwin,
        TableName::Surface,
        TableName::WearField,
        TableName::WearStep,
        TableName::StaticContact,
        TableName::ContactField,
        TableName::FrettingCycle,
        TableName::CoarseStep,
        TableName::ModelUpdate,
        TableName::ContactElement,
        TableName::DynamicResponse,
        TableName::Frf,
        TableName::WornResponse,
    ],
    before: &[
        TableName::Summary,
        TableName::ContactField,
        TableName::ModelUpdate,
        TableName::DynamicResponse,
        TableName::FrettingCycle,
    ],
    writes: &[TableName::Summary],
    is_due: |_| true,
    shared: false,
    compute,
};

fn compute(reads: &StageInputs, _: &mut Solvers) -> Result<Outputs, RunError> {
    let mut outputs = Outputs::default();
    let summary = match reads.optional_table::<typed::StaticContact>()? {
        Some(contact) => contact_summary(reads, &contact)?,
        None => vibration_summary(reads)?,
    };
    outputs.add_table(&summary)?;
    Ok(outputs)
}

/// Returns the summary of a vibration without a rough contact.
fn vibration_summary(reads: &StageInputs) -> Result<typed::Summary, RunError> {
    let response = reads.optional_table::<typed::DynamicResponse>()?;
    let elements = reads.optional_table::<typed::ContactElement>()?;
    let response_value = |value: fn(&typed::DynamicResponse) -> f64| response.as_ref().map(value);
    let forced = reads.optional_table::<typed::Frf>()?;
    let total = |value: fn(&typed::ContactElement) -> &Vec<f64>| {
        elements
            .as_ref()
            .map(|elements| value(elements).iter().sum())
    };
    Ok(typed::Summary {
        dissipated_energy: response_value(friction),
        resonance_frequency: response.as_ref().and_then(|row| row.resonance_frequency),
        peak_frequency: response_value(|row| row.peak_frequency),
        peak_amplitude: response_value(|row| row.peak_amplitude),
        error_dissipated_energy: response_value(|row| row.error_friction_energy),
        error_dissipated_energy_absolute: response_value(|row| {
            row.error_friction_energy * friction(row)
        }),
        error_resonance_frequency: response
            .as_ref()
            .and_then(|row| row.error_resonance_frequency),
        error_peak_amplitude: response
            .as_ref()
            .map(|row| error_of_peak(row, forced.as_ref())),
        kn: total(|elements| &elements.kn),
        kt: total(|elements| &elements.kt),
        ..typed::Summary::default()
    })
}

/// Returns the relative error of the peak amplitude. The error is at least the amount by which the largest amplitude of
/// the forced response exceeds the peak. An unknown error ([`ALL`] or more) stays unchanged. The size of an unknown
/// error shows if the damping gives a bound.
fn error_of_peak(response: &typed::DynamicResponse, forced: Option<&typed::Frf>) -> f64 {
    let error = response.error_peak_amplitude;
    if error >= UNKNOWN {
        return error;
    }
    let rows = forced.iter().flat_map(|frf| frf.amplitude.iter().flatten());
    let largest = rows.copied().fold(0.0, f64::max);
    let excess = largest / response.peak_amplitude - 1.0;
    if excess.is_finite() {
        error.max(excess)
    } else {
        error
    }
}

fn contact_summary(
    reads: &StageInputs,
    contact: &typed::StaticContact,
) -> Result<typed::Summary, RunError> {
    let (patch, height) = patch_and_height(reads)?;
    let fields: typed::ContactField = reads.table()?;
    let pressure = &fields.pressure;
    let largest = pressure.iter().fold(0.0f64, |m, p| m.max(*p));
    let count = |above: f64| pressure.iter().filter(|&&p| p > above).count() as f64;
    let fraction = |above: f64| count(above) / patch.cells() as f64;
    let on_grid = patch.scatter(pressure);
    let area = ContactArea::new(&patch, is_periodic(reads), |cell| on_grid[cell] > 0.0);
    let wear = reads.optional_table::<typed::WearField>()?;
    let wear = super::contact_state::wear_of(&patch, wear);
    let depths = patch.joint_values(&wear);
    let worn: Vec<f64> = height.iter().zip(&wear).map(|(h, w)| h - w).collect();
    let shape = roughness(&patch, &worn)?;
    let step = reads
        .optional_table::<typed::WearStep>()?
        .unwrap_or_default();
    let mut summary = typed::Summary {
        contact_area: Some(count(0.0) * patch.grid.cell_area()),
        contact_area_fraction: Some(fraction(0.0)),
        corrected_area_fraction: Some(area.corrected / patch.area()),
        error_corrected_area: Some(area.relative_error()),
        loaded_area_fraction: Some(fraction(LOADED_PRESSURE * largest)),
        max_pressure: Some(largest),
        normal_load: Some(contact.normal_load),
        approach: Some(contact.approach),
        rotation_x: contact.rotation_x,
        rotation_y: contact.rotation_y,
        moment_x: Some(contact.moment_x),
        moment_y: Some(contact.moment_y),
        kn: contact.kn,
        kt: contact.kt,
        mean_height: Some(shape.mean),
        rq: Some(shape.rq),
        sk: Some(shape.sk),
        ku: Some(shape.ku),
        normal_iterations: Some(contact.iterations),
        error_normal: Some(contact.error),
        tangential_iterations: contact.tangential_iterations,
        error_tangential: contact.error_tangential,
        fft_pairs: contact.fft_pairs + step.fft_pairs,
        ..typed::Summary::default()
    };
    let in_force = ResponseInForce::of(reads.optional_table()?, reads.optional_table()?);
    if let Some(ResponseInForce { response, update }) = &in_force {
        summary.updated = Some(update.updated);
        summary.resonance_frequency = response.resonance_frequency;
        summary.peak_frequency = Some(response.peak_frequency);
        summary.peak_amplitude = Some(response.peak_amplitude);
    }
    let Some(cycle) = reads.optional_table::<typed::FrettingCycle>()? else {
        return Ok(summary);
    };
    summary.fft_pairs += cycle.fft_pairs;
    summary.dissipated_energy = Some(cycle.dissipated_energy);
    summary.tangential_iterations = Some(cycle.iterations);
    summary.error_tangential = Some(cycle.error_tangential);
    summary.error_cycle = Some(cycle.error_cycle);
    let Some(wear) = &reads.recipe.wear else {
        let error = error_of_energy(&cycle, in_force.as_ref());
        let response = in_force.as_ref().map(|in_force| &in_force.response);
        summary.error_dissipated_energy = Some(error);
        summary.error_dissipated_energy_absolute = Some(error * cycle.dissipated_energy);
        summary.error_resonance_frequency = response.and_then(|row| row.error_resonance_frequency);
        summary.error_peak_amplitude = response.map(|row| row.error_peak_amplitude);
        return Ok(summary);
    };
    let law = wear.law();
    let before = PreviousIteration::of(reads)?;
    let before = before.as_ref();
    let volume = before.map_or(0.0, |b| b.volume) + step.volume;
    // A run that began from another run may use another wear coefficient.
    let energy = before.map_or(0.0, |b| b.energy) + law.energy(step.volume);
    let cycles = before.map_or(0, |b| b.cycles) + step.n_cycles;
    summary.cycles = Some(cycles);
    summary.n_cycles = Some(step.n_cycles);
    summary.wear_volume = Some(volume);
    summary.largest_depth = Some(depth_quantile(depths.clone(), 1.0));
    summary.depth_99 = Some(depth_quantile(depths, 0.99));
    summary.wear_rate = Some(law.volume(cycle.dissipated_energy));
    summary.dissipated_energy_total = Some(energy);
    let coarse = reads.optional_table::<typed::CoarseStep>()?;
    summary.fft_pairs += coarse.as_ref().map_or(0.0, |coarse| coarse.fft_pairs);
    let worn = reads.optional_table::<typed::WornResponse>()?;
    let twin = reads.optional_table::<typed::GridTwin>()?;
    let unworn = reads.unworn::<typed::Summary>()?;
    let falling = reads
        .recipe
        .contact()
        .filter(|recipe_contact| recipe_contact.load_falls());
    let lost_load = falling.map(|recipe_contact| {
        let load = match recipe_contact.conditions.approach {
            Some(_) => unworn.as_ref().and_then(|unworn| unworn.normal_load),
            None => Some(recipe_contact.conditions.normal_load),
        };
        load.map_or(0.0, |load| load - contact.normal_load)
    });
    let unworn_response = reads.unworn::<typed::DynamicResponse>()?;
    let cells = Cells {
        loaded: count(LOADED_PRESSURE * largest),
        touching: count(0.0),
        undecided: contact.undecided_cells as f64,
    };
    let sources = Sources {
        before,
        step: &step,
        in_force: in_force.as_ref(),
        unworn: unworn.as_ref(),
        unworn_response: unworn_response.as_ref(),
        lost_load,
        cycle: &cycle,
        // For other iterations, the next update gives a better estimate.
        worn: worn.as_ref().filter(|_| reads.forced_response_due),
        coarse: coarse.as_ref(),
        twin: twin.as_ref(),
        cells,
        dissipation: fields.dissipation.as_deref().unwrap_or_default(),
        cell_area: patch.grid.cell_area(),
        volume,
    };
    error_bars(wear, &sources, &mut summary);
    Ok(summary)
}

pub(super) fn is_periodic(reads: &StageInputs) -> bool {
    let contact = reads.recipe.contact();
    contact.is_some_and(|contact| contact.conditions.boundary == Boundary::Periodic)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_a_peak_holds_the_rows_of_its_forced_response() {
        let forced = typed::Frf {
            amplitude: vec![Some(1.0), None, Some(2.5)],
            ..typed::Frf::default()
        };
        let error = |peak_amplitude, error_peak_amplitude| {
            let response = typed::DynamicResponse {
                peak_amplitude,
                error_peak_amplitude,
                ..typed::DynamicResponse::default()
            };
            error_of_peak(&response, Some(&forced))
        };
        assert_eq!(error(2.0, 0.01), 0.25);
        assert_eq!(error(3.0, 0.01), 0.01);
        // An unknown error of the peak amplitude has the value 1, and the forced response does not change the value.
        assert_eq!(error(2.0, 1.0), 1.0);
        assert_eq!(error(0.5, 1.0), 1.0);
        assert_eq!(error(0.0, 0.01), 0.01);
    }
}
