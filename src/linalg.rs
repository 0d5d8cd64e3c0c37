//! Dense and sparse linear algebra: the only place that names `faer`.
//!
//! Everything runs on one thread and in a fixed order, so that equal input gives equal bits.

use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::linalg::evd::{
    ComputeEigenvectors, SelfAdjointEvdParams, self_adjoint_evd, self_adjoint_evd_scratch,
};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, IntranodeLbltRef, LltRef, SymbolicCholesky, SymbolicCholeskyRaw,
    SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Accum, Auto, Conj, MatMut, MatRef, Par, Side};

/// A factorization or decomposition that does not exist, or did not succeed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LinalgError {
    /// A pivot of a Cholesky factorization is not positive.
    #[error(
        "the matrix of {size} rows is not positive definite: the pivot of row {row} is not positive"
    )]
    NotPositiveDefinite {
        /// Rows of the matrix.
        size: usize,
        /// The row, in the matrix's own numbering.
        row: usize,
    },
    /// An eigenvalue iteration did not end.
    #[error(
        "the eigenvalues of a dense symmetric matrix of {size} rows did not converge; are its entries finite?"
    )]
    NoEigenvalues {
        /// Rows of the matrix.
        size: usize,
    },
    /// Not enough memory, or more entries than an index can count.
    #[error("a sparse factor of {size} rows and {entries} given entries does not fit into memory")]
    TooLarge {
        /// Rows of the matrix.
        size: usize,
        /// Entries of its lower triangle.
        entries: usize,
    },
    /// An elimination order that is not a permutation.
    #[error("the elimination order of {length} entries is not a permutation of the {size} rows")]
    NotAPermutation {
        /// Rows of the matrix.
        size: usize,
        /// Length of the order.
        length: usize,
    },
}

