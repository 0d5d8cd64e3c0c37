//! `[motion]`, `[wear]`, `[update]` and `[fidelity]`: what happens in a cycle, over many of them, and how exactly.

use super::{Body, Result};
use crate::scene::reader::{ANY, CHANGE, NOT_NEGATIVE, POSITIVE, Reader, TOLERANCE};
use crate::scene::{
    Boundary, Contact, CycleMode, Dynamics, Fidelity, Motion, Preset, Scheme, Structure, Torsion,
    Transverse, Update, Wear, keys,
};
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
        for name in [
            "amplitude",
            "force",
            "rotation",
            "moment",
            "phase",
            "normal_load_amplitude",
        ] {
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
    harmonic(reader, contact).map(Some)
}

fn harmonic(reader: &Reader<'_>, contact: &Contact) -> Result<Motion> {
    let along_x: fn(f64) -> [f64; 2] = |x| [x, 0.0];
    let half_ranges =
        |key, dimension, example| reader.pair(key, dimension, NOT_NEGATIVE, Some(along_x), example);
    let amplitude = half_ranges(
        "motion.amplitude",
        Dimension::LENGTH,
        "[\"5 um\", \"0 um\"]",
    )?;
    let force = half_ranges("motion.force", Dimension::FORCE, "[\"5 kN\", \"0 N\"]")?;
    let torsion = torsion(reader, contact)?;
    if amplitude.is_some() && force.is_some() {
        return Err(reader.conflict(
            "motion.force",
            "motion.amplitude gives the displacement already; give one or the other",
        ));
    }
    if amplitude.is_none() && force.is_none() && torsion.is_none() {
        return Err(reader.missing(
            "motion.amplitude",
            "amplitude = [\"5 um\", \"0 um\"]   (or force, rotation, moment)",
        ));
    }
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
    let amplitude = amplitude.unwrap_or([0.0; 2]);
    check_along_y(reader, contact, amplitude[1], force.map_or(0.0, |f| f[1]))?;
    let moves = |values: [f64; 2]| values != [0.0; 2];
    if !moves(amplitude)
        && !force.is_some_and(moves)
        && torsion.is_none()
        && normal_load_amplitude == 0.0
    {
        let key = if force.is_some() {
            "motion.force"
        } else {
            "motion.amplitude"
        };
        return Err(reader.conflict(
            key,
            "nothing moves; give a value greater than zero, or leave [motion] out for a static contact",
        ));
    }
    Ok(Motion::Harmonic {
        amplitude,
        force,
        torsion,
        phase,
        normal_load_amplitude,
    })
}

/// What `contact.transverse` leaves of the motion along y.
fn check_along_y(reader: &Reader<'_>, contact: &Contact, amplitude: f64, force: f64) -> Result<()> {
    let absent = contact.transverse == Transverse::Absent;
    if force > 0.0 && absent {
        return Err(reader.conflict(
            "motion.force",
            "contact.transverse = \"absent\" leaves no force along y; give \"0 N\" for y, or transverse = \"fixed\"",
        ));
    }
    if amplitude == 0.0 {
        return Ok(());
    }
    match contact.transverse {
        Transverse::Fixed => Ok(()),
        Transverse::Absent => Err(reader.conflict(
            "motion.amplitude",
            "contact.transverse = \"absent\" leaves no motion along y; give \"0 um\" for y, or transverse = \"fixed\"",
        )),
        Transverse::Free => Err(reader.conflict(
            "motion.amplitude",
            "contact.transverse = \"free\" finds the motion along y from no force; give \"0 um\" for y, or transverse = \"fixed\"",
        )),
    }
}

fn torsion(reader: &Reader<'_>, contact: &Contact) -> Result<Option<Torsion>> {
    const ROTATION: &str = "motion.rotation";
    const MOMENT: &str = "motion.moment";
    let rotation = reader.quantity(ROTATION, Dimension::ANGLE, POSITIVE, "\"0.1 mrad\"")?;
    let moment = reader.quantity(MOMENT, Dimension::MOMENT, POSITIVE, "\"20 N m\"")?;
    let (torsion, key) = match (rotation, moment) {
        (None, None) => return Ok(None),
        (Some(_), Some(_)) => {
            return Err(reader.conflict(
                MOMENT,
                "motion.rotation gives the rotation already; give one or the other",
            ));
        }
        (Some(rotation), None) => (Torsion::Rotation(rotation), ROTATION),
        (None, Some(moment)) => (Torsion::Moment(moment), MOMENT),
    };
    if contact.transverse == Transverse::Absent {
        return Err(reader.conflict(
            key,
            "a rotation about z moves cells along y, and contact.transverse = \"absent\" leaves no y; use \"fixed\" or \"free\"",
        ));
    }
    if contact.boundary == Boundary::Periodic {
        return Err(reader.conflict(
            key,
            "with contact.boundary = \"periodic\" a turned body would not repeat itself; use boundary = \"free\"",
        ));
    }
    Ok(Some(torsion))
}

