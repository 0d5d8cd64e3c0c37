//! A structure whose stiffness and mass come from another program: its rows in SI, its joint, and the small model at it.

use std::collections::{HashMap, HashSet};

use serde::{Deserialize, Serialize};

use super::StructureError;
use super::frequencies::{self, DENSE, SUMMED, bodies, dense, spectrum};
use super::inspection::{self, FixedError, mass_by_direction};
use super::interface::{Interface, InterfaceError, Side, Wanted};
use super::matrices::{Dof, Matrices, Role, Triplets};
use super::modes::{ModeOptions, lowest_of, shift_of};
use super::reduction::{ContactPorts, ModesAtPorts, Ports, Reduced, complete};
use crate::linalg::{Matrix, SparseCholesky, SparseSymmetric, minimum_degree};

/// Entries may differ from their mirror images by this share of the largest: what the digits of a text leave.
const SYMMETRIC: f64 = 1e-6;
/// The nodes of a pair may be so far apart along the joint, in sides of a contact element: what other elements of curved meshes leave.
const ASKEW: f64 = 0.05;
/// Rigid modes of a body, which a block of vectors finds together.
const BODY: usize = 6;
/// The shift of a mesh suits where it is between these times the lowest elastic ω².
const USUAL: [f64; 2] = [1e-4, 100.0];
/// Elastic modes that are looked for to know the lowest.
const LOWEST: usize = 1;

/// Worth of the units of the files in SI.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UnitSystem {
    /// Of length \[m\].
    pub length: f64,
    /// Of mass \[kg\].
    pub mass: f64,
    /// Of time \[s\].
    pub time: f64,
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

/// Nodes of two bodies that face each other.
#[derive(Debug, Clone, PartialEq)]
pub enum Facing {
    /// Pairs of nodes: of the upper body, of the lower one, and the area, in the unit of length squared; all have one or none.
    Pairs(Vec<(i64, i64, Option<f64>)>),
    /// Sets of nodes by name.
    Sets {
        /// Of the upper body.
        upper: String,
        /// Of the lower body.
        lower: String,
    },
}

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
        "node {0} has no position; give structure.nodes, a table of node, x, y and z, or the deck of the model"
    )]
    NoPosition(i64),
    /// A node of the joint, or of a point, has no row.
    #[error(
        "node {node} has no displacement along {axis} in the matrices{}", if *.is_held { ": structure.fixed holds it" } else { ": the program has removed it, or there is no such node" }
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
    /// A node twice.
    #[error("node {node} is in two pairs of the joint; each node of a body faces one of the other")]
    Twice {
        /// The node.
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

/// Stiffness and mass of a structure in SI, its joint, and the points at which forces act.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The joint.
    pub interface: Interface,
    /// What the user should know of the files.
    pub notes: Vec<String>,
    /// Rows of the matrices that are not held.
    pub rows: usize,
    /// Mass \[kg\].
    pub mass: f64,
    stiffness: Lower,
    inertia: Lower,
    damping: Option<Lower>,
    /// Half a unit of the last digit of the stiffness's entries, over them.
    precision: f64,
    row_of: HashMap<(i64, u32), usize>,
    sides: [Side; 2],
    /// The nodes of both sides face each other one by one, in their order.
    is_paired: bool,
    points: Vec<(String, Vec<i64>)>,
}

/// A lower triangle: rows, columns and values, sorted by column.
type Lower = Vec<(u32, u32, f64)>;

const AXES: [&str; 3] = ["x", "y", "z"];

/// What a user says of a structure beside its files.
#[derive(Debug, Clone, PartialEq)]
pub struct Options<'a> {
    /// Units of the files.
    pub unit: UnitSystem,
    /// Nodes in the order of the rows, three or six rows each, for files that do not say what rows are.
    pub order: &'a [i64],
    /// Rows that are held, as [`inspection::fixed`] reads it.
    pub fixed: Option<&'a str>,
    /// The joint.
    pub facing: &'a Facing,
    /// What the joint must be.
    pub wanted: &'a Wanted,
    /// Sides of the joint along x and y \[m\].
    pub size: [f64; 2],
    /// Contact elements along x and y.
    pub elements: Option<[usize; 2]>,
    /// Points: numbers of nodes, or names of sets, whose mean displacement is meant.
    pub points: &'a [String],
}

