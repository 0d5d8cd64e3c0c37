//! Dense and sparse linear algebra: the only place that names `faer`.
//!
//! Everything runs on one thread and in a fixed order, so that equal input gives equal bits.

mod dense;
mod sparse;

pub use dense::Matrix;
pub use sparse::{SparseCholesky, SparseIndefinite, SparseSymmetric};

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
