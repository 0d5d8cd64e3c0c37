//! Forces that press the bodies of a joint together, and the influence of the structure on them.

use serde::{Deserialize, Serialize};

use super::contact::Contact;
use super::response::{Force, Port};
use crate::contact::Pair;
use crate::contact::nodes::{NodalCompliance, ShearCompliance};
use crate::model_update::ContactElements;
use crate::structure::StructureError;
use crate::structure::element::Formulation;
use crate::structure::half_space::{FaceCompliance, FaceResolution};
use crate::structure::reduction::ReducedStructure;
use crate::structure::statics::PortForce;
use crate::wear::{BodyMotions, NodalLoad, PressedBodies};

/// A mesh of equal boxes under a joint, identical on both sides.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StructureMesh {
    /// Boxes along x and y.
    pub counts: [usize; 2],
    /// Side lengths of the boxes \[m\].
    pub sides: [f64; 2],
    /// Thickness of the layers, starting at the joint \[m\].
    pub layers: Vec<f64>,
    /// Finite element formulation of the boxes.
    #[serde(default, skip_serializing_if = "Formulation::has_incompatible_modes")]
    pub formulation: Formulation,
}

impl StructureMesh {
    /// Returns the part of the compliance of the half spaces that the structure mesh already contains.
    fn compliance(&self, bodies: Pair) -> Result<FaceCompliance, StructureError> {
        if let Some(&count) = self.counts.iter().find(|count| **count == 0) {
            return Err(StructureError::OutOfRange {
                name: "a count of boxes under the joint",
                value: count as f64,
                expected: "at least 1",
            });
        }
        let face_compliance = |elastic| {
            let (sides, layers, counts) = (self.sides, &self.layers, self.counts);
            FaceCompliance::of_layered_half_space(
                elastic,
                sides,
                layers,
                counts,
                self.formulation,
                FaceResolution::default(),
            )
        };
        let mut both = face_compliance(bodies.lower)?;
        if bodies.upper == bodies.lower {
            both.add(&both.clone());
        } else {
            both.add(&face_compliance(bodies.upper)?);
        }
        Ok(both)
    }
}

/// Pressing of the joint by a flexible structure instead of rigid punches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StructurePressing {
    /// Origin of the load of the joint.
    pub preload: Preload,
    /// Additional constant loads that press the joint and are not part of the vibration \[N\].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub loads: Vec<Force>,
}

impl StructurePressing {
    /// Returns the points of the structure where loads act.
    pub fn points(&self) -> Vec<String> {
        let ends = match &self.preload {
            Preload::Bolt { points, .. } => points.to_vec(),
            Preload::Faces => Vec::new(),
        };
        let loads = self.loads.iter().map(|force| force.port.at.clone());
        ends.into_iter().chain(loads).collect()
    }

    /// Describes the loads.
    pub(super) fn describe(&self) -> String {
        let preload = match &self.preload {
            Preload::Faces => "opposing forces on both faces, by area".to_owned(),
            Preload::Bolt {
                points, in_mesh, ..
            } => {
                let [first, second] = points;
                let is = if *in_mesh {
                    "its bolt, tightened at"
                } else {
                    "forces at"
                };
                format!("{is} {first} and {second}")
            }
        };
        match self.loads.len() {
            0 => format!("by the structure: {preload}"),
            count => format!("by the structure: {preload}, and {count} constant forces"),
        }
    }
}

/// Origin of the load of a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Preload {
    /// Opposing forces on the faces of the joint, distributed by area.
    Faces,
    /// Opposing forces at two points of the structure, which pull the points together.
    Bolt {
        /// The points.
        points: [String; 2],
        /// Direction from the first to the second point, along the axes of the structure.
        direction: [f64; 3],
        /// True if the bolt is part of the structure. The solver then finds the bolt force for which the contact
        /// pressure sums to the requested load.
        in_mesh: bool,
    },
}

impl Preload {
    /// Returns true if the forces are computed so that the pressure has the requested load.
    pub fn is_found(&self) -> bool {
        matches!(self, Preload::Bolt { in_mesh: true, .. })
    }

