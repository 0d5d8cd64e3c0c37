//! `[contact]`: of a rough surface, or of given stiffness.

use super::{Body, Result};
use crate::scene::reader::{ANY, NOT_NEGATIVE, POSITIVE, Reader};
use crate::scene::{
    Boundary, Contact, Distribution, GivenContact, Rotation, Stiffness, Transverse, keys,
};
use crate::units::Dimension;

const CONTACT_EXAMPLE: &str = "[contact]\nnormal_load = \"30 kN\"";
const VIBRATING_EXAMPLE: &str = "[contact]\nfriction_coefficient = 0.6\nnormal_load = \"30 kN\"";
const SURFACE_EXAMPLE: &str =
    "[surface]\nkind = \"gaussian\"\nrq = \"5 um\"\ncorrelation_length = [\"0.5 mm\", \"0.5 mm\"]";

/// Keys that only the contact of a surface has.
const OF_A_SURFACE: [&str; 9] = [
    "approach",
    "pressure_cap",
    "boundary",
    "transverse",
    "rotation",
    "moment",
    "stiffness",
    "distribution",
    "bolt_stiffness",
];

pub(super) fn contact(reader: &Reader<'_>, body: Body) -> Result<Option<Contact>> {
    let has_surface = reader.has("surface");
    if body == Body::Oscillator && has_surface {
        let reason =
            "an oscillator has no joint that could be rough; give contact.kn and contact.kt";
        return Err(reader.misplaced("surface", reason));
    }
    if !reader.has("contact") {
        let purpose = "the load on the joint";
        return match (body, has_surface) {
            (Body::Joint, _) => Err(reader.missing_section("contact", purpose, CONTACT_EXAMPLE)),
            (_, true) => Err(reader.missing_section("contact", purpose, VIBRATING_EXAMPLE)),
            (_, false) if reader.has("wear") && body == Body::Resonator => {
                let purpose = "[wear] needs it: a bonded joint does not wear";
                Err(reader.missing_section("contact", purpose, VIBRATING_EXAMPLE))
            }
            (_, false) => Ok(None),
        };
    }
    for name in ["kn", "kt"] {
        let key = keys::join("contact", name);
        if !reader.has(&key) {
            continue;
        }
        if body == Body::Joint {
            return Err(reader.conflict(
                &key,
                "a contact of given stiffness is part of a structure; add [structure] and [dynamics], or give [surface], from which the contact stiffness is computed",
            ));
        }
        if has_surface {
            return Err(reader.conflict(
                &key,
                "[surface] is there, from which the contact stiffness is computed; give one or the other",
            ));
        }
        return given(reader).map(Some);
    }
    match body {
        Body::Oscillator => {
            return Err(reader.missing("contact.kn", "kn = \"12 N/um\""));
        }
        Body::Resonator if !has_surface => {
            return Err(reader.missing_section(
                "surface",
                "the heights of the contact; contact.kn and contact.kt may take its place",
                SURFACE_EXAMPLE,
            ));
        }
        _ => {}
    }
    if reader.has("contact.gap") {
        return Err(reader.conflict(
            "contact.gap",
            "the gap follows from the surface; it is given only together with contact.kn and contact.kt",
        ));
    }
    rough(reader, body).map(Some)
}

