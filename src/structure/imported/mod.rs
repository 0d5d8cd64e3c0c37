//! Structure from the stiffness and mass of another program: its rows in SI, its joint, and its reduced model.

mod error;
mod nodes;
mod reduce;
mod rows;

use std::collections::{HashMap, HashSet};

use serde::{Deserialize, Serialize};

pub use error::ImportError;
pub use nodes::FacingNodes;
pub use rows::name_rows;

use super::element::Formulation;
use super::frequencies::{self, SUMMED_PRECISION, bodies};
use super::inspection::{self, mass_by_direction};
use super::interface::{Interface, InterfaceError, JointRequirements, Side};
use super::matrices::{Matrices, Role, Triplets};
use super::reduction::{ContactPorts, Ports};
use crate::linalg::vectors::{dot, minus};
use nodes::{
    NodePoint, check_pairs, ends_of_preload, merge_facing_nodes, neighbours, point, sides,
};
use rows::{fix_massless_rows, number_rows};

/// Tolerance of the symmetry of a matrix, as a share of its largest entry. The tolerance allows for the rounded digits
/// of a text file.
const SYMMETRIC: f64 = 1e-6;

/// Units of the files, as multiples of the SI units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UnitSystem {
    /// Unit of length \[m\].
    pub length: f64,
    /// Unit of mass \[kg\].
    pub mass: f64,
    /// Unit of time \[s\].
    pub time: f64,
}

impl UnitSystem {
    /// Returns true if the units are equal except for rounding.
    pub fn is_near(&self, other: &UnitSystem) -> bool {
        const ROUNDING: f64 = 1e-9;
        let pairs = [
            (self.length, other.length),
            (self.mass, other.mass),
            (self.time, other.time),
        ];
        pairs.iter().all(|(a, b)| (a / b - 1.0).abs() < ROUNDING)
    }
}

impl Default for UnitSystem {
    fn default() -> Self {
        UnitSystem {
            length: 1.0,
            mass: 1.0,
            time: 1.0,
        }
    }
}

/// Stiffness and mass of a structure in SI, its joint, and the points at which forces act.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedStructure {
    /// The joint. `None` for a bonded structure.
    pub interface: Option<Interface>,
    /// Notes for the user about the files.
    pub notes: Vec<String>,
    /// Warnings that the files may be wrong.
    pub doubts: Vec<String>,
    /// Number of rows that are not fixed or left out.
    pub rows: usize,
    /// Mass \[kg\].
    pub mass: f64,
    stiffness: Lower,
    inertia: Lower,
    damping: Option<Lower>,
    hysteretic: Option<Lower>,
    /// Relative precision of the stiffness entries: half a unit of the last digit.
    precision: f64,
    row_of: HashMap<(i64, u32), usize>,
    /// Position of each row in the unit of the files, if all positions are known.
    places: Option<Vec<[f64; 3]>>,
    sides: [Side; 2],
    /// True if the nodes of both sides are paired in their order.
    is_paired: bool,
    points: Vec<NodePoint>,
    /// Formulation of the hexahedra, if all elements of the files are 8-node hexahedra of one formulation.
    pub hexahedra: Option<Formulation>,
    /// Ends of a preload, which are the last two points.
    pub preload: Option<EndsOfPreload>,
    /// Edges of the bodies as nodes and their positions in the axes of the joint \[m\].
    outline: Vec<Vec<(i64, [f64; 3])>>,
}

/// Two end points of a bolt preload, and the direction of the preload.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EndsOfPreload {
    /// Names of the two points.
    pub points: [String; 2],
    /// Unit vector from the first point to the second, in the axes of the model.
    pub direction: [f64; 3],
}

/// Lower triangle as columns, rows and values, sorted by column.
type Lower = Vec<(u32, u32, f64)>;

const AXES: [&str; 3] = ["x", "y", "z"];

