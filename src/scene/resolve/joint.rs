//! `[joint]` and `[material]`

use serde_json::Value as Json;

use super::{All, Body, Result};
use crate::contact::Pair;
use crate::material::Elastic;
use crate::scene::keys::{Key, Quantity, contact, cycles::MOTION_AMPLITUDE, joint::*, lines};
use crate::scene::reader::Reader;
use crate::scene::{Bodies, Joint, Motion, Resonator, Scene, SceneError};
use crate::wear::Harmonic;

pub(super) fn joint(reader: &Reader<'_>, body: Body) -> Result<Option<Joint>> {
    let example = match body {
        Body::Joint => lines(&[&SIZE, &GRID]),
        Body::Matrices => "size = [\"40 mm\", \"40 mm\"]\ngrid = [256, 256]".to_owned(),
        Body::Resonator => {
            "size = [\"40 mm\", \"40 mm\"]\ngrid = [256, 256]\nelements = [19, 19]".to_owned()
        }
        Body::Oscillator if reader.has("joint") => {
            let reason = "an oscillator has one contact element and no joint; remove it";
            return Err(reader.misplaced("joint", reason));
        }
        Body::Oscillator => return Ok(None),
    };
    let has_part = |section| reader.has(section);
    if body == Body::Matrices && !["joint", "contact", "surface"].into_iter().any(has_part) {
        return Ok(None);
    }
    if !reader.has("joint") {
        return Err(reader.missing_section("joint", "the size of the joint", &example));
    }
    let grid = match reader.optional(&GRID, None) {
        Ok(None) if body == Body::Joint || reader.has("surface") => Err(reader.missing(&GRID, "")),
        read => read,
    };
    let (size, grid) = (reader.required(&SIZE), grid).all()?;
    let mut elements = reader.optional(&ELEMENTS, None)?;
    if body == Body::Matrices && reader.has("joint.hole") {
        return Err(reader.conflict(
            &HOLE_DIAMETER,
            "the nodes of the mesh define the outline and the holes of the joint; remove it",
        ));
    }
    if body == Body::Resonator {
        let mesh_elements = resonator_elements(reader, elements, grid)?;
        elements = Some(reader.note(&ELEMENTS, mesh_elements));
    }
    let diameter = reader.peek(&HOLE_DIAMETER)?;
    if reader.has("joint.hole") && diameter.is_none() {
        return Err(reader.missing(&HOLE_DIAMETER, ""));
    }
    if diameter.is_some_and(|d| d >= size[0].min(size[1])) {
        return Err(implausible_size(reader, size, diameter).unwrap_or_else(|| {
            reader.out_of_range(&HOLE_DIAMETER, "less than the shorter side of joint.size")
        }));
    }
    let hole = match (body, diameter, elements) {
        (Body::Resonator, Some(diameter), Some(elements)) => {
            check_hole(reader, diameter, size, elements)?;
            None
        }
        _ => diameter,
    };
    match hole {
        Some(diameter) => _ = reader.note(&HOLE_DIAMETER, diameter),
        None => reader.record.note("joint.hole", Json::Null),
    }
    Ok(Some(Joint {
        size,
        grid,
        elements,
        hole,
    }))
}

/// Range of the sides of a bolted joint \[m\].
const BOLTED: [f64; 2] = [1e-3, 2.0];

/// Returns the error for a hole that does not fit a joint of implausible size: the size is then probably wrong.
fn implausible_size(
    reader: &Reader<'_>,
    size: [f64; 2],
    diameter: Option<f64>,
) -> Option<SceneError> {
    let diameter = diameter?;
    let plausible_sides = BOLTED[0]..=BOLTED[1];
    (!size.iter().all(|side| plausible_sides.contains(side))).then(|| {
        reader.out_of_range(
            &SIZE,
            format!(
                "a few times the diameter of its hole, {:.4} mm: mm, um or m?",
                diameter * 1e3
            ),
        )
    })
}

/// Returns the contact elements of a resonator, whose mesh has the same number along x and y.
fn resonator_elements(
    reader: &Reader<'_>,
    given_elements: Option<[usize; 2]>,
    grid: Option<[usize; 2]>,
) -> Result<[usize; 2]> {
    let default = [Resonator::default().lap_cells; 2];
    let elements = given_elements.unwrap_or(default);
    if elements[0] != elements[1] {
        return Err(reader.out_of_range(
            &ELEMENTS,
            "the same number along x and y for a resonator, such as [19, 19]",
        ));
    }
    match grid {
        Some(grid) if reader.has("surface") && (0..2).any(|d| grid[d] < elements[d]) => {
            Err(reader.out_of_range(
                &GRID,
                format!(
                    "at least one cell per contact element, {} along x and y, or elements would bear no load",
                    elements[0]
                ),
            ))
        }
        _ => Ok(elements),
    }
}

