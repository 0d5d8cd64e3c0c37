//! Meshes of hexahedra, and points on them.

use crate::material::Material;
use crate::structure::StructureError;
use crate::structure::element::{self, invert, jacobian, shape};

/// An 8-node hexahedron of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hexahedron {
    /// Its nodes, in the order of [`crate::structure::element`].
    pub nodes: [usize; 8],
    /// Its material, by place in [`Mesh::materials`].
    pub material: usize,
    /// The part it belongs to; what the numbers mean is the mesh's maker's to say.
    pub part: usize,
}

/// A mesh of hexahedra.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Position of each node \[m\].
    pub nodes: Vec<[f64; 3]>,
    /// The elements.
    pub elements: Vec<Hexahedron>,
    /// The materials.
    pub materials: Vec<Material>,
}

/// A point of the structure between nodes: its displacement is the weighted sum of those of the nodes, and a force on it acts
/// on the nodes by the same weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Name, as the scene knows it.
    pub name: String,
    /// Where it is \[m\].
    pub position: [f64; 3],
    /// Nodes and their weights, which sum to one.
    pub weights: Vec<(usize, f64)>,
}

/// How far outside an element, in its natural coordinates, a point may lie and still be on its face: positions are rounded.
const ON_FACE: f64 = 1e-9;
/// Weights below this are rounding: the point lies on the face or edge opposite to that node.
const NO_WEIGHT: f64 = 1e-9;
/// Newton steps to find natural coordinates; a parallelepiped takes one, a distorted element a few.
const LOCATE_STEPS: usize = 30;

impl Mesh {
    /// A box of `size` \[m\] from the origin, cut into `cells` along each axis. Nodes are numbered with x fastest, then y, then
    /// z, elements likewise.
    pub fn block(size: [f64; 3], cells: [usize; 3], material: Material) -> Mesh {
        let points = cells.map(|c| c + 1);
        let node = |i: usize, j: usize, k: usize| i + points[0] * (j + points[1] * k);
        let mut nodes = Vec::with_capacity(points.iter().product());
        for k in 0..points[2] {
            for j in 0..points[1] {
                for i in 0..points[0] {
                    let place = [i, j, k];
                    nodes.push([0, 1, 2].map(|a| size[a] * place[a] as f64 / cells[a] as f64));
                }
            }
        }
        let mut elements = Vec::with_capacity(cells.iter().product());
        for k in 0..cells[2] {
            for j in 0..cells[1] {
                for i in 0..cells[0] {
                    elements.push(Hexahedron {
                        nodes: corners(i, j, k).map(|c| node(c[0], c[1], c[2])),
                        material: 0,
                        part: 0,
                    });
                }
            }
        }
        Mesh {
            nodes,
            elements,
            materials: vec![material],
        }
    }

    /// Positions of an element's nodes \[m\].
    pub fn corners_of(&self, element: usize) -> [[f64; 3]; 8] {
        self.elements[element].nodes.map(|n| self.nodes[n])
    }

    /// The point at a position in or on the mesh, weighted by the shape functions of the element it lies in.
    ///
    /// # Errors
    /// [`StructureError::PointOutside`] if it lies in none.
    pub fn point(&self, name: &str, position: [f64; 3]) -> Result<Point, StructureError> {
        for (e, element) in self.elements.iter().enumerate() {
            if let Some(natural) = locate(&self.corners_of(e), position) {
                let weights = element.nodes.into_iter().zip(shape(natural));
                return Ok(Point {
                    name: name.to_owned(),
                    position,
                    weights: weights.filter(|w| w.1.abs() > NO_WEIGHT).collect(),
                });
            }
        }
        Err(StructureError::PointOutside {
            name: name.to_owned(),
            position,
        })
    }

    /// Checks that every element has nodes and a material that exist, and every material is one.
    pub fn check(&self) -> Result<(), StructureError> {
        for material in &self.materials {
            element::check(material)?;
        }
        for element in &self.elements {
            for &index in &element.nodes {
                if index >= self.nodes.len() {
                    return Err(StructureError::NoSuch {
                        what: "node",
                        index,
                        count: self.nodes.len(),
                    });
                }
            }
            if element.material >= self.materials.len() {
                return Err(StructureError::NoSuch {
                    what: "material",
                    index: element.material,
                    count: self.materials.len(),
                });
            }
        }
        Ok(())
    }
}

/// Grid positions of the corners of cell (i, j, k), in the element's order of nodes.
pub(crate) fn corners(i: usize, j: usize, k: usize) -> [[usize; 3]; 8] {
    [
        [i, j, k],
        [i + 1, j, k],
        [i + 1, j + 1, k],
        [i, j + 1, k],
        [i, j, k + 1],
        [i + 1, j, k + 1],
        [i + 1, j + 1, k + 1],
        [i, j + 1, k + 1],
    ]
}

/// Natural coordinates of a position, if it lies in the element.
fn locate(nodes: &[[f64; 3]; 8], position: [f64; 3]) -> Option<[f64; 3]> {
    let mut size = 0.0_f64;
    for a in 0..3 {
        let low = nodes.iter().map(|x| x[a]).fold(f64::INFINITY, f64::min);
        let high = nodes.iter().map(|x| x[a]).fold(f64::NEG_INFINITY, f64::max);
        let slack = ON_FACE * (high - low);
        if position[a] < low - slack || position[a] > high + slack {
            return None;
        }
        size = size.max(high - low);
    }
    let mut natural = [0.0; 3];
    for _ in 0..LOCATE_STEPS {
        let weights = shape(natural);
        let miss =
            [0, 1, 2].map(|a| position[a] - (0..8).map(|n| weights[n] * nodes[n][a]).sum::<f64>());
        let (_, inverse) = invert(&jacobian(nodes, natural));
        for m in 0..3 {
            natural[m] += (0..3).map(|a| inverse[m][a] * miss[a]).sum::<f64>();
        }
        if miss.iter().all(|m| m.abs() <= 1e-3 * ON_FACE * size) {
            break;
        }
    }
    // A coordinate that is not a number (the iteration left the element for good) is not inside.
    natural
        .iter()
        .all(|x| x.abs() <= 1.0 + ON_FACE)
        .then_some(natural)
}
