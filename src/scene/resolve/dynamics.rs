//! Resolves `[dynamics]`: the drive of the structure, and the wanted response.

use std::f64::consts::TAU;

use serde_json::{Value as Json, json};

use super::{Result, fidelity};
use crate::recipe::{ElementStiffness, Reasons, Response};
use crate::scene::document::Node;
use crate::scene::keys::dynamics::*;
use crate::scene::keys::structure::DAMPING;
use crate::scene::keys::structure::STRUCTURAL_DAMPING;
use crate::scene::reader::Reader;
use crate::scene::{Base, BaseMotion, Contact, Fidelity, Force, Port, Rayleigh, Structure};

/// Default harmonics [A §3].
const FIRST_HARMONICS: [u32; 4] = [0, 1, 2, 3];
/// Default modal damping ratio of a bolted steel structure. The published case does not state its ratio.
const STEEL_DAMPING: f64 = 0.002;
/// Default lower end of the forced response of an oscillator, relative to the natural frequency without contact.
const FROM_FREE: f64 = 0.5;
/// Default lower end of the forced response, divided by the natural frequency with the contact springs. The default
/// applies to an oscillator that only the contact supports.
const FROM_STUCK: f64 = 0.3;
/// Default upper end of the forced response of an oscillator, relative to the natural frequency with the contact
/// springs.
const TO_STUCK: f64 = 1.5;
/// Rounding error of a sum of forces that cancel, relative to the largest force.
const CANCELLED: f64 = 1e-14;

/// Section of the ground motion.
const BASE: &str = "dynamics.base";
/// Section of Rayleigh damping.
const RAYLEIGH: &str = "dynamics.rayleigh";

/// Points of a structure at which forces act and displacements are read, the default one first.
fn points(structure: &Structure) -> &'static [&'static str] {
    structure.points()
}

pub(super) fn response(
    reader: &Reader<'_>,
    structure: &Structure,
    contact: Option<&Contact>,
    fidelity: &Fidelity,
) -> Result<Response> {
    let base = base(reader, structure)?;
    let (forces, noted): (Vec<Force>, Vec<Json>) = match reader.has(&FORCE) || base.is_none() {
        true => forces(reader, structure)?.into_iter().unzip(),
        false => Default::default(),
    };
    reader.record.note(FORCE.name, json!(noted));
    let drive = match forces.iter().find(|force| force.harmonic == 1) {
        Some(force) => force.port.clone(),
        None => match base.filter(|base| base.harmonic == 1) {
            Some(base) => Port {
                at: points(structure)
                    .first()
                    .copied()
                    .unwrap_or_default()
                    .to_owned(),
                axis: base.axis,
            },
            None => {
                let key = if forces.is_empty() { BASE } else { FORCE.name };
                return Err(
                    reader.conflict(key, "no force of harmonic 1 drives the structure; give one")
                );
            }
        },
    };
    if base.is_none() && forces_cancel(&forces) {
        return Err(reader.conflict(
            &FORCE,
            "the forces of harmonic 1 cancel each other, so that nothing drives the structure; change an amplitude or a phase",
        ));
    }
    let at = reader.point(&RESPONSE_AT, points(structure))?;
    let axis = reader.peek(&RESPONSE_DIRECTION)?;
    let response = Port {
        at: reader.note(&RESPONSE_AT, at.unwrap_or_else(|| drive.at.clone())),
        axis: reader.note(&RESPONSE_DIRECTION, axis.unwrap_or(drive.axis)),
    };
    let harmonics = harmonics(reader, &forces, base)?;
    let rayleigh = rayleigh(reader)?;
    let loss_factor = reader.value(&LOSS_FACTOR)?;
    let has_files = reader.has(&DAMPING) || reader.has(&STRUCTURAL_DAMPING);
    let has_other =
        structure.is_oscillator() || rayleigh.is_some() || loss_factor > 0.0 || has_files;
    let damping_ratio = match reader.peek(&DAMPING_RATIO)? {
        Some(ratio) => ratio,
        None if has_other => 0.0,
        None => STEEL_DAMPING,
    };
    let is_nonlinear = contact.is_some() || !structure.springs().is_empty();
    let highest = harmonics.last().copied().unwrap_or(0);
    let at_frequency = reader.optional(&AT, None)?;
    Ok(Response {
        at: response,
        damping_ratio: reader.note(&DAMPING_RATIO, damping_ratio),
        loss_factor,
        rayleigh,
        damping_basis: reader.value(&DAMPING_BASIS)?,
        at_frequency,
        frequency: frequency(reader, structure, contact, drive.axis, at_frequency)?,
        points: reader.optional(&POINTS, None)?,
        harmonic_tolerance: fidelity::harmonic_tolerance(reader, fidelity, is_nonlinear)?,
        harmonic_correction: fidelity::harmonic_correction(reader, fidelity, is_nonlinear)?,
        samples: fidelity::samples(reader, fidelity, structure, highest)?,
        harmonics,
        forces,
        base,
        why: Reasons::default(),
    })
}

