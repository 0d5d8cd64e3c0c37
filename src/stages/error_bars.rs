//! The error bars of a worn state.

use super::context::Context;
use super::fretting_cycle::Cycle;
use super::state::Committed;
use super::vibrating::{Driven, Shaken};
use super::wear::Worn;
use crate::recipe::Wear;
use crate::tables::typed::Summary;
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

/// Adds the error bars to a summary that has its figures: of the volume, of figures of the contact, and of those of the vibration.
pub fn error_bars(context: &Context, wear: &Wear, sources: &Sources, summary: &mut Summary) {
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
    // The bar of a figure of this and of the iteration before, which what was inherited may not have had: by the volume worn while the
    // figure changed, and by an error that is in it by itself, not through wear.
    let followed = |figure: fn(&Summary) -> Option<f64>, meanwhile: f64, own: f64| {
        let now = figure(summary).unwrap_or(0.0);
        let earlier = before.and_then(|b| figure(&b.summary));
        let ends = [earlier.unwrap_or(now), now];
        Some(error_bar::of_figure(ends, bar, meanwhile, volume) + own)
    };
    let of_cycle = cycle.solution.relative_error();
    let (mut meanwhile, mut own) = (worn.volume, of_cycle);
    let mut of_vibration = [None; 2];
    if let Some(driven) = driven {
        let (shaken, errors) = (&driven.shaken, &driven.shaken.truncation);
        // The vibration in force stays from one update to the next.
        let since = volume - last.map_or(0.0, |last| last.model.reference.wear_volume);
        if driven.model.updated {
            meanwhile = since;
        }
        own = of_cycle + errors.friction_energy + closure(shaken, cycle.solution.dissipation);
        of_vibration = [
            followed(|s| s.resonance_frequency, since, errors.frequency),
            followed(|s| s.peak_amplitude, since, errors.amplitude),
        ];
    }
    let bars = Summary {
        error_loaded_area: followed(|s| s.loaded_area_fraction, worn.volume, 0.0),
        error_kn: followed(|s| s.kn, worn.volume, 0.0),
        error_kt: followed(|s| s.kt, worn.volume, 0.0),
        error_dissipated_energy: followed(|s| s.dissipated_energy, meanwhile, own),
        error_resonance_frequency: of_vibration[0],
        error_peak_amplitude: of_vibration[1],
        error_harmonics: driven.map(|_| relative(bar.harmonics)),
        error_closure: driven.map(|_| relative(bar.closure)),
        error_wear: Some(relative(before.map_or(0.0, |b| b.error) + estimate)),
        error_wear_volume: Some(relative(bar.total())),
        ..summary.clone()
    };
    *summary = bars;
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
