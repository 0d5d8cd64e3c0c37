//! Errors of a joint.

use super::OTHER_SIZE;

/// Error for a joint whose nodes are invalid or do not match the scene.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InterfaceError {
    /// A body has fewer nodes than a plane needs.
    #[error(
        "the {side} body has {count} nodes at the joint; a joint has at least 4, not all on one line"
    )]
    TooFew {
        /// `"lower"` or `"upper"` body.
        side: &'static str,
        /// Number of its nodes.
        count: usize,
    },
    /// The nodes are not in one plane.
    #[error(
        "node {node} lies {off:.4} mm off the plane of the joint, which is {across:.4} mm across; the nodes of a joint lie in one plane"
    )]
    NotPlane {
        /// Node with the largest distance from the plane.
        node: i64,
        /// Distance from the plane \[mm\].
        off: f64,
        /// Largest distance of a node from the middle of the joint \[mm\].
        across: f64,
    },
    /// The direction of the normal is unknown.
    #[error(
        "the direction of the joint normal is unknown: the bodies touch, and the positions of their other nodes are unknown or on one side (bodies joined by a *TIE or common nodes have no joint); give structure.normal, from the lower body into the upper one"
    )]
    NoNormal,
    /// The normal of the scene is not the normal of the nodes.
    #[error(
        "structure.normal is {angle:.1} degrees off the normal of the plane of the nodes, [{:.4}, {:.4}, {:.4}]", .found[0], .found[1], .found[2]
    )]
    NormalMismatch {
        /// Angle between both normals \[degrees\].
        angle: f64,
        /// Normal of the nodes.
        found: [f64; 3],
    },
    /// The x axis of the scene is along the normal.
    #[error("structure.along is the normal of the joint; its x axis lies in its plane")]
    AlongNormal,
    /// The size of the joint in the scene differs from that of the nodes.
    #[error(
        "joint.size is {:.5} x {:.5} mm, and the nodes of the joint span {:.5} x {:.5} mm{}", .given[0], .given[1], .found[0], .found[1], hint(.given, .found)
    )]
    SizeMismatch {
        /// Size in the scene \[mm\].
        given: [f64; 2],
        /// Size of the nodes \[mm\].
        found: [f64; 2],
    },
    /// The number of contact elements in the scene differs from that of the nodes.
    #[error(
        "joint.elements is [{}, {}], and the nodes are the corners of [{}, {}] rectangles; leave joint.elements out", .given[0], .given[1], .found[0], .found[1]
    )]
    CountMismatch {
        /// Numbers in the scene.
        given: [usize; 2],
        /// Numbers from the nodes.
        found: [usize; 2],
    },
    /// The nodes of the joint form no array, and the scene defines no array of contact elements.
    #[error(
        "the {nodes} nodes of the joint are not the corners of equal rectangles; give joint.elements, the contact elements along x and y, such as [{}, {}]", .about[0], .about[1]
    )]
    NoArray {
        /// Number of nodes of the upper body.
        nodes: usize,
        /// Suggested numbers of rectangles, about as many as nodes.
        about: [usize; 2],
    },
    /// The array has more grid points than a face has nodes.
    #[error(
        "joint.elements gives {wanted} grid points, but a face of the joint has only {nodes} nodes; give fewer contact elements"
    )]
    TooFine {
        /// Number of grid points between the rectangles.
        wanted: usize,
        /// Number of nodes of the face that has fewer.
        nodes: usize,
    },
    /// The normal of the scene points from the upper body into the lower one.
    #[error(
        "structure.normal points from the upper body into the lower one, according to the positions of their nodes; reverse it, or exchange upper and lower in structure.interface"
    )]
    AgainstPositions,
    /// The two bodies are at different places along the joint.
    #[error(
        "the nodes of the upper and the lower body do not face each other: the nearest node of the lower one is {off:.4} mm along the joint from the middle of the upper ones, which reach {across:.4} mm"
    )]
    NotFacing {
        /// Distance of the nearest lower node from the middle of the upper nodes, in the plane \[mm\].
        off: f64,
        /// Largest distance of an upper node from the middle \[mm\].
        across: f64,
    },
    /// The upper face extends beyond the lower one.
    #[error(
        "the nodes of the upper body reach {by:.4} mm beyond those of the lower one along {along} of the joint: the lower face must reach under all upper nodes, because contact is computed there; shift the bodies, or exchange upper and lower in structure.interface"
    )]
    Overhang {
        /// Axis of the joint.
        along: &'static str,
        /// Length of the overhang \[mm\].
        by: f64,
    },
    /// The faces are far apart along the normal.
    #[error(
        "the nodes of the upper and the lower body are {distance:.4} mm apart along the normal of the joint, which reaches {across:.4} mm from its middle; faces in contact must lie on each other: check the positions of the nodes"
    )]
    Distant {
        /// Distance between both planes \[mm\].
        distance: f64,
        /// Largest distance of a node from the middle of the joint \[mm\].
        across: f64,
    },
    /// The body has too few nodes around a contact element.
    #[error(
        "the contact element at ({:.4}, {:.4}) mm has too few nodes of the {side} body around it; make joint.elements smaller", .at[0], .at[1]
    )]
    NoNodes {
        /// `"lower"` or `"upper"` body.
        side: &'static str,
        /// Centre of the contact element, from the middle of the joint \[mm\].
        at: [f64; 2],
    },
    /// The areas of the pairs differ from the areas of the contact elements.
    #[error(
        "the areas of the pairs sum up to {given:.5} mm2, and those of the contact elements to {found:.5} mm2; check structure.unit, and that all nodes of the joint are among the pairs"
    )]
    AreaMismatch {
        /// Total area of the pairs \[mm²\].
        given: f64,
        /// Total area of the contact elements \[mm²\].
        found: f64,
    },
}

fn hint(given: &[f64; 2], found: &[f64; 2]) -> String {
    let ratio = [0, 1].map(|d| found[d] / given[d]);
    let is_same = (ratio[0] / ratio[1] - 1.0).abs() < OTHER_SIZE;
    if is_same
        && [1e-3, 1e3]
            .iter()
            .any(|r| (ratio[0] / r - 1.0).abs() < OTHER_SIZE)
    {
        return ": see structure.unit.length".to_owned();
    }
    let swapped = [0, 1].map(|d| found[1 - d] / given[d] - 1.0);
    if swapped.iter().all(|off| off.abs() < OTHER_SIZE) {
        return ": x and y are the other way round; structure.along gives the x axis".to_owned();
    }
    let axes = "; structure.along gives the x axis";
    if is_same { "" } else { axes }.to_owned()
}