/// Options of the scene for an imported structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Options<'a> {
    /// Units of the files.
    pub unit: UnitSystem,
    /// Fixed rows, in the syntax of [`inspection::parse_fixed_rows`].
    pub fixed: Option<&'a str>,
    /// Nodes of both bodies at the joint.
    pub facing: &'a FacingNodes,
    /// Requirements on the joint.
    pub wanted: &'a JointRequirements,
    /// Sides of the joint along x and y \[m\].
    pub size: [f64; 2],
    /// Numbers of contact elements along x and y.
    pub elements: Option<[usize; 2]>,
    /// True if facing nodes are merged.
    pub is_bonded: bool,
    /// Points, each as nodes and sets of nodes. A point has the mean displacement of its nodes.
    pub points: &'a [String],
    /// Nodes and sets of nodes at both ends of a preload.
    pub preload: Option<&'a [String; 2]>,
}

impl ImportedStructure {
    /// Builds a structure from matrices and options.
    ///
    /// # Errors
    /// [`ImportError`] for missing matrices, nodes or sets, and for a joint that does not match the scene.
    pub fn new(
        matrices: &Matrices,
        options: &Options<'_>,
    ) -> Result<ImportedStructure, ImportError> {
        let stiffness = required(matrices, Role::Stiffness)?;
        let mass = required(matrices, Role::Mass)?;
        let dofs = matrices.dofs.as_ref().ok_or(ImportError::NoDofs {
            rows: matrices.size,
            nodes: 0,
        })?;
        let damping = matrices.damping.as_ref();
        let symmetric = [
            (Role::Stiffness, Some(stiffness)),
            (Role::Mass, Some(mass)),
            (Role::Damping, damping),
            (Role::Hysteretic, matrices.hysteretic.as_ref()),
        ];
        for (role, matrix) in symmetric
            .into_iter()
            .filter_map(|(role, matrix)| Some((role, matrix?)))
        {
            let asymmetry = matrix.asymmetry();
            if asymmetry.share > SYMMETRIC {
                return Err(ImportError::Unsymmetric {
                    role,
                    at: (dofs[asymmetry.at.0], dofs[asymmetry.at.1]),
                    values: asymmetry.values,
                    share: asymmetry.share,
                });
            }
        }
        let masses = mass.diagonal();
        if let Some(row) = masses.iter().position(|m| *m < 0.0) {
            return Err(ImportError::NegativeMass {
                dof: dofs[row],
                mass: masses[row],
            });
        }
        let mut notes = matrices.notes.clone();
        notes.extend(inspection::inner_nodes_note(matrices));
        let mut doubts = inspection::model_warnings(matrices);
        let (mut is_held, fixed_notes) = match options.fixed {
            Some(text) => inspection::parse_fixed_rows(matrices, text)?,
            None => (vec![false; matrices.size], Vec::new()),
        };
        notes.extend(fixed_notes);
        let held_rows = |is_held: &[bool]| -> HashSet<(i64, u32)> {
            let held = dofs.iter().zip(is_held).filter(|(_, held)| **held);
            held.map(|(dof, _)| (dof.node, dof.direction)).collect()
        };
        let mut used_nodes: HashSet<i64> =
            held_rows(&is_held).into_iter().map(|row| row.0).collect();
        for (row, held) in frequencies::penalty_fixed_rows(matrices)
            .into_iter()
            .enumerate()
        {
            is_held[row] |= held;
        }
        let held_rows = held_rows(&is_held);
        let left_out = fix_massless_rows(matrices, [stiffness, mass], &mut is_held);
        if left_out > 0 {
            notes.push(format!(
                "{left_out} rows without a connection to any mass are left out"
            ));
        }
        let unit = options.unit;
        let positions = |node: i64| {
            let found = matrices.positions.get(&node);
            let found =
                found.ok_or_else(|| ImportError::NoPosition(node, matrices.unread_reasons()))?;
            Ok(found.map(|v| v * unit.length))
        };
        let [mut lower, mut upper] = sides(matrices, options.facing, unit, &positions)?;
        let (mut place, mut rows) = number_rows(matrices, [stiffness, mass], &is_held);
        if options.is_bonded && !upper.nodes.is_empty() {
            rows = merge_facing_nodes(dofs, options.facing, [&lower, &upper], &mut place)?;
            notes.push(format!(
                "without [contact] the joint is bonded: {} pairs of nodes are merged",
                upper.nodes.len()
            ));
            [lower, upper] = Default::default();
        }
        let scaled = |matrix: &Triplets, worth: f64| -> Lower {
            // A rotation is scaled to the displacement at a lever of one unit of length.
            let lever: Vec<f64> = (dofs.iter())
                .map(|dof| if dof.is_rotation() { unit.length } else { 1.0 })
                .collect();
            let mut row_levers = vec![1.0; rows];
            for (row, place) in place.iter().enumerate() {
                if let Some(place) = place {
                    row_levers[*place as usize] = lever[row];
                }
            }
            let lower = matrix.lower(&place).into_iter();
            lower
                .map(|(i, j, v)| {
                    (
                        i,
                        j,
                        v * worth * row_levers[i as usize] * row_levers[j as usize],
                    )
                })
                .collect()
        };
        let mut row_of = HashMap::new();
        for (row, dof) in dofs.iter().enumerate() {
            if let Some(place) = place[row] {
                row_of.insert((dof.node, dof.direction), place as usize);
            }
        }
        let stiffness_si = scaled(stiffness, unit.mass / (unit.time * unit.time));
        let inertia = scaled(mass, unit.mass);
        if options.is_bonded {
            let (_, bodies) = bodies(rows, &stiffness_si, &inertia);
            if bodies > 1 {
                doubts.push(format!(
                    "without [contact] nothing joins the {bodies} bodies of the structure: give structure.interface, or a *TIE in the deck"
                ));
            }
        }
        let points = options.points.iter().map(|name| point(matrices, name));
        let mut points = points.collect::<Result<Vec<_>, _>>()?;
        let mut preload = None;
        if let Some(names) = options.preload {
            let ([head, nut], are_areas_known) = ends_of_preload(matrices, names, &positions)?;
            if !are_areas_known {
                notes.push(
                    "no file has elements whose faces have all corners in contact.preload.head or nut: their nodes bear equal parts of the preload".to_owned(),
                );
            }
            let head_to_nut = minus(nut.1, head.1);
            let length = dot(head_to_nut, head_to_nut).sqrt();
            if length == 0.0 {
                return Err(ImportError::PreloadDirection(names.clone()));
            }
            preload = Some(EndsOfPreload {
                points: [head.0.0.clone(), nut.0.0.clone()],
                direction: head_to_nut.map(|d| d / length),
            });
            points.extend([head.0, nut.0]);
        }
        used_nodes.extend(lower.nodes.iter().chain(&upper.nodes));
        used_nodes.extend(
            points
                .iter()
                .flat_map(|point| &point.1)
                .map(|(node, _)| node),
        );
        for (why, nodes) in &matrices.local_axes {
            if let Some(node) = nodes.iter().find(|node| used_nodes.contains(node)) {
                return Err(ImportError::LocalAxes(*node, why.clone()));
            }
        }
        let mut node_of = vec![0; rows];
        for (&(node, _), &row) in &row_of {
            node_of[row] = node;
        }
        let neighbour_positions = neighbours([&lower, &upper], &stiffness_si, &node_of, &positions);
        [lower.neighbours, upper.neighbours] = neighbour_positions;
        let mut all: Vec<i64> = matrices.positions.keys().copied().collect();
        all.sort_unstable();
        let all: Result<Vec<[f64; 3]>, ImportError> = all.into_iter().map(positions).collect();
        let mut interface = None;
        if !options.is_bonded {
            let found = Interface::find(
                [&lower, &upper],
                &all?,
                options.size,
                options.elements,
                options.wanted,
            )?;
            doubts.extend(found.gap_note());
            notes.extend(face_notes(&found, options.facing, [&lower, &upper])?);
            interface = Some(found);
        }
        let at_joint = |node: &i64| {
            let at = positions(*node)?;
            Ok((
                *node,
                interface.as_ref().map_or(at, |joint| joint.place(at)),
            ))
        };
        let edge = |nodes: &Vec<i64>| nodes.iter().map(at_joint).collect();
        let outline: Result<_, ImportError> = matrices.outline.iter().map(edge).collect();
        let outline = outline?;
        let imported = ImportedStructure {
            interface,
            notes,
            doubts,
            rows,
            mass: mass_by_direction(matrices)
                .into_iter()
                .flatten()
                .fold(0.0, f64::max)
                * unit.mass,
            inertia,
            damping: damping.map(|damping| scaled(damping, unit.mass / unit.time)),
            hysteretic: (matrices.hysteretic.as_ref())
                .map(|damping| scaled(damping, unit.mass / unit.time.powi(2))),
            stiffness: stiffness_si,
            precision: stiffness.precision.max(SUMMED_PRECISION),
            row_of,
            places: matrices.places(&place),
            sides: [lower, upper],
            is_paired: matches!(options.facing, FacingNodes::Pairs(_)),
            points,
            hexahedra: matrices.hexahedra,
            preload,
            outline,
        };
        imported.check_rows(&held_rows)?;
        Ok(imported)
    }

