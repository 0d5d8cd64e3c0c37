//! What can go wrong between a structure's drawing and its reduced model.

use crate::linalg::LinalgError;

/// A structure that cannot be meshed, assembled or reduced.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StructureError {
    /// A number out of its range.
    #[error("{name} is {value:e}; it must be {expected}")]
    OutOfRange {
        /// What the number is.
        name: &'static str,
        /// The value found.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A load along a rigid motion in which the pressure at the joint does no work.
    #[error(
        "nothing bears {}: {share:.1e} of its work is in a rigid motion that the pressure at the joint does not resist; hold the structure, or balance the load",
        if *load == 0 { "the preload" } else { "the constant forces of dynamics.force" }
    )]
    Unborne {
        /// Number of the load: 0 of the preload, 1 of the constant forces.
        load: usize,
        /// Part of its work in such motions.
        share: f64,
    },
    /// Faces that do not move as two rigid bodies where the structure is free to.
    #[error(
        "contact element {element} does not move with the others of its face in a rigid motion of the structure: the two faces of the joint must belong to two separate bodies"
    )]
    NotTwoBodies {
        /// The contact element.
        element: usize,
    },
    /// A structure whose joint is not that of its mesh and material.
    #[error(
        "between neighbouring nodes of the joint the structure has {ratio:.3} times the flexibility that a half space of [material] has in its mesh, and {least} to {most} is right: a modulus or a unit of the structure is another than that of [material], or its elements under the joint are no boxes, or the two faces have meshes of different fineness; give structure.layer if it was not found, mesh both faces alike, or use contact.pressing = \"punch\""
    )]
    OtherMesh {
        /// The ratio.
        ratio: f64,
        /// The least that is right.
        least: f64,
        /// The largest that is right.
        most: f64,
    },
    /// Two numbers that do not fit each other.
    #[error("{name} is {value:e}, but {other} is {other_value:e}; {expected}")]
    DoNotFit {
        /// What the number is.
        name: &'static str,
        /// The value found.
        value: f64,
        /// What it must fit.
        other: &'static str,
        /// The value of that.
        other_value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A hexahedron that is turned inside out, or has no volume.
    #[error(
        "element {element} has a Jacobian of {jacobian:e} m³; it must be positive (8 nodes: one face counter-clockwise seen from the opposite face, then that face)"
    )]
    InvertedElement {
        /// Number of the element, from 0.
        element: usize,
        /// Smallest Jacobian determinant at its integration points \[m³\].
        jacobian: f64,
    },
    /// A point outside all elements.
    #[error("the point {name} at ({:e}, {:e}, {:e}) m lies in no element of the mesh", .position[0], .position[1], .position[2])]
    PointOutside {
        /// Name of the point.
        name: String,
        /// Where it is \[m\].
        position: [f64; 3],
    },
    /// A node number, or degree of freedom, that does not exist.
    #[error("{what} {index} does not exist; there are {count}, counted from 0")]
    NoSuch {
        /// `"node"` or `"degree of freedom"`.
        what: &'static str,
        /// The number found.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// The modes were not found.
    #[error(
        "{converged} of {wanted} modes converged with {vectors} Lanczos vectors: residual {residual:.3e}, {tolerance:.1e} asked; of a stiffness or mass that is not positive, or where both are exchanged, there are none (fretwear inspect tells)"
    )]
    NotConverged {
        /// Modes that did converge.
        converged: usize,
        /// Modes asked for.
        wanted: usize,
        /// Lanczos vectors spent.
        vectors: usize,
        /// Largest relative residual among the modes asked for.
        residual: f64,
        /// The residual asked for.
        tolerance: f64,
    },
    /// More modes than the structure has.
    #[error(
        "{wanted} elastic modes are asked of a structure that has {available}: everything else is held, has no mass, or moves as a whole"
    )]
    TooManyModes {
        /// Modes asked for.
        wanted: usize,
        /// Degrees of freedom with mass, less the rigid ones.
        available: usize,
    },
    /// A factorization that does not exist.
    #[error("{matrix}: {source}")]
    Factorization {
        /// Which matrix.
        matrix: &'static str,
        /// What went wrong.
        source: LinalgError,
    },
}
