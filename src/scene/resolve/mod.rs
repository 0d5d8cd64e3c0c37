//! Resolves the merged tree to a [`Scene`]: applies defaults, and checks ranges and combinations of keys.

mod contact;
mod cycles;
mod dynamics;
mod fidelity;
mod joint;
mod output;
mod structure;
mod surface;

use std::collections::BTreeMap;

use super::document::{Content, Node};
use super::error::SceneError;
use super::faults::{All, Faults};
use super::keys::{
    dynamics::{FORCE, FREQUENCY, FRICTION_LAW},
    joint::TITLE,
    lines,
    structure::KIND,
};
use super::reader::Reader;
use super::{FrictionLaw, Scene, Surface};
use crate::recipe::{Reasons, Recipe};

type Result<T> = std::result::Result<T, SceneError>;

/// Kind of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Body {
    /// A joint without a structure.
    Joint,
    /// `[structure] kind = "resonator"`
    Resonator,
    /// `[structure] kind = "matrices"`, or `"mesh"`
    Matrices,
    /// `[structure] kind = "oscillator"`
    Oscillator,
}

pub(super) fn scene(tree: &Node, name: String) -> Result<Scene> {
    let reader = Reader::new(tree);
    // The reader rejects an unavailable kind of structure first, because the keys of an unavailable kind are unknown.
    let only = "only \"resonator\", \"matrices\", \"mesh\" and \"oscillator\" are";
    reader.refuse_words(&KIND, &["reduced"], only)?;
    let mut faults = Faults::default();
    let scene = sections(&reader, name, &mut faults);
    // The sections report more specific faults than `check_keys`, so the faults of the sections come first.
    faults.value_or_record(reader.check_keys());
    faults.end_sorted()?;
    match scene {
        Some(scene) => Ok(scene),
        None => unreachable!("what has no value has a fault"),
    }
}

/// Resolves the sections whose prerequisites are sound. Consequences of a fault are not reported.
fn sections(reader: &Reader<'_>, name: String, faults: &mut Faults) -> Option<Scene> {
    let title = faults.value_or_record(reader.peek(&TITLE));
    let body = faults.value_or_record(body(reader))?;
    let joint = faults.value_or_record(joint::joint(reader, body));
    let contact = faults.value_or_record(contact::contact(reader, body));
    let fidelity = faults.value_or_record(fidelity::fidelity(reader));
    let material = faults.value_or_record(joint::material(reader, body));
    let surface = faults.value_or_record(surface(reader, body, joint.as_ref()));
    let motion = match &contact {
        Some(Some(contact)) => faults.value_or_record(cycles::motion(reader, contact)),
        Some(None) => Some(None),
        None => None,
    };
    // If `[fidelity]` has a fault, check the sections that need it against its defaults.
    let empty_tree = Node {
        place: reader.root.place.clone(),
        content: Content::Section(BTreeMap::new()),
    };
    let fidelity_or_default = match &fidelity {
        Some(fidelity) => Some(fidelity.clone()),
        None => fidelity::fidelity(&Reader::new(&empty_tree)).ok(),
    };
    let fidelity_or_default = fidelity_or_default?;
    let contact_section = contact.as_ref().and_then(Option::as_ref);
    let wear = faults.value_or_record(cycles::wear(
        reader,
        body,
        &fidelity_or_default,
        contact_section,
    ));
    let (joint, contact, material) = (joint?, contact?, material?);
    let contact = contact.as_ref();
    let source = structure::source(reader, body, joint.as_ref(), material, contact);
    let source = faults.value_or_record(source)?;
    let vibrates = source.is_some();
    let (response, structure, friction_law) = match source {
        Some(source) => {
            let response = dynamics::response(reader, &source, contact, &fidelity_or_default);
            (
                faults.value_or_record(response).map(Some),
                faults
                    .value_or_record(structure::structure(reader, source, contact))
                    .map(Some),
                faults.value_or_record(reader.value(&FRICTION_LAW)),
            )
        }
        None => {
            faults.value_or_record(fidelity::check_without_vibration(reader));
            (Some(None), Some(None), Some(FrictionLaw::default()))
        }
    };
    let wear = wear?;
    let update = faults.value_or_record(cycles::update(
        reader,
        wear.as_ref(),
        vibrates,
        fidelity_or_default.preset,
    ));
    let output = faults.value_or_record(output::output(reader, wear.as_ref(), vibrates));
    let fidelity = fidelity?;
    let scene = Scene {
        name,
        recipe: Recipe {
            title: title?,
            structure: structure?,
            joints: Vec::new(),
            response: response?,
            wear,
            output: output?,
            asked_error: fidelity.tolerance,
            grid_check: fidelity.grid_check,
            why: Reasons::default(),
        },
        joint,
        material,
        surface: surface?,
        contact: contact.cloned(),
        motion: motion?,
        friction_law: friction_law?,
        update: update?,
        fidelity,
        canonical: reader.record.canonical(),
        document: reader.root.to_table(),
    };
    faults.value_or_record(joint::check_patch(reader, &scene))?;
    faults.value_or_record(fidelity::check_grid(reader, &scene))?;
    Some(scene)
}

fn body(reader: &Reader<'_>) -> Result<Body> {
    match (reader.has("structure"), reader.has("dynamics")) {
        (false, false) => return Ok(Body::Joint),
        (true, false) => {
            let purpose = "[structure] needs it: the forces that make it vibrate";
            return Err(reader.missing_section("dynamics", purpose, &lines(&[&FORCE, &FREQUENCY])));
        }
        (false, true) => {
            let purpose = "[dynamics] needs it: the structure that vibrates";
            return Err(reader.missing_section("structure", purpose, &KIND.line()));
        }
        (true, true) => {}
    }
    if reader.has("motion") {
        let reason = "[dynamics] computes the motion of the joint; give one or the other";
        return Err(reader.misplaced("motion", reason));
    }
    let kind = reader.kind(&KIND)?;
    Ok(match kind {
        "resonator" => Body::Resonator,
        "matrices" | "mesh" => Body::Matrices,
        _ => Body::Oscillator,
    })
}

/// Reads the surface of a scene. A scene that has a joint but no structure must have a surface. A scene with a
/// structure may omit the surface.
fn surface(
    reader: &Reader<'_>,
    body: Body,
    joint: Option<&Option<super::Joint>>,
) -> Result<Option<Surface>> {
    // The surface is read even if the joint has a fault.
    let longer = match joint {
        Some(None) => return Ok(None),
        Some(Some(joint)) => joint.size[0].max(joint.size[1]),
        None => f64::INFINITY,
    };
    if body == Body::Joint || reader.has("surface") {
        return surface::surface(reader, longer).map(Some);
    }
    Ok(None)
}
