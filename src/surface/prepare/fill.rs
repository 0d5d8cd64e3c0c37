//! Filling of holes with the solution of the Laplace equation.
//!
//! Each unmeasured point is the mean of its four neighbours, weighted by the inverse squares of their
//! distances. Measured neighbours are boundary values; the edge of the map is free. The mean plane is
//! subtracted first, so that a plane is continued exactly even if a hole touches the edge. The solver is the
//! conjugate gradient method with a diagonal preconditioner.

use super::PrepareError;
use super::detrend::fit;
use crate::grid::Grid;

/// Largest residual of the mean-value property, as a fraction of the range of heights. The largest residual is far
/// below the noise of any instrument.
const TOLERANCE: f64 = 1e-12;

/// Largest number of iterations, beyond the need of the largest map. A hole n points wide takes some n
/// iterations.
const MOST_ITERATIONS: usize = 20_000;

/// Marks a missing neighbour.
const EDGE: usize = usize::MAX;

/// Replaces every NaN. At least one height must be a number.
pub(super) fn harmonic(grid: &Grid, heights: &mut [f64]) -> Result<(), PrepareError> {
    let unknown: Vec<usize> = (0..heights.len())
        .filter(|&k| heights[k].is_nan())
        .collect();
    if unknown.is_empty() {
        return Ok(());
    }
    // Three points on a line do not determine a plane, but always a mean.
    let trend = fit(grid, heights, 1).or_else(|| fit(grid, heights, 0));
    let trend_at = |index: usize| trend.as_ref().map_or(0.0, |t| t.at(grid, index));
    let about: Vec<f64> = (0..heights.len())
        .map(|k| heights[k] - trend_at(k))
        .collect();

    let measured = || heights.iter().copied().filter(|h| !h.is_nan());
    let range =
        measured().fold(f64::NEG_INFINITY, f64::max) - measured().fold(f64::INFINITY, f64::min);
    let solution = if range > 0.0 {
        solve(grid, &unknown, &about, range)?
    } else {
        vec![0.0; unknown.len()]
    };
    for (&k, value) in unknown.iter().zip(solution) {
        heights[k] = value + trend_at(k);
    }
    Ok(())
}

fn solve(
    grid: &Grid,
    unknown: &[usize],
    about: &[f64],
    range: f64,
) -> Result<Vec<f64>, PrepareError> {
    let mut row_of = vec![EDGE; grid.len()];
    for (row, &k) in unknown.iter().enumerate() {
        row_of[k] = row;
    }
    // In units of 1/dx², which makes the diagonal of order one to ten.
    let weights = [
        1.0,
        1.0,
        (grid.dx / grid.dy).powi(2),
        (grid.dx / grid.dy).powi(2),
    ];
    let neighbours: Vec<[usize; 4]> = unknown
        .iter()
        .map(|&k| {
            let (i, j) = grid.cell(k);
            [
                if i > 0 { k - grid.ny } else { EDGE },
                if i + 1 < grid.nx { k + grid.ny } else { EDGE },
                if j > 0 { k - 1 } else { EDGE },
                if j + 1 < grid.ny { k + 1 } else { EDGE },
            ]
        })
        .collect();
    let mut diagonal = vec![0.0; unknown.len()];
    let mut right = vec![0.0; unknown.len()];
    for (row, near) in neighbours.iter().enumerate() {
        for (&k, w) in near.iter().zip(weights).filter(|(k, _)| **k != EDGE) {
            diagonal[row] += w;
            if row_of[k] == EDGE {
                right[row] += w * about[k];
            }
        }
    }
    let apply = |x: &[f64]| -> Vec<f64> {
        let row = |(row, near): (usize, &[usize; 4])| {
            let mut sum = diagonal[row] * x[row];
            for (&k, w) in near.iter().zip(weights).filter(|(k, _)| **k != EDGE) {
                if row_of[k] != EDGE {
                    sum -= w * x[row_of[k]];
                }
            }
            sum
        };
        neighbours.iter().enumerate().map(row).collect()
    };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let scaled = |r: &[f64]| -> Vec<f64> { r.iter().zip(&diagonal).map(|(r, d)| r / d).collect() };

    let mut x = vec![0.0; unknown.len()];
    let mut residual = right;
    let mut z = scaled(&residual);
    let mut direction = z.clone();
    let mut rho = dot(&residual, &z);
    let mut iterations = 0;
    loop {
        let worst = z.iter().fold(0.0, |m: f64, v| m.max(v.abs())) / range;
        if worst <= TOLERANCE {
            return Ok(x);
        }
        if iterations == MOST_ITERATIONS {
            return Err(PrepareError::NotConverged {
                iterations,
                residual: worst,
                tolerance: TOLERANCE,
            });
        }
        iterations += 1;
        let image = apply(&direction);
        let step = rho / dot(&direction, &image);
        for row in 0..x.len() {
            x[row] += step * direction[row];
            residual[row] -= step * image[row];
        }
        z = scaled(&residual);
        let next = dot(&residual, &z);
        for (d, z) in direction.iter_mut().zip(&z) {
            *d = z + next / rho * *d;
        }
        rho = next;
    }
}
