//! Dense and sparse linear algebra. No other module uses `faer`.
//!
//! All operations run on one thread in a fixed order, so that equal input gives bitwise equal results.

mod blocks;
mod dense;
mod registers;
mod rows;
mod sparse;
pub(crate) mod vectors;

pub use blocks::Blocks;
pub use dense::Matrix;
pub use rows::{
    Factors, RowMatrix, Scalar, add_product_of_rows, add_scaled, generalised_eigen, single,
    vectorised,
};
pub use sparse::{SparseCholesky, SparseIndefinite, SparseSymmetric, minimum_degree};

/// Error of a factorization or decomposition.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LinalgError {
    /// A pivot of a Cholesky factorization is not positive.
    #[error(
        "the matrix of {size} rows is not positive definite: the pivot of row {row} is not positive"
    )]
    NotPositiveDefinite {
        /// Rows of the matrix.
        size: usize,
        /// Row of the pivot, in the numbering of the matrix before reordering.
        row: usize,
    },
    /// A pivot of an LU factorization is zero to rounding, or not finite.
    #[error(
        "the matrix of {size} rows is singular: pivot {pivot} is {share:.3e} of the largest entry"
    )]
    Singular {
        /// Rows of the matrix.
        size: usize,
        /// Elimination step of the pivot, from 0.
        pivot: usize,
        /// Magnitude of the pivot divided by that of the largest entry.
        share: f64,
    },
    /// The number of values differs from the number of entries.
    #[error("{found} values do not fill a matrix of {rows} rows and {columns} columns")]
    WrongLength {
        /// Number of values.
        found: usize,
        /// Rows of the matrix.
        rows: usize,
        /// Columns of the matrix.
        columns: usize,
    },
    /// An eigenvalue iteration did not converge.
    #[error(
        "the eigenvalues of a dense matrix of {size} rows did not converge; are its entries finite?"
    )]
    NoEigenvalues {
        /// Rows of the matrix.
        size: usize,
    },
    /// The memory does not suffice, or the factor has more entries than an index can count.
    #[error(
        "the sparse factor of a matrix with {size} rows and {entries} entries does not fit into memory"
    )]
    TooLarge {
        /// Rows of the matrix.
        size: usize,
        /// Number of entries of the lower triangle of the matrix.
        entries: usize,
    },
    /// The elimination order is not a permutation of the rows.
    #[error("the elimination order of {length} entries is not a permutation of the {size} rows")]
    NotAPermutation {
        /// Rows of the matrix.
        size: usize,
        /// Length of the order.
        length: usize,
    },
}