fn rough(reader: &Reader<'_>, body: Body) -> Result<Contact> {
    let vibrates = body != Body::Joint;
    let friction_coefficient = reader.quantity(
        "contact.friction_coefficient",
        Dimension::NONE,
        NOT_NEGATIVE,
        "0.6",
    )?;
    if vibrates && friction_coefficient.is_none() {
        return Err(reader.missing("contact.friction_coefficient", "friction_coefficient = 0.6"));
    }
    let (normal_load, approach) = load_or_approach(reader, vibrates)?;
    let stiffness = reader
        .choice(
            "contact.stiffness",
            &[
                ("total", Stiffness::Total),
                ("roughness", Stiffness::Roughness),
                ("tangent", Stiffness::Tangent),
            ],
        )?
        .unwrap_or(Stiffness::Total);
    let distribution = reader.choice(
        "contact.distribution",
        &[
            ("uniform", Distribution::Uniform),
            ("by_load", Distribution::ByLoad),
        ],
    )?;
    let needs_structure = "it is about the contact elements of a structure, and there is none; add [structure] and [dynamics], or leave it out";
    if !vibrates && stiffness != Stiffness::Total {
        return Err(reader.conflict("contact.stiffness", needs_structure));
    }
    if !vibrates && distribution == Some(Distribution::ByLoad) {
        return Err(reader.conflict("contact.distribution", needs_structure));
    }
    if stiffness == Stiffness::Tangent && distribution.is_some() {
        return Err(reader.conflict(
            "contact.distribution",
            "contact.stiffness = \"tangent\" gives each element its own stiffness; leave distribution out",
        ));
    }
    let bolt_stiffness = reader.quantity(
        "contact.bolt_stiffness",
        Dimension::STIFFNESS,
        POSITIVE,
        "\"500 N/um\"",
    )?;
    if bolt_stiffness.is_some() && !reader.has("wear") {
        return Err(reader.conflict(
            "contact.bolt_stiffness",
            "it makes the load fall as the joint wears, and there is no [wear]; leave it out",
        ));
    }
    let boundary = reader
        .choice(
            "contact.boundary",
            &[("free", Boundary::Free), ("periodic", Boundary::Periodic)],
        )?
        .unwrap_or(Boundary::Free);
    let (rotation, moment) = rotation(reader, boundary)?;
    Ok(Contact {
        friction_coefficient,
        normal_load,
        approach,
        given: None,
        stiffness,
        distribution: distribution.unwrap_or(Distribution::Uniform),
        bolt_stiffness,
        pressure_cap: reader.quantity(
            "contact.pressure_cap",
            Dimension::PRESSURE,
            POSITIVE,
            "\"600 MPa\"",
        )?,
        boundary,
        transverse: transverse(reader, vibrates)?,
        rotation,
        moment,
    })
}

/// What presses the bodies together: a load, or for a contact that does not move the approach.
fn load_or_approach(reader: &Reader<'_>, vibrates: bool) -> Result<(f64, Option<f64>)> {
    const LOAD: &str = "contact.normal_load";
    const APPROACH: &str = "contact.approach";
    let load = reader.quantity(LOAD, Dimension::FORCE, POSITIVE, "\"30 kN\"")?;
    let approach = reader.quantity(APPROACH, Dimension::LENGTH, ANY, "\"2 um\"")?;
    let moves = vibrates || reader.has("motion");
    match (load, approach) {
        (None, None) if moves => Err(reader.missing(LOAD, "normal_load = \"30 kN\"")),
        (None, None) => Err(reader.missing(
            LOAD,
            "normal_load = \"30 kN\"   (or approach = \"2 um\")",
        )),
        (Some(_), Some(_)) => Err(reader.conflict(
            APPROACH,
            "contact.normal_load presses the bodies together already; give one or the other",
        )),
        (Some(load), None) => Ok((load, None)),
        (None, Some(_)) if moves => Err(reader.conflict(
            APPROACH,
            "it presses a contact that does not move; with [motion] or [dynamics] give contact.normal_load",
        )),
        (None, approach) => Ok((0.0, approach)),
    }
}

fn transverse(reader: &Reader<'_>, vibrates: bool) -> Result<Transverse> {
    const KEY: &str = "contact.transverse";
    let words = [
        ("absent", Transverse::Absent),
        ("fixed", Transverse::Fixed),
        ("free", Transverse::Free),
    ];
    let transverse = reader.choice(KEY, &words)?.unwrap_or(Transverse::Fixed);
    if vibrates && transverse == Transverse::Free {
        return Err(reader.conflict(
            KEY,
            "[dynamics] computes the displacement along y too; use \"fixed\", which follows it, or \"absent\"",
        ));
    }
    Ok(transverse)
}

