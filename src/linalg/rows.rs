//! Dense matrices stored row by row, real and complex, and their LU factors.

use std::ops::{Add, AddAssign, Div, Mul, Sub};

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor::{lu_in_place, lu_in_place_scratch};
use faer::linalg::lu::partial_pivoting::solve::{
    solve_transpose_in_place_scratch, solve_transpose_in_place_with_conj,
};
use faer::perm::PermRef;
use faer::traits::ComplexField;
use faer::{Accum, Conj, MatMut, MatRef, Par};
use num_complex::Complex64;
use pulp::Arch;

use super::registers::{multiply, with_cleared_registers};
use super::{LinalgError, Matrix};

/// Share of the largest matrix entry below which the factorisation treats a pivot as zero.
const SINGULAR: f64 = 1e-15;

/// A real or complex number.
pub trait Scalar:
    ComplexField
    + Copy
    + Default
    + PartialEq
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
{
    /// The number one.
    const ONE: Self;
    /// Returns the absolute value.
    fn magnitude(self) -> f64;
}

impl Scalar for f64 {
    const ONE: f64 = 1.0;
    fn magnitude(self) -> f64 {
        self.abs()
    }
}

impl Scalar for f32 {
    const ONE: f32 = 1.0;
    fn magnitude(self) -> f64 {
        self.abs().into()
    }
}

impl Scalar for Complex64 {
    const ONE: Complex64 = Complex64::new(1.0, 0.0);
    fn magnitude(self) -> f64 {
        self.norm()
    }
}

/// Adds the product `a * b` to `out`. `a` is `rows × inner`; the `inner` rows of `b` begin `stride` entries apart.
/// All matrices are row by row, and `out` has `rows` rows.
pub fn add_product_of_rows(
    out: &mut [f64],
    a: &[f64],
    b: &[f64],
    [rows, inner]: [usize; 2],
    stride: usize,
) {
    let columns = out.len() / rows;
    let a = MatRef::from_row_major_slice(a, rows, inner);
    let b = MatRef::from_row_major_slice_with_stride(b, inner, columns, stride);
    let target = MatMut::from_row_major_slice_mut(out, rows, columns);
    multiply(target, Accum::Add, a, b, 1.0);
}

/// Dense matrix stored row by row: entry (i, j) is at `i * columns + j`.
#[derive(Debug, Clone, PartialEq)]
pub struct RowMatrix<T = f64> {
    rows: usize,
    columns: usize,
    values: Vec<T>,
}

/// Share of the largest value below which the conversion to single precision replaces a value by zero. The share is far
/// smaller than the relative rounding error of single precision. The replacement avoids denormal numbers. Arithmetic
/// with denormal numbers is a hundred times slower.
const NEGLIGIBLE: f64 = 1e-12;

/// Converts numbers to single precision and replaces negligible ones by zero.
pub fn single(values: &[f64]) -> Vec<f32> {
    let largest = values.iter().fold(0.0_f64, |m, value| m.max(value.abs()));
    let least = NEGLIGIBLE * largest;
    let counts = |value: f64| if value.abs() < least { 0.0 } else { value };
    values.iter().map(|value| counts(*value) as f32).collect()
}

impl RowMatrix {
    /// Converts the matrix to single precision, as [`single`] does.
    pub fn single(&self) -> RowMatrix<f32> {
        RowMatrix {
            rows: self.rows,
            columns: self.columns,
            values: single(&self.values),
        }
    }
}

impl RowMatrix<f32> {
    /// Converts the matrix to double precision.
    pub fn double(&self) -> RowMatrix {
        RowMatrix {
            rows: self.rows,
            columns: self.columns,
            values: self.values.iter().map(|value| f64::from(*value)).collect(),
        }
    }
}

impl<T: Scalar> RowMatrix<T> {
    /// Returns a matrix of zeros.
    pub fn zeros(rows: usize, columns: usize) -> RowMatrix<T> {
        RowMatrix {
            rows,
            columns,
            values: vec![T::default(); rows * columns],
        }
    }

    /// Returns the identity matrix.
    pub fn identity(order: usize) -> RowMatrix<T> {
        RowMatrix::diagonal(&vec![T::ONE; order])
    }

    /// Builds a matrix from values row by row.
    ///
    /// # Errors
    /// [`LinalgError::WrongLength`] if the number of values is not `rows * columns`.
    pub fn from_rows(rows: usize, columns: usize, values: Vec<T>) -> Result<Self, LinalgError> {
        if values.len() != rows * columns {
            return Err(LinalgError::WrongLength {
                found: values.len(),
                rows,
                columns,
            });
        }
        Ok(RowMatrix {
            rows,
            columns,
            values,
        })
    }

