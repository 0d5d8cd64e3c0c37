//! What matrices from elsewhere say of their structure: masses, rows without mass, modal coordinates, rows that a user names, and which
//! units are likely. Units are those of the file throughout.

use std::collections::{BTreeMap, HashMap, HashSet};

use crate::structure::matrices::{Dof, Matrices, Role, Triplets};
use crate::structure::readers::{CALCULIX_LIST, DECK};

/// Diagonals below this share of the largest of their kind are zero.
const ZERO: f64 = 1e-14;
/// Modal masses are 1 to this, and modes are orthogonal to it.
const MODAL: f64 = 1e-6;
/// Mass that moves as a whole over the diagonal of the mass: from a half to two and a half for solids, and nothing for a stiffness.
const MOVED: f64 = 1e-2;

/// A body is free where a translation strains it by less than this share of its stiffness,
const FREE: f64 = 1e-6;
/// and should turn with less than this,
const TURNED: f64 = 1e-7;
/// or with so many times what the translations leave by their digits.
const STRAINED: f64 = 1e3;

/// What a user names as held, and is not there.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FixedError {
    /// Neither a set nor a node.
    #[error(
        "{text} is neither a node (12, 12-20, 12.123), a row (row:5), nor one of the sets of nodes: {known}"
    )]
    Unknown {
        /// What was given.
        text: String,
        /// Names of the sets.
        known: String,
    },
    /// A direction that no node has.
    #[error(
        "{text}: direction {direction} does not exist; displacements are 1 to 3, rotations 4 to 6"
    )]
    NoSuchDirection {
        /// What was given.
        text: String,
        /// The direction.
        direction: u32,
    },
    /// A node that has no row.
    #[error("node {node} has no freedom {direction}in the matrices; their nodes are {nodes}")]
    NoSuchNode {
        /// The node.
        node: i64,
        /// The direction with a blank after it, or nothing.
        direction: String,
        /// First and last node there is.
        nodes: String,
    },
    /// A row beyond the last.
    #[error("row {row} does not exist; the matrices have rows 1 to {size}")]
    NoSuchRow {
        /// The row.
        row: usize,
        /// Rows there are.
        size: usize,
    },
    /// There is nothing but boundary.
    #[error(
        "boundary holds all but modal coordinates, and there are none in the matrices; name nodes or a set"
    )]
    NoModes,
    /// Nobody says which node a row belongs to.
    #[error(
        "{text} names nodes, but no file says which node a row belongs to; name rows, as row:1-6"
    )]
    NoNodes {
        /// What was given.
        text: String,
    },
}

/// The rows that a user holds: `SET`, `NODE`, `FIRST-LAST`, each with `.DIRECTIONS` or `:DIRECTIONS` behind it (`12.123`, `CLAMP:3`),
/// `row:K`, `row:K-L` (from 1), or `boundary` (all that is no modal coordinate); several with commas between them.
///
/// # Errors
/// [`FixedError`] names what is not there. A set none of whose nodes has a row is none: its rows were removed by the program.
pub fn fixed(matrices: &Matrices, text: &str) -> Result<(Vec<bool>, Vec<String>), FixedError> {
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
            // Without modal coordinates nothing would be left.
            if !modal.contains(&true) {
                return Err(FixedError::NoModes);
            }
            for (held, is_modal) in is_fixed.iter_mut().zip(&modal) {
                *held |= !is_modal;
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
            // Nodes of a range that are not there are no mistake, unless it is one node.
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
            let there = || dofs.iter().map(|dof| dof.node);
            let (first, last) = (there().min().unwrap_or(0), there().max().unwrap_or(0));
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
        known: matrices.known_sets("there are none"),
    }
}

/// A node or a set, and the directions behind it, where it has any.
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

/// `12`, `-12` or `12-20`.
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

