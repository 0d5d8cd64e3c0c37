//! Resolves `[contact]`: a rough contact, or a contact of given stiffness.

use super::{All, Body, Result};
use crate::contact::normal::Rotation;
use crate::model_update::{BoltedJoint, metric_thread};
use crate::recipe::{Conditions, ElementStiffness};
use crate::scene::keys::{contact::*, fidelity::PRESET, lines};
use crate::scene::reader::Reader;
use crate::scene::{
    Boundary, Contact, Distribution, ElementFile, Preload, Pressing, Stiffness, Transverse,
};

pub(super) fn contact(reader: &Reader<'_>, body: Body) -> Result<Option<Contact>> {
    let has_surface = reader.has("surface");
    if body == Body::Oscillator && has_surface {
        let reason =
            "an oscillator has no joint that could be rough; give contact.kn and contact.kt";
        return Err(reader.misplaced("surface", reason));
    }
    if !reader.has("contact") {
        let purpose = "the load on the joint";
        let load = NORMAL_LOAD.line();
        let friction = lines(&[&FRICTION_COEFFICIENT, &NORMAL_LOAD]);
        return match (body, has_surface) {
            (Body::Joint, _) => Err(reader.missing_section("contact", purpose, &load)),
            (Body::Matrices, true) => {
                let purpose = "the load on the joint; or remove [surface], [wear] and [update] for a bonded joint";
                Err(reader.missing_section("contact", purpose, &friction))
            }
            (_, true) => Err(reader.missing_section("contact", purpose, &friction)),
            (_, false) if reader.has("wear") && body != Body::Oscillator => {
                let purpose = "[wear] needs it: a bonded joint does not wear";
                Err(reader.missing_section("contact", purpose, &friction))
            }
            (_, false) => Ok(None),
        };
    }
    if reader.has(&ELEMENTS) {
        return table_contact(reader, body).map(Some);
    }
    for key in [&KN, &KT] {
        if !reader.has(key) {
            continue;
        }
        if body == Body::Joint {
            return Err(reader.conflict(
                key,
                "a contact of given stiffness is part of a structure; add [structure] and [dynamics], or give [surface], from which the contact stiffness is computed",
            ));
        }
        if has_surface {
            return Err(reader.conflict(
                key,
                "the contact stiffness is already computed from [surface]; give one or the other",
            ));
        }
        return stiffness_contact(reader).map(Some);
    }
    match body {
        Body::Oscillator => {
            return Err(reader.missing_line(&KN, "kn = \"12 N/um\""));
        }
        Body::Resonator | Body::Matrices if !has_surface => {
            return Err(reader.missing_section(
                "surface",
                "the heights of the contact; contact.kn and contact.kt may take its place",
                &super::surface::first_lines(),
            ));
        }
        _ => {}
    }
    if reader.has(&GAP) {
        return Err(reader.conflict(
            &GAP,
            "the gap follows from the surface; it is given only together with contact.kn and contact.kt",
        ));
    }
    rough(reader, body).map(Some)
}

fn rough(reader: &Reader<'_>, body: Body) -> Result<Contact> {
    let vibrates = body != Body::Joint;
    let friction_coefficient = match reader.optional(&FRICTION_COEFFICIENT, None) {
        Ok(None) if vibrates || reader.has("motion") => {
            Err(reader.missing(&FRICTION_COEFFICIENT, ""))
        }
        read => read,
    };
    let boundary = reader.value(&BOUNDARY)?;
    let (friction_coefficient, load, pressed_by, elements, transverse, rotation) = (
        friction_coefficient,
        load_or_approach(reader, body),
        pressed_by(reader, vibrates),
        element_law(reader, vibrates, boundary),
        transverse(reader, vibrates),
        rotation(reader, boundary),
    )
        .all()?;
    let (normal_load, approach, preload) = load;
    let bolt_stiffness = reader.optional(&BOLT_STIFFNESS, None)?;
    let without_wear =
        "it makes the load fall as the joint wears, but there is no [wear]; remove it";
    if bolt_stiffness.is_some() && !reader.has("wear") {
        return Err(reader.conflict(&BOLT_STIFFNESS, without_wear));
    }
    let bolt = bolt(reader)?;
    if bolt.is_some() && !reader.has("wear") {
        return Err(reader.misplaced("contact.bolt", without_wear));
    }
    if bolt.is_some() && bolt_stiffness.is_some() {
        return Err(reader.conflict(
            &BOLT_STIFFNESS,
            "contact.bolt determines the stiffness of the bolt already; give one or the other",
        ));
    }
    Ok(Contact {
        friction_coefficient,
        transverse,
        conditions: Some(Conditions {
            boundary,
            pressure_cap: reader.optional(&PRESSURE_CAP, None)?,
            normal_load,
            approach,
            bolt_stiffness,
            rotation,
        }),
        preload,
        bolt,
        pressed_by,
        elements,
        table: None,
    })
}

