//! What can be wrong with a joint.

use super::OTHER_SIZE;

/// What is wrong with a joint.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InterfaceError {
    /// Fewer nodes than a plane needs.
    #[error(
        "the {side} body has {count} nodes at the joint; a joint has at least 4, not all on one line"
    )]
    TooFew {
        /// Which body.
        side: &'static str,
        /// Its nodes.
        count: usize,
    },
    /// The nodes lie in no plane.
    #[error(
        "node {node} lies {off:.4} mm off the plane of the joint, which is {across:.4} mm across; the nodes of a joint lie in one plane"
    )]
    NotPlane {
        /// The node farthest from it.
        node: i64,
        /// How far \[mm\].
        off: f64,
        /// Longest distance from the middle \[mm\].
        across: f64,
    },
    /// Nothing says which body is above.
    #[error(
        "nothing says which way the normal of the joint points: the bodies touch (or are joined there, by a *TIE or common nodes, which leaves no joint), and the positions of their other nodes are not known or lie on one side; give structure.normal, from the lower body into the upper one"
    )]
    NoNormal,
    /// The normal that was given is not that of the nodes.
    #[error(
        "structure.normal is {angle:.1} degrees off the normal of the plane of the nodes, [{:.4}, {:.4}, {:.4}]", .found[0], .found[1], .found[2]
    )]
    OtherNormal {
        /// Angle between both.
        angle: f64,
        /// That of the nodes.
        found: [f64; 3],
    },
    /// The x axis that was given is the normal.
    #[error("structure.along is the normal of the joint; its x axis lies in its plane")]
    AlongNormal,
    /// The scene has another joint.
    #[error(
        "joint.size is {:.5} x {:.5} mm, and the nodes of the joint span {:.5} x {:.5} mm{}", .given[0], .given[1], .found[0], .found[1], hint(.given, .found)
    )]
    OtherSize {
        /// That of the scene \[mm\].
        given: [f64; 2],
        /// That of the nodes \[mm\].
        found: [f64; 2],
    },
    /// The nodes are those of another array.
    #[error(
        "joint.elements is [{}, {}], and the nodes are the corners of [{}, {}] rectangles; leave joint.elements out", .given[0], .given[1], .found[0], .found[1]
    )]
    OtherCounts {
        /// That of the scene.
        given: [usize; 2],
        /// That of the nodes.
        found: [usize; 2],
    },
    /// The nodes form no array, and the scene gives none.
    #[error(
        "the {nodes} nodes of the joint are not the corners of equal rectangles; give joint.elements, the contact elements along x and y, such as [{}, {}]", .about[0], .about[1]
    )]
    NoArray {
        /// Nodes of the upper body.
        nodes: usize,
        /// About as many rectangles as nodes.
        about: [usize; 2],
    },
    /// More contact elements than nodes.
    #[error(
        "joint.elements has {wanted} places between its rectangles, and a face of the joint {nodes} nodes, which cannot move in more ways; make it smaller"
    )]
    TooFine {
        /// Places between the rectangles.
        wanted: usize,
        /// Nodes of the face with fewer.
        nodes: usize,
    },
    /// The normal that was given points the other way.
    #[error(
        "structure.normal points from the upper body into the lower one, as the positions of their nodes have it; turn it, or exchange upper and lower in structure.interface"
    )]
    AgainstPositions,
    /// Both bodies are elsewhere.
    #[error(
        "the nodes of the upper and the lower body do not face each other: the nearest node of the lower one is {off:.4} mm along the joint from the middle of the upper ones, which reach {across:.4} mm"
    )]
    Apart {
        /// Distance of the nearest node from the middle, in the plane \[mm\].
        off: f64,
        /// Longest distance from the middle \[mm\].
        across: f64,
    },
    /// The upper face is not over the lower one.
    #[error(
        "the nodes of the upper body reach {by:.4} mm beyond those of the lower one along {along} of the joint: the lower face must reach under all upper nodes, because contact is computed there; shift the bodies, or exchange upper and lower in structure.interface"
    )]
    Overhang {
        /// Axis of the joint.
        along: &'static str,
        /// How far \[mm\].
        by: f64,
    },
    /// One body is far above the other.
    #[error(
        "the nodes of the upper and the lower body are {distance:.4} mm apart along the normal of the joint, which reaches {across:.4} mm from its middle; bodies that touch lie on each other: see the positions of the nodes"
    )]
    Distant {
        /// Distance of both planes \[mm\].
        distance: f64,
        /// Longest distance from the middle \[mm\].
        across: f64,
    },
    /// A contact element has no nodes around it.
    #[error(
        "the contact element at ({:.4}, {:.4}) mm has too few nodes of the {side} body around it; make joint.elements smaller", .at[0], .at[1]
    )]
    NoNodes {
        /// Which body.
        side: &'static str,
        /// Where it is, from the middle of the joint \[mm\].
        at: [f64; 2],
    },
    /// Areas that are not those of the joint.
    #[error(
        "the areas of the pairs sum up to {given:.5} mm2, and those of the contact elements to {found:.5} mm2; see structure.unit, and whether all nodes of the joint are among the pairs"
    )]
    OtherArea {
        /// Those of the pairs \[mm²\].
        given: f64,
        /// Those of the contact elements \[mm²\].
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
