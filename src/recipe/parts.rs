//! Parts of a recipe: what a stage declares that it reads, what it then sees, and what of it goes into its key.

use serde_json::{Map, Value};

use super::{Durability, Joint, Keep, Output, Reasons, Recipe, ResonanceOf, Wear};

/// A part of a recipe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// What vibrates.
    Structure,
    /// Cells and heights of the joint.
    Surface,
    /// The rough contact.
    Contact,
    /// The cycle, with the motion that is prescribed.
    Cycle,
    /// The contact elements.
    Elements,
    /// How the structure vibrates.
    Response,
    /// Wear, with the cycles and the volume that end it.
    Wear,
    /// Wear but for its end: what a state of wear depends on.
    WearLaw,
    /// Whether the curves of this iteration are wanted: not how often they are.
    Curves,
    /// Which fields of the cycle of this iteration are wanted, if any: not how often they are.
    CycleFields,
    /// Whether this iteration is the last: not where the run ends.
    End,
    /// The cycles at which a response is wanted.
    ResponseAt,
    /// Whether a forced response of this iteration is wanted: not of which others one is.
    ForcedResponse,
    /// Whether the scene is run on half the grid too.
    GridCheck,
}

impl Part {
    /// The name, as in a recipe that is written.
    pub fn name(self) -> &'static str {
        match self {
            Part::Structure => "structure",
            Part::Surface => "surface",
            Part::Contact => "contact",
            Part::Cycle => "cycle",
            Part::Elements => "elements",
            Part::Response => "response",
            Part::Wear => "wear",
            Part::WearLaw => "wear_law",
            Part::Curves => "output.curves_every",
            Part::CycleFields => "output.cycle_fields",
            Part::End => "end",
            Part::ResponseAt => "output.response_at",
            Part::ForcedResponse => "forced_response_due",
            Part::GridCheck => "grid_check",
        }
    }
}

impl Recipe {
    /// The recipe with nothing but these parts.
    pub fn only(&self, parts: &[Part]) -> Recipe {
        let has = |part| parts.contains(&part);
        let law = |wear: &Wear| Wear {
            cycles: None,
            volume: None,
            until_preload: None,
            ..wear.clone()
        };
        let joint = |joint: &Joint| Joint {
            surface: joint.surface.clone().filter(|_| has(Part::Surface)),
            contact: joint.contact.clone().filter(|_| has(Part::Contact)),
            cycle: joint.cycle.clone().filter(|_| has(Part::Cycle)),
            elements: joint.elements.clone().filter(|_| has(Part::Elements)),
        };
        let response_at = match has(Part::ResponseAt) {
            true => self.output.response_at.clone(),
            false => Vec::new(),
        };
        Recipe {
            title: None,
            structure: self.structure.clone().filter(|_| has(Part::Structure)),
            joints: self.joints.iter().map(joint).collect(),
            response: self.response.clone().filter(|_| has(Part::Response)),
            wear: match has(Part::Wear) {
                true => self.wear.clone(),
                false => self.wear.as_ref().filter(|_| has(Part::WearLaw)).map(law),
            },
            output: Output {
                keep: Keep::All,
                cycle_fields: self
                    .output
                    .cycle_fields
                    .clone()
                    .filter(|_| has(Part::CycleFields)),
                curves_every: 0,
                stiffness: true,
                response_at,
                resonance: ResonanceOf::default(),
                durability: Durability::default(),
            },
            asked_error: None,
            grid_check: self.grid_check && has(Part::GridCheck),
            why: Reasons::default(),
        }
    }

    /// The parts by name, as they go into the key of a stage. Reasons do not influence a result.
    pub fn parameters(&self, parts: &[Part]) -> Map<String, Value> {
        let of = |part: Part| {
            let only = self.only(&[part]);
            let joint = only.joint();
            let value = match part {
                Part::Structure => serde_json::to_value(&only.structure),
                Part::Surface => serde_json::to_value(joint.map(|joint| &joint.surface)),
                Part::Contact => serde_json::to_value(joint.map(|joint| &joint.contact)),
                Part::Cycle => serde_json::to_value(joint.map(|joint| &joint.cycle)),
                Part::Elements => serde_json::to_value(joint.map(|joint| &joint.elements)),
                Part::Response => serde_json::to_value(&only.response),
                Part::Wear | Part::WearLaw => serde_json::to_value(&only.wear),
                Part::GridCheck => serde_json::to_value(only.grid_check),
                Part::ResponseAt => serde_json::to_value(&only.output.response_at),
                Part::Curves | Part::CycleFields | Part::End | Part::ForcedResponse => {
                    unreachable!("who reads it says whether they are due")
                }
            };
            let mut value = value.expect("a recipe is numbers, words and UTF-8 paths");
            strip(&mut value);
            (part.name().to_owned(), value)
        };
        let where_due = [
            Part::Curves,
            Part::CycleFields,
            Part::End,
            Part::ForcedResponse,
        ];
        let parts = parts.iter().filter(|part| !where_due.contains(part));
        parts.map(|part| of(*part)).collect()
    }
}

/// Takes away what does not influence a result.
fn strip(value: &mut Value) {
    match value {
        Value::Object(object) => {
            object.remove("why");
            object.values_mut().for_each(strip);
        }
        Value::Array(items) => items.iter_mut().for_each(strip),
        _ => (),
    }
}