/// Nodes of CalculiX's list that are numbered above all of its deck: inner freedoms of solids (C3D8I), which do not move with a body as a
/// whole. Elsewhere nodes without a place are nodes whose place nobody gave.
fn inner_nodes(matrices: &Matrices) -> HashSet<i64> {
    if ![DECK, CALCULIX_LIST]
        .iter()
        .all(|format| matrices.formats.contains(format))
    {
        return HashSet::new();
    }
    let nodes: HashSet<i64> = matrices.dofs.iter().flatten().map(|dof| dof.node).collect();
    let (known, inner): (HashSet<i64>, HashSet<i64>) =
        (nodes.into_iter()).partition(|node| matrices.positions.contains_key(node));
    let last = known.iter().copied().max();
    let is_above = |node: &i64| last.is_some_and(|last| *node > last);
    match inner.iter().all(is_above) {
        true => inner,
        false => HashSet::new(),
    }
}

/// That there are such nodes.
pub fn inner_nodes_note(matrices: &Matrices) -> Option<String> {
    let inner = inner_nodes(matrices);
    let first = inner.iter().min()?;
    Some(format!(
        "{} nodes of the matrices are not in the deck, the first {first}: they are taken as inner freedoms of solids",
        inner.len(),
    ))
}

/// What makes it doubtful that these matrices are a structure: nodes that have stiffness alone, or mass alone, and a mass that does not
/// resist to a motion as a whole.
pub fn suspicions(matrices: &Matrices) -> Vec<String> {
    let mut found = Vec::new();
    let (Some(dofs), Some(stiffness), Some(mass)) =
        (&matrices.dofs, &matrices.stiffness, &matrices.mass)
    else {
        return found;
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
        let only: Vec<i64> = with.difference(without).copied().collect();
        if !only.is_empty() && only.len() < with.len() {
            found.push(format!(
                "{} of {} nodes have {what}, the first {}: {then}",
                only.len(),
                stiff.union(&heavy).count(),
                only.iter().min().unwrap_or(&0)
            ));
        }
    }
    found.extend(turned_bodies(matrices));
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
        found.push(format!(
            "the mass resists a motion as a whole by {:.1e} of its diagonal only, as a stiffness does: stiffness and mass may be exchanged",
            total / trace
        ));
    }
    found
}

/// Sum of the mass between the displacements along each axis; `None` along one that no row has, or where no file says which rows do.
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

/// Nodes that matrices join to each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// How many.
    pub nodes: usize,
    /// Their mass, in the unit of the files; none without a mass matrix.
    pub mass: Option<f64>,
    /// Where it is on average, where the positions of all of its nodes are known.
    pub centre: Option<[f64; 3]>,
}

/// Which body each node is of, of those that the matrices join: the nodes, ascending, and a number for each.
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
    let of_node = (0..nodes.len()).map(|k| root(&mut parents, k)).collect();
    (nodes, of_node)
}

/// A free body that moves without strain and cannot turn without: its rows or the positions of its nodes are others than those of the matrix.
fn turned_bodies(matrices: &Matrices) -> Option<String> {
    let (dofs, stiffness) = (matrices.dofs.as_ref()?, matrices.stiffness.as_ref()?);
    let (nodes, of_node) = bodies_of_nodes(matrices, dofs);
    let body = |row: usize| of_node[nodes.partition_point(|node| *node < dofs[row].node)];
    let mut centres: HashMap<usize, ([f64; 3], f64)> = HashMap::new();
    let mut unknown: HashSet<usize> = HashSet::new();
    for (node, of) in nodes.iter().zip(&of_node) {
        match matrices.positions.get(node) {
            Some(at) => {
                let (sum, count) = centres.entry(*of).or_default();
                (0..3).for_each(|axis| sum[axis] += at[axis]);
                *count += 1.0;
            }
            None => {
                unknown.insert(*of);
            }
        }
    }
    for row in 0..dofs.len() {
        if !dofs[row].is_translation() && !dofs[row].is_rotation() {
            unknown.insert(body(row));
        }
    }
    // What a row moves by in each of three translations and three rotations.
    let motion = |row: usize| -> [f64; 6] {
        let mut moved = [0.0; 6];
        if unknown.contains(&body(row)) {
            return moved;
        }
        let dof = dofs[row];
        let (sum, count) = centres[&body(row)];
        let at = matrices.positions[&dof.node];
        let [x, y, z] = [0, 1, 2].map(|axis| at[axis] - sum[axis] / count);
        let arms = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
        match dof.direction {
            d @ 1..=3 => {
                moved[d as usize - 1] = 1.0;
                (0..3).for_each(|turn| moved[3 + turn] = arms[turn][d as usize - 1]);
            }
            d @ 4..=6 => moved[d as usize - 1] = 1.0,
            _ => {}
        }
        moved
    };
    let motions: Vec<[f64; 6]> = (0..dofs.len()).map(motion).collect();
    let mut energies: BTreeMap<usize, [[f64; 2]; 6]> = BTreeMap::new();
    for &(i, j, value) in &stiffness.entries {
        let of = body(i as usize);
        if unknown.contains(&of) {
            continue;
        }
        let times = if stiffness.is_half && i != j {
            2.0
        } else {
            1.0
        };
        let [a, b] = [i, j].map(|row| motions[row as usize]);
        let energies = energies.entry(of).or_default();
        for k in 0..6 {
            let work = times * value * a[k] * b[k];
            energies[k][0] += work;
            energies[k][1] += work.abs();
        }
    }
    let share = |[work, size]: [f64; 2]| if size > 0.0 { work.abs() / size } else { 0.0 };
    let bodies = energies.values().map(|of| of.map(share));
    let worst = bodies.filter_map(|[x, y, z, turns @ ..]| {
        let moved = x.max(y).max(z);
        let turned = turns.into_iter().fold(0.0, f64::max);
        (moved < FREE && turned > TURNED.max(STRAINED * moved)).then_some(turned)
    });
    let worst = worst.max_by(f64::total_cmp)?;
    Some(format!(
        "a body that moves freely resists a turn by {worst:.1e} of its stiffness: its rows, the positions of its nodes or their axes are others than those of the stiffness matrix"
    ))
}

