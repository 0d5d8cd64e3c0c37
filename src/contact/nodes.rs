//! Compliance between the nodes of a coarse mesh over the grid, added to that of the half spaces.
//!
//! The model of a structure ends in nodes on the contact plane, and has a compliance between them. Where both models act on one
//! contact, what both have must be counted once: the compliance of the cells is then K + S D Sᵀ A_c, with D the compliance between
//! nodes that is to be added \[m/N\] (what the structure has, less what its mesh has of the half spaces), A_c the area of a cell, and
//! S the mean over each cell of the bilinear interpolation between the nodes. Its transpose shares the traction of a cell among the
//! nodes around it, so that work done on the cells is work done on the nodes. With the interpolation's value at the centre in place of its
//! mean, K − A_c S M Sᵀ would not be positive where a cell lies across the border of two rectangles.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::ContactError;
use super::error::check_length;
use crate::grid::Grid;

/// Means over the cells of a grid of the bilinear interpolation between the nodes of a mesh of equal rectangles over it.
/// Node (i, j) is number `i * (counts[1] + 1) + j`. No cell is longer than a rectangle.
#[derive(Debug, Clone, PartialEq)]
pub struct Interpolation {
    grid: Grid,
    counts: [usize; 2],
    /// For each row and column of cells the lowest node along the axis that it has a part in, and its parts in this one and the two next.
    along: [Vec<(usize, [f64; 3])>; 2],
    /// Cells next to missing nodes: by how much their parts differ from the means.
    moved: Vec<(usize, Vec<(usize, f64)>)>,
}

/// A part of a cell below this is rounding.
const PARTLESS: f64 = 1e-14;

/// The integral from −1 up to `at` of the hat over −1 to 1 whose top is 1.
fn hat_integral(at: f64) -> f64 {
    let at = at.clamp(-1.0, 1.0);
    if at < 0.0 {
        0.5 * (1.0 + at).powi(2)
    } else {
        1.0 - 0.5 * (1.0 - at).powi(2)
    }
}

impl Interpolation {
    /// Of a mesh of `counts` rectangles along x and y, each at least one, over the rectangle of `grid`.
    ///
    /// # Panics
    /// On a grid that has fewer cells along an axis than rectangles.
    pub fn new(grid: Grid, counts: [usize; 2]) -> Self {
        let along = |cells: usize, rectangles: usize| -> Vec<(usize, [f64; 3])> {
            assert!(
                cells >= rectangles,
                "cells that are no longer than rectangles"
            );
            (0..cells)
                .map(|cell| {
                    // In parts of a rectangle over the number of cells, whole numbers: no border depends on rounding.
                    let node = cell * rectangles / cells;
                    let from = |end: usize, node: usize| {
                        (end * rectangles) as f64 / cells as f64 - node as f64
                    };
                    let length = rectangles as f64 / cells as f64;
                    let parts = [0, 1, 2].map(|k| {
                        let [low, high] =
                            [cell, cell + 1].map(|end| hat_integral(from(end, node + k)));
                        (high - low) / length
                    });
                    (node, parts)
                })
                .collect()
        };
        Interpolation {
            grid,
            counts,
            along: [along(grid.nx, counts[0]), along(grid.ny, counts[1])],
            moved: Vec::new(),
        }
    }

