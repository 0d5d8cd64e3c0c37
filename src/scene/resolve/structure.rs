//! `[structure]`

use super::{Body, Result};
use crate::scene::error::SceneError;
use crate::scene::reader::{NOT_NEGATIVE, POSITIVE, Reader};
use crate::scene::{Joint, Material, Resonator, Structure, keys};
use crate::structure::{StructureError, element};
use crate::units::Dimension;

/// More mesh cells along one part of the resonator than any mesh has: a slip of the keyboard.
const LARGEST_CELLS: usize = 999;

/// Cells of the box around a mesh: the factors of the matrices of so many take some hundred gigabytes.
const MOST_CELLS: f64 = 4e6;

/// Without contact the two sides of the joint are one.
pub(super) fn structure(
    reader: &Reader<'_>,
    body: Body,
    joint: Option<&Joint>,
    material: Option<Material>,
    has_contact: bool,
) -> Result<Option<Structure>> {
    match (body, joint, material) {
        (Body::Oscillator, ..) => oscillator(reader).map(Some),
        (Body::Resonator, Some(joint), Some(material)) => {
            let geometry = resonator(reader, joint, material, !has_contact)?;
            Ok(Some(Structure::Resonator {
                geometry: Box::new(geometry),
            }))
        }
        _ => Ok(None),
    }
}

fn oscillator(reader: &Reader<'_>) -> Result<Structure> {
    let three = |name, dimension, check, example: &str| {
        let expected = format!("one value, or a list of three for x, y and z, such as {example}");
        reader.list(
            &keys::join("structure", name),
            dimension,
            check,
            Some(|all| [all; 3]),
            &expected,
        )
    };
    Ok(Structure::Oscillator {
        mass: three("mass", Dimension::MASS, POSITIVE, "\"1 kg\"")?
            .ok_or_else(|| reader.missing("structure.mass", "mass = \"1 kg\""))?,
        damping: three("damping", Dimension::DAMPING, NOT_NEGATIVE, "\"5 N s/m\"")?
            .unwrap_or([0.0; 3]),
        stiffness: three(
            "stiffness",
            Dimension::STIFFNESS,
            NOT_NEGATIVE,
            "\"10 N/um\"",
        )?
        .ok_or_else(|| reader.missing("structure.stiffness", "stiffness = \"10 N/um\""))?,
    })
}

fn resonator(
    reader: &Reader<'_>,
    joint: &Joint,
    material: Material,
    tied: bool,
) -> Result<Resonator> {
    let shipped = Resonator::default();
    let positive = |name, dimension, default, example| -> Result<f64> {
        let key = keys::join("structure", name);
        let given = reader.quantity(&key, dimension, POSITIVE, example)?;
        Ok(given.unwrap_or(default))
    };
    let length = |name, default| positive(name, Dimension::LENGTH, default, "\"40 mm\"");
    let cells = |name, default: usize| -> Result<usize> {
        let key = keys::join("structure", name);
        Ok(reader.count(&key, 1, LARGEST_CELLS)?.unwrap_or(default))
    };
    let resonator = Resonator {
        lap_length: joint.size[0],
        arm_height: joint.size[1],
        depth: length("depth", shipped.depth)?,
        stub_length: length("stub_length", shipped.stub_length)?,
        gap_length: length("gap_length", shipped.gap_length)?,
        block_length: length("block_length", shipped.block_length)?,
        block_height: length("block_height", shipped.block_height)?,
        leaf_thickness: length("leaf_thickness", shipped.leaf_thickness)?,
        window_length: length("window_length", shipped.window_length)?,
        window_height: length("window_height", shipped.window_height)?,
        frame_height: length("frame_height", shipped.frame_height)?,
        wall_thickness: length("wall_thickness", shipped.wall_thickness)?,
        head_thickness: length("head_thickness", shipped.head_thickness)?,
        bolt_modulus_factor: positive(
            "bolt_modulus_factor",
            Dimension::NONE,
            shipped.bolt_modulus_factor,
            "1.45",
        )?,
        material: one_material(reader, material)?,
        lap_cells: joint.elements.map_or(shipped.lap_cells, |count| count[0]),
        half_depth_cells: cells("half_depth_cells", shipped.half_depth_cells)?,
        block_cells: cells("block_cells", shipped.block_cells)?,
        stub_cells: cells("stub_cells", shipped.stub_cells)?,
        gap_cells: cells("gap_cells", shipped.gap_cells)?,
        leaf_cells: cells("leaf_cells", shipped.leaf_cells)?,
        window_cells: cells("window_cells", shipped.window_cells)?,
        wall_cells: cells("wall_cells", shipped.wall_cells)?,
        inner_cells: cells("inner_cells", shipped.inner_cells)?,
        rim_cells: cells("rim_cells", shipped.rim_cells)?,
        head_cells: cells("head_cells", shipped.head_cells)?,
        tied,
    };
    resonator.check().map_err(|fault| named(reader, &fault))?;
    let cells = resonator.box_cells();
    if cells > MOST_CELLS {
        return Err(reader.misplaced(
            "structure",
            format!(
                "the box around its mesh has {cells:.2e} cells; it may have at most {MOST_CELLS:e}: make joint.elements or the *_cells smaller"
            ),
        ));
    }
    Ok(resonator)
}

