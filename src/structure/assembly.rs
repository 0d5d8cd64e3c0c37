//! Sparse stiffness and mass of a mesh.

use crate::linalg::{LinalgError, SparseCholesky, SparseSymmetric};
use crate::structure::StructureError;
use crate::structure::element::{Formulation, matrices};
use crate::structure::mesh::Mesh;
use crate::structure::order::nested_dissection;

/// Linear combination of degrees of freedom, as pairs of a number and a weight.
pub type Combination = Vec<(usize, f64)>;

/// Spring between nodes. The spring resists a combination of displacements with the force `stiffness * value`, where
/// `value` is the value of the combination.
#[derive(Debug, Clone, PartialEq)]
pub struct Spring {
    /// Combination of displacements that the spring resists.
    pub on: Combination,
    /// Stiffness \[N/m\].
    pub stiffness: f64,
}

/// Stiffness and mass of a structure with three degrees of freedom per node.
#[derive(Debug, Clone, PartialEq)]
pub struct System {
    /// Stiffness \[N/m\].
    pub stiffness: SparseSymmetric,
    /// Consistent mass \[kg\].
    pub mass: SparseSymmetric,
    /// Position of each node \[m\].
    pub coordinates: Vec<[f64; 3]>,
    /// Neighbours of node n are `adjacency[adjacency_starts[n]..adjacency_starts[n + 1]]`, ascending.
    adjacency_starts: Vec<usize>,
    adjacency: Vec<usize>,
}

impl System {
    /// Assembles the elements of a mesh and the springs between its nodes.
    ///
    /// # Errors
    /// [`StructureError`] for an inverted element, and for a node, degree of freedom or material that does not exist.
    pub fn assemble(
        mesh: &Mesh,
        formulation: Formulation,
        springs: &[Spring],
    ) -> Result<System, StructureError> {
        mesh.check()?;
        let count = mesh.nodes.len();
        let mut groups: Vec<Vec<usize>> = mesh.elements.iter().map(|e| e.nodes.to_vec()).collect();
        for spring in springs {
            let mut nodes = Vec::new();
            for &(dof, _) in &spring.on {
                if dof >= 3 * count {
                    return Err(StructureError::DoesNotExist {
                        what: "degree of freedom",
                        index: dof,
                        count: 3 * count,
                    });
                }
                nodes.push(dof / 3);
            }
            nodes.sort_unstable();
            nodes.dedup();
            groups.push(nodes);
        }
        let (adjacency_starts, adjacency) = adjacency(&groups, count);
        let mut system = System {
            stiffness: pattern(&adjacency_starts, &adjacency, |_, _| true),
            mass: pattern(&adjacency_starts, &adjacency, |a, b| a == b),
            coordinates: mesh.nodes.clone(),
            adjacency_starts,
            adjacency,
        };
        for (e, element) in mesh.elements.iter().enumerate() {
            let material = &mesh.materials[element.material];
            let element_matrices = matrices(&mesh.corners_of(e), material, formulation, e)?;
            for (p, &node) in element.nodes.iter().enumerate() {
                for (q, &other) in element.nodes.iter().enumerate() {
                    for a in 0..3 {
                        let column = 3 * other + a;
                        if node >= other {
                            add(
                                &mut system.mass,
                                3 * node + a,
                                column,
                                element_matrices.mass[p][q],
                            );
                        }
                        for b in 0..3 {
                            if 3 * node + b >= column {
                                let value = element_matrices.stiffness[3 * p + b][3 * q + a];
                                add(&mut system.stiffness, 3 * node + b, column, value);
                            }
                        }
                    }
                }
            }
        }
        for spring in springs {
            for &(row, row_weight) in &spring.on {
                for &(column, other) in &spring.on {
                    if row >= column {
                        let value = spring.stiffness * row_weight * other;
                        add(&mut system.stiffness, row, column, value);
                    }
                }
            }
        }
        Ok(system)
    }

    /// Returns the number of degrees of freedom.
    pub fn size(&self) -> usize {
        3 * self.coordinates.len()
    }

    /// Returns the mass of the structure \[kg\].
    pub fn total_mass(&self) -> f64 {
        let mut total = 0.0;
        for column in (0..self.size()).step_by(3) {
            for (row, value) in self.mass.column(column) {
                total += if row == column { value } else { 2.0 * value };
            }
        }
        total
    }

