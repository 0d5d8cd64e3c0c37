//! Small dense matrices, real and complex: products, LU factors with partial pivoting, symmetric eigenvalues.
//!
//! Meant for the few hundred unknowns of a reduced model; nothing here is parallel, so results do not depend on threads.

use std::ops::{Add, Div, Mul, Sub};

use num_complex::Complex64;

use super::DynamicsError;

/// Columns that are eliminated together, so that the block of the upper factor in use stays in cache.
const BLOCK: usize = 32;
/// Pivots below this share of the largest entry are taken to be rounding of zero.
const SINGULAR: f64 = 1e-15;

/// A real or complex number.
pub trait Scalar:
    Copy
    + Default
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + PartialEq
{
    /// The number one.
    const ONE: Self;
    /// Absolute value.
    fn magnitude(self) -> f64;
}

impl Scalar for f64 {
    const ONE: f64 = 1.0;
    fn magnitude(self) -> f64 {
        self.abs()
    }
}

impl Scalar for Complex64 {
    const ONE: Complex64 = Complex64::new(1.0, 0.0);
    fn magnitude(self) -> f64 {
        self.norm()
    }
}

/// A dense matrix, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix<T = f64> {
    rows: usize,
    columns: usize,
    values: Vec<T>,
}

impl<T: Scalar> Matrix<T> {
    /// Zeros.
    pub fn zeros(rows: usize, columns: usize) -> Matrix<T> {
        Matrix {
            rows,
            columns,
            values: vec![T::default(); rows * columns],
        }
    }

    /// The identity.
    pub fn identity(order: usize) -> Matrix<T> {
        let mut matrix = Matrix::zeros(order, order);
        for i in 0..order {
            matrix.set(i, i, T::ONE);
        }
        matrix
    }

    /// From values row by row.
    ///
    /// # Errors
    /// [`DynamicsError::Length`] if there are not `rows * columns` of them.
    pub fn from_rows(rows: usize, columns: usize, values: Vec<T>) -> Result<Self, DynamicsError> {
        if values.len() != rows * columns {
            return Err(DynamicsError::Length {
                what: "matrix",
                found: values.len(),
                expected: rows * columns,
            });
        }
        Ok(Matrix {
            rows,
            columns,
            values,
        })
    }