/// Reads the dimensions of the bolt in `[contact.bolt]`. The plan later sets the modulus of the clamped parts to the
/// modulus of the lower body.
fn bolt(reader: &Reader<'_>) -> Result<Option<BoltedJoint>> {
    if !reader.has("contact.bolt") {
        return Ok(None);
    }
    let size = reader.get(&BOLT_SIZE)?;
    let (diameter, core) = (
        reader.get(&BOLT_DIAMETER)?,
        reader.get(&BOLT_CORE_DIAMETER)?,
    );
    let [diameter, core_diameter] = match (size, diameter, core) {
        (Some(size), None, None) => metric_thread(&size).ok_or_else(|| {
            let expected = "a metric thread, such as M10, or M10x1.25 with its pitch; for another thread give diameter and core_diameter";
            reader.out_of_range(&BOLT_SIZE, expected)
        })?,
        (None, Some(diameter), Some(core)) => [diameter, core],
        (None, Some(_), None) => return Err(reader.missing(&BOLT_CORE_DIAMETER, "")),
        (None, None, Some(_)) => return Err(reader.missing(&BOLT_DIAMETER, "")),
        (None, None, None) => return Err(reader.missing(&BOLT_SIZE, "")),
        (Some(_), ..) => {
            return Err(reader.conflict(&BOLT_SIZE, "a thread size determines both diameters; remove diameter and core_diameter"));
        }
    };
    let (clamp_length, bearing_diameter, hole_diameter, outer_diameter) = (
        reader.required(&BOLT_CLAMP_LENGTH),
        reader.required(&BOLT_BEARING_DIAMETER),
        reader.required(&BOLT_HOLE),
        reader.required(&BOLT_OUTER_DIAMETER),
    )
        .all()?;
    let bolt = BoltedJoint {
        diameter,
        core_diameter,
        clamp_length,
        shank_length: reader.value(&BOLT_SHANK_LENGTH)?,
        bearing_diameter,
        hole_diameter,
        outer_diameter,
        bolt_modulus: reader.value(&BOLT_MODULUS)?,
        plate_modulus: f64::NAN,
        head: reader.value(&BOLT_HEAD)?,
        clamping: reader.value(&BOLT_JOINT)?,
    };
    Ok(Some(bolt))
}

/// Reads how the bodies are to press each other.
fn pressed_by(reader: &Reader<'_>, vibrates: bool) -> Result<Pressing> {
    if !vibrates && reader.peek(&PRESSING)? == Some(Pressing::Structure) {
        let reason = "there is no structure; add [structure] and [dynamics], or remove the key";
        return Err(reader.conflict(&PRESSING, reason));
    }
    let chosen = (!vibrates).then_some(Pressing::Punch);
    reader.value_or(&PRESSING, chosen, reader.value(&PRESET)?)
}

/// Reads the law of the contact elements of a structure, and how they share a common stiffness.
fn element_law(
    reader: &Reader<'_>,
    vibrates: bool,
    boundary: Boundary,
) -> Result<ElementStiffness> {
    let given_stiffness = reader.peek(&STIFFNESS)?;
    let distribution = reader.value(&DISTRIBUTION)?;
    let needs_structure = "it applies to the contact elements of a structure, but there is none; add [structure] and [dynamics], or remove the key";
    if !vibrates && given_stiffness.is_some_and(|stiffness| stiffness != Stiffness::Total) {
        return Err(reader.conflict(&STIFFNESS, needs_structure));
    }
    if !vibrates && distribution != Distribution::Uniform {
        return Err(reader.conflict(&DISTRIBUTION, needs_structure));
    }
    // A periodic joint has no mesh whose compliance could be subtracted from half spaces.
    let needs_total = !vibrates || boundary == Boundary::Periodic;
    let chosen = needs_total.then_some(Stiffness::Total);
    let stiffness = reader.value_or(&STIFFNESS, chosen, reader.value(&PRESET)?)?;
    let own_law = match stiffness {
        Stiffness::Tangent => Some("tangent"),
        Stiffness::Sliders => Some("sliders"),
        Stiffness::Total | Stiffness::Roughness => None,
    };
    if let (Some(word), true) = (own_law, reader.has(&DISTRIBUTION)) {
        let default = if given_stiffness.is_none() {
            ", its default,"
        } else {
            ""
        };
        return Err(reader.conflict(
            &DISTRIBUTION,
            format!("contact.stiffness = \"{word}\"{default} gives each element its own stiffness; remove distribution, or add stiffness = \"total\""),
        ));
    }
    if stiffness == Stiffness::Sliders && boundary == Boundary::Periodic {
        return Err(reader.conflict(
            &BOUNDARY,
            "contact.stiffness = \"sliders\" subtracts the compliance of the structure's mesh from half spaces with a free surface; use \"free\", or stiffness = \"total\"",
        ));
    }
    Ok(ElementStiffness::Contact {
        stiffness,
        distribution,
    })
}

