//! Nodes of the joint and of the points where forces act.

use std::collections::{BTreeSet, HashMap, HashSet};

use super::{AXES, ImportError, Lower, UnitSystem};
use crate::linalg::vectors::{cross, dot, minus};
use crate::structure::interface::{Interface, Side};
use crate::structure::matrices::{Dof, Matrices};

/// Largest distance between the nodes of a pair along the joint, in sides of a contact element. Meshes of curved
/// faces need some.
const ASKEW: f64 = 0.05;

/// Nodes of two bodies that face each other.
#[derive(Debug, Clone, PartialEq)]
pub enum FacingNodes {
    /// Pairs of nodes: the upper node, the lower node, and the area in the squared unit of length. Either all pairs of
    /// nodes have an area, or no pair has one.
    Pairs(Vec<(i64, i64, Option<f64>)>),
    /// Names of two sets of nodes.
    Sets {
        /// Set of the upper body.
        upper: String,
        /// Set of the lower body.
        lower: String,
    },
}

pub(super) type Position<'a> = dyn Fn(i64) -> Result<[f64; 3], ImportError> + 'a;

/// Checks that the nodes of each pair face each other.
pub(super) fn check_pairs(
    interface: &Interface,
    lower: &Side,
    upper: &Side,
) -> Result<(), ImportError> {
    let sides = interface.array.sides();
    let side = sides[0].min(sides[1]);
    let position_pairs = lower.positions.iter().zip(&upper.positions);
    for (k, (below, above)) in position_pairs.enumerate() {
        let offset = [0, 1, 2].map(|d| above[d] - below[d]);
        let along = [0, 1].map(|axis| {
            let direction = interface.axes[axis];
            (0..3).map(|d| offset[d] * direction[d]).sum::<f64>()
        });
        let off = along[0].hypot(along[1]);
        if off > ASKEW * side {
            return Err(ImportError::PairOffset {
                upper: upper.nodes[k],
                lower: lower.nodes[k],
                off: off * 1e3,
                side: side * 1e3,
            });
        }
    }
    Ok(())
}

/// Returns the nodes of both bodies at the joint, the lower body first.
pub(super) fn sides(
    matrices: &Matrices,
    facing: &FacingNodes,
    unit: UnitSystem,
    positions: &Position<'_>,
) -> Result<[Side; 2], ImportError> {
    let mut sides = [Side::default(), Side::default()];
    match facing {
        FacingNodes::Pairs(pairs) => {
            for &(upper, lower, area) in pairs {
                sides[0].nodes.push(lower);
                sides[1].nodes.push(upper);
                for side in &mut sides {
                    side.areas
                        .extend(area.map(|area| area * unit.length * unit.length));
                }
            }
        }
        FacingNodes::Sets { upper, lower } => {
            let set_nodes = |key, name: &String| {
                let set = matrices.sets.get(&name.to_ascii_uppercase());
                let mut set = set.cloned().ok_or_else(|| no_set(matrices, key, name))?;
                set.sort_unstable();
                set.dedup();
                Ok::<_, ImportError>(set)
            };
            sides[0].nodes = set_nodes("structure.interface.lower", lower)?;
            sides[1].nodes = set_nodes("structure.interface.upper", upper)?;
        }
    }
    let mut seen = HashMap::new();
    for (k, side) in sides.iter_mut().enumerate() {
        for &node in &side.nodes {
            match seen.insert(node, k) {
                Some(other) if other == k => return Err(ImportError::DuplicateNode { node }),
                Some(_) => return Err(ImportError::OnBothSides { node }),
                None => (),
            }
        }
        side.positions = side
            .nodes
            .iter()
            .map(|node| positions(*node))
            .collect::<Result<_, _>>()?;
    }
    Ok(sides)
}

pub(super) fn no_set(matrices: &Matrices, key: &'static str, name: &str) -> ImportError {
    ImportError::NoSet {
        key,
        name: name.to_owned(),
        known: matrices.set_names("none"),
    }
}

/// Name of a point, and the nodes of the point with their weights, which sum to one.
pub(super) type NodePoint = (String, Vec<(i64, f64)>);

/// Returns the point with the mean displacement of the nodes that a scene names.
pub(super) fn point(matrices: &Matrices, name: &str) -> Result<NodePoint, ImportError> {
    let nodes = nodes_of(matrices, "dynamics", name)?;
    let part = 1.0 / nodes.len() as f64;
    Ok((
        name.to_owned(),
        nodes.into_iter().map(|node| (node, part)).collect(),
    ))
}

/// End point of a bolt preload, and the centroid of the end \[m\].
pub(super) type End = (NodePoint, [f64; 3]);

/// Returns the name of an end of a preload. The name of an end differs from the name of the point with the same nodes.
fn preload_end_name(name: &str) -> String {
    format!("{name} by area")
}

