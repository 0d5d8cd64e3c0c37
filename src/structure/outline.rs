//! The outline of a mesh: the edges of its bodies, as a drawing shows them.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use crate::structure::mesh::Mesh;

/// Faces of the hexahedron, by the places of their nodes.
const FACES: [[usize; 4]; 6] = [
    [0, 1, 2, 3],
    [4, 5, 6, 7],
    [0, 1, 5, 4],
    [1, 2, 6, 5],
    [2, 3, 7, 6],
    [3, 0, 4, 7],
];
/// Faces whose normals have at least this product are one plane: some 18°, above what a distorted mesh has on a curved face.
const ONE_PLANE: f64 = 0.95;
/// Edges whose directions have at least this product are one straight line.
const ONE_LINE: f64 = 0.999;
/// Parts of a straight line at most: a drawing shows no more of how it bends in a low mode.
const PARTS: usize = 8;

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
    let length = a.iter().map(|x| x * x).sum::<f64>().sqrt();
    a.map(|x| if length > 0.0 { x / length } else { 0.0 })
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn product(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let turn = |k: usize| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    [turn(0), turn(1), turn(2)]
}

/// An edge, the lower node first.
type Edge = (usize, usize);

impl Mesh {
    /// The lines where outer faces of the mesh meet at an angle. Bodies that touch with nodes of their own have edges of their own there.
    pub fn outline(&self) -> Vec<Line> {
        let edges = self.sharp_edges();
        let mut at_node: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (a, b) in edges.keys() {
            at_node.entry(*a).or_default().push(*b);
            at_node.entry(*b).or_default().push(*a);
        }
        let of = |a: usize, b: usize| (a.min(b), a.max(b));
        let direction = |from: usize, to: usize| unit(minus(self.nodes[to], self.nodes[from]));
        let mut left: BTreeSet<Edge> = edges.keys().copied().collect();
        let mut lines = Vec::new();
        while let Some((first, second)) = left.pop_first() {
            let part = edges[&(first, second)];
            let mut nodes = std::collections::VecDeque::from([first, second]);
            for forward in [true, false] {
                loop {
                    let count = nodes.len();
                    let (end, before) = match forward {
                        true => (nodes[count - 1], nodes[count - 2]),
                        false => (nodes[0], nodes[1]),
                    };
                    let goes_on = |next: &&usize| {
                        let edge = of(end, **next);
                        let along = product(direction(before, end), direction(end, **next));
                        left.contains(&edge) && edges[&edge] == part && along > ONE_LINE
                    };
                    let Some(next) = at_node[&end].iter().find(goes_on).copied() else {
                        break;
                    };
                    left.remove(&of(end, next));
                    match forward {
                        true => nodes.push_back(next),
                        false => nodes.push_front(next),
                    }
                }
            }
            let count = nodes.len() - 1;
            let parts = count.min(PARTS);
            let nodes = (0..=parts).map(|k| nodes[k * count / parts]).collect();
            lines.push(Line { part, nodes });
        }
        lines
    }

    /// Edges between outer faces that are not of one plane, with the first part that has them.
    fn sharp_edges(&self) -> BTreeMap<Edge, usize> {
        let mut outer: HashMap<[usize; 4], ([usize; 4], usize)> = HashMap::new();
        for element in &self.elements {
            for face in FACES {
                let nodes = face.map(|k| element.nodes[k]);
                let mut key = nodes;
                key.sort_unstable();
                // A face of two elements is within.
                if outer.remove(&key).is_none() {
                    outer.insert(key, (nodes, element.part));
                }
            }
        }
        let mut around: HashMap<Edge, Vec<([f64; 3], usize)>> = HashMap::new();
        for (nodes, part) in outer.values() {
            let [a, b, c, d] = nodes.map(|n| self.nodes[n]);
            let normal = unit(cross(minus(c, a), minus(d, b)));
            for k in 0..4 {
                let (a, b) = (nodes[k], nodes[(k + 1) % 4]);
                let faces = around.entry((a.min(b), a.max(b))).or_default();
                faces.push((normal, *part));
            }
        }
        let sharp = around.into_iter().filter(|(_, faces)| {
            let first = faces[0].0;
            let mut others = faces.iter().skip(1);
            // The order of the nodes of a face does not say which side is outside.
            others.any(|(normal, _)| product(first, *normal).abs() < ONE_PLANE)
        });
        let part = |faces: &[([f64; 3], usize)]| faces.iter().map(|(_, part)| *part).min();
        sharp
            .filter_map(|(edge, faces)| Some((edge, part(&faces)?)))
            .collect()
    }
}
