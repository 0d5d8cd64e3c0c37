//! Errors of structures from imported matrices.

use crate::structure::StructureError;
use crate::structure::inspection::FixedError;
use crate::structure::interface::InterfaceError;
use crate::structure::matrices::{Dof, Role};

/// Error for imported matrices that do not give a valid structure.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ImportError {
    /// A matrix is missing.
    #[error("the files have no {}; a vibrating structure needs stiffness and mass", .0.name())]
    Missing(Role),
    /// No file describes the rows.
    #[error(
        "no file says which node and direction the {rows} rows have{}; give structure.nodes, a table of the nodes in the order of the rows, or put the program's list of freedoms beside the matrices", nodes_note(*.nodes)
    )]
    NoDofs {
        /// Number of rows of the matrices.
        rows: usize,
        /// Number of nodes in the table of nodes.
        nodes: usize,
    },
    /// A matrix is not symmetric.
    #[error(
        "the {} is not symmetric: it has {:.6e} in row {} and column {}, but {:.6e} across the diagonal. The difference is {:.1e} of its largest entry", .role.name(), .values.0, .at.0, .at.1, .values.1, .share
    )]
    Unsymmetric {
        /// Role of the matrix.
        role: Role,
        /// Degrees of freedom of the row and the column.
        at: (Dof, Dof),
        /// The two values.
        values: (f64, f64),
        /// Difference of the values over the largest entry.
        share: f64,
    },
    /// The user fixes a set, node or row that does not exist.
    #[error("structure.fixed: {0}")]
    Fixed(#[from] FixedError),
    /// A node of the joint, or of a point, has no position.
    #[error(
        "node {0} has no position; give structure.nodes, a table of node, x, y and z, or the deck of the model{1}"
    )]
    NoPosition(i64, String),
    /// A node that the scene uses has displacements along local axes.
    #[error(
        "node {0}, which the joint, a force, the response or structure.fixed uses, has {1}; write the matrices along the global axes"
    )]
    LocalAxes(i64, String),
    /// A node of the joint or of a point has no row.
    #[error(
        "node {node} has no displacement along {axis} in the matrices{}", if *.is_held { ": structure.fixed fixes it" } else { ": the program has removed it, no mass is connected to it, a tie or an equation of the deck makes it dependent, or the node does not exist" }
    )]
    NoRow {
        /// Number of the node.
        node: i64,
        /// Axis of the missing displacement: x, y or z.
        axis: &'static str,
        /// True if the scene fixes the displacement.
        is_held: bool,
    },
    /// A set of nodes does not exist.
    #[error("{key}: there is no set of nodes \"{name}\"; the files have {known}")]
    NoSet {
        /// Key of the scene.
        key: &'static str,
        /// Name of the missing set.
        name: String,
        /// Names of the sets in the files.
        known: String,
    },
    /// The direction of the preload is undefined.
    #[error(
        "contact.preload: the centroids of head \"{}\" and nut \"{}\" coincide, so the preload has no direction; give the nodes at both ends of the bolt",
        .0[0], .0[1]
    )]
    PreloadDirection([String; 2]),
    /// A node occurs twice on a side of the joint.
    #[error("node {node} is in two pairs of the joint; each node of a body faces one of the other")]
    DuplicateNode {
        /// Number of the node.
        node: i64,
    },
    /// A node of a bonded joint faces no other node.
    #[error(
        "structure.interface: without [contact] the joint is bonded, and its faces must match node for node, but node {node} of the upper face has no lower node of its own at the same place; tie the faces in the deck (*TIE) and leave structure.interface out, or give [contact]"
    )]
    NotNodeForNode {
        /// Number of the upper node.
        node: i64,
    },
    /// A node is on both sides of the joint.
    #[error("node {node} is on both sides of the joint: bodies that share nodes are bonded there")]
    OnBothSides {
        /// Number of the node.
        node: i64,
    },
    /// The joint was not found in the nodes.
    #[error("structure.interface: {0}")]
    Interface(#[from] InterfaceError),
    /// A mass is negative.
    #[error("the mass of freedom {dof} is {mass:.6e} on its diagonal; a mass is zero or more")]
    NegativeMass {
        /// Degree of freedom of the mass.
        dof: Dof,
        /// The mass in the unit of the file.
        mass: f64,
    },
    /// A damping matrix feeds energy into a motion.
    #[error(
        "the {kind} damping feeds some motion: its matrix between modes has a negative eigenvalue, {share:.1e} of the largest; the damping of every motion must be zero or more"
    )]
    NegativeDamping {
        /// `"viscous"` or `"structural"`.
        kind: &'static str,
        /// Magnitude of the least eigenvalue over the largest.
        share: f64,
    },
    /// The two nodes of a pair do not face each other.
    #[error(
        "structure.interface: the nodes of the pair {upper}, {lower} are {off:.4} mm apart along the joint, whose rectangles have sides of {side:.4} mm; check the positions of the nodes, or give two sets of nodes instead of pairs"
    )]
    PairOffset {
        /// Node of the upper body.
        upper: i64,
        /// Node of the lower body.
        lower: i64,
        /// Distance between the nodes in the plane of the joint \[mm\].
        off: f64,
        /// Shorter side of a contact element's rectangle \[mm\].
        side: f64,
    },
    /// Some bodies have no mass.
    #[error("{rows} of {all} rows belong to bodies without any mass; check structure.mass")]
    Massless {
        /// Number of rows of bodies without mass.
        rows: usize,
        /// Number of all rows.
        all: usize,
    },
    /// A motion of massless rows has no stiffness.
    #[error(
        "some motion of massless rows has no stiffness; fix it with structure.fixed, or remove these rows from the matrices"
    )]
    NoStiffness,
    /// The stiffness has a negative eigenvalue.
    #[error(
        "the stiffness is not positive: a mode has omega^2 = {0:.4e} s^-2, so its amplitude grows; the matrices are of an unstable state, or do not belong together"
    )]
    Unstable(f64),
    /// The reduction failed.
    #[error(transparent)]
    Structure(#[from] StructureError),
}

fn nodes_note(nodes: usize) -> String {
    match nodes {
        0 => String::new(),
        nodes => format!(", which are neither three nor six for each of the {nodes} nodes"),
    }
}
