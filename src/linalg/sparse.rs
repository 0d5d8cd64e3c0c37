//! Sparse symmetric matrices, and the triangular factors of these matrices.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, IntranodeLbltRef, LltRef, SymbolicCholesky, SymbolicCholeskyRaw,
    SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, amd};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, Par, Side};

use super::registers::with_cleared_registers;
use super::{LinalgError, Matrix};

/// Sparse symmetric matrix. The lower triangle with the diagonal is stored by columns, with ascending rows in each.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseSymmetric {
    /// Start of each column: column j has the entries `starts[j]..starts[j + 1]`. The length is the number of columns
    /// + 1.
    pub starts: Vec<usize>,
    /// Row of each entry, equal to or greater than its column.
    pub rows: Vec<usize>,
    /// Value of each entry.
    pub values: Vec<f64>,
}

impl SparseSymmetric {
    /// Builds the matrix from the entries of the lower triangle: column, row, value. The entries are sorted by
    /// column, then by row, and have no duplicates.
    pub fn from_sorted(size: usize, entries: &[(u32, u32, f64)]) -> Self {
        let mut starts = vec![0; size + 1];
        for entry in entries {
            debug_assert!(entry.0 <= entry.1);
            starts[entry.0 as usize + 1] += 1;
        }
        for j in 0..size {
            starts[j + 1] += starts[j];
        }
        SparseSymmetric {
            starts,
            rows: entries.iter().map(|e| e.1 as usize).collect(),
            values: entries.iter().map(|e| e.2).collect(),
        }
    }

    /// Returns the number of rows.
    pub fn size(&self) -> usize {
        self.starts.len() - 1
    }

    /// Returns the rows and values of a column's entries on and below the diagonal.
    pub fn column(&self, j: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[j]..self.starts[j + 1];
        self.rows[range.clone()]
            .iter()
            .copied()
            .zip(self.values[range].iter().copied())
    }

    /// Returns the diagonal, with zero where no entry is stored.
    pub fn diagonal(&self) -> Vec<f64> {
        (0..self.size())
            .map(|j| self.column(j).find(|&(i, _)| i == j).map_or(0.0, |e| e.1))
            .collect()
    }

