//! Fretting of a joint under a given motion: the steady cycle, the energy it dissipates, and the wear that follows.

pub mod cycle;
pub mod error_bar;
pub mod explicit;
pub mod implicit;
pub mod joint;
pub mod landing;
pub mod motion;
pub mod sampled;
pub mod semi_implicit;
pub mod superposition;

pub use joint::{FrettingJoint, WearError};
pub use motion::{Channel, Harmonic, Motion};
