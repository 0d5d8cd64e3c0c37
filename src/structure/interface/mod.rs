//! The joint of a finite-element model: nodes of two bodies that face each other, in a plane of any orientation.
//!
//! Its own axes are x and y in the plane and z along the normal, from the lower body into the upper one; its middle is that of the
//! rectangle around the nodes. Contact elements lie on an array of equal rectangles. Where the nodes are the corners of such an array,
//! which may have holes and any outline, it is theirs, and a contact element at nodes is one node of each body. Else the array is given, and the
//! displacement of a contact element is a mean over the nodes around it, whose weights reproduce every displacement that is linear over the joint: the nodes of
//! the bodies need not face each other one by one, and forces keep their resultant and moments.

mod error;
mod lattice;
mod layers;
mod plane;
mod weights;

use serde::{Deserialize, Serialize};

pub use error::InterfaceError;

use super::contact_array::ContactArray;
use super::reduction::ContactPorts;
use crate::linalg::vectors::{dot, minus};
use lattice::{Lattice, span, uncovered};
use layers::layers;
use plane::Plane;
use weights::around;

/// Nodes may be off their plane, and off a regular array, by this share of the array's side: what rounding and the digits of a deck leave.
const OFF: f64 = 2e-3;
/// The joint of a scene may differ from that of its nodes by this share, or by half a contact element.
const OTHER_SIZE: f64 = 0.01;
/// The upper face may reach beyond the lower one by this share of a contact element; pairs of nodes may be as far apart.
const OVERHANG: f64 = 0.05;
/// The areas of all nodes may differ from that of all contact elements by this share.
const OTHER_AREA: f64 = 0.25;
/// The nodes around a contact element lie on a line if the smaller moment is below this share of the larger.
const LINE: f64 = 1e-3;
const MM: f64 = 1e-3;
const SIDES: [&str; 2] = ["lower", "upper"];

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
pub struct JointRequirements {
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
    /// Distance of both faces along the normal, apart or one in the other \[m\]; not kept.
    #[serde(skip)]
    pub distance: f64,
}

/// Counts along both sides with no more places between rectangles than nodes, in about the same ratio.
fn fewer(counts: [usize; 2], nodes: usize) -> [usize; 2] {
    let mut fewer = counts;
    while (fewer[0] + 1) * (fewer[1] + 1) > nodes && fewer != [1, 1] {
        let longer = usize::from(fewer[1] * counts[0] > fewer[0] * counts[1]);
        let longer = if fewer[longer] > 1 {
            longer
        } else {
            1 - longer
        };
        fewer[longer] -= 1;
    }
    fewer
}

impl Interface {
    /// A place of the model from the middle of the joint, along its axes \[m\].
    pub fn place(&self, at: [f64; 3]) -> [f64; 3] {
        let from = minus(at, self.origin);
        self.axes.map(|axis| dot(from, axis))
    }

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
        wanted: &JointRequirements,
    ) -> Result<Interface, InterfaceError> {
        let found = Plane::of([lower, upper], wanted)?;
        let axes = found.axes_along(&upper.positions, wanted)?;
        let flat = |p: &[f64; 3]| {
            let d = minus(*p, found.middle);
            [dot(d, axes[0]), dot(d, axes[1])]
        };
        let above: Vec<[f64; 2]> = upper.positions.iter().map(flat).collect();
        let span = span(&above);
        let extent = span.map(|[least, most]| most - least);
        let lattice = Lattice::of(&above);
        let counts = lattice.as_ref().map(|lattice| lattice.counts).or(elements);
        let Some(counts) = counts else {
            let side = (extent[0] * extent[1] / above.len() as f64).sqrt();
            return Err(InterfaceError::NoArray {
                nodes: above.len(),
                about: fewer(
                    extent.map(|length| ((length / side).round() as usize).max(1)),
                    above.len().min(lower.nodes.len()),
                ),
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
        let below: Vec<[f64; 2]> = lower.positions.iter().map(flat).collect();
        let below = lattice::span(&below);
        let overhang = |d: usize| (below[d][0] - span[d][0]).max(span[d][1] - below[d][1]);
        // Without an array of its own a face is only near the other's outline.
        let share = if lattice.is_some() { OVERHANG } else { 0.5 };
        if let Some(d) = (0..2).find(|d| overhang(*d) > share * size[*d] / counts[*d] as f64) {
            return Err(InterfaceError::Overhang {
                along: ["x", "y"][d],
                by: overhang(d) / MM,
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
        array.absent = regular.unwrap_or_else(|| uncovered(&array, &above, centre));
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
        })
    }

    /// That both faces do not lie on each other, where they do not.
    pub fn gap_note(&self) -> Option<String> {
        let across = self.array.size.iter().copied().fold(0.0, f64::max);
        (self.distance > OFF * across).then(|| {
            format!(
                "the faces of the joint are {:.4} mm apart along its normal, or as far one in the other: they are taken to touch, and each force of friction acts on both at their own faces, with that distance as a lever",
                self.distance / MM
            )
        })
    }

    /// What people are told of it, behind what the structure is.
    pub fn describe(&self) -> String {
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