    /// Passes all data that determine the reduced model to a hash: entries, edges, and nodes of the joint and the
    /// points.
    pub fn hash_parts(&self, update: &mut dyn FnMut(&[u8])) {
        let required_matrices = [&self.stiffness, &self.inertia];
        for matrix in required_matrices
            .into_iter()
            .chain(&self.damping)
            .chain(&self.hysteretic)
        {
            update(&(matrix.len() as u64).to_le_bytes());
            for &(i, j, v) in matrix {
                update(&i.to_le_bytes());
                update(&j.to_le_bytes());
                update(&v.to_le_bytes());
            }
        }
        for (node, at) in self.outline.iter().flatten() {
            update(&node.to_le_bytes());
            at.iter().for_each(|v| update(&v.to_le_bytes()));
        }
        update(&self.precision.to_le_bytes());
        let each_row = |update: &mut dyn FnMut(&[u8]), node: i64| {
            for d in 1..=3 {
                let row = self.row_of.get(&(node, d)).copied().unwrap_or(0);
                update(&(row as u64).to_le_bytes());
            }
        };
        for side in &self.sides {
            for (node, at) in side.nodes.iter().zip(&side.positions) {
                at.iter().for_each(|v| update(&v.to_le_bytes()));
                each_row(update, *node);
            }
            side.areas
                .iter()
                .for_each(|area| update(&area.to_le_bytes()));
        }
        for (name, nodes) in &self.points {
            update(name.as_bytes());
            for (node, part) in nodes {
                each_row(update, *node);
                update(&part.to_le_bytes());
            }
        }
    }

