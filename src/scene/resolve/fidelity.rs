//! `[fidelity]`: how exactly things are computed.

use super::Result;
use crate::dynamics::vibration::samples_of;
use crate::recipe::{FEWEST_CELLS, Tolerances};
use crate::scene::keys::{cycles::HISTORY, dynamics::HARMONICS, fidelity::*};
use crate::scene::reader::Reader;
use crate::scene::{Fidelity, Preset, Scene, Structure};

/// As many steps a cycle as make an error bar of a tenth of `error`, by the 2 % that 32 make on an orbit.
fn steps_for(error: f64) -> usize {
    let steps = 32.0 * (0.02 / (0.1 * error)).sqrt();
    ((steps / 16.0).ceil() * 16.0).clamp(32.0, 1024.0) as usize
}

/// Bounds on the normal tolerance: rounding, and what kn and contact area still make sense with.
const NORMAL: (f64, f64) = (1e-10, 1e-5);

/// Part of `fidelity.tolerance` for a tolerance of the cycles, tangential or closing. What wear steps and solves make wrong in the
/// worn volume is to stay within the error asked for, each by how its own error enters the error bar: the bar is twice what the
/// coarse trajectory differs by, up to four times what the steps are allowed (beside a structure three times what they estimate of
/// themselves), and the duality gap of the cycles, to which a tenth is left.
const OF_CYCLES: f64 = 0.1;
/// See [`OF_CYCLES`].
const OF_STEPS: f64 = 0.25;
/// See [`OF_CYCLES`]: a pressure is in error by its tolerance times the peak, which is some hundred times the mean.
const OF_PRESSURE: f64 = 1e-4;

pub(super) fn fidelity(reader: &Reader<'_>) -> Result<Fidelity> {
    let preset = reader.value(&PRESET)?;
    let cycle = reader.optional(&CYCLE, reader.default_of(&CYCLE, preset)?)?;
    let target = reader.get(&ASKED)?;
    let is_history = reader.look(&HISTORY)?.is_some();
    let of_preset = steps_of_history(preset).filter(|_| is_history);
    let steps = target.map(steps_for).or(of_preset);
    let steps_per_cycle = reader.value_or(&STEPS_PER_CYCLE, steps, preset)?;
    if target.is_some() && reader.has(&PRESET) {
        return Err(reader.conflict(
            &ASKED,
            "fidelity.preset sets the same knobs; give one of them",
        ));
    }
    let pressure = target.map(|error| (OF_PRESSURE * error).clamp(NORMAL.0, NORMAL.1));
    let cycles = target.map(|error| OF_CYCLES * error);
    let of_preset = reader.default(&LOAD_STEPS, preset)?;
    let load_steps = reader.look(&LOAD_STEPS)?.unwrap_or(of_preset);
    if load_steps != of_preset {
        // Those of the preset stay out of the record: of alike bodies they mean nothing.
        reader.note(&LOAD_STEPS, load_steps);
    }
    // Of a scene that vibrates they are read where its harmonics are known.
    reader.note(&AFT_SAMPLES, least_samples(reader, target, preset)?);
    Ok(Fidelity {
        preset,
        tolerance: target,
        cycle,
        steps_per_cycle,
        tolerances: Tolerances {
            normal: reader.value_or(&NORMAL_TOLERANCE, pressure, preset)?,
            tangential: reader.value_or(&TANGENTIAL_TOLERANCE, cycles, preset)?,
            cycle: reader.value_or(&CYCLE_TOLERANCE, cycles, preset)?,
        },
        cycle_extrapolation: reader.value_or(&CYCLE_EXTRAPOLATION, None, preset)?,
        load_steps,
        grid_check: reader.value(&GRID_CHECK)?,
    })
}

/// Refuses to look at half of a grid that has none, or where nothing wears.
pub(super) fn check_grid(reader: &Reader<'_>, scene: &Scene) -> Result<()> {
    if !scene.fidelity.grid_check {
        return Ok(());
    }
    let rough = scene.rough().filter(|_| scene.recipe.wear.is_some());
    let reason = if let Some(rough) = rough {
        let grid = rough.patch().grid;
        let cells = [grid.nx, grid.ny];
        if cells.iter().all(|n| n % 2 == 0 && n / 2 >= FEWEST_CELLS) {
            return Ok(());
        }
        format!(
            "half of joint.grid must be whole numbers of {FEWEST_CELLS} cells or more, and it is {} x {}",
            cells[0], cells[1]
        )
    } else {
        "it is about the volume that [wear] takes from a rough [surface]; leave it out".to_owned()
    };
    Err(reader.conflict(&GRID_CHECK, reason))
}