    /// Where some nodes are not there: a cell with a part in one of these has the interpolation at its centre in place of its mean, so that
    /// forces keep their moments. One whose centre is not between nodes that are there keeps its parts.
    pub fn without(mut self, is_there: impl Fn(usize) -> bool) -> Self {
        let [nx, ny] = [self.grid.nx, self.grid.ny];
        let at_centre = |cells: usize, rectangles: usize, cell: usize| {
            // In half cells, whole numbers.
            let twice = (2 * cell + 1) * rectangles;
            let node = twice / (2 * cells);
            let upper = (twice - 2 * cells * node) as f64 / (2 * cells) as f64;
            [(node, 1.0 - upper), (node + 1, upper)]
        };
        self.moved.clear();
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
                .filter(|(_, part)| *part > 0.0)
                .collect();
            let around: Vec<(usize, f64)> = self.around(cell).collect();
            let is_within = centre.iter().all(|(node, _)| is_there(*node));
            if is_within && around.iter().any(|(node, _)| !is_there(*node)) {
                let mut change: BTreeMap<usize, f64> = BTreeMap::new();
                for (node, part) in centre {
                    *change.entry(node).or_insert(0.0) += part;
                }
                for (node, part) in around {
                    *change.entry(node).or_insert(0.0) -= part;
                }
                moved.push((cell, change.into_iter().collect()));
            }
        }
        self.moved = moved;
        self
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        (self.counts[0] + 1) * (self.counts[1] + 1)
    }

    /// The grid.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Rectangles along x and y.
    pub fn counts(&self) -> [usize; 2] {
        self.counts
    }

    /// The nodes that a cell has a part in, with its parts, which sum to one.
    pub fn around(&self, cell: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (i, j) = self.grid.cell(cell);
        let ((m, x), (n, y)) = (self.along[0][i], self.along[1][j]);
        let width = self.counts[1] + 1;
        let moved = self.moved.binary_search_by_key(&cell, |(cell, _)| *cell);
        let moved = moved.map_or(&[][..], |place| &self.moved[place].1);
        let pairs =
            (0..3).flat_map(move |a| (0..3).map(move |b| ((m + a) * width + n + b, x[a] * y[b])));
        pairs
            .filter(|(_, part)| *part > 0.0)
            .map(|(node, part)| {
                let change = moved.iter().find(|(of, _)| *of == node);
                (node, part + change.map_or(0.0, |(_, change)| *change))
            })
            .filter(|(_, part)| *part > PARTLESS)
    }

    /// Sᵀ `field`: the sums over the cells, each in the parts of its nodes.
    pub fn sums(&self, field: &[f64]) -> Vec<f64> {
        let width = self.counts[1] + 1;
        // Two more along each axis, for the parts that a last cell does not have.
        let mut sums = vec![0.0; (self.counts[0] + 3) * width];
        let mut of_row = vec![0.0; width + 2];
        for (row, &(m, x)) in field.chunks_exact(self.grid.ny).zip(&self.along[0]) {
            of_row.fill(0.0);
            for (value, &(n, y)) in row.iter().zip(&self.along[1]) {
                for (sum, part) in of_row[n..n + 3].iter_mut().zip(y) {
                    *sum += part * value;
                }
            }
            for (k, part) in x.into_iter().enumerate() {
                let of_node = sums[(m + k) * width..].iter_mut();
                for (sum, value) in of_node.zip(&of_row[..width]) {
                    *sum += part * value;
                }
            }
        }
        sums.truncate(self.nodes());
        for (cell, parts) in &self.moved {
            parts
                .iter()
                .for_each(|(node, part)| sums[*node] += part * field[*cell]);
        }
        sums
    }

    /// `field` += `factor` S `values`.
    pub fn add(&self, factor: f64, values: &[f64], field: &mut [f64]) {
        let width = self.counts[1] + 1;
        let mut of_row = vec![0.0; width + 2];
        for (row, &(m, x)) in field.chunks_exact_mut(self.grid.ny).zip(&self.along[0]) {
            of_row.fill(0.0);
            for (k, part) in x.into_iter().enumerate().take(self.counts[0] + 1 - m) {
                let of_node = &values[(m + k) * width..(m + k + 1) * width];
                for (value, of_node) in of_row.iter_mut().zip(of_node) {
                    *value += factor * part * of_node;
                }
            }
            for (value, &(n, y)) in row.iter_mut().zip(&self.along[1]) {
                *value += y[0] * of_row[n] + y[1] * of_row[n + 1] + y[2] * of_row[n + 2];
            }
        }
        for (cell, parts) in &self.moved {
            let change = parts.iter().map(|(node, part)| part * values[*node]);
            field[*cell] += factor * change.sum::<f64>();
        }
    }
}

/// D, the compliance between nodes that is added to the half spaces'. Matrices of `nodes × nodes`, row by row \[m/N\].
#[derive(Debug, Clone, PartialEq)]
pub struct NodalCompliance {
    /// From nodes to cells.
    pub interpolation: Arc<Interpolation>,
    /// By how much the bodies part under normal forces that press them apart; symmetric.
    pub normal: Vec<f64>,
    /// The same for shear; `None` where nothing is added to it.
    pub shear: Option<ShearCompliance>,
}

