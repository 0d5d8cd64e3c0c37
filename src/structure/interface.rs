//! The joint of a finite-element model: nodes of two bodies that face each other, in a plane of any orientation.
//!
//! Its own axes are x and y in the plane and z along the normal, from the lower body into the upper one; its middle is that of the
//! rectangle around the nodes. Contact elements lie on an array of equal rectangles. Where the nodes are the corners of such an array,
//! which may have holes and any outline, it is theirs, and a contact element at nodes is one node of each body. Else the array is given, and the
//! displacement of a contact element is a mean over the nodes around it, whose weights reproduce every displacement that is linear over the joint: the nodes of
//! the bodies need not face each other one by one, and forces keep their resultant and moments.

use std::collections::{BTreeMap, HashSet};

use serde::{Deserialize, Serialize};

use super::contact_array::ContactArray;
use super::reduction::ContactPorts;
use crate::linalg::Matrix;

/// Nodes may be off their plane, and off a regular array, by this share of the array's side: what rounding and the digits of a deck leave.
const OFF: f64 = 2e-3;
/// The joint of a scene may differ from that of its nodes by this share, or by half a contact element.
const OTHER_SIZE: f64 = 0.01;
/// The areas of all nodes may differ from that of all contact elements by this share.
const OTHER_AREA: f64 = 0.25;
/// A rectangle belongs to the joint if its centre is nearer to a node than this times the root of the area of that node: in an array of
/// squares the corners of one are 0.71 of it from its centre.
const COVERED: f64 = 0.75;
/// Nodes next to one, in an array of squares.
const AROUND: usize = 4;
/// Reach of the weights around a contact element, in sides of the array: the first that has nodes enough.
const REACHES: [f64; 5] = [1.0, 1.5, 2.0, 3.0, 4.5];
/// A weight below this share of the largest is that of rounding.
const NO_WEIGHT: f64 = 1e-9;
/// The nodes around a contact element lie on a line if the smaller moment is below this share of the larger.
const LINE: f64 = 1e-3;
/// A weight may be as far below zero as this share of the sum of all.
const NEGATIVE: f64 = -0.5;

/// The nodes of one body at the joint.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Side {
    /// Numbers of the nodes.
    pub nodes: Vec<i64>,
    /// Where they are \[m\].
    pub positions: Vec<[f64; 3]>,
    /// Their areas \[m²\]; empty where they are not known.
    pub areas: Vec<f64>,
    /// Other nodes of the body: those that the stiffness joins with the nodes of the joint \[m\].
    pub neighbours: Vec<[f64; 3]>,
}

/// What the user says of a joint.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Wanted {
    /// Its normal, from the lower body into the upper one, in the axes of the model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal: Option<[f64; 3]>,
    /// Its x axis, in those of the model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub along: Option<[f64; 3]>,
    /// Thickness of the finite elements at the joint \[m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layer: Option<f64>,
}

/// Where the joint is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Interface {
    /// Its middle, in the axes of the model \[m\].
    pub origin: [f64; 3],
    /// Unit vectors of its x, y and z.
    pub axes: [[f64; 3]; 3],
    /// Its contact elements.
    pub array: ContactArray,
    /// The nodes are the corners of the array.
    pub is_regular: bool,
    /// Thickness of the layers of finite elements from the joint on \[m\]; empty where nothing says it.
    pub layers: Vec<f64>,
    /// Mean distance of the nodes of both bodies along the normal \[m\].
    pub distance: f64,
    /// Nodes of the lower and the upper body.
    pub nodes: [usize; 2],
}

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
        "nothing says which way the normal of the joint points: the bodies touch, and the positions of their other nodes are not known or lie on one side; give structure.normal, from the lower body into the upper one"
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

const MM: f64 = 1e-3;
const SIDES: [&str; 2] = ["lower", "upper"];

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|d| a[d] - b[d])
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = dot(a, a).sqrt();
    a.map(|v| v / length)
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|d| a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3])
}

fn mean(points: &[[f64; 3]]) -> [f64; 3] {
    let sum = points
        .iter()
        .fold([0.0; 3], |sum, p| [0, 1, 2].map(|d| sum[d] + p[d]));
    sum.map(|v| v / points.len().max(1) as f64)
}

