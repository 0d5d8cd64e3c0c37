//! Outline of a mesh for drawings: the sharp edges of its bodies.

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};

use super::mesh::Mesh;
use super::solids::FACES;
use crate::linalg::Matrix;
use crate::linalg::vectors::{cross, dot, minus};

/// Two faces are coplanar if the product of their unit normals is at least `ONE_PLANE` (some 18°). Neighbouring faces
/// on a curved face of a distorted mesh have a product above `ONE_PLANE`.
const ONE_PLANE: f64 = 0.95;
/// Two edges are collinear if the product of their unit directions is at least `ONE_LINE`.
const ONE_LINE: f64 = 0.999;
/// Largest number of segments of a straight line. More would show no more bending in a low mode.
const PARTS: usize = 8;

/// Outline of a structure, and the motion of the outline in the modes, for drawings.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Straight lines in order: the name of each line's part, and its number of points.
    pub lines: Vec<(String, usize)>,
    /// Points of all lines, in order \[m\].
    pub positions: Vec<[f64; 3]>,
    /// Mode shapes at the points \[kg^-1/2\]. The matrix has three rows per point (x, y, z) and one column per mode,
    /// rigid modes first.
    pub shapes: Matrix,
}

/// Straight line of an outline.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line {
    /// Part of the mesh that the line belongs to. The first part for an edge where parts meet.
    pub part: usize,
    /// Nodes from one end of the line to the other end, with at most eight segments.
    pub nodes: Vec<usize>,
}

/// Returns the unit vector along `a`, or zero for a zero vector.
fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = dot(a, a).sqrt();
    a.map(|x| if length > 0.0 { x / length } else { 0.0 })
}

/// Edge between two nodes, the lower number first.
type Edge = (usize, usize);

/// Face of an element as the nodes around it, and the part of the mesh that the element belongs to.
pub type Face = (Vec<usize>, usize);

impl Mesh {
    /// Returns the [`lines`] of the hexahedra.
    pub fn outline(&self) -> Vec<Line> {
        let faces = self.elements.iter().flat_map(|element| {
            FACES.map(|face| (face.map(|k| element.nodes[k]).to_vec(), element.part))
        });
        lines(faces, &self.nodes)
    }
}

/// Returns the lines where outer faces of a mesh meet at an angle. `faces` are the faces of all elements, and `nodes`
/// the positions of the nodes. Touching bodies with separate nodes have separate edges.
pub fn lines(faces: impl IntoIterator<Item = Face>, nodes: &[[f64; 3]]) -> Vec<Line> {
    let edges = sharp_edges(faces, nodes);
    let mut at_node: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (a, b) in edges.keys() {
        at_node.entry(*a).or_default().push(*b);
        at_node.entry(*b).or_default().push(*a);
    }
    let ordered = |a: usize, b: usize| (a.min(b), a.max(b));
    let direction = |from: usize, to: usize| unit(minus(nodes[to], nodes[from]));
    let mut remaining: BTreeSet<Edge> = edges.keys().copied().collect();
    let mut lines = Vec::new();
    while let Some((first, second)) = remaining.pop_first() {
        let part = edges[&(first, second)];
        let mut chain = VecDeque::from([first, second]);
        for forward in [true, false] {
            loop {
                let count = chain.len();
                let (end, before) = match forward {
                    true => (chain[count - 1], chain[count - 2]),
                    false => (chain[0], chain[1]),
                };
                let continues = |next: &&usize| {
                    let edge = ordered(end, **next);
                    let turn = dot(direction(before, end), direction(end, **next));
                    remaining.contains(&edge) && edges[&edge] == part && turn > ONE_LINE
                };
                let Some(next) = at_node[&end].iter().find(continues).copied() else {
                    break;
                };
                remaining.remove(&ordered(end, next));
                match forward {
                    true => chain.push_back(next),
                    false => chain.push_front(next),
                }
            }
        }
        let count = chain.len() - 1;
        let parts = count.min(PARTS);
        let nodes = (0..=parts).map(|k| chain[k * count / parts]).collect();
        lines.push(Line { part, nodes });
    }
    lines
}

/// Returns the outer faces, which belong to one element only, in the order of their sorted nodes.
pub fn outer_faces(faces: impl IntoIterator<Item = Face>) -> Vec<Face> {
    let mut outer: HashMap<Vec<usize>, Face> = HashMap::new();
    for face in faces {
        let mut key = face.0.clone();
        key.sort_unstable();
        // A face that two elements share is inside the body.
        if outer.remove(&key).is_none() {
            outer.insert(key, face);
        }
    }
    let mut outer: Vec<(Vec<usize>, Face)> = outer.into_iter().collect();
    outer.sort_unstable();
    outer.into_iter().map(|(_, face)| face).collect()
}

/// Returns the edges between outer faces that are not coplanar, with the lowest part number of each edge.
fn sharp_edges(faces: impl IntoIterator<Item = Face>, nodes: &[[f64; 3]]) -> BTreeMap<Edge, usize> {
    let mut around: HashMap<Edge, Vec<([f64; 3], usize)>> = HashMap::new();
    for (corners, part) in &outer_faces(faces) {
        let at = |k: usize| nodes[corners[k % corners.len()]];
        // The normal of a quadrangle is the cross product of its diagonals. The normal of a triangle is the cross
        // product of two sides.
        let normal = unit(cross(minus(at(2), at(0)), minus(at(3), at(1))));
        for k in 0..corners.len() {
            let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
            let faces = around.entry((a.min(b), a.max(b))).or_default();
            faces.push((normal, *part));
        }
    }
    let sharp = around.into_iter().filter(|(_, faces)| {
        let first = faces[0].0;
        let mut others = faces.iter().skip(1);
        // The sign of a normal is arbitrary, because the order of the nodes does not determine the outer side of a
        // face.
        others.any(|(normal, _)| dot(first, *normal).abs() < ONE_PLANE)
    });
    let part = |faces: &[([f64; 3], usize)]| faces.iter().map(|(_, part)| *part).min();
    sharp
        .filter_map(|(edge, faces)| Some((edge, part(&faces)?)))
        .collect()
}