    /// Returns a diagonal matrix.
    pub fn diagonal(values: &[T]) -> RowMatrix<T> {
        let mut matrix = RowMatrix::zeros(values.len(), values.len());
        for (i, &value) in values.iter().enumerate() {
            matrix.set(i, i, value);
        }
        matrix
    }

    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Returns entry (i, j).
    pub fn at(&self, i: usize, j: usize) -> T {
        self.values[i * self.columns + j]
    }

    /// Sets entry (i, j).
    pub fn set(&mut self, i: usize, j: usize, value: T) {
        self.values[i * self.columns + j] = value;
    }

    /// Returns row i.
    pub fn row(&self, i: usize) -> &[T] {
        &self.values[i * self.columns..][..self.columns]
    }

    /// Returns row i for writing.
    pub fn row_mut(&mut self, i: usize) -> &mut [T] {
        &mut self.values[i * self.columns..][..self.columns]
    }

    /// Returns all entries, row by row.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// Returns all entries, row by row, for writing.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// Converts the matrix into the list of the matrix entries, row by row.
    pub fn into_values(self) -> Vec<T> {
        self.values
    }

    fn view(&self) -> MatRef<'_, T> {
        MatRef::from_row_major_slice(&self.values, self.rows, self.columns)
    }

    fn view_mut(&mut self) -> MatMut<'_, T> {
        MatMut::from_row_major_slice_mut(&mut self.values, self.rows, self.columns)
    }

    /// Returns the transpose.
    pub fn transposed(&self) -> RowMatrix<T> {
        let mut out = RowMatrix::zeros(self.columns, self.rows);
        for i in 0..self.rows {
            for (j, &value) in self.row(i).iter().enumerate() {
                out.set(j, i, value);
            }
        }
        out
    }

    /// Returns the product with `other`, which must have as many rows as `self` has columns.
    pub fn times(&self, other: &RowMatrix<T>) -> RowMatrix<T> {
        let mut out = RowMatrix::zeros(self.rows, other.columns);
        out.add_product(self, other);
        out
    }

    /// Adds a product: `self += a * b`.
    pub fn add_product(&mut self, a: &RowMatrix<T>, b: &RowMatrix<T>) {
        let add = Accum::Add;
        multiply(self.view_mut(), add, a.view(), b.view(), T::ONE);
    }

    /// Adds a product with a transposed left factor: `self += aᵀ * b`.
    pub fn add_transposed_product(&mut self, a: &RowMatrix<T>, b: &RowMatrix<T>) {
        let (target, add) = (self.view_mut(), Accum::Add);
        multiply(target, add, a.view().transpose(), b.view(), T::ONE);
    }

    /// Adds a product with a transposed right factor: `self += a * bᵀ`.
    pub fn add_product_transposed(&mut self, a: &RowMatrix<T>, b: &RowMatrix<T>) {
        let (target, add) = (self.view_mut(), Accum::Add);
        multiply(target, add, a.view(), b.view().transpose(), T::ONE);
    }

    /// Returns the product with a vector.
    pub fn apply(&self, vector: &[T]) -> Vec<T> {
        (0..self.rows)
            .map(|i| {
                let products = self.row(i).iter().zip(vector).map(|(&a, &b)| a * b);
                products.fold(T::default(), |sum, product| sum + product)
            })
            .collect()
    }

    /// Computes the LU factors with row exchanges.
    ///
    /// # Errors
    /// [`LinalgError::Singular`] if a pivot is zero to rounding, or an entry is not finite.
    pub fn factorize(mut self) -> Result<Factors<T>, LinalgError> {
        let size = self.rows;
        assert_eq!(size, self.columns, "only square matrices have LU factors");
        let largest = self.values.iter().fold(0.0, |largest: f64, value| {
            // `f64::max` ignores NaN. This loop returns NaN for a matrix with NaN, so that the solver rejects the
            // matrix.
            let size = value.magnitude();
            if size > largest || size.is_nan() {
                size
            } else {
                largest
            }
        });
        let (mut order, mut place) = (vec![0_usize; size], vec![0_usize; size]);
        let scratch =
            lu_in_place_scratch::<usize, T>(size, size, Par::Seq, faer::prelude::default());
        // The rows are the columns of the transpose, so faer factorizes the transpose in place.
        with_cleared_registers(|| {
            lu_in_place(
                MatMut::from_column_major_slice_mut(&mut self.values, size, size),
                &mut order,
                &mut place,
                Par::Seq,
                MemStack::new(&mut MemBuffer::new(scratch)),
                faer::prelude::default(),
            )
        });
        for pivot in 0..size {
            let magnitude = self.at(pivot, pivot).magnitude();
            if !magnitude.is_finite() || !largest.is_finite() || magnitude <= SINGULAR * largest {
                return Err(LinalgError::Singular {
                    size,
                    pivot,
                    share: magnitude / largest,
                });
            }
        }
        Ok(Factors {
            lu: self,
            order,
            place,
        })
    }
}

