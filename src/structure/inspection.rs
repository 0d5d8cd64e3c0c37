//! Checks of imported matrices. The checks cover masses, massless rows, modal coordinates, rows that the user fixes,
//! and likely units. All numbers are in the units of the files.

use std::collections::{BTreeMap, HashMap, HashSet};

use crate::structure::matrices::{Dof, Matrices, Role, Triplets};
use crate::structure::readers::{CALCULIX_LIST, DECK};

/// A diagonal below `ZERO` times the largest diagonal of translations, or of rotations, counts as zero.
const ZERO: f64 = 1e-14;
/// Tolerance of unit modal masses and of the orthogonality of modes.
const MODAL: f64 = 1e-6;
/// Smallest sum of the mass entries over the diagonal of the mass. Solids have 0.5 to 2.5, and a stiffness almost
/// zero.
const MOVED: f64 = 1e-2;

/// A body is free if its resistance to a translation is less than `FREE_STRAIN` times its stiffness.
const FREE_STRAIN: f64 = 1e-6;
/// A free body gives a warning if its resistance to a rotation exceeds two limits. The limits are `ROTATION_RESISTANCE`
/// times the stiffness, and [`ROTATION_RATIO`] times the resistance to translations.
const ROTATION_RESISTANCE: f64 = 1e-7;
/// Factor above the resistance to translations, which is rounding, for a warning.
const ROTATION_RATIO: f64 = 1e3;

/// Error in the rows that the user fixes.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FixedError {
    /// The text is neither a set nor a node.
    #[error(
        "{text} is neither a node (12, 12-20, 12.123), a row (row:5), nor one of the sets of nodes: {known}"
    )]
    Unknown {
        /// Text of the user.
        text: String,
        /// Names of the sets.
        known: String,
    },
    /// The direction does not exist.
    #[error(
        "{text}: direction {direction} does not exist; displacements are 1 to 3, rotations 4 to 6"
    )]
    NoSuchDirection {
        /// Text of the user.
        text: String,
        /// The direction.
        direction: u32,
    },
    /// The node has no row.
    #[error(
        "node {node} has no freedom {direction}in the matrices; the matrices have nodes {nodes}"
    )]
    NoSuchNode {
        /// Number of the node.
        node: i64,
        /// The directions, each followed by a blank. The string is empty if the text names no direction.
        direction: String,
        /// First and last node of the matrices.
        nodes: String,
    },
    /// The row does not exist.
    #[error("row {row} does not exist; the matrices have rows 1 to {size}")]
    NoSuchRow {
        /// Number of the row, from 1.
        row: usize,
        /// Number of rows.
        size: usize,
    },
    /// No modal coordinates remain if the boundary is fixed.
    #[error(
        "boundary fixes all rows but modal coordinates, and the matrices have none; name nodes or a set"
    )]
    NoModes,
    /// No file assigns the rows to nodes.
    #[error(
        "{text} names nodes, but no file says which node a row belongs to; name rows, for example row:1-6"
    )]
    NoNodes {
        /// Text of the user.
        text: String,
    },
}