    /// Checks that every node of a port has three displacements.
    fn check_rows(&self, held: &HashSet<(i64, u32)>) -> Result<(), ImportError> {
        let joint_nodes = self.sides.iter().flat_map(|side| &side.nodes);
        let point_nodes = self.points.iter().flat_map(|point| &point.1);
        for &node in joint_nodes.chain(point_nodes.map(|(node, _)| node)) {
            for (axis, name) in AXES.into_iter().enumerate() {
                let row = (node, axis as u32 + 1);
                if !self.row_of.contains_key(&row) {
                    return Err(ImportError::NoRow {
                        node,
                        axis: name,
                        is_held: held.contains(&row),
                    });
                }
            }
        }
        Ok(())
    }

    /// Returns the median normal stiffness of single nodes of the joint over the shorter side of a contact element
    /// \[Pa\].
    ///
    /// The quotient of normal stiffness and shorter side is near Young's modulus for any mesh. Returns `None` for a
    /// bonded joint.
    pub fn apparent_modulus(&self) -> Option<f64> {
        let interface = self.interface.as_ref()?;
        let mut diagonal = vec![0.0; self.rows];
        for &(i, j, value) in &self.stiffness {
            if i == j {
                diagonal[i as usize] = value;
            }
        }
        let normal = interface.axes[2];
        let normal_stiffness = |node: &i64| -> f64 {
            let rows = (0..3).map(|d| (normal[d], self.row_of.get(&(*node, d as u32 + 1))));
            rows.map(|(n, row)| row.map_or(0.0, |row| n * n * diagonal[*row]))
                .sum()
        };
        let mut node_stiffnesses: Vec<f64> = self
            .sides
            .iter()
            .flat_map(|side| &side.nodes)
            .map(normal_stiffness)
            .collect();
        node_stiffnesses.sort_by(f64::total_cmp);
        let sides = interface.array.sides();
        Some(node_stiffnesses[node_stiffnesses.len() / 2] / sides[0].min(sides[1]))
    }

