//! Compliance between the nodes of a coarse mesh, added to the compliance of the half spaces.
//!
//! The finite-element model of a structure ends in nodes on the contact plane and has a compliance between them. The
//! half spaces act on the same contact. The compliance that both models include must count only once. The compliance of
//! the cells is K + A_c S D Sᵀ. D is the added compliance between nodes \[m/N\]: the compliance of the structure minus
//! M. M is the compliance of the half spaces that the mesh of the structure already includes. A_c is the area of a
//! cell. S averages the bilinear interpolation between nodes over each cell. Sᵀ distributes the traction of a cell
//! among the nodes around the cell. The work on the nodes equals the work on the cell. S must average over the cell. If
//! S interpolated at the centre of a cell that crosses the border of two rectangles, K − A_c S M Sᵀ would not be
//! positive.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::ContactError;
use super::error::check_length;
use crate::grid::Grid;

/// Interpolation from the nodes of a mesh of equal rectangles to the cells of a grid over the same area. Each cell gets
/// the mean of the bilinear interpolation over it. Node (i, j) has the number `i * (counts[1] + 1) + j`. No cell is
/// longer than a rectangle.
#[derive(Debug, Clone, PartialEq)]
pub struct Interpolation {
    grid: Grid,
    counts: [usize; 2],
    /// Weights of the nodes along an axis, for each row and column of cells. Each entry of `axis_weights` has the index
    /// of the lowest contributing node, the weight of the lowest node, and the weights of the next two nodes.
    axis_weights: [Vec<(usize, [f64; 3])>; 2],
    /// Cells next to missing nodes, and how their nodal weights differ from the weights of the mean.
    weight_changes: Vec<(usize, Vec<(usize, f64)>)>,
}

/// Smallest nodal weight. Smaller weights are rounding errors, and the interpolation drops them.
const NEGLIGIBLE_WEIGHT: f64 = 1e-14;

/// Returns the integral from −1 to `at` of the hat function on −1 to 1 with height 1.
fn hat_integral(at: f64) -> f64 {
    let at = at.clamp(-1.0, 1.0);
    if at < 0.0 {
        0.5 * (1.0 + at).powi(2)
    } else {
        1.0 - 0.5 * (1.0 - at).powi(2)
    }
}

impl Interpolation {
    /// Creates the interpolation of a mesh of `counts` rectangles along x and y, each at least 1, over `grid`.
    ///
    /// # Panics
    /// Panics if the grid has fewer cells than rectangles along an axis.
    pub fn new(grid: Grid, counts: [usize; 2]) -> Self {
        let along = |cells: usize, rectangles: usize| -> Vec<(usize, [f64; 3])> {
            assert!(
                cells >= rectangles,
                "each rectangle must span at least one cell"
            );
            (0..cells)
                .map(|cell| {
                    // Lengths are integers divided by the number of cells. With integers, rounding does not move a
                    // border between two rectangles.
                    let node = cell * rectangles / cells;
                    let from = |end: usize, node: usize| {
                        (end * rectangles) as f64 / cells as f64 - node as f64
                    };
                    let length = rectangles as f64 / cells as f64;
                    let weights = [0, 1, 2].map(|k| {
                        let [low, high] =
                            [cell, cell + 1].map(|end| hat_integral(from(end, node + k)));
                        (high - low) / length
                    });
                    (node, weights)
                })
                .collect()
        };
        Interpolation {
            grid,
            counts,
            axis_weights: [along(grid.nx, counts[0]), along(grid.ny, counts[1])],
            weight_changes: Vec::new(),
        }
    }

    /// Removes missing nodes. If a cell needs a missing node, the interpolation at the centre of the cell replaces the
    /// mean over the cell. The interpolation at the centre preserves the moments of the forces. If the centre of a cell
    /// needs a missing node, the weights of the cell stay unchanged.
    pub fn without_missing_nodes(mut self, is_there: impl Fn(usize) -> bool) -> Self {
        let [nx, ny] = [self.grid.nx, self.grid.ny];
        let at_centre = |cells: usize, rectangles: usize, cell: usize| {
            // Integers in units of half a cell avoid rounding.
            let twice = (2 * cell + 1) * rectangles;
            let node = twice / (2 * cells);
            let upper = (twice - 2 * cells * node) as f64 / (2 * cells) as f64;
            [(node, 1.0 - upper), (node + 1, upper)]
        };
        self.weight_changes.clear();
        let mut moved = Vec::new();
        for cell in 0..self.grid.len() {
            let (i, j) = self.grid.cell(cell);
            let (x, y) = (
                at_centre(nx, self.counts[0], i),
                at_centre(ny, self.counts[1], j),
            );
            let pairs = x.into_iter().flat_map(|x| y.map(|y| (x, y)));
            let centre: Vec<(usize, f64)> = pairs
                .map(|((m, x), (n, y))| (m * (self.counts[1] + 1) + n, x * y))
                .filter(|(_, weight)| *weight > 0.0)
                .collect();
            let around: Vec<(usize, f64)> = self.nodal_weights(cell).collect();
            let is_within = centre.iter().all(|(node, _)| is_there(*node));
            if is_within && around.iter().any(|(node, _)| !is_there(*node)) {
                let mut change: BTreeMap<usize, f64> = BTreeMap::new();
                for (node, weight) in centre {
                    *change.entry(node).or_insert(0.0) += weight;
                }
                for (node, weight) in around {
                    *change.entry(node).or_insert(0.0) -= weight;
                }
                moved.push((cell, change.into_iter().collect()));
            }
        }
        self.weight_changes = moved;
        self
    }

