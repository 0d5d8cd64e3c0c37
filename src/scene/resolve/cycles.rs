//! Resolves `[motion]`, `[wear]` and `[update]`: one cycle, and many of them.

use super::{All, Body, Result, fidelity};
use crate::scene::keys::{contact::KN, cycles::*, fidelity::WEAR_TOLERANCE};
use crate::scene::reader::Reader;
use crate::scene::{
    Boundary, Contact, Fidelity, Motion, Preset, Transverse, Update, Updates, Wear,
};
use crate::units::has_force;
use crate::wear::{Harmonic, HarmonicMotion};

/// Largest wear depth of an explicit step of the `paper` preset \[m\]. [A §4a] uses the same value at Rq 5 and 10 µm.
const PAPER_DEPTH_STEP: f64 = 1e-7;

pub(super) fn motion(reader: &Reader<'_>, contact: &Contact) -> Result<Option<Motion>> {
    if !reader.has("motion") {
        return Ok(None);
    }
    if let Some(path) = reader.peek(&HISTORY)? {
        reader.refuse_form(
            "motion",
            "harmonic",
            "motion.history gives the whole cycle already; give one or the other",
        )?;
        reader.record.note("motion.kind", "history".into());
        return Ok(Some(Motion::History { path }));
    }
    reader.record.note("motion.kind", "harmonic".into());
    harmonic(reader, contact).map(|motion| Some(Motion::Harmonic(motion)))
}

fn harmonic(reader: &Reader<'_>, contact: &Contact) -> Result<HarmonicMotion> {
    let amplitude = reader.peek(&MOTION_AMPLITUDE)?;
    let force = reader.get(&MOTION_FORCE)?;
    let rotation = torsion(reader, contact)?;
    if amplitude.is_some() && force.is_some() {
        return Err(reader.conflict(
            &MOTION_FORCE,
            "motion.amplitude gives the displacement already; give one or the other",
        ));
    }
    if amplitude.is_none() && force.is_none() && rotation.is_none() {
        return Err(reader.missing(&MOTION_AMPLITUDE, "   (or force, rotation, moment)"));
    }
    let phase = reader.value(&MOTION_PHASE)?;
    let normal_load_amplitude = reader.value(&NORMAL_LOAD_AMPLITUDE)?;
    let normal_load = contact.normal_load();
    if normal_load_amplitude >= normal_load {
        return Err(reader.out_of_range(
            &NORMAL_LOAD_AMPLITUDE,
            format!("less than contact.normal_load, {normal_load} N, or the joint would lift off"),
        ));
    }
    let amplitude = reader.note(&MOTION_AMPLITUDE, amplitude.unwrap_or([0.0; 2]));
    check_along_y(reader, contact, amplitude[1], force.map_or(0.0, |f| f[1]))?;
    let moves = |values: [f64; 2]| values != [0.0; 2];
    if !moves(amplitude)
        && !force.is_some_and(moves)
        && rotation.is_none()
        && normal_load_amplitude == 0.0
    {
        let key = if force.is_some() {
            &MOTION_FORCE
        } else {
            &MOTION_AMPLITUDE
        };
        return Err(reader.conflict(
            key,
            "nothing moves; give a value greater than zero, or remove [motion] for a static contact",
        ));
    }
    let axis = |axis: usize, force: Option<f64>| Harmonic {
        amplitude: force.unwrap_or(amplitude[axis]),
        phase: phase[axis],
        is_force: force.is_some(),
    };
    let mut axes = vec![axis(0, force.map(|force| force[0]))];
    // Without a force along y, `contact.transverse` decides whether y is fixed or free.
    let along_y = force.map(|force| force[1]).filter(|force| *force > 0.0);
    match contact.transverse {
        Transverse::Absent => {}
        Transverse::Fixed => axes.push(axis(1, along_y)),
        Transverse::Free => axes.push(axis(1, Some(along_y.unwrap_or(0.0)))),
    }
    Ok(HarmonicMotion {
        axes,
        rotation,
        normal_load_amplitude,
    })
}

