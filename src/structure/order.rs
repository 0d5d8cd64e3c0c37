//! Elimination order: nested dissection if all coordinates are known, otherwise approximate minimum degree.

use std::collections::HashMap;

use super::StructureError;
use crate::linalg::{SparseSymmetric, minimum_degree};

/// The ordering does not divide a piece of at most `LEAF_SIZE` nodes. A piece of at most `LEAF_SIZE` nodes becomes
/// about one dense block of the factor.
const LEAF_SIZE: usize = 40;
/// Positions of trial cuts along an axis, as shares of the piece's nodes. An off-centre cut pays where the body is
/// thinner.
const SHARES: [f64; 5] = [0.35, 0.42, 0.5, 0.58, 0.65];

/// Computes an elimination order of the nodes by nested dissection. A plane cuts each piece of the mesh. The two sides
/// of the piece are ordered first, recursively, and the nodes on the cut last. The order ends with the nodes `last`, in
/// their given order.
///
/// The neighbours of node n are `adjacency[starts[n]..starts[n + 1]]`; coordinates are in metres.
pub fn nested_dissection(
    coordinates: &[[f64; 3]],
    starts: &[usize],
    adjacency: &[usize],
    last: &[usize],
) -> Vec<usize> {
    let count = coordinates.len();
    let mut dissection = Dissection {
        coordinates,
        starts,
        adjacency,
        side: vec![OUTSIDE; count],
        order: Vec::with_capacity(count),
    };
    let mut is_last = vec![false; count];
    for &n in last {
        is_last[n] = true;
    }
    dissection.cut((0..count).filter(|&n| !is_last[n]).collect());
    dissection.order.extend_from_slice(last);
    dissection.order
}

/// Computes an elimination order of matrix rows with little fill. The elimination order ends with the rows `last`, in
/// their given order.
///
/// With `places`, the position of each row \[any unit\], the method is nested dissection. For solids nested dissection
/// is far cheaper than minimum degree.
///
/// # Errors
/// [`StructureError::Factorization`] if the memory does not suffice.
pub fn elimination_order(
    matrix: &SparseSymmetric,
    places: Option<&[[f64; 3]]>,
    last: &[usize],
) -> Result<Vec<usize>, StructureError> {
    let mut is_last = vec![false; matrix.size()];
    for &row in last {
        is_last[row] = true;
    }
    let inner = match places {
        Some(places) => dissect_rows(matrix, places),
        None => {
            // The last rows are excluded, because they would change the degrees of the others.
            let others: Vec<usize> = (0..matrix.size()).filter(|&row| !is_last[row]).collect();
            let mut place = vec![None; matrix.size()];
            for (k, &row) in others.iter().enumerate() {
                place[row] = Some(k as u32);
            }
            let entries: Vec<(u32, u32, f64)> = (0..matrix.size())
                .flat_map(|j| matrix.column(j).map(move |(i, v)| (j, i, v)))
                .filter_map(|(j, i, v)| Some((place[j]?, place[i]?, v)))
                .collect();
            let inner = SparseSymmetric::from_sorted(others.len(), &entries);
            let order = minimum_degree(&inner).map_err(|source| StructureError::Factorization {
                matrix: "the stiffness",
                source,
            })?;
            order.into_iter().map(|row| others[row]).collect()
        }
    };
    let inner = inner.into_iter().filter(|&row| !is_last[row]);
    Ok(inner.chain(last.iter().copied()).collect())
}

/// Orders rows by nested dissection of their positions.
fn dissect_rows(matrix: &SparseSymmetric, places: &[[f64; 3]]) -> Vec<usize> {
    let mut node_at = HashMap::new();
    let mut coordinates = Vec::new();
    let mut rows_of: Vec<Vec<usize>> = Vec::new();
    let mut node_of = Vec::with_capacity(places.len());
    for (row, place) in places.iter().enumerate() {
        let node = *node_at.entry(place.map(f64::to_bits)).or_insert_with(|| {
            coordinates.push(*place);
            rows_of.push(Vec::new());
            coordinates.len() - 1
        });
        rows_of[node].push(row);
        node_of.push(node);
    }
    let mut neighbours: Vec<Vec<usize>> = vec![Vec::new(); coordinates.len()];
    for j in 0..matrix.size() {
        for (i, _) in matrix.column(j) {
            let (a, b) = (node_of[j], node_of[i]);
            // The following rows of a node have the same neighbours.
            if a != b && neighbours[a].last() != Some(&b) {
                neighbours[a].push(b);
                neighbours[b].push(a);
            }
        }
    }
    let mut starts = vec![0];
    let mut adjacency = Vec::new();
    for mut list in neighbours {
        list.sort_unstable();
        list.dedup();
        adjacency.extend(list);
        starts.push(adjacency.len());
    }
    let order = nested_dissection(&coordinates, &starts, &adjacency, &[]);
    order
        .into_iter()
        .flat_map(|node| std::mem::take(&mut rows_of[node]))
        .collect()
}

