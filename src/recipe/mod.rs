//! The recipe of a run: everything that the run will use, as plain data, with the reason for each choice.
//!
//! A scene is the input of the user. [`crate::scene::Plan`] makes all choices and converts the scene into a recipe. The
//! functions that build objects from a recipe make no choices, and stages do not see the scene. All quantities are in
//! SI units. Each part of the recipe has its own file. The file contains the functions that build objects from the
//! part, and the texts about the part for the user. Only the file of a part contains code for the different kinds of
//! the part. For example, only `structure.rs` distinguishes the kinds of structures.

mod check;
mod contact;
mod cycle;
mod cycle_fields;
mod decision;
pub mod element_table;
mod elements;
mod explanation;
mod inputs;
mod parts;
mod pressing;
mod resources;
mod response;
mod stored_plan;
mod structure;
mod surface;
mod wear;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use crate::model_update::UpdateCriterion;
pub use crate::structure::contact_array::ContactArray;
pub use crate::wear::Scheme;
pub use check::Check;
pub use contact::{BoltCompliance, Conditions, Contact, Tolerances, YIELD_PRESSURE};
pub(crate) use cycle::why_computed;
pub use cycle::{Cycle, CycleError, MotionKind, MotionSource, STRAIGHT_WITH_LAWS};
pub use cycle_fields::CycleFields;
pub use decision::Decision;
pub use elements::{ElementStiffness, Elements, Layout, Updates};
pub use explanation::decisions;
pub use inputs::{GridTwin, Identity, Inputs};
pub use parts::Part;
pub use pressing::{Preload, StructureMesh, StructurePressing};
pub use resources::ResourceEstimate;
pub use response::{Base, BaseMotion, DampingBasis, Force, Port, Response};
pub use stored_plan::StoredPlan;
pub use structure::{Import, ImportFiles, JointSets, Structure, StructureSource};
pub use surface::{Cells, FEWEST_CELLS, Heights, HeightsFile, Mirror, SecondFace, Surface};
pub use wear::Wear;

/// Everything that a run will use.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// Title given by the user.
    pub title: Option<String>,
    /// The vibrating structure; `None` without vibration.
    pub structure: Option<Structure>,
    /// The joints; empty for a structure without contact.
    pub joints: Vec<Joint>,
    /// Excitation of the structure and the requested response; always given together with `structure`.
    pub response: Option<Response>,
    /// Wear over many cycles; `None` for a single pass.
    pub wear: Option<Wear>,
    /// Iterations and outputs that a run keeps.
    pub output: Output,
    /// Requested bound on the error bar of the worn volume; `None` if the scene sets no such bound.
    pub asked_error: Option<f64>,
    /// True if a second run computes the scene on half the grid.
    pub grid_check: bool,
    /// Reasons for the numbers that a preset may set, by their keys in a scene.
    pub why: Reasons,
}

/// A joint, either rough or with prescribed stiffness.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Cells and unworn heights; `None` for a joint with prescribed stiffness.
    pub surface: Option<Surface>,
    /// The rough contact; given whenever there is a surface.
    pub contact: Option<Contact>,
    /// The cycle of the rough contact; `None` if nothing moves it.
    pub cycle: Option<Cycle>,
    /// The contact elements; given whenever there is a structure.
    pub elements: Option<Elements>,
}

/// Reasons for choices, by the name of the field that contains the choice.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Reasons(BTreeMap<String, String>);

impl Reasons {
    /// Records the reason for a choice.
    pub fn add(&mut self, choice: &str, why: impl Into<String>) {
        self.0.insert(choice.to_owned(), why.into());
    }

    /// Returns the reason for a choice, or an empty text.
    pub fn of(&self, choice: &str) -> &str {
        self.0.get(choice).map_or("", String::as_str)
    }
}