/// Principal directions of points, the one of least extent first.
fn principal(points: &[[f64; 3]], middle: [f64; 3]) -> Option<Matrix> {
    let offsets: Vec<[f64; 3]> = points.iter().map(|p| minus(*p, middle)).collect();
    let moments = Matrix::from_fn(3, 3, |a, b| offsets.iter().map(|d| d[a] * d[b]).sum());
    let (values, vectors) = moments.symmetric_eigen().ok()?;
    (values[1] > LINE * LINE * values[2]).then_some(vectors)
}

impl Interface {
    /// The joint of the lower and the upper body, as large as the scene says, with `elements` rectangles along x and y where the nodes
    /// form no array themselves. `all` has the positions of all nodes of the model.
    ///
    /// # Errors
    /// [`InterfaceError`] for nodes that lie in no plane, and for a joint that is not that of the scene.
    pub fn find(
        [lower, upper]: [&Side; 2],
        all: &[[f64; 3]],
        size: [f64; 2],
        elements: Option<[usize; 2]>,
        wanted: &Wanted,
    ) -> Result<Interface, InterfaceError> {
        let found = Plane::of([lower, upper], wanted)?;
        let axes = found.axes_along(&upper.positions, wanted)?;
        let flat = |p: &[f64; 3]| {
            let d = minus(*p, found.middle);
            [dot(d, axes[0]), dot(d, axes[1])]
        };
        let above: Vec<[f64; 2]> = upper.positions.iter().map(flat).collect();
        let span = [0, 1].map(|d| {
            let least = above.iter().map(|p| p[d]).fold(f64::INFINITY, f64::min);
            let most = above.iter().map(|p| p[d]).fold(f64::NEG_INFINITY, f64::max);
            [least, most]
        });
        let extent = span.map(|[least, most]| most - least);
        let lattice = Lattice::of(&above, span);
        let counts = lattice.as_ref().map(|lattice| lattice.counts).or(elements);
        let Some(counts) = counts else {
            let side = (extent[0] * extent[1] / above.len() as f64).sqrt();
            return Err(InterfaceError::NoArray {
                nodes: above.len(),
                about: extent.map(|length| ((length / side).round() as usize).max(1)),
            });
        };
        let other = |d: usize| {
            let element = if lattice.is_some() {
                0.0
            } else {
                0.5 * size[d] / counts[d] as f64
            };
            (extent[d] - size[d]).abs() > element.max(OTHER_SIZE * size[d])
        };
        if lattice.is_none() {
            let wanted = (counts[0] + 1) * (counts[1] + 1);
            let nodes = lower.nodes.len().min(upper.nodes.len());
            if wanted > nodes {
                return Err(InterfaceError::TooFine { wanted, nodes });
            }
        }
        if other(0) || other(1) {
            return Err(InterfaceError::OtherSize {
                given: size.map(|l| l / MM),
                found: extent.map(|l| l / MM),
            });
        }
        if let (Some(lattice), Some(given)) = (&lattice, elements)
            && lattice.counts != given
        {
            return Err(InterfaceError::OtherCounts {
                given,
                found: lattice.counts,
            });
        }
        let centre = span.map(|[least, most]| 0.5 * (least + most));
        let mut array = ContactArray {
            size,
            counts,
            absent: Vec::new(),
        };
        let regular = lattice.map(|lattice| lattice.absent());
        let is_regular = regular.is_some();
        array.absent = regular.unwrap_or_else(|| uncovered(&array, &above, centre, &upper.areas));
        let origin =
            [0, 1, 2].map(|k| found.middle[k] + centre[0] * axes[0][k] + centre[1] * axes[1][k]);
        let given: f64 = upper.areas.iter().sum();
        let area = array.cells().len() as f64 * array.cell_area();
        if !upper.areas.is_empty() && (given / area - 1.0).abs() > OTHER_AREA {
            return Err(InterfaceError::OtherArea {
                given: given / MM / MM,
                found: area / MM / MM,
            });
        }
        let layers = match wanted.layer {
            Some(layer) => vec![layer],
            None => layers(&array, all, origin, axes),
        };
        Ok(Interface {
            origin,
            axes,
            array,
            is_regular,
            layers,
            distance: found.distance,
            nodes: [lower.nodes.len(), upper.nodes.len()],
        })
    }