/// The part of [`NodalCompliance`] in the plane.
#[derive(Debug, Clone, PartialEq)]
pub struct ShearCompliance {
    /// Displacement along x under forces along x; symmetric.
    pub xx: Vec<f64>,
    /// Along y under forces along y; symmetric.
    pub yy: Vec<f64>,
    /// Along x under forces along y; its transpose is that along y under forces along x.
    pub xy: Vec<f64>,
}

impl NodalCompliance {
    /// Checks that every matrix has a value for every pair of nodes.
    ///
    /// # Errors
    /// [`ContactError::Length`].
    pub fn check(&self) -> Result<(), ContactError> {
        let pairs = self.interpolation.nodes().pow(2);
        let shear = self.shear.iter().flat_map(|of| [&of.xx, &of.yy, &of.xy]);
        for matrix in shear.chain([&self.normal]) {
            check_length("compliance between nodes", matrix.len(), pairs)?;
        }
        Ok(())
    }

    /// Adds what a pressure displaces \[m\].
    pub fn add_normal(&self, pressure: &[f64], displacement: &mut [f64]) {
        self.add(&self.normal, pressure, displacement);
    }

    /// Adds what a shear along x displaces along x.
    pub(super) fn add_shear_x(&self, shear: &[f64], displacement: &mut [f64]) {
        if let Some(of) = &self.shear {
            self.add(&of.xx, shear, displacement);
        }
    }

    /// Adds what a shear in the plane displaces.
    pub(super) fn add_shear(&self, shear: [&[f64]; 2], displacement: [&mut [f64]; 2]) {
        let Some(of) = &self.shear else {
            return;
        };
        let nodes = self.interpolation.nodes();
        let [x, y] = shear.map(|q| self.interpolation.sums(q));
        let mut moved = [product(&of.xx, &x), product(&of.yy, &y)];
        for (value, of_y) in moved[0].iter_mut().zip(product(&of.xy, &y)) {
            *value += of_y;
        }
        for (row, x) in of.xy.chunks_exact(nodes).zip(&x) {
            for (value, c) in moved[1].iter_mut().zip(row) {
                *value += c * x;
            }
        }
        for (moved, displacement) in moved.iter().zip(displacement) {
            let area = self.interpolation.grid.cell_area();
            self.interpolation.add(area, moved, displacement);
        }
    }

    /// By how much blocks of cells part on average under a pressure summed over the cells of each \[m/Pa\], row by row. `blocks` has the
    /// block of every cell, and every block has a cell.
    pub(super) fn between(&self, blocks: &[u32]) -> Vec<f64> {
        let (nodes, count) = (
            self.interpolation.nodes(),
            blocks.iter().max().map_or(0, |last| *last as usize + 1),
        );
        let mut cells = vec![0.0; count];
        let mut parts = vec![BTreeMap::new(); count];
        for (cell, &block) in blocks.iter().enumerate() {
            cells[block as usize] += 1.0;
            for (node, part) in self.interpolation.around(cell) {
                *parts[block as usize].entry(node).or_insert(0.0) += part;
            }
        }
        let area = self.interpolation.grid.cell_area();
        let mut between = Vec::with_capacity(count * count);
        for (of, number) in parts.iter().zip(&cells) {
            let mut moved = vec![0.0; nodes];
            for (&node, part) in of {
                let row = &self.normal[node * nodes..(node + 1) * nodes];
                let part = area * part / number;
                moved.iter_mut().zip(row).for_each(|(m, c)| *m += part * c);
            }
            between.extend(parts.iter().zip(&cells).map(|(other, number)| {
                let terms = other.iter().map(|(&node, part)| part * moved[node]);
                terms.sum::<f64>() / number
            }));
        }
        between
    }

    fn add(&self, matrix: &[f64], traction: &[f64], displacement: &mut [f64]) {
        let moved = product(matrix, &self.interpolation.sums(traction));
        let area = self.interpolation.grid.cell_area();
        self.interpolation.add(area, &moved, displacement);
    }
}

fn product(matrix: &[f64], vector: &[f64]) -> Vec<f64> {
    let rows = matrix.chunks_exact(vector.len());
    rows.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
        .collect()
}
