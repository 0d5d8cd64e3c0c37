//! Resolves `[fidelity]`: the accuracy of the computation.

use super::Result;
use crate::dynamics::vibration::samples_of;
use crate::recipe::{FEWEST_CELLS, Tolerances};
use crate::scene::keys::{cycles::HISTORY, dynamics::HARMONICS, fidelity::*};
use crate::scene::reader::Reader;
use crate::scene::{Fidelity, Preset, Scene, Structure};

/// Returns the steps per cycle for an error bar of a tenth of `error`. On an orbit 32 steps make an error of 2 %.
fn steps_for(error: f64) -> usize {
    let steps = 32.0 * (0.02 / (0.1 * error)).sqrt();
    ((steps / 16.0).ceil() * 16.0).clamp(32.0, 1024.0) as usize
}

/// Bounds of the normal tolerance. The lower bound is the rounding error, and the upper bound is the accuracy that kn
/// and the contact area need.
const NORMAL: (f64, f64) = (1e-10, 1e-5);

/// Tolerance of the cycles, tangential and closing, as a fraction of `fidelity.tolerance`. The errors of wear steps and
/// solves must keep the worn volume within the requested error. The factors follow from the error bar of the worn
/// volume. The error bar is twice the difference from the coarse trajectory, plus the duality gap of the cycles. The
/// difference from the coarse trajectory is at most four times the step tolerance. With a structure, the error bar
/// contains three times the estimated step errors in place of twice the difference. The cycles may cause a tenth of the
/// requested error.
const OF_CYCLES: f64 = 0.1;
/// Tolerance of the wear steps, see [`OF_CYCLES`].
const OF_STEPS: f64 = 0.25;
/// Normal tolerance, see [`OF_CYCLES`]. The error of a pressure is the normal tolerance times the peak pressure. The
/// peak pressure is about a hundred times the mean pressure.
const OF_PRESSURE: f64 = 1e-4;

pub(super) fn fidelity(reader: &Reader<'_>) -> Result<Fidelity> {
    let preset = reader.value(&PRESET)?;
    let cycle = reader.optional(&CYCLE, reader.default_of(&CYCLE, preset)?)?;
    let target = reader.get(&ASKED)?;
    let is_history = reader.peek(&HISTORY)?.is_some();
    let preset_steps = steps_of_history(preset).filter(|_| is_history);
    let steps = target.map(steps_for).or(preset_steps);
    let steps_per_cycle = reader.value_or(&STEPS_PER_CYCLE, steps, preset)?;
    if target.is_some() && reader.has(&PRESET) {
        return Err(reader.conflict(
            &ASKED,
            "fidelity.preset sets the same keys; give one of them",
        ));
    }
    let pressure = target.map(|error| (OF_PRESSURE * error).clamp(NORMAL.0, NORMAL.1));
    let cycles = target.map(|error| OF_CYCLES * error);
    let preset_load_steps = reader.default(&LOAD_STEPS, preset)?;
    let load_steps = reader.peek(&LOAD_STEPS)?.unwrap_or(preset_load_steps);
    if load_steps != preset_load_steps {
        // The default is not recorded, because it has no effect for bodies of the same material.
        reader.note(&LOAD_STEPS, load_steps);
    }
    // If the joint vibrates, the program replaces the recorded number of samples once the harmonics are known.
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

/// Rejects the grid check if half of the grid is not possible, or if nothing wears.
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
            "half of joint.grid must be whole numbers of {FEWEST_CELLS} cells or more, but joint.grid is {} x {}",
            cells[0], cells[1]
        )
    } else {
        "it applies to the worn volume of a rough [surface] with [wear]; remove it".to_owned()
    };
    Err(reader.conflict(&GRID_CHECK, reason))
}

/// Returns the relative error allowed per wear step, if `[wear]` does not give it.
pub(super) fn wear_tolerance(reader: &Reader<'_>, fidelity: &Fidelity) -> Result<f64> {
    let steps = fidelity.tolerance.map(|error| OF_STEPS * error);
    let with_response =
        wear_tolerance_with_response(fidelity.preset).filter(|_| reader.has("dynamics"));
    match reader.peek(&WEAR_TOLERANCE)?.or(steps).or(with_response) {
        Some(error) => Ok(error),
        None => reader.default(&WEAR_TOLERANCE, fidelity.preset),
    }
}

