//! Conservative resampling between regular grids.
//!
//! Every height is the mean height of one cell. Along each axis in turn, the resampling computes one parabola in every
//! old cell. The mean of a parabola is the mean height of the cell. Two neighbouring parabolas have the same height at
//! the edge between their cells. A cubic through four cell means gives the height at an edge. The method is the
//! piecewise parabolic method of Colella and Woodward (1984) without limiters. Each new height is the mean of the
//! parabolas over the new cell. Properties of the resampling:
//! - The resampling preserves the mean over the map up to rounding, for any pair of grids.
//! - A coarser grid averages the heights without aliasing. If the ratio of the grids is a whole number, a new height is
//!   the block mean.
//! - The cell means of planes and of quadratic surfaces are exact up to the edges. If the grids are equal, the heights
//!   do not change.
//! - The new heights are a linear function of the old heights, because the method has no limiters. Next to a spike, the
//!   new heights undershoot by up to an eighth of the height of the spike.

use crate::grid::Grid;

/// Resamples the part of the map that the target grid covers. `window` gives the ends of that part along x
/// and y, in points.
pub(super) fn parabolic(
    from: &Grid,
    heights: &[f64],
    window: &[[f64; 2]; 2],
    to: &Grid,
) -> Vec<f64> {
    both_axes(from, heights, window, to, edges_of_parabolas)
}

/// Resamples a field that is constant in each old cell. For a field of ones and zeros, the result is the
/// fraction of each new cell that the ones cover.
pub(super) fn constant(from: &Grid, field: &[f64], window: &[[f64; 2]; 2], to: &Grid) -> Vec<f64> {
    both_axes(from, field, window, to, |line| {
        line.iter().map(|&h| [h, h]).collect()
    })
}

/// Function that returns the height at the lower and upper edge of each cell.
type Edges = fn(&[f64]) -> Vec<[f64; 2]>;

fn both_axes(
    from: &Grid,
    field: &[f64],
    window: &[[f64; 2]; 2],
    to: &Grid,
    edges: Edges,
) -> Vec<f64> {
    let mut along_y = vec![0.0; from.nx * to.ny];
    for i in 0..from.nx {
        let line = &field[i * from.ny..(i + 1) * from.ny];
        means(
            line,
            &edges(line),
            window[1],
            &mut along_y[i * to.ny..(i + 1) * to.ny],
        );
    }
    let mut resampled = vec![0.0; to.nx * to.ny];
    let mut new = vec![0.0; to.nx];
    for j in 0..to.ny {
        let line: Vec<f64> = (0..from.nx).map(|i| along_y[i * to.ny + j]).collect();
        means(&line, &edges(&line), window[0], &mut new);
        for (i, value) in new.iter().enumerate() {
            resampled[i * to.ny + j] = *value;
        }
    }
    resampled
}

/// Divides the window into equal cells and computes the mean height of each cell.
fn means(line: &[f64], edges: &[[f64; 2]], window: [f64; 2], new: &mut [f64]) {
    let n = line.len();
    let width = (window[1] - window[0]) / new.len() as f64;
    let edge = |k: usize| (window[0] + k as f64 * width).clamp(0.0, n as f64);
    for (k, value) in new.iter_mut().enumerate() {
        let (start, end) = (edge(k), edge(k + 1));
        let mut sum = 0.0;
        let mut cell = (start as usize).min(n - 1);
        while cell < n && (cell as f64) < end {
            let (a, b) = ((start - cell as f64).max(0.0), (end - cell as f64).min(1.0));
            // Exact mean of a whole cell.
            sum += if a == 0.0 && b == 1.0 {
                line[cell]
            } else {
                integral(line[cell], edges[cell], a, b)
            };
            cell += 1;
        }
        *value = sum / (end - start);
    }
}

/// Returns the integral of a cell's parabola from a to b, both in [0, 1]. The parabola has the mean `mean`, and the
/// heights `low` and `high` at the edges of the cell.
fn integral(mean: f64, [low, high]: [f64; 2], a: f64, b: f64) -> f64 {
    let linear = 3.0 * mean - 2.0 * low - high;
    let square = low + high - 2.0 * mean;
    let primitive = |s: f64| s * (low + s * (linear + s * square));
    primitive(b) - primitive(a)
}

fn edges_of_parabolas(line: &[f64]) -> Vec<[f64; 2]> {
    let n = line.len();
    let at = |edge: usize| match (n, edge) {
        (1, _) => line[0],
        (2, 0) => 1.5 * line[0] - 0.5 * line[1],
        (2, 1) => 0.5 * (line[0] + line[1]),
        (2, _) => 1.5 * line[1] - 0.5 * line[0],
        // One-sided formulas, exact for quadratics, at the two edges next to either end.
        (_, 0) => (11.0 * line[0] - 7.0 * line[1] + 2.0 * line[2]) / 6.0,
        (_, 1) => (2.0 * line[0] + 5.0 * line[1] - line[2]) / 6.0,
        (_, k) if k == n => (11.0 * line[n - 1] - 7.0 * line[n - 2] + 2.0 * line[n - 3]) / 6.0,
        (_, k) if k == n - 1 => (2.0 * line[n - 1] + 5.0 * line[n - 2] - line[n - 3]) / 6.0,
        (_, k) => (7.0 * (line[k - 1] + line[k]) - line[k - 2] - line[k + 1]) / 12.0,
    };
    let heights: Vec<f64> = (0..=n).map(at).collect();
    heights.windows(2).map(|w| [w[0], w[1]]).collect()
}
