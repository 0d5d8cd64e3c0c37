//! Export of the resonator as an input deck of CalculiX and Abaqus. The deck computes the free vibration of the
//! resonator.
//!
//! All quantities are in SI: m, N, kg, s, Pa. The deck numbers nodes and elements in the order of the mesh, but from 1
//! instead of 0. The elements are C3D8I, hexahedra with incompatible modes as [`Formulation::IncompatibleModes`]. The
//! structure is unsupported, so the first six modes are rigid.
//!
//! The spring of a contact element acts on the mean of the four relative displacements at the contact element. A deck
//! has springs between nodes only. A quarter of the spring on each pair would not be equivalent, because k/4·Σu² is not
//! k·(Σu/4)². The deck adds one massless node per contact element. An equation sets the displacement of the massless
//! node to the mean of the four relative displacements. A spring connects the massless node to the ground.

use std::collections::{BTreeMap, HashMap};
use std::f64::consts::TAU;
use std::fmt::{self, Display, Write};

use crate::structure::StructureError;
use crate::structure::assembly::{Spring, System};
use crate::structure::element::Formulation;
use crate::structure::modes::{ModeOptions, lowest, rigid_modes, shift};
use crate::structure::reduction::{ContactPorts, Ports};
use crate::structure::resonator::{BOLT, MASS_1, MASS_2, ResonatorMesh};

/// Names of the element sets, by part number.
const PARTS: [(usize, &str); 3] = [(MASS_1, "MASS_1"), (MASS_2, "MASS_2"), (BOLT, "BOLT")];
/// Numbers on a line of a set. The format allows 16.
const NUMBERS_A_LINE: usize = 12;
/// Terms on a line of an equation.
const TERMS_A_LINE: usize = 4;
/// Faces of a hexahedron as indices of its nodes, in the order S1…S6 of the format.
const FACES: [[usize; 4]; 6] = [
    [0, 1, 2, 3],
    [4, 7, 6, 5],
    [0, 4, 5, 1],
    [1, 5, 6, 2],
    [2, 6, 7, 3],
    [3, 7, 4, 0],
];

/// Free-vibration problem of a resonator. [`Display`] writes the input deck of the free-vibration problem.
#[derive(Debug, Clone, Copy)]
pub struct Deck<'a> {
    resonator: &'a ResonatorMesh,
    springs: &'a [[f64; 3]],
    modes: usize,
}

impl<'a> Deck<'a> {
    /// Defines the free vibration of a resonator with springs at its contact elements.
    ///
    /// `springs` has the stiffnesses `[x, y, z]` of each contact element \[N/m\]; zero means no spring. `modes` is
    /// the number of elastic modes, without the six rigid ones. A tied resonator has no contact elements and takes no
    /// springs.
    ///
    /// # Errors
    /// [`StructureError`] if the number of springs differs from the number of contact elements. [`StructureError`] if a
    /// stiffness is negative or not finite, or if `modes` is zero.
    pub fn new(
        resonator: &'a ResonatorMesh,
        springs: &'a [[f64; 3]],
        modes: usize,
    ) -> Result<Self, StructureError> {
        if springs.len() != resonator.contacts.len() {
            return Err(StructureError::Contradiction {
                name: "the number of contact springs",
                value: springs.len() as f64,
                other: "the number of contact elements",
                other_value: resonator.contacts.len() as f64,
                expected: "they must be equal",
            });
        }
        let invalid = springs
            .iter()
            .flatten()
            .find(|k| !(**k >= 0.0 && k.is_finite()));
        if let Some(&value) = invalid {
            return Err(StructureError::OutOfRange {
                name: "the stiffness of a contact spring",
                value,
                expected: "a finite number, zero or more (a tied resonator is the infinite one)",
            });
        }
        if modes == 0 {
            return Err(StructureError::OutOfRange {
                name: "the number of modes",
                value: 0.0,
                expected: "at least 1",
            });
        }
        Ok(Deck {
            resonator,
            springs,
            modes,
        })
    }

