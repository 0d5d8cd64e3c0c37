//! Parameters of the structure's contact elements from the fine contact solution [A §2e], and criteria for an update of
//! the parameters.
//!
//! The fine contact is solved on the grid of the joint, with hundreds of cells along a side. The structure has a few
//! hundred contact elements. [`ContactElements`] maps between the cells of the grid and the contact elements.
//! [`Springs`] selects the part of the contact compliance that the element springs represent. [`ElementParameters`]
//! contains the stiffness of each element. With [`Laws`], each element gets a force law of its own instead of springs.
//! [`UpdateCriterion`] decides after a wear step whether the elements are updated. [`preload`] computes the remaining
//! load of the bolt.

mod bolt;
mod bolt_compliance;
mod criterion;
mod elements;
mod end_loads;
mod error;
mod joint_motion;
mod motion_energy;
mod settings;
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
pub use motion_energy::match_dissipation;
pub use settings::UpdateSettings;
pub use sliders::{Laws, Sliders};
pub use stiffness::{
    Compliance, Distribution, ElementParameters, Linearisation, SMALLEST_COMPLIANCE, Springs,
    StiffnessKind, fine_displacement,
};
pub use trend::{Trend, can_extrapolate};