    /// What people are told of it, behind what the structure is.
    pub fn told(&self) -> String {
        let [x, y] = self.array.size.map(|side| side / MM);
        let [i, j] = self.array.counts;
        let kind = if self.is_regular {
            "nodes"
        } else {
            "means over nodes"
        };
        let absent = match self.array.absent.len() {
            0 => String::new(),
            absent => format!(", {absent} of them absent"),
        };
        let direction = |axis: [f64; 3]| {
            let names = ["x", "y", "z"];
            match (0..3).find(|d| axis[*d].abs() > 1.0 - 1e-9) {
                Some(d) if axis[d] < 0.0 => format!("-{}", names[d]),
                Some(d) => names[d].to_owned(),
                None => format!("[{:.4}, {:.4}, {:.4}]", axis[0], axis[1], axis[2]),
            }
        };
        format!(
            "; joint {x:.4} x {y:.4} mm of {i} x {j} rectangles{absent}, {kind}; its x is {}, its normal {}",
            direction(self.axes[0]),
            direction(self.axes[2])
        )
    }

    /// Weights of the nodes of a body in the displacement of each contact element, by their places in `side`.
    ///
    /// # Errors
    /// [`InterfaceError::NoNodes`] where there are too few around one.
    pub fn weights(
        &self,
        side: &Side,
        is_upper: bool,
        at: ContactPorts,
    ) -> Result<Vec<Vec<(usize, f64)>>, InterfaceError> {
        let flat: Vec<[f64; 2]> = (side.positions.iter())
            .map(|p| {
                let d = minus(*p, self.origin);
                [dot(d, self.axes[0]), dot(d, self.axes[1])]
            })
            .collect();
        let places = match at {
            ContactPorts::Faces => self.array.faces(),
            ContactPorts::Nodes => self.array.nodes(),
        };
        let sides = self.array.sides();
        // Nodes at the corners of the array stand for as much of it each.
        let areas = if self.is_regular {
            &[][..]
        } else {
            &side.areas
        };
        let each = places.into_iter().map(|(place, _)| {
            around(place, sides, &flat, areas).ok_or(InterfaceError::NoNodes {
                side: SIDES[usize::from(is_upper)],
                at: place.map(|v| v / MM),
            })
        });
        each.collect()
    }
}

/// The plane of a joint.
struct Plane {
    middle: [f64; 3],
    normal: [f64; 3],
    distance: f64,
}

impl Plane {
    fn of(sides: [&Side; 2], wanted: &Wanted) -> Result<Plane, InterfaceError> {
        let middles = sides.map(|side| mean(&side.positions));
        for (k, side) in sides.into_iter().enumerate() {
            let is_plane =
                side.nodes.len() >= 4 && principal(&side.positions, middles[k]).is_some();
            if !is_plane {
                return Err(InterfaceError::TooFew {
                    side: SIDES[k],
                    count: side.nodes.len(),
                });
            }
        }
        let [lower, upper] = sides;
        let middle = middles[1];
        let vectors = principal(&upper.positions, middle).expect("it is a plane");
        let mut normal = [0, 1, 2].map(|d| vectors[(d, 0)]);
        let across = (upper.positions.iter())
            .map(|p| minus(*p, middle))
            .map(|d| dot(d, d).sqrt())
            .fold(0.0, f64::max);
        // The upper one first, whose plane it is.
        for (k, side) in sides.into_iter().enumerate().rev() {
            let off = |p: &[f64; 3]| dot(minus(*p, middles[k]), normal).abs();
            let each = side.positions.iter().map(off).zip(&side.nodes);
            let farthest = each.max_by(|a, b| a.0.total_cmp(&b.0)).expect("four nodes");
            if farthest.0 > OFF * across {
                return Err(InterfaceError::NotPlane {
                    node: *farthest.1,
                    off: farthest.0 / MM,
                    across: across / MM,
                });
            }
        }
        let apart = minus(middles[1], middles[0]);
        let mut distance = dot(apart, normal);
        // One face may be larger than the other; somewhere they face each other.
        let sideways = |p: &[f64; 3]| {
            let d = minus(*p, middle);
            let out = dot(d, normal);
            let d = minus(d, normal.map(|v| v * out));
            dot(d, d).sqrt()
        };
        let off = lower
            .positions
            .iter()
            .map(sideways)
            .fold(f64::INFINITY, f64::min);
        if off > across {
            return Err(InterfaceError::Apart {
                off: off / MM,
                across: across / MM,
            });
        }
        // Below zero: the normal found points from the upper body into the lower one.
        let by_positions = if distance.abs() > OFF * across {
            Some(distance)
        } else {
            let depth = |side: &Side| -> f64 {
                let each = side.neighbours.iter();
                each.map(|p| dot(minus(*p, middle), normal)).sum::<f64>()
                    / side.neighbours.len().max(1) as f64
            };
            let (above, below) = (depth(upper), depth(lower));
            let is_known = above.abs().max(below.abs()) >= OFF * across && above * below <= 0.0;
            is_known.then_some(above - below)
        };
        let direction = match wanted.normal.map(unit) {
            Some(given) => {
                let cosine = dot(given, normal);
                if cosine.abs() < 1.0 - OFF {
                    return Err(InterfaceError::OtherNormal {
                        angle: cosine.abs().min(1.0).acos().to_degrees(),
                        found: normal,
                    });
                }
                if by_positions.is_some_and(|known| known * cosine < 0.0) {
                    return Err(InterfaceError::AgainstPositions);
                }
                cosine
            }
            None => by_positions.ok_or(InterfaceError::NoNormal)?,
        };
        if direction < 0.0 {
            normal = normal.map(|v| -v);
            distance = -distance;
        }
        // Digits that the eigenvectors do not have: an axis of the model is one.
        let snapped = normal.map(|v: f64| if v.abs() > 1.0 - 1e-12 { v.signum() } else { v });
        if let Some(axis) = (0..3).find(|&d| snapped[d].abs() == 1.0) {
            normal = [0, 1, 2].map(|d| if d == axis { snapped[axis] } else { 0.0 });
        }
        Ok(Plane {
            middle,
            normal,
            distance,
        })
    }

