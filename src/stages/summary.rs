//! One row on the state of the run.

use super::RunError;
use super::context::Context;
use super::error_bars::{Sources, error_bars};
use super::fretting_cycle::Cycle;
use super::state::Committed;
use super::static_contact::StaticContact;
use super::vibrating::Driven;
use super::wear::Worn;
use crate::surface::statistics::roughness;
use crate::tables::typed;

/// Keys that cannot alter what is already computed: where a run stops and what it keeps.
pub const FREE_KEYS: [&str; 4] = [
    "wear.cycles",
    "wear.volume",
    "output.keep.*",
    "output.response_at.*",
];

/// Keys that a run shares with the one it begins from: wear belongs to the cells and heights that wore.
/// With a structure these are the cells of its contact elements.
pub const INHERITED_KEYS: [&str; 3] = ["joint.*", "surface.*", "structure.kind"];

/// Pressure above this part of the largest counts as load: area by p > 0 alone hangs on cells that carry next to nothing.
const LOADED: f64 = 1e-3;

/// The summary of an iteration; `before` is the one it was worn from.
pub fn summary(
    context: &Context,
    before: Option<&Committed>,
    worn: &Worn,
    contact: &StaticContact,
    driven: Option<&Driven>,
    cycle: Option<&Cycle>,
) -> Result<typed::Summary, RunError> {
    let joint = &context.joint;
    let pressure = &contact.solution.pressure;
    let kept = joint.patch.cells() as f64;
    let largest = pressure.iter().fold(0.0f64, |m, p| m.max(*p));
    let count = |above: f64| pressure.iter().filter(|&&p| p > above).count() as f64;
    let fraction = |above: f64| count(above) / kept;
    let height: Vec<f64> = joint
        .height
        .iter()
        .zip(&worn.wear)
        .map(|(h, w)| h - w)
        .collect();
    let shape = roughness(&joint.patch, &height)?;
    let rotation = context.rotation(&contact.solution);
    let moment = contact.solution.moment;
    let mut summary = typed::Summary {
        contact_area: Some(count(0.0) * joint.patch.grid.cell_area()),
        contact_area_fraction: Some(fraction(0.0)),
        loaded_area_fraction: Some(fraction(LOADED * largest)),
        max_pressure: Some(largest),
        normal_load: Some(contact.load),
        approach: Some(contact.solution.approach),
        rotation_x: rotation.map(|r| r[0]),
        rotation_y: rotation.map(|r| r[1]),
        moment_x: Some(moment[0]),
        moment_y: Some(moment[1]),
        kn: Some(contact.kn),
        kt: Some(contact.kt),
        mean_height: Some(shape.mean),
        rq: Some(shape.rq),
        sk: Some(shape.sk),
        ku: Some(shape.ku),
        normal_iterations: Some(contact.solution.iterations as i64),
        error_normal: Some(contact.solution.error),
        fft_pairs: contact.fft_pairs + worn.fft_pairs,
        ..typed::Summary::default()
    };
    if let Some(driven) = driven {
        summary.updated = Some(driven.model.updated);
        summary.resonance_frequency = Some(driven.shaken.resonance_frequency);
        summary.peak_frequency = Some(driven.shaken.peak_frequency);
        summary.peak_amplitude = Some(driven.shaken.peak_amplitude);
    }
    if let Some(friction) = &contact.friction {
        summary.tangential_iterations = Some(friction.steps as i64);
        summary.error_tangential = Some(friction.error);
    }
    let Some(cycle) = cycle else {
        return Ok(summary);
    };
    summary.fft_pairs += cycle.fft_pairs;
    summary.dissipated_energy = Some(cycle.solution.dissipation);
    summary.tangential_iterations = Some(cycle.solution.steps as i64);
    summary.error_tangential = Some(cycle.solution.error);
    summary.error_cycle = Some(cycle.solution.relative_error());
    if let Some(wear) = &context.inputs.recipe.wear {
        let volume = before.map_or(0.0, |b| b.volume) + worn.volume;
        // A run that began from another may wear at another coefficient than it.
        let energy = before.map_or(0.0, |b| b.energy) + worn.volume / wear.coefficient;
        let cycles = before.map_or(0, |b| b.cycles) + worn.n_cycles;
        summary.cycles = Some(cycles as i64);
        summary.n_cycles = Some(worn.n_cycles as i64);
        summary.wear_volume = Some(volume);
        summary.wear_rate = Some(wear.coefficient * cycle.solution.dissipation);
        summary.dissipated_energy_total = Some(energy);
        let sources = Sources {
            before,
            worn,
            driven,
            cycle,
            volume,
        };
        error_bars(context, wear, &sources, &mut summary);
    }
    Ok(summary)
}