/// Reads what presses the bodies together: a load, or the approach of a contact that does not move.
fn load_or_approach(
    reader: &Reader<'_>,
    body: Body,
) -> Result<(f64, Option<f64>, Option<Preload>)> {
    let vibrates = body != Body::Joint;
    if let Some((force, preload)) = preload(reader, body)? {
        reader.note(&NORMAL_LOAD, force);
        return Ok((force, None, Some(preload)));
    }
    let load = reader.get(&NORMAL_LOAD)?;
    let approach = reader.get(&APPROACH)?;
    let moves = vibrates || reader.has("motion");
    match (load, approach) {
        (None, None) if moves => Err(reader.missing(&NORMAL_LOAD, "")),
        (None, None) => Err(reader.missing(&NORMAL_LOAD, "   (or approach = \"2 um\")")),
        (Some(_), Some(_)) => Err(reader.conflict(
            &APPROACH,
            "contact.normal_load presses the bodies together already; give one or the other",
        )),
        (Some(load), None) => Ok((load, None, None)),
        (None, Some(_)) if moves => Err(reader.conflict(
            &APPROACH,
            "it is only for a contact that does not move; with [motion] or [dynamics] give contact.normal_load",
        )),
        (None, approach) => Ok((reader.note(&NORMAL_LOAD, 0.0), approach, None)),
    }
}

/// Reads the preload at two places of a structure, and its force \[N\].
fn preload(reader: &Reader<'_>, body: Body) -> Result<Option<(f64, Preload)>> {
    if !reader.has("contact.preload") {
        return Ok(None);
    }
    for (key, reason) in [
        (
            &NORMAL_LOAD,
            "contact.preload.force is the load already; give one or the other",
        ),
        (
            &APPROACH,
            "contact.preload presses the bodies together already; give one or the other",
        ),
    ] {
        if reader.has(key) {
            return Err(reader.conflict(key, reason));
        }
    }
    if body != Body::Matrices {
        let reason = "it names sets of nodes of a structure of kind = \"mesh\" or \"matrices\", but this scene has none; give contact.normal_load";
        return Err(reader.misplaced("contact.preload", reason));
    }
    let (force, head, nut, in_mesh) = (
        reader.required(&PRELOAD_FORCE),
        reader.required(&PRELOAD_HEAD),
        reader.required(&PRELOAD_NUT),
        reader.value(&PRELOAD_IN_MESH),
    )
        .all()?;
    let ends = [head, nut];
    Ok(Some((force, Preload { ends, in_mesh })))
}

fn transverse(reader: &Reader<'_>, vibrates: bool) -> Result<Transverse> {
    let transverse = reader.value(&TRANSVERSE)?;
    if vibrates && transverse == Transverse::Free {
        return Err(reader.conflict(
            &TRANSVERSE,
            "[dynamics] computes the displacement along y too; use \"fixed\", which follows it, or \"absent\"",
        ));
    }
    Ok(transverse)
}

/// Reads the rotations of the bodies about x and y.
fn rotation(reader: &Reader<'_>, boundary: Boundary) -> Result<Rotation> {
    let rotation = reader.value(&ROTATION)?;
    if rotation != Rotation::FIXED && boundary == Boundary::Periodic {
        return Err(reader.conflict(
            &ROTATION,
            "with contact.boundary = \"periodic\" a rotated body would not be periodic; use \"fixed\"",
        ));
    }
    match reader.get(&MOMENT)? {
        Some(_) if rotation == Rotation::FIXED => Err(reader.conflict(
            &MOMENT,
            "with contact.rotation = \"fixed\" the moments are computed and reported; use \"free\", or remove moment",
        )),
        Some(moment) => Ok(Rotation::Free { moment }),
        None => Ok(rotation),
    }
}

