//! The recipe of a run: everything that it will use, as plain data, with the reason beside each choice.
//!
//! A scene is what a user writes; [`crate::scene::Plan`] makes a recipe of it, and that is the only place that chooses. What a part of a
//! recipe builds decides nothing, and no stage knows the scene. All quantities are SI. Each part stands in one file with what is built from
//! it and with its words for people: what kinds of a structure, a surface or a wear step there are, only that file knows.

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
pub use contact::{BoltCompliance, Conditions, Contact, Tolerances, YIELDS};
pub(crate) use cycle::why_computed;
pub use cycle::{Cycle, CycleError, MotionKind, MotionSource, STRAIGHT_WITH_LAWS};
pub use cycle_fields::CycleFields;
pub use decision::Decision;
pub use elements::{ElementStiffness, Elements, Layout, Updates};
pub use explanation::decisions;
pub use inputs::{GridTwin, Identity, Inputs};
pub use parts::Part;
pub use pressing::{Preload, StructureMesh, StructurePressing};
pub use resources::Counted;
pub use response::{Base, BaseMotion, DampingBasis, Force, Port, Response};
pub use stored_plan::StoredPlan;
pub use structure::{Import, ImportFiles, JointSets, Structure, StructureSource};
pub use surface::{Cells, FEWEST_CELLS, Heights, HeightsFile, Mirror, SecondFace, Surface};
pub use wear::Wear;

/// Everything that a run will use.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// What the user calls it.
    pub title: Option<String>,
    /// What vibrates; none without vibration.
    pub structure: Option<Structure>,
    /// The joints; none in a structure without contact.
    pub joints: Vec<Joint>,
    /// How the structure is made to vibrate, and what of its response is wanted; always together with `structure`.
    pub response: Option<Response>,
    /// Wear over many cycles; none for a single pass.
    pub wear: Option<Wear>,
    /// What a run keeps.
    pub output: Output,
    /// Bound that is asked for on the error bar of the worn volume; none: that of the other tolerances.
    pub asked_error: Option<f64>,
    /// Whether the scene is run on half the grid too.
    pub grid_check: bool,
    /// Why the numbers of its parts that a preset has a say in are what they are, by their keys in a scene.
    pub why: Reasons,
}

/// A joint: rough, or of given stiffness.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Its cells and unworn heights; none of a joint of given stiffness.
    pub surface: Option<Surface>,
    /// The rough contact; there whenever there is a surface.
    pub contact: Option<Contact>,
    /// The cycle that the rough contact goes through; none where nothing moves it.
    pub cycle: Option<Cycle>,
    /// Its contact elements; there whenever there is a structure.
    pub elements: Option<Elements>,
}

/// Why a choice was made, by the name of the field that holds it.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Reasons(BTreeMap<String, String>);

impl Reasons {
    /// Notes the reason of a choice.
    pub fn add(&mut self, choice: &str, why: impl Into<String>) {
        self.0.insert(choice.to_owned(), why.into());
    }

    /// The reason of a choice; empty if there is none.
    pub fn of(&self, choice: &str) -> &str {
        self.0.get(choice).map_or("", String::as_str)
    }
}

/// What a run keeps and writes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// Which iterations are kept.
    pub keep: Keep,
    /// Which fields of the steady cycle are written; none: none, and none are held.
    #[serde(with = "cycle_fields")]
    pub cycle_fields: Option<CycleFields>,
    /// Indentation and hysteresis curves are written every so many iterations; 0: never.
    pub curves_every: u64,
    /// Whether the stiffness of the joint is wanted at every iteration.
    pub stiffness: bool,
    /// Cycles at which a forced response of the worn state is computed, without feeding it back.
    pub response_at: Vec<u64>,
    /// Which states of wear have a resonance of their own.
    #[serde(default)]
    pub resonance: ResonanceOf,
    /// When what is written is on the disk.
    pub durability: Durability,
}

/// Which states of wear have a resonance of their own, which is not fed back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ResonanceOf {
    /// Those of updates, and those with a forced response.
    #[default]
    Updates,
    /// All.
    All,
}

/// When what a run writes is on the disk for good.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Durability {
    /// At every commit.
    #[default]
    Commit,
    /// Where the run ends or is stopped.
    End,
}

/// Which iterations are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Keep {
    /// All of them.
    All,
    /// Some of them.
    #[serde(untagged)]
    Some {
        /// Every so many; none: only those below.
        every: Option<u64>,
        /// The last so many, at least one.
        last: u64,
        /// Those that updated the model.
        updates: bool,
    },
}

impl Keep {
    /// Iterations that are kept of this many states, updates not counted. The unworn state is always kept.
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
    /// The joint, where there is one: a run has one at most as yet.
    pub fn joint(&self) -> Option<&Joint> {
        self.joints.first()
    }

    /// Cells and heights of the joint, where it is rough.
    pub fn surface(&self) -> Option<&Surface> {
        self.joint()?.surface.as_ref()
    }

    /// What a user should know of how the joint of a structure that comes from files is pressed.
    pub fn pressing_notice(&self) -> Option<&'static str> {
        let structure = self.structure.as_ref()?;
        let contact = self
            .contact()
            .filter(|_| structure.source.import().is_some())?;
        match &contact.pressing {
            None => Some(
                "the preload is distributed over the joint as by a rigid punch, not by the bodies of structure.file; loads and wear may be far from where they are, and no error bar covers this",
            ),
            Some(pressing) if pressing.preload == Preload::Faces => Some(
                "contact.normal_load presses both faces of the joint evenly, which no bolt does; contact.preload says where the head and the nut of a bolt press",
            ),
            Some(_) => None,
        }
    }

    /// The rough contact of the joint.
    pub fn contact(&self) -> Option<&Contact> {
        self.joint()?.contact.as_ref()
    }

    /// The cycle of the joint.
    pub fn cycle(&self) -> Option<&Cycle> {
        self.joint()?.cycle.as_ref()
    }

    /// True if the run ends with the iteration after one that bears this load \[N\], known to this relative bar.
    pub fn ends_after(&self, load: Option<f64>, bar: Option<f64>) -> bool {
        let (Some(wear), Some(contact)) = (&self.wear, self.contact()) else {
            return false;
        };
        let unworn = contact.conditions.normal_load;
        load.is_some_and(|load| wear.has_lost(load, bar.unwrap_or(0.0), unworn))
    }

    /// The contact elements of the joint.
    pub fn elements(&self) -> Option<&Elements> {
        self.joint()?.elements.as_ref()
    }
}