    /// x, y and z: x as the scene says, else that of an array of the nodes, else the axis x of the model in the plane, or y where x is the normal.
    fn axes_along(
        &self,
        positions: &[[f64; 3]],
        wanted: &Wanted,
    ) -> Result<[[f64; 3]; 3], InterfaceError> {
        let in_plane = |a: [f64; 3]| {
            let out = dot(a, self.normal);
            minus(a, self.normal.map(|v| v * out))
        };
        let axes = |x: [f64; 3]| [x, cross(self.normal, x), self.normal];
        if let Some(along) = wanted.along.map(unit) {
            let x = in_plane(along);
            if dot(x, x) < 0.25 {
                return Err(InterfaceError::AlongNormal);
            }
            return Ok(axes(unit(x)));
        }
        let first = usize::from(self.normal[0].abs() > 0.9);
        let mut model = [0.0; 3];
        model[first] = 1.0;
        let usual = unit(in_plane(model));
        let is_array = |x: [f64; 3]| {
            let [x, y, _] = axes(x);
            let flat: Vec<[f64; 2]> = (positions.iter())
                .map(|p| minus(*p, self.middle))
                .map(|d| [dot(d, x), dot(d, y)])
                .collect();
            let span = [0, 1].map(|d| {
                let values = || flat.iter().map(|p| p[d]);
                [
                    values().fold(f64::INFINITY, f64::min),
                    values().fold(f64::NEG_INFINITY, f64::max),
                ]
            });
            Lattice::of(&flat, span).is_some()
        };
        if is_array(usual) {
            return Ok(axes(usual));
        }
        // Towards the nearest node, turned by quarters until it is closest to the usual axis.
        let from = positions[0];
        let nearest = (positions[1..].iter().map(|p| minus(*p, from)))
            .min_by(|a, b| dot(*a, *a).total_cmp(&dot(*b, *b)))
            .expect("four nodes");
        let one = unit(in_plane(nearest));
        let quarter = cross(self.normal, one);
        let turned = [one, quarter, one.map(|v| -v), quarter.map(|v| -v)];
        let best = turned
            .into_iter()
            .max_by(|a, b| dot(*a, usual).total_cmp(&dot(*b, usual)));
        let best = best.expect("four directions");
        Ok(axes(if is_array(best) { best } else { usual }))
    }
}

/// Nodes that are the corners of equal rectangles.
struct Lattice {
    counts: [usize; 2],
    there: HashSet<[usize; 2]>,
}

