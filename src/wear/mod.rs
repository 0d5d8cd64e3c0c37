//! Fretting of a joint under a given motion: the steady cycle, the energy it dissipates, and the wear that follows.

pub mod coarse;
pub mod curves;
pub mod cycle;
pub mod error_bar;
pub mod event_search;
pub mod explicit;
pub mod fields;
mod harmonic_motion;
pub mod implicit;
pub mod indentation;
pub mod joint;
mod law;
mod limits;
pub mod motion;
mod nodal_motion;
mod pace;
mod pressing;
mod scheme;
pub mod semi_implicit;
mod sequence;
pub mod slip_band;

pub use harmonic_motion::{Harmonic, HarmonicMotion};
pub use joint::{FrettingJoint, WearError};
pub use law::WearLaw;
pub(crate) use motion::mean_of;
pub use motion::{Channel, Motion};
pub use nodal_motion::NodalMotion;
pub use pressing::{BodyMotions, NodalLoad, PressedBodies};
pub use scheme::{Scheme, StepOutcome};
