//! From the drawing of a bolted structure to the small model that vibrates: mesh, finite elements, modes and static residual.
//!
//! - [`mesh`]: hexahedral meshes and points on them; [`resonator`]: the parametric single-lap-joint resonator.
//! - [`element`]: the 8-node hexahedron, plain and with incompatible modes.
//! - [`assembly`]: sparse stiffness and mass; [`order`]: the order of elimination.
//! - [`modes`]: rigid and elastic modes; [`reduction`]: the model in relative contact displacements.
//! - [`deck`]: the resonator as an input deck of other finite-element programs.
//!
//! Degree of freedom 3·n + a is the displacement of node n along axis a (x, y, z) \[m\]. Everything is in SI.

pub mod assembly;
pub mod deck;
pub mod element;
mod error;
pub mod mesh;
pub mod modes;
pub mod order;
pub mod reduction;
pub mod resonator;
mod work;

pub use error::StructureError;
pub use work::Work;