/// Checks that the hole given for a resonator agrees with its mesh, a staircase of contact elements, to within one
/// element.
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
    let absent = resonator.contact_array().absent.len();
    let staircase = 2.0 * (absent as f64 * side[0] * side[1] / std::f64::consts::PI).sqrt();
    let tolerance = side[0].max(side[1]);
    if (diameter - staircase).abs() <= tolerance {
        return Ok(());
    }
    Err(implausible_size(reader, size, Some(diameter)).unwrap_or_else(|| reader.out_of_range(
        &HOLE_DIAMETER,
        format!(
            "within {:.4} mm of {:.4} mm: the mesh of a resonator defines its hole, {absent} contact elements; remove joint.hole",
            tolerance * 1e3,
            staircase * 1e3
        ),
    )))
}

pub(super) fn material(reader: &Reader<'_>, body: Body) -> Result<Option<Bodies>> {
    let example = match body {
        Body::Joint => lines(&[&YOUNGS_MODULUS, &POISSON_RATIO]),
        Body::Matrices if !reader.has("surface") && !reader.has("material") => return Ok(None),
        Body::Matrices => lines(&[&YOUNGS_MODULUS, &POISSON_RATIO]),
        Body::Resonator => lines(&[&YOUNGS_MODULUS, &POISSON_RATIO, &DENSITY]),
        Body::Oscillator if reader.has("material") => {
            let reason =
                "an oscillator has a mass and a stiffness instead, in [structure]; remove it";
            return Err(reader.misplaced("material", reason));
        }
        Body::Oscillator => return Ok(None),
    };
    if !reader.has("material") {
        return Err(reader.missing_section("material", "the elastic constants", &example));
    }
    // The common value is always read, so that its faults are found even if both bodies override it.
    let value_or_common = |own: &Key<Quantity>, common: &Key<Quantity>| -> Result<Option<f64>> {
        let common = reader.peek(common)?;
        reader.optional(own, common)
    };
    type Solid = (Elastic, Option<f64>);
    let solid = |[modulus, ratio, density]: [&Key<Quantity>; 3]| -> Result<Solid> {
        let needed =
            |own, common| value_or_common(own, common)?.ok_or_else(|| reader.missing(common, ""));
        let constants = (
            needed(modulus, &YOUNGS_MODULUS),
            needed(ratio, &POISSON_RATIO),
        )
            .all()?;
        let elastic = Elastic {
            youngs_modulus: constants.0,
            poisson_ratio: constants.1,
        };
        Ok((elastic, value_or_common(density, &DENSITY)?))
    };
    let lower = solid([&LOWER_YOUNGS_MODULUS, &LOWER_POISSON_RATIO, &LOWER_DENSITY]);
    let upper = solid([&UPPER_YOUNGS_MODULUS, &UPPER_POISSON_RATIO, &UPPER_DENSITY]);
    let (lower, upper) = (lower, upper).all()?;
    Ok(Some(Bodies {
        elastic: Pair {
            lower: lower.0,
            upper: upper.0,
        },
        density: [lower.1, upper.1],
    }))
}

/// Checks that the joint has cells and that the motion is not too long. Checks that the pressure cap permits the load.
pub(super) fn check_patch(reader: &Reader<'_>, scene: &Scene) -> Result<()> {
    let Some(rough) = scene.rough() else {
        return Ok(());
    };
    let patch = rough.patch();
    if patch.cells() == 0 {
        return Err(reader.out_of_range(&GRID, "finer: no cell has its centre outside the hole"));
    }
    let (axes, varying) = match &scene.motion {
        Some(Motion::Harmonic(motion)) => (&motion.axes[..], motion.normal_load_amplitude),
        _ => (&[][..], 0.0),
    };
    let size = patch.grid.size();
    let too_long = |(k, axis): (usize, &Harmonic)| !axis.is_force && axis.amplitude >= size[k];
    if let Some(axis) = axes.iter().enumerate().position(too_long) {
        return Err(reader.out_of_range(
            &MOTION_AMPLITUDE,
            format!(
                "less than the length of the joint, {:.4} mm along {}: slip is assumed to be small",
                size[axis] * 1e3,
                ["x", "y"][axis]
            ),
        ));
    }
    // The loads of a history are not known yet.
    if matches!(scene.motion, Some(Motion::History { .. })) {
        return Ok(());
    }
    let mean = (rough.conditions.normal_load + varying) / patch.area();
    if rough.conditions.pressure_cap.is_some_and(|cap| cap <= mean) {
        return Err(reader.out_of_range(
            &contact::PRESSURE_CAP,
            format!(
                "greater than the largest load over the area of the joint, {:.4} MPa",
                mean * 1e-6
            ),
        ));
    }
    Ok(())
}