    /// A diagonal matrix.
    pub fn diagonal(values: &[T]) -> Matrix<T> {
        let mut matrix = Matrix::zeros(values.len(), values.len());
        for (i, &value) in values.iter().enumerate() {
            matrix.set(i, i, value);
        }
        matrix
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Entry (i, j).
    pub fn at(&self, i: usize, j: usize) -> T {
        self.values[i * self.columns + j]
    }

    /// Sets entry (i, j).
    pub fn set(&mut self, i: usize, j: usize, value: T) {
        self.values[i * self.columns + j] = value;
    }

    /// Row i.
    pub fn row(&self, i: usize) -> &[T] {
        &self.values[i * self.columns..][..self.columns]
    }

    /// Row i, to change.
    pub fn row_mut(&mut self, i: usize) -> &mut [T] {
        &mut self.values[i * self.columns..][..self.columns]
    }

    /// All entries, row by row.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// The transpose.
    pub fn transposed(&self) -> Matrix<T> {
        let mut out = Matrix::zeros(self.columns, self.rows);
        for i in 0..self.rows {
            for (j, &value) in self.row(i).iter().enumerate() {
                out.set(j, i, value);
            }
        }
        out
    }

    /// The product with `other`, whose rows are as many as our columns.
    pub fn times(&self, other: &Matrix<T>) -> Matrix<T> {
        assert_eq!(self.columns, other.rows, "inner dimensions differ");
        let mut out = Matrix::zeros(self.rows, other.columns);
        for i in 0..self.rows {
            let target = &mut out.values[i * other.columns..][..other.columns];
            for (k, &factor) in self.row(i).iter().enumerate() {
                if factor != T::default() {
                    add_scaled(target, factor, other.row(k));
                }
            }
        }
        out
    }

    /// The product with a vector.
    pub fn apply(&self, vector: &[T]) -> Vec<T> {
        (0..self.rows)
            .map(|i| {
                let products = self.row(i).iter().zip(vector).map(|(&a, &b)| a * b);
                products.fold(T::default(), |sum, product| sum + product)
            })
            .collect()
    }
}

/// `target += factor * source`.
pub fn add_scaled<T: Scalar>(target: &mut [T], factor: T, source: &[T]) {
    for (target, &source) in target.iter_mut().zip(source) {
        *target = *target + factor * source;
    }
}

/// LU factors of a square matrix, with row exchanges.
#[derive(Debug, Clone)]
pub struct Factors<T = f64> {
    lu: Matrix<T>,
    exchanges: Vec<usize>,
}

impl<T: Scalar> Factors<T> {
    /// Factorizes `matrix`, called `what` in the error.
    ///
    /// # Errors
    /// [`DynamicsError::Singular`].
    pub fn new(matrix: Matrix<T>, what: &'static str) -> Result<Factors<T>, DynamicsError> {
        let n = matrix.rows;
        assert_eq!(n, matrix.columns, "only square matrices have LU factors");
        let largest = matrix.values.iter().fold(0.0, |largest: f64, value| {
            // A maximum that keeps NaN, so that a poisoned matrix is refused.
            let size = value.magnitude();
            if size > largest || size.is_nan() {
                size
            } else {
                largest
            }
        });
        let mut lu = matrix;
        let mut exchanges = Vec::with_capacity(n);
        for start in (0..n).step_by(BLOCK) {
            let end = (start + BLOCK).min(n);
            for k in start..end {
                let pivot = (k..n)
                    .max_by(|&a, &b| {
                        let (a, b) = (lu.at(a, k).magnitude(), lu.at(b, k).magnitude());
                        a.total_cmp(&b)
                    })
                    .unwrap_or(k);
                let size = lu.at(pivot, k).magnitude();
                if !size.is_finite() || size <= SINGULAR * largest {
                    return Err(DynamicsError::Singular {
                        what,
                        order: n,
                        pivot: k,
                        size: size / largest,
                    });
                }
                exchanges.push(pivot);
                if pivot != k {
                    let (upper, lower) = lu.values.split_at_mut(pivot * n);
                    upper[k * n..][..n].swap_with_slice(&mut lower[..n]);
                }
                let (upper, lower) = lu.values.split_at_mut((k + 1) * n);
                let pivot_row = &upper[k * n..][..n];
                for row in lower.chunks_exact_mut(n) {
                    let factor = row[k] / pivot_row[k];
                    row[k] = factor;
                    if factor != T::default() {
                        subtract_scaled(&mut row[k + 1..end], factor, &pivot_row[k + 1..end]);
                    }
                }
            }
            // The rows of this block right of it, then the rest of the matrix.
            for i in start + 1..n {
                let (upper, lower) = lu.values.split_at_mut(i * n);
                let row = &mut lower[..n];
                for k in start..end.min(i) {
                    let factor = row[k];
                    if factor != T::default() {
                        subtract_scaled(&mut row[end..], factor, &upper[k * n + end..(k + 1) * n]);
                    }
                }
            }
        }
        Ok(Factors { lu, exchanges })
    }

    /// Replaces `right` by the solution.
    pub fn solve(&self, right: &mut [T]) {
        let n = self.lu.rows;
        for (k, &pivot) in self.exchanges.iter().enumerate() {
            right.swap(k, pivot);
        }
        for i in 0..n {
            let row = self.lu.row(i);
            let sum = dot(&row[..i], &right[..i]);
            right[i] = right[i] - sum;
        }
        for i in (0..n).rev() {
            let row = self.lu.row(i);
            let sum = dot(&row[i + 1..], &right[i + 1..]);
            right[i] = (right[i] - sum) / row[i];
        }
    }

    /// Replaces every column of `right` by its solution.
    pub fn solve_columns(&self, right: &mut Matrix<T>) {
        let (n, m) = (self.lu.rows, right.columns);
        for (k, &pivot) in self.exchanges.iter().enumerate() {
            if k != pivot {
                let (upper, lower) = right.values.split_at_mut(pivot * m);
                upper[k * m..][..m].swap_with_slice(&mut lower[..m]);
            }
        }
        // Panels of columns, each of which stays in cache while all rows pass over it.
        for start in (0..m).step_by(BLOCK) {
            let end = (start + BLOCK).min(m);
            for i in 0..n {
                let (upper, lower) = right.values.split_at_mut(i * m);
                let target = &mut lower[start..end];
                for k in 0..i {
                    let factor = self.lu.at(i, k);
                    if factor != T::default() {
                        subtract_scaled(target, factor, &upper[k * m + start..k * m + end]);
                    }
                }
            }
            for i in (0..n).rev() {
                let (upper, lower) = right.values.split_at_mut((i + 1) * m);
                let target = &mut upper[i * m + start..i * m + end];
                for k in i + 1..n {
                    let factor = self.lu.at(i, k);
                    let source = &lower[(k - i - 1) * m + start..(k - i - 1) * m + end];
                    subtract_scaled(target, factor, source);
                }
                for value in target {
                    *value = *value / self.lu.at(i, i);
                }
            }
        }
    }

