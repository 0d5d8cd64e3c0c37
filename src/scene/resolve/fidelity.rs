//! `[fidelity]`: how exactly things are computed.

use super::Result;
use crate::scene::reader::{LARGEST_INTEGER, Reader, TOLERANCE};
use crate::scene::{CycleMode, Dynamics, Fidelity, Preset, Structure};
use crate::units::Dimension;

/// Time steps a cycle of a preset. An orbit and a load that varies are solved to within some 1.1 % of dissipation with 32 steps,
/// when extrapolated, and the error falls with the square of their number; the published 32 are not.
fn steps_per_cycle(preset: Preset) -> u64 {
    match preset {
        Preset::Paper | Preset::Fast => 32,
        Preset::Balanced => 64,
        Preset::Reference => 128,
    }
}

/// As many as make an error bar of a tenth of `error`, by the 2 % that 32 make on an orbit.
fn steps_for(error: f64) -> u64 {
    let steps = 32.0 * (0.02 / (0.1 * error)).sqrt();
    ((steps / 16.0).ceil() * 16.0).clamp(32.0, 1024.0) as u64
}

/// Fewer do not make a loop with an inside; an odd number misses the reversal at half a cycle.
const SMALLEST_STEPS: usize = 4;

/// A cycle finer than this has no meaning that the tolerances would not swallow; a larger number is a slip of the keyboard.
const LARGEST_STEPS: usize = 65_536;

/// Bounds on the normal tolerance: rounding, and what kn and contact area still make sense with.
const NORMAL: (f64, f64) = (1e-10, 1e-5);

/// What the knobs of a scene are set to where it does not say.
pub(super) struct Tolerances {
    normal: f64,
    tangential: f64,
    cycle: f64,
    pub(super) wear: f64,
}

/// Those of `fidelity.tolerance`, or of the preset.
pub(super) fn tolerances(fidelity: &Fidelity) -> Tolerances {
    match fidelity.tolerance {
        Some(error) => for_error(error),
        None => defaults(fidelity.preset),
    }
}

/// Knobs that keep the part of wear steps and solves in the error bar of the worn volume within `error`, each by how its own error enters it: the bar is three times what
/// the steps estimate of themselves, which is up to seven tenths of what they are allowed, and the duality gap of the cycles, to which a
/// tenth is left. A pressure is in error by its tolerance times the peak, which is some hundred times the mean.
fn for_error(error: f64) -> Tolerances {
    Tolerances {
        normal: (1e-4 * error).clamp(NORMAL.0, NORMAL.1),
        tangential: 0.1 * error,
        cycle: 0.1 * error,
        wear: 0.4 * error,
    }
}

fn defaults(preset: Preset) -> Tolerances {
    let [normal, tangential, cycle, wear] = match preset {
        Preset::Fast => [1e-5, 1e-3, 1e-2, 0.05],
        Preset::Balanced => [1e-6, 1e-3, 1e-3, 0.015],
        Preset::Reference => [1e-8, 1e-6, 1e-5, 1e-3],
        // The explicit scheme of the paper has no wear tolerance; the value serves a scene that asks for the implicit one.
        Preset::Paper => [1e-6, 1e-4, 1e-3, 0.01],
    };
    Tolerances {
        normal,
        tangential,
        cycle,
        wear,
    }
}

pub(super) fn fidelity(reader: &Reader<'_>) -> Result<Fidelity> {
    let preset = reader
        .choice(
            "fidelity.preset",
            &[
                ("paper", Preset::Paper),
                ("fast", Preset::Fast),
                ("balanced", Preset::Balanced),
                ("reference", Preset::Reference),
            ],
        )?
        .unwrap_or(Preset::Balanced);
    let cycle = reader.choice(
        "fidelity.cycle",
        &[
            ("superposition", CycleMode::Superposition),
            ("reversal", CycleMode::Reversal),
            ("stepped", CycleMode::Stepped),
        ],
    )?;
    let target = reader.quantity("fidelity.tolerance", Dimension::NONE, TOLERANCE, "0.01")?;
    let expected = format!("an even integer of {SMALLEST_STEPS} to {LARGEST_STEPS}");
    let steps = reader
        .integer("fidelity.steps_per_cycle", 0, LARGEST_INTEGER)?
        .unwrap_or_else(|| target.map_or_else(|| steps_per_cycle(preset), steps_for));
    let steps_per_cycle = usize::try_from(steps)
        .ok()
        .filter(|steps| steps % 2 == 0 && (SMALLEST_STEPS..=LARGEST_STEPS).contains(steps))
        .ok_or_else(|| reader.out_of_range("fidelity.steps_per_cycle", expected))?;
    if target.is_some() && reader.has("fidelity.preset") {
        return Err(reader.conflict(
            "fidelity.tolerance",
            "fidelity.preset sets the same knobs; give one of them",
        ));
    }
    let default = target.map_or_else(|| defaults(preset), for_error);
    let tolerance = |key, default| -> Result<f64> {
        Ok(reader
            .quantity(key, Dimension::NONE, TOLERANCE, "1e-4")?
            .unwrap_or(default))
    };
    Ok(Fidelity {
        preset,
        tolerance: target,
        cycle: cycle.or((preset == Preset::Paper).then_some(CycleMode::Stepped)),
        steps_per_cycle,
        normal_tolerance: tolerance("fidelity.normal_tolerance", default.normal)?,
        tangential_tolerance: tolerance("fidelity.tangential_tolerance", default.tangential)?,
        cycle_tolerance: tolerance("fidelity.cycle_tolerance", default.cycle)?,
        cycle_extrapolation: reader
            .boolean("fidelity.cycle_extrapolation")?
            .unwrap_or(preset != Preset::Paper),
        load_steps: load_steps(reader)?,
        aft_samples: target.map_or_else(|| samples(preset), samples_for),
        harmonic_tolerance: None,
    })
}

