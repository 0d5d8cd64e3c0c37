//! Regular grid of the joint, and the set of grid cells that belong to the joint.
//!
//! A field is a flat slice of `nx * ny` values. Cell (i, j) has the index `i * ny + j`, so y varies fastest. A module
//! that takes a field as input takes the [`Grid`] or the [`Patch`] of the field as well. Only the module `grid` depends
//! on the order of the values in a field.

use serde::{Deserialize, Serialize};

/// Regular grid of `nx * ny` rectangular cells of `dx * dy` metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Cells along x.
    pub nx: usize,
    /// Cells along y.
    pub ny: usize,
    /// Cell width along x \[m\].
    pub dx: f64,
    /// Cell width along y \[m\].
    pub dy: f64,
}

impl Grid {
    /// Divides a rectangle of `size` metres into `cells`.
    pub fn over(size: [f64; 2], cells: [usize; 2]) -> Self {
        Grid {
            nx: cells[0],
            ny: cells[1],
            dx: size[0] / cells[0] as f64,
            dy: size[1] / cells[1] as f64,
        }
    }

    /// Returns the number of cells.
    pub fn len(&self) -> usize {
        self.nx * self.ny
    }

    /// Returns true for a grid without cells.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the position of cell (i, j) in a field.
    pub fn index(&self, i: usize, j: usize) -> usize {
        i * self.ny + j
    }

    /// Returns the cell (i, j) at a position in a field.
    pub fn cell(&self, index: usize) -> (usize, usize) {
        (index / self.ny, index % self.ny)
    }

    /// Returns the centre of cell (i, j), measured from the centre of the grid \[m\].
    pub fn centre(&self, i: usize, j: usize) -> (f64, f64) {
        (
            (i as f64 + 0.5 - 0.5 * self.nx as f64) * self.dx,
            (j as f64 + 0.5 - 0.5 * self.ny as f64) * self.dy,
        )
    }

    /// Returns the area of one cell \[m²\].
    pub fn cell_area(&self) -> f64 {
        self.dx * self.dy
    }

    /// Returns the side lengths of the grid \[m\].
    pub fn size(&self) -> [f64; 2] {
        [self.nx as f64 * self.dx, self.ny as f64 * self.dy]
    }
}

/// Grid with the set of grid cells that belong to the joint. Other cells (the bolt hole) carry no load and have no
/// surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    /// The grid.
    pub grid: Grid,
    /// One entry per cell, true where the cell belongs to the joint.
    pub is_in_joint: Vec<bool>,
}

impl Patch {
    /// Returns a patch of all cells of the grid.
    pub fn full(grid: Grid) -> Self {
        Patch {
            grid,
            is_in_joint: vec![true; grid.len()],
        }
    }

    /// Returns a patch without the cells whose centre lies within `diameter / 2` of the grid's centre.
    pub fn with_hole(grid: Grid, diameter: f64) -> Self {
        let radius = 0.5 * diameter;
        let kept = (0..grid.len())
            .map(|index| {
                let (i, j) = grid.cell(index);
                let (x, y) = grid.centre(i, j);
                x.hypot(y) > radius
            })
            .collect();
        Patch {
            grid,
            is_in_joint: kept,
        }
    }

    /// Returns the number of cells that belong to the joint.
    pub fn cells(&self) -> usize {
        self.is_in_joint.iter().filter(|&&k| k).count()
    }

    /// Returns the cells of the joint that share an edge with `cell`. At the border of the grid, the neighbour is the
    /// opposite cell if the grid `wraps`, and `None` otherwise.
    pub fn neighbours(&self, cell: usize, wraps: bool) -> [Option<usize>; 4] {
        let Grid { nx, ny, .. } = self.grid;
        let (i, j) = self.grid.cell(cell);
        let step = |at: usize, count: usize, is_up: bool| match (is_up, wraps) {
            (true, true) => Some((at + 1) % count),
            (false, true) => Some((at + count - 1) % count),
            (true, false) => Some(at + 1).filter(|&next| next < count),
            (false, false) => at.checked_sub(1),
        };
        let along_x = [true, false].map(|up| Some(self.grid.index(step(i, nx, up)?, j)));
        let along_y = [true, false].map(|up| Some(self.grid.index(i, step(j, ny, up)?)));
        let [a, b] = along_x;
        let [c, d] = along_y;
        [a, b, c, d].map(|other| other.filter(|&other| self.is_in_joint[other]))
    }

    /// Returns the indices i and j of the cells that belong to the joint, in the order of the field.
    pub fn indices(&self) -> (Vec<i32>, Vec<i32>) {
        let kept = (0..self.grid.len()).filter(|&cell| self.is_in_joint[cell]);
        let cells = kept.map(|cell| self.grid.cell(cell));
        cells.map(|(i, j)| (i as i32, j as i32)).unzip()
    }

    /// Returns the values of a field on the cells that belong to the joint, in the order of the field.
    pub fn joint_values(&self, field: &[f64]) -> Vec<f64> {
        let cells = field.iter().zip(&self.is_in_joint);
        cells.filter(|(_, kept)| **kept).map(|(v, _)| *v).collect()
    }

    /// Returns the field with the values `values` on the cells of the joint, and 0 on all other cells.
    pub fn scatter(&self, values: &[f64]) -> Vec<f64> {
        let mut values = values.iter().copied();
        let value = |kept: &bool| match kept {
            true => values.next().unwrap_or(0.0),
            false => 0.0,
        };
        self.is_in_joint.iter().map(value).collect()
    }

    /// Returns the nominal area of the joint \[m²\].
    pub fn area(&self) -> f64 {
        self.cells() as f64 * self.grid.cell_area()
    }
}

/// One entry per in-plane axis: x alone, or x and y. An absent axis has no entry and no storage.
pub type ByAxis<T> = Vec<T>;