    /// The inverse.
    pub fn inverse(&self) -> Matrix<T> {
        let mut inverse = Matrix::identity(self.lu.rows);
        self.solve_columns(&mut inverse);
        inverse
    }
}

fn subtract_scaled<T: Scalar>(target: &mut [T], factor: T, source: &[T]) {
    for (target, &source) in target.iter_mut().zip(source) {
        *target = *target - factor * source;
    }
}

fn dot<T: Scalar>(a: &[T], b: &[T]) -> T {
    let products = a.iter().zip(b).map(|(&a, &b)| a * b);
    products.fold(T::default(), |sum, product| sum + product)
}

/// Eigenvalues λ, ascending, and vectors of `stiffness` v = λ `mass` v, with vᵀ `mass` v = 1; vector r is column r.
///
/// # Errors
/// [`DynamicsError::OutOfRange`] if the mass is not positive definite.
pub fn eigen(stiffness: &Matrix, mass: &Matrix) -> Result<(Vec<f64>, Matrix), DynamicsError> {
    let n = stiffness.rows;
    let lower = cholesky(mass)?;
    // L⁻¹ K L⁻ᵀ: two triangular solves on rows.
    let mut reduced = stiffness.clone();
    for _ in 0..2 {
        for i in 0..n {
            for k in 0..i {
                let factor = lower.at(i, k);
                let (upper, rest) = reduced.values.split_at_mut(i * n);
                subtract_scaled(&mut rest[..n], factor, &upper[k * n..][..n]);
            }
            for value in reduced.row_mut(i) {
                *value /= lower.at(i, i);
            }
        }
        reduced = reduced.transposed();
    }
    let mut vectors = Matrix::identity(n);
    jacobi(&mut reduced, &mut vectors);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| reduced.at(a, a).total_cmp(&reduced.at(b, b)));
    let values = order.iter().map(|&r| reduced.at(r, r)).collect();
    let mut out = Matrix::zeros(n, n);
    for (column, &r) in order.iter().enumerate() {
        for i in (0..n).rev() {
            let sum: f64 = (i + 1..n).map(|k| lower.at(k, i) * out.at(k, column)).sum();
            out.set(i, column, (vectors.at(i, r) - sum) / lower.at(i, i));
        }
    }
    Ok((values, out))
}

fn cholesky(matrix: &Matrix) -> Result<Matrix, DynamicsError> {
    let n = matrix.rows;
    let mut lower = Matrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = matrix.at(i, j) - dot(&lower.row(i)[..j], &lower.row(j)[..j]);
            if i != j {
                lower.set(i, j, sum / lower.at(j, j));
            } else if sum > 0.0 {
                lower.set(i, i, sum.sqrt());
            } else {
                return Err(DynamicsError::OutOfRange {
                    name: "the mass along a coordinate",
                    value: sum,
                    expected: "positive",
                });
            }
        }
    }
    Ok(lower)
}

/// Diagonalises a symmetric matrix by cyclic rotations (Golub, van Loan, Matrix Computations, §8.5).
fn jacobi(matrix: &mut Matrix, vectors: &mut Matrix) {
    /// Convergence is quadratic; a few sweeps are the rule.
    const SWEEPS: usize = 60;
    let n = matrix.rows;
    let total: f64 = matrix.values.iter().map(|v| v * v).sum();
    for _ in 0..SWEEPS {
        let mut off = 0.0;
        for p in 0..n {
            for q in p + 1..n {
                let entry = matrix.at(p, q);
                off += entry * entry;
                if entry == 0.0 {
                    continue;
                }
                let ratio = (matrix.at(q, q) - matrix.at(p, p)) / (2.0 * entry);
                let t = ratio.signum() / (ratio.abs() + (1.0 + ratio * ratio).sqrt());
                let c = 1.0 / (1.0 + t * t).sqrt();
                let s = t * c;
                for k in 0..n {
                    let (a, b) = (matrix.at(k, p), matrix.at(k, q));
                    matrix.set(k, p, c * a - s * b);
                    matrix.set(k, q, s * a + c * b);
                }
                for k in 0..n {
                    let (a, b) = (matrix.at(p, k), matrix.at(q, k));
                    matrix.set(p, k, c * a - s * b);
                    matrix.set(q, k, s * a + c * b);
                    let (a, b) = (vectors.at(k, p), vectors.at(k, q));
                    vectors.set(k, p, c * a - s * b);
                    vectors.set(k, q, s * a + c * b);
                }
            }
        }
        if off <= f64::EPSILON * f64::EPSILON * total {
            break;
        }
    }
}
