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
use crate::tables::{Table, TableName};

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
) -> Result<Table, RunError> {
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
    let mut fft_pairs = contact.fft_pairs + worn.fft_pairs;
    let rotation = context.rotation(&contact.solution);
    let mut table = Table::builder(TableName::Summary)
        .column(
            "contact_area",
            vec![count(0.0) * joint.patch.grid.cell_area()],
        )
        .column("contact_area_fraction", vec![fraction(0.0)])
        .column("loaded_area_fraction", vec![fraction(LOADED * largest)])
        .column("max_pressure", vec![largest])
        .column("normal_load", vec![contact.load])
        .column("approach", vec![contact.solution.approach])
        .maybe("rotation_x", rotation.map(|r| vec![r[0]]))
        .maybe("rotation_y", rotation.map(|r| vec![r[1]]))
        .column("moment_x", vec![contact.solution.moment[0]])
        .column("moment_y", vec![contact.solution.moment[1]])
        .column("kn", vec![contact.kn])
        .column("kt", vec![contact.kt])
        .column("mean_height", vec![shape.mean])
        .column("rq", vec![shape.rq])
        .column("sk", vec![shape.sk])
        .column("ku", vec![shape.ku])
        .column(
            "normal_iterations",
            vec![contact.solution.iterations as i64],
        )
        .column("error_normal", vec![contact.solution.error]);
    if let Some(driven) = driven {
        table = table
            .column("updated", vec![driven.model.updated])
            .column(
                "resonance_frequency",
                vec![driven.shaken.resonance_frequency],
            )
            .column("peak_frequency", vec![driven.shaken.peak_frequency])
            .column("peak_amplitude", vec![driven.shaken.peak_amplitude]);
    }
    if let Some(friction) = &contact.friction {
        table = table
            .column("tangential_iterations", vec![friction.steps as i64])
            .column("error_tangential", vec![friction.error]);
    }
    if let Some(cycle) = cycle {
        fft_pairs += cycle.fft_pairs;
        table = table
            .column("dissipated_energy", vec![cycle.solution.dissipation])
            .column("tangential_iterations", vec![cycle.solution.steps as i64])
            .column("error_tangential", vec![cycle.solution.error])
            .column("error_cycle", vec![cycle.solution.relative_error()]);
    }
    if let (Some(wear), Some(cycle)) = (&context.inputs.scene.wear, cycle) {
        let volume = before.map_or(0.0, |b| b.volume) + worn.volume;
        // A run that began from another may wear at another coefficient than it.
        let energy = before.map_or(0.0, |b| b.energy) + worn.volume / wear.coefficient;
        let sources = Sources {
            before,
            worn,
            driven,
            cycle,
            volume,
        };
        let of_contact = [fraction(LOADED * largest), contact.kn, contact.kt];
        table = error_bars(context, table, wear, &sources, of_contact)
            .column(
                "cycles",
                vec![(before.map_or(0, |b| b.cycles) + worn.n_cycles) as i64],
            )
            .column("n_cycles", vec![worn.n_cycles as i64])
            .column("wear_volume", vec![volume])
            .column(
                "wear_rate",
                vec![wear.coefficient * cycle.solution.dissipation],
            )
            .column("dissipated_energy_total", vec![energy]);
    }
    Ok(table.column("fft_pairs", vec![fft_pairs]).build()?)
}
