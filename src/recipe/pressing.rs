//! What presses the bodies of a joint together, and what of it the structure decides.

use serde::{Deserialize, Serialize};

use super::contact::Contact;
use super::response::{Force, Port};
use crate::contact::Pair;
use crate::contact::nodes::{NodalCompliance, ShearCompliance};
use crate::model_update::ContactElements;
use crate::structure::StructureError;
use crate::structure::element::Formulation;
use crate::structure::half_space::FaceCompliance;
use crate::structure::reduction::Reduced;
use crate::structure::statics::PortForce;
use crate::wear::{Bodies, NodalLoad, Pressing};

/// A mesh of equal boxes under a joint, the same on both sides.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StructureMesh {
    /// Boxes along x and y.
    pub counts: [usize; 2],
    /// Their sides \[m\].
    pub sides: [f64; 2],
    /// Thickness of their layers, from the joint on \[m\].
    pub layers: Vec<f64>,
    /// What the boxes are.
    #[serde(default, skip_serializing_if = "Formulation::has_incompatible_modes")]
    pub formulation: Formulation,
}

impl StructureMesh {
    /// What this mesh has of the compliance of half spaces.
    fn compliance(&self, bodies: Pair) -> Result<FaceCompliance, StructureError> {
        if let Some(&count) = self.counts.iter().find(|count| **count == 0) {
            return Err(StructureError::OutOfRange {
                name: "a count of boxes under the joint",
                value: count as f64,
                expected: "at least 1",
            });
        }
        let of = |elastic| {
            let (sides, layers, counts) = (self.sides, &self.layers, self.counts);
            FaceCompliance::new(elastic, sides, layers, counts, self.formulation)
        };
        let mut both = of(bodies.lower)?;
        if bodies.upper == bodies.lower {
            both.add(&both.clone());
        } else {
            both.add(&of(bodies.upper)?);
        }
        Ok(both)
    }
}

/// How a structure presses its joint, by its own flexibility.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StructurePressing {
    /// What the load of the joint is.
    pub preload: Preload,
    /// Constant loads beside it, which press the joint and are no part of the vibration \[N\].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub loads: Vec<Force>,
}

impl StructurePressing {
    /// The points of the structure where loads act.
    pub fn points(&self) -> Vec<String> {
        let ends = match &self.preload {
            Preload::Bolt { points, .. } => points.to_vec(),
            Preload::Faces => Vec::new(),
        };
        let loads = self.loads.iter().map(|force| force.port.at.clone());
        ends.into_iter().chain(loads).collect()
    }

    /// What presses, in words.
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

/// What the load of a joint is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Preload {
    /// Opposing forces on the faces of the joint, spread by area.
    Faces,
    /// Opposing forces at two points of the structure, which pull one towards the other.
    Bolt {
        /// The points.
        points: [String; 2],
        /// From the first to the second, along the axes of the structure.
        direction: [f64; 3],
        /// The bolt is a part of the structure: its forces are found such that the pressure has the load wanted.
        in_mesh: bool,
    },
}

impl Preload {
    /// True where the forces are found such that the pressure has the load wanted.
    pub fn is_found(&self) -> bool {
        matches!(self, Preload::Bolt { in_mesh: true, .. })
    }

    /// True of a bolt that is no part of the structure.
    fn is_outside(&self) -> bool {
        matches!(self, Preload::Bolt { in_mesh: false, .. })
    }