/// True if the forces of harmonic 1 cancel up to rounding, at every point and along every axis.
fn forces_cancel(forces: &[Force]) -> bool {
    let first = || forces.iter().filter(|force| force.harmonic == 1);
    let largest = first().fold(0.0_f64, |most, force| most.max(force.amplitude));
    first().all(|force| {
        let same = first().filter(|other| other.port == force.port);
        let (cosine, sine) = same.fold((0.0, 0.0), |(cosine, sine), other| {
            let (s, c) = other.phase.sin_cos();
            (cosine + other.amplitude * c, sine + other.amplitude * s)
        });
        cosine.hypot(sine) <= CANCELLED * largest
    })
}

/// Reads the Rayleigh damping. Returns `None` if the scene has no Rayleigh damping.
fn rayleigh(reader: &Reader<'_>) -> Result<Option<Rayleigh>> {
    if !reader.has(RAYLEIGH) {
        return Ok(None);
    }
    let rayleigh = Rayleigh {
        mass: reader.peek(&RAYLEIGH_MASS)?.unwrap_or_default(),
        stiffness: reader.peek(&RAYLEIGH_STIFFNESS)?.unwrap_or_default(),
    };
    if rayleigh == Rayleigh::default() {
        return Ok(None);
    }
    reader.note(&RAYLEIGH_MASS, rayleigh.mass);
    reader.note(&RAYLEIGH_STIFFNESS, rayleigh.stiffness);
    Ok(Some(rayleigh))
}

/// Reads the motion of the ground. Returns `None` if the scene has no ground motion.
fn base(reader: &Reader<'_>, structure: &Structure) -> Result<Option<Base>> {
    if !reader.has(BASE) {
        return Ok(None);
    }
    if !structure.is_oscillator() {
        return Err(reader.conflict(
            BASE,
            "only an oscillator can have a ground motion; drive a reduced structure with dynamics.force",
        ));
    }
    let motion = match (
        reader.get(&BASE_ACCELERATION)?,
        reader.get(&BASE_DISPLACEMENT)?,
    ) {
        (Some(acceleration), None) => BaseMotion::Acceleration(acceleration),
        (None, Some(displacement)) => BaseMotion::Displacement(displacement),
        (Some(_), Some(_)) => {
            return Err(reader.conflict(
                &BASE_DISPLACEMENT,
                "the ground has an acceleration already; give one or the other",
            ));
        }
        (None, None) => {
            return Err(reader.missing(&BASE_ACCELERATION, "   (or displacement)"));
        }
    };
    Ok(Some(Base {
        motion,
        axis: reader.value(&BASE_DIRECTION)?,
        phase: reader.value(&BASE_PHASE)?,
        harmonic: reader.value(&BASE_HARMONIC)? as u32,
    }))
}

/// Reads one force or a list of forces, each with its record.
fn forces(reader: &Reader<'_>, structure: &Structure) -> Result<Vec<(Force, Json)>> {
    let Some(list) = reader.tables(&FORCE)? else {
        let at = if structure.is_oscillator() {
            ""
        } else {
            " at = 17,"
        };
        return Err(match structure.resonator() {
            Some(_) => reader.missing(&FORCE, ""),
            None => reader.missing_line(
                &FORCE,
                format!("force = {{ amplitude = \"100 N\",{at} direction = \"x\" }}"),
            ),
        });
    };
    let read = |each: &Reader<'_>| -> Result<(Force, Json)> {
        let force = force(each, structure)?;
        Ok((force, each.record.part("dynamics", "force")))
    };
    let Some(tables) = list else {
        return read(&Reader::new(reader.root)).map(|force| vec![force]);
    };
    let read_table = |(at, table): (usize, Node)| {
        reader.check_section(FORCE.name, &table)?;
        let root = table.nested_under(&["dynamics", "force"]);
        read(&Reader::of_item(&root, FORCE.name, at))
    };
    tables.into_iter().enumerate().map(read_table).collect()
}

