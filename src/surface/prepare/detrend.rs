//! Least-squares polynomials in two variables.

use crate::grid::Grid;

/// Number of terms of the quadratic, the largest polynomial.
const MOST_TERMS: usize = 6;

/// Smallest ratio of a pivot to its diagonal entry. If the ratio is below `SINGULAR`, the points do not determine all
/// terms of the polynomial. Well-spread points have pivots of order 0.1; rounding gives 1e-16.
const SINGULAR: f64 = 1e-11;

/// Number of solves. The first solve has an error of rounding times condition number. The second solve, on the
/// residual, removes the error of the first solve.
const SOLVES: usize = 2;

/// Returns the number of terms of a polynomial of order 0, 1 or 2.
pub(super) fn terms(order: usize) -> usize {
    (order + 1) * (order + 2) / 2
}

/// Polynomial in the coordinates of the map, each from -1 to 1. The space of planes or quadratics does not depend on
/// the spacing. Coordinates from -1 to 1 keep the equations well conditioned.
pub(super) struct Polynomial {
    pub(super) coefficients: [f64; MOST_TERMS],
}

impl Polynomial {
    pub(super) fn at(&self, grid: &Grid, index: usize) -> f64 {
        let monomials = monomials(grid, index);
        self.coefficients
            .iter()
            .zip(monomials)
            .map(|(c, m)| c * m)
            .sum()
    }
}

/// Fits the polynomial of order `order` to the heights that are not NaN. Returns `None` if the heights do not determine
/// the polynomial.
pub(super) fn fit(grid: &Grid, heights: &[f64], order: usize) -> Option<Polynomial> {
    let terms = terms(order);
    let mut matrix = [[0.0; MOST_TERMS]; MOST_TERMS];
    for (index, _) in heights.iter().enumerate().filter(|(_, h)| !h.is_nan()) {
        let m = monomials(grid, index);
        for a in 0..terms {
            for b in 0..=a {
                matrix[a][b] += m[a] * m[b];
            }
        }
    }
    let factor = cholesky(matrix, terms)?;
    let mut fitted = Polynomial {
        coefficients: [0.0; MOST_TERMS],
    };
    for _ in 0..SOLVES {
        let mut right = [0.0; MOST_TERMS];
        for (index, h) in heights.iter().enumerate().filter(|(_, h)| !h.is_nan()) {
            let rest = h - fitted.at(grid, index);
            for (r, m) in right.iter_mut().zip(monomials(grid, index)) {
                *r += m * rest;
            }
        }
        let step = solve(&factor, right, terms);
        for (c, s) in fitted.coefficients.iter_mut().zip(step) {
            *c += s;
        }
    }
    Some(fitted)
}

fn monomials(grid: &Grid, index: usize) -> [f64; MOST_TERMS] {
    let (i, j) = grid.cell(index);
    let u = (2 * i + 1) as f64 / grid.nx as f64 - 1.0;
    let v = (2 * j + 1) as f64 / grid.ny as f64 - 1.0;
    [1.0, u, v, u * u, u * v, v * v]
}

/// Returns the lower Cholesky factor of a symmetric matrix; `None` if the matrix is not positive definite.
fn cholesky(
    mut a: [[f64; MOST_TERMS]; MOST_TERMS],
    n: usize,
) -> Option<[[f64; MOST_TERMS]; MOST_TERMS]> {
    for k in 0..n {
        let whole = a[k][k];
        let pivot = whole - a[k][..k].iter().map(|v| v * v).sum::<f64>();
        if pivot <= SINGULAR * whole || whole == 0.0 {
            return None;
        }
        a[k][k] = pivot.sqrt();
        for i in k + 1..n {
            let eliminated: f64 = (0..k).map(|c| a[i][c] * a[k][c]).sum();
            a[i][k] = (a[i][k] - eliminated) / a[k][k];
        }
    }
    Some(a)
}

fn solve(
    factor: &[[f64; MOST_TERMS]; MOST_TERMS],
    mut b: [f64; MOST_TERMS],
    n: usize,
) -> [f64; MOST_TERMS] {
    for i in 0..n {
        let eliminated: f64 = (0..i).map(|k| factor[i][k] * b[k]).sum();
        b[i] = (b[i] - eliminated) / factor[i][i];
    }
    for i in (0..n).rev() {
        let eliminated: f64 = (i + 1..n).map(|k| factor[k][i] * b[k]).sum();
        b[i] = (b[i] - eliminated) / factor[i][i];
    }
    b[n..].fill(0.0);
    b
}