/// Returns for each row whether the user fixes it, and notes for the user.
///
/// `text` is a list with commas. An item that selects nodes is `SET`, `NODE` or `FIRST-LAST`. `.DIRECTIONS` or
/// `:DIRECTIONS` can follow such an item, for example `12.123` or `CLAMP:3`. An item that selects rows is `row:K` or
/// `row:K-L`, and rows count from 1. The item `boundary` selects every row that is not modal.
///
/// # Errors
/// [`FixedError`] for a set, node, direction or row that does not exist. If the nodes of a set have no rows, the
/// function returns a note. The finite-element program has then removed the rows of the nodes.
pub fn parse_fixed_rows(
    matrices: &Matrices,
    text: &str,
) -> Result<(Vec<bool>, Vec<String>), FixedError> {
    let mut is_fixed = vec![false; matrices.size];
    let mut notes = Vec::new();
    for item in text
        .split(',')
        .map(str::trim)
        .filter(|item| !item.is_empty())
    {
        if let Some(range) = item.strip_prefix("row:") {
            let rows = range_of(range)
                .filter(|r| r.0 >= 1)
                .ok_or_else(|| unknown(matrices, item))?;
            if rows.1 as usize > matrices.size {
                return Err(FixedError::NoSuchRow {
                    row: rows.1 as usize,
                    size: matrices.size,
                });
            }
            is_fixed[rows.0 as usize - 1..rows.1 as usize].fill(true);
            continue;
        }
        if item.eq_ignore_ascii_case("boundary") && !matrices.sets.contains_key("BOUNDARY") {
            let modal = modal_rows(matrices);
            // Without modal coordinates no row would remain.
            if !modal.contains(&true) {
                return Err(FixedError::NoModes);
            }
            for (is_row_fixed, is_modal) in is_fixed.iter_mut().zip(&modal) {
                *is_row_fixed |= !is_modal;
            }
            continue;
        }
        let Some(dofs) = &matrices.dofs else {
            return Err(FixedError::NoNodes {
                text: item.to_owned(),
            });
        };
        let (name, directions) =
            name_and_directions(matrices, item).ok_or_else(|| unknown(matrices, item))?;
        let set = matrices.sets.get(&name.to_ascii_uppercase());
        let range = if set.is_some() { None } else { range_of(name) };
        let nodes: HashSet<i64> = match (set, range) {
            (Some(set), _) => set.iter().copied().collect(),
            // A range may have gaps. A single node without a row is an error below.
            (None, Some((first, last))) => (dofs.iter().map(|dof| dof.node))
                .filter(|node| (first..=last).contains(node))
                .collect(),
            (None, None) => return Err(unknown(matrices, item)),
        };
        let mut count = 0;
        for (row, dof) in dofs.iter().enumerate() {
            if nodes.contains(&dof.node)
                && (directions.is_empty() || directions.contains(&dof.direction))
            {
                is_fixed[row] = true;
                count += 1;
            }
        }
        if let Some(direction) = directions.iter().find(|d| !(1..=6).contains(*d)) {
            return Err(FixedError::NoSuchDirection {
                text: item.to_owned(),
                direction: *direction,
            });
        }
        if count == 0 && set.is_some() {
            notes.push(format!(
                "no node of the set {name} has such freedoms in the matrices: the program has removed them already"
            ));
        } else if count == 0 {
            let node = range.map_or(0, |range| range.0);
            let node_numbers = || dofs.iter().map(|dof| dof.node);
            let (first, last) = (
                node_numbers().min().unwrap_or(0),
                node_numbers().max().unwrap_or(0),
            );
            return Err(FixedError::NoSuchNode {
                node,
                direction: directions.iter().map(|d| format!("{d} ")).collect(),
                nodes: format!("{first} to {last}"),
            });
        }
    }
    Ok((is_fixed, notes))
}

fn unknown(matrices: &Matrices, item: &str) -> FixedError {
    FixedError::Unknown {
        text: item.to_owned(),
        known: matrices.set_names("there are none"),
    }
}

/// Splits an item into a node or set and its directions. The directions may be empty.
fn name_and_directions<'a>(matrices: &Matrices, item: &'a str) -> Option<(&'a str, Vec<u32>)> {
    if matrices.sets.contains_key(&item.to_ascii_uppercase()) {
        return Some((item, Vec::new()));
    }
    let Some((name, digits)) = item.rsplit_once([':', '.']) else {
        return Some((item, Vec::new()));
    };
    let directions: Option<Vec<u32>> = digits.chars().map(|c| c.to_digit(10)).collect();
    directions
        .filter(|d| !d.is_empty())
        .map(|directions| (name, directions))
}

/// Parses `12`, `-12` or `12-20`.
fn range_of(text: &str) -> Option<(i64, i64)> {
    let text = text.trim();
    let dash = text
        .char_indices()
        .skip(1)
        .find(|c| c.1 == '-')
        .map(|c| c.0);
    let (first, last) = match dash {
        Some(at) => (&text[..at], &text[at + 1..]),
        None => (text, text),
    };
    let range = (first.trim().parse().ok()?, last.trim().parse().ok()?);
    (range.0 <= range.1).then_some(range)
}