/// Iterations and outputs that a run keeps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// Iterations that the run keeps.
    pub keep: Keep,
    /// Fields of the steady cycle that the run writes; `None` if it neither writes nor stores any.
    #[serde(with = "cycle_fields")]
    pub cycle_fields: Option<CycleFields>,
    /// Interval in iterations at which indentation and hysteresis curves are written; 0 for never.
    pub curves_every: u64,
    /// True if the stiffness of the joint is computed in every iteration.
    pub stiffness: bool,
    /// Cycles at which the run computes a forced response of the worn state. The forced responses of worn states do not
    /// drive the wear.
    pub response_at: Vec<u64>,
    /// States of wear for which the run computes a separate resonance.
    #[serde(default)]
    pub resonance: ResonanceOf,
    /// Time at which data are flushed to disk.
    pub durability: Durability,
}

/// States of wear for which the run computes a separate resonance, which does not drive the wear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ResonanceOf {
    /// States with an update, and states with a forced response.
    #[default]
    Updates,
    /// All states.
    All,
}

/// Time at which the data of a run are flushed to disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Durability {
    /// At every commit.
    #[default]
    Commit,
    /// When the run ends or is stopped.
    End,
}

/// Iterations that a run keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Keep {
    /// All of them.
    All,
    /// Some of them.
    #[serde(untagged)]
    Some {
        /// Interval in iterations; `None` to keep only the iterations below.
        every: Option<u64>,
        /// Number of last iterations to keep, at least one.
        last: u64,
        /// True to keep iterations with a model update.
        updates: bool,
    },
}

impl Keep {
    /// Returns the number of iterations that the run keeps out of the given number of `states`, not counting updates.
    /// The unworn state is always kept.
    pub(crate) fn count(self, states: f64) -> f64 {
        match self {
            Keep::All => states,
            Keep::Some { every, last, .. } => {
                let regular = every.map_or(1.0, |every| (states / every as f64).ceil());
                (regular + last as f64).min(states)
            }
        }
    }
}

impl Recipe {
    /// Returns the joint, if there is one. A run has at most one joint.
    pub fn joint(&self) -> Option<&Joint> {
        self.joints.first()
    }

    /// Returns cells and heights of the joint, if it is rough.
    pub fn surface(&self) -> Option<&Surface> {
        self.joint()?.surface.as_ref()
    }

    /// Returns a notice about the pressing of the joint, for a structure that comes from files.
    pub fn pressing_notice(&self) -> Option<&'static str> {
        let structure = self.structure.as_ref()?;
        let contact = self
            .contact()
            .filter(|_| structure.source.import().is_some())?;
        match &contact.pressing {
            None => Some(
                "the preload is distributed over the joint as by a rigid punch, not by the bodies of structure.file; the real loads and wear may lie elsewhere, and no error bar covers this",
            ),
            Some(pressing) if pressing.preload == Preload::Faces => Some(
                "contact.normal_load presses both faces of the joint evenly, which no bolt does; give the places where the head and the nut of the bolt press in contact.preload",
            ),
            Some(_) => None,
        }
    }

    /// Returns the rough contact of the joint.
    pub fn contact(&self) -> Option<&Contact> {
        self.joint()?.contact.as_ref()
    }

    /// Returns the cycle of the joint.
    pub fn cycle(&self) -> Option<&Cycle> {
        self.joint()?.cycle.as_ref()
    }

    /// Returns true if the run ends with the next iteration after an iteration with the given `load` \[N\]. `bar` is
    /// the relative error bar of the load.
    pub fn ends_after(&self, load: Option<f64>, bar: Option<f64>) -> bool {
        let (Some(wear), Some(contact)) = (&self.wear, self.contact()) else {
            return false;
        };
        let unworn = contact.conditions.normal_load;
        load.is_some_and(|load| wear.has_lost(load, bar.unwrap_or(0.0), unworn))
    }

    /// Returns the contact elements of the joint.
    pub fn elements(&self) -> Option<&Elements> {
        self.joint()?.elements.as_ref()
    }
}
