//! Memory that the reduction of a structure needs, counted from its mesh or its matrices.

use super::StructureError;
use super::assembly::adjacency;
use super::imported::{ImportError, Imported};
use super::order::nested_dissection;
use super::reduction::ContactPorts;
use super::resonator::Resonator;

/// Degrees of freedom of a node.
const AXES: f64 = 3.0;
/// A number, and a number with its place in a sparse matrix \[B\].
const NUMBER: f64 = 8.0;
const ENTRY: f64 = 16.0;
/// Vectors of the search for modes: an iteration that finds so many modes to its tolerance looks at some twice as many.
const VECTORS_A_MODE: f64 = 2.0;

impl Resonator {
    /// Peak of memory of [`Resonator::reduce`] for this number of modes \[B\]: stiffness and mass, the sum of both that is factored, its factor,
    /// and the rows of the ports. The pattern of the factor follows from the mesh.
    ///
    /// # Errors
    /// [`StructureError`] for dimensions that make no mesh.
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
            // The three columns of a node have one another's rows too.
            for own in 1..=3 {
                factor_entries += AXES * column as f64 + own as f64;
            }
        }
        let held = AXES * last.len() as f64;
        let ports = AXES * (meshed.contacts.len() + meshed.points.len()) as f64;
        let vectors = VECTORS_A_MODE * modes as f64;
        let size = AXES * count as f64;
        let pairs = neighbours.len() as f64 / 2.0 + count as f64;
        // The mass couples an axis with itself alone.
        let [stiffness, mass] = [9.0, 3.0].map(|coupled| ENTRY * coupled * pairs);
        let basis = NUMBER * size * vectors;
        let modes = flexibility(held, ports).max(basis);
        Ok(2.0 * stiffness + mass + NUMBER * factor_entries + modes)
    }
}

impl Imported {
    /// Peak of memory of [`Imported::reduce`] for this number of modes \[B\]: the matrices as they were read and as they are factored, the factor, and
    /// the rows of the ports.
    ///
    /// # Errors
    /// [`ImportError`] for a contact element without nodes, and where memory does not suffice for the places of the factor's entries.
    pub fn memory_to_reduce(&self, modes: usize, at: ContactPorts) -> Result<f64, ImportError> {
        let ports = self.ports(at)?.combinations;
        let count = self.entries_to_reduce(&ports)?;
        let [stiffness, mass, factor, held] = count.map(|n| n as f64);
        let vectors = VECTORS_A_MODE * modes as f64 * self.rows as f64;
        let modes = flexibility(held, ports.len() as f64).max(NUMBER * vectors);
        Ok(ENTRY * (3.0 * stiffness + 2.0 * mass) + NUMBER * factor + modes)
    }
}

/// Bytes of the flexibility of the ports, from the dense factor of the rows that they hold.
fn flexibility(held: f64, ports: f64) -> f64 {
    NUMBER * (held * held + held * ports + 2.0 * ports * ports)
}

/// Rows below the diagonal in each column of the factor, in the order of elimination: row i fills the columns on the way from each
/// of its entries up the tree of elimination to i.
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
