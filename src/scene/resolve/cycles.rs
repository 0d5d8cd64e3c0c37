//! `[motion]`, `[wear]` and `[fidelity]`: what happens in a cycle, over many of them, and how exactly.

use super::Result;
use crate::scene::reader::{ANY, NOT_NEGATIVE, POSITIVE, Reader, TOLERANCE};
use crate::scene::{Contact, CycleMode, Fidelity, Motion, Preset, Scheme, Transverse, Wear, keys};
use crate::units::Dimension;

/// Largest wear depth of an explicit step of the `paper` preset \[m\]: what [A §4a] takes at Rq 5 and 10 µm.
const PAPER_DEPTH_STEP: f64 = 1e-7;

/// Time steps a cycle: what the harmonics of a steady response need, with room to spare.
const STEPS_PER_CYCLE: u64 = 32;

/// Fewer do not make a loop with an inside; an odd number misses the reversal at half a cycle.
const SMALLEST_STEPS: usize = 4;

/// A cycle finer than this has no meaning that the tolerances would not swallow; a larger number is a slip of the keyboard.
const LARGEST_STEPS: usize = 65_536;

pub(super) fn motion(reader: &Reader<'_>, contact: &Contact) -> Result<Option<Motion>> {
    if !reader.has("motion") {
        return Ok(None);
    }
    if contact.friction_coefficient.is_none() {
        return Err(reader.missing("contact.friction_coefficient", "friction_coefficient = 0.6"));
    }
    if let Some(path) = reader.path("motion.history", "\"cycle.parquet\"")? {
        for name in ["amplitude", "phase", "normal_load_amplitude"] {
            let key = keys::join("motion", name);
            if reader.has(&key) {
                return Err(reader.conflict(
                    &key,
                    "motion.history gives the whole cycle already; give one or the other",
                ));
            }
        }
        return Ok(Some(Motion::History { path }));
    }
    let amplitude = reader
        .pair(
            "motion.amplitude",
            Dimension::LENGTH,
            NOT_NEGATIVE,
            Some(|along_x| [along_x, 0.0]),
            "[\"5 um\", \"0 um\"]",
        )?
        .ok_or_else(|| reader.missing("motion.amplitude", "amplitude = [\"5 um\", \"0 um\"]"))?;
    let phase = reader
        .pair(
            "motion.phase",
            Dimension::ANGLE,
            ANY,
            Some(|both| [both, both]),
            "[\"0 deg\", \"90 deg\"]",
        )?
        .unwrap_or([0.0; 2]);
    let normal_load_amplitude = reader
        .quantity(
            "motion.normal_load_amplitude",
            Dimension::FORCE,
            NOT_NEGATIVE,
            "\"100 N\"",
        )?
        .unwrap_or(0.0);
    if normal_load_amplitude >= contact.normal_load {
        return Err(reader.out_of_range(
            "motion.normal_load_amplitude",
            format!(
                "less than contact.normal_load, {} N, or the joint would come apart",
                contact.normal_load
            ),
        ));
    }
    if amplitude[1] > 0.0 && contact.transverse == Transverse::Absent {
        return Err(reader.conflict(
            "motion.amplitude",
            "contact.transverse = \"absent\" leaves no motion along y; give \"0 um\" for y, or transverse = \"fixed\"",
        ));
    }
    if amplitude == [0.0; 2] && normal_load_amplitude == 0.0 {
        return Err(reader.conflict(
            "motion.amplitude",
            "nothing moves; give an amplitude greater than zero, or leave [motion] out for a static contact",
        ));
    }
    Ok(Some(Motion::Harmonic {
        amplitude,
        phase,
        normal_load_amplitude,
    }))
}