/// Runs `work` with the widest vector instructions of the processor, as far as `work` is inlined.
///
/// The results do not depend on the processor: every product and sum is rounded separately, in the order written.
#[inline(always)]
pub fn vectorised<R>(work: impl FnOnce() -> R) -> R {
    Arch::new().dispatch(work)
}

/// Adds a multiple: `target += factor * source`.
#[inline(always)]
pub fn add_scaled<T: Scalar>(target: &mut [T], factor: T, source: &[T]) {
    for (target, &source) in target.iter_mut().zip(source) {
        *target += factor * source;
    }
}

/// LU factors of a square matrix, with row exchanges.
#[derive(Debug, Clone)]
pub struct Factors<T = f64> {
    /// Factors of the transpose, column by column.
    lu: RowMatrix<T>,
    order: Vec<usize>,
    place: Vec<usize>,
}

impl<T: Scalar> Factors<T> {
    fn solve_view(&self, right: MatMut<'_, T>) {
        let size = self.lu.rows;
        let lu = MatRef::from_column_major_slice(&self.lu.values, size, size);
        let scratch = solve_transpose_in_place_scratch::<usize, T>(size, right.ncols(), Par::Seq);
        with_cleared_registers(|| {
            solve_transpose_in_place_with_conj(
                lu,
                lu,
                PermRef::new_checked(&self.order, &self.place, size),
                Conj::No,
                right,
                Par::Seq,
                MemStack::new(&mut MemBuffer::new(scratch)),
            )
        });
    }

    /// Overwrites `right` with the solution.
    pub fn solve(&self, right: &mut [T]) {
        let size = self.lu.rows;
        self.solve_view(MatMut::from_column_major_slice_mut(right, size, 1));
    }

    /// Overwrites every column of `right` with its solution.
    pub fn solve_columns(&self, right: &mut RowMatrix<T>) {
        self.solve_view(right.view_mut());
    }

    /// Returns the inverse.
    pub fn inverse(&self) -> RowMatrix<T> {
        let mut inverse = RowMatrix::identity(self.lu.rows);
        self.solve_columns(&mut inverse);
        inverse
    }
}

/// Solves the generalised eigenproblem `stiffness` v = λ `mass` v of two symmetric matrices.
///
/// Returns the eigenvalues λ in ascending order and the matrix of eigenvectors. Column r is eigenvector r, with vᵀ
/// `mass` v = 1.
///
/// # Errors
/// [`LinalgError::NotPositiveDefinite`] if the mass is not positive definite; [`LinalgError::NoEigenvalues`] if the
/// iteration does not converge.
pub fn generalised_eigen(
    stiffness: &RowMatrix,
    mass: &RowMatrix,
) -> Result<(Vec<f64>, RowMatrix), LinalgError> {
    let size = stiffness.rows;
    let columns = |m: &RowMatrix| Matrix::from_fn(m.rows, m.columns, |i, j| m.at(i, j));
    let lower = columns(mass).cholesky()?;
    let mut reduced = columns(stiffness);
    lower.solve_lower(&mut reduced);
    lower.solve_upper_right(&mut reduced);
    let (values, vectors) = reduced.symmetric_eigen()?;
    // Row r is (L⁻ᵀ v)ᵀ with column v of `vectors`: eigenvector r of the generalised problem.
    let mut rows = RowMatrix::zeros(size, size);
    for r in 0..size {
        let row = rows.row_mut(r);
        row.copy_from_slice(vectors.column(r));
        for i in (0..size).rev() {
            let mut sum = row[i];
            for k in i + 1..size {
                sum -= lower[(k, i)] * row[k];
            }
            row[i] = sum / lower[(i, i)];
        }
    }
    Ok((values, rows.transposed()))
}
