//! Dense matrices.

use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::linalg::evd::{
    ComputeEigenvectors, SelfAdjointEvdParams, self_adjoint_evd, self_adjoint_evd_scratch,
};
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Accum, Auto, MatMut, MatRef, Par, Side};

use super::LinalgError;
use super::registers::{multiply, with_cleared_registers};

/// Dense matrix stored column by column: entry (i, j) is at `j * rows + i`.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    rows: usize,
    columns: usize,
    data: Vec<f64>,
}

impl std::ops::Index<(usize, usize)> for Matrix {
    type Output = f64;
    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        debug_assert!(i < self.rows);
        &self.data[j * self.rows + i]
    }
}

impl std::ops::IndexMut<(usize, usize)> for Matrix {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        debug_assert!(i < self.rows);
        &mut self.data[j * self.rows + i]
    }
}

impl Matrix {
    /// Returns a matrix of zeros.
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Matrix {
            rows,
            columns,
            data: vec![0.0; rows * columns],
        }
    }

    /// Returns the matrix whose entry (i, j) is `entry(i, j)`.
    pub fn from_fn(
        rows: usize,
        columns: usize,
        mut entry: impl FnMut(usize, usize) -> f64,
    ) -> Self {
        let mut data = Vec::with_capacity(rows * columns);
        for j in 0..columns {
            for i in 0..rows {
                data.push(entry(i, j));
            }
        }
        Matrix {
            rows,
            columns,
            data,
        }
    }

    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Returns all entries, column by column.
    pub fn as_slice(&self) -> &[f64] {
        &self.data
    }

    /// Returns all entries, column by column, for writing.
    pub fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.data
    }

    /// Returns column j.
    pub fn column(&self, j: usize) -> &[f64] {
        &self.data[j * self.rows..(j + 1) * self.rows]
    }

    /// Returns column j for writing.
    pub fn column_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.data[j * self.rows..(j + 1) * self.rows]
    }

    /// Appends the columns of `other`, which must have as many rows as `self`.
    pub fn append(&mut self, other: &Matrix) {
        assert_eq!(self.rows, other.rows, "columns of unequal length");
        self.data.extend_from_slice(&other.data);
        self.columns += other.columns;
    }

    /// Copies a range of columns.
    pub fn column_range(&self, range: std::ops::Range<usize>) -> Matrix {
        Matrix {
            rows: self.rows,
            columns: range.len(),
            data: self.data[range.start * self.rows..range.end * self.rows].to_vec(),
        }
    }

    pub(super) fn view(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.data, self.rows, self.columns)
    }

    pub(super) fn view_mut(&mut self) -> MatMut<'_, f64> {
        MatMut::from_column_major_slice_mut(&mut self.data, self.rows, self.columns)
    }

    /// Returns `self * other`.
    pub fn times(&self, other: &Matrix) -> Matrix {
        let mut product = Matrix::zeros(self.rows, other.columns);
        product.add_product(1.0, self, other);
        product
    }

    /// Returns `selfᵀ * other`.
    pub fn transpose_times(&self, other: &Matrix) -> Matrix {
        let mut product = Matrix::zeros(self.columns, other.columns);
        multiply(
            product.view_mut(),
            Accum::Replace,
            self.view().transpose(),
            other.view(),
            1.0,
        );
        product
    }

    /// Returns `self * otherᵀ`.
    pub fn times_transpose(&self, other: &Matrix) -> Matrix {
        let mut product = Matrix::zeros(self.rows, other.rows);
        multiply(
            product.view_mut(),
            Accum::Replace,
            self.view(),
            other.view().transpose(),
            1.0,
        );
        product
    }

    /// Adds a product: `self += factor * a * b`.
    pub fn add_product(&mut self, factor: f64, a: &Matrix, b: &Matrix) {
        multiply(self.view_mut(), Accum::Add, a.view(), b.view(), factor);
    }

    /// Adds a multiple: `self += factor * other`.
    pub fn add(&mut self, factor: f64, other: &Matrix) {
        for (mine, theirs) in self.data.iter_mut().zip(&other.data) {
            *mine += factor * theirs;
        }
    }

    /// Computes the eigenvalues in ascending order and the orthonormal eigenvectors of a symmetric matrix. Reads the
    /// lower triangle only.
    pub fn symmetric_eigen(&self) -> Result<(Vec<f64>, Matrix), LinalgError> {
        let size = self.rows;
        // faer's divide and conquer (from 128 rows on) loses repeated eigenvalues, so it is switched off. On a block
        // of 162 degrees of freedom its error was 2e-4 of the largest eigenvalue.
        let mut params: SelfAdjointEvdParams = Auto::<f64>::auto();
        params.recursion_threshold = usize::MAX;
        let vectors_too = ComputeEigenvectors::Yes;
        let scratch = self_adjoint_evd_scratch::<f64>(size, vectors_too, Par::Seq, params.into());
        let mut values = Diag::zeros(size);
        let mut vectors = Matrix::zeros(size, size);
        with_cleared_registers(|| {
            self_adjoint_evd(
                self.view(),
                values.as_mut(),
                Some(vectors.view_mut()),
                Par::Seq,
                MemStack::new(&mut MemBuffer::new(scratch)),
                params.into(),
            )
        })
        .map_err(|_| LinalgError::NoEigenvalues { size })?;
        let values: Vec<f64> = (0..size).map(|i| values[i]).collect();
        if values.iter().any(|v| !v.is_finite()) {
            return Err(LinalgError::NoEigenvalues { size });
        }
        Ok((values, vectors))
    }

    /// Computes the lower triangular factor L of a symmetric positive definite matrix L Lᵀ. Reads the lower triangle
    /// only.
    pub fn cholesky(&self) -> Result<Matrix, LinalgError> {
        let size = self.rows;
        let factor = with_cleared_registers(|| self.view().llt(Side::Lower)).map_err(|error| {
            let LltError::NonPositivePivot { index } = error;
            LinalgError::NotPositiveDefinite { size, row: index }
        })?;
        let lower = factor.L();
        Ok(Matrix::from_fn(size, size, |i, j| {
            if i < j { 0.0 } else { lower[(i, j)] }
        }))
    }

    /// Overwrites `right` with L⁻¹ `right`, where L is `self`, a lower triangular matrix.
    pub fn solve_lower(&self, right: &mut Matrix) {
        with_cleared_registers(|| {
            solve_lower_triangular_in_place(self.view(), right.view_mut(), Par::Seq)
        });
    }

    /// Overwrites `right` with L⁻ᵀ `right`, where L is `self`, a lower triangular matrix.
    pub fn solve_lower_transposed(&self, right: &mut Matrix) {
        with_cleared_registers(|| {
            solve_upper_triangular_in_place(self.view().transpose(), right.view_mut(), Par::Seq)
        });
    }

    /// Overwrites `left` with `left` L⁻ᵀ, where L is `self`, a lower triangular matrix. If L Lᵀ is the Gram matrix of
    /// the columns, the columns become orthonormal.
    pub fn solve_upper_right(&self, left: &mut Matrix) {
        // X Lᵀ = A is equivalent to L Xᵀ = Aᵀ.
        with_cleared_registers(|| {
            solve_lower_triangular_in_place(self.view(), left.view_mut().transpose_mut(), Par::Seq)
        });
    }
}
