//! Joint of a finite-element model: facing nodes of two bodies in a plane of any orientation.
//!
//! The axes x and y are in the plane of the joint. The axis z is along the normal, from the lower body into the upper
//! body. The origin is the middle of the rectangle around the upper nodes. Contact elements form an array of equal
//! rectangles.
//!
//! The nodes can be the corners of an array of equal rectangles. The array of the contact elements is then the array of
//! the nodes. The array of the nodes can have holes and any outline. A contact element at nodes then consists of one
//! node of each body. If the nodes form no array, the scene defines the array of the contact elements. The displacement
//! of a contact element is then a weighted mean of the displacements of nearby nodes. If the displacements of the nodes
//! are a linear function of position, the weighted mean equals the linear function. Because of these weights, the nodes
//! of the two bodies need not match, and forces keep their resultant and moments.

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
use lattice::{Lattice, span, uncovered_cells};
use layers::layers;
use plane::Plane;
use weights::node_weights;

/// Largest permitted distance of a node from the plane of the joint or from a regular array. The unit of the distance
/// is the size of the joint. The tolerance allows for rounding and for the digits of a deck.
const OFF: f64 = 2e-3;
/// Tolerance of the size of the joint in the scene, as a share. For an irregular mesh, the size of the joint may also
/// differ by half a contact element.
const OTHER_SIZE: f64 = 0.01;
/// Largest overhang of the upper face beyond the lower one, in sides of a contact element.
const OVERHANG: f64 = 0.05;
/// Largest relative difference between the total area of the nodes and the area of the contact elements.
const OTHER_AREA: f64 = 0.25;
/// The nodes around a contact element are on a line if the ratio of their second moments is below `LINE`.
const LINE: f64 = 1e-3;
const MM: f64 = 1e-3;
const SIDES: [&str; 2] = ["lower", "upper"];

/// Nodes of one body at the joint.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Side {
    /// Numbers of the nodes.
    pub nodes: Vec<i64>,
    /// Positions of the nodes \[m\].
    pub positions: Vec<[f64; 3]>,
    /// Areas of the nodes \[m²\]. Empty if unknown.
    pub areas: Vec<f64>,
    /// Positions of the body's other nodes that the stiffness connects to the joint \[m\].
    pub neighbours: Vec<[f64; 3]>,
}

/// Requirements of the scene on the joint.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct JointRequirements {
    /// Normal from the lower body into the upper one, in the axes of the model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal: Option<[f64; 3]>,
    /// Direction of the x axis, in the axes of the model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub along: Option<[f64; 3]>,
    /// Thickness of the element layer at the joint \[m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layer: Option<f64>,
}

/// Position, axes and contact elements of the joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Interface {
    /// Middle of the joint, in the axes of the model \[m\].
    pub origin: [f64; 3],
    /// Unit vectors along x, y and z of the joint.
    pub axes: [[f64; 3]; 3],
    /// Array of the contact elements.
    pub array: ContactArray,
    /// True if the nodes are the corners of the array.
    pub is_regular: bool,
    /// Thicknesses of the element layers from the joint on \[m\]. Empty if unknown.
    pub layers: Vec<f64>,
    /// Distance between both faces along the normal, as a gap or an overlap \[m\]. Not stored.
    #[serde(skip)]
    pub distance: f64,
}

/// Reduces the counts along both sides until there are no more grid points than nodes. The ratio stays about the
/// same.
fn coarser_counts(counts: [usize; 2], nodes: usize) -> [usize; 2] {
    let mut coarser = counts;
    while (coarser[0] + 1) * (coarser[1] + 1) > nodes && coarser != [1, 1] {
        let longer = usize::from(coarser[1] * counts[0] > coarser[0] * counts[1]);
        let longer = if coarser[longer] > 1 {
            longer
        } else {
            1 - longer
        };
        coarser[longer] -= 1;
    }
    coarser
}

impl Interface {
    /// Converts a position of the model to the origin and axes of the joint \[m\].
    pub fn place(&self, at: [f64; 3]) -> [f64; 3] {
        let from = minus(at, self.origin);
        self.axes.map(|axis| dot(from, axis))
    }

