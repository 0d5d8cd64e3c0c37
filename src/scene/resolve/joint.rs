//! `[joint]` and `[material]`

use super::{Body, Result};
use crate::scene::reader::{Check, POISSON, POSITIVE, Reader};
use crate::scene::{Hole, Joint, Material, Motion, Resonator, Scene, Solid, keys};
use crate::units::Dimension;

/// More cells a side would need fields of several GiB each once they are padded for convolution.
const LARGEST_GRID: u64 = 16_384;

/// More contact elements a side than any structure is meshed with: a slip of the keyboard.
const LARGEST_ELEMENTS: u64 = 999;

const JOINT_EXAMPLE: &str = "[joint]\nsize = [\"40 mm\", \"30 mm\"]\ngrid = [256, 192]";
const RESONATOR_EXAMPLE: &str =
    "[joint]\nsize = [\"40 mm\", \"40 mm\"]\ngrid = [256, 256]\nelements = [19, 19]";
const MATERIAL_EXAMPLE: &str = "[material]\nyoungs_modulus = \"198.4 GPa\"\npoisson_ratio = 0.3";
const DENSE_EXAMPLE: &str =
    "[material]\nyoungs_modulus = \"198.4 GPa\"\npoisson_ratio = 0.3\ndensity = \"7949 kg/m^3\"";

pub(super) fn joint(reader: &Reader<'_>, body: Body) -> Result<Option<Joint>> {
    let example = match body {
        Body::Joint => JOINT_EXAMPLE,
        Body::Resonator => RESONATOR_EXAMPLE,
        Body::Oscillator if reader.has("joint") => {
            let reason = "an oscillator has one contact element and no joint; leave it out";
            return Err(reader.misplaced("joint", reason));
        }
        Body::Oscillator => return Ok(None),
    };
    if !reader.has("joint") {
        return Err(reader.missing_section("joint", "the size of the joint", example));
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
    let grid = reader.integer_pair("joint.grid", LARGEST_GRID, "[256, 192]")?;
    if grid.is_none() && (body == Body::Joint || reader.has("surface")) {
        return Err(reader.missing("joint.grid", "grid = [256, 192]"));
    }
    let mut elements = reader.integer_pair("joint.elements", LARGEST_ELEMENTS, "[19, 19]")?;
    if body == Body::Resonator {
        elements = Some(resonator_elements(reader, elements, grid)?);
    }
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
    let hole = match (body, diameter, elements) {
        (Body::Resonator, Some(diameter), Some(elements)) => {
            check_hole(reader, diameter, size, elements)?;
            None
        }
        _ => diameter.map(|diameter| Hole { diameter }),
    };
    Ok(Some(Joint {
        size,
        grid,
        elements,
        hole,
    }))
}

/// The contact elements of a resonator, whose mesh has as many along x as along y.
fn resonator_elements(
    reader: &Reader<'_>,
    given: Option<[usize; 2]>,
    grid: Option<[usize; 2]>,
) -> Result<[usize; 2]> {
    let default = [Resonator::default().lap_cells; 2];
    let elements = given.unwrap_or(default);
    if elements[0] != elements[1] {
        return Err(reader.out_of_range(
            "joint.elements",
            "as many along x as along y for a resonator, such as [19, 19]",
        ));
    }
    match grid {
        Some(grid) if reader.has("surface") && (0..2).any(|d| grid[d] < elements[d]) => {
            Err(reader.out_of_range(
                "joint.grid",
                format!(
                    "at least one cell to a contact element, {} along x and y, or elements would bear nothing",
                    elements[0]
                ),
            ))
        }
        _ => Ok(elements),
    }
}

/// A hole given beside a resonator is that of its mesh, a staircase of contact elements, to within one element.
fn check_hole(
    reader: &Reader<'_>,
    diameter: f64,
    size: [f64; 2],
    elements: [usize; 2],
) -> Result<()> {
    let resonator = Resonator {
        lap_cells: elements[0],
        ..Resonator::default()
    };
    let side = [0, 1].map(|d| size[d] / elements[d] as f64);
    let absent = elements[0] * elements[1] - resonator.contact_cells().len();
    let staircase = 2.0 * (absent as f64 * side[0] * side[1] / std::f64::consts::PI).sqrt();
    let within = side[0].max(side[1]);
    if (diameter - staircase).abs() <= within {
        return Ok(());
    }
    Err(reader.out_of_range(
        "joint.hole.diameter",
        format!(
            "within {:.4} mm of {:.4} mm: the hole of a resonator is that of its mesh, {absent} contact elements; leave joint.hole out",
            within * 1e3,
            staircase * 1e3
        ),
    ))
}

pub(super) fn material(reader: &Reader<'_>, body: Body) -> Result<Option<Material>> {
    let example = match body {
        Body::Joint => MATERIAL_EXAMPLE,
        Body::Resonator => DENSE_EXAMPLE,
        Body::Oscillator if reader.has("material") => {
            let reason =
                "an oscillator has a mass and a stiffness instead, in [structure]; leave it out";
            return Err(reader.misplaced("material", reason));
        }
        Body::Oscillator => return Ok(None),
    };
    if !reader.has("material") {
        return Err(reader.missing_section("material", "the elastic constants", example));
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
    Ok(Some(Material {
        lower: solid("lower")?,
        upper: solid("upper")?,
    }))
}

/// What needs the cells of the joint: there are some, and they can carry the load.
pub(super) fn check_patch(reader: &Reader<'_>, scene: &Scene) -> Result<()> {
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
