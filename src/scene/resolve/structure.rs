//! `[structure]`

use serde_json::json;

use super::{All, Body, Result};
use crate::material::Material;
use crate::recipe::{self, Import, ImportFiles, JointSets, Reasons};
use crate::scene::error::SceneError;
use crate::scene::keys::{self, dynamics::MODES, joint::DENSITY, structure::*};
use crate::scene::reader::Reader;
use crate::scene::{Bodies, Contact, Joint, Resonator, Structure};
use crate::structure::StructureError;
use crate::structure::imported::UnitSystem;
use crate::structure::interface::JointRequirements;
use crate::structure::matrices::Role;
use crate::structure::reduction::ContactPorts;

/// Number of directions of motion of an oscillator. The reduction keeps all three directions of motion as modes.
const OSCILLATOR_MODES: usize = 3;
/// Most cells of the box around a mesh. The factors of larger matrices take some hundred gigabytes.
const MOST_CELLS: f64 = 4e6;

/// Reads the structure. Without contact the two sides of the joint are tied.
pub(super) fn source(
    reader: &Reader<'_>,
    body: Body,
    joint: Option<&Joint>,
    bodies: Option<Bodies>,
    contact: Option<&Contact>,
) -> Result<Option<Structure>> {
    let (kind, source) = match (body, joint, bodies) {
        (Body::Oscillator, ..) => ("oscillator", oscillator(reader)?),
        (Body::Resonator, Some(joint), Some(bodies)) => {
            let geometry = resonator(reader, joint, bodies, contact.is_none())?;
            ("resonator", geometry.into())
        }
        (Body::Matrices, joint, _) => ("matrices", matrices(reader, joint, contact.is_some())?),
        _ => return Ok(None),
    };
    reader.note(&KIND, kind);
    Ok(Some(source))
}

/// Adds the modes and the kind of contact elements to the structure.
pub(super) fn structure(
    reader: &Reader<'_>,
    source: Structure,
    contact: Option<&Contact>,
) -> Result<recipe::Structure> {
    let modes = match source.is_oscillator() {
        true if reader.has(&MODES) => {
            return Err(reader.conflict(&MODES, "an oscillator is not reduced to modes; remove it"));
        }
        true => reader.note(&MODES, OSCILLATOR_MODES),
        false => reader.value(&MODES)?,
    };
    let has_banks = contact.is_some_and(|contact| contact.elements.is_sliders());
    Ok(recipe::Structure {
        source,
        modes,
        contact_ports: match has_banks {
            true => ContactPorts::Nodes,
            false => ContactPorts::Faces,
        },
        why: Reasons::default(),
    })
}

