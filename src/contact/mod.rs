//! Contact of two elastic half spaces: kernels, normal problem, tangential problem, coupled problem, and contact
//! stiffness.

pub mod area;
mod cells;
mod coarse;
pub mod coupled;
mod coupling;
mod error;
mod far_field;
mod half_space;
mod kernel;
pub mod nodes;
pub mod normal;
mod pair;
pub mod stiffness;
mod sums;
pub mod tangential;

pub use error::ContactError;
pub use half_space::{Boundary, HalfSpace, Shear};
pub use kernel::{CellIntegrals, cell_integrals, coupling_integrals};
pub use pair::{Coupling, Pair};

pub use crate::material::Elastic;
