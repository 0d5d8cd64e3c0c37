//! Parts of a recipe. A stage declares the parts of the recipe that it reads. The stage sees only the declared parts,
//! and the key of the stage includes only the declared parts.

use serde_json::{Map, Value};

use super::{Durability, Joint, Keep, Output, Reasons, Recipe, ResonanceOf, Wear};

/// A part of a recipe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The vibrating structure.
    Structure,
    /// Cells and heights of the joint.
    Surface,
    /// The rough contact.
    Contact,
    /// The cycle, with the prescribed motion.
    Cycle,
    /// The contact elements.
    Elements,
    /// Excitation and response of the structure.
    Response,
    /// Wear, with the cycles and the volume that end the run.
    Wear,
    /// Settings of the wear without the end of the run: all wear settings on which a state of wear depends.
    WearLaw,
    /// Whether the current iteration writes the curves. The part does not contain the interval between such iterations.
    Curves,
    /// Fields of the cycle that the current iteration writes. The part does not contain the interval between such
    /// iterations.
    CycleFields,
    /// Whether the current iteration is the last iteration. The part does not contain the cycles or the volume that end
    /// the run.
    End,
    /// The cycles at which a response is requested.
    ResponseAt,
    /// Whether the current iteration writes a forced response. The part does not list the other iterations that write a
    /// forced response.
    ForcedResponse,
    /// Whether a second run computes the scene on half the grid.
    GridCheck,
}

impl Part {
    /// Returns the name of the part in a stored recipe.
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
    /// Returns a recipe that contains only the given `parts`.
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

    /// Returns the values of the `parts` by name. The key of a stage includes these values. The function omits the
    /// reasons of choices, because the reasons do not affect a result.
    pub fn parameters(&self, parts: &[Part]) -> Map<String, Value> {
        let parameter = |part: Part| {
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
        let scheduled_parts = [
            Part::Curves,
            Part::CycleFields,
            Part::End,
            Part::ForcedResponse,
        ];
        let parts = parts.iter().filter(|part| !scheduled_parts.contains(part));
        parts.map(|part| parameter(*part)).collect()
    }
}

/// Removes fields that do not influence a result.
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