    /// Returns true for a bolt that is not part of the structure.
    fn is_outside(&self) -> bool {
        matches!(self, Preload::Bolt { in_mesh: false, .. })
    }

    /// Returns the forces on ports for a preload of 1 N.
    fn forces(&self, reduced: &ReducedStructure, areas: &[f64]) -> Vec<PortForce> {
        match self {
            Preload::Faces => {
                let total_area: f64 = areas.iter().sum();
                let each = areas.iter().enumerate();
                each.map(|(e, area)| (3 * e + 2, -area / total_area))
                    .collect()
            }
            Preload::Bolt {
                points, direction, ..
            } => {
                let signs = points.iter().zip([1.0, -1.0]);
                let along = |(at, sign): (&String, f64)| {
                    let axes = direction.iter().enumerate();
                    let forces = axes.map(|(axis, d)| (port_of(reduced, at, axis), sign * d));
                    forces.collect::<Vec<PortForce>>()
                };
                signs.flat_map(along).collect()
            }
        }
    }
}

fn port_of(reduced: &ReducedStructure, at: &str, axis: usize) -> usize {
    let port = reduced.ports.of_point(at, axis);
    port.expect("the points of a recipe are ports of its structure")
}

/// Relative difference below which areas count as equal.
const ROUNDING: f64 = 1e-9;

/// Accepted range of a ratio of two flexibilities between neighbouring nodes of the joint. The ratio is the flexibility
/// of the structure divided by the flexibility of the same mesh on half spaces. A structure with twice the modulus has
/// a ratio of one half.
const SAME_MESH: [f64; 2] = [0.8, 1.25];

impl Contact {
    /// Returns the vibrating structure. If the scene contains the stiffness of a bolt outside the mesh, the structure
    /// includes the spring of the bolt.
    ///
    /// # Errors
    /// Returns errors of [`ReducedStructure::with_spring`].
    pub fn with_bolt(&self, reduced: ReducedStructure) -> Result<ReducedStructure, StructureError> {
        let bolt = self.pressing.as_ref().map(|pressing| &pressing.preload);
        match (
            bolt.filter(|bolt| bolt.is_outside()),
            self.conditions.bolt_stiffness,
        ) {
            (Some(bolt), Some(stiffness)) => {
                reduced.with_spring(&bolt.forces(&reduced, &[]), stiffness)
            }
            _ => Ok(reduced),
        }
    }

    /// Returns the compliance of the structure mesh on half spaces, with a negative sign, between the nodes of the
    /// contact elements. The negative sign removes the compliance of the mesh from the compliance of the half spaces.
    pub(super) fn taken_away(
        &self,
        mesh: &StructureMesh,
        elements: &ContactElements,
    ) -> Result<NodalCompliance, StructureError> {
        let nodes = elements.nodes().expect("contact elements at nodes");
        let matrices = mesh.compliance(self.bodies)?.matrices();
        let [normal, xx, yy, xy] = matrices.map(|matrix| matrix.into_iter().map(|c| -c).collect());
        Ok(NodalCompliance {
            interpolation: nodes.interpolation.clone(),
            normal,
            shear: Some(ShearCompliance { xx, yy, xy }),
        })
    }

