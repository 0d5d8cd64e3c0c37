//! Meshes of hexahedra, and points on them.

use crate::material::Material;
use crate::structure::StructureError;
use crate::structure::element::{self, invert, jacobian, shape};

/// 8-node hexahedron of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hexahedron {
    /// Nodes of the element, in the order of [`crate::structure::element`].
    pub nodes: [usize; 8],
    /// Material of the element, as an index into [`Mesh::materials`].
    pub material: usize,
    /// Part that the element belongs to. The code that makes the mesh defines the numbers.
    pub part: usize,
}

/// Mesh of hexahedra.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Position of each node \[m\].
    pub nodes: Vec<[f64; 3]>,
    /// The elements.
    pub elements: Vec<Hexahedron>,
    /// The materials.
    pub materials: Vec<Material>,
}

/// Point of a structure between nodes. The displacement of the point is the weighted sum of the displacements of nodes.
/// A force on the point is distributed to the nodes by the weights of the displacements.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Name of the point in the scene.
    pub name: String,
    /// Position \[m\].
    pub position: [f64; 3],
    /// Nodes around the point, and the weights of the nodes, which sum to one.
    pub weights: Vec<(usize, f64)>,
}

/// Tolerance in natural coordinates for a point on the face of an element. The tolerance allows for rounding of the
/// position.
const ON_FACE: f64 = 1e-9;
/// A weight of a node below `NO_WEIGHT` is a rounding error. If a node has a weight below `NO_WEIGHT`, the point is on
/// the face or edge opposite to the node.
const NO_WEIGHT: f64 = 1e-9;
/// Largest number of Newton steps to find natural coordinates. A parallelepiped takes one, a distorted element a few.
const LOCATE_STEPS: usize = 30;

impl Mesh {
    /// Makes a box of `size` \[m\] from the origin, divided into `cells` along each axis. The numbers of nodes and
    /// elements increase fastest along x, then along y, then along z.
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

    /// Returns the positions of an element's nodes \[m\].
    pub fn corners_of(&self, element: usize) -> [[f64; 3]; 8] {
        self.elements[element].nodes.map(|n| self.nodes[n])
    }

    /// Returns the point at a position in or on the mesh. The weights are the shape functions of its element.
    ///
    /// # Errors
    /// [`StructureError::PointOutside`] if no element contains the position.
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

    /// Checks that the nodes and the material of every element exist. Checks that every material is valid.
    pub fn check(&self) -> Result<(), StructureError> {
        for material in &self.materials {
            element::check(material)?;
        }
        for element in &self.elements {
            for &index in &element.nodes {
                if index >= self.nodes.len() {
                    return Err(StructureError::DoesNotExist {
                        what: "node",
                        index,
                        count: self.nodes.len(),
                    });
                }
            }
            if element.material >= self.materials.len() {
                return Err(StructureError::DoesNotExist {
                    what: "material",
                    index: element.material,
                    count: self.materials.len(),
                });
            }
        }
        Ok(())
    }
}

/// Returns the grid positions of the corners of cell (i, j, k). The corners are in the order of the nodes of an
/// element.
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

/// Returns the natural coordinates of a position, or `None` outside the element.
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
        let offset =
            [0, 1, 2].map(|a| position[a] - (0..8).map(|n| weights[n] * nodes[n][a]).sum::<f64>());
        let (_, inverse) = invert(&jacobian(nodes, natural));
        for m in 0..3 {
            natural[m] += (0..3).map(|a| inverse[m][a] * offset[a]).sum::<f64>();
        }
        if offset.iter().all(|m| m.abs() <= 1e-3 * ON_FACE * size) {
            break;
        }
    }
    // The comparison `abs() <= 1.0 + ON_FACE` rejects the NaN of a diverged iteration.
    natural
        .iter()
        .all(|x| x.abs() <= 1.0 + ON_FACE)
        .then_some(natural)
}
