//! The rigid motions that a normal contact leaves to its solver, each in exchange for a resultant of the pressure.
//!
//! A motion is an approach δ and two rotations θ, by which a cell comes closer by δ + θ_x y − θ_y x; its resultant is the sum of the
//! pressure times that. With the load given the approach is unknown; with the moments given the two rotations are too; bodies of a structure may
//! be free to move along any motions.

use crate::contact::sums::sum;
use crate::grid::Grid;

/// Coefficients or resultants of up to three motions; those that a problem does not have are 0.
pub(super) type Motions = [f64; 3];

/// Below this part of its diagonal a pivot is rounding: the cells in question do not tell the motions apart.
const SINGULAR: f64 = 1e-12;

/// The fields 1, y and −x at a cell.
fn fields(grid: Grid, c: usize) -> Motions {
    let (i, j) = grid.cell(c);
    let (x, y) = grid.centre(i, j);
    [1.0, y, -x]
}

/// Displacement of a cell by an approach and two rotations.
pub(super) fn displacement(grid: Grid, motions: Motions, c: usize) -> f64 {
    let fields = fields(grid, c);
    (0..3).map(|k| motions[k] * fields[k]).sum()
}

/// Load and moments of a pressure over the area of a cell.
pub(super) fn load_and_moments(grid: Grid, pressure: &[f64]) -> Motions {
    let mut sums = [0.0; 3];
    for (c, p) in pressure.iter().enumerate() {
        if *p != 0.0 {
            let fields = fields(grid, c);
            (0..3).for_each(|k| sums[k] += p * fields[k]);
        }
    }
    sums
}

/// The unknown motions of a problem, up to three.
#[derive(Debug, Clone)]
pub(super) struct RigidMotions {
    grid: Grid,
    /// Approach and rotations of each; those beyond `count` are none.
    motions: [Motions; 3],
    count: usize,
    rotates: bool,
}

impl RigidMotions {
    /// Motions that are independent of each other.
    pub(super) fn new(grid: Grid, motions: &[Motions]) -> Self {
        let mut all = [[0.0; 3]; 3];
        all[..motions.len()].copy_from_slice(motions);
        RigidMotions {
            grid,
            motions: all,
            count: motions.len(),
            rotates: motions.iter().any(|[_, x, y]| *x != 0.0 || *y != 0.0),
        }
    }

    /// True where pressure and motions are all given.
    pub(super) fn none(&self) -> bool {
        self.count == 0
    }

    /// True where one of them turns the bodies; else there is at most one, the approach.
    pub(super) fn rotates(&self) -> bool {
        self.rotates
    }

    /// Approach and rotations of a combination of the motions.
    pub(super) fn combined(&self, of: &Motions) -> Motions {
        [0, 1, 2].map(|m| (0..self.count).map(|k| of[k] * self.motions[k][m]).sum())
    }

    /// The fields of the motions at a cell, 0 for an absent one.
    fn fields(&self, c: usize) -> Motions {
        let fields = fields(self.grid, c);
        self.motions
            .map(|motion| (0..3).map(|m| motion[m] * fields[m]).sum())
    }

    /// Displacement of a cell by the motions.
    pub(super) fn at(&self, motions: &Motions, c: usize) -> f64 {
        if self.rotates {
            let fields = self.fields(c);
            motions[0] * fields[0] + motions[1] * fields[1] + motions[2] * fields[2]
        } else {
            motions[0]
        }
    }

    /// Σ value · field over some cells, for each motion.
    pub(super) fn resultants(&self, cells: &[usize], values: &[f64]) -> Motions {
        let mut sums = [0.0; 3];
        if self.rotates {
            // Moments cancel, and the sum of many equal pressures rounds each time to the same side: what each addition loses
            // is summed as well [Neumaier 1974].
            let mut lost = [0.0; 3];
            for (&c, value) in cells.iter().zip(values) {
                let fields = self.fields(c);
                for k in 0..3 {
                    let term = value * fields[k];
                    let sum = sums[k] + term;
                    lost[k] += if sums[k].abs() >= term.abs() {
                        (sums[k] - sum) + term
                    } else {
                        (term - sum) + sums[k]
                    };
                    sums[k] = sum;
                }
            }
            (0..3).for_each(|k| sums[k] += lost[k]);
        } else if !self.none() {
            sums[0] = sum(values);
        }
        sums
    }

