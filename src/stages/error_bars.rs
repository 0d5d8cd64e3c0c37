//! The error bars of a worn state.

use super::context::Context;
use super::fretting_cycle::Cycle;
use super::state::Committed;
use super::vibrating::{Driven, Shaken};
use super::wear::Worn;
use crate::scene::Wear;
use crate::tables::TableBuilder;
use crate::wear::error_bar::{self, VolumeError};

/// Relative error of what is 0 and should perhaps not be.
const ALL: f64 = 1.0;

/// What the error bars of an iteration follow from.
pub struct Sources<'a> {
    /// The iteration that it was worn from.
    pub before: Option<&'a Committed>,
    pub worn: &'a Worn,
    pub driven: Option<&'a Driven>,
    pub cycle: &'a Cycle,
    /// Volume worn in all iterations \[m³\].
    pub volume: f64,
}

/// A figure of the summary and its bar.
struct Figure {
    column: &'static str,
    bar: &'static str,
    value: f64,
    /// Volume worn while it changed \[m³\].
    meanwhile: f64,
    /// Relative error that is in it by itself, not through wear: by the vibration, or the cycle's solves and samples.
    own: f64,
}

/// Adds the error bars to a summary: of the volume, of figures of the contact (`loaded area, kn, kt`), and of those of the vibration.
pub fn error_bars(
    context: &Context,
    table: TableBuilder,
    wear: &Wear,
    sources: &Sources,
    [loaded_area, kn, kt]: [f64; 3],
) -> TableBuilder {
    let &Sources {
        before,
        worn,
        driven,
        cycle,
        volume,
    } = sources;
    let relative = |error: f64| match volume {
        volume if volume > 0.0 => error / volume,
        _ if error > 0.0 => ALL,
        _ => 0.0,
    };
    let estimate = estimate(context, wear, sources);
    // The vibration that the step was worn under is that of the iteration before.
    let last = before.and_then(|b| b.driven.as_ref());
    let wrong = |of: fn(&Shaken) -> f64| last.map_or(0.0, |last| of(&last.shaken));
    let bar = before.map_or(VolumeError::default(), |b| b.bar)
        + VolumeError {
            steps: error_bar::of_step(estimate, worn.volume, cycle.solution.relative_error()),
            harmonics: worn.volume * wrong(|s| s.truncation.friction_energy),
            closure: wear.coefficient * worn.n_cycles as f64 * wrong(|s| s.closure_energy),
        };
    let of_contact = |column, bar, value| Figure {
        column,
        bar,
        value,
        meanwhile: worn.volume,
        own: 0.0,
    };
    let energy = Figure {
        own: cycle.solution.relative_error(),
        ..of_contact(
            "dissipated_energy",
            "error_dissipated_energy",
            cycle.solution.dissipation,
        )
    };
    let mut figures = vec![
        of_contact("loaded_area_fraction", "error_loaded_area", loaded_area),
        of_contact("kn", "error_kn", kn),
        of_contact("kt", "error_kt", kt),
    ];
    let mut table = table;
    if let Some(driven) = driven {
        let (shaken, errors) = (&driven.shaken, &driven.shaken.truncation);
        // The vibration in force stays from one update to the next.
        let since = volume - last.map_or(0.0, |last| last.model.reference.wear_volume);
        let of_vibration = |column, bar, value, error| Figure {
            meanwhile: since,
            own: error,
            ..of_contact(column, bar, value)
        };
        figures.extend([
            Figure {
                meanwhile: if driven.model.updated {
                    since
                } else {
                    worn.volume
                },
                own: energy.own + errors.friction_energy + closure(shaken, energy.value),
                ..energy
            },
            of_vibration(
                "resonance_frequency",
                "error_resonance_frequency",
                shaken.resonance_frequency,
                errors.frequency,
            ),
            of_vibration(
                "peak_amplitude",
                "error_peak_amplitude",
                shaken.peak_amplitude,
                errors.amplitude,
            ),
        ]);
        table = table
            .column("error_harmonics", vec![relative(bar.harmonics)])
            .column("error_closure", vec![relative(bar.closure)]);
    } else {
        figures.push(energy);
    }
    for figure in figures {
        // What was inherited may not have had it.
        let earlier = before.and_then(|b| b.summary.f64(figure.column).ok());
        let ends = [
            earlier.map_or(figure.value, |earlier| earlier[0]),
            figure.value,
        ];
        let followed = error_bar::of_figure(ends, bar, figure.meanwhile, volume);
        table = table.column(figure.bar, vec![followed + figure.own]);
    }
    let steps = before.map_or(0.0, |b| b.error) + estimate;
    table
        .column("error_wear", vec![relative(steps)])
        .column("error_wear_volume", vec![relative(bar.total())])
}

/// What the wear step makes wrong by its own estimate, or by the change of its rates \[m³\].
fn estimate(context: &Context, wear: &Wear, sources: &Sources) -> f64 {
    let (worn, cycle) = (sources.worn, &sources.cycle.solution);
    match sources.before {
        Some(before) if !wear.scheme.estimates_error() => {
            let energies = [&before.worn.cycle.energy[..], &cycle.energy];
            let cell_area = context.joint.patch.grid.cell_area();
            error_bar::of_constant_rate(energies, wear.coefficient, worn.n_cycles, cell_area)
        }
        _ => worn.error,
    }
}

/// What mean displacement and total load make wrong in the `energy` of a cycle \[J\], relative to it.
fn closure(shaken: &Shaken, energy: f64) -> f64 {
    let wrong = shaken.closure_energy;
    if wrong <= 0.0 {
        0.0
    } else if energy > 0.0 {
        wrong / energy
    } else {
        ALL
    }
}