    /// Returns the connected bodies: the number of each node's body, and the number of bodies.
    pub fn bodies(&self) -> (Vec<usize>, usize) {
        let count = self.coordinates.len();
        let mut body = vec![usize::MAX; count];
        let mut bodies = 0;
        let mut open = Vec::new();
        for first in 0..count {
            if body[first] != usize::MAX {
                continue;
            }
            body[first] = bodies;
            open.push(first);
            while let Some(node) = open.pop() {
                let range = self.adjacency_starts[node]..self.adjacency_starts[node + 1];
                for &next in &self.adjacency[range] {
                    if body[next] == usize::MAX {
                        body[next] = bodies;
                        open.push(next);
                    }
                }
            }
            bodies += 1;
        }
        (body, bodies)
    }

    /// Computes an elimination order of the degrees of freedom that ends with the nodes `last`.
    pub fn elimination_order(&self, last: &[usize]) -> Vec<usize> {
        nested_dissection(
            &self.coordinates,
            &self.adjacency_starts,
            &self.adjacency,
            last,
        )
        .into_iter()
        .flat_map(|node| [3 * node, 3 * node + 1, 3 * node + 2])
        .collect()
    }

    /// Factorizes K + shift·M. A positive shift \[rad²/s²\] makes the matrix positive definite.
    pub fn shifted_factor(
        &self,
        shift: f64,
        order: &[usize],
    ) -> Result<SparseCholesky, StructureError> {
        SparseCholesky::new(&self.stiffness.plus(shift, &self.mass), order).map_err(
            |source: LinalgError| StructureError::Factorization {
                matrix: "the shifted stiffness",
                source,
            },
        )
    }
}

/// Returns the neighbours of each node, without the node itself, from groups of nodes that are coupled to each other.
/// The neighbours of node n are at `starts[n]..starts[n + 1]`.
pub(super) fn adjacency(groups: &[Vec<usize>], count: usize) -> (Vec<usize>, Vec<usize>) {
    let mut groups_of_node: Vec<Vec<usize>> = vec![Vec::new(); count];
    for (g, group) in groups.iter().enumerate() {
        for &n in group {
            groups_of_node[n].push(g);
        }
    }
    let mut starts = vec![0];
    let mut neighbours = Vec::new();
    let mut node_neighbours = Vec::new();
    for (n, node_groups) in groups_of_node.iter().enumerate() {
        node_neighbours.clear();
        for &g in node_groups {
            node_neighbours.extend(groups[g].iter().copied().filter(|&m| m != n));
        }
        node_neighbours.sort_unstable();
        node_neighbours.dedup();
        neighbours.extend_from_slice(&node_neighbours);
        starts.push(neighbours.len());
    }
    (starts, neighbours)
}

/// Builds a matrix of zeros whose pattern couples each node with itself and its neighbours. `coupled(a, b)` is true
/// if axis a of the row is coupled with axis b of the column.
fn pattern(
    starts: &[usize],
    adjacency: &[usize],
    coupled: impl Fn(usize, usize) -> bool,
) -> SparseSymmetric {
    let mut matrix = SparseSymmetric {
        starts: vec![0],
        rows: Vec::new(),
        values: Vec::new(),
    };
    for node in 0..starts.len() - 1 {
        for b in 0..3 {
            let neighbours = adjacency[starts[node]..starts[node + 1]].iter();
            for &other in std::iter::once(&node).chain(neighbours.filter(|&&m| m > node)) {
                for a in 0..3 {
                    if coupled(a, b) && 3 * other + a >= 3 * node + b {
                        matrix.rows.push(3 * other + a);
                    }
                }
            }
            matrix.starts.push(matrix.rows.len());
        }
    }
    matrix.values = vec![0.0; matrix.rows.len()];
    matrix
}

/// Adds a value to an entry on or below the diagonal. The pattern must have the entry.
fn add(matrix: &mut SparseSymmetric, row: usize, column: usize, value: f64) {
    let range = matrix.starts[column]..matrix.starts[column + 1];
    let place = matrix.rows[range.clone()]
        .binary_search(&row)
        .expect("the pattern was made from the same elements and springs");
    matrix.values[range.start + place] += value;
}