/// The bodies, the heaviest first; none where no file says what the rows are. The mass is that along the direction that has most.
pub fn bodies(matrices: &Matrices) -> Vec<Body> {
    let Some(dofs) = &matrices.dofs else {
        return Vec::new();
    };
    let (nodes, of_node) = bodies_of_nodes(matrices, dofs);
    let place = |row: u32| nodes.partition_point(|node| *node < dofs[row as usize].node);
    let along = mass_by_direction(matrices);
    let most = (0..3).max_by(|a, b| {
        let of = |d: &usize| along[*d].unwrap_or(0.0);
        of(a).total_cmp(&of(b))
    });
    let direction = most.map_or(1, |d| d as u32 + 1);
    let mut found: BTreeMap<usize, (usize, f64, Option<[f64; 3]>)> = BTreeMap::new();
    for (k, node) in nodes.iter().enumerate() {
        let of = found.entry(of_node[k]).or_insert((0, 0.0, Some([0.0; 3])));
        of.0 += 1;
        if !matrices.positions.contains_key(node) {
            of.2 = None;
        }
    }
    if let Some(matrix) = &matrices.mass {
        for &(i, j, value) in &matrix.entries {
            let is_along = |row: u32| dofs[row as usize].direction == direction;
            if !is_along(i) || !is_along(j) {
                continue;
            }
            let ends = if matrix.is_half && i != j {
                &[i, j][..]
            } else {
                &[i]
            };
            for &row in ends {
                let of = found.get_mut(&of_node[place(row)]).expect("a body");
                of.1 += value;
                if let (Some(sum), Some(at)) =
                    (&mut of.2, matrices.positions.get(&dofs[row as usize].node))
                {
                    (0..3).for_each(|d| sum[d] += value * at[d]);
                }
            }
        }
    }
    let mut bodies: Vec<Body> = found
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

/// Rows whose diagonal is zero: against the largest of displacements, rotations or scalars, whichever the row is.
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

/// Rows that are modal coordinates: scalars where files say what rows are; otherwise the last ones, as long as their modal masses are 1
/// and nothing couples them with each other.
pub fn modal_rows(matrices: &Matrices) -> Vec<bool> {
    if let Some(dofs) = &matrices.dofs {
        return dofs.iter().map(|dof| dof.direction == 0).collect();
    }
    let mut is_modal = vec![false; matrices.size];
    let (Some(stiffness), Some(mass)) = (&matrices.stiffness, &matrices.mass) else {
        return is_modal;
    };
    let (k, m) = (stiffness.diagonal(), mass.diagonal());
    // The first row that can be one: below it all have unit mass, and no two of them are coupled.
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
    // All of them would be a structure of oscillators.
    if first > 0 && first < matrices.size {
        is_modal[first..].fill(true);
    }
    is_modal
}

/// Units that the numbers look like.
#[derive(Debug, Clone, PartialEq)]
pub struct Units {
    /// The system, or that none fits.
    pub likely: &'static str,
    /// What speaks for it.
    pub why: String,
}

/// Speeds of waves in metals, polymers and composites \[m/s\], times what the estimate may be off: from the distance of nodes bars
/// give 1.7 times the speed and hexahedra 2.5 times, from rotations more or less. Between the range of metres and that of
/// millimetres lies what kilogrammes with newtons and millimetres give for metals, 1.6e5 to 4e5.
const BY_DISTANCE: [f64; 2] = [1.2e3, 3e4];
const BY_ROTATION: [f64; 2] = [3e2, 5e4];
/// A part of less than a hundredth of a unit of mass is more likely grammes written in tonnes than in kilogrammes.
const LIGHT: f64 = 1e-2;

/// Which units are likely. Of a rod √(K/M) of one element times its length is the speed of waves, which is about 5 000 m/s in steel and
/// differs little between solids: its number tells metres from millimetres, whatever the structure.
pub fn units(matrices: &Matrices) -> Option<Units> {
    let total = mass_by_direction(matrices)
        .into_iter()
        .flatten()
        .fold(0.0, f64::max);
    if let Some((speed, [least, most], how)) = wave_speed(matrices) {
        // Slower than waves in any range is bending on a coarse mesh: that says nothing.
        let found = match speed {
            v if (least..=most).contains(&v) => Some((
                "m, kg, s (N, Pa)",
                "the length is in metres and mass fits to force",
            )),
            v if (1e3 * least..=1e3 * most).contains(&v) => Some((
                "mm, t, s (N, MPa)",
                "the length is in millimetres and mass fits to force (tonnes to newtons)",
            )),
            v if (most..1e3 * least).contains(&v) => Some((
                "none that fit each other",
                "with N and mm the mass is to be in t, with N and m in kg (kg with N and mm makes frequencies 31.6 times too low); inches and pounds give 2e5",
            )),
            _ => None,
        };
        if let Some((likely, then)) = found {
            return Some(Units {
                likely,
                why: format!(
                    "{how} gives waves of {speed:.2e} lengths a second, where solids have some 5e3 m/s or 5e6 mm/s: {then}"
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

/// The speed of waves, what it is for solids in m/s, and of which lengths: the distance of neighbouring nodes, or √(K/K) of rotations and displacements.
fn wave_speed(matrices: &Matrices) -> Option<(f64, [f64; 2], String)> {
    let (dofs, stiffness, mass) = (
        matrices.dofs.as_ref()?,
        matrices.stiffness.as_ref()?,
        matrices.mass.as_ref()?,
    );
    if dofs.iter().any(|dof| dof.direction == 0) {
        // Between the boundary nodes of a superelement lies the whole structure.
        return None;
    }
    let (k, m) = (stiffness.diagonal(), mass.diagonal());
    let of = |is: fn(&Dof) -> bool, value: fn(f64, f64) -> f64| {
        let rows = (0..dofs.len()).filter(|&row| is(&dofs[row]) && k[row] > 0.0 && m[row] > 0.0);
        median(rows.map(|row| value(k[row], m[row])).collect())
    };
    let rate = of(Dof::is_translation, |k, m| (k / m).sqrt())?;
    if let Some(length) = spacing(matrices, dofs) {
        return Some((
            rate * length,
            BY_DISTANCE,
            format!("a distance of neighbouring nodes of {length:.3e} with √(K/M) of {rate:.2e}"),
        ));
    }
    let turning = of(Dof::is_rotation, |k, _| k)?;
    let moving = of(Dof::is_translation, |k, _| k)?;
    let length = (turning / moving).sqrt();
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

/// Median distance of a node to its nearest neighbour, of some of them.
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
        let found = distances.filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
        found.is_finite().then_some(found)
    });
    median(nearest.collect())
}
