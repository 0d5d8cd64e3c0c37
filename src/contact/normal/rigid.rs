//! Unknown rigid motions of a normal contact. Each unknown motion has a prescribed resultant of the pressure.
//!
//! A motion consists of an approach δ and two rotations θ. The motion brings a cell closer by δ + θ_x y − θ_y x. A unit
//! amount of a motion displaces each cell. The resultant of the motion is the sum of pressure times displacement over
//! the cells. If the load is given, the approach is unknown. If the moments are given, both rotations of the bodies are
//! unknown. Bodies of a structure may be free to move along any motions.

use crate::contact::sums::sum;
use crate::grid::Grid;

/// Coefficients or resultants of up to three motions; 0 for a motion that a problem does not have.
pub(super) type Motions = [f64; 3];

/// Smallest ratio of a pivot to the diagonal of the matrix. A smaller pivot is rounding, and the cells do not determine
/// the motions.
const SINGULAR: f64 = 1e-12;

/// Returns the fields 1, y and −x at a cell.
fn fields(grid: Grid, c: usize) -> Motions {
    let (i, j) = grid.cell(c);
    let (x, y) = grid.centre(i, j);
    [1.0, y, -x]
}

/// Returns the displacement of a cell by an approach and two rotations.
pub(super) fn displacement(grid: Grid, motions: Motions, c: usize) -> f64 {
    let fields = fields(grid, c);
    (0..3).map(|k| motions[k] * fields[k]).sum()
}

/// Returns the load and the moments of a pressure, divided by the area of a cell.
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

/// Unknown motions of a problem, up to three.
#[derive(Debug, Clone)]
pub(super) struct RigidMotions {
    grid: Grid,
    /// Approach and rotations of each motion; zero beyond `count`.
    motions: [Motions; 3],
    count: usize,
    rotates: bool,
}

impl RigidMotions {
    /// Creates the unknown motions, which must be independent.
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

    /// Returns true if no motion is unknown.
    pub(super) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns true if a motion rotates the bodies. If no motion rotates the bodies, the approach is the only possible
    /// unknown motion.
    pub(super) fn rotates(&self) -> bool {
        self.rotates
    }

    /// Returns the approach and rotations of a combination of the motions.
    pub(super) fn combined(&self, amounts: &Motions) -> Motions {
        [0, 1, 2].map(|m| {
            (0..self.count)
                .map(|k| amounts[k] * self.motions[k][m])
                .sum()
        })
    }

    /// Returns the displacement fields of the motions at a cell, 0 for an absent motion.
    fn fields(&self, c: usize) -> Motions {
        let fields = fields(self.grid, c);
        self.motions
            .map(|motion| (0..3).map(|m| motion[m] * fields[m]).sum())
    }

    /// Returns the displacement of a cell by the motions.
    pub(super) fn displacement_at(&self, motions: &Motions, c: usize) -> f64 {
        if self.rotates {
            let fields = self.fields(c);
            motions[0] * fields[0] + motions[1] * fields[1] + motions[2] * fields[2]
        } else {
            motions[0]
        }
    }

    /// Returns Σ value · field over some cells, for each motion.
    pub(super) fn resultants(&self, cells: &[usize], values: &[f64]) -> Motions {
        let mut sums = [0.0; 3];
        if self.rotates {
            // Moments cancel, and many equal pressures round to the same side in each addition. To correct the
            // rounding, add the rounding errors of the additions to the sums [Neumaier 1974].
            let mut rounding_errors = [0.0; 3];
            for (&c, value) in cells.iter().zip(values) {
                let fields = self.fields(c);
                for k in 0..3 {
                    let term = value * fields[k];
                    let sum = sums[k] + term;
                    rounding_errors[k] += if sums[k].abs() >= term.abs() {
                        (sums[k] - sum) + term
                    } else {
                        (term - sum) + sums[k]
                    };
                    sums[k] = sum;
                }
            }
            (0..3).for_each(|k| sums[k] += rounding_errors[k]);
        } else if !self.is_empty() {
            sums[0] = sum(values);
        }
        sums
    }

    /// Returns the motions whose displacement has the given resultants on some cells. Returns `None` if the cells do
    /// not determine the motions: no cells, or all cells in a line.
    pub(super) fn with_resultants(&self, cells: &[usize], resultants: Motions) -> Option<Motions> {
        if self.is_empty() {
            return None;
        }
        if !self.rotates {
            let count = cells.len();
            return (count > 0).then(|| [resultants[0] / count as f64, 0.0, 0.0]);
        }
        self.solve(self.gram(cells), resultants, |_| None)
    }

    /// Computes [`RigidMotions::with_resultants`], with zero for a motion that the cells do not determine.
    pub(super) fn with_resultants_or_zero(&self, cells: &[usize], resultants: Motions) -> Motions {
        self.solve(self.gram(cells), resultants, |_| Some(f64::MAX))
            .unwrap_or_default()
    }

    /// Computes [`RigidMotions::with_resultants`], with `part` of the matrix of `others` added to the matrix of
    /// `cells`.
    pub(super) fn with_regularised_resultants(
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

    /// Returns Σ field · field over some cells.
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

    /// Solves a symmetric system in the present motions by LDLᵀ. Replaces a pivot at rounding by `singular` of it.
    fn solve(
        &self,
        mut matrix: [[f64; 3]; 3],
        right: Motions,
        singular: impl Fn(f64) -> Option<f64>,
    ) -> Option<Motions> {
        let count = self.count;
        let mut x = right;
        for k in 0..count {
            let diagonal = matrix[k][k];
            for m in 0..k {
                matrix[k][k] -= matrix[k][m] * matrix[k][m] * matrix[m][m];
            }
            if matrix[k][k] <= SINGULAR * diagonal {
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

    /// Returns the distance between two resultants. Moments are divided by half the diagonal of the grid.
    pub(super) fn distance(&self, a: &Motions, b: &Motions) -> f64 {
        let [lx, ly] = self.grid.size();
        let arm = 0.5 * lx.hypot(ly);
        let (mut load, mut moment) = (0.0f64, 0.0f64);
        for k in 0..self.count {
            let [approach, x, y] = self.motions[k];
            let difference = a[k] - b[k];
            match x == 0.0 && y == 0.0 {
                true => load = (difference / approach).abs(),
                false => moment = moment.hypot(difference / (approach.abs() + arm * x.hypot(y))),
            }
        }
        load.max(moment)
    }
}
