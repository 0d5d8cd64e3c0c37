//! Memory that the reduction of a structure needs, estimated from its mesh or its matrices.

use super::StructureError;
use super::assembly::adjacency;
use super::imported::{ImportError, ImportedStructure};
use super::order::nested_dissection;
use super::reduction::ContactPorts;
use super::resonator::Resonator;

/// Number of degrees of freedom of a node.
const AXES: f64 = 3.0;
/// Size of a number \[B\], and of a number with its index in a sparse matrix \[B\].
const NUMBER: f64 = 8.0;
const ENTRY: f64 = 16.0;
/// Number of Lanczos vectors per converged mode.
const VECTORS_A_MODE: f64 = 2.0;

impl Resonator {
    /// Estimates the peak memory of [`Resonator::reduce`] for a given number of modes \[B\].
    ///
    /// The estimate is the sum of stiffness, mass, the shifted matrix, the factor of the shifted matrix, and one
    /// further term. The further term is the flexibility of the ports or the Lanczos basis, whichever is larger. The
    /// sparsity pattern of the factor follows from the mesh.
    ///
    /// # Errors
    /// [`StructureError`] for invalid dimensions.
    pub fn memory_to_reduce(&self, modes: usize) -> Result<f64, StructureError> {
        let meshed = self.mesh()?;
        let count = meshed.mesh.nodes.len();
        let groups: Vec<Vec<usize>> = meshed
            .mesh
            .elements
            .iter()
            .map(|element| element.nodes.to_vec())
            .collect();
        let (starts, neighbours) = adjacency(&groups, count);
        let mut last: Vec<usize> = meshed
            .contacts
            .iter()
            .flat_map(|contact| contact.pairs.iter().flat_map(|&(a, b)| [a, b]))
            .chain(
                meshed
                    .points
                    .iter()
                    .flat_map(|p| p.weights.iter().map(|w| w.0)),
            )
            .collect();
        last.sort_unstable();
        last.dedup();
        let order = nested_dissection(&meshed.mesh.nodes, &starts, &neighbours, &last);
        let below = below_diagonal(&order, &starts, &neighbours);
        let mut factor_entries = 0.0;
        for column in below {
            // The columns of a node in the factor also have entries in one to three rows of the same node.
            for own in 1..=3 {
                factor_entries += AXES * column as f64 + own as f64;
            }
        }
        let port_rows = AXES * last.len() as f64;
        let ports = AXES * (meshed.contacts.len() + meshed.points.len()) as f64;
        let vectors = VECTORS_A_MODE * modes as f64;
        let size = AXES * count as f64;
        let pairs = neighbours.len() as f64 / 2.0 + count as f64;
        // The mass does not couple different axes.
        let [stiffness, mass] = [9.0, 3.0].map(|coupled| ENTRY * coupled * pairs);
        let basis = NUMBER * size * vectors;
        let modes = flexibility(port_rows, ports).max(basis);
        Ok(2.0 * stiffness + mass + NUMBER * factor_entries + modes)
    }
}

impl ImportedStructure {
    /// Estimates the peak memory of [`ImportedStructure::reduce`] for a given number of modes \[B\].
    ///
    /// The estimate is the sum of the matrices before factorization, the matrices for the factorization, the factor,
    /// and one further term. The further term is the flexibility of the ports or the Lanczos basis, whichever is
    /// larger.
    ///
    /// # Errors
    /// [`ImportError`] for a contact element without nodes, and if the memory does not suffice for the pattern of the
    /// factor.
    pub fn memory_to_reduce(&self, modes: usize, at: ContactPorts) -> Result<f64, ImportError> {
        let ports = self.ports(at)?.combinations;
        let count = self.entries_to_reduce(&ports)?;
        let [stiffness, mass, factor, port_rows] = count.map(|n| n as f64);
        let vectors = VECTORS_A_MODE * modes as f64 * self.rows as f64;
        let modes = flexibility(port_rows, ports.len() as f64).max(NUMBER * vectors);
        Ok(ENTRY * (3.0 * stiffness + 2.0 * mass) + NUMBER * factor + modes)
    }
}

/// Returns the memory of the flexibility of the ports, from the dense factor of the rows that the ports use \[B\].
fn flexibility(port_rows: f64, ports: f64) -> f64 {
    NUMBER * (port_rows * port_rows + port_rows * ports + 2.0 * ports * ports)
}

/// Counts the rows below the diagonal in each column of the factor, in the order of elimination.
///
/// Row i fills the columns on the paths up the elimination tree from each of its entries to i.
fn below_diagonal(order: &[usize], starts: &[usize], neighbours: &[usize]) -> Vec<usize> {
    const NONE: usize = usize::MAX;
    let count = order.len();
    let mut place = vec![0; count];
    for (at, &node) in order.iter().enumerate() {
        place[node] = at;
    }
    let (mut parent, mut reached) = (vec![NONE; count], vec![NONE; count]);
    let mut below = vec![0; count];
    for row in 0..count {
        reached[row] = row;
        let node = order[row];
        for &other in &neighbours[starts[node]..starts[node + 1]] {
            let mut column = place[other];
            while column < row && reached[column] != row {
                reached[column] = row;
                below[column] += 1;
                if parent[column] == NONE {
                    parent[column] = row;
                }
                column = parent[column];
            }
        }
    }
    below
}
