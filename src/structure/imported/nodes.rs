//! Nodes of the joint, and of the points at which forces act.

use std::collections::{BTreeSet, HashMap, HashSet};

use super::{AXES, ImportError, Lower, UnitSystem};
use crate::linalg::vectors::{cross, dot, minus};
use crate::structure::interface::{Interface, Side};
use crate::structure::matrices::{Dof, Matrices};

/// The nodes of a pair may be so far apart along the joint, in sides of a contact element: what other elements of curved meshes leave.
const ASKEW: f64 = 0.05;

/// Nodes of two bodies that face each other.
#[derive(Debug, Clone, PartialEq)]
pub enum FacingNodes {
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

pub(super) type Position<'a> = dyn Fn(i64) -> Result<[f64; 3], ImportError> + 'a;

/// Pairs of nodes face each other.
pub(super) fn check_pairs(
    interface: &Interface,
    lower: &Side,
    upper: &Side,
) -> Result<(), ImportError> {
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
pub(super) fn sides(
    matrices: &Matrices,
    facing: &FacingNodes,
    unit: UnitSystem,
    positions: &Position<'_>,
) -> Result<[Side; 2], ImportError> {
    let mut both = [Side::default(), Side::default()];
    match facing {
        FacingNodes::Pairs(pairs) => {
            for &(upper, lower, area) in pairs {
                both[0].nodes.push(lower);
                both[1].nodes.push(upper);
                for side in &mut both {
                    side.areas
                        .extend(area.map(|area| area * unit.length * unit.length));
                }
            }
        }
        FacingNodes::Sets { upper, lower } => {
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

pub(super) fn no_set(matrices: &Matrices, key: &'static str, name: &str) -> ImportError {
    ImportError::NoSet {
        key,
        name: name.to_owned(),
        known: matrices.known_sets("none"),
    }
}

/// A point: its name, and its nodes with their parts in its displacement, which sum to one.
pub(super) type NodePoint = (String, Vec<(i64, f64)>);

/// The mean over the nodes that a scene names.
pub(super) fn point(matrices: &Matrices, name: &str) -> Result<NodePoint, ImportError> {
    let nodes = nodes_of(matrices, "dynamics", name)?;
    let part = 1.0 / nodes.len() as f64;
    Ok((
        name.to_owned(),
        nodes.into_iter().map(|node| (node, part)).collect(),
    ))
}

/// An end of a preload, and its centroid \[m\].
pub(super) type End = (NodePoint, [f64; 3]);

/// What an end of a preload is called beside the point of the same nodes.
fn end_of_preload(name: &str) -> String {
    format!("{name} by area")
}

/// Both ends of a preload, each of its nodes with its part of the area, their centroids, and whether areas are known. A node has equal parts of
/// the outer faces that it is a corner of, if all of their corners are among the nodes.
pub(super) fn ends_of_preload(
    matrices: &Matrices,
    names: &[String; 2],
    positions: &Position<'_>,
) -> Result<([End; 2], bool), ImportError> {
    let mut are_areas_known = true;
    let mut end = |name: &String| -> Result<End, ImportError> {
        let nodes = nodes_of(matrices, "contact.preload", name)?;
        let among: HashSet<i64> = nodes.iter().copied().collect();
        let mut parts: HashMap<i64, f64> = HashMap::new();
        for face in matrices
            .faces
            .iter()
            .filter(|face| face.iter().all(|n| among.contains(n)))
        {
            let at = face
                .iter()
                .map(|n| positions(*n))
                .collect::<Result<Vec<_>, _>>()?;
            // Twice the area of a quadrangle is the product of its diagonals, of a triangle that of two sides.
            let at = |k: usize| at[k % at.len()];
            let normal = cross(minus(at(2), at(0)), minus(at(3), at(1)));
            let area = dot(normal, normal).sqrt() / face.len() as f64;
            face.iter()
                .for_each(|node| *parts.entry(*node).or_insert(0.0) += area);
        }
        if parts.is_empty() {
            are_areas_known = false;
            parts = nodes.iter().map(|node| (*node, 1.0)).collect();
        }
        let mut parts: Vec<(i64, f64)> = parts.into_iter().collect();
        parts.sort_unstable_by_key(|(node, _)| *node);
        let whole: f64 = parts.iter().map(|(_, part)| part).sum();
        let mut centroid = [0.0; 3];
        for (node, part) in &mut parts {
            *part /= whole;
            let at = positions(*node)?;
            (0..3).for_each(|d| centroid[d] += *part * at[d]);
        }
        Ok(((end_of_preload(name), parts), centroid))
    };
    let [first, second] = names;
    Ok(([end(first)?, end(second)?], are_areas_known))
}

/// Nodes by their numbers and by names of sets, with commas between.
fn nodes_of(matrices: &Matrices, key: &'static str, name: &str) -> Result<Vec<i64>, ImportError> {
    let mut nodes = Vec::new();
    for item in name.split(',').map(str::trim) {
        match (item.parse(), matrices.sets.get(&item.to_ascii_uppercase())) {
            (_, Some(set)) => nodes.extend(set),
            (Ok(node), None) => nodes.push(node),
            (Err(_), None) => return Err(no_set(matrices, key, item)),
        }
    }
    nodes.sort_unstable();
    nodes.dedup();
    Ok(nodes)
}

/// Distance of two nodes that become one, over the side of the box around their face.
const SAME_PLACE: f64 = 1e-4;

/// Gives each upper node the rows of the lower one that it faces, those of a pair or at its place; how many rows there are then.
///
/// # Errors
/// [`ImportError::NotNodeForNode`] for a node that faces none, [`ImportError::NoRow`] for one without three displacements.
pub(super) fn bond(
    dofs: &[Dof],
    facing: &FacingNodes,
    [lower, upper]: [&Side; 2],
    place: &mut [Option<u32>],
) -> Result<usize, ImportError> {
    let row_of: HashMap<(i64, u32), usize> = (dofs.iter().enumerate())
        .map(|(row, dof)| ((dof.node, dof.direction), row))
        .collect();
    let spread = |d: usize| {
        let along = upper.positions.iter().map(|at| at[d]);
        let (least, most) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
            (a.min(x), b.max(x))
        });
        most - least
    };
    let within = SAME_PLACE * (0..3).map(spread).fold(0.0, f64::max);
    let mut taken = HashSet::new();
    for (n, (node, at)) in upper.nodes.iter().zip(&upper.positions).enumerate() {
        let apart = |other: &usize| {
            let between = minus(lower.positions[*other], *at);
            dot(between, between)
        };
        let faced = match facing {
            FacingNodes::Pairs(_) => Some(n),
            FacingNodes::Sets { .. } => (0..lower.nodes.len())
                .min_by(|a, b| apart(a).total_cmp(&apart(b)))
                .filter(|other| apart(other).sqrt() <= within && taken.insert(*other)),
        };
        let Some(faced) = faced else {
            return Err(ImportError::NotNodeForNode { node: *node });
        };
        for direction in 1..=6 {
            let both = [lower.nodes[faced], *node];
            match both.map(|n| row_of.get(&(n, direction)).copied()) {
                [Some(below), Some(above)] => {
                    // A support of one node holds both.
                    let one = place[below].filter(|_| place[above].is_some());
                    (place[below], place[above]) = (one, one);
                }
                [below, above] if direction <= 3 && below.is_some() != above.is_some() => {
                    return Err(ImportError::NoRow {
                        node: both[usize::from(below.is_some())],
                        axis: AXES[direction as usize - 1],
                        is_held: false,
                    });
                }
                _ => (),
            }
        }
    }
    let mut used: Vec<u32> = place.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    for own in place.iter_mut().flatten() {
        *own = used.partition_point(|other| other < own) as u32;
    }
    Ok(used.len())
}

/// Other nodes of the bodies that the stiffness joins with each side of the joint, those whose position is known.
pub(super) fn neighbours(
    sides: [&Side; 2],
    stiffness: &Lower,
    node_of: &[i64],
    positions: &Position<'_>,
) -> [Vec<[f64; 3]>; 2] {
    let at_joint: HashMap<i64, usize> = (sides.iter().enumerate())
        .flat_map(|(k, side)| side.nodes.iter().map(move |node| (*node, k)))
        .collect();
    let mut found = [BTreeSet::new(), BTreeSet::new()];
    for &(i, j, _) in stiffness {
        let both = [i, j].map(|row| node_of[row as usize]);
        for (node, other) in [(both[0], both[1]), (both[1], both[0])] {
            if let Some(&side) = at_joint.get(&node)
                && !at_joint.contains_key(&other)
            {
                found[side].insert(other);
            }
        }
    }
    let known = |nodes: BTreeSet<i64>| nodes.into_iter().filter_map(|node| positions(node).ok());
    found.map(|nodes| known(nodes).collect())
}
