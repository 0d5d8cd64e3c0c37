//! `[dynamics]`: what drives the structure and what of its response is wanted.

use std::f64::consts::TAU;

use super::Result;
use crate::scene::document::Node;
use crate::scene::keys::dynamics::*;
use crate::scene::keys::structure::DAMPING;
use crate::scene::reader::Reader;
use crate::scene::{Base, BaseMotion, Contact, Dynamics, Force, Port, Rayleigh, Structure};

/// Directions of motion of an oscillator, all of which it keeps.
const OSCILLATOR_MODES: usize = 3;
/// Harmonics unless the scene says otherwise [A §3].
const FIRST_HARMONICS: [u32; 4] = [0, 1, 2, 3];
/// Modal damping ratio of a bolted steel structure unless the scene says otherwise. The published case does not state its own.
const STEEL_DAMPING: f64 = 0.002;
/// Where the forced response of an oscillator begins unless the scene says otherwise: at this share of the natural frequency without the
/// contact.
const FROM_FREE: f64 = 0.5;
/// Where the forced response of an oscillator begins unless the scene says otherwise and nothing holds it without the contact: at this
/// share of the natural frequency with the contact's springs.
const FROM_STUCK: f64 = 0.3;
/// Where the forced response of an oscillator ends unless the scene says otherwise: at this share of the natural frequency with the
/// contact's springs.
const TO_STUCK: f64 = 1.5;
/// Share of the largest force that a sum of several leaves by rounding.
const CANCELLED: f64 = 1e-14;

/// The section on the motion of the ground.
const BASE: &str = "dynamics.base";
/// The section on damping by mass and stiffness.
const RAYLEIGH: &str = "dynamics.rayleigh";

/// Points of a structure at which forces act and displacements are read, the usual one first.
fn points(structure: &Structure) -> &'static [&'static str] {
    structure.points()
}

pub(super) fn dynamics(
    reader: &Reader<'_>,
    structure: &Structure,
    contact: Option<&Contact>,
) -> Result<Dynamics> {
    let is_oscillator = structure.is_oscillator();
    let base = base(reader, structure)?;
    let forces = match reader.has(&FORCE) || base.is_none() {
        true => forces(reader, structure)?,
        false => Vec::new(),
    };
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
    if base.is_none() && cancel(&forces) {
        return Err(reader.conflict(
            &FORCE,
            "the forces of harmonic 1 cancel each other, so that nothing drives the structure; change an amplitude or a phase",
        ));
    }
    let response = Port {
        at: reader
            .point(&RESPONSE_AT, points(structure))?
            .unwrap_or_else(|| drive.at.clone()),
        axis: reader.get(&RESPONSE_DIRECTION)?.unwrap_or(drive.axis),
    };
    let harmonics = harmonics(reader, &forces, base)?;
    let rayleigh = rayleigh(reader)?;
    if is_oscillator && reader.has(&MODES) {
        return Err(reader.conflict(
            &MODES,
            "an oscillator is not reduced to modes; leave it out",
        ));
    }
    Ok(Dynamics {
        response,
        harmonics,
        modes: if is_oscillator {
            OSCILLATOR_MODES
        } else {
            reader.value(&MODES)?
        },
        has_damping_ratio: reader.has(&DAMPING_RATIO),
        damping_ratio: reader.get(&DAMPING_RATIO)?.unwrap_or(
            if is_oscillator || rayleigh.is_some() || reader.has(&DAMPING) {
                0.0
            } else {
                STEEL_DAMPING
            },
        ),
        rayleigh,
        damping_basis: reader.value(&DAMPING_BASIS)?,
        friction_law: reader.value(&FRICTION_LAW)?,
        frequency: frequency(reader, structure, contact, drive.axis)?,
        points: reader.get(&POINTS)?,
        forces,
        base,
    })
}