/// A dense matrix, column by column: entry (i, j) is at `j * rows + i`.
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
    /// A matrix of zeros.
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Matrix {
            rows,
            columns,
            data: vec![0.0; rows * columns],
        }
    }

    /// The matrix whose entry (i, j) is `entry(i, j)`.
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

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// All entries, column by column.
    pub fn as_slice(&self) -> &[f64] {
        &self.data
    }

    /// All entries, column by column.
    pub fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.data
    }

    /// Column j.
    pub fn column(&self, j: usize) -> &[f64] {
        &self.data[j * self.rows..(j + 1) * self.rows]
    }

    /// Column j.
    pub fn column_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.data[j * self.rows..(j + 1) * self.rows]
    }

    /// The columns of `self`, then those of `other`, which has as many rows.
    pub fn append(&mut self, other: &Matrix) {
        assert_eq!(self.rows, other.rows, "columns of unequal length");
        self.data.extend_from_slice(&other.data);
        self.columns += other.columns;
    }

    /// A copy of some columns.
    pub fn columns_of(&self, range: std::ops::Range<usize>) -> Matrix {
        Matrix {
            rows: self.rows,
            columns: range.len(),
            data: self.data[range.start * self.rows..range.end * self.rows].to_vec(),
        }
    }

    fn view(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.data, self.rows, self.columns)
    }

    fn view_mut(&mut self) -> MatMut<'_, f64> {
        MatMut::from_column_major_slice_mut(&mut self.data, self.rows, self.columns)
    }

    /// `self * other`.
    pub fn times(&self, other: &Matrix) -> Matrix {
        let mut product = Matrix::zeros(self.rows, other.columns);
        product.add_product(1.0, self, other);
        product
    }

    /// `selfᵀ * other`.
    pub fn transpose_times(&self, other: &Matrix) -> Matrix {
        let mut product = Matrix::zeros(self.columns, other.columns);
        matmul(
            product.view_mut(),
            Accum::Replace,
            self.view().transpose(),
            other.view(),
            1.0,
            Par::Seq,
        );
        product
    }

    /// `self * otherᵀ`.
    pub fn times_transpose(&self, other: &Matrix) -> Matrix {
        let mut product = Matrix::zeros(self.rows, other.rows);
        matmul(
            product.view_mut(),
            Accum::Replace,
            self.view(),
            other.view().transpose(),
            1.0,
            Par::Seq,
        );
        product
    }

    /// `self += factor * a * b`.
    pub fn add_product(&mut self, factor: f64, a: &Matrix, b: &Matrix) {
        matmul(
            self.view_mut(),
            Accum::Add,
            a.view(),
            b.view(),
            factor,
            Par::Seq,
        );
    }

    /// `self += factor * other`.
    pub fn add(&mut self, factor: f64, other: &Matrix) {
        for (mine, theirs) in self.data.iter_mut().zip(&other.data) {
            *mine += factor * theirs;
        }
    }

    /// Eigenvalues in ascending order and orthonormal eigenvectors of a symmetric matrix; its lower triangle is read.
    pub fn symmetric_eigen(&self) -> Result<(Vec<f64>, Matrix), LinalgError> {
        let size = self.rows;
        // faer's divide and conquer (from 128 rows on) lost repeated eigenvalues: 2e-4 of the largest on a block of 162 freedoms.
        let mut params: SelfAdjointEvdParams = Auto::<f64>::auto();
        params.recursion_threshold = usize::MAX;
        let vectors_too = ComputeEigenvectors::Yes;
        let scratch = self_adjoint_evd_scratch::<f64>(size, vectors_too, Par::Seq, params.into());
        let mut values = Diag::zeros(size);
        let mut vectors = Matrix::zeros(size, size);
        self_adjoint_evd(
            self.view(),
            values.as_mut(),
            Some(vectors.view_mut()),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            params.into(),
        )
        .map_err(|_| LinalgError::NoEigenvalues { size })?;
        let values: Vec<f64> = (0..size).map(|i| values[i]).collect();
        if values.iter().any(|v| !v.is_finite()) {
            return Err(LinalgError::NoEigenvalues { size });
        }
        Ok((values, vectors))
    }

    /// The lower triangular L of a symmetric positive definite matrix L Lᵀ; its lower triangle is read.
    pub fn cholesky(&self) -> Result<Matrix, LinalgError> {
        let size = self.rows;
        let factor = self.view().llt(Side::Lower).map_err(|error| {
            let LltError::NonPositivePivot { index } = error;
            LinalgError::NotPositiveDefinite { size, row: index }
        })?;
        let lower = factor.L();
        Ok(Matrix::from_fn(size, size, |i, j| {
            if i < j { 0.0 } else { lower[(i, j)] }
        }))
    }

    /// Overwrites `right` with L⁻¹ `right`, `self` being lower triangular.
    pub fn solve_lower(&self, right: &mut Matrix) {
        solve_lower_triangular_in_place(self.view(), right.view_mut(), Par::Seq);
    }

    /// Overwrites `left` with `left` L⁻ᵀ, `self` being lower triangular: columns whose Gram matrix is L Lᵀ become orthonormal.
    pub fn solve_upper_right(&self, left: &mut Matrix) {
        // X Lᵀ = A is L Xᵀ = Aᵀ.
        solve_lower_triangular_in_place(self.view(), left.view_mut().transpose_mut(), Par::Seq);
    }
}

/// A sparse symmetric matrix: its lower triangle with the diagonal, by columns, row numbers ascending in each.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseSymmetric {
    /// Column j holds the entries `starts[j]..starts[j + 1]`; one more than there are columns.
    pub starts: Vec<usize>,
    /// Row of each entry, at least its column.
    pub rows: Vec<usize>,
    /// Value of each entry.
    pub values: Vec<f64>,
}

impl SparseSymmetric {
    /// Number of rows.
    pub fn size(&self) -> usize {
        self.starts.len() - 1
    }

    /// Rows and values of a column's entries on and below the diagonal.
    pub fn column(&self, j: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[j]..self.starts[j + 1];
        self.rows[range.clone()]
            .iter()
            .copied()
            .zip(self.values[range].iter().copied())
    }

    /// The diagonal; zero where no entry is stored.
    pub fn diagonal(&self) -> Vec<f64> {
        (0..self.size())
            .map(|j| self.column(j).find(|&(i, _)| i == j).map_or(0.0, |e| e.1))
            .collect()
    }

