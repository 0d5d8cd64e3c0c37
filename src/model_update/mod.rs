//! The structure's contact elements as the fine contact solution gives them [A §2e], and when they are due for an update.
//!
//! The fine contact is solved on the joint's grid, with hundreds of cells along a side; the structure has a few hundred contact
//! elements. [`ContactElements`] is the map between both, [`Springs`] says what of the fine contact's compliance the elements
//! get, [`ElementParameters`] is the result; or [`Laws`] gives each a law of its own. [`UpdateCriterion`] decides after a wear step whether they are renewed, and [`preload`]
//! how much of the bolt's load is left.

mod bolt;
mod bolt_compliance;
mod criterion;
mod elements;
mod end_loads;
mod error;
mod joint_motion;
mod motion_energy;
pub mod sliders;
mod stiffness;
mod trend;

pub use bolt::{Bolt, BoltContact, PRELOAD_TOLERANCE, Preload, preload};
pub use bolt_compliance::{BoltHead, BoltedJoint, Clamping, metric_thread};
pub use criterion::{CycleFigures, DueUpdate, UpdateCause, UpdateCriterion, UpdateState};
pub use elements::{ContactElements, Nodes};
pub use end_loads::EndLoads;
pub use error::ModelUpdateError;
pub use joint_motion::Loading;
pub use motion_energy::with_energy_of;
pub use sliders::{Laws, Sliders};
pub use stiffness::{
    Compliance, Distribution, ElementParameters, Linearisation, SMALLEST_COMPLIANCE, Springs,
    StiffnessKind, fine_displacement,
};
pub use trend::{Trend, is_steady};
