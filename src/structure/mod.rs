//! From the drawing of a bolted structure to the small model that vibrates: mesh, finite elements, modes and static residual.
//!
//! - [`mesh`]: hexahedral meshes and points on them; [`resonator`]: the parametric single-lap-joint resonator.
//! - [`element`]: the 8-node hexahedron, plain and with incompatible modes; [`solids`]: those and others, of meshes of other programs.
//! - [`assembly`]: sparse stiffness and mass; [`order`]: the order of elimination.
//! - [`modes`]: rigid and elastic modes; [`reduction`]: the model in relative contact displacements.
//! - [`statics`]: what loads that stay do at the joint.
//! - [`half_space`]: what a mesh has of the compliance of a half space.
//! - [`outline`]: the edges of the bodies, for a drawing.
//! - [`contact_array`]: where the contact elements are.
//! - [`matrices`]: stiffness and mass from other programs, read by [`readers`]; [`frequencies`] and [`inspection`]: what they say;
//!   [`node_tables`], [`interface`] and [`imported`]: their joint, and the small model at it.
//! - [`deck`] and [`matrix_files`]: the resonator as an input deck of other finite-element programs, and as matrices.
//!
//! Degree of freedom 3·n + a is the displacement of node n along axis a (x, y, z) \[m\]. Everything is in SI, but matrices of other
//! programs, which are in the units of their files.
//!
//! ```
//! use fretwear::material::{Elastic, Material};
//! use fretwear::structure::element::Formulation;
//! use fretwear::structure::{assembly::System, mesh::Mesh};
//!
//! let steel = Material {
//!     elastic: Elastic { youngs_modulus: 198.4e9, poisson_ratio: 0.3 },
//!     density: 7949.0,
//! };
//! let block = Mesh::block([0.1, 0.02, 0.03], [10, 3, 4], steel);
//! let system = System::assemble(&block, Formulation::IncompatibleModes, &[])?;
//! assert_eq!(system.size(), 3 * 11 * 4 * 5);
//! assert!((system.total_mass() / (7949.0 * 0.1 * 0.02 * 0.03) - 1.0).abs() < 1e-12);
//! # Ok::<(), fretwear::structure::StructureError>(())
//! ```

pub mod assembly;
pub mod contact_array;
pub mod deck;
pub mod element;
mod error;
pub mod face;
pub mod frequencies;
pub mod half_space;
pub mod imported;
pub mod inspection;
pub mod interface;
pub mod matrices;
pub mod matrix_files;
mod memory_to_reduce;
pub mod mesh;
pub mod modes;
pub mod node_tables;
pub mod order;
pub mod outline;
pub mod readers;
pub mod reduction;
pub mod resonator;
pub mod solids;
pub mod statics;
pub mod superelement;

pub use error::StructureError;