    /// The product with each column of `block`.
    pub fn times(&self, block: &Matrix) -> Matrix {
        let mut product = Matrix::zeros(block.rows, block.columns);
        for c in 0..block.columns {
            let x = block.column(c);
            let y = product.column_mut(c);
            for j in 0..self.size() {
                let xj = x[j];
                let mut yj = 0.0;
                for (i, v) in self.column(j) {
                    y[i] += v * xj;
                    if i != j {
                        yj += v * x[i];
                    }
                }
                y[j] += yj;
            }
        }
        product
    }

    /// `self + factor * other`, on the union of both patterns.
    pub fn plus(&self, factor: f64, other: &SparseSymmetric) -> SparseSymmetric {
        let size = self.size();
        let mut sum = SparseSymmetric {
            starts: Vec::with_capacity(size + 1),
            rows: Vec::with_capacity(self.rows.len()),
            values: Vec::with_capacity(self.rows.len()),
        };
        sum.starts.push(0);
        for j in 0..size {
            let mut mine = self.column(j).peekable();
            let mut theirs = other.column(j).peekable();
            loop {
                let row = match (mine.peek(), theirs.peek()) {
                    (None, None) => break,
                    (Some(a), None) => a.0,
                    (None, Some(b)) => b.0,
                    (Some(a), Some(b)) => a.0.min(b.0),
                };
                let a = mine.next_if(|e| e.0 == row).map_or(0.0, |e| e.1);
                let b = theirs.next_if(|e| e.0 == row).map_or(0.0, |e| e.1);
                sum.rows.push(row);
                sum.values.push(a + factor * b);
            }
            sum.starts.push(sum.rows.len());
        }
        sum
    }

    fn view(&self) -> SparseColMatRef<'_, usize, f64> {
        let size = self.size();
        let pattern =
            SymbolicSparseColMatRef::new_checked(size, size, &self.starts, None, &self.rows);
        SparseColMatRef::new(pattern, &self.values)
    }
}

/// An elimination order: the rows of a matrix in the order in which they are eliminated, and its inverse.
#[derive(Debug, Clone, PartialEq)]
struct Permutation {
    forward: Vec<usize>,
    inverse: Vec<usize>,
}

impl Permutation {
    fn new(order: &[usize], size: usize) -> Result<Self, LinalgError> {
        let wrong = LinalgError::NotAPermutation {
            size,
            length: order.len(),
        };
        if order.len() != size {
            return Err(wrong);
        }
        let mut inverse = vec![usize::MAX; size];
        for (place, &row) in order.iter().enumerate() {
            if row >= size || inverse[row] != usize::MAX {
                return Err(wrong);
            }
            inverse[row] = place;
        }
        Ok(Permutation {
            forward: order.to_vec(),
            inverse,
        })
    }
}

fn symbolic(
    matrix: &SparseSymmetric,
    order: &[usize],
) -> Result<SymbolicCholesky<usize>, LinalgError> {
    let size = matrix.size();
    let permutation = Permutation::new(order, size)?;
    factorize_symbolic_cholesky(
        matrix.view().symbolic(),
        Side::Lower,
        SymmetricOrdering::Custom(PermRef::new_checked(
            &permutation.forward,
            &permutation.inverse,
            size,
        )),
        CholeskySymbolicParams {
            // The trailing block is read out of the supernodes, so there must be supernodes, in a small matrix too.
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        },
    )
    .map_err(|_| LinalgError::TooLarge {
        size,
        entries: matrix.rows.len(),
    })
}

/// The factor L of a sparse symmetric positive definite matrix, P A Pᵀ = L Lᵀ.
pub struct SparseCholesky {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    order: Vec<usize>,
}

