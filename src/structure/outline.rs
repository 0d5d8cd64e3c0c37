//! The outline of a mesh: the edges of its bodies, as a drawing shows them.

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};

use super::mesh::Mesh;
use super::solids::FACES;
use crate::linalg::Matrix;
use crate::linalg::vectors::{cross, dot, minus};

/// Faces whose normals have at least this product are one plane: some 18°, above what a distorted mesh has on a curved face.
const ONE_PLANE: f64 = 0.95;
/// Edges whose directions have at least this product are one straight line.
const ONE_LINE: f64 = 0.999;
/// Parts of a straight line at most: a drawing shows no more of how it bends in a low mode.
const PARTS: usize = 8;

/// The outline of a structure, and how it moves in the modes: for drawings.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Straight lines, one after another: the part of each, and how many of the points are its own.
    pub lines: Vec<(String, usize)>,
    /// The points \[m\].
    pub positions: Vec<[f64; 3]>,
    /// Modes at the points \[kg^-1/2\]: three rows each (x, y, z), the rigid modes first, one column each.
    pub shapes: Matrix,
}

/// A straight line of an outline.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line {
    /// The part of the mesh that it belongs to; of an edge where parts meet, the first.
    pub part: usize,
    /// Nodes from one end to the other: eight parts at most.
    pub nodes: Vec<usize>,
}

/// Unit vector along `a`; zeros of none.
fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = dot(a, a).sqrt();
    a.map(|x| if length > 0.0 { x / length } else { 0.0 })
}

/// An edge, the lower node first.
type Edge = (usize, usize);

/// The face of an element by the nodes around it, and the part of the mesh that the element belongs to.
pub type Face = (Vec<usize>, usize);

impl Mesh {
    /// The [`lines`] of its hexahedra.
    pub fn outline(&self) -> Vec<Line> {
        let faces = self.elements.iter().flat_map(|element| {
            FACES.map(|face| (face.map(|k| element.nodes[k]).to_vec(), element.part))
        });
        lines(faces, &self.nodes)
    }
}

/// The lines where outer faces of the elements of a mesh meet at an angle, of the `faces` of all elements, with `nodes` at their places.
/// Bodies that touch with nodes of their own have edges of their own there.
pub fn lines(faces: impl IntoIterator<Item = Face>, nodes: &[[f64; 3]]) -> Vec<Line> {
    let edges = sharp_edges(faces, nodes);
    let mut at_node: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (a, b) in edges.keys() {
        at_node.entry(*a).or_default().push(*b);
        at_node.entry(*b).or_default().push(*a);
    }
    let of = |a: usize, b: usize| (a.min(b), a.max(b));
    let direction = |from: usize, to: usize| unit(minus(nodes[to], nodes[from]));
    let mut left: BTreeSet<Edge> = edges.keys().copied().collect();
    let mut lines = Vec::new();
    while let Some((first, second)) = left.pop_first() {
        let part = edges[&(first, second)];
        let mut along = VecDeque::from([first, second]);
        for forward in [true, false] {
            loop {
                let count = along.len();
                let (end, before) = match forward {
                    true => (along[count - 1], along[count - 2]),
                    false => (along[0], along[1]),
                };
                let goes_on = |next: &&usize| {
                    let edge = of(end, **next);
                    let turn = dot(direction(before, end), direction(end, **next));
                    left.contains(&edge) && edges[&edge] == part && turn > ONE_LINE
                };
                let Some(next) = at_node[&end].iter().find(goes_on).copied() else {
                    break;
                };
                left.remove(&of(end, next));
                match forward {
                    true => along.push_back(next),
                    false => along.push_front(next),
                }
            }
        }
        let count = along.len() - 1;
        let parts = count.min(PARTS);
        let nodes = (0..=parts).map(|k| along[k * count / parts]).collect();
        lines.push(Line { part, nodes });
    }
    lines
}

/// Those of the `faces` of all elements that are not between two of them, in the order of their sorted nodes.
pub fn outer_faces(faces: impl IntoIterator<Item = Face>) -> Vec<Face> {
    let mut outer: HashMap<Vec<usize>, Face> = HashMap::new();
    for face in faces {
        let mut key = face.0.clone();
        key.sort_unstable();
        // A face of two elements is within.
        if outer.remove(&key).is_none() {
            outer.insert(key, face);
        }
    }
    let mut outer: Vec<(Vec<usize>, Face)> = outer.into_iter().collect();
    outer.sort_unstable();
    outer.into_iter().map(|(_, face)| face).collect()
}

/// Edges between outer faces that are not of one plane, with the first part that has them.
fn sharp_edges(faces: impl IntoIterator<Item = Face>, nodes: &[[f64; 3]]) -> BTreeMap<Edge, usize> {
    let mut around: HashMap<Edge, Vec<([f64; 3], usize)>> = HashMap::new();
    for (corners, part) in &outer_faces(faces) {
        let at = |k: usize| nodes[corners[k % corners.len()]];
        // Of a quadrangle the product of its diagonals, of a triangle that of two sides.
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
        // The order of the nodes of a face does not say which side is outside.
        others.any(|(normal, _)| dot(first, *normal).abs() < ONE_PLANE)
    });
    let part = |faces: &[([f64; 3], usize)]| faces.iter().map(|(_, part)| *part).min();
    sharp
        .filter_map(|(edge, faces)| Some((edge, part(&faces)?)))
        .collect()
}
