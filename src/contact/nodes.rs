//! Compliance between the nodes of a coarse mesh over the grid, added to that of the half spaces.
//!
//! The model of a structure ends in nodes on the contact plane, and has a compliance between them. Where both models act on one
//! contact, what both have must be counted once: the compliance of the cells is then K + S D Sᵀ A_c, with D the compliance between
//! nodes that is to be added \[m/N\] (what the structure has, less what its mesh has of the half spaces), A_c the area of a cell, and
//! S the bilinear interpolation from the nodes to the centres of the cells. Its transpose shares the traction of a cell among the
//! four nodes around it, so that work done on the cells is work done on the nodes.

use super::ContactError;
use super::error::check_length;
use crate::grid::Grid;

/// Bilinear interpolation between the nodes of a mesh of equal rectangles over a grid and the centres of the grid's cells.
/// Node (i, j) is number `i * (counts[1] + 1) + j`.
#[derive(Debug, Clone, PartialEq)]
pub struct Interpolation {
    grid: Grid,
    counts: [usize; 2],
    /// For each row and column of cells the lower node along the axis and the weight of the upper one.
    along: [Vec<(usize, f64)>; 2],
}

impl Interpolation {
    /// Of a mesh of `counts` rectangles along x and y, each at least one, over the rectangle of `grid`.
    pub fn new(grid: Grid, counts: [usize; 2]) -> Self {
        let along = |cells: usize, rectangles: usize| -> Vec<(usize, f64)> {
            (0..cells)
                .map(|cell| {
                    // In half cells, whole numbers: no border depends on rounding.
                    let twice = (2 * cell + 1) * rectangles;
                    let node = twice / (2 * cells);
                    let over = (twice - 2 * cells * node) as f64;
                    (node, over / (2 * cells) as f64)
                })
                .collect()
        };
        Interpolation {
            grid,
            counts,
            along: [along(grid.nx, counts[0]), along(grid.ny, counts[1])],
        }
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

    /// The four nodes around the centre of a cell with their weights, which sum to one.
    pub fn around(&self, cell: usize) -> [(usize, f64); 4] {
        let (i, j) = self.grid.cell(cell);
        let ((m, x), (n, y)) = (self.along[0][i], self.along[1][j]);
        let width = self.counts[1] + 1;
        let node = |m: usize, n: usize| m * width + n;
        [
            (node(m, n), (1.0 - x) * (1.0 - y)),
            (node(m, n + 1), (1.0 - x) * y),
            (node(m + 1, n), x * (1.0 - y)),
            (node(m + 1, n + 1), x * y),
        ]
    }

    /// Sᵀ `field`: the sums over the cells, each in the parts of its nodes.
    pub fn sums(&self, field: &[f64]) -> Vec<f64> {
        let width = self.counts[1] + 1;
        let mut sums = vec![0.0; self.nodes()];
        let mut of_row = vec![0.0; width];
        for (row, &(m, x)) in field.chunks_exact(self.grid.ny).zip(&self.along[0]) {
            of_row.fill(0.0);
            for (value, &(n, y)) in row.iter().zip(&self.along[1]) {
                of_row[n] += (1.0 - y) * value;
                of_row[n + 1] += y * value;
            }
            for (n, value) in of_row.iter().enumerate() {
                sums[m * width + n] += (1.0 - x) * value;
                sums[(m + 1) * width + n] += x * value;
            }
        }
        sums
    }

    /// `field` += `factor` S `values`.
    pub fn add(&self, factor: f64, values: &[f64], field: &mut [f64]) {
        let width = self.counts[1] + 1;
        let mut of_row = vec![0.0; width];
        for (row, &(m, x)) in field.chunks_exact_mut(self.grid.ny).zip(&self.along[0]) {
            for (n, value) in of_row.iter_mut().enumerate() {
                let (low, high) = (values[m * width + n], values[(m + 1) * width + n]);
                *value = factor * ((1.0 - x) * low + x * high);
            }
            for (value, &(n, y)) in row.iter_mut().zip(&self.along[1]) {
                *value += (1.0 - y) * of_row[n] + y * of_row[n + 1];
            }
        }
    }
}

/// D, the compliance between nodes that is added to the half spaces'. Matrices of `nodes × nodes`, row by row \[m/N\].
#[derive(Debug, Clone, PartialEq)]
pub struct NodalCompliance {
    /// From nodes to cells.
    pub interpolation: Interpolation,
    /// Approach of the bodies under normal forces; symmetric.
    pub normal: Vec<f64>,
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
        for matrix in [&self.normal, &self.xx, &self.yy, &self.xy] {
            check_length("compliance between nodes", matrix.len(), pairs)?;
        }
        Ok(())
    }

    /// Adds what a pressure displaces.
    pub(super) fn add_normal(&self, pressure: &[f64], displacement: &mut [f64]) {
        self.add(&self.normal, pressure, displacement);
    }

    /// Adds what a shear along x displaces along x.
    pub(super) fn add_shear_x(&self, shear: &[f64], displacement: &mut [f64]) {
        self.add(&self.xx, shear, displacement);
    }

    /// Adds what a shear in the plane displaces.
    pub(super) fn add_shear(&self, shear: [&[f64]; 2], displacement: [&mut [f64]; 2]) {
        let nodes = self.interpolation.nodes();
        let [x, y] = shear.map(|q| self.interpolation.sums(q));
        let mut moved = [product(&self.xx, &x), product(&self.yy, &y)];
        for (value, of_y) in moved[0].iter_mut().zip(product(&self.xy, &y)) {
            *value += of_y;
        }
        for (row, x) in self.xy.chunks_exact(nodes).zip(&x) {
            for (value, c) in moved[1].iter_mut().zip(row) {
                *value += c * x;
            }
        }
        for (moved, displacement) in moved.iter().zip(displacement) {
            let area = self.interpolation.grid.cell_area();
            self.interpolation.add(area, moved, displacement);
        }
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