    /// Returns the pressing of the two bodies of the `reduced` structure at the contact elements. `top` is the height
    /// of the highest point of the surface \[m\].
    ///
    /// # Errors
    /// Returns [`StructureError::MeshMismatch`] if the joint does not match the mesh and the material of the structure,
    /// and errors of [`ReducedStructure::statics`].
    pub fn pressing(
        &self,
        structure_pressing: &StructurePressing,
        mesh: &StructureMesh,
        elements: &ContactElements,
        reduced: &ReducedStructure,
        top: f64,
    ) -> Result<PressedBodies, StructureError> {
        let nodes = elements.nodes().expect("contact elements at nodes");
        let preload = structure_pressing.preload.forces(reduced, elements.areas());
        let port = |port: &Port| port_of(reduced, &port.at, port.axis);
        let constant_forces = structure_pressing.loads.iter();
        let constant_forces =
            constant_forces.map(|force| (port(&force.port), force.amplitude * force.phase.cos()));
        let on_faces = structure_pressing.preload == Preload::Faces;
        let loads = [preload, constant_forces.collect()];
        let statics = reduced.statics(elements.centres(), &loads, on_faces)?;
        let [mesh_compliance, ..] = mesh.compliance(self.bodies)?.matrices();
        let node_count = nodes.interpolation.nodes();
        let at = |e: usize, f: usize| nodes.numbers[e] * node_count + nodes.numbers[f];
        let on_mesh = |e: usize, f: usize| mesh_compliance[at(e, f)];
        let ratio = ratio_to_mesh(elements, |e, f| statics.flexibility[(e, f)], on_mesh);
        if let Some(ratio) = ratio
            && !(SAME_MESH[0]..=SAME_MESH[1]).contains(&ratio)
        {
            return Err(StructureError::MeshMismatch {
                ratio,
                least: SAME_MESH[0],
                most: SAME_MESH[1],
            });
        }
        let mut added = vec![0.0; node_count * node_count];
        for e in 0..elements.len() {
            for f in 0..elements.len() {
                added[at(e, f)] = statics.remaining_flexibility[(e, f)] - on_mesh(e, f);
            }
        }
        let mut loads: Vec<NodalLoad> = Vec::with_capacity(2);
        for load in statics.loads {
            let mut opening = vec![0.0; node_count];
            for (&node, value) in nodes.numbers.iter().zip(&load.opening) {
                opening[node] = *value;
            }
            loads.push(NodalLoad {
                opening,
                resultants: load.resultants,
                work: load.work.try_into().expect("two loads"),
            });
        }
        let added = NodalCompliance {
            interpolation: nodes.interpolation.clone(),
            normal: added,
            shear: None,
        };
        let loads = loads.try_into().expect("two loads");
        let bodies = BodyMotions {
            free: statics.free_motions,
            restrained: statics.supported_motions,
            compliance: statics.supported_compliance,
        };
        let mut pressing = PressedBodies::new(added.into(), bodies, loads, top);
        pressing.mesh_ratio = ratio;
        Ok(pressing)
    }
}

/// Returns the ratio of the elastic energy of the structure to the energy of its mesh on half spaces. The forces are 1,
/// −2 and 1 on three nodes in a row that have all their faces. The three forces neither move nor rotate a body, and
/// hardly bend the body. Forces on only two nodes would rotate a slender bar.
fn ratio_to_mesh(
    elements: &ContactElements,
    on_structure: impl Fn(usize, usize) -> f64,
    on_mesh: impl Fn(usize, usize) -> f64,
) -> Option<f64> {
    let nodes = elements.nodes()?;
    let width = nodes.interpolation.counts()[1] + 1;
    let whole = elements.areas().iter().fold(0.0, |m: f64, a| m.max(*a));
    // An inner node has faces on all sides and a neighbour along each axis. A step from an inner node to the next node
    // therefore stays in the row.
    let inner = |number: usize| {
        let element = nodes.numbers.binary_search(&number).ok();
        element.filter(|e| elements.areas()[*e] > (1.0 - ROUNDING) * whole)
    };
    const FORCES: [f64; 3] = [1.0, -2.0, 1.0];
    let energy = |x: &dyn Fn(usize, usize) -> f64, at: [usize; 3]| -> f64 {
        let pairs = (0..9).map(|k| (k / 3, k % 3));
        pairs
            .map(|(a, b)| FORCES[a] * FORCES[b] * x(at[a], at[b]))
            .sum()
    };
    let (mut of_structure, mut of_mesh) = (0.0, 0.0);
    for &number in &nodes.numbers {
        for step in [width, 1] {
            let row = [0, 1, 2].map(|k| inner(number + k * step));
            if let [Some(a), Some(b), Some(c)] = row {
                of_structure += energy(&on_structure, [a, b, c]);
                of_mesh += energy(&on_mesh, [a, b, c]);
            }
        }
    }
    (of_mesh > 0.0).then(|| of_structure / of_mesh)
}