/// The error that a wear step may make, where `[wear]` does not say.
pub(super) fn wear_tolerance(reader: &Reader<'_>, fidelity: &Fidelity) -> Result<f64> {
    let steps = fidelity.tolerance.map(|error| OF_STEPS * error);
    let of_preset =
        wear_tolerance_with_response(fidelity.preset).filter(|_| reader.has("dynamics"));
    match reader.look(&WEAR_TOLERANCE)?.or(steps).or(of_preset) {
        Some(error) => Ok(error),
        None => reader.default(&WEAR_TOLERANCE, fidelity.preset),
    }
}

/// As many as leave a tenth of `error` of amplitude, by what 64 leave.
fn samples_for(error: f64) -> usize {
    let samples = 64.0 * (1e-3 / (0.1 * error)).sqrt();
    ((samples / 32.0).ceil() * 32.0).clamp(32.0, 1024.0) as usize
}

/// Samples of a vibration cycle, unless its harmonics need more or a key says how many.
fn least_samples(reader: &Reader<'_>, error: Option<f64>, preset: Preset) -> Result<usize> {
    match error {
        Some(error) => Ok(samples_for(error)),
        None => reader.default(&AFT_SAMPLES, preset),
    }
}

/// An oscillator has one element: as many times the samples cost nothing.
const OSCILLATOR_SAMPLES: usize = 8;

const WITHOUT_DYNAMICS: &str = "it is about [dynamics], and there is none; leave it out";

/// Part of an asked error that harmonics left out may take of amplitude and dissipation.
const OF_HARMONICS: f64 = 0.5;

/// Refuses what is about a vibration where there is none.
pub(super) fn check_without_vibration(reader: &Reader<'_>) -> Result<()> {
    if reader.look(&HARMONIC_TOLERANCE)?.is_some() {
        return Err(reader.conflict(&HARMONIC_TOLERANCE, WITHOUT_DYNAMICS));
    }
    for key in [AFT_SAMPLES.name, HARMONIC_CORRECTION.name] {
        if reader.has(key) {
            return Err(reader.conflict(key, WITHOUT_DYNAMICS));
        }
    }
    Ok(())
}

/// Error up to which the harmonics of a vibration are extended; none where they are not.
pub(super) fn harmonic_tolerance(
    reader: &Reader<'_>,
    fidelity: &Fidelity,
    is_nonlinear: bool,
) -> Result<Option<f64>> {
    let given = reader.look(&HARMONIC_TOLERANCE)?;
    let conflict = |reason| Err(reader.conflict(&HARMONIC_TOLERANCE, reason));
    if given.is_some() && !is_nonlinear {
        return conflict(
            "without a [contact] the vibration is linear and has no more harmonics; leave it out",
        );
    }
    if given.is_some() && reader.has(&HARMONICS) {
        return conflict("dynamics.harmonics says which there are; give one of them");
    }
    if !is_nonlinear || reader.has(&HARMONICS) {
        return Ok(None);
    }
    let asked = fidelity.tolerance.map(|error| OF_HARMONICS * error);
    let of_preset = reader.default_of(&HARMONIC_TOLERANCE, fidelity.preset)?;
    let with_wear = harmonic_tolerance_with_wear(fidelity.preset).filter(|_| reader.has("wear"));
    let tolerance = given.or(asked).or(with_wear).or(of_preset);
    Ok(tolerance.map(|tolerance| reader.note(&HARMONIC_TOLERANCE, tolerance)))
}

/// Whether the response with more harmonics drives the wear.
pub(super) fn harmonic_correction(
    reader: &Reader<'_>,
    fidelity: &Fidelity,
    is_nonlinear: bool,
) -> Result<bool> {
    if is_nonlinear && reader.has("wear") {
        return reader.value_or(&HARMONIC_CORRECTION, None, fidelity.preset);
    }
    if reader.look(&HARMONIC_CORRECTION)? == Some(true) {
        return Err(reader.conflict(
            &HARMONIC_CORRECTION,
            "it is about the wear of a vibrating joint, and there is none; leave it out",
        ));
    }
    Ok(false)
}

/// Samples of a vibration cycle, of which its highest harmonic needs some.
pub(super) fn samples(
    reader: &Reader<'_>,
    fidelity: &Fidelity,
    structure: &Structure,
    highest: u32,
) -> Result<usize> {
    let reason = format!(": more than twice the highest harmonic, {highest}");
    let times = match structure.is_oscillator() {
        true => OSCILLATOR_SAMPLES,
        false => 1,
    };
    let least = least_samples(reader, fidelity.tolerance, fidelity.preset)?;
    let samples = reader
        .even_from(&AFT_SAMPLES, 2 * u64::from(highest) + 2, &reason)?
        .unwrap_or((times * least).max(samples_of(highest)));
    Ok(reader.note(&AFT_SAMPLES, samples))
}