/// Reads the paths and options of matrices from another program. The files are read later.
fn matrices(reader: &Reader<'_>, joint: Option<&Joint>, has_contact: bool) -> Result<Structure> {
    let (file, stiffness, mass) = (
        reader.peek(&FILE)?,
        reader.path(&STIFFNESS)?,
        reader.path(&MASS)?,
    );
    let files = match (file, stiffness, mass) {
        (Some(file), None, None) if !reader.has(&DAMPING) && !reader.has(&STRUCTURAL_DAMPING) => {
            vec![(None, file)]
        }
        (Some(_), _, _) => {
            return Err(reader.conflict(
                &FILE,
                "structure.stiffness, structure.mass, structure.damping or structure.structural_damping names a separate file; give a single file, or one file per matrix",
            ));
        }
        (None, Some(stiffness), Some(mass)) => {
            let damping = reader
                .path(&DAMPING)?
                .map(|path| (Some(Role::Damping), path));
            let both = [(Some(Role::Stiffness), stiffness), (Some(Role::Mass), mass)];
            let hysteretic = reader.peek(&STRUCTURAL_DAMPING)?;
            let hysteretic = hysteretic.map(|path| (Some(Role::Hysteretic), path));
            both.into_iter().chain(damping).chain(hysteretic).collect()
        }
        (None, None, None) if reader.kind(&KIND)? == "mesh" => {
            return Err(reader.missing_line(&FILE, "file = \"model.inp\""));
        }
        (None, None, _) => {
            return Err(reader.missing_line(
                &STIFFNESS,
                "stiffness = \"model_STIF1.mtx\"   (or file = \"matrices.npz\")",
            ));
        }
        (None, Some(_), None) => {
            return Err(reader.missing_line(&MASS, "mass = \"model_MASS1.mtx\""));
        }
    };
    let interface = reader.peek(&INTERFACE)?;
    if has_contact && interface.is_none() {
        return Err(reader.missing(
            &INTERFACE,
            "   (or { upper = \"TOP\", lower = \"BOTTOM\" })",
        ));
    }
    let sets = match interface {
        None | Some(Some(_)) => None,
        Some(None) => {
            let (upper, lower) = (
                reader.required(&INTERFACE_UPPER),
                reader.required(&INTERFACE_LOWER),
            )
                .all()?;
            Some(JointSets { upper, lower })
        }
    };
    let direction =
        |key: &keys::Key<keys::List<3>>| {
            let direction = reader.get(key)?;
            match direction {
                Some([0.0, 0.0, 0.0]) => Err(reader
                    .out_of_range(key, "a direction, with at least one value other than zero")),
                direction => Ok(direction),
            }
        };
    let wanted = JointRequirements {
        normal: direction(&NORMAL)?,
        along: direction(&ALONG)?,
        layer: reader.get(&LAYER)?,
    };
    if let (Some(layer), Some(joint)) = (wanted.layer, joint)
        && layer > joint.size[0].max(joint.size[1])
    {
        return Err(reader.out_of_range(&LAYER, "no more than a side of the joint"));
    }
    let unit = UnitSystem {
        length: reader.value(&UNIT_LENGTH)?,
        mass: reader.value(&UNIT_MASS)?,
        time: reader.value(&UNIT_TIME)?,
    };
    Ok(Structure::from(Import {
        files: ImportFiles {
            matrices: files,
            nodes: reader.peek(&NODES)?,
            pairs: interface.flatten(),
        },
        format: reader.get(&FORMAT)?.map(str::to_owned),
        unit,
        fixed: reader.get(&FIXED)?,
        sets,
        wanted,
        ..Import::default()
    }))
}

fn oscillator(reader: &Reader<'_>) -> Result<Structure> {
    let needed = |key: &keys::Key<keys::ListOrPath<3>>| {
        reader.list(key)?.ok_or_else(|| reader.missing(key, ""))
    };
    let damping = reader.list(&DAMPING).map(Option::unwrap_or_default);
    let (mass, damping, stiffness) = (needed(&MASS), damping, needed(&STIFFNESS)).all()?;
    for (key, list) in [(&MASS, mass), (&DAMPING, damping), (&STIFFNESS, stiffness)] {
        reader.record.note(key.name, json!(list));
    }
    let along = |key: &keys::Key<keys::List<3>>| -> Result<[f64; 3]> {
        Ok(reader.peek(key)?.unwrap_or_default())
    };
    let [cubic, stop, gap] = [
        along(&CUBIC_STIFFNESS)?,
        along(&STOP_STIFFNESS)?,
        along(&STOP_GAP)?,
    ];
    if reader.has(&STOP_GAP) && stop == [0.0; 3] {
        return Err(reader.conflict(
            &STOP_GAP,
            "there is no structure.stop_stiffness; give one, or remove the gap",
        ));
    }
    let structure = Structure::oscillator(mass, damping, stiffness);
    let structure = structure.with_springs(cubic, stop, gap);
    if !structure.springs().is_empty() {
        let springs = json!(structure.springs());
        reader.record.note("structure.springs", springs);
    }
    Ok(structure)
}