/// Rejects a motion or force along y that `contact.transverse` does not allow.
fn check_along_y(reader: &Reader<'_>, contact: &Contact, amplitude: f64, force: f64) -> Result<()> {
    let absent = contact.transverse == Transverse::Absent;
    if force > 0.0 && absent {
        return Err(reader.conflict(
            &MOTION_FORCE,
            "contact.transverse = \"absent\" allows no force along y; give \"0 N\" for y, or transverse = \"fixed\"",
        ));
    }
    if amplitude == 0.0 {
        return Ok(());
    }
    match contact.transverse {
        Transverse::Fixed => Ok(()),
        Transverse::Absent => Err(reader.conflict(
            &MOTION_AMPLITUDE,
            "contact.transverse = \"absent\" allows no motion along y; give \"0 um\" for y, or transverse = \"fixed\"",
        )),
        Transverse::Free => Err(reader.conflict(
            &MOTION_AMPLITUDE,
            "contact.transverse = \"free\" computes the motion along y from zero force; give \"0 um\" for y, or transverse = \"fixed\"",
        )),
    }
}

fn torsion(reader: &Reader<'_>, contact: &Contact) -> Result<Option<Harmonic>> {
    let rotation = reader.get(&MOTION_ROTATION)?;
    let moment = reader.get(&MOTION_MOMENT)?;
    let (amplitude, key) = match (rotation, moment) {
        (None, None) => return Ok(None),
        (Some(_), Some(_)) => {
            return Err(reader.conflict(
                &MOTION_MOMENT,
                "motion.rotation gives the rotation already; give one or the other",
            ));
        }
        (Some(rotation), None) => (rotation, &MOTION_ROTATION),
        (None, Some(moment)) => (moment, &MOTION_MOMENT),
    };
    if contact.transverse == Transverse::Absent {
        return Err(reader.conflict(
            key,
            "a rotation about z moves cells along y, but contact.transverse = \"absent\" allows no motion along y; use \"fixed\" or \"free\"",
        ));
    }
    let boundary = contact.conditions.map(|conditions| conditions.boundary);
    if boundary == Some(Boundary::Periodic) {
        return Err(reader.conflict(
            key,
            "with contact.boundary = \"periodic\" a rotated body would not be periodic; use boundary = \"free\"",
        ));
    }
    Ok(Some(Harmonic {
        amplitude,
        phase: 0.0,
        is_force: moment.is_some(),
    }))
}

/// Checks that `[wear]` has a surface, and a motion.
fn check_wear(reader: &Reader<'_>, body: Body) -> Result<()> {
    if body == Body::Joint && !reader.has("motion") {
        return Err(reader.missing_section(
            "motion",
            "[wear] needs it, or [structure] and [dynamics]: without motion nothing wears",
            &MOTION_AMPLITUDE.line(),
        ));
    }
    if body == Body::Oscillator {
        let reason = "an oscillator has no surface that could wear; remove [wear]";
        return Err(reader.misplaced("wear", reason));
    }
    if reader.has(&KN) {
        return Err(reader.conflict(
            &KN,
            "a contact of given stiffness has no surface that could wear; give [surface] instead, or remove [wear]",
        ));
    }
    Ok(())
}

/// Returns the worn volume per dissipated energy \[m³/J\] from the given coefficient. By Archard's law, the worn volume
/// is dV = k N ds. The friction energy is µ N ds, so that α = k/µ.
fn alpha(reader: &Reader<'_>, contact: Option<&Contact>) -> Result<f64> {
    let coefficient = reader.required_unrecorded(&COEFFICIENT)?;
    let alpha = match reader.peek(&LAW)? {
        Some("archard") => match contact.and_then(|contact| contact.friction_coefficient) {
            Some(0.0) => Err(reader.conflict(
                &LAW,
                "alpha = k/mu, and contact.friction_coefficient is 0: give a friction coefficient greater than zero",
            )),
            friction => Ok(coefficient / friction.unwrap_or(1.0)),
        },
        None if reader.root.text(COEFFICIENT.name).is_some_and(has_force) => Err(reader.conflict(
            &COEFFICIENT,
            "this unit fits both alpha (volume per dissipated energy) and Archard's k (volume per load and slip); state which one it is: wear.law = \"energy\", or wear.law = \"archard\" (alpha = k/mu)",
        )),
        _ => Ok(coefficient),
    };
    alpha.map(|alpha| reader.note(&COEFFICIENT, alpha))
}