/// Reads a contact whose elements are in a table. The table itself is read later.
fn table_contact(reader: &Reader<'_>, body: Body) -> Result<Contact> {
    let in_table = "the table of contact.elements gives it for each contact element; remove it";
    if body == Body::Joint {
        let reason = "contact elements are part of a structure; add [structure] and [dynamics], or give [surface] instead";
        return Err(reader.conflict(&ELEMENTS, reason));
    }
    if reader.has("surface") {
        let reason =
            "the contact elements are already computed from [surface]; give one or the other";
        return Err(reader.conflict(&ELEMENTS, reason));
    }
    for section in ["contact.preload", "contact.bolt"] {
        if reader.has(section) {
            return Err(reader.misplaced(section, in_table));
        }
    }
    for key in [
        KN.name,
        KT.name,
        GAP.name,
        NORMAL_LOAD.name,
        FRICTION_COEFFICIENT.name,
    ] {
        if reader.has(key) {
            return Err(reader.conflict(key, in_table));
        }
    }
    reader.refuse_form("contact", "rough", in_table)?;
    note_rough(reader)?;
    Ok(Contact {
        friction_coefficient: None,
        transverse: reader.value(&TRANSVERSE)?,
        conditions: None,
        preload: None,
        bolt: None,
        pressed_by: Pressing::Punch,
        elements: ElementStiffness::Given {
            kn: 0.0,
            kt: 0.0,
            gap: 0.0,
            normal_load: 0.0,
        },
        table: Some(ElementFile {
            path: reader.required(&ELEMENTS)?,
            table: None,
        }),
    })
}

/// Records the keys of a rough contact with their defaults, because the record always has them.
fn note_rough(reader: &Reader<'_>) -> Result<()> {
    reader.note(&STIFFNESS, Stiffness::Total);
    reader.note(&PRESSING, Pressing::Punch);
    reader.value(&DISTRIBUTION)?;
    reader.value(&BOUNDARY)?;
    reader.value(&ROTATION)?;
    for key in [&BOLT_STIFFNESS, &PRESSURE_CAP] {
        reader.optional(key, None)?;
    }
    Ok(())
}

fn stiffness_contact(reader: &Reader<'_>) -> Result<Contact> {
    if reader.has("contact.preload") {
        let reason = "contact.kn and contact.kt are given, and such a joint has no bolt: its load at rest is contact.normal_load, uniform by area";
        return Err(reader.misplaced("contact.preload", reason));
    }
    if reader.has("contact.bolt") {
        let reason = "contact.kn and contact.kt are given, and such a joint does not wear";
        return Err(reader.misplaced("contact.bolt", reason));
    }
    reader.refuse_form(
        "contact",
        "rough",
        "it applies to the contact of a rough surface, but contact.kn and contact.kt are given instead; remove it",
    )?;
    let kn = match reader.get(&KN) {
        Ok(None) => Err(reader.missing_line(&KN, "kn = \"1.2e4 N/um\"")),
        Ok(Some(kn)) => Ok(kn),
        Err(error) => Err(error),
    };
    let (kn, kt, gap) = (kn, reader.required(&KT), reader.value(&GAP)).all()?;
    let normal_load = match reader.peek(&LOAD_AT_REST)? {
        Some(load) if load > 0.0 && gap > 0.0 => {
            return Err(reader.conflict(
                &GAP,
                "a contact that is open at rest bears no contact.normal_load; give one or the other",
            ));
        }
        Some(load) => load,
        // A contact that just touches is given by a gap of 0.
        None if reader.has(&GAP) => 0.0,
        None => return Err(reader.missing(&LOAD_AT_REST, "   (or gap = \"20 um\")")),
    };
    if kn == 0.0 && (kt == 0.0 || normal_load == 0.0) {
        return Err(reader.conflict(
            &KN,
            "without a normal stiffness the contact bears no load unless contact.kt and contact.normal_load are greater than zero; give them, or remove [contact]",
        ));
    }
    let friction_coefficient = reader.optional(&FRICTION_COEFFICIENT, None)?;
    if friction_coefficient.is_none() && kt > 0.0 {
        return Err(reader.missing(&FRICTION_COEFFICIENT, ""));
    }
    note_rough(reader)?;
    Ok(Contact {
        friction_coefficient,
        transverse: reader.value(&TRANSVERSE)?,
        conditions: None,
        preload: None,
        bolt: None,
        pressed_by: Pressing::Punch,
        elements: ElementStiffness::Given {
            kn,
            kt,
            gap,
            normal_load: reader.note(&LOAD_AT_REST, normal_load),
        },
        table: None,
    })
}
