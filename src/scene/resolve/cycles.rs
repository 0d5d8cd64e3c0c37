//! `[motion]`, `[wear]` and `[update]`: what happens in a cycle, and over many of them.

use super::{Body, Result, fidelity};
use crate::scene::reader::{
    ANY, CHANGE, MOST_CYCLES, MOST_ITERATIONS, NOT_NEGATIVE, POSITIVE, Reader, TOLERANCE,
};
use crate::scene::{
    Boundary, Contact, Dynamics, Fidelity, Motion, Preset, Scheme, Torsion, Transverse, Update,
    Wear, keys,
};
use crate::units::Dimension;

/// Largest wear depth of an explicit step of the `paper` preset \[m\]: what [A §4a] takes at Rq 5 and 10 µm.
const PAPER_DEPTH_STEP: f64 = 1e-7;

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

pub(super) fn wear(reader: &Reader<'_>, body: Body, fidelity: &Fidelity) -> Result<Option<Wear>> {
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
    let cycles = reader.integer("wear.cycles", 1, MOST_CYCLES)?;
    let volume = reader.quantity("wear.volume", Dimension::VOLUME, POSITIVE, "\"1 mm^3\"")?;
    if cycles.is_none() && volume.is_none() {
        return Err(reader.missing(
            "wear.cycles",
            "cycles = 10_000_000   (or volume = \"1 mm^3\")",
        ));
    }
    let is_paper = fidelity.preset == Preset::Paper;
    let scheme = reader
        .choice(
            "wear.scheme",
            &[
                ("implicit", Scheme::Implicit),
                ("semi_implicit", Scheme::SemiImplicit),
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
        (None, Scheme::Explicit | Scheme::SemiImplicit) if is_paper => Some(PAPER_DEPTH_STEP),
        (None, Scheme::Explicit | Scheme::SemiImplicit) => {
            return Err(reader.missing(
                "wear.depth_step",
                "depth_step = \"0.1 um\"   (this scheme has no other measure of its steps)",
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
        tolerance: own
            .or(general)
            .unwrap_or(fidelity::tolerances(fidelity).wear),
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
    let iterations = reader.integer(CRITERIA[1], 1, MOST_ITERATIONS)?;
    let volume = reader.quantity(CRITERIA[2], Dimension::VOLUME, POSITIVE, "\"0.1 mm^3\"")?;
    Ok(change
        .map(Update::StiffnessChange)
        .or(iterations.map(Update::Iterations))
        .or(volume.map(Update::WearVolume)))
}