    /// Computes the natural frequencies that the deck requests, with the finite elements of Fretwear.
    ///
    /// # Errors
    /// [`StructureError`] if the modes do not converge.
    pub fn frequencies(&self) -> Result<Frequencies, StructureError> {
        let ports = Ports::new(&self.resonator.contacts, &[], ContactPorts::Faces);
        let springs: Vec<Spring> = ports
            .combinations
            .into_iter()
            .zip(self.springs.iter().flatten())
            .filter(|(_, stiffness)| **stiffness > 0.0)
            .map(|(on, &stiffness)| Spring { on, stiffness })
            .collect();
        let mesh = &self.resonator.mesh;
        let system = System::assemble(mesh, Formulation::IncompatibleModes, &springs)?;
        let shift = shift(&system);
        let factor = system.shifted_factor(shift, &system.elimination_order(&[]))?;
        let rigid =
            rigid_modes(&system, shift).map_err(|source| StructureError::Factorization {
                matrix: "the energy of the rigid motions",
                source,
            })?;
        let options = ModeOptions::new(self.modes);
        let modes = lowest(&system, &factor, shift, &rigid, &options)?;
        Ok(Frequencies {
            rigid: rigid.columns(),
            elastic: modes.omega.iter().map(|omega| omega / TAU).collect(),
            mass: system.total_mass(),
        })
    }
}

/// Frequencies of a free structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Frequencies {
    /// Number of rigid modes.
    pub rigid: usize,
    /// Frequencies of the elastic modes \[Hz\], ascending.
    pub elastic: Vec<f64>,
    /// Mass of the structure \[kg\].
    pub mass: f64,
}

/// Number in the format of the deck. CalculiX reads 20 characters of a number, so the deck writes no more digits.
struct Number(f64);

impl Display for Number {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{:.11e}", self.0)
    }
}

impl Display for Deck<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ResonatorMesh {
            mesh,
            contacts,
            points,
        } = self.resonator;
        out.write_str("*HEADING\nLap-joint resonator, free vibration\n")?;
        out.write_str(
            "** Units: m, N, kg, s, Pa. Nothing is held: the first six modes are rigid.\n",
        )?;
        out.write_str("*NODE, NSET=STRUCTURE\n")?;
        for (n, x) in mesh.nodes.iter().enumerate() {
            let [x, y, z] = x.map(Number);
            writeln!(out, "{}, {x}, {y}, {z}", n + 1)?;
        }
        for (m, material) in mesh.materials.iter().enumerate() {
            let modulus = Number(material.elastic.youngs_modulus);
            let poisson = Number(material.elastic.poisson_ratio);
            let density = Number(material.density);
            writeln!(out, "*MATERIAL, NAME=MATERIAL_{}", m + 1)?;
            writeln!(out, "*ELASTIC\n{modulus}, {poisson}")?;
            writeln!(out, "*DENSITY\n{density}")?;
        }
        for (part, name) in PARTS {
            self.elements(out, part, name)?;
        }
        for point in points {
            let name = point.name.to_uppercase();
            writeln!(out, "** {name}: the mean of its nodes, weighted by")?;
            for (node, weight) in &point.weights {
                writeln!(out, "** {}, {weight:.9}", node + 1)?;
            }
            node_set(out, &name, point.weights.iter().map(|w| w.0).collect())?;
        }
        if !contacts.is_empty() {
            self.contact_faces(out)?;
            self.contact_springs(out)?;
        }
        let modes = self.modes + 6;
        writeln!(out, "*STEP\n*FREQUENCY\n{modes}\n*END STEP")
    }
}

/// Writes a set of nodes in ascending order. `nodes` are numbered from 0.
fn node_set(out: &mut fmt::Formatter<'_>, name: &str, mut nodes: Vec<usize>) -> fmt::Result {
    nodes.sort_unstable();
    nodes.dedup();
    writeln!(out, "*NSET, NSET={name}")?;
    for line in nodes.chunks(NUMBERS_A_LINE) {
        let numbers: Vec<String> = line.iter().map(|n| (n + 1).to_string()).collect();
        writeln!(out, "{}", numbers.join(", "))?;
    }
    Ok(())
}

