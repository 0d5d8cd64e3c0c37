//! `[fidelity]`: how exactly things are computed.

use super::Result;
use crate::dynamics::vibration::samples_of;
use crate::scene::keys::{cycles::HISTORY, dynamics::HARMONICS, fidelity::*};
use crate::scene::reader::Reader;
use crate::scene::{Dynamics, Fidelity, Structure};

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
    let cycle = reader.get_or(&CYCLE, None, preset)?;
    let target = reader.get(&ASKED)?;
    let is_history = reader.get(&HISTORY)?.is_some();
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
    Ok(Fidelity {
        preset,
        tolerance: target,
        cycle,
        steps_per_cycle,
        normal_tolerance: reader.value_or(&NORMAL_TOLERANCE, pressure, preset)?,
        tangential_tolerance: reader.value_or(&TANGENTIAL_TOLERANCE, cycles, preset)?,
        cycle_tolerance: reader.value_or(&CYCLE_TOLERANCE, cycles, preset)?,
        cycle_extrapolation: reader.value_or(&CYCLE_EXTRAPOLATION, None, preset)?,
        // Those of the preset stay out of the scene: of alike bodies they mean nothing.
        load_steps: reader
            .get(&LOAD_STEPS)?
            .filter(|steps| LOAD_STEPS.default.of(preset) != Some(&steps.to_string())),
        // Of a scene that vibrates it is read where its harmonics are known.
        aft_samples: match target {
            Some(error) => samples_for(error),
            None => reader.default(&AFT_SAMPLES, preset)?,
        },
        harmonic_tolerance: None,
    })
}

/// The error that a wear step may make, where `[wear]` does not say.
pub(super) fn wear_tolerance(reader: &Reader<'_>, fidelity: &Fidelity) -> Result<f64> {
    let steps = fidelity.tolerance.map(|error| OF_STEPS * error);
    let of_preset =
        wear_tolerance_with_response(fidelity.preset).filter(|_| reader.has("dynamics"));
    let steps = steps.or(of_preset);
    reader.value_or(&WEAR_TOLERANCE, steps, fidelity.preset)
}

/// As many as leave a tenth of `error` of amplitude, by what 64 leave.
fn samples_for(error: f64) -> usize {
    let samples = 64.0 * (1e-3 / (0.1 * error)).sqrt();
    ((samples / 32.0).ceil() * 32.0).clamp(32.0, 1024.0) as usize
}

/// An oscillator has one element: as many times the samples cost nothing.
const OSCILLATOR_SAMPLES: usize = 8;

const WITHOUT_DYNAMICS: &str = "it is about [dynamics], and there is none; leave it out";

/// Part of an asked error that harmonics left out may take of amplitude and dissipation.
const OF_HARMONICS: f64 = 0.5;

/// What a vibration needs: whether its harmonics are extended, and the samples of a cycle, of which the highest needs some.
pub(super) fn with_vibration(
    reader: &Reader<'_>,
    fidelity: Fidelity,
    structure: Option<&Structure>,
    dynamics: Option<&Dynamics>,
    has_contact: bool,
) -> Result<Fidelity> {
    let has_springs = structure.is_some_and(|structure| !structure.springs().is_empty());
    let is_nonlinear = has_contact || has_springs;
    let given = reader.get(&HARMONIC_TOLERANCE)?;
    let conflict = |reason| Err(reader.conflict(&HARMONIC_TOLERANCE, reason));
    let harmonic_tolerance = match dynamics {
        None if given.is_some() => return conflict(WITHOUT_DYNAMICS),
        Some(_) if given.is_some() && !is_nonlinear => {
            return conflict(
                "without a [contact] the vibration is linear and has no more harmonics; leave it out",
            );
        }
        Some(_) if given.is_some() && reader.has(&HARMONICS) => {
            return conflict("dynamics.harmonics says which there are; give one of them");
        }
        Some(_) if is_nonlinear && !reader.has(&HARMONICS) => {
            let asked = fidelity.tolerance.map(|error| OF_HARMONICS * error);
            reader.get_or(&HARMONIC_TOLERANCE, asked, fidelity.preset)?
        }
        _ => None,
    };
    let fidelity = with_samples(reader, fidelity, structure, dynamics)?;
    Ok(Fidelity {
        harmonic_tolerance,
        ..fidelity
    })
}

fn with_samples(
    reader: &Reader<'_>,
    fidelity: Fidelity,
    structure: Option<&Structure>,
    dynamics: Option<&Dynamics>,
) -> Result<Fidelity> {
    let Some(dynamics) = dynamics else {
        return if reader.has(&AFT_SAMPLES) {
            Err(reader.conflict(&AFT_SAMPLES, WITHOUT_DYNAMICS))
        } else {
            Ok(fidelity)
        };
    };
    let highest = dynamics.harmonics.last().map_or(0, |order| *order as usize);
    let reason = format!(": more than twice the highest harmonic, {highest}");
    let is_oscillator = structure.is_some_and(|structure| structure.is_oscillator());
    let times = if is_oscillator { OSCILLATOR_SAMPLES } else { 1 };
    let aft_samples = reader
        .even_from(&AFT_SAMPLES, 2 * highest as u64 + 2, &reason)?
        .unwrap_or((times * fidelity.aft_samples).max(samples_of(highest as u32)));
    Ok(Fidelity {
        aft_samples,
        ..fidelity
    })
}