/// Returns the samples for an error of a tenth of `error` of the amplitude. With 64 samples the error is 1e-3.
fn samples_for(error: f64) -> usize {
    let samples = 64.0 * (1e-3 / (0.1 * error)).sqrt();
    ((samples / 32.0).ceil() * 32.0).clamp(32.0, 1024.0) as usize
}

/// Default samples of a vibration cycle, which its harmonics or a key may increase.
fn least_samples(reader: &Reader<'_>, error: Option<f64>, preset: Preset) -> Result<usize> {
    match error {
        Some(error) => Ok(samples_for(error)),
        None => reader.default(&AFT_SAMPLES, preset),
    }
}

/// Factor for the number of samples of an oscillator. An oscillator has a single contact element, so more samples cost
/// nothing.
const OSCILLATOR_SAMPLES: usize = 8;

const WITHOUT_DYNAMICS: &str = "it applies to [dynamics], but there is none; remove it";

/// Fraction of a requested error that truncated harmonics may have in amplitude and dissipation.
const OF_HARMONICS: f64 = 0.5;

/// Rejects keys about a vibration if the scene has no vibration.
pub(super) fn check_without_vibration(reader: &Reader<'_>) -> Result<()> {
    if reader.peek(&HARMONIC_TOLERANCE)?.is_some() {
        return Err(reader.conflict(&HARMONIC_TOLERANCE, WITHOUT_DYNAMICS));
    }
    for key in [AFT_SAMPLES.name, HARMONIC_CORRECTION.name] {
        if reader.has(key) {
            return Err(reader.conflict(key, WITHOUT_DYNAMICS));
        }
    }
    Ok(())
}

/// Returns the truncation error up to which harmonics are added, `None` if they are fixed.
pub(super) fn harmonic_tolerance(
    reader: &Reader<'_>,
    fidelity: &Fidelity,
    is_nonlinear: bool,
) -> Result<Option<f64>> {
    let given_tolerance = reader.peek(&HARMONIC_TOLERANCE)?;
    let conflict = |reason| Err(reader.conflict(&HARMONIC_TOLERANCE, reason));
    if given_tolerance.is_some() && !is_nonlinear {
        return conflict(
            "without a [contact] the vibration is linear and has no further harmonics; remove it",
        );
    }
    if given_tolerance.is_some() && reader.has(&HARMONICS) {
        return conflict("dynamics.harmonics lists the harmonics already; give one of them");
    }
    if !is_nonlinear || reader.has(&HARMONICS) {
        return Ok(None);
    }
    let by_tolerance = fidelity.tolerance.map(|error| OF_HARMONICS * error);
    let by_preset = reader.default_of(&HARMONIC_TOLERANCE, fidelity.preset)?;
    let with_wear = harmonic_tolerance_with_wear(fidelity.preset).filter(|_| reader.has("wear"));
    let tolerance = given_tolerance.or(by_tolerance).or(with_wear).or(by_preset);
    Ok(tolerance.map(|tolerance| reader.note(&HARMONIC_TOLERANCE, tolerance)))
}

/// Returns whether the response with more harmonics drives the wear.
pub(super) fn harmonic_correction(
    reader: &Reader<'_>,
    fidelity: &Fidelity,
    is_nonlinear: bool,
) -> Result<bool> {
    if is_nonlinear && reader.has("wear") {
        return reader.value_or(&HARMONIC_CORRECTION, None, fidelity.preset);
    }
    if reader.peek(&HARMONIC_CORRECTION)? == Some(true) {
        return Err(reader.conflict(
            &HARMONIC_CORRECTION,
            "it applies to the wear of a vibrating joint, but there is none; remove it",
        ));
    }
    Ok(false)
}

/// Returns the samples of a vibration cycle. The highest harmonic sets a lower bound.
pub(super) fn samples(
    reader: &Reader<'_>,
    fidelity: &Fidelity,
    structure: &Structure,
    highest: u32,
) -> Result<usize> {
    let reason = format!(": more than twice the highest harmonic, {highest}");
    let factor = match structure.is_oscillator() {
        true => OSCILLATOR_SAMPLES,
        false => 1,
    };
    let least = least_samples(reader, fidelity.tolerance, fidelity.preset)?;
    let samples = reader
        .even_from(&AFT_SAMPLES, 2 * u64::from(highest) + 2, &reason)?
        .unwrap_or((factor * least).max(samples_of(highest)));
    Ok(reader.note(&AFT_SAMPLES, samples))
}
