//! `[motion]`, `[wear]` and `[update]`: what happens in a cycle, and over many of them.

use super::{All, Body, Result, fidelity};
use crate::scene::keys::{contact::KN, cycles::*, fidelity::WEAR_TOLERANCE};
use crate::scene::reader::Reader;
use crate::scene::{
    Boundary, Contact, Fidelity, Motion, Preset, Transverse, Update, Updates, Wear,
};
use crate::units::has_force;
use crate::wear::{Harmonic, HarmonicMotion};

/// Largest wear depth of an explicit step of the `paper` preset \[m\]: what [A §4a] takes at Rq 5 and 10 µm.
const PAPER_DEPTH_STEP: f64 = 1e-7;

pub(super) fn motion(reader: &Reader<'_>, contact: &Contact) -> Result<Option<Motion>> {
    if !reader.has("motion") {
        return Ok(None);
    }
    if let Some(path) = reader.look(&HISTORY)? {
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
    let amplitude = reader.look(&MOTION_AMPLITUDE)?;
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
            format!(
                "less than contact.normal_load, {normal_load} N, or the joint would come apart"
            ),
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
            "nothing moves; give a value greater than zero, or leave [motion] out for a static contact",
        ));
    }
    let axis = |axis: usize, force: Option<f64>| Harmonic {
        amplitude: force.unwrap_or(amplitude[axis]),
        phase: phase[axis],
        is_force: force.is_some(),
    };
    let mut axes = vec![axis(0, force.map(|force| force[0]))];
    // Without a force of its own y is held or free, as the scene says.
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

/// What `contact.transverse` leaves of the motion along y.
fn check_along_y(reader: &Reader<'_>, contact: &Contact, amplitude: f64, force: f64) -> Result<()> {
    let absent = contact.transverse == Transverse::Absent;
    if force > 0.0 && absent {
        return Err(reader.conflict(
            &MOTION_FORCE,
            "contact.transverse = \"absent\" leaves no force along y; give \"0 N\" for y, or transverse = \"fixed\"",
        ));
    }
    if amplitude == 0.0 {
        return Ok(());
    }
    match contact.transverse {
        Transverse::Fixed => Ok(()),
        Transverse::Absent => Err(reader.conflict(
            &MOTION_AMPLITUDE,
            "contact.transverse = \"absent\" leaves no motion along y; give \"0 um\" for y, or transverse = \"fixed\"",
        )),
        Transverse::Free => Err(reader.conflict(
            &MOTION_AMPLITUDE,
            "contact.transverse = \"free\" finds the motion along y from no force; give \"0 um\" for y, or transverse = \"fixed\"",
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
            "a rotation about z moves cells along y, and contact.transverse = \"absent\" leaves no y; use \"fixed\" or \"free\"",
        ));
    }
    let boundary = contact.conditions.map(|conditions| conditions.boundary);
    if boundary == Some(Boundary::Periodic) {
        return Err(reader.conflict(
            key,
            "with contact.boundary = \"periodic\" a turned body would not repeat itself; use boundary = \"free\"",
        ));
    }
    Ok(Some(Harmonic {
        amplitude,
        phase: 0.0,
        is_force: moment.is_some(),
    }))
}

/// What `[wear]` needs beside it: a surface, and something that moves it.
fn check_wear(reader: &Reader<'_>, body: Body) -> Result<()> {
    if body == Body::Joint && !reader.has("motion") {
        return Err(reader.missing_section(
            "motion",
            "[wear] needs it, or [structure] and [dynamics]: without motion nothing wears",
            &MOTION_AMPLITUDE.line(),
        ));
    }
    if body == Body::Oscillator {
        let reason = "an oscillator has no surface that could wear; leave [wear] out";
        return Err(reader.misplaced("wear", reason));
    }
    if reader.has(&KN) {
        return Err(reader.conflict(
            &KN,
            "a contact of given stiffness has no surface that could wear; give [surface] instead, or leave [wear] out",
        ));
    }
    Ok(())
}

/// Worn volume per dissipated energy \[m³/J\] of the coefficient that is given. By Archard's law, dV = k N ds, it is α = k/µ, since the
/// energy is µ N ds.
fn alpha(reader: &Reader<'_>, contact: Option<&Contact>) -> Result<f64> {
    let given = reader.needed(&COEFFICIENT)?;
    let alpha = match reader.look(&LAW)? {
        Some("archard") => match contact.and_then(|contact| contact.friction_coefficient) {
            Some(0.0) => Err(reader.conflict(
                &LAW,
                "alpha = k/mu, and contact.friction_coefficient is 0: give a friction coefficient greater than zero",
            )),
            friction => Ok(given / friction.unwrap_or(1.0)),
        },
        None if reader.root.text(COEFFICIENT.name).is_some_and(has_force) => Err(reader.conflict(
            &COEFFICIENT,
            "this unit is that of alpha (volume per dissipated energy) and of Archard's k (volume per load and slip); say which it is: wear.law = \"energy\", or wear.law = \"archard\" (alpha = k/mu)",
        )),
        _ => Ok(given),
    };
    alpha.map(|alpha| reader.note(&COEFFICIENT, alpha))
}

pub(super) fn wear(
    reader: &Reader<'_>,
    body: Body,
    fidelity: &Fidelity,
    contact: Option<&Contact>,
) -> Result<Option<Wear>> {
    let general = reader.look(&WEAR_TOLERANCE)?;
    if !reader.has("wear") {
        return Ok(None);
    }
    check_wear(reader, body)?;
    let own = reader.look(&WEAR_STEP_TOLERANCE)?;
    if own.is_some() && general.is_some() {
        return Err(reader.conflict(
            &WEAR_TOLERANCE,
            "wear.tolerance says the same; give one of them",
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
            return Err(reader.missing(
                &DEPTH_STEP,
                "   (this scheme has no other measure of its steps)",
            ));
        }
        (given, _) => given,
    };
    let tolerance = match own {
        Some(own) => own,
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

/// When the contact elements are renewed, and whether their motion is carried on in between.
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
                    "without an update nothing is carried on; give update.stiffness_change too",
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
    let given: Vec<&str> = criteria
        .into_iter()
        .filter(|key| reader.has(*key))
        .collect();
    let Some(&first) = given.first() else {
        return match reader.node(&UPDATE).map(|node| node.shown()) {
            Some(empty) if empty == "{}" => Err(reader.missing(&STIFFNESS_CHANGE, "")),
            _ => reader.look(&UPDATE).map(|_| Update::Never),
        };
    };
    if let Some(second) = given.get(1) {
        return Err(reader.conflict(
            *second,
            format!("{first} decides already when to update; give one of them"),
        ));
    }
    if wear.is_none() {
        let reason = "without [wear] the contact never changes; leave it out";
        return Err(reader.misplaced("update", reason));
    }
    if !vibrates {
        let reason = "it changes the contact elements of a structure, and there is none; add [structure] and [dynamics], or leave it out";
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
                    "it is beside update.stiffness_change; {first} decides already when to update"
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
