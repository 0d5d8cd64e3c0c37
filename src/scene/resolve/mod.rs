//! From the merged tree to a [`Scene`]: defaults, ranges, and what must or must not stand together.

mod cycles;
mod surface;

use cycles::{fidelity, motion, wear};
use surface::surface;

use super::document::Node;
use super::error::{Problem, SceneError};
use super::reader::{Check, POISSON, POSITIVE, Reader};
use super::{
    Boundary, Contact, Distribution, Hole, Joint, Keep, Material, Motion, Output, Rotation, Scene,
    Solid, Stiffness, Transverse, keys,
};
use crate::units::Dimension;

/// More cells a side would need fields of several GiB each once they are padded for convolution.
const LARGEST_GRID: u64 = 16_384;

/// Iterations between two indentation and hysteresis curves.
const CURVES_EVERY: u64 = 10;

const JOINT_EXAMPLE: &str = "[joint]\nsize = [\"40 mm\", \"30 mm\"]\ngrid = [256, 192]";
const MATERIAL_EXAMPLE: &str = "[material]\nyoungs_modulus = \"198.4 GPa\"\npoisson_ratio = 0.3";
const CONTACT_EXAMPLE: &str = "[contact]\nnormal_load = \"30 kN\"";

type Result<T> = std::result::Result<T, SceneError>;

pub(super) fn scene(tree: &Node, name: String) -> Result<Scene> {
    let reader = Reader { root: tree };
    reader.check_keys()?;
    let joint = joint(&reader)?;
    let contact = contact(&reader)?;
    let fidelity = fidelity(&reader)?;
    let scene = Scene {
        title: reader
            .text("title", "\"Lap joint, Rq 5 um\"")?
            .map(str::to_owned),
        name,
        material: Some(material(&reader)?),
        surface: Some(surface(&reader, &joint)?),
        motion: motion(&reader, &contact)?,
        wear: wear(&reader, fidelity.preset)?,
        output: output(&reader)?,
        joint: Some(joint),
        contact: Some(contact),
        structure: None,
        dynamics: None,
        update: None,
        fidelity,
        document: tree.to_table(),
    };
    check_patch(&reader, &scene)?;
    Ok(scene)
}

fn joint(reader: &Reader<'_>) -> Result<Joint> {
    if !reader.has("joint") {
        return Err(reader.missing_section("joint", "the size of the joint", JOINT_EXAMPLE));
    }
    let size = reader
        .pair(
            "joint.size",
            Dimension::LENGTH,
            POSITIVE,
            None,
            "[\"40 mm\", \"30 mm\"]",
        )?
        .ok_or_else(|| reader.missing("joint.size", "size = [\"40 mm\", \"30 mm\"]"))?;
    let grid = reader
        .integer_pair("joint.grid", LARGEST_GRID, "[256, 192]")?
        .ok_or_else(|| reader.missing("joint.grid", "grid = [256, 192]"))?;
    let elements = reader.integer_pair("joint.elements", LARGEST_GRID, "[19, 19]")?;
    let diameter = reader.quantity(
        "joint.hole.diameter",
        Dimension::LENGTH,
        POSITIVE,
        "\"11 mm\"",
    )?;
    if reader.has("joint.hole") && diameter.is_none() {
        return Err(reader.missing("joint.hole.diameter", "diameter = \"11 mm\""));
    }
    if diameter.is_some_and(|d| d >= size[0].min(size[1])) {
        return Err(reader.out_of_range(
            "joint.hole.diameter",
            "less than the shorter side of joint.size",
        ));
    }
    Ok(Joint {
        size,
        grid: Some(grid),
        elements,
        hole: diameter.map(|diameter| Hole { diameter }),
    })
}

fn material(reader: &Reader<'_>) -> Result<Material> {
    if !reader.has("material") {
        return Err(reader.missing_section("material", "the elastic constants", MATERIAL_EXAMPLE));
    }
    let of = |body: &str, name: &str, dimension, check: Check, example| -> Result<Option<f64>> {
        // Both are read, so that a faulty common value is found even where both bodies override it.
        let common = reader.quantity(&keys::join("material", name), dimension, check, example)?;
        let own = keys::join(&keys::join("material", body), name);
        Ok(reader.quantity(&own, dimension, check, example)?.or(common))
    };
    let solid = |body| -> Result<Solid> {
        Ok(Solid {
            youngs_modulus: of(
                body,
                "youngs_modulus",
                Dimension::PRESSURE,
                POSITIVE,
                "\"198.4 GPa\"",
            )?
            .ok_or_else(|| {
                reader.missing("material.youngs_modulus", "youngs_modulus = \"198.4 GPa\"")
            })?,
            poisson_ratio: of(body, "poisson_ratio", Dimension::NONE, POISSON, "0.3")?
                .ok_or_else(|| reader.missing("material.poisson_ratio", "poisson_ratio = 0.3"))?,
            density: of(
                body,
                "density",
                Dimension::DENSITY,
                POSITIVE,
                "\"7949 kg/m^3\"",
            )?,
        })
    };
    Ok(Material {
        lower: solid("lower")?,
        upper: solid("upper")?,
    })
}