fn force(reader: &Reader<'_>, structure: &Structure) -> Result<Force> {
    let points = points(structure);
    let at = match (reader.point(&FORCE_AT, points)?, points.first()) {
        (Some(at), _) => at,
        (None, Some(usual)) => (*usual).to_owned(),
        (None, None) => {
            return Err(reader.missing_line(&FORCE_AT, "at = 17   # a node, or a set of nodes"));
        }
    };
    let port = Port {
        at: reader.note(&FORCE_AT, at),
        axis: reader.value(&FORCE_DIRECTION)?,
    };
    let harmonic = reader.value(&FORCE_HARMONIC)? as u32;
    let amplitude = reader.required(&FORCE_AMPLITUDE)?;
    if amplitude == 0.0 {
        return Err(
            reader.out_of_range(&FORCE_AMPLITUDE, "other than zero; remove a force of zero")
        );
    }
    if amplitude < 0.0 && harmonic > 0 {
        return Err(reader.out_of_range(
            &FORCE_AMPLITUDE,
            "greater than zero; use phase = \"180 deg\" for an opposite force",
        ));
    }
    let phase = reader.value(&FORCE_PHASE)?;
    if harmonic == 0 && phase != 0.0 {
        return Err(reader.conflict(
            &FORCE_PHASE,
            "harmonic = 0 is a constant force, which has no phase; remove the phase",
        ));
    }
    Ok(Force {
        amplitude,
        port,
        phase,
        harmonic,
    })
}

/// Reads the harmonics, in ascending order.
fn harmonics(reader: &Reader<'_>, forces: &[Force], base: Option<Base>) -> Result<Vec<u32>> {
    let expected = HARMONICS.value.1;
    let mut orders = match reader.peek(&HARMONICS)? {
        None => {
            let driven = forces.iter().map(|force| force.harmonic);
            let driven = driven.chain(base.map(|base| base.harmonic));
            let mut orders: Vec<u32> = FIRST_HARMONICS.into_iter().chain(driven).collect();
            orders.sort_unstable();
            orders.dedup();
            orders
        }
        Some(orders) => orders
            .into_iter()
            .map(|order| {
                u32::try_from(order)
                    .ok()
                    .filter(|_| order <= LARGEST_HARMONIC)
                    .ok_or_else(|| reader.out_of_range(&HARMONICS, expected))
            })
            .collect::<Result<Vec<u32>>>()?,
    };
    orders.sort_unstable();
    if !orders.starts_with(&[0, 1]) {
        return Err(reader.out_of_range(&HARMONICS, expected));
    }
    if let Some(force) = forces.iter().find(|f| !orders.contains(&f.harmonic)) {
        return Err(reader.conflict(
            &FORCE,
            format!(
                "harmonic {} is not in dynamics.harmonics = {orders:?}; add it there",
                force.harmonic
            ),
        ));
    }
    if base.is_some_and(|base| !orders.contains(&base.harmonic)) {
        return Err(reader.conflict(
            &BASE_HARMONIC,
            format!("it is not in dynamics.harmonics = {orders:?}; add it there"),
        ));
    }
    reader.record.note(HARMONICS.name, json!(orders));
    Ok(orders)
}

/// Reads the frequency range of the resonance and of the forced response. If the frequency `at` is given, the range is
/// optional.
fn frequency(
    reader: &Reader<'_>,
    structure: &Structure,
    contact: Option<&Contact>,
    axis: usize,
    at: Option<f64>,
) -> Result<Option<[f64; 2]>> {
    if let Some([low, high]) = reader.get(&FREQUENCY)? {
        return if low < high {
            Ok(Some([low, high]))
        } else {
            let expected =
                "a list with the lower frequency first, such as [\"900 Hz\", \"1050 Hz\"]";
            Err(reader.out_of_range(&FREQUENCY, expected))
        };
    }
    let missing = || match at {
        Some(_) => Ok(None),
        None => Err(reader.missing(&FREQUENCY, "")),
    };
    let Some([mass, _, stiffness]) = structure.oscillator_along(axis) else {
        return missing();
    };
    let spring = match contact.map(|contact| contact.elements) {
        Some(ElementStiffness::Given { kn, .. }) if axis == 2 => kn,
        Some(ElementStiffness::Given { kt, .. }) => kt,
        _ => 0.0,
    };
    let natural = |stiffness: f64| (stiffness / mass).sqrt() / TAU;
    let [free, stuck] = [natural(stiffness), natural(stiffness + spring)];
    let low = if free > 0.0 {
        FROM_FREE * free
    } else {
        FROM_STUCK * stuck
    };
    if low > 0.0 {
        Ok(Some(reader.note(&FREQUENCY, [low, TO_STUCK * stuck])))
    } else {
        missing()
    }
}
