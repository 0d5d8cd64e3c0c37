//! What cannot be made of matrices.

use crate::structure::StructureError;
use crate::structure::inspection::FixedError;
use crate::structure::interface::InterfaceError;
use crate::structure::matrices::{Dof, Role};

/// What cannot be made of matrices.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ImportError {
    /// A matrix is missing.
    #[error("the files have no {}; a structure that vibrates has stiffness and mass", .0.name())]
    Missing(Role),
    /// No file says what the rows are.
    #[error(
        "no file says which node and direction the {rows} rows stand for{}; give structure.nodes, a table of the nodes in the order of the rows, or the program's list of freedoms beside the matrices", nodes_told(*.nodes)
    )]
    NoDofs {
        /// Rows of the matrices.
        rows: usize,
        /// Nodes in the table of nodes.
        nodes: usize,
    },
    /// A matrix is not symmetric.
    #[error(
        "the {} is not symmetric: {:.6e} in row {} and column {} against {:.6e}, {:.1e} of its largest entry", .role.name(), .values.0, .at.0, .at.1, .values.1, .share
    )]
    Unsymmetric {
        /// Which.
        role: Role,
        /// Where, by what the rows stand for.
        at: (Dof, Dof),
        /// Both values.
        values: (f64, f64),
        /// Their difference over the largest entry.
        share: f64,
    },
    /// What the user holds is not there.
    #[error("structure.fixed: {0}")]
    Fixed(#[from] FixedError),
    /// A node of the joint, or of a point, has no position.
    #[error(
        "node {0} has no position; give structure.nodes, a table of node, x, y and z, or the deck of the model{1}"
    )]
    NoPosition(i64, String),
    /// A node that the scene uses has displacements along other axes.
    #[error(
        "node {0}, which the joint, a force, the response or structure.fixed uses, has {1}; write the matrices along the global axes"
    )]
    LocalAxes(i64, String),
    /// A node of the joint, or of a point, has no row.
    #[error(
        "node {node} has no displacement along {axis} in the matrices{}", if *.is_held { ": structure.fixed holds it" } else { ": the program has removed it, nothing with mass is joined to it, a tie or an equation of the deck makes it follow others, or there is no such node" }
    )]
    NoRow {
        /// The node.
        node: i64,
        /// x, y or z.
        axis: &'static str,
        /// The scene holds it.
        is_held: bool,
    },
    /// There is no such set.
    #[error("{key}: there is no set of nodes \"{name}\"; the files have {known}")]
    NoSet {
        /// The key.
        key: &'static str,
        /// The name.
        name: String,
        /// Those there are.
        known: String,
    },
    /// A preload without a direction.
    #[error(
        "contact.preload: the centroids of head \"{}\" and nut \"{}\" are one point, so that the forces between them have no direction; they must be at both ends of the bolt",
        .0[0], .0[1]
    )]
    PreloadNowhere([String; 2]),
    /// A node twice.
    #[error("node {node} is in two pairs of the joint; each node of a body faces one of the other")]
    Twice {
        /// The node.
        node: i64,
    },
    /// A node of a bonded joint that faces none.
    #[error(
        "structure.interface: without [contact] the joint is bonded, and its faces must match node for node; no lower node of its own is where node {node} of the upper face is; tie the faces in the deck (*TIE) and leave structure.interface out, or give [contact]"
    )]
    NotNodeForNode {
        /// The upper one.
        node: i64,
    },
    /// A node on both sides.
    #[error("node {node} is on both sides of the joint: bodies that share nodes are bonded there")]
    Both {
        /// The node.
        node: i64,
    },
    /// The joint cannot be found.
    #[error("structure.interface: {0}")]
    Interface(#[from] InterfaceError),
    /// A mass below zero.
    #[error("the mass of freedom {dof} is {mass:.6e} on its diagonal; a mass is zero or more")]
    NegativeMass {
        /// Whose.
        dof: Dof,
        /// In the unit of the file.
        mass: f64,
    },
    /// Hysteretic damping that feeds a motion.
    #[error(
        "the {kind} damping feeds some motion: between modes it has an eigenvalue of {share:.1e} of the largest below zero; it must be zero or more for every motion"
    )]
    NegativeDamping {
        /// viscous or structural.
        kind: &'static str,
        /// Size of the least eigenvalue, over the largest.
        share: f64,
    },
    /// The two nodes of a pair do not face each other.
    #[error(
        "structure.interface: the nodes of the pair {upper}, {lower} are {off:.4} mm apart along the joint, whose rectangles have sides of {side:.4} mm; see the positions of the nodes, or give two sets of nodes instead of pairs"
    )]
    Askew {
        /// Of the upper body.
        upper: i64,
        /// Of the lower body.
        lower: i64,
        /// How far apart, in the plane \[mm\].
        off: f64,
        /// Shorter side of a contact element's rectangle \[mm\].
        side: f64,
    },
    /// Nothing has mass.
    #[error("{rows} of {all} rows belong to bodies without any mass; see structure.mass")]
    Massless {
        /// Rows without.
        rows: usize,
        /// All rows.
        all: usize,
    },
    /// Some motion of rows without mass is resisted by nothing.
    #[error(
        "some motion of rows without mass is resisted by nothing; hold it with structure.fixed, or leave these rows out of the matrices"
    )]
    Loose,
    /// The stiffness drives something away.
    #[error(
        "the stiffness is not positive: a mode has omega^2 = {0:.4e} s^-2, which grows by itself; the matrices are of an unstable state, or of different files"
    )]
    Unstable(f64),
    /// It cannot be reduced.
    #[error(transparent)]
    Structure(#[from] StructureError),
}

fn nodes_told(nodes: usize) -> String {
    match nodes {
        0 => String::new(),
        nodes => format!(", and they are neither three nor six for each of the {nodes} nodes"),
    }
}