/// What `[wear]` needs beside it: a surface, and something that moves it.
fn check_wear(reader: &Reader<'_>, body: Body) -> Result<()> {
    if body == Body::Joint && !reader.has("motion") {
        return Err(reader.missing_section(
            "motion",
            "[wear] needs it, or [structure] and [dynamics]: without motion nothing wears",
            "[motion]\namplitude = [\"5 um\", \"0 um\"]",
        ));
    }
    if body == Body::Oscillator {
        let reason = "an oscillator has no surface that could wear; leave [wear] out";
        return Err(reader.misplaced("wear", reason));
    }
    if reader.has("contact.kn") {
        return Err(reader.conflict(
            "contact.kn",
            "a contact of given stiffness has no surface that could wear; give [surface] instead, or leave [wear] out",
        ));
    }
    Ok(())
}

pub(super) fn wear(reader: &Reader<'_>, body: Body, preset: Preset) -> Result<Option<Wear>> {
    let tolerance = |key| reader.quantity(key, Dimension::NONE, TOLERANCE, "0.01");
    let general = tolerance("fidelity.wear_tolerance")?;
    if !reader.has("wear") {
        return Ok(None);
    }
    check_wear(reader, body)?;
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

pub(super) fn update(
    reader: &Reader<'_>,
    wear: Option<&Wear>,
    dynamics: Option<&Dynamics>,
) -> Result<Option<Update>> {
    const CRITERIA: [&str; 3] = [
        "update.stiffness_change",
        "update.iterations",
        "update.wear_volume",
    ];
    let Some(node) = reader.node("update") else {
        return Ok(None);
    };
    let given: Vec<&str> = CRITERIA.into_iter().filter(|key| reader.has(key)).collect();
    let Some(&first) = given.first() else {
        return match node.shown().as_str() {
            "\"never\"" => Ok(None),
            "{}" => Err(reader.missing(CRITERIA[0], "stiffness_change = 0.10")),
            _ => Err(reader.out_of_range(
                "update",
                "\"never\" or a table such as { stiffness_change = 0.10 }",
            )),
        };
    };
    if let Some(second) = given.get(1) {
        return Err(reader.conflict(
            second,
            format!("{first} decides already when to update; give one of them"),
        ));
    }
    if wear.is_none() {
        let reason = "without [wear] the contact never changes; leave it out";
        return Err(reader.misplaced("update", reason));
    }
    if dynamics.is_none() {
        let reason = "it changes the contact elements of a structure, and there is none; add [structure] and [dynamics], or leave it out";
        return Err(reader.misplaced("update", reason));
    }
    let change = reader.quantity(CRITERIA[0], Dimension::NONE, CHANGE, "0.10")?;
    let iterations = reader.integer(CRITERIA[1], 1)?;
    let volume = reader.quantity(CRITERIA[2], Dimension::VOLUME, POSITIVE, "\"0.1 mm^3\"")?;
    Ok(change
        .map(Update::StiffnessChange)
        .or(iterations.map(Update::Iterations))
        .or(volume.map(Update::WearVolume)))
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
        load_steps: load_steps(reader)?,
        aft_samples: samples(preset),
    })
}

fn load_steps(reader: &Reader<'_>) -> Result<Option<usize>> {
    const KEY: &str = "fidelity.load_steps";
    let Some(steps) = reader.integer(KEY, 1)? else {
        return Ok(None);
    };
    match usize::try_from(steps) {
        Ok(steps) if steps <= LARGEST_STEPS => Ok(Some(steps)),
        _ => Err(reader.out_of_range(KEY, format!("an integer of 1 to {LARGEST_STEPS}"))),
    }
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

/// An oscillator has one element: as many times the samples cost nothing.
const OSCILLATOR_SAMPLES: usize = 8;

/// The samples of a vibration cycle, of which the highest harmonic needs some.
pub(super) fn with_samples(
    reader: &Reader<'_>,
    fidelity: Fidelity,
    structure: Option<&Structure>,
    dynamics: Option<&Dynamics>,
) -> Result<Fidelity> {
    const KEY: &str = "fidelity.aft_samples";
    let Some(dynamics) = dynamics else {
        return if reader.has(KEY) {
            Err(reader.conflict(
                KEY,
                "it is about [dynamics], and there is none; leave it out",
            ))
        } else {
            Ok(fidelity)
        };
    };
    let highest = dynamics.harmonics.last().map_or(0, |order| *order as usize);
    let least = 2 * highest + 2;
    let aft_samples = match reader.integer(KEY, 0)? {
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