impl Lattice {
    /// `None` where they are not, or a node belongs to no rectangle.
    fn of(points: &[[f64; 2]], span: [[f64; 2]; 2]) -> Option<Lattice> {
        let mut counts = [0_usize; 2];
        for d in 0..2 {
            let [least, most] = span[d];
            let mut values: Vec<f64> = points.iter().map(|p| p[d]).collect();
            values.sort_by(f64::total_cmp);
            let mut levels = 1;
            let mut last = values[0];
            for &value in &values {
                if value - last > OFF * (most - least) / (points.len() as f64).sqrt() {
                    levels += 1;
                    last = value;
                }
            }
            counts[d] = levels - 1;
        }
        // An array has holes at most; nodes in disorder have about as many levels as there are nodes.
        let places = (counts[0] + 1).checked_mul(counts[1] + 1)?;
        if counts.contains(&0) || places > 8 * points.len() {
            return None;
        }
        let mut there = HashSet::new();
        for p in points {
            let place = [0, 1].map(|d| {
                let [least, most] = span[d];
                (p[d] - least) / (most - least) * counts[d] as f64
            });
            if place.iter().any(|v| (v - v.round()).abs() > OFF) {
                return None;
            }
            if !there.insert(place.map(|v| v.round() as usize)) {
                return None;
            }
        }
        let lattice = Lattice { counts, there };
        let used: HashSet<[usize; 2]> = (lattice.cells())
            .flat_map(super::contact_array::corners_of)
            .collect();
        (used.len() == lattice.there.len()).then_some(lattice)
    }

    /// Rectangles with all four corners.
    fn cells(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        self.all().filter(|cell| self.is_there(*cell))
    }

    fn all(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let counts = self.counts;
        (0..counts[0]).flat_map(move |i| (0..counts[1]).map(move |j| [i, j]))
    }

    fn is_there(&self, cell: [usize; 2]) -> bool {
        let corners = super::contact_array::corners_of(cell);
        corners.iter().all(|corner| self.there.contains(corner))
    }

    fn absent(&self) -> Vec<[usize; 2]> {
        self.all().filter(|cell| !self.is_there(*cell)).collect()
    }
}

/// Rectangles whose centre is near no node. `centre` is the middle of the joint.
fn uncovered(
    array: &ContactArray,
    points: &[[f64; 2]],
    centre: [f64; 2],
    areas: &[f64],
) -> Vec<[usize; 2]> {
    let distance =
        |a: [f64; 2], b: [f64; 2]| ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt();
    let reach: Vec<f64> = match areas.is_empty() {
        false => areas.iter().map(|area| COVERED * area.sqrt()).collect(),
        // Without areas that of a square as wide as the way to the last of the nearest nodes.
        true => (points.iter().enumerate())
            .map(|(n, p)| {
                let others = points.iter().enumerate().filter(|(m, _)| *m != n);
                let mut ways: Vec<f64> = others.map(|(_, q)| distance(*p, *q)).collect();
                ways.sort_by(f64::total_cmp);
                COVERED * ways[AROUND.min(ways.len()) - 1]
            })
            .collect(),
    };
    let sides = array.sides();
    let all = (0..array.counts[0]).flat_map(|i| (0..array.counts[1]).map(move |j| [i, j]));
    all.filter(|&cell| {
        let at = array.place(cell.map(|k| k as f64 + 0.5));
        let at = [at[0] + centre[0], at[1] + centre[1]];
        // A rectangle coarser than the nodes is covered as far as half its side.
        let own = 0.5 * sides[0].min(sides[1]);
        !points
            .iter()
            .zip(&reach)
            .any(|(p, reach)| distance(*p, at) <= reach.max(own))
    })
    .collect()
}

/// Weights of the nodes around a place: a tent over the array's sides times the area of each, made to reproduce what is linear.
fn around(
    place: [f64; 2],
    sides: [f64; 2],
    points: &[[f64; 2]],
    areas: &[f64],
) -> Option<Vec<(usize, f64)>> {
    REACHES.iter().find_map(|reach| {
        let tent =
            |d: usize, p: &[f64; 2]| (1.0 - (p[d] - place[d]).abs() / (reach * sides[d])).max(0.0);
        let area = |n: usize| areas.get(n).copied().unwrap_or(1.0);
        let tents: Vec<(usize, f64)> = (points.iter().enumerate())
            .map(|(n, p)| (n, tent(0, p) * tent(1, p) * area(n)))
            .filter(|w| w.1 > 0.0)
            .collect();
        let largest = tents.iter().fold(0.0, |a: f64, w| a.max(w.1));
        let tents: Vec<(usize, f64)> = (tents.into_iter())
            .filter(|w| w.1 > NO_WEIGHT * largest)
            .collect();
        let sum: f64 = tents.iter().map(|w| w.1).sum();
        if tents.is_empty() {
            return None;
        }
        // In sides of the array.
        let off = |n: usize| [0, 1].map(|d| (points[n][d] - place[d]) / sides[d]);
        let middle = [0, 1].map(|d| tents.iter().map(|&(n, w)| w * off(n)[d]).sum::<f64>() / sum);
        if middle.iter().all(|m| m.abs() < OFF) {
            return Some(tents.iter().map(|&(n, w)| (n, w / sum)).collect());
        }
        let moment = |a: usize, b: usize| {
            let each = tents.iter();
            each.map(|&(n, w)| w * (off(n)[a] - middle[a]) * (off(n)[b] - middle[b]))
                .sum::<f64>()
                / sum
        };
        let (xx, xy, yy) = (moment(0, 0), moment(0, 1), moment(1, 1));
        let (trace, determinant) = (xx + yy, xx * yy - xy * xy);
        // A single node has no moments.
        if determinant <= LINE * trace * trace {
            return None;
        }
        let slope = [
            (yy * middle[0] - xy * middle[1]) / determinant,
            (xx * middle[1] - xy * middle[0]) / determinant,
        ];
        let weights: Vec<(usize, f64)> = (tents.iter())
            .map(|&(n, w)| {
                let d = [0, 1].map(|k| off(n)[k] - middle[k]);
                (n, w / sum * (1.0 - slope[0] * d[0] - slope[1] * d[1]))
            })
            .collect();
        let below: f64 = weights.iter().map(|w| w.1.min(0.0)).sum();
        (below > NEGATIVE).then_some(weights)
    })
}