/// Returns the inner nodes of solids (C3D8I), which do not move with the body as a whole.
///
/// In CalculiX's list, inner nodes have higher numbers than all nodes of the deck. With other formats a node without a
/// position is no inner node.
fn inner_nodes(matrices: &Matrices) -> HashSet<i64> {
    if ![DECK, CALCULIX_LIST]
        .iter()
        .all(|format| matrices.formats.contains(format))
    {
        return HashSet::new();
    }
    let nodes: HashSet<i64> = matrices.dofs.iter().flatten().map(|dof| dof.node).collect();
    let (located, inner): (HashSet<i64>, HashSet<i64>) =
        (nodes.into_iter()).partition(|node| matrices.positions.contains_key(node));
    let last = located.iter().copied().max();
    let is_above = |node: &i64| last.is_some_and(|last| *node > last);
    match inner.iter().all(is_above) {
        true => inner,
        false => HashSet::new(),
    }
}

/// Returns a note for the user if the matrices have inner nodes.
pub fn inner_nodes_note(matrices: &Matrices) -> Option<String> {
    let inner = inner_nodes(matrices);
    let first = inner.iter().min()?;
    Some(format!(
        "{} nodes of the matrices, the first {first}, are not in the deck: they are treated as inner freedoms of solids",
        inner.len(),
    ))
}

/// Returns warnings about matrices that probably do not define a valid structure. The function warns about nodes with
/// stiffness but no mass, and about nodes with mass but no stiffness. The function also warns about bodies that resist
/// a rigid rotation, and about a mass that hardly resists a translation.
pub fn model_warnings(matrices: &Matrices) -> Vec<String> {
    let mut warnings = Vec::new();
    let (Some(dofs), Some(stiffness), Some(mass)) =
        (&matrices.dofs, &matrices.stiffness, &matrices.mass)
    else {
        return warnings;
    };
    let inner = inner_nodes(matrices);
    let (k, m) = (stiffness.diagonal(), mass.diagonal());
    let is_displacement =
        |row: &usize| dofs[*row].is_translation() && !inner.contains(&dofs[*row].node);
    let nodes_with = |diagonal: &[f64]| -> HashSet<i64> {
        let rows = (0..dofs.len()).filter(is_displacement);
        rows.filter(|row| diagonal[*row] != 0.0)
            .map(|row| dofs[row].node)
            .collect()
    };
    let (stiff, heavy) = (nodes_with(&k), nodes_with(&m));
    for (with, without, what, then) in [
        (
            &stiff,
            &heavy,
            "stiffness and no mass",
            "the mass may have been cut, or be that of another mesh",
        ),
        (
            &heavy,
            &stiff,
            "mass and no stiffness",
            "both matrices may be of different meshes",
        ),
    ] {
        let unmatched: Vec<i64> = with.difference(without).copied().collect();
        if !unmatched.is_empty() && unmatched.len() < with.len() {
            warnings.push(format!(
                "{} of {} nodes have {what}, the first {}: {then}",
                unmatched.len(),
                stiff.union(&heavy).count(),
                unmatched.iter().min().unwrap_or(&0)
            ));
        }
    }
    warnings.extend(rotation_warning(matrices));
    let trace: f64 = (0..dofs.len())
        .filter(is_displacement)
        .map(|row| m[row])
        .sum();
    let total: f64 = mass_by_direction(matrices)
        .into_iter()
        .flatten()
        .map(f64::abs)
        .sum();
    if trace > 0.0 && total < MOVED * trace {
        warnings.push(format!(
            "the mass of a rigid translation is only {:.1e} of the diagonal, as in a stiffness matrix: stiffness and mass may be exchanged",
            total / trace
        ));
    }
    warnings
}