    /// Returns the product with each column of `block`.
    pub fn times(&self, block: &Matrix) -> Matrix {
        let mut product = Matrix::zeros(block.rows(), block.columns());
        for c in 0..block.columns() {
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

    /// Returns `self + factor * other` on the union of both sparsity patterns.
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

/// Computes an elimination order with little fill by approximate minimum degree. The method needs no coordinates.
pub fn minimum_degree(matrix: &SparseSymmetric) -> Result<Vec<usize>, LinalgError> {
    let size = matrix.size();
    let (mut forward, mut inverse) = (vec![0; size], vec![0; size]);
    let entries = matrix.rows.len();
    let scratch = amd::order_scratch::<usize>(size, entries);
    let mut memory =
        MemBuffer::try_new(scratch).map_err(|_| LinalgError::TooLarge { size, entries })?;
    amd::order(
        &mut forward,
        &mut inverse,
        matrix.view().symbolic(),
        amd::Control::default(),
        MemStack::new(&mut memory),
    )
    .map_err(|_| LinalgError::TooLarge { size, entries })?;
    Ok(forward)
}

/// Order in which the factorisation eliminates the rows. `forward` lists the rows in this order. The inverse lists the
/// place of each row in the order.
#[derive(Debug, Clone, PartialEq)]
struct Permutation {
    forward: Vec<usize>,
    inverse: Vec<usize>,
}

impl Permutation {
    fn new(order: &[usize], size: usize) -> Result<Self, LinalgError> {
        let error = LinalgError::NotAPermutation {
            size,
            length: order.len(),
        };
        if order.len() != size {
            return Err(error);
        }
        let mut inverse = vec![usize::MAX; size];
        for (place, &row) in order.iter().enumerate() {
            if row >= size || inverse[row] != usize::MAX {
                return Err(error);
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
            // The function `trailing_factor` reads supernodes, so the factorisation must have supernodes even for a
            // small matrix.
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        },
    )
    .map_err(|_| LinalgError::TooLarge {
        size,
        entries: matrix.rows.len(),
    })
}

/// Cholesky factor L of a sparse symmetric positive definite matrix A, with P A Pᵀ = L Lᵀ.
pub struct SparseCholesky {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    order: Vec<usize>,
}

impl SparseCholesky {
    /// Factorizes a matrix whose rows are eliminated in the given order.
    pub fn new(matrix: &SparseSymmetric, order: &[usize]) -> Result<Self, LinalgError> {
        let size = matrix.size();
        let symbolic = symbolic(matrix, order)?;
        let mut values = vec![0.0; symbolic.len_val()];
        let mut memory = MemBuffer::new(
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
        );
        let factorized = with_cleared_registers(|| {
            symbolic.factorize_numeric_llt(
                &mut values,
                matrix.view(),
                Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
        });
        factorized.map_err(|error| match error {
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

    /// Returns the number of entries stored for the factor.
    pub fn entries(&self) -> usize {
        self.values.len()
    }

    /// Returns the number of entries that [`SparseCholesky::new`] would store. The count depends only on the sparsity
    /// pattern of the matrix.
    ///
    /// # Errors
    /// Returns the errors of [`SparseCholesky::new`], except that the matrix need not be positive definite.
    pub fn count_entries(matrix: &SparseSymmetric, order: &[usize]) -> Result<usize, LinalgError> {
        Ok(symbolic(matrix, order)?.len_val())
    }

    /// Overwrites `right` with A⁻¹ `right`.
    pub fn solve(&self, right: &mut Matrix) {
        let scratch = self
            .symbolic
            .solve_in_place_scratch::<f64>(right.columns(), Par::Seq);
        let mut memory = MemBuffer::new(scratch);
        let factor = LltRef::new(&self.symbolic, &self.values);
        with_cleared_registers(|| {
            factor.solve_in_place_with_conj(
                Conj::No,
                right.view_mut(),
                Par::Seq,
                MemStack::new(&mut memory),
            )
        });
    }

    /// Returns the last `count` rows of the elimination order.
    pub fn last_rows(&self, count: usize) -> &[usize] {
        &self.order[self.order.len() - count..]
    }

    /// Returns the dense factor T of the last `count` rows. The block of A⁻¹ for the last `count` rows and columns is
    /// (T Tᵀ)⁻¹. To compute a flexibility between the last rows, a solve needs only T and not the whole factor.
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

/// Factorization of a sparse symmetric matrix that may be indefinite (K − ω²M above the first mode).
///
/// Pivoting is restricted to supernodes, so the caller must check a solution by its residual.
pub struct SparseIndefinite {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    off_diagonal: Vec<f64>,
    forward: Vec<usize>,
    inverse: Vec<usize>,
}

impl SparseIndefinite {
    /// Factorizes a matrix whose rows are eliminated in about the given order. Pivoting within supernodes may change
    /// the order of elimination.
    pub fn new(matrix: &SparseSymmetric, order: &[usize]) -> Result<Self, LinalgError> {
        let size = matrix.size();
        let symbolic = symbolic(matrix, order)?;
        let mut values = vec![0.0; symbolic.len_val()];
        let mut off_diagonal = vec![0.0; size];
        let (mut forward, mut inverse) = (vec![0; size], vec![0; size]);
        let mut memory = MemBuffer::new(
            symbolic.factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Default::default()),
        );
        with_cleared_registers(|| {
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
            )
        });
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
            .solve_in_place_scratch::<f64>(right.columns(), Par::Seq);
        let mut memory = MemBuffer::new(scratch);
        let factor = IntranodeLbltRef::new(
            &self.symbolic,
            &self.values,
            &self.off_diagonal,
            PermRef::new_checked(&self.forward, &self.inverse, self.forward.len()),
        );
        with_cleared_registers(|| {
            factor.solve_in_place_with_conj(
                Conj::No,
                right.view_mut(),
                Par::Seq,
                MemStack::new(&mut memory),
            )
        });
    }
}