impl SparseCholesky {
    /// Factors a matrix, its rows eliminated in the given order.
    pub fn new(matrix: &SparseSymmetric, order: &[usize]) -> Result<Self, LinalgError> {
        let size = matrix.size();
        let symbolic = symbolic(matrix, order)?;
        let mut values = vec![0.0; symbolic.len_val()];
        let mut memory = MemBuffer::new(
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
        );
        symbolic
            .factorize_numeric_llt(
                &mut values,
                matrix.view(),
                Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .map_err(|error| match error {
                LltError::NonPositivePivot { index } => LinalgError::NotPositiveDefinite {
                    size,
                    row: order[index.min(size - 1)],
                },
            })?;
        Ok(SparseCholesky {
            symbolic,
            values,
            order: order.to_vec(),
        })
    }

    /// Entries stored for the factor.
    pub fn entries(&self) -> usize {
        self.values.len()
    }

    /// Overwrites `right` with A⁻¹ `right`.
    pub fn solve(&self, right: &mut Matrix) {
        let scratch = self
            .symbolic
            .solve_in_place_scratch::<f64>(right.columns, Par::Seq);
        let mut memory = MemBuffer::new(scratch);
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            right.view_mut(),
            Par::Seq,
            MemStack::new(&mut memory),
        );
    }

    /// The rows eliminated last, in their order of elimination.
    pub fn last_rows(&self, count: usize) -> &[usize] {
        &self.order[self.order.len() - count..]
    }

    /// The dense factor T of the rows eliminated last: on those rows and columns A⁻¹ is (T Tᵀ)⁻¹, so a flexibility between
    /// them needs no solve with the whole factor.
    pub fn trailing_factor(&self, count: usize) -> Matrix {
        let SymbolicCholeskyRaw::Supernodal(structure) = self.symbolic.raw() else {
            unreachable!("the factor is always asked for as a supernodal one");
        };
        let first = self.order.len() - count;
        let factor = SupernodalLltRef::new(structure, &self.values);
        let mut trailing = Matrix::zeros(count, count);
        for s in 0..structure.n_supernodes() {
            let end = structure.supernode_end()[s];
            if end <= first {
                continue;
            }
            let supernode = factor.supernode(s);
            let (start, block) = (supernode.start(), supernode.val());
            for column in start.max(first)..end {
                for row in column..end {
                    trailing[(row - first, column - first)] = block[(row - start, column - start)];
                }
                for (place, &row) in supernode.pattern().iter().enumerate() {
                    trailing[(row - first, column - first)] =
                        block[(end - start + place, column - start)];
                }
            }
        }
        trailing
    }
}

/// A factorization of a sparse symmetric matrix that need not be positive definite (K − ω²M above the first mode).
///
/// Pivots are sought within supernodes only, so a solution is to be judged by its residual.
pub struct SparseIndefinite {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    off_diagonal: Vec<f64>,
    forward: Vec<usize>,
    inverse: Vec<usize>,
}

impl SparseIndefinite {
    /// Factors a matrix, its rows eliminated in about the given order.
    pub fn new(matrix: &SparseSymmetric, order: &[usize]) -> Result<Self, LinalgError> {
        let size = matrix.size();
        let symbolic = symbolic(matrix, order)?;
        let mut values = vec![0.0; symbolic.len_val()];
        let mut off_diagonal = vec![0.0; size];
        let (mut forward, mut inverse) = (vec![0; size], vec![0; size]);
        let mut memory = MemBuffer::new(
            symbolic.factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Default::default()),
        );
        symbolic.factorize_numeric_intranode_lblt(
            &mut values,
            &mut off_diagonal,
            &mut forward,
            &mut inverse,
            matrix.view(),
            Side::Lower,
            Par::Seq,
            MemStack::new(&mut memory),
            Default::default(),
        );
        Ok(SparseIndefinite {
            symbolic,
            values,
            off_diagonal,
            forward,
            inverse,
        })
    }

    /// Overwrites `right` with A⁻¹ `right`.
    pub fn solve(&self, right: &mut Matrix) {
        let scratch = self
            .symbolic
            .solve_in_place_scratch::<f64>(right.columns, Par::Seq);
        let mut memory = MemBuffer::new(scratch);
        IntranodeLbltRef::new(
            &self.symbolic,
            &self.values,
            &self.off_diagonal,
            PermRef::new_checked(&self.forward, &self.inverse, self.forward.len()),
        )
        .solve_in_place_with_conj(
            Conj::No,
            right.view_mut(),
            Par::Seq,
            MemStack::new(&mut memory),
        );
    }
}
