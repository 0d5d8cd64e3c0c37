//! From the merged tree to a [`Scene`]: defaults, ranges, and what must or must not stand together.

mod contact;
mod cycles;
mod dynamics;
mod fidelity;
mod joint;
mod output;
mod structure;
mod surface;

use super::document::Node;
use super::error::SceneError;
use super::keys::{
    dynamics::{FORCE, FREQUENCY},
    joint::TITLE,
    lines,
    structure::KIND,
};
use super::reader::Reader;
use super::{Scene, Surface};

type Result<T> = std::result::Result<T, SceneError>;

/// What a scene is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Body {
    /// A joint without a structure.
    Joint,
    /// `[structure] kind = "resonator"`
    Resonator,
    /// `[structure] kind = "oscillator"`
    Oscillator,
}

pub(super) fn scene(tree: &Node, name: String) -> Result<Scene> {
    let reader = Reader::new(tree);
    // Before the keys: those of a kind that is not there yet are unknown.
    let only = "only \"resonator\" and \"oscillator\" are";
    reader.refuse_words(&KIND, &["matrices", "mesh", "reduced"], only)?;
    reader.check_keys()?;
    let body = body(&reader)?;
    let joint = joint::joint(&reader, body)?;
    let contact = contact::contact(&reader, body)?;
    let fidelity = fidelity::fidelity(&reader)?;
    let material = joint::material(&reader, body)?;
    let surface = surface(&reader, body, joint.as_ref())?;
    let motion = match &contact {
        Some(contact) => cycles::motion(&reader, contact)?,
        None => None,
    };
    let wear = cycles::wear(&reader, body, &fidelity)?;
    let structure =
        structure::structure(&reader, body, joint.as_ref(), material, contact.is_some())?;
    let dynamics = match &structure {
        Some(structure) => Some(dynamics::dynamics(&reader, structure, contact.as_ref())?),
        None => None,
    };
    let scene = Scene {
        title: reader.get(&TITLE)?,
        name,
        update: cycles::update(&reader, wear.as_ref(), dynamics.as_ref())?,
        output: output::output(&reader, wear.as_ref(), dynamics.as_ref())?,
        fidelity: fidelity::with_vibration(
            &reader,
            fidelity,
            structure.as_ref(),
            dynamics.as_ref(),
            contact.is_some(),
        )?,
        joint,
        material,
        surface,
        contact,
        structure,
        dynamics,
        motion,
        wear,
        document: tree.to_table(),
    };
    joint::check_patch(&reader, &scene)?;
    Ok(scene)
}

fn body(reader: &Reader<'_>) -> Result<Body> {
    match (reader.has("structure"), reader.has("dynamics")) {
        (false, false) => return Ok(Body::Joint),
        (true, false) => {
            let purpose = "[structure] needs it: what makes it vibrate";
            return Err(reader.missing_section("dynamics", purpose, &lines(&[&FORCE, &FREQUENCY])));
        }
        (false, true) => {
            let purpose = "[dynamics] needs it: what vibrates";
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
        _ => Body::Oscillator,
    })
}

/// The surface of a scene that has one. Whether it may have one, and must, is known from the contact.
fn surface(
    reader: &Reader<'_>,
    body: Body,
    joint: Option<&super::Joint>,
) -> Result<Option<Surface>> {
    match joint {
        Some(joint) if body == Body::Joint || reader.has("surface") => {
            surface::surface(reader, joint).map(Some)
        }
        _ => Ok(None),
    }
}
