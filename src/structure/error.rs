//! Errors of meshing, assembly and reduction.

use crate::linalg::LinalgError;

/// Error for a structure that cannot be meshed, assembled or reduced.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StructureError {
    /// A number is outside the range of valid values.
    #[error("{name} is {value:e}; it must be {expected}")]
    OutOfRange {
        /// Name of the number.
        name: &'static str,
        /// Value of the number.
        value: f64,
        /// Range of valid values.
        expected: &'static str,
    },
    /// A load has a component along a rigid motion that the pressure at the joint does not resist.
    #[error(
        "nothing balances {}: {share:.1e} of its work is in a rigid motion that the pressure at the joint does not resist; support the structure, or balance the load",
        if *load == 0 { "the preload" } else { "the constant forces of dynamics.force" }
    )]
    UnbalancedLoad {
        /// Number of the load: 0 for the preload, 1 for the constant forces.
        load: usize,
        /// Ratio of two works of the load. The numerator is the largest work in a rigid motion that the pressure does
        /// not resist. The denominator is the largest work in any rigid mode.
        share: f64,
    },
    /// The faces of the joint do not move as two rigid bodies in a rigid mode of the structure.
    #[error(
        "contact element {element} does not move with the others of its face in a rigid motion of the structure: the two faces of the joint must belong to two separate bodies"
    )]
    NotTwoBodies {
        /// Number of the contact element.
        element: usize,
    },
    /// The flexibility of the joint does not match the mesh and material that the scene describes.
    #[error(
        "the structure does not match [material] and its mesh: between neighbouring nodes of the joint its flexibility is {ratio:.3} times that of a half space of [material] with the same mesh, and must be {least} to {most} times. A modulus or a unit differs from [material], the elements under the joint are no boxes, or the meshes of the two faces differ in size. Give structure.layer if it was not found, mesh both faces alike, or use contact.pressing = \"punch\""
    )]
    MeshMismatch {
        /// Flexibility of the structure divided by that of the mesh on a half space.
        ratio: f64,
        /// Smallest valid ratio.
        least: f64,
        /// Largest valid ratio.
        most: f64,
    },
    /// Two numbers contradict each other.
    #[error("{name} is {value:e}, but {other} is {other_value:e}; {expected}")]
    Contradiction {
        /// Name of the first number.
        name: &'static str,
        /// Value of the first number.
        value: f64,
        /// Name of the second number.
        other: &'static str,
        /// Value of the second number.
        other_value: f64,
        /// Relation that the two numbers must satisfy.
        expected: &'static str,
    },
    /// A hexahedron is inverted or has no volume.
    #[error(
        "element {element} has a Jacobian of {jacobian:e} m³; it must be positive (8 nodes: one face counter-clockwise seen from the opposite face, then that face)"
    )]
    InvertedElement {
        /// Number of the element, from 0.
        element: usize,
        /// Smallest Jacobian determinant at the integration points of the element \[m³\].
        jacobian: f64,
    },
    /// A point is outside all elements.
    #[error("the point {name} at ({:e}, {:e}, {:e}) m lies in no element of the mesh", .position[0], .position[1], .position[2])]
    PointOutside {
        /// Name of the point.
        name: String,
        /// Its position \[m\].
        position: [f64; 3],
    },
    /// A node, degree of freedom or material does not exist.
    #[error("{what} {index} does not exist; there are {count}, counted from 0")]
    DoesNotExist {
        /// `"node"`, `"degree of freedom"` or `"material"`.
        what: &'static str,
        /// Its number, from 0.
        index: usize,
        /// How many exist.
        count: usize,
    },
    /// The modes did not converge.
    #[error(
        "only {converged} of {wanted} modes converged with {vectors} Lanczos vectors: the residual is {residual:.3e}, and at most {tolerance:.1e} is required; use fretwear inspect to check that stiffness and mass are positive and not exchanged"
    )]
    NotConverged {
        /// Number of converged modes.
        converged: usize,
        /// Number of requested modes.
        wanted: usize,
        /// Number of Lanczos vectors used.
        vectors: usize,
        /// Largest relative residual of the requested modes.
        residual: f64,
        /// Requested tolerance of the residual.
        tolerance: f64,
    },
    /// More modes are requested than the structure has.
    #[error(
        "{wanted} elastic modes are requested, but the structure has {available}: all other motions are fixed, massless or rigid"
    )]
    TooManyModes {
        /// Number of requested modes.
        wanted: usize,
        /// Degrees of freedom with mass, minus the rigid modes.
        available: usize,
    },
    /// A matrix has no factorization or decomposition.
    #[error("{matrix}: {source}")]
    Factorization {
        /// Name of the matrix.
        matrix: &'static str,
        /// Cause.
        source: LinalgError,
    },
}