pub(super) fn wear(reader: &Reader<'_>, preset: Preset) -> Result<Option<Wear>> {
    let tolerance = |key| reader.quantity(key, Dimension::NONE, TOLERANCE, "0.01");
    let general = tolerance("fidelity.wear_tolerance")?;
    if !reader.has("wear") {
        return Ok(None);
    }
    if !reader.has("motion") {
        return Err(reader.missing_section(
            "motion",
            "[wear] needs it: without motion nothing wears",
            "[motion]\namplitude = [\"5 um\", \"0 um\"]",
        ));
    }
    let own = tolerance("wear.tolerance")?;
    if own.is_some() && general.is_some() {
        return Err(reader.conflict(
            "fidelity.wear_tolerance",
            "wear.tolerance says the same; give one of them",
        ));
    }
    let coefficient = reader
        .quantity(
            "wear.coefficient",
            Dimension::WEAR_COEFFICIENT,
            POSITIVE,
            "\"2e3 um^3/J\"",
        )?
        .ok_or_else(|| reader.missing("wear.coefficient", "coefficient = \"2e3 um^3/J\""))?;
    let cycles = reader.integer("wear.cycles", 1)?;
    let volume = reader.quantity("wear.volume", Dimension::VOLUME, POSITIVE, "\"1 mm^3\"")?;
    if cycles.is_none() && volume.is_none() {
        return Err(reader.missing(
            "wear.cycles",
            "cycles = 10_000_000   (or volume = \"1 mm^3\")",
        ));
    }
    let is_paper = preset == Preset::Paper;
    let scheme = reader
        .choice(
            "wear.scheme",
            &[
                ("implicit", Scheme::Implicit),
                ("explicit", Scheme::Explicit),
            ],
        )?
        .unwrap_or(if is_paper {
            Scheme::Explicit
        } else {
            Scheme::Implicit
        });
    let depth_step =
        reader.quantity("wear.depth_step", Dimension::LENGTH, POSITIVE, "\"0.1 um\"")?;
    let depth_step = match (depth_step, scheme) {
        (None, Scheme::Explicit) if is_paper => Some(PAPER_DEPTH_STEP),
        (None, Scheme::Explicit) => {
            return Err(reader.missing(
                "wear.depth_step",
                "depth_step = \"0.1 um\"   (the explicit scheme needs it)",
            ));
        }
        (given, _) => given,
    };
    Ok(Some(Wear {
        coefficient,
        cycles,
        volume,
        scheme,
        depth_step,
        tolerance: own.or(general).unwrap_or(defaults(preset).wear),
    }))
}

/// Tolerances of a preset.
struct Tolerances {
    normal: f64,
    tangential: f64,
    cycle: f64,
    wear: f64,
}

fn defaults(preset: Preset) -> Tolerances {
    let [normal, tangential, cycle, wear] = match preset {
        Preset::Fast => [1e-5, 1e-3, 1e-2, 0.05],
        Preset::Balanced => [1e-6, 1e-4, 1e-3, 0.01],
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
    let expected = format!("an even integer of {SMALLEST_STEPS} to {LARGEST_STEPS}");
    let steps = reader
        .integer("fidelity.steps_per_cycle", 0)?
        .unwrap_or(STEPS_PER_CYCLE);
    let steps_per_cycle = usize::try_from(steps)
        .ok()
        .filter(|steps| steps % 2 == 0 && (SMALLEST_STEPS..=LARGEST_STEPS).contains(steps))
        .ok_or_else(|| reader.out_of_range("fidelity.steps_per_cycle", expected))?;
    let default = defaults(preset);
    let tolerance = |key, default| -> Result<f64> {
        Ok(reader
            .quantity(key, Dimension::NONE, TOLERANCE, "1e-4")?
            .unwrap_or(default))
    };
    Ok(Fidelity {
        preset,
        cycle: cycle.or((preset == Preset::Paper).then_some(CycleMode::Stepped)),
        steps_per_cycle,
        normal_tolerance: tolerance("fidelity.normal_tolerance", default.normal)?,
        tangential_tolerance: tolerance("fidelity.tangential_tolerance", default.tangential)?,
        cycle_tolerance: tolerance("fidelity.cycle_tolerance", default.cycle)?,
        aft_samples: 64,
    })
}