    /// Finds the joint of the lower and the upper body.
    ///
    /// `size` is the size in the scene. `elements` are the numbers of rectangles along x and y, needed if the nodes
    /// form no array. `all` are the positions of all nodes of the model.
    ///
    /// # Errors
    /// [`InterfaceError`] if the nodes are not in a plane, or if the joint does not match the scene.
    pub fn find(
        [lower, upper]: [&Side; 2],
        all: &[[f64; 3]],
        size: [f64; 2],
        elements: Option<[usize; 2]>,
        wanted: &JointRequirements,
    ) -> Result<Interface, InterfaceError> {
        let plane = Plane::fit([lower, upper], wanted)?;
        let axes = plane.axes_along(&upper.positions, wanted)?;
        let project = |p: &[f64; 3]| {
            let d = minus(*p, plane.middle);
            [dot(d, axes[0]), dot(d, axes[1])]
        };
        let above: Vec<[f64; 2]> = upper.positions.iter().map(project).collect();
        let span = span(&above);
        let extent = span.map(|[least, most]| most - least);
        let lattice = Lattice::detect(&above);
        let counts = lattice.as_ref().map(|lattice| lattice.counts).or(elements);
        let Some(counts) = counts else {
            let side = (extent[0] * extent[1] / above.len() as f64).sqrt();
            return Err(InterfaceError::NoArray {
                nodes: above.len(),
                about: coarser_counts(
                    extent.map(|length| ((length / side).round() as usize).max(1)),
                    above.len().min(lower.nodes.len()),
                ),
            });
        };
        let is_other_size = |d: usize| {
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
        if is_other_size(0) || is_other_size(1) {
            return Err(InterfaceError::SizeMismatch {
                given: size.map(|l| l / MM),
                found: extent.map(|l| l / MM),
            });
        }
        if let (Some(lattice), Some(given)) = (&lattice, elements)
            && lattice.counts != given
        {
            return Err(InterfaceError::CountMismatch {
                given,
                found: lattice.counts,
            });
        }
        let below: Vec<[f64; 2]> = lower.positions.iter().map(project).collect();
        let below = lattice::span(&below);
        let overhang = |d: usize| (below[d][0] - span[d][0]).max(span[d][1] - below[d][1]);
        // If the nodes of a face form no array, the outlines of the two faces agree only roughly.
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
        array.absent = regular.unwrap_or_else(|| uncovered_cells(&array, &above, centre));
        let origin =
            [0, 1, 2].map(|k| plane.middle[k] + centre[0] * axes[0][k] + centre[1] * axes[1][k]);
        let given_area: f64 = upper.areas.iter().sum();
        let area = array.cells().len() as f64 * array.cell_area();
        if !upper.areas.is_empty() && (given_area / area - 1.0).abs() > OTHER_AREA {
            return Err(InterfaceError::AreaMismatch {
                given: given_area / MM / MM,
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
            distance: plane.distance,
        })
    }

    /// Returns a note for the user if the faces are apart or overlap.
    pub fn gap_note(&self) -> Option<String> {
        let longest_side = self.array.size.iter().copied().fold(0.0, f64::max);
        (self.distance > OFF * longest_side).then(|| {
            format!(
                "the faces of the joint are {:.4} mm apart along its normal, or overlap by as much. They are assumed to touch, and each friction force acts on both bodies at their own faces, with this distance as a lever",
                self.distance / MM
            )
        })
    }

    /// Returns a description for the user, which is appended to the description of the structure.
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

    /// Computes the weights of the nodes of a body in the displacement of each contact element. Nodes are indices
    /// into `side`.
    ///
    /// # Errors
    /// [`InterfaceError::NoNodes`] if a body has too few nodes around a contact element.
    pub fn weights(
        &self,
        side: &Side,
        is_upper: bool,
        at: ContactPorts,
    ) -> Result<Vec<Vec<(usize, f64)>>, InterfaceError> {
        let positions_in_plane: Vec<[f64; 2]> = (side.positions.iter())
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
        // The nodes of a regular array have equal weights, so their areas are not used.
        let areas = if self.is_regular {
            &[][..]
        } else {
            &side.areas
        };
        let node_weights = places.into_iter().map(|(place, _)| {
            node_weights(place, sides, &positions_in_plane, areas).ok_or(InterfaceError::NoNodes {
                side: SIDES[usize::from(is_upper)],
                at: place.map(|v| v / MM),
            })
        });
        node_weights.collect()
    }
}
