//! Steady vibration of a structure with friction contacts: multi-harmonic balance, continuation and resonance.
//!
//! A [`LinearModel`] gives the contact displacements that forces cause; [`reduced_model`] builds one from finite
//! elements. [`InterfaceElement`]s give the contact forces that displacements cause. [`HarmonicBalance`] combines the
//! linear model and the interface elements [A eq. 2.1–2.2]. [`Continuation`] follows the response over a range of
//! frequencies. [`resonance`] tracks only the phase resonance and the peak.
//!
//! Conventions: an element has three displacements, x and y in its plane and n along its normal. The displacements are
//! *relative* between the two bodies; n is positive when the bodies approach. Zero displacement is the preloaded state.
//! A contact force is positive along its displacement, and the equation of motion subtracts the contact force. The work
//! of a contact force over a cycle is the energy that the force takes from the structure. All quantities are in SI
//! units. Frequencies are angular \[rad/s\] unless a name says otherwise.
//!
//! ```
//! use std::f64::consts::TAU;
//! use fretwear::dynamics::{
//!     ContactElement, FrictionLaw, HarmonicBalance, Harmonics, Oscillator, BalanceSettings, Slider,
//! };
//!
//! // A mass of 1.5 kg on a spring and a friction contact.
//! let oscillator = Oscillator {
//!     mass: [1.5; 3],
//!     damping: [300.0; 3],
//!     stiffness: [4e7; 3],
//!     element: ContactElement {
//!         area: 4e-6,
//!         friction_coefficient: 0.6,
//!         law: FrictionLaw::Cone,
//!         springs: vec![],
//!         sliders: vec![Slider {
//!             normal_load: 90.0,
//!             gap: 0.0,
//!             tangential_stiffness: 2.5e7,
//!             normal_stiffness: 3.5e7,
//!         }],
//!     },
//! };
//! let load = Oscillator::load(0, 120.0, 0.0);
//! let balance = HarmonicBalance::new(
//!     &oscillator.model()?,
//!     vec![oscillator.element.clone()],
//!     Harmonics::up_to(5),
//!     vec![load],
//!     BalanceSettings::default(),
//! )?;
//! let response = balance.solve(TAU * 850.0, None)?;
//! // Friction and damping dissipate the work of the load.
//! assert!(response.energy.friction > 0.0);
//! assert!(response.energy.imbalance() < 1e-6);
//! # Ok::<(), fretwear::dynamics::DynamicsError>(())
//! ```

pub mod aft;
pub mod backbone;
mod branch;
mod closed_model;
pub mod contact_element;
pub mod continuation;
pub mod cycle;
mod effort;
mod error;
pub mod forced_response;
pub mod harmonic_balance;
pub mod harmonics;
mod krylov;
mod line;
pub mod linear_model;
mod linear_resonance;
mod march;
mod newton;
pub mod oscillator;
mod peak_bound;
mod preconditioner;
mod predictor;
pub mod pseudo_modes;
mod receptance;
pub mod reduced;
pub mod resonance;
pub mod response;
mod slider;
pub mod spring;
pub mod truncation;
pub mod vibration;

pub use aft::{InterfaceElement, Sampling};
pub use backbone::{
    Backbone, BackboneEnd, BackbonePoint, DrivenStructure, LoadLevels, resonance_over_parameter,
};
pub use closed_model::{ClosedModel, Core};
pub use contact_element::{ContactElement, ElementState};
pub use continuation::{Continuation, ContinuationSettings};
pub use cycle::{JointCycle, JointSummary};
pub use error::DynamicsError;
pub use forced_response::{ForcedPoint, RangeResponse, SolutionMethod};
pub use harmonic_balance::{BalanceSettings, HarmonicBalance, Load};
pub use harmonics::Harmonics;
pub use linear_model::{LinearModel, Rayleigh, SecondOrder};
pub use linear_resonance::{LinearLimits, LinearResonance, LinearResonances, LinearResponse};
pub use oscillator::Oscillator;
pub use receptance::Receptance;
pub use reduced::{Damping, reduced_model, reference_springs};
pub use response::{Energy, Response, Start};
pub use slider::{FrictionLaw, Slider};
pub use spring::Spring;
pub use truncation::{
    Correction, CorrectionRequest, Extension, ResolvedResonance, TruncationError,
};
pub use vibration::{Resonance, ResonanceKind, Vibration};