/// Returns both ends of a preload and their centroids, and whether the areas of the nodes are known.
///
/// The nodes of an end are weighted by area. An outer face belongs to an end if all corners of the face are nodes of
/// the end. The area of the face is divided equally among the corners of the face.
pub(super) fn ends_of_preload(
    matrices: &Matrices,
    names: &[String; 2],
    positions: &Position<'_>,
) -> Result<([End; 2], bool), ImportError> {
    let mut are_areas_known = true;
    let mut end = |name: &String| -> Result<End, ImportError> {
        let nodes = nodes_of(matrices, "contact.preload", name)?;
        let node_set: HashSet<i64> = nodes.iter().copied().collect();
        let mut parts: HashMap<i64, f64> = HashMap::new();
        for face in matrices
            .faces
            .iter()
            .filter(|face| face.iter().all(|n| node_set.contains(n)))
        {
            let at = face
                .iter()
                .map(|n| positions(*n))
                .collect::<Result<Vec<_>, _>>()?;
            // The cross product of the diagonals of a quadrangle is twice its area. The code takes two sides of a
            // triangle as its diagonals.
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
        Ok(((preload_end_name(name), parts), centroid))
    };
    let [first, second] = names;
    Ok(([end(first)?, end(second)?], are_areas_known))
}

/// Returns the nodes of a list of node numbers and names of sets, separated by commas.
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

/// Largest distance of two nodes that are merged, as a share of the longest side of the box around their face.
const SAME_PLACE: f64 = 1e-4;

/// Merges each upper node with the lower node that the upper node faces. The two nodes are a pair of
/// [`FacingNodes::Pairs`], or have the same position. Returns the new number of rows.
///
/// # Errors
/// [`ImportError::NotNodeForNode`] if a node does not face a node of the other body. [`ImportError::NoRow`] if the
/// matrices lack a displacement of a node.
pub(super) fn merge_facing_nodes(
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
    let tolerance = SAME_PLACE * (0..3).map(spread).fold(0.0, f64::max);
    let mut merged_nodes = HashSet::new();
    for (n, (node, at)) in upper.nodes.iter().zip(&upper.positions).enumerate() {
        let squared_distance = |other: &usize| {
            let between = minus(lower.positions[*other], *at);
            dot(between, between)
        };
        let lower_index = match facing {
            FacingNodes::Pairs(_) => Some(n),
            FacingNodes::Sets { .. } => (0..lower.nodes.len())
                .min_by(|a, b| squared_distance(a).total_cmp(&squared_distance(b)))
                .filter(|other| {
                    squared_distance(other).sqrt() <= tolerance && merged_nodes.insert(*other)
                }),
        };
        let Some(lower_index) = lower_index else {
            return Err(ImportError::NotNodeForNode { node: *node });
        };
        for direction in 1..=6 {
            let paired_nodes = [lower.nodes[lower_index], *node];
            match paired_nodes.map(|n| row_of.get(&(n, direction)).copied()) {
                [Some(below), Some(above)] => {
                    // A support of one node fixes both.
                    let merged = place[below].filter(|_| place[above].is_some());
                    (place[below], place[above]) = (merged, merged);
                }
                [below, above] if direction <= 3 && below.is_some() != above.is_some() => {
                    return Err(ImportError::NoRow {
                        node: paired_nodes[usize::from(below.is_some())],
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
    for row_number in place.iter_mut().flatten() {
        *row_number = used.partition_point(|other| other < row_number) as u32;
    }
    Ok(used.len())
}

/// Returns the known positions of the nodes outside the joint that the stiffness connects to each side of the joint.
pub(super) fn neighbours(
    sides: [&Side; 2],
    stiffness: &Lower,
    node_of: &[i64],
    positions: &Position<'_>,
) -> [Vec<[f64; 3]>; 2] {
    let at_joint: HashMap<i64, usize> = (sides.iter().enumerate())
        .flat_map(|(k, side)| side.nodes.iter().map(move |node| (*node, k)))
        .collect();
    let mut neighbour_nodes = [BTreeSet::new(), BTreeSet::new()];
    for &(i, j, _) in stiffness {
        let entry_nodes = [i, j].map(|row| node_of[row as usize]);
        for (node, other) in [
            (entry_nodes[0], entry_nodes[1]),
            (entry_nodes[1], entry_nodes[0]),
        ] {
            if let Some(&side) = at_joint.get(&node)
                && !at_joint.contains_key(&other)
            {
                neighbour_nodes[side].insert(other);
            }
        }
    }
    let known_positions =
        |nodes: BTreeSet<i64>| nodes.into_iter().filter_map(|node| positions(node).ok());
    neighbour_nodes.map(|nodes| known_positions(nodes).collect())
}
