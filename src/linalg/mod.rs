//! Dense and sparse linear algebra: the only place that names `faer`.
//!
//! Everything runs on one thread and in a fixed order, so that equal input gives equal bits.

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
    /// A pivot of an LU factorization is zero but for rounding, or not finite.
    #[error(
        "the matrix of {size} rows is singular: pivot {pivot} has {share:.3e} of the largest entry"
    )]
    Singular {
        /// Rows of the matrix.
        size: usize,
        /// Where elimination stopped.
        pivot: usize,
        /// Size of the pivot over that of the largest entry.
        share: f64,
    },
    /// As many values as entries were expected.
    #[error("{found} values do not fill a matrix of {rows} rows and {columns} columns")]
    Length {
        /// Values found.
        found: usize,
        /// Rows of the matrix.
        rows: usize,
        /// Columns of the matrix.
        columns: usize,
    },
    /// An eigenvalue iteration did not end.
    #[error(
        "the eigenvalues of a dense matrix of {size} rows did not converge; are its entries finite?"
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