/// Whether what the forces of harmonic 1 add up to is rounding, at every point and along every axis.
fn cancel(forces: &[Force]) -> bool {
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

/// Damping by mass and stiffness, where the scene has any.
fn rayleigh(reader: &Reader<'_>) -> Result<Option<Rayleigh>> {
    if !reader.has(RAYLEIGH) {
        return Ok(None);
    }
    let rayleigh = Rayleigh {
        mass: reader.value(&RAYLEIGH_MASS)?,
        stiffness: reader.value(&RAYLEIGH_STIFFNESS)?,
    };
    Ok((rayleigh != Rayleigh::default()).then_some(rayleigh))
}

/// The motion of the ground, where the scene has one.
fn base(reader: &Reader<'_>, structure: &Structure) -> Result<Option<Base>> {
    if !reader.has(BASE) {
        return Ok(None);
    }
    if !structure.is_oscillator() {
        return Err(reader.conflict(
            BASE,
            "the motion of the ground is that of an oscillator; drive a reduced structure with dynamics.force",
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

/// One force, or a list of them.
fn forces(reader: &Reader<'_>, structure: &Structure) -> Result<Vec<Force>> {
    let Some(list) = reader.get(&FORCE)? else {
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
    let Some(tables) = list else {
        return Ok(vec![force(reader, structure)?]);
    };
    let read = |(at, table): (usize, Node)| {
        reader.check_section(FORCE.name, &table)?;
        let root = table.below(&["dynamics", "force"]);
        force(&Reader::of_item(&root, FORCE.name, at), structure)
    };
    tables.into_iter().enumerate().map(read).collect()
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
        at,
        axis: reader.value(&FORCE_DIRECTION)?,
    };
    let harmonic = reader.value(&FORCE_HARMONIC)? as u32;
    let amplitude = reader.required(&FORCE_AMPLITUDE)?;
    if amplitude == 0.0 {
        return Err(reader.out_of_range(
            &FORCE_AMPLITUDE,
            "other than zero: a force of nothing drives nothing; leave it out",
        ));
    }
    if amplitude < 0.0 && harmonic > 0 {
        return Err(reader.out_of_range(
            &FORCE_AMPLITUDE,
            "greater than zero; an opposite force has phase = \"180 deg\"",
        ));
    }
    let phase = reader.value(&FORCE_PHASE)?;
    if harmonic == 0 && phase != 0.0 {
        return Err(reader.conflict(
            &FORCE_PHASE,
            "harmonic = 0 is a constant force, which has no phase; leave it out",
        ));
    }
    Ok(Force {
        amplitude,
        port,
        phase,
        harmonic,
    })
}

/// In ascending order.
fn harmonics(reader: &Reader<'_>, forces: &[Force], base: Option<Base>) -> Result<Vec<u32>> {
    let expected = HARMONICS.value.1;
    let mut orders = match reader.get(&HARMONICS)? {
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
    Ok(orders)
}

fn frequency(
    reader: &Reader<'_>,
    structure: &Structure,
    contact: Option<&Contact>,
    axis: usize,
) -> Result<[f64; 2]> {
    if let Some([low, high]) = reader.get(&FREQUENCY)? {
        return if low < high {
            Ok([low, high])
        } else {
            let expected =
                "a list with the lower frequency first, such as [\"900 Hz\", \"1050 Hz\"]";
            Err(reader.out_of_range(&FREQUENCY, expected))
        };
    }
    let missing = || reader.missing(&FREQUENCY, "");
    let Some([mass, _, stiffness]) = structure.oscillator_along(axis) else {
        return Err(missing());
    };
    let spring = contact
        .and_then(|contact| contact.given)
        .map_or(0.0, |given| if axis == 2 { given.kn } else { given.kt });
    let natural = |stiffness: f64| (stiffness / mass).sqrt() / TAU;
    let [free, stuck] = [natural(stiffness), natural(stiffness + spring)];
    let low = if free > 0.0 {
        FROM_FREE * free
    } else {
        FROM_STUCK * stuck
    };
    if low > 0.0 {
        Ok([low, TO_STUCK * stuck])
    } else {
        Err(missing())
    }
}