/// Thickness of the layers of nodes above and below the joint, as most columns of nodes have them; where there are no columns, the distance of
/// the nearest nodes off the plane.
fn layers(
    array: &ContactArray,
    all: &[[f64; 3]],
    origin: [f64; 3],
    axes: [[f64; 3]; 3],
) -> Vec<f64> {
    let sides = array.sides();
    let least = OFF * sides[0].min(sides[1]);
    let inside = |d: usize, v: f64| v.abs() <= 0.5 * array.size[d] + least;
    // Ordered, so that of columns that differ by rounding the same one stands for all on every machine.
    let mut columns: BTreeMap<[i64; 3], Vec<f64>> = BTreeMap::new();
    let mut nearest = [f64::INFINITY; 2];
    for p in all {
        let d = minus(*p, origin);
        let [x, y, z] = axes.map(|axis| dot(d, axis));
        if z.abs() <= least || !inside(0, x) || !inside(1, y) {
            continue;
        }
        let is_above = z > 0.0;
        nearest[usize::from(is_above)] = nearest[usize::from(is_above)].min(z.abs());
        // A quarter of a step off whole ones: nodes of a column must not be told apart by rounding.
        let step = |v: f64, d: usize| (v / (4.0 * OFF * sides[d]) + 0.25).round() as i64;
        let key = [step(x, 0), step(y, 1), i64::from(is_above)];
        columns.entry(key).or_default().push(z.abs());
    }
    let nodes: HashSet<[i64; 2]> = (array.nodes().iter())
        .map(|(p, _)| [0, 1].map(|d| (p[d] / (4.0 * OFF * sides[d]) + 0.25).round() as i64))
        .collect();
    let mut kinds: Vec<(Vec<f64>, usize)> = Vec::new();
    for (key, mut depths) in columns {
        if !nodes.contains(&[key[0], key[1]]) {
            continue;
        }
        depths.sort_by(f64::total_cmp);
        let is_same = |kind: &(Vec<f64>, usize)| {
            kind.0.len() == depths.len()
                && depths
                    .iter()
                    .zip(&kind.0)
                    .all(|(a, b)| (a - b).abs() < least)
        };
        match kinds.iter_mut().find(|kind| is_same(kind)) {
            Some(kind) => kind.1 += 1,
            None => kinds.push((depths, 1)),
        }
    }
    // Those of most columns; of equally many the shorter ones, so that the order of a table does not matter.
    let usual = kinds.into_iter().max_by(|a, b| {
        a.1.cmp(&b.1)
            .then(b.0.len().cmp(&a.0.len()))
            .then(b.0[0].total_cmp(&a.0[0]))
    });
    match usual {
        Some((depths, _)) => {
            let above = std::iter::once(0.0).chain(depths.iter().copied());
            depths.iter().zip(above).map(|(z, last)| z - last).collect()
        }
        None => {
            let found: Vec<f64> = nearest.into_iter().filter(|z| z.is_finite()).collect();
            match found.is_empty() {
                true => Vec::new(),
                false => vec![found.iter().sum::<f64>() / found.len() as f64],
            }
        }
    }
}