fn resonator(reader: &Reader<'_>, joint: &Joint, bodies: Bodies, tied: bool) -> Result<Resonator> {
    let resonator = Resonator {
        lap_length: joint.size[0],
        arm_height: joint.size[1],
        depth: reader.value(&DEPTH)?,
        stub_length: reader.value(&STUB_LENGTH)?,
        gap_length: reader.value(&GAP_LENGTH)?,
        block_length: reader.value(&BLOCK_LENGTH)?,
        block_height: reader.value(&BLOCK_HEIGHT)?,
        leaf_thickness: reader.value(&LEAF_THICKNESS)?,
        window_length: reader.value(&WINDOW_LENGTH)?,
        window_height: reader.value(&WINDOW_HEIGHT)?,
        frame_height: reader.value(&FRAME_HEIGHT)?,
        wall_thickness: reader.value(&WALL_THICKNESS)?,
        head_thickness: reader.value(&HEAD_THICKNESS)?,
        bolt_modulus_factor: reader.value(&BOLT_MODULUS_FACTOR)?,
        material: one_material(reader, bodies)?,
        lap_cells: joint
            .elements
            .map_or(Resonator::default().lap_cells, |count| count[0]),
        half_depth_cells: reader.value(&HALF_DEPTH_CELLS)?,
        block_cells: reader.value(&BLOCK_CELLS)?,
        stub_cells: reader.value(&STUB_CELLS)?,
        gap_cells: reader.value(&GAP_CELLS)?,
        leaf_cells: reader.value(&LEAF_CELLS)?,
        window_cells: reader.value(&WINDOW_CELLS)?,
        wall_cells: reader.value(&WALL_CELLS)?,
        inner_cells: reader.value(&INNER_CELLS)?,
        rim_cells: reader.value(&RIM_CELLS)?,
        head_cells: reader.value(&HEAD_CELLS)?,
        tied,
    };
    let following = [
        ("lap_length", json!(resonator.lap_length)),
        ("arm_height", json!(resonator.arm_height)),
        ("lap_cells", json!(resonator.lap_cells)),
        ("material", json!(resonator.material)),
        ("tied", json!(tied)),
    ];
    for (name, value) in following {
        reader.record.note(&keys::join("structure", name), value);
    }
    resonator
        .check()
        .map_err(|fault| resonator_error(reader, &fault))?;
    let cells = resonator.box_cells();
    if cells > MOST_CELLS {
        return Err(reader.misplaced(
            "structure",
            format!(
                "the box around its mesh has {cells:.2e} cells, but at most {MOST_CELLS:e} are allowed: make joint.elements or the *_cells smaller"
            ),
        ));
    }
    Ok(resonator)
}

/// Returns the material of both bodies, which must be the same for a resonator.
fn one_material(reader: &Reader<'_>, bodies: Bodies) -> Result<Material> {
    let (below, above) = (bodies.elastic.lower, bodies.elastic.upper);
    let [density, upper_density] = bodies.density;
    for (name, differs) in [
        (
            "youngs_modulus",
            below.youngs_modulus != above.youngs_modulus,
        ),
        ("poisson_ratio", below.poisson_ratio != above.poisson_ratio),
        ("density", density != upper_density),
    ] {
        let body_key = |body| keys::join(&keys::join("material", body), name);
        let key = if reader.has(body_key("upper").as_str()) {
            body_key("upper")
        } else {
            body_key("lower")
        };
        if differs {
            let reason =
                "a resonator has one material; material.lower and material.upper must be equal";
            return Err(reader.conflict(key.as_str(), reason));
        }
    }
    Ok(Material {
        elastic: below,
        density: density.ok_or_else(|| reader.missing(&DENSITY, ""))?,
    })
}

/// Returns the key that determines a field of the resonator.
fn key_of(field: &str) -> String {
    match field {
        "lap_length" | "arm_height" => "joint.size".to_owned(),
        "lap_cells" => "joint.elements".to_owned(),
        "youngs_modulus" | "poisson_ratio" | "density" => keys::join("material", field),
        _ => keys::join("structure", field),
    }
}

/// Converts to millimetres for display, without the digits that scaling adds.
fn millimetres(length: f64) -> f64 {
    (length * 1e9).round() / 1e6
}

/// Converts a fault of the mesh to an error about the given key.
fn resonator_error(reader: &Reader<'_>, fault: &StructureError) -> SceneError {
    match fault {
        StructureError::OutOfRange { name, expected, .. } => {
            let key = key_of(name);
            // The value may have been given for a single body.
            let body_key = key.replace("material.", "material.lower.");
            let given_key = if reader.has(key.as_str()) {
                key
            } else {
                body_key
            };
            reader.out_of_range(given_key.as_str(), *expected)
        }
        StructureError::Contradiction {
            name,
            value,
            other,
            other_value,
            ..
        } => {
            let (key, other_key) = (key_of(name), key_of(other));
            let reason = format!(
                "{key} must be greater than {other_key}{}, but they are {} mm and {} mm",
                if *other == "arm_height" {
                    " along y"
                } else {
                    ""
                },
                millimetres(*value),
                millimetres(*other_value)
            );
            // One of the two keys was given, because the default values fit.
            let given_key = if reader.has(key.as_str()) {
                key
            } else {
                other_key
            };
            reader.conflict(given_key.as_str(), reason)
        }
        other => reader.misplaced("structure", other.to_string()),
    }
}