impl Imported {
    /// What `matrices` are with these options.
    ///
    /// # Errors
    /// [`ImportError`] names what is missing, or what does not fit the scene.
    pub fn new(matrices: &Matrices, options: &Options<'_>) -> Result<Imported, ImportError> {
        let stiffness = required(matrices, Role::Stiffness)?;
        let mass = required(matrices, Role::Mass)?;
        let ordered;
        let dofs = match &matrices.dofs {
            Some(dofs) => dofs,
            None => {
                ordered = in_order(matrices.size, options.order)?;
                &ordered
            }
        };
        let damping = matrices.damping.as_ref();
        let symmetric = [
            (Role::Stiffness, Some(stiffness)),
            (Role::Mass, Some(mass)),
            (Role::Damping, damping),
        ];
        for (role, matrix) in symmetric
            .into_iter()
            .filter_map(|(role, matrix)| Some((role, matrix?)))
        {
            let off = matrix.asymmetry();
            if off.share > SYMMETRIC {
                return Err(ImportError::Unsymmetric {
                    role,
                    at: (dofs[off.at.0], dofs[off.at.1]),
                    values: off.values,
                    share: off.share,
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
        let mut known = None;
        let (mut is_held, found) = match options.fixed {
            Some(text) => inspection::fixed(dofs_known(matrices, dofs, &mut known), text)?,
            None => (vec![false; matrices.size], Vec::new()),
        };
        notes.extend(found);
        for (row, held) in frequencies::held(matrices).into_iter().enumerate() {
            is_held[row] |= held;
        }
        let left_out = leave_out_massless(matrices, [stiffness, mass], &mut is_held);
        if left_out > 0 {
            notes.push(format!(
                "{left_out} rows that nothing with mass is joined to are left out"
            ));
        }
        let (place, rows) = places(matrices, [stiffness, mass], &is_held);
        let unit = options.unit;
        let scaled = |matrix: &Triplets, worth: f64| -> Lower {
            // A rotation is the displacement at a lever of one unit of length.
            let lever: Vec<f64> = (dofs.iter())
                .map(|dof| if dof.is_rotation() { unit.length } else { 1.0 })
                .collect();
            let mut of_row = vec![1.0; rows];
            for (row, place) in place.iter().enumerate() {
                if let Some(place) = place {
                    of_row[*place as usize] = lever[row];
                }
            }
            let lower = matrix.lower(&place).into_iter();
            lower
                .map(|(i, j, v)| (i, j, v * worth * of_row[i as usize] * of_row[j as usize]))
                .collect()
        };
        let positions = |node: i64| {
            let found = matrices.positions.get(&node);
            let found = found.ok_or(ImportError::NoPosition(node))?;
            Ok(found.map(|v| v * unit.length))
        };
        let mut row_of = HashMap::new();
        for (row, dof) in dofs.iter().enumerate() {
            if let Some(place) = place[row] {
                row_of.insert((dof.node, dof.direction), place as usize);
            }
        }
        let stiffness_si = scaled(stiffness, unit.mass / (unit.time * unit.time));
        let [lower, upper] = sides(matrices, options.facing, unit, &positions)?;
        let neighbours = Neighbours::of(rows, &stiffness_si, dofs, &place);
        let joint: HashSet<i64> = lower.nodes.iter().chain(&upper.nodes).copied().collect();
        let [lower, upper] =
            [lower, upper].map(|side| neighbours.added(side, &joint, &row_of, &positions));
        let mut all: Vec<i64> = matrices.positions.keys().copied().collect();
        all.sort_unstable();
        let all: Result<Vec<[f64; 3]>, ImportError> = all.into_iter().map(positions).collect();
        let interface = Interface::find(
            [&lower, &upper],
            &all?,
            options.size,
            options.elements,
            options.wanted,
        )?;
        if let Facing::Pairs(_) = options.facing {
            check_pairs(&interface, &lower, &upper)?;
        } else if lower.nodes.len() != upper.nodes.len() {
            notes.push(format!(
                "the faces of the joint have {} nodes above and {} below: contact is where the upper ones are",
                upper.nodes.len(),
                lower.nodes.len()
            ));
        }
        if !interface.is_regular && !interface.array.absent.is_empty() {
            let all = interface.array.counts[0] * interface.array.counts[1];
            notes.push(format!(
                "{} of {all} rectangles of joint.elements are near no node and bear nothing: holes, or fewer elements are wanted",
                interface.array.absent.len()
            ));
        }
        let held_rows: HashSet<(i64, u32)> = (dofs.iter().zip(&is_held))
            .filter(|(_, held)| **held)
            .map(|(dof, _)| (dof.node, dof.direction))
            .collect();
        let points = options.points.iter().map(|name| point(matrices, name));
        let imported = Imported {
            interface,
            notes,
            rows,
            mass: mass_by_direction(dofs_known(matrices, dofs, &mut known))
                .into_iter()
                .flatten()
                .fold(0.0, f64::max)
                * unit.mass,
            inertia: scaled(mass, unit.mass),
            damping: damping.map(|damping| scaled(damping, unit.mass / unit.time)),
            stiffness: stiffness_si,
            precision: stiffness.precision.max(SUMMED),
            row_of,
            sides: [lower, upper],
            is_paired: matches!(options.facing, Facing::Pairs(_)),
            points: points.collect::<Result<_, _>>()?,
        };
        imported.check_rows(&held_rows)?;
        Ok(imported)
    }

    /// All that the small model depends on, part by part, to be hashed: entries, nodes at the joint and at the points.
    pub fn each_part(&self, update: &mut dyn FnMut(&[u8])) {
        let both = [&self.stiffness, &self.inertia];
        for matrix in both.into_iter().chain(&self.damping) {
            update(&(matrix.len() as u64).to_le_bytes());
            for &(i, j, v) in matrix {
                update(&i.to_le_bytes());
                update(&j.to_le_bytes());
                update(&v.to_le_bytes());
            }
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
            nodes.iter().for_each(|node| each_row(update, *node));
        }
    }

    /// Every node that a port needs has three displacements.
    fn check_rows(&self, held: &HashSet<(i64, u32)>) -> Result<(), ImportError> {
        let of_joint = self.sides.iter().flat_map(|side| &side.nodes);
        let of_points = self.points.iter().flat_map(|point| &point.1);
        for &node in of_joint.chain(of_points) {
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

    /// Median stiffness of the nodes of the joint along its normal, each held alone, over the shorter side of a contact element \[Pa\]: near
    /// Young's modulus, whatever the mesh.
    pub fn apparent_modulus(&self) -> f64 {
        let mut diagonal = vec![0.0; self.rows];
        for &(i, j, value) in &self.stiffness {
            if i == j {
                diagonal[i as usize] = value;
            }
        }
        let normal = self.interface.axes[2];
        let of_node = |node: &i64| -> f64 {
            let rows = (0..3).map(|d| (normal[d], self.row_of.get(&(*node, d as u32 + 1))));
            rows.map(|(n, row)| row.map_or(0.0, |row| n * n * diagonal[*row]))
                .sum()
        };
        let mut each: Vec<f64> = self
            .sides
            .iter()
            .flat_map(|side| &side.nodes)
            .map(of_node)
            .collect();
        each.sort_by(f64::total_cmp);
        let sides = self.interface.array.sides();
        each[each.len() / 2] / sides[0].min(sides[1])
    }

    /// True where the files have a damping matrix.
    pub fn has_damping(&self) -> bool {
        self.damping.is_some()
    }

    /// The ports: three for each contact element along the axes of the joint, then three for each point along those of the model.
    ///
    /// # Errors
    /// [`InterfaceError`] for a contact element that has no nodes around it.
    pub fn ports(&self, at: ContactPorts) -> Result<Ports, InterfaceError> {
        let [lower, upper] = &self.sides;
        let above = self.interface.weights(upper, true, at)?;
        let below = match self.is_paired {
            true => above.clone(),
            false => self.interface.weights(lower, false, at)?,
        };
        let weights = [below, above];
        let contacts = weights[0].len();
        let mut combinations = Vec::with_capacity(3 * (contacts + self.points.len()));
        for element in 0..contacts {
            for axis in self.interface.axes {
                let mut port = Vec::new();
                for (side, sign) in [(0, -1.0), (1, 1.0)] {
                    for &(n, weight) in &weights[side][element] {
                        let node = self.sides[side].nodes[n];
                        for (d, along) in axis.into_iter().enumerate().filter(|a| a.1 != 0.0) {
                            port.push((self.row_of[&(node, d as u32 + 1)], sign * weight * along));
                        }
                    }
                }
                combinations.push(port);
            }
        }
        for (_, nodes) in &self.points {
            let share = 1.0 / nodes.len() as f64;
            for d in 0..3 {
                let rows = nodes
                    .iter()
                    .map(|node| (self.row_of[&(*node, d + 1)], share));
                combinations.push(rows.collect());
            }
        }
        Ok(Ports {
            combinations,
            contacts,
            points: self.points.iter().map(|point| point.0.clone()).collect(),
        })
    }

    /// The structure at its ports: its lowest `count` elastic modes, all that it has if it has fewer, and the residual of the others.
    ///
    /// # Errors
    /// [`ImportError`] for matrices that are those of no structure, and for modes that are not found.
    pub fn reduce(&self, count: usize, at: ContactPorts) -> Result<Reduced, ImportError> {
        let ports = self.ports(at)?;
        let rows = self.rows;
        let stiffness = SparseSymmetric::from_sorted(rows, &self.stiffness);
        let mass = SparseSymmetric::from_sorted(rows, &self.inertia);
        let lowest = spectrum(rows, &self.stiffness, &self.inertia, self.precision, LOWEST)?;
        if lowest.massless > 0 {
            return Err(ImportError::Massless {
                rows: lowest.massless,
                all: rows,
            });
        }
        if lowest.is_steadied {
            return Err(ImportError::Loose);
        }
        if let Some(square) = lowest.elastic().find(|square| *square < 0.0) {
            return Err(ImportError::Unstable(square));
        }
        let rigid = lowest.rigid();
        let Some(first) = lowest.elastic().next() else {
            return Err(StructureError::TooManyModes {
                wanted: count,
                available: 0,
            }
            .into());
        };
        let shift = shift_near(first, &stiffness, &mass);
        let mut last: Vec<usize> = ports.combinations.iter().flatten().map(|c| c.0).collect();
        last.sort_unstable();
        last.dedup();
        let order = order_with_last(rows, &self.stiffness, &self.inertia, &last)?;
        let factored = |shift: f64| {
            SparseCholesky::new(&stiffness.plus(shift, &mass), &order).map_err(|source| {
                StructureError::Factorization {
                    matrix: "the shifted stiffness",
                    source,
                }
            })
        };
        let factor = factored(shift)?;
        let massive = mass.diagonal().iter().filter(|v| **v > 0.0).count();
        let wanted = (rigid + count).min(massive);
        let (squares, shapes, residual) = if rows <= DENSE {
            let (squares, mut shapes) = dense(&mass, &stiffness.plus(shift, &mass), shift, wanted)?;
            for (mode, square) in squares.iter().enumerate() {
                // φᵀ(K + sM)φ = 1 there.
                let scale = (square + shift).sqrt();
                shapes.column_mut(mode).iter_mut().for_each(|v| *v *= scale);
            }
            (squares, shapes, 0.0)
        } else {
            let mut options = ModeOptions::new(wanted);
            options.block = BODY;
            let none = Matrix::zeros(rows, 0);
            let modes = lowest_of(&mass, &factor, shift, &none, &options, true)?;
            let squares = modes.omega.iter().map(|omega| omega * omega).collect();
            let residual = modes.residuals.iter().copied().fold(0.0, f64::max);
            (squares, modes.shapes, residual)
        };
        let elastic = squares.len().saturating_sub(rigid);
        if elastic == 0 {
            return Err(StructureError::TooManyModes {
                wanted: count,
                available: 0,
            }
            .into());
        }
        let kept = shapes.columns_of(0..rigid + elastic);
        let damping = self.damping.as_ref().map(|damping| {
            let damping = SparseSymmetric::from_sorted(rows, damping);
            kept.transpose_times(&damping.times(&kept))
        });
        let modes = ModesAtPorts {
            rigid_squares: rayleigh(&stiffness, &shapes.columns_of(0..rigid)),
            rigid: ports.displacements(&shapes.columns_of(0..rigid)),
            omega: squares[rigid..]
                .iter()
                .map(|square| square.max(0.0).sqrt())
                .collect(),
            shapes: ports.displacements(&shapes.columns_of(rigid..rigid + elastic)),
            residual,
        };
        let reduced = complete(
            ports,
            modes,
            self.mass,
            (factor, shift, last.len()),
            factored,
        )?;
        Ok(Reduced { damping, ..reduced })
    }
}

fn nodes_told(nodes: usize) -> String {
    match nodes {
        0 => String::new(),
        nodes => format!(", and they are neither three nor six for each of the {nodes} nodes"),
    }
}

/// What rows are where nodes are in their order: x, y, z of each, and rotations about them where there are six.
fn in_order(rows: usize, order: &[i64]) -> Result<Vec<Dof>, ImportError> {
    let nodes = order.len();
    let each = [3, 6]
        .into_iter()
        .find(|each| nodes > 0 && rows == each * nodes);
    let each = each.ok_or(ImportError::NoDofs { rows, nodes })?;
    let of_node = |&node: &i64| (1..=each as u32).map(move |direction| Dof { node, direction });
    Ok(order.iter().flat_map(of_node).collect())
}

fn required(matrices: &Matrices, role: Role) -> Result<&Triplets, ImportError> {
    matrices.get(role).ok_or(ImportError::Missing(role))
}

/// The matrices with what their rows are, for the words by which rows are held.
fn dofs_known<'a>(
    matrices: &'a Matrices,
    dofs: &[Dof],
    known: &'a mut Option<Matrices>,
) -> &'a Matrices {
    match matrices.dofs {
        Some(_) => matrices,
        None => known.insert(Matrices {
            dofs: Some(dofs.to_vec()),
            ..matrices.clone()
        }),
    }
}

/// The number of each row that takes part, and how many do: those held and those without any entry do not.
fn places(
    matrices: &Matrices,
    both: [&Triplets; 2],
    is_held: &[bool],
) -> (Vec<Option<u32>>, usize) {
    let mut has_entry = vec![false; matrices.size];
    for &(i, j, v) in both.into_iter().flat_map(|matrix| &matrix.entries) {
        if v != 0.0 {
            has_entry[i as usize] = true;
            has_entry[j as usize] = true;
        }
    }
    let mut rows = 0;
    let place = (0..matrices.size).map(|row| {
        (has_entry[row] && !is_held[row]).then(|| {
            rows += 1;
            rows as u32 - 1
        })
    });
    let place = place.collect();
    (place, rows)
}

/// Takes rows that no stiffness joins to any mass for held: they move with nothing. How many there are.
fn leave_out_massless(
    matrices: &Matrices,
    [stiffness, mass]: [&Triplets; 2],
    is_held: &mut [bool],
) -> usize {
    let (place, rows) = places(matrices, [stiffness, mass], is_held);
    let (k, m) = (stiffness.lower(&place), mass.lower(&place));
    let (body, bodies) = bodies(rows, &k, &m);
    let mut has_mass = vec![false; bodies];
    for &(i, _, value) in &m {
        has_mass[body[i as usize] as usize] |= value != 0.0;
    }
    // A structure without any mass has an error of its own.
    if !has_mass.contains(&true) {
        return 0;
    }
    let mut left_out = 0;
    for (row, place) in place.iter().enumerate() {
        if place.is_some_and(|place| !has_mass[body[place as usize] as usize]) {
            is_held[row] = true;
            left_out += 1;
        }
    }
    left_out
}

type Position<'a> = dyn Fn(i64) -> Result<[f64; 3], ImportError> + 'a;

/// Pairs of nodes face each other.
fn check_pairs(interface: &Interface, lower: &Side, upper: &Side) -> Result<(), ImportError> {
    let sides = interface.array.sides();
    let side = sides[0].min(sides[1]);
    let both = lower.positions.iter().zip(&upper.positions);
    for (k, (below, above)) in both.enumerate() {
        let apart = [0, 1, 2].map(|d| above[d] - below[d]);
        let along = [0, 1].map(|axis| {
            let direction = interface.axes[axis];
            (0..3).map(|d| apart[d] * direction[d]).sum::<f64>()
        });
        let off = along[0].hypot(along[1]);
        if off > ASKEW * side {
            return Err(ImportError::Askew {
                upper: upper.nodes[k],
                lower: lower.nodes[k],
                off: off * 1e3,
                side: side * 1e3,
            });
        }
    }
    Ok(())
}

/// Nodes of both bodies at the joint, the lower one first.
fn sides(
    matrices: &Matrices,
    facing: &Facing,
    unit: UnitSystem,
    positions: &Position<'_>,
) -> Result<[Side; 2], ImportError> {
    let mut both = [Side::default(), Side::default()];
    match facing {
        Facing::Pairs(pairs) => {
            for &(upper, lower, area) in pairs {
                both[0].nodes.push(lower);
                both[1].nodes.push(upper);
                for side in &mut both {
                    side.areas
                        .extend(area.map(|area| area * unit.length * unit.length));
                }
            }
        }
        Facing::Sets { upper, lower } => {
            let of = |key, name: &String| {
                let set = matrices.sets.get(&name.to_ascii_uppercase());
                let mut set = set.cloned().ok_or_else(|| no_set(matrices, key, name))?;
                set.sort_unstable();
                set.dedup();
                Ok::<_, ImportError>(set)
            };
            both[0].nodes = of("structure.interface.lower", lower)?;
            both[1].nodes = of("structure.interface.upper", upper)?;
        }
    }
    let mut seen = HashMap::new();
    for (k, side) in both.iter_mut().enumerate() {
        for &node in &side.nodes {
            match seen.insert(node, k) {
                Some(other) if other == k => return Err(ImportError::Twice { node }),
                Some(_) => return Err(ImportError::Both { node }),
                None => (),
            }
        }
        side.positions = side
            .nodes
            .iter()
            .map(|node| positions(*node))
            .collect::<Result<_, _>>()?;
    }
    Ok(both)
}

fn no_set(matrices: &Matrices, key: &'static str, name: &str) -> ImportError {
    let mut known: Vec<&str> = matrices.sets.keys().map(String::as_str).collect();
    known.sort_unstable();
    ImportError::NoSet {
        key,
        name: name.to_owned(),
        known: match known.is_empty() {
            true => "none".to_owned(),
            false => known.join(", "),
        },
    }
}

/// The nodes of a point: numbers of nodes and names of sets, with commas between.
fn point(matrices: &Matrices, name: &str) -> Result<(String, Vec<i64>), ImportError> {
    let mut nodes = Vec::new();
    for item in name.split(',').map(str::trim) {
        match (item.parse(), matrices.sets.get(&item.to_ascii_uppercase())) {
            (_, Some(set)) => nodes.extend(set),
            (Ok(node), None) => nodes.push(node),
            (Err(_), None) => return Err(no_set(matrices, "dynamics", item)),
        }
    }
    nodes.sort_unstable();
    nodes.dedup();
    Ok((name.to_owned(), nodes))
}

/// Which nodes the stiffness joins.
struct Neighbours {
    starts: Vec<usize>,
    rows: Vec<u32>,
    node_of: Vec<i64>,
}

impl Neighbours {
    fn of(rows: usize, stiffness: &Lower, dofs: &[Dof], place: &[Option<u32>]) -> Neighbours {
        let mut starts = vec![0; rows + 1];
        for &(i, j, _) in stiffness {
            starts[i as usize + 1] += 1;
            starts[j as usize + 1] += 1;
        }
        for row in 0..rows {
            starts[row + 1] += starts[row];
        }
        let mut next = starts.clone();
        let mut joined = vec![0; starts[rows]];
        for &(i, j, _) in stiffness {
            for (a, b) in [(i, j), (j, i)] {
                joined[next[a as usize]] = b;
                next[a as usize] += 1;
            }
        }
        let mut node_of = vec![0; rows];
        for (row, place) in place.iter().enumerate() {
            if let Some(place) = place {
                node_of[*place as usize] = dofs[row].node;
            }
        }
        Neighbours {
            starts,
            rows: joined,
            node_of,
        }
    }

    /// A side of the joint with the other nodes of its body, those whose position is known.
    fn added(
        &self,
        mut side: Side,
        joint: &HashSet<i64>,
        row_of: &HashMap<(i64, u32), usize>,
        positions: &Position<'_>,
    ) -> Side {
        let mut found: Vec<i64> = Vec::new();
        for &node in &side.nodes {
            let rows = (1..=3).filter_map(|direction| row_of.get(&(node, direction)));
            for &row in rows {
                let joined = &self.rows[self.starts[row]..self.starts[row + 1]];
                found.extend(joined.iter().map(|row| self.node_of[*row as usize]));
            }
        }
        found.sort_unstable();
        found.dedup();
        let others = found.into_iter().filter(|node| !joint.contains(node));
        side.neighbours = others.filter_map(|node| positions(node).ok()).collect();
        side
    }
}

/// φᵀKφ of columns φ, whose mass is one.
fn rayleigh(stiffness: &SparseSymmetric, shapes: &Matrix) -> Vec<f64> {
    let energies = shapes.transpose_times(&stiffness.times(shapes));
    (0..shapes.columns()).map(|r| energies[(r, r)]).collect()
}

/// The shift of a mesh without rows that have no mass, where it is near the lowest elastic ω², so that the same structure has the same one
/// whichever way it came; else that ω² itself.
fn shift_near(first: f64, stiffness: &SparseSymmetric, mass: &SparseSymmetric) -> f64 {
    let usual = shift_of(&stiffness.diagonal(), &mass.diagonal());
    match usual >= USUAL[0] * first && usual <= USUAL[1] * first {
        true => usual,
        false => first,
    }
}

/// An order of elimination that keeps little fill, the rows `last` at its end: those of the ports, whose flexibility is then a dense block.
fn order_with_last(
    rows: usize,
    stiffness: &Lower,
    mass: &Lower,
    last: &[usize],
) -> Result<Vec<usize>, StructureError> {
    let mut place = vec![Some(0_u32); rows];
    for &row in last {
        place[row] = None;
    }
    let mut others = Vec::with_capacity(rows - last.len());
    for (row, place) in place.iter_mut().enumerate() {
        if let Some(place) = place {
            *place = others.len() as u32;
            others.push(row);
        }
    }
    let mut entries: Vec<(u32, u32, f64)> = (stiffness.iter().chain(mass))
        .filter_map(|&(i, j, v)| Some((place[i as usize]?, place[j as usize]?, v.abs())))
        .collect();
    entries.sort_by_key(|e| (e.0, e.1));
    entries.dedup_by_key(|e| (e.0, e.1));
    let inner = SparseSymmetric::from_sorted(others.len(), &entries);
    let order = minimum_degree(&inner).map_err(|source| StructureError::Factorization {
        matrix: "the stiffness",
        source,
    })?;
    Ok(order
        .into_iter()
        .map(|row| others[row])
        .chain(last.iter().copied())
        .collect())
}