pub(super) fn wear(
    reader: &Reader<'_>,
    body: Body,
    fidelity: &Fidelity,
    contact: Option<&Contact>,
) -> Result<Option<Wear>> {
    let fidelity_tolerance = reader.peek(&WEAR_TOLERANCE)?;
    if !reader.has("wear") {
        return Ok(None);
    }
    check_wear(reader, body)?;
    let step_tolerance = reader.peek(&WEAR_STEP_TOLERANCE)?;
    if step_tolerance.is_some() && fidelity_tolerance.is_some() {
        return Err(reader.conflict(
            &WEAR_TOLERANCE,
            "wear.tolerance has the same meaning; give one of them",
        ));
    }
    let cycles = reader.optional(&CYCLES, None);
    let end = match (cycles, reader.optional(&VOLUME, None)).all() {
        Ok((None, None)) => Err(reader.missing(&CYCLES, "   (or volume = \"1 mm^3\")")),
        read => read,
    };
    let (coefficient, (cycles, volume)) = (alpha(reader, contact), end).all()?;
    let is_paper = fidelity.preset == Preset::Paper;
    let scheme = reader.value_or(&SCHEME, None, fidelity.preset)?;
    let depth_step = match (reader.optional(&DEPTH_STEP, None)?, scheme) {
        (None, scheme) if scheme.needs_depth_step() && is_paper => {
            Some(reader.note(&DEPTH_STEP, PAPER_DEPTH_STEP))
        }
        (None, scheme) if scheme.needs_depth_step() => {
            return Err(
                reader.missing(&DEPTH_STEP, "   (this scheme needs it to choose its steps)")
            );
        }
        (given, _) => given,
    };
    let tolerance = match step_tolerance {
        Some(step_tolerance) => step_tolerance,
        None => fidelity::wear_tolerance(reader, fidelity)?,
    };
    Ok(Some(Wear {
        coefficient,
        cycles,
        volume,
        until_preload: reader.optional(&UNTIL_PRELOAD, None)?,
        scheme,
        depth_step,
        tolerance: reader.note(&WEAR_STEP_TOLERANCE, tolerance),
    }))
}

/// Reads when the contact elements are updated, and whether their motion is extrapolated between updates.
pub(super) fn update(
    reader: &Reader<'_>,
    wear: Option<&Wear>,
    vibrates: bool,
    preset: Preset,
) -> Result<Updates> {
    let criterion = criterion(reader, wear, vibrates, preset)?;
    if criterion == Update::Never {
        for key in [EXTRAPOLATE.name, VOLUME_GROWTH.name] {
            if reader.has(key) {
                return Err(reader.conflict(
                    key,
                    "it has no effect without updates; give update.stiffness_change too",
                ));
            }
        }
        return Ok(Updates::default());
    }
    Ok(Updates {
        criterion,
        extrapolates: reader.value_or(&EXTRAPOLATE, None, preset)?,
    })
}

fn criterion(
    reader: &Reader<'_>,
    wear: Option<&Wear>,
    vibrates: bool,
    preset: Preset,
) -> Result<Update> {
    if !reader.has(&UPDATE) {
        return Ok(Update::Never);
    }
    let criteria = [
        STIFFNESS_CHANGE.name,
        UPDATE_ITERATIONS.name,
        UPDATE_WEAR_VOLUME.name,
    ];
    let given_criteria: Vec<&str> = criteria
        .into_iter()
        .filter(|key| reader.has(*key))
        .collect();
    let Some(&first) = given_criteria.first() else {
        return match reader.node(&UPDATE).map(|node| node.shown()) {
            Some(empty) if empty == "{}" => Err(reader.missing(&STIFFNESS_CHANGE, "")),
            _ => reader.peek(&UPDATE).map(|_| Update::Never),
        };
    };
    if let Some(second) = given_criteria.get(1) {
        return Err(reader.conflict(
            *second,
            format!("{first} decides already when to update; give one of them"),
        ));
    }
    if wear.is_none() {
        let reason = "without [wear] the contact never changes; remove it";
        return Err(reader.misplaced("update", reason));
    }
    if !vibrates {
        let reason = "it updates the contact elements of a structure, but there is none; add [structure] and [dynamics], or remove it";
        return Err(reader.misplaced("update", reason));
    }
    let change = match reader.get(&STIFFNESS_CHANGE)? {
        Some(change) => Some(Update::StiffnessChange {
            change,
            volume_growth: reader.value_or(&VOLUME_GROWTH, None, preset)?,
        }),
        None if reader.has(&VOLUME_GROWTH) => {
            return Err(reader.conflict(
                &VOLUME_GROWTH,
                format!(
                    "it needs update.stiffness_change, but {first} decides already when to update"
                ),
            ));
        }
        None => None,
    };
    let iterations = reader.get(&UPDATE_ITERATIONS)?;
    let volume = reader.get(&UPDATE_WEAR_VOLUME)?;
    Ok(change
        .or(iterations.map(Update::Iterations))
        .or(volume.map(Update::WearVolume))
        .unwrap_or_default())
}