impl Deck<'_> {
    /// Writes the elements of a part, and the section of each material in it.
    fn elements(&self, out: &mut fmt::Formatter<'_>, part: usize, name: &str) -> fmt::Result {
        let mesh = &self.resonator.mesh;
        for material in 0..mesh.materials.len() {
            let part_elements: Vec<usize> = (0..mesh.elements.len())
                .filter(|&e| mesh.elements[e].part == part && mesh.elements[e].material == material)
                .collect();
            if part_elements.is_empty() {
                continue;
            }
            writeln!(out, "*ELEMENT, TYPE=C3D8I, ELSET={name}")?;
            for e in part_elements {
                write!(out, "{}", e + 1)?;
                for node in mesh.elements[e].nodes {
                    write!(out, ", {}", node + 1)?;
                }
                out.write_char('\n')?;
            }
            let material = format!("MATERIAL_{}", material + 1);
            writeln!(out, "*SOLID SECTION, ELSET={name}, MATERIAL={material}")?;
        }
        Ok(())
    }

    /// Writes the nodes and the element faces on both sides of the contact plane.
    fn contact_faces(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ResonatorMesh { mesh, contacts, .. } = self.resonator;
        let mut faces = HashMap::new();
        for (e, element) in mesh.elements.iter().enumerate() {
            for (f, places) in FACES.iter().enumerate() {
                let mut nodes = places.map(|p| element.nodes[p]);
                nodes.sort_unstable();
                faces.insert(nodes, (e, f));
            }
        }
        let lower = contacts.iter().map(|c| c.pairs.map(|pair| pair.0));
        let upper = contacts.iter().map(|c| c.pairs.map(|pair| pair.1));
        let sides: [(&str, Vec<[usize; 4]>); 2] = [
            ("CONTACT_LOWER", lower.collect()),
            ("CONTACT_UPPER", upper.collect()),
        ];
        for (name, side) in sides {
            node_set(out, name, side.iter().flatten().copied().collect())?;
            writeln!(out, "*SURFACE, NAME={name}_FACES, TYPE=ELEMENT")?;
            for mut nodes in side {
                nodes.sort_unstable();
                // The lookup always succeeds: the mesh makes each contact face from a face of an element.
                if let Some((element, face)) = faces.get(&nodes) {
                    writeln!(out, "{}, S{}", element + 1, face + 1)?;
                }
            }
        }
        Ok(())
    }

    /// Writes the massless nodes, the equations of the massless nodes, and the springs between the massless nodes and
    /// the ground.
    fn contact_springs(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ResonatorMesh { mesh, contacts, .. } = self.resonator;
        out.write_str(
            "** Each contact element's mean relative displacement, upper minus lower, is that of a node of its own.\n",
        )?;
        // A node without a spring would make the stiffness singular, so only elements with a spring get a node.
        let mut sprung_elements = Vec::new();
        for (contact, springs) in contacts.iter().zip(self.springs) {
            if springs.iter().any(|k| *k > 0.0) {
                sprung_elements.push((
                    mesh.nodes.len() + 1 + sprung_elements.len(),
                    contact,
                    springs,
                ));
            }
        }
        if sprung_elements.is_empty() {
            return Ok(());
        }
        out.write_str("*NODE, NSET=CONTACT_MEANS\n")?;
        for (node, contact, _) in &sprung_elements {
            let [x, y] = contact.centre.map(Number);
            writeln!(out, "{node}, {x}, {y}, {}", Number(0.0))?;
        }
        // Springs of equal direction and stiffness form a set. The bits of positive numbers have the order of the
        // numbers.
        let mut sets: BTreeMap<(usize, u64), Vec<usize>> = BTreeMap::new();
        for (node, contact, springs) in &sprung_elements {
            let share = 1.0 / contact.pairs.len() as f64;
            for axis in 1..=3 {
                let stiffness = springs[axis - 1];
                if stiffness == 0.0 {
                    continue;
                }
                let mut terms = vec![format!("{node}, {axis}, -1.0")];
                for (lower, upper) in contact.pairs {
                    terms.push(format!("{}, {axis}, {share:?}", upper + 1));
                    terms.push(format!("{}, {axis}, {:?}", lower + 1, -share));
                }
                writeln!(out, "*EQUATION\n{}", terms.len())?;
                for line in terms.chunks(TERMS_A_LINE) {
                    writeln!(out, "{}", line.join(", "))?;
                }
                let set = sets.entry((axis, stiffness.to_bits())).or_default();
                set.push(*node);
            }
        }
        let mut element = mesh.elements.len();
        for (s, ((axis, bits), nodes)) in sets.iter().enumerate() {
            let name = format!("SPRINGS_{}", s + 1);
            writeln!(out, "*ELEMENT, TYPE=SPRING1, ELSET={name}")?;
            for node in nodes {
                element += 1;
                writeln!(out, "{element}, {node}")?;
            }
            let stiffness = Number(f64::from_bits(*bits));
            writeln!(out, "*SPRING, ELSET={name}\n{axis}\n{stiffness}")?;
        }
        Ok(())
    }
}
