//! Closed forms and independent reference solutions that verify the solvers.
//!
//! The module `reference` shares no code with the solvers, and computes the elastic constants of the pair by its own
//! formulas. The only discrete solution ([`axisymmetric`]) uses a dense matrix of elliptic integrals as the kernel.
//! Lengths are in metres, pressures in pascals, compression positive. Inputs are assumed positive and finite. The doc
//! comment of each function states the inputs for which the closed form is valid.

pub mod axisymmetric;
pub mod cattaneo_mindlin;
pub mod duffing;
pub mod elastic;
pub mod elliptic;
pub mod hertz;
pub mod jenkins;
pub mod jenkins_oscillator;
pub mod punch;
pub mod wear;
pub mod westergaard;

pub use axisymmetric::CappedHertz;
pub use cattaneo_mindlin::CattaneoMindlin;
pub use duffing::Duffing;
pub use hertz::Hertz;
pub use jenkins::Jenkins;
pub use jenkins_oscillator::JenkinsOscillator;
pub use punch::CircularPunch;
pub use wear::WinklerWear;
pub use westergaard::Westergaard;