    /// Returns the number of nodes.
    pub fn nodes(&self) -> usize {
        (self.counts[0] + 1) * (self.counts[1] + 1)
    }

    /// Returns the grid.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Returns the number of rectangles along x and y.
    pub fn counts(&self) -> [usize; 2] {
        self.counts
    }

    /// Returns the nodes that contribute to a cell, and the weights of the nodes. The weights sum to one.
    pub fn nodal_weights(&self, cell: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (i, j) = self.grid.cell(cell);
        let ((m, x), (n, y)) = (self.axis_weights[0][i], self.axis_weights[1][j]);
        let width = self.counts[1] + 1;
        let changes = self
            .weight_changes
            .binary_search_by_key(&cell, |(cell, _)| *cell);
        let changes = changes.map_or(&[][..], |place| &self.weight_changes[place].1);
        let pairs =
            (0..3).flat_map(move |a| (0..3).map(move |b| ((m + a) * width + n + b, x[a] * y[b])));
        pairs
            .filter(|(_, weight)| *weight > 0.0)
            .map(|(node, weight)| {
                let change = changes
                    .iter()
                    .find(|(changed_node, _)| *changed_node == node);
                (node, weight + change.map_or(0.0, |(_, change)| *change))
            })
            .filter(|(_, weight)| *weight > NEGLIGIBLE_WEIGHT)
    }

    /// Returns Sᵀ `field`: for each node the sum over the cells, weighted by the node's contribution.
    pub fn apply_transpose(&self, field: &[f64]) -> Vec<f64> {
        let width = self.counts[1] + 1;
        // Two extra rows and columns of nodes take the zero weights of the last cells.
        let mut sums = vec![0.0; (self.counts[0] + 3) * width];
        let mut row_sums = vec![0.0; width + 2];
        for (row, &(m, x)) in field.chunks_exact(self.grid.ny).zip(&self.axis_weights[0]) {
            row_sums.fill(0.0);
            for (value, &(n, y)) in row.iter().zip(&self.axis_weights[1]) {
                for (sum, weight) in row_sums[n..n + 3].iter_mut().zip(y) {
                    *sum += weight * value;
                }
            }
            for (k, weight) in x.into_iter().enumerate() {
                let node_sums = sums[(m + k) * width..].iter_mut();
                for (sum, value) in node_sums.zip(&row_sums[..width]) {
                    *sum += weight * value;
                }
            }
        }
        sums.truncate(self.nodes());
        for (cell, weights) in &self.weight_changes {
            weights
                .iter()
                .for_each(|(node, weight)| sums[*node] += weight * field[*cell]);
        }
        sums
    }

    /// `field` += `factor` S `values`.
    pub fn add_interpolated(&self, factor: f64, values: &[f64], field: &mut [f64]) {
        let width = self.counts[1] + 1;
        let mut row_values = vec![0.0; width + 2];
        for (row, &(m, x)) in field
            .chunks_exact_mut(self.grid.ny)
            .zip(&self.axis_weights[0])
        {
            row_values.fill(0.0);
            for (k, weight) in x.into_iter().enumerate().take(self.counts[0] + 1 - m) {
                let node_values = &values[(m + k) * width..(m + k + 1) * width];
                for (value, node_value) in row_values.iter_mut().zip(node_values) {
                    *value += factor * weight * node_value;
                }
            }
            for (value, &(n, y)) in row.iter_mut().zip(&self.axis_weights[1]) {
                *value +=
                    y[0] * row_values[n] + y[1] * row_values[n + 1] + y[2] * row_values[n + 2];
            }
        }
        for (cell, weights) in &self.weight_changes {
            let change = weights.iter().map(|(node, weight)| weight * values[*node]);
            field[*cell] += factor * change.sum::<f64>();
        }
    }
}

/// D, the compliance between nodes that is added to the half spaces. Matrices are `nodes × nodes`, row by row \[m/N\].
#[derive(Debug, Clone, PartialEq)]
pub struct NodalCompliance {
    /// Interpolation from nodes to cells.
    pub interpolation: Arc<Interpolation>,
    /// Separation of the bodies under normal forces that push them apart; symmetric.
    pub normal: Vec<f64>,
    /// Compliance for shear; `None` if nothing is added to the half spaces' compliance.
    pub shear: Option<ShearCompliance>,
}