fn contact(reader: &Reader<'_>) -> Result<Contact> {
    if !reader.has("contact") {
        return Err(reader.missing_section("contact", "the load on the joint", CONTACT_EXAMPLE));
    }
    let only = "only \"fixed\" is";
    refuse_value(reader, "contact.rotation", &["free"], only)?;
    let only = "only \"total\" is";
    refuse_value(reader, "contact.stiffness", &["roughness", "tangent"], only)?;
    let only = "only \"uniform\" is";
    refuse_value(reader, "contact.distribution", &["by_load"], only)?;
    reader.choice("contact.stiffness", &[("total", ())])?;
    reader.choice("contact.distribution", &[("uniform", ())])?;
    Ok(Contact {
        friction_coefficient: reader.quantity(
            "contact.friction_coefficient",
            Dimension::NONE,
            POSITIVE,
            "0.6",
        )?,
        normal_load: reader
            .quantity(
                "contact.normal_load",
                Dimension::FORCE,
                POSITIVE,
                "\"30 kN\"",
            )?
            .ok_or_else(|| reader.missing("contact.normal_load", "normal_load = \"30 kN\""))?,
        given: None,
        stiffness: Stiffness::Total,
        distribution: Distribution::Uniform,
        bolt_stiffness: None,
        pressure_cap: reader.quantity(
            "contact.pressure_cap",
            Dimension::PRESSURE,
            POSITIVE,
            "\"600 MPa\"",
        )?,
        boundary: reader
            .choice(
                "contact.boundary",
                &[("free", Boundary::Free), ("periodic", Boundary::Periodic)],
            )?
            .unwrap_or(Boundary::Free),
        transverse: reader
            .choice(
                "contact.transverse",
                &[
                    ("absent", Transverse::Absent),
                    ("fixed", Transverse::Fixed),
                    ("free", Transverse::Free),
                ],
            )?
            .unwrap_or(Transverse::Fixed),
        rotation: reader
            .choice("contact.rotation", &[("fixed", Rotation::Fixed)])?
            .unwrap_or(Rotation::Fixed),
    })
}

/// Refuses words that the whole program knows and this version does not.
fn refuse_value(
    reader: &Reader<'_>,
    key: &str,
    words: &[&str],
    instead: &'static str,
) -> Result<()> {
    let Some(node) = reader.node(key) else {
        return Ok(());
    };
    let shown = node.shown();
    if words.iter().any(|word| shown == format!("\"{word}\"")) {
        return Err(SceneError::new(
            &node.place,
            Problem::Unavailable {
                key: format!("{key} = {shown}"),
                instead,
            },
        ));
    }
    Ok(())
}

fn output(reader: &Reader<'_>) -> Result<Output> {
    let is_table = ["every", "last", "updates"]
        .iter()
        .any(|name| reader.has(&keys::join("output.keep", name)));
    let keep = if is_table {
        Keep::Some {
            every: reader.integer("output.keep.every", 1)?,
            last: reader.integer("output.keep.last", 1)?.unwrap_or(1),
            updates: reader.boolean("output.keep.updates")?.unwrap_or(true),
        }
    } else if reader
        .node("output.keep")
        .is_none_or(|node| node.shown() == "\"all\"")
    {
        Keep::All
    } else {
        return Err(reader.out_of_range(
            "output.keep",
            "\"all\" or a table such as { every = 50, last = 3, updates = true }",
        ));
    };
    if let Some(node) = reader.node("output.response_at")
        && node.shown() != "[]"
    {
        return Err(SceneError::new(
            &node.place,
            Problem::Unavailable {
                key: format!("output.response_at = {}", node.shown()),
                instead: "it needs [dynamics]; leave it out or give []",
            },
        ));
    }
    Ok(Output {
        keep,
        cycle_fields: reader.boolean("output.cycle_fields")?.unwrap_or(false),
        response_at: Vec::new(),
        curves_every: reader
            .integer("output.curves_every", 0)?
            .unwrap_or(CURVES_EVERY),
    })
}

/// What needs the cells of the joint: there are some, and they can carry the load.
fn check_patch(reader: &Reader<'_>, scene: &Scene) -> Result<()> {
    let Some(rough) = scene.rough() else {
        return Ok(());
    };
    let patch = rough.patch();
    if patch.cells() == 0 {
        return Err(reader.out_of_range(
            "joint.grid",
            "finer: no cell has its centre outside the hole",
        ));
    }
    let amplitude = match scene.motion {
        Some(Motion::Harmonic {
            normal_load_amplitude,
            ..
        }) => normal_load_amplitude,
        _ => 0.0,
    };
    let mean = (rough.contact.normal_load + amplitude) / patch.area();
    if rough.contact.pressure_cap.is_some_and(|cap| cap <= mean) {
        return Err(reader.out_of_range(
            "contact.pressure_cap",
            format!(
                "greater than the largest load over the area of the joint, {:.4} MPa",
                mean * 1e-6
            ),
        ));
    }
    Ok(())
}