/// Returns the sum of the mass between displacements along each axis. The sum along an axis is `None` if the matrices
/// have no row along the axis. The sum is also `None` if no file lists the directions of the rows.
pub fn mass_by_direction(matrices: &Matrices) -> [Option<f64>; 3] {
    let (Some(dofs), Some(mass)) = (&matrices.dofs, &matrices.mass) else {
        return [None; 3];
    };
    let inner = inner_nodes(matrices);
    [1, 2, 3].map(|direction| {
        let is = |row: usize| dofs[row].direction == direction && !inner.contains(&dofs[row].node);
        dofs.iter()
            .any(|dof| dof.direction == direction)
            .then(|| mass.sum_between(is))
    })
}

/// Body: nodes that the matrices connect to each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Number of nodes.
    pub nodes: usize,
    /// Mass of the body in the unit of the files. `None` without a mass matrix.
    pub mass: Option<f64>,
    /// Centre of mass of the body. `None` unless the positions of all of its nodes are known.
    pub centre: Option<[f64; 3]>,
}

/// Returns the nodes in ascending order, and a number of its body for each node.
fn bodies_of_nodes(matrices: &Matrices, dofs: &[Dof]) -> (Vec<i64>, Vec<usize>) {
    let mut nodes: Vec<i64> = dofs.iter().map(|dof| dof.node).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let place = |row: u32| nodes.partition_point(|node| *node < dofs[row as usize].node);
    let mut parents: Vec<usize> = (0..nodes.len()).collect();
    let root = |parents: &mut Vec<usize>, mut k: usize| {
        while parents[k] != k {
            parents[k] = parents[parents[k]];
            k = parents[k];
        }
        k
    };
    for role in [Role::Stiffness, Role::Mass] {
        for &(i, j, value) in matrices.get(role).iter().flat_map(|matrix| &matrix.entries) {
            if value != 0.0 {
                let (a, b) = (root(&mut parents, place(i)), root(&mut parents, place(j)));
                parents[a.max(b)] = a.min(b);
            }
        }
    }
    let body_of_node = (0..nodes.len()).map(|k| root(&mut parents, k)).collect();
    (nodes, body_of_node)
}

/// Returns a warning if a free body resists a rotation. If a free body resists a rotation, the rows or the positions of
/// its nodes do not match the stiffness.
fn rotation_warning(matrices: &Matrices) -> Option<String> {
    let (dofs, stiffness) = (matrices.dofs.as_ref()?, matrices.stiffness.as_ref()?);
    let (nodes, body_of_node) = bodies_of_nodes(matrices, dofs);
    let body = |row: usize| body_of_node[nodes.partition_point(|node| *node < dofs[row].node)];
    let mut centres: HashMap<usize, ([f64; 3], f64)> = HashMap::new();
    let mut unknown_bodies: HashSet<usize> = HashSet::new();
    for (node, body_number) in nodes.iter().zip(&body_of_node) {
        match matrices.positions.get(node) {
            Some(at) => {
                let (sum, count) = centres.entry(*body_number).or_default();
                (0..3).for_each(|axis| sum[axis] += at[axis]);
                *count += 1.0;
            }
            None => {
                unknown_bodies.insert(*body_number);
            }
        }
    }
    for row in 0..dofs.len() {
        if !dofs[row].is_translation() && !dofs[row].is_rotation() {
            unknown_bodies.insert(body(row));
        }
    }
    // Displacement of a row in each of three translations and three rotations.
    let motion = |row: usize| -> [f64; 6] {
        let mut displacements = [0.0; 6];
        if unknown_bodies.contains(&body(row)) {
            return displacements;
        }
        let dof = dofs[row];
        let (sum, count) = centres[&body(row)];
        let at = matrices.positions[&dof.node];
        let [x, y, z] = [0, 1, 2].map(|axis| at[axis] - sum[axis] / count);
        let arms = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
        match dof.direction {
            d @ 1..=3 => {
                displacements[d as usize - 1] = 1.0;
                (0..3).for_each(|turn| displacements[3 + turn] = arms[turn][d as usize - 1]);
            }
            d @ 4..=6 => displacements[d as usize - 1] = 1.0,
            _ => {}
        }
        displacements
    };
    let motions: Vec<[f64; 6]> = (0..dofs.len()).map(motion).collect();
    let mut energies: BTreeMap<usize, [[f64; 2]; 6]> = BTreeMap::new();
    for &(i, j, value) in &stiffness.entries {
        let body_number = body(i as usize);
        if unknown_bodies.contains(&body_number) {
            continue;
        }
        let multiplicity = if stiffness.is_triangle && i != j {
            2.0
        } else {
            1.0
        };
        let [a, b] = [i, j].map(|row| motions[row as usize]);
        let energies = energies.entry(body_number).or_default();
        for k in 0..6 {
            let work = multiplicity * value * a[k] * b[k];
            energies[k][0] += work;
            energies[k][1] += work.abs();
        }
    }
    let share = |[work, size]: [f64; 2]| if size > 0.0 { work.abs() / size } else { 0.0 };
    let bodies = energies.values().map(|energies| energies.map(share));
    let worst = bodies.filter_map(|[x, y, z, turns @ ..]| {
        let strain = x.max(y).max(z);
        let turned = turns.into_iter().fold(0.0, f64::max);
        (strain < FREE_STRAIN && turned > ROTATION_RESISTANCE.max(ROTATION_RATIO * strain))
            .then_some(turned)
    });
    let worst = worst.max_by(f64::total_cmp)?;
    Some(format!(
        "a body that moves freely resists a rotation by {worst:.1e} of its stiffness: its rows, the positions of its nodes or their axes do not match the stiffness matrix"
    ))
}

