//! Structural model of a bolted joint, from the mesh to the reduced model.
//!
//! - [`mesh`]: hexahedral meshes and points on them; [`resonator`]: the parametric single-lap-joint resonator.
//! - [`element`]: the 8-node hexahedron, plain and with incompatible modes; [`solids`]: the elements of imported
//!   meshes.
//! - [`assembly`]: sparse stiffness and mass; [`order`]: the elimination order.
//! - [`modes`]: rigid and elastic modes; [`reduction`]: the model in relative contact displacements.
//! - [`statics`]: the response of the joint to constant loads.
//! - [`half_space`]: the compliance of a meshed half space.
//! - [`outline`]: the edges of the bodies, for drawings.
//! - [`contact_array`]: the positions of the contact elements.
//! - [`matrices`]: stiffness and mass from other programs; [`readers`]: their file formats; [`frequencies`] and
//!   [`inspection`]: checks of the matrices.
//! - [`node_tables`], [`interface`] and [`imported`]: the joint of an imported structure and its reduced model.
//! - [`deck`] and [`matrix_files`]: export of the resonator as an input deck and as matrices.
//!
//! Degree of freedom 3·n + a is the displacement of node n along axis a (x, y, z) \[m\]. All quantities are in SI,
//! except imported matrices, which keep the units of their files.
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