    /// Returns true if the files have a damping matrix.
    pub fn has_damping(&self) -> bool {
        self.damping.is_some() || self.hysteretic.is_some()
    }

    /// Returns true if the files have elements whose edges can be drawn.
    pub fn has_outline(&self) -> bool {
        !self.outline.is_empty()
    }

    /// Returns the ports of the structure. Each contact element has three ports along the axes of the joint. After the
    /// contact elements, each point has three ports along the axes of the model.
    ///
    /// # Errors
    /// [`InterfaceError`] if no nodes are near a contact element.
    pub fn ports(&self, at: ContactPorts) -> Result<Ports, InterfaceError> {
        let (mut combinations, mut contacts) = (Vec::new(), 0);
        if let Some(interface) = &self.interface {
            let [lower, upper] = &self.sides;
            let upper_weights = interface.weights(upper, true, at)?;
            let lower_weights = match self.is_paired {
                true => upper_weights.clone(),
                false => interface.weights(lower, false, at)?,
            };
            let weights = [lower_weights, upper_weights];
            contacts = weights[0].len();
            for element in 0..contacts {
                for axis in interface.axes {
                    let mut port = Vec::new();
                    for (side, sign) in [(0, -1.0), (1, 1.0)] {
                        for &(n, weight) in &weights[side][element] {
                            let node = self.sides[side].nodes[n];
                            for (d, along) in axis.into_iter().enumerate().filter(|a| a.1 != 0.0) {
                                let row = self.row_of[&(node, d as u32 + 1)];
                                port.push((row, sign * weight * along));
                            }
                        }
                    }
                    combinations.push(port);
                }
            }
        }
        for (_, nodes) in &self.points {
            for d in 0..3 {
                let rows = nodes.iter();
                let rows = rows.map(|(node, part)| (self.row_of[&(*node, d + 1)], *part));
                combinations.push(rows.collect());
            }
        }
        Ok(Ports {
            combinations,
            contacts,
            points: self.points.iter().map(|point| point.0.clone()).collect(),
        })
    }
}

/// Checks paired nodes, and returns notes for the user about the faces of the joint.
fn face_notes(
    interface: &Interface,
    facing: &FacingNodes,
    [lower, upper]: [&Side; 2],
) -> Result<Vec<String>, ImportError> {
    let mut notes = Vec::new();
    if let FacingNodes::Pairs(_) = facing {
        check_pairs(interface, lower, upper)?;
    } else if lower.nodes.len() != upper.nodes.len() {
        notes.push(format!(
            "the faces of the joint have {} nodes above and {} below: the contact elements are at the upper nodes",
            upper.nodes.len(),
            lower.nodes.len()
        ));
    }
    if !interface.is_regular && !interface.array.absent.is_empty() {
        let all = interface.array.counts[0] * interface.array.counts[1];
        notes.push(format!(
            "{} of {all} rectangles of joint.elements have no node nearby and carry no load: they are holes, or joint.elements is too fine",
            interface.array.absent.len()
        ));
    }
    Ok(notes)
}

fn required(matrices: &Matrices, role: Role) -> Result<&Triplets, ImportError> {
    matrices.get(role).ok_or(ImportError::Missing(role))
}
