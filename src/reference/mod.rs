//! Closed forms and independent oracles that the solvers are held to.
//!
//! Nothing here shares code with the solvers: the elastic constants of the pair are reduced anew, and the only discrete
//! solution ([`axisymmetric`]) has a dense matrix of elliptic integrals for a kernel. Lengths are in metres, pressures in
//! pascals, compression positive. Inputs are taken to be positive and finite; every function states what lies outside its
//! range of validity.

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