/// In-plane part of [`NodalCompliance`].
#[derive(Debug, Clone, PartialEq)]
pub struct ShearCompliance {
    /// Displacement along x under forces along x; symmetric.
    pub xx: Vec<f64>,
    /// Displacement along y under forces along y; symmetric.
    pub yy: Vec<f64>,
    /// Displacement along x under forces along y. The transpose of `xy` is the displacement along y under forces along
    /// x.
    pub xy: Vec<f64>,
}

impl NodalCompliance {
    /// Checks that every matrix has one value per pair of nodes.
    ///
    /// # Errors
    /// Returns [`ContactError::Length`] for a matrix of another size.
    pub fn check(&self) -> Result<(), ContactError> {
        let pairs = self.interpolation.nodes().pow(2);
        let shear = self
            .shear
            .iter()
            .flat_map(|shear| [&shear.xx, &shear.yy, &shear.xy]);
        for matrix in shear.chain([&self.normal]) {
            check_length("compliance between nodes", matrix.len(), pairs)?;
        }
        Ok(())
    }

    /// Adds the displacement that a pressure causes \[m\].
    pub fn add_normal(&self, pressure: &[f64], displacement: &mut [f64]) {
        self.add(&self.normal, pressure, displacement);
    }

    /// Adds the displacement along x that a shear along x causes.
    pub(super) fn add_shear_x(&self, shear: &[f64], displacement: &mut [f64]) {
        if let Some(shear_compliance) = &self.shear {
            self.add(&shear_compliance.xx, shear, displacement);
        }
    }

    /// Adds the displacement that a shear along x and y causes.
    pub(super) fn add_shear(&self, shear: [&[f64]; 2], displacement: [&mut [f64]; 2]) {
        let Some(compliance) = &self.shear else {
            return;
        };
        let nodes = self.interpolation.nodes();
        let [x, y] = shear.map(|q| self.interpolation.apply_transpose(q));
        let mut nodal_displacement = [product(&compliance.xx, &x), product(&compliance.yy, &y)];
        for (value, from_y) in nodal_displacement[0]
            .iter_mut()
            .zip(product(&compliance.xy, &y))
        {
            *value += from_y;
        }
        for (row, x) in compliance.xy.chunks_exact(nodes).zip(&x) {
            for (value, c) in nodal_displacement[1].iter_mut().zip(row) {
                *value += c * x;
            }
        }
        for (nodal, displacement) in nodal_displacement.iter().zip(displacement) {
            let area = self.interpolation.grid.cell_area();
            self.interpolation
                .add_interpolated(area, nodal, displacement);
        }
    }

    /// Returns the matrix of compliances between blocks of cells \[m/Pa\], row by row. An entry of the matrix is the
    /// mean separation of one block divided by the sum of the pressures on the cells of another block. `blocks` gives
    /// the block of every cell, and every block must contain a cell.
    pub(super) fn block_compliance(&self, blocks: &[u32]) -> Vec<f64> {
        let (nodes, count) = (
            self.interpolation.nodes(),
            blocks.iter().max().map_or(0, |last| *last as usize + 1),
        );
        let mut cells = vec![0.0; count];
        let mut weights = vec![BTreeMap::new(); count];
        for (cell, &block) in blocks.iter().enumerate() {
            cells[block as usize] += 1.0;
            for (node, weight) in self.interpolation.nodal_weights(cell) {
                *weights[block as usize].entry(node).or_insert(0.0) += weight;
            }
        }
        let area = self.interpolation.grid.cell_area();
        let mut between = Vec::with_capacity(count * count);
        for (block_weights, cell_count) in weights.iter().zip(&cells) {
            let mut nodal_displacement = vec![0.0; nodes];
            for (&node, weight) in block_weights {
                let row = &self.normal[node * nodes..(node + 1) * nodes];
                let weight = area * weight / cell_count;
                nodal_displacement
                    .iter_mut()
                    .zip(row)
                    .for_each(|(m, c)| *m += weight * c);
            }
            between.extend(weights.iter().zip(&cells).map(|(other, cell_count)| {
                let terms = other
                    .iter()
                    .map(|(&node, weight)| weight * nodal_displacement[node]);
                terms.sum::<f64>() / cell_count
            }));
        }
        between
    }

    fn add(&self, matrix: &[f64], traction: &[f64], displacement: &mut [f64]) {
        let nodal_displacement = product(matrix, &self.interpolation.apply_transpose(traction));
        let area = self.interpolation.grid.cell_area();
        self.interpolation
            .add_interpolated(area, &nodal_displacement, displacement);
    }
}

fn product(matrix: &[f64], vector: &[f64]) -> Vec<f64> {
    let rows = matrix.chunks_exact(vector.len());
    rows.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
        .collect()
}
