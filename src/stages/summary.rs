//! One row on the state of the run.

use super::RunError;
use super::context::Context;
use super::fretting_cycle::Cycle;
use super::state::Committed;
use super::static_contact::StaticContact;
use super::vibrating::Driven;
use super::wear::Worn;
use crate::surface::statistics::roughness;
use crate::tables::{Table, TableName};
use crate::wear::error_bar;

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
            .column("error_tangential", vec![cycle.solution.error]);
    }
    if let (Some(wear), Some(cycle)) = (&context.inputs.scene.wear, cycle) {
        let volume = before.map_or(0.0, |b| b.volume) + worn.volume;
        // A run that began from another may wear at another coefficient than it.
        let energy = before.map_or(0.0, |b| b.energy) + worn.volume / wear.coefficient;
        let estimate = match before {
            Some(before) if !wear.scheme.estimates_error() => {
                let energies = [&before.worn.cycle.energy[..], &cycle.solution.energy];
                let (coefficient, cell_area) = (wear.coefficient, joint.patch.grid.cell_area());
                error_bar::of_constant_rate(energies, coefficient, worn.n_cycles, cell_area)
            }
            _ => worn.error,
        };
        let error = before.map_or(0.0, |b| b.error) + estimate;
        let bar = before.map_or(0.0, |b| b.bar)
            + error_bar::of_step(estimate, worn.volume, cycle.solution.error);
        let relative = |error: f64| if volume > 0.0 { error / volume } else { 0.0 };
        // Each with the volume that was worn while it changed: the vibration in force stays from one update to the next.
        let last = before.and_then(|b| b.driven.as_ref());
        let since = volume - last.map_or(0.0, |last| last.model.reference.wear_volume);
        let jumps = driven.is_some_and(|driven| driven.model.updated);
        let mut figures = vec![
            (
                "loaded_area_fraction",
                "error_loaded_area",
                fraction(LOADED * largest),
                worn.volume,
            ),
            ("kn", "error_kn", contact.kn, worn.volume),
            ("kt", "error_kt", contact.kt, worn.volume),
            (
                "dissipated_energy",
                "error_dissipated_energy",
                cycle.solution.dissipation,
                if jumps { since } else { worn.volume },
            ),
        ];
        if let Some(driven) = driven {
            let shaken = &driven.shaken;
            figures.extend([
                (
                    "resonance_frequency",
                    "error_resonance_frequency",
                    shaken.resonance_frequency,
                    since,
                ),
                (
                    "peak_amplitude",
                    "error_peak_amplitude",
                    shaken.peak_amplitude,
                    since,
                ),
            ]);
        }
        for (figure, name, value, meanwhile) in figures {
            // What was inherited may not have had it.
            let earlier = before.and_then(|b| b.summary.f64(figure).ok());
            let ends = [earlier.map_or(value, |earlier| earlier[0]), value];
            let error = error_bar::of_figure(ends, bar, meanwhile, volume);
            table = table.column(name, vec![error]);
        }
        table = table
            .column("error_wear_volume", vec![relative(bar)])
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
            .column("dissipated_energy_total", vec![energy])
            .column("error_wear", vec![relative(error)]);
    }
    Ok(table.column("fft_pairs", vec![fft_pairs]).build()?)
}
