//! Closed forms and independent reference solutions that verify the solvers.
//!
//! No code here is shared with the solvers. The elastic constants of the pair are computed anew. The only
//! discrete solution ([`axisymmetric`]) uses a dense matrix of elliptic integrals as its kernel. Lengths are
//! in metres, pressures in pascals, compression positive. Inputs are assumed positive and finite. Every
//! function states its range of validity.

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