fn load_steps(reader: &Reader<'_>) -> Result<Option<usize>> {
    const KEY: &str = "fidelity.load_steps";
    reader.count(KEY, 1, LARGEST_STEPS)
}

/// Samples of a vibration cycle of a preset. The friction law is integrated exactly between them, along straight lines: the
/// error of the force falls with the square of their number, and 64 leave less than a thousandth of amplitude.
fn samples(preset: Preset) -> usize {
    match preset {
        Preset::Paper | Preset::Fast => 32,
        Preset::Balanced => 64,
        Preset::Reference => 512,
    }
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
const HARMONICS: f64 = 0.5;

/// The same of the promise of a preset; the published one does not extend its harmonics.
fn harmonic_tolerance(preset: Preset) -> Option<f64> {
    match preset {
        Preset::Paper => None,
        Preset::Fast => Some(HARMONICS * 0.05),
        Preset::Balanced => Some(HARMONICS * 0.01),
        Preset::Reference => Some(2e-3),
    }
}

/// What a vibration needs: whether its harmonics are extended, and the samples of a cycle, of which the highest needs some.
pub(super) fn with_vibration(
    reader: &Reader<'_>,
    fidelity: Fidelity,
    structure: Option<&Structure>,
    dynamics: Option<&Dynamics>,
    has_contact: bool,
) -> Result<Fidelity> {
    const KEY: &str = "fidelity.harmonic_tolerance";
    let given = reader.quantity(KEY, Dimension::NONE, TOLERANCE, "0.005")?;
    let harmonic_tolerance = match dynamics {
        None if given.is_some() => return Err(reader.conflict(KEY, WITHOUT_DYNAMICS)),
        Some(_) if given.is_some() && !has_contact => {
            return Err(reader.conflict(
                KEY,
                "without a [contact] the vibration is linear and has no more harmonics; leave it out",
            ));
        }
        Some(_) if given.is_some() && reader.has("dynamics.harmonics") => {
            return Err(reader.conflict(
                KEY,
                "dynamics.harmonics says which there are; give one of them",
            ));
        }
        Some(_) if has_contact && !reader.has("dynamics.harmonics") => {
            given.or_else(|| match fidelity.tolerance {
                Some(error) => Some(HARMONICS * error),
                None => harmonic_tolerance(fidelity.preset),
            })
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
    const KEY: &str = "fidelity.aft_samples";
    let Some(dynamics) = dynamics else {
        return if reader.has(KEY) {
            Err(reader.conflict(KEY, WITHOUT_DYNAMICS))
        } else {
            Ok(fidelity)
        };
    };
    let highest = dynamics.harmonics.last().map_or(0, |order| *order as usize);
    let least = 2 * highest + 2;
    let aft_samples = match reader.integer(KEY, 0, LARGEST_INTEGER)? {
        None => {
            let times = match structure {
                Some(Structure::Oscillator { .. }) => OSCILLATOR_SAMPLES,
                _ => 1,
            };
            (times * fidelity.aft_samples).max(4 * highest + 2)
        }
        Some(samples) => usize::try_from(samples)
            .ok()
            .filter(|n| n % 2 == 0 && (least..=LARGEST_STEPS).contains(n))
            .ok_or_else(|| {
                reader.out_of_range(
                    KEY,
                    format!(
                        "an even integer of {least} to {LARGEST_STEPS}: more than twice the highest harmonic, {highest}"
                    ),
                )
            })?,
    };
    Ok(Fidelity {
        aft_samples,
        ..fidelity
    })
}