/// Returns the bodies, the heaviest first. The mass is the mass along the direction with the largest total. Returns
/// no bodies if no file says what the rows are.
pub fn bodies(matrices: &Matrices) -> Vec<Body> {
    let Some(dofs) = &matrices.dofs else {
        return Vec::new();
    };
    let (nodes, body_of_node) = bodies_of_nodes(matrices, dofs);
    let place = |row: u32| nodes.partition_point(|node| *node < dofs[row as usize].node);
    let mass_along = mass_by_direction(matrices);
    let heaviest_axis = (0..3).max_by(|a, b| {
        let mass_of = |d: &usize| mass_along[*d].unwrap_or(0.0);
        mass_of(a).total_cmp(&mass_of(b))
    });
    let direction = heaviest_axis.map_or(1, |d| d as u32 + 1);
    let mut sums: BTreeMap<usize, (usize, f64, Option<[f64; 3]>)> = BTreeMap::new();
    for (k, node) in nodes.iter().enumerate() {
        let body_sums = sums
            .entry(body_of_node[k])
            .or_insert((0, 0.0, Some([0.0; 3])));
        body_sums.0 += 1;
        if !matrices.positions.contains_key(node) {
            body_sums.2 = None;
        }
    }
    if let Some(matrix) = &matrices.mass {
        for &(i, j, value) in &matrix.entries {
            let is_along = |row: u32| dofs[row as usize].direction == direction;
            if !is_along(i) || !is_along(j) {
                continue;
            }
            let ends = if matrix.is_triangle && i != j {
                &[i, j][..]
            } else {
                &[i]
            };
            for &row in ends {
                let body_sums = sums.get_mut(&body_of_node[place(row)]).expect("a body");
                body_sums.1 += value;
                if let (Some(sum), Some(at)) = (
                    &mut body_sums.2,
                    matrices.positions.get(&dofs[row as usize].node),
                ) {
                    (0..3).for_each(|d| sum[d] += value * at[d]);
                }
            }
        }
    }
    let mut bodies: Vec<Body> = sums
        .into_values()
        .map(|(nodes, mass, sum)| Body {
            nodes,
            mass: matrices.mass.is_some().then_some(mass),
            centre: sum.filter(|_| mass > 0.0).map(|sum| sum.map(|s| s / mass)),
        })
        .collect();
    bodies.sort_by(|a, b| {
        b.mass
            .partial_cmp(&a.mass)
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    bodies
}

/// Returns the rows whose diagonal is zero compared with the largest of the same kind: displacements, rotations,
/// scalars.
pub fn zero_diagonals(matrices: &Matrices, matrix: &Triplets) -> Vec<usize> {
    let diagonal = matrix.diagonal();
    let kind = |row: usize| match matrices.dofs.as_ref().map(|dofs| dofs[row]) {
        Some(dof) if dof.is_translation() => 1,
        Some(dof) if dof.is_rotation() => 2,
        Some(_) => 3,
        None => 0,
    };
    let mut largest = [0.0_f64; 4];
    for (row, value) in diagonal.iter().enumerate() {
        largest[kind(row)] = largest[kind(row)].max(value.abs());
    }
    (0..diagonal.len())
        .filter(|&row| diagonal[row].abs() <= ZERO * largest[kind(row)])
        .collect()
}

/// Returns a value for each row of the matrices: true if the row is a modal coordinate.
///
/// If the files describe the rows, modal coordinates are the scalars. If no file describes the rows, modal coordinates
/// are the last rows with unit masses and no coupling between these rows.
pub fn modal_rows(matrices: &Matrices) -> Vec<bool> {
    if let Some(dofs) = &matrices.dofs {
        return dofs.iter().map(|dof| dof.direction == 0).collect();
    }
    let mut is_modal = vec![false; matrices.size];
    let (Some(stiffness), Some(mass)) = (&matrices.stiffness, &matrices.mass) else {
        return is_modal;
    };
    let (k, m) = (stiffness.diagonal(), mass.diagonal());
    // First modal row: all rows from it on have unit mass, and no two of them are coupled.
    let mut first = matrices.size;
    while first > 0 && (m[first - 1] - 1.0).abs() < MODAL && k[first - 1] >= 0.0 {
        first -= 1;
    }
    let mut coupled: Vec<usize> = Vec::new();
    for (matrix, diagonal) in [(stiffness, &k), (mass, &m)] {
        for &(i, j, v) in matrix.entries.iter().filter(|e| e.0 != e.1) {
            let (i, j) = (i as usize, j as usize);
            if i.min(j) >= first && v.abs() > MODAL * (diagonal[i] * diagonal[j]).abs().sqrt() {
                coupled.push(i.min(j) + 1);
            }
        }
    }
    first = coupled.into_iter().max().unwrap_or(first).max(first);
    // If all rows qualify, the structure is a set of oscillators without modal coordinates.
    if first > 0 && first < matrices.size {
        is_modal[first..].fill(true);
    }
    is_modal
}

/// Likely system of units.
#[derive(Debug, Clone, PartialEq)]
pub struct Units {
    /// The likely system of units, or a statement that no system fits.
    pub likely: &'static str,
    /// Evidence for the likely system of units.
    pub why: String,
}

/// Ranges of the estimated wave speed in metals, polymers and composites \[m/s\].
///
/// From the distance of nodes, bars give 1.7 times the speed and hexahedra 2.5 times. Rotations are less accurate.
/// Between the ranges of metres and of millimetres are metals with kilogrammes, newtons and millimetres: 1.6e5 to
/// 4e5.
const BY_DISTANCE: [f64; 2] = [1.2e3, 3e4];
const BY_ROTATION: [f64; 2] = [3e2, 5e4];
/// A total mass below `LIGHT` is more likely in tonnes than in kilogrammes.
const LIGHT: f64 = 1e-2;

/// Estimates the units of the matrices from the wave speed.
///
/// For one element of a rod, the wave speed is √(K/M) times the length of the element. The wave speed is about 5 000
/// m/s in steel and differs little between solids. The value of the wave speed therefore shows whether lengths are in
/// metres or in millimetres.
pub fn units(matrices: &Matrices) -> Option<Units> {
    let total = mass_by_direction(matrices)
        .into_iter()
        .flatten()
        .fold(0.0, f64::max);
    if let Some((speed, [least, most], how)) = wave_speed(matrices) {
        // A wave speed below all ranges comes from bending on a coarse mesh. A wave speed below all ranges does not
        // indicate the units.
        let guess = match speed {
            v if (least..=most).contains(&v) => Some((
                "m, kg, s (N, Pa)",
                "the length is in metres, and mass and force are consistent",
            )),
            v if (1e3 * least..=1e3 * most).contains(&v) => Some((
                "mm, t, s (N, MPa)",
                "the length is in millimetres, and mass and force are consistent (tonnes and newtons)",
            )),
            v if (most..1e3 * least).contains(&v) => Some((
                "none that fit each other",
                "with N and mm the mass must be in t, with N and m in kg (kg with N and mm makes frequencies 31.6 times too low); inches and pounds give 2e5",
            )),
            _ => None,
        };
        if let Some((likely, then)) = guess {
            return Some(Units {
                likely,
                why: format!(
                    "{how} gives a wave speed of {speed:.2e} lengths per second, and solids have some 5e3 m/s or 5e6 mm/s: {then}"
                ),
            });
        }
    }
    if total > 0.0 && total < LIGHT {
        return Some(Units {
            likely: "mm, t, s (N, MPa)",
            why: format!(
                "the mass is {total:.3e}: as tonnes a part of {:.3e} kg, as kilogrammes one of {:.3e} g",
                1e3 * total,
                1e3 * total
            ),
        });
    }
    None
}

/// Returns the estimated wave speed, the range of wave speeds in solids in m/s, and a description of the estimate. The
/// length of the estimate is the distance of neighbouring nodes, or √(K/K) of rotations and displacements.
fn wave_speed(matrices: &Matrices) -> Option<(f64, [f64; 2], String)> {
    let (dofs, stiffness, mass) = (
        matrices.dofs.as_ref()?,
        matrices.stiffness.as_ref()?,
        matrices.mass.as_ref()?,
    );
    if dofs.iter().any(|dof| dof.direction == 0) {
        // The boundary nodes of a superelement are not neighbours: the whole structure is between them.
        return None;
    }
    let (k, m) = (stiffness.diagonal(), mass.diagonal());
    let median_of = |is: fn(&Dof) -> bool, value: fn(f64, f64) -> f64| {
        let rows = (0..dofs.len()).filter(|&row| is(&dofs[row]) && k[row] > 0.0 && m[row] > 0.0);
        median(rows.map(|row| value(k[row], m[row])).collect())
    };
    let rate = median_of(Dof::is_translation, |k, m| (k / m).sqrt())?;
    if let Some(length) = spacing(matrices, dofs) {
        return Some((
            rate * length,
            BY_DISTANCE,
            format!("a distance of neighbouring nodes of {length:.3e} with √(K/M) of {rate:.2e}"),
        ));
    }
    let rotational = median_of(Dof::is_rotation, |k, _| k)?;
    let translational = median_of(Dof::is_translation, |k, _| k)?;
    let length = (rotational / translational).sqrt();
    Some((
        rate * length,
        BY_ROTATION,
        format!(
            "a length of {length:.3e} from rotational over translational stiffness with √(K/M) of {rate:.2e}"
        ),
    ))
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    values.sort_by(f64::total_cmp);
    Some(values[values.len() / 2])
}

/// Returns the median distance of a node to its nearest neighbour, from a sample of the nodes.
fn spacing(matrices: &Matrices, dofs: &[Dof]) -> Option<f64> {
    const SOME: usize = 64;
    const MOST: usize = 1 << 20;
    let nodes: HashMap<i64, [f64; 3]> = (dofs.iter().map(|dof| dof.node))
        .filter_map(|node| Some((node, *matrices.positions.get(&node)?)))
        .collect();
    let mut all: Vec<(i64, [f64; 3])> = nodes.into_iter().collect();
    all.sort_unstable_by_key(|node| node.0);
    all.truncate(MOST);
    let step = (all.len() / SOME).max(1);
    let nearest = all.iter().step_by(step).filter_map(|(node, at)| {
        let distances = all
            .iter()
            .filter(|other| other.0 != *node)
            .map(|(_, other)| {
                let squares = (0..3).map(|a| (at[a] - other[a]) * (at[a] - other[a]));
                squares.sum::<f64>().sqrt()
            });
        let distance = distances.filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
        distance.is_finite().then_some(distance)
    });
    median(nearest.collect())
}