    /// The motions whose displacement has the given resultants on some cells; `None` where the cells (none, or all in a line)
    /// do not determine them.
    pub(super) fn with_resultants(&self, cells: &[usize], resultants: Motions) -> Option<Motions> {
        if self.none() {
            return None;
        }
        if !self.rotates {
            let count = cells.len();
            return (count > 0).then(|| [resultants[0] / count as f64, 0.0, 0.0]);
        }
        self.solve(self.gram(cells), resultants, |_| None)
    }

    /// As [`RigidMotions::with_resultants`], with none of a motion that the cells do not determine.
    pub(super) fn determined(&self, cells: &[usize], resultants: Motions) -> Motions {
        self.solve(self.gram(cells), resultants, |_| Some(f64::MAX))
            .unwrap_or_default()
    }

    /// As [`RigidMotions::with_resultants`], with a `part` of what other cells have added to the cells'.
    pub(super) fn with_resultants_of(
        &self,
        cells: &[usize],
        others: &[usize],
        part: f64,
        resultants: Motions,
    ) -> Option<Motions> {
        let mut gram = self.gram(cells);
        for (row, others) in gram.iter_mut().zip(self.gram(others)) {
            for (entry, other) in row.iter_mut().zip(others) {
                *entry += part * other;
            }
        }
        self.solve(gram, resultants, |_| None)
    }

    /// Σ field · field over some cells.
    fn gram(&self, cells: &[usize]) -> [[f64; 3]; 3] {
        let mut gram = [[0.0; 3]; 3];
        for &c in cells {
            let fields = self.fields(c);
            for (row, a) in gram.iter_mut().zip(fields) {
                for (entry, b) in row.iter_mut().zip(fields) {
                    *entry += a * b;
                }
            }
        }
        gram
    }

    /// Solves a symmetric system in the present motions by LDLᵀ; a pivot that is rounding becomes `singular` of it.
    fn solve(
        &self,
        mut matrix: [[f64; 3]; 3],
        right: Motions,
        singular: impl Fn(f64) -> Option<f64>,
    ) -> Option<Motions> {
        let count = self.count;
        let mut x = right;
        for k in 0..count {
            let whole = matrix[k][k];
            for m in 0..k {
                matrix[k][k] -= matrix[k][m] * matrix[k][m] * matrix[m][m];
            }
            if matrix[k][k] <= SINGULAR * whole {
                matrix[k][k] = singular(matrix[k][k])?;
            }
            for r in k + 1..count {
                for m in 0..k {
                    matrix[r][k] -= matrix[r][m] * matrix[k][m] * matrix[m][m];
                }
                matrix[r][k] /= matrix[k][k];
            }
        }
        for k in 0..count {
            for m in 0..k {
                x[k] -= matrix[k][m] * x[m];
            }
        }
        for k in 0..count {
            x[k] /= matrix[k][k];
        }
        for k in (0..count).rev() {
            for r in k + 1..count {
                x[k] -= matrix[r][k] * x[r];
            }
        }
        x[count..].fill(0.0);
        Some(x)
    }

    /// How far apart two resultants are, moments counted over half the diagonal of the grid.
    pub(super) fn distance(&self, a: &Motions, b: &Motions) -> f64 {
        let [lx, ly] = self.grid.size();
        let arm = 0.5 * lx.hypot(ly);
        let (mut load, mut moments) = (0.0f64, 0.0f64);
        for k in 0..self.count {
            let [approach, x, y] = self.motions[k];
            let off = a[k] - b[k];
            match x == 0.0 && y == 0.0 {
                true => load = (off / approach).abs(),
                false => moments = moments.hypot(off / (approach.abs() + arm * x.hypot(y))),
            }
        }
        load.max(moments)
    }
}