/// What the bodies' rotations about x and y do, and the moments of free ones.
fn rotation(reader: &Reader<'_>, boundary: Boundary) -> Result<(Rotation, Option<[f64; 2]>)> {
    const KEY: &str = "contact.rotation";
    let words = [("fixed", Rotation::Fixed), ("free", Rotation::Free)];
    let rotation = reader.choice(KEY, &words)?.unwrap_or(Rotation::Fixed);
    if rotation == Rotation::Free && boundary == Boundary::Periodic {
        return Err(reader.conflict(
            KEY,
            "with contact.boundary = \"periodic\" a turned body would not repeat itself; use \"fixed\"",
        ));
    }
    let moment = reader.pair(
        "contact.moment",
        Dimension::MOMENT,
        ANY,
        None,
        "[\"2 N m\", \"0 N m\"]",
    )?;
    if moment.is_some() && rotation == Rotation::Fixed {
        return Err(reader.conflict(
            "contact.moment",
            "with contact.rotation = \"fixed\" the moments are found and reported; use \"free\", or leave moment out",
        ));
    }
    Ok((rotation, moment))
}

fn given(reader: &Reader<'_>) -> Result<Contact> {
    for name in OF_A_SURFACE {
        let key = keys::join("contact", name);
        if reader.has(&key) {
            return Err(reader.conflict(
                &key,
                "it is about the contact of a rough surface, and contact.kn and contact.kt are given instead; leave it out",
            ));
        }
    }
    let stiffness = |key| reader.quantity(key, Dimension::STIFFNESS, NOT_NEGATIVE, "\"1e4 N/um\"");
    let kn = stiffness("contact.kn")?
        .ok_or_else(|| reader.missing("contact.kn", "kn = \"1.2e4 N/um\""))?;
    let kt = stiffness("contact.kt")?
        .ok_or_else(|| reader.missing("contact.kt", "kt = \"1e4 N/um\""))?;
    let gap = reader
        .quantity("contact.gap", Dimension::LENGTH, NOT_NEGATIVE, "\"1 um\"")?
        .unwrap_or(0.0);
    let normal_load = reader.quantity(
        "contact.normal_load",
        Dimension::FORCE,
        NOT_NEGATIVE,
        "\"30 kN\"",
    )?;
    let normal_load = match normal_load {
        Some(load) if load > 0.0 && gap > 0.0 => {
            return Err(reader.conflict(
                "contact.gap",
                "a contact that is open at rest bears no contact.normal_load; give one or the other",
            ));
        }
        Some(load) => load,
        None if gap > 0.0 => 0.0,
        None => {
            return Err(reader.missing("contact.normal_load", "normal_load = \"30 kN\""));
        }
    };
    if kn == 0.0 && (kt == 0.0 || normal_load == 0.0) {
        return Err(reader.conflict(
            "contact.kn",
            "without a normal stiffness the contact bears nothing unless contact.kt and contact.normal_load are greater than zero; give them, or leave [contact] out",
        ));
    }
    let friction_coefficient = reader.quantity(
        "contact.friction_coefficient",
        Dimension::NONE,
        NOT_NEGATIVE,
        "0.6",
    )?;
    if friction_coefficient.is_none() && kt > 0.0 {
        return Err(reader.missing("contact.friction_coefficient", "friction_coefficient = 0.6"));
    }
    Ok(Contact {
        friction_coefficient,
        normal_load,
        approach: None,
        given: Some(GivenContact { kn, kt, gap }),
        stiffness: Stiffness::Total,
        distribution: Distribution::Uniform,
        bolt_stiffness: None,
        pressure_cap: None,
        boundary: Boundary::Free,
        transverse: Transverse::Fixed,
        rotation: Rotation::Fixed,
        moment: None,
    })
}