    /// Forces on ports for a preload of 1 N.
    fn forces(&self, reduced: &Reduced, areas: &[f64]) -> Vec<PortForce> {
        match self {
            Preload::Faces => {
                let all: f64 = areas.iter().sum();
                let each = areas.iter().enumerate();
                each.map(|(e, area)| (3 * e + 2, -area / all)).collect()
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

fn port_of(reduced: &Reduced, at: &str, axis: usize) -> usize {
    let port = reduced.ports.of_point(at, axis);
    port.expect("the points of a recipe are ports of its structure")
}

/// Areas that differ by this part are the same.
const ROUNDING: f64 = 1e-9;

/// Least and largest ratio of the structure's flexibility to that of its mesh on half spaces, between neighbouring nodes within the joint. Twice the
/// modulus has a half.
const SAME_MESH: [f64; 2] = [0.8, 1.25];

impl Contact {
    /// The structure as it vibrates: with the spring of a bolt that is no part of it, where that is given.
    ///
    /// # Errors
    /// Those of [`Reduced::with_spring`].
    pub fn with_bolt(&self, reduced: Reduced) -> Result<Reduced, StructureError> {
        let bolt = self.pressing.as_ref().map(|of| &of.preload);
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

    /// What the mesh of the structure takes away from half spaces, negative, between the nodes of the contact elements.
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

    /// How the bodies of the `reduced` structure press each other at its contact elements, on a surface whose highest point is `top` \[m\].
    ///
    /// # Errors
    /// [`StructureError::OtherMesh`] for a structure whose joint is not that of its mesh and material, and those of [`Reduced::statics`].
    pub fn pressing(
        &self,
        of: &StructurePressing,
        mesh: &StructureMesh,
        elements: &ContactElements,
        reduced: &Reduced,
        top: f64,
    ) -> Result<Pressing, StructureError> {
        let nodes = elements.nodes().expect("contact elements at nodes");
        let preload = of.preload.forces(reduced, elements.areas());
        let port = |port: &Port| port_of(reduced, &port.at, port.axis);
        let others = of.loads.iter();
        let others = others.map(|force| (port(&force.port), force.amplitude * force.phase.cos()));
        let of_pressure = of.preload == Preload::Faces;
        let loads = [preload, others.collect()];
        let statics = reduced.statics(elements.centres(), &loads, of_pressure)?;
        let [of_mesh, ..] = mesh.compliance(self.bodies)?.matrices();
        let all = nodes.interpolation.nodes();
        let at = |e: usize, f: usize| nodes.numbers[e] * all + nodes.numbers[f];
        let on_mesh = |e: usize, f: usize| of_mesh[at(e, f)];
        let ratio = ratio_to_mesh(elements, |e, f| statics.flexibility[(e, f)], on_mesh);
        if let Some(ratio) = ratio
            && !(SAME_MESH[0]..=SAME_MESH[1]).contains(&ratio)
        {
            return Err(StructureError::OtherMesh {
                ratio,
                least: SAME_MESH[0],
                most: SAME_MESH[1],
            });
        }
        let mut added = vec![0.0; all * all];
        for e in 0..elements.len() {
            for f in 0..elements.len() {
                added[at(e, f)] = statics.stiff[(e, f)] - on_mesh(e, f);
            }
        }
        let mut loads: Vec<NodalLoad> = Vec::with_capacity(2);
        for load in statics.loads {
            let mut opening = vec![0.0; all];
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
        let bodies = Bodies {
            free: statics.motions,
            held: statics.held,
            compliance: statics.held_compliance,
        };
        let mut pressing = Pressing::new(added.into(), bodies, loads, top);
        pressing.mesh_ratio = ratio;
        Ok(pressing)
    }
}

/// Ratio of the energy of the structure to that of its mesh on half spaces, under forces of 1, −2 and 1 on three nodes in a row with all faces
/// around them. Such forces neither move nor turn the bodies as a whole, and hardly bend them: two nodes alone would turn a slender bar.
fn ratio_to_mesh(
    elements: &ContactElements,
    own: impl Fn(usize, usize) -> f64,
    on_mesh: impl Fn(usize, usize) -> f64,
) -> Option<f64> {
    let nodes = elements.nodes()?;
    let width = nodes.interpolation.counts()[1] + 1;
    let whole = elements.areas().iter().fold(0.0, |m: f64, a| m.max(*a));
    // A node with all faces around it has a neighbour along each axis, so that a step never leads around the end of a row.
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
                of_structure += energy(&own, [a, b, c]);
                of_mesh += energy(&on_mesh, [a, b, c]);
            }
        }
    }
    (of_mesh > 0.0).then(|| of_structure / of_mesh)
}