/// The material of both bodies, which a resonator has in common.
fn one_material(reader: &Reader<'_>, material: Material) -> Result<element::Material> {
    let (lower, upper) = (material.lower, material.upper);
    for (name, differs) in [
        (
            "youngs_modulus",
            lower.youngs_modulus != upper.youngs_modulus,
        ),
        ("poisson_ratio", lower.poisson_ratio != upper.poisson_ratio),
        ("density", lower.density != upper.density),
    ] {
        let of = |body| keys::join(&keys::join("material", body), name);
        let key = if reader.has(&of("upper")) {
            of("upper")
        } else {
            of("lower")
        };
        if differs {
            let reason =
                "a resonator is of one material; material.lower and material.upper must be alike";
            return Err(reader.conflict(&key, reason));
        }
    }
    Ok(element::Material {
        youngs_modulus: lower.youngs_modulus,
        poisson_ratio: lower.poisson_ratio,
        density: lower
            .density
            .ok_or_else(|| reader.missing("material.density", "density = \"7949 kg/m^3\""))?,
    })
}

/// The key that a field of the resonator comes from.
fn key_of(field: &str) -> String {
    match field {
        "lap_length" | "arm_height" => "joint.size".to_owned(),
        "lap_cells" => "joint.elements".to_owned(),
        "youngs_modulus" | "poisson_ratio" | "density" => keys::join("material", field),
        _ => keys::join("structure", field),
    }
}

/// For people: without the digits that scaling adds.
fn millimetres(length: f64) -> f64 {
    (length * 1e9).round() / 1e6
}

/// What the mesh finds wrong, by the key that was given.
fn named(reader: &Reader<'_>, fault: &StructureError) -> SceneError {
    match fault {
        StructureError::OutOfRange { name, expected, .. } => {
            let key = key_of(name);
            // A value may have been given for the bodies alone.
            let of_a_body = key.replace("material.", "material.lower.");
            reader.out_of_range(if reader.has(&key) { &key } else { &of_a_body }, *expected)
        }
        StructureError::DoNotFit {
            name,
            value,
            other,
            other_value,
            ..
        } => {
            let (key, other_key) = (key_of(name), key_of(other));
            let reason = format!(
                "{key} must be greater than {other_key}{}, and is {} mm against {} mm",
                if *other == "arm_height" {
                    " along y"
                } else {
                    ""
                },
                millimetres(*value),
                millimetres(*other_value)
            );
            // One of the two was given, or the shipped values would fit.
            let given = if reader.has(&key) { key } else { other_key };
            reader.conflict(&given, reason)
        }
        other => reader.misplaced("structure", other.to_string()),
    }
}
