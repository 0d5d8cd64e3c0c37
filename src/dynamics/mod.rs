//! Steady vibration of a structure with friction contacts: multi-harmonic balance, continuation and resonance.
//!
//! A [`LinearModel`] ([`reduced_model`] makes it of finite elements) says how contact displacements answer to forces,
//! [`InterfaceElement`]s say what forces they cause, and [`HarmonicBalance`] joins them [A eq. 2.1–2.2]. [`Continuation`] follows the response over a range of frequencies,
//! [`resonance`] tracks the phase resonance and the peak alone.
//!
//! Conventions throughout: an element has three displacements, x and y in its plane and n along its normal, *relative* between
//! the two bodies; n is positive when the bodies approach. Displacement zero is the preloaded state. A contact force is
//! positive along its displacement and is subtracted in the equation of motion, so its work over a cycle is what it takes from
//! the structure. Everything is in SI units, frequencies are angular \[rad/s\] unless a name says otherwise.

pub mod aft;
mod closed_model;
pub mod closure;
pub mod contact_element;
pub mod continuation;
pub mod cycle;
mod error;
pub mod harmonic_balance;
pub mod harmonics;
mod krylov;
pub mod linear_model;
mod march;
mod newton;
mod newton_step;
pub mod oscillator;
mod peak;
pub mod reduced;
pub mod resonance;
pub mod response;
mod slider;
pub mod truncation;
pub mod vibration;

pub use aft::{InterfaceElement, Sampling};
pub use closed_model::{ClosedModel, Core};
pub use contact_element::{ContactElement, ElementState};
pub use continuation::{Continuation, ContinuationSettings};
pub use cycle::{JointCycle, JointSummary};
pub use error::DynamicsError;
pub use harmonic_balance::{HarmonicBalance, Load, Settings};
pub use harmonics::Harmonics;
pub use linear_model::{LinearModel, Receptance, SecondOrder};
pub use oscillator::Oscillator;
pub use reduced::{Damping, reduced_model, reference_springs};
pub use response::{Energy, Response, Start};
pub use slider::FrictionLaw;
pub use truncation::{Resolved, Truncation};
pub use vibration::{ForcedPoint, Resonance, Vibration};
