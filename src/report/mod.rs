//! What is read from finished runs. Needs the feature `polars`, which is named in this folder only.

mod compare;
mod error;

pub use compare::{Cell, Comparison, Rows, compare};
pub use error::CompareError;
