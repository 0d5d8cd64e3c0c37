//! Anderson mixing of the iterates of a fixed-point iteration.

/// Number of stored differences between iterates.
const DEPTH: usize = 4;

/// Smallest fraction of a difference of residuals that must be orthogonal to the other differences. The mixing drops a
/// difference with a smaller orthogonal part, because a smaller orthogonal part is rounding and inner error.
const DEPENDENT: f64 = 1e-3;

/// Last iterate, the residual of the last iterate, and the stored differences. The residual of an iterate is the
/// computed next value minus the iterate. The newest difference comes last.
#[derive(Default)]
pub(super) struct Mixing {
    last: Option<[Vec<f64>; 2]>,
    differences: Vec<[Vec<f64>; 2]>,
}

impl Mixing {
    /// Replaces `value` by the next iterate. The fixed-point map moves `value` by `residual`. The stored differences
    /// predict the value with the smallest residual on the cells that `counts` selects. The next iterate is the
    /// predicted value plus the smallest residual. A constant part of a residual is ignored.
    pub(super) fn advance(
        &mut self,
        value: &mut [f64],
        residual: &[f64],
        counts: impl Fn(usize) -> bool,
    ) {
        let cells: Vec<usize> = (0..value.len()).filter(|&c| counts(c)).collect();
        if let Some([old_value, old_residual]) = self.last.take() {
            let difference = |new: &[f64], old: Vec<f64>| -> Vec<f64> {
                new.iter().zip(old).map(|(n, o)| n - o).collect()
            };
            if self.differences.len() == DEPTH {
                self.differences.remove(0);
            }
            self.differences.push([
                difference(value, old_value),
                difference(residual, old_residual),
            ]);
        }
        self.last = Some([value.to_vec(), residual.to_vec()]);
        // Orthogonalise the residuals, newest first, and combine the changes of the value in the same way.
        let mut basis: Vec<[Vec<f64>; 2]> = Vec::new();
        for [value, residual] in self.differences.iter().rev() {
            let mut column = [value.clone(), residual.clone()];
            let size = product(&column[1], &column[1], &cells);
            for other in &basis {
                let part = -product(&other[1], &column[1], &cells);
                for (c, o) in column.iter_mut().zip(other) {
                    c.iter_mut().zip(o).for_each(|(c, o)| *c += part * o);
                }
            }
            let remainder = product(&column[1], &column[1], &cells);
            if remainder > DEPENDENT * DEPENDENT * size {
                for field in &mut column {
                    field.iter_mut().for_each(|v| *v /= remainder.sqrt());
                }
                basis.push(column);
            }
        }
        for (v, r) in value.iter_mut().zip(residual) {
            *v += r;
        }
        for [change, column] in &basis {
            let part = product(column, residual, &cells);
            for (v, (d, r)) in value.iter_mut().zip(change.iter().zip(column)) {
                *v -= part * (d + r);
            }
        }
    }
}

/// Returns the covariance over some cells, times their number.
fn product(a: &[f64], b: &[f64], cells: &[usize]) -> f64 {
    let count = cells.len().max(1) as f64;
    let mean = |field: &[f64]| cells.iter().map(|&c| field[c]).sum::<f64>() / count;
    let (ma, mb) = (mean(a), mean(b));
    cells.iter().map(|&c| (a[c] - ma) * (b[c] - mb)).sum()
}