const OUTSIDE: u8 = 0;
const NEAR: u8 = 1;
const FAR: u8 = 2;
const CUT: u8 = 3;

struct Dissection<'a> {
    coordinates: &'a [[f64; 3]],
    starts: &'a [usize],
    adjacency: &'a [usize],
    /// Mark of each node of the current piece. All other nodes are [`OUTSIDE`].
    side: Vec<u8>,
    order: Vec<usize>,
}

impl Dissection<'_> {
    fn neighbours(&self, node: usize) -> &[usize] {
        &self.adjacency[self.starts[node]..self.starts[node + 1]]
    }

    fn cut(&mut self, mut piece: Vec<usize>) {
        if piece.len() <= LEAF_SIZE {
            let axis = self.longest_axis(&piece);
            self.sort(&mut piece, axis);
            self.order.extend(piece);
            return;
        }
        let Some((axis, level)) = self.best_cut(&mut piece) else {
            self.order.extend(piece);
            return;
        };
        self.mark(&piece, axis, level);
        let marked = |mark: u8| -> Vec<usize> {
            let on = piece.iter().copied().filter(|&n| self.side[n] == mark);
            on.collect()
        };
        let (near, far, mut separator) = (marked(NEAR), marked(FAR), marked(CUT));
        for &n in &piece {
            self.side[n] = OUTSIDE;
        }
        drop(piece);
        self.cut(near);
        self.cut(far);
        let axis = self.longest_axis(&separator);
        self.sort(&mut separator, axis);
        self.order.extend(separator);
    }

    /// Returns the axis and the coordinate of the cut with the fewest nodes per node of its smaller side.
    fn best_cut(&mut self, piece: &mut [usize]) -> Option<(usize, f64)> {
        let mut best: Option<(f64, usize, f64)> = None;
        for axis in 0..3 {
            self.sort(piece, axis);
            let mut last_level = f64::NAN;
            for share in SHARES {
                let level = self.coordinates[piece[(share * piece.len() as f64) as usize]][axis];
                if level == last_level {
                    continue;
                }
                last_level = level;
                let [near, far, cut] = self.mark(piece, axis, level);
                if near > 0 && far > 0 {
                    let cost = cut as f64 / near.min(far) as f64;
                    if best.is_none_or(|b| cost < b.0) {
                        best = Some((cost, axis, level));
                    }
                }
            }
        }
        for &n in piece.iter() {
            self.side[n] = OUTSIDE;
        }
        best.map(|b| (b.1, b.2))
    }

    /// Marks the nodes of a piece below a level as near. Marks nodes above the level as cut if they have a near
    /// neighbour, and all other nodes as far. Returns the numbers of near, far and cut nodes.
    fn mark(&mut self, piece: &[usize], axis: usize, level: f64) -> [usize; 3] {
        for &n in piece {
            self.side[n] = if self.coordinates[n][axis] < level {
                NEAR
            } else {
                FAR
            };
        }
        let mut count = [0; 3];
        for &n in piece {
            if self.side[n] == NEAR {
                count[0] += 1;
            } else if self.neighbours(n).iter().any(|&m| self.side[m] == NEAR) {
                self.side[n] = CUT;
                count[2] += 1;
            } else {
                count[1] += 1;
            }
        }
        count
    }

    fn longest_axis(&self, piece: &[usize]) -> usize {
        let extent = |axis: usize| {
            let values = || piece.iter().map(|&n| self.coordinates[n][axis]);
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        };
        let extents = [0, 1, 2].map(extent);
        (0..3).fold(0, |a, b| if extents[b] > extents[a] { b } else { a })
    }

    /// Sorts nodes by one coordinate. Nodes with equal coordinates are sorted by number, so that every machine has the
    /// same order.
    fn sort(&self, piece: &mut [usize], axis: usize) {
        piece.sort_unstable_by(|&a, &b| {
            self.coordinates[a][axis]
                .total_cmp(&self.coordinates[b][axis])
                .then(a.cmp(&b))
        });
    }
}
