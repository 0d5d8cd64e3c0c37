//! What is read from finished runs. The comparison of summaries needs the feature `polars`, which is named in this folder only.

#[cfg(feature = "polars")]
mod compare;
#[cfg(feature = "polars")]
mod error;
pub mod trade;

#[cfg(feature = "polars")]
pub use compare::{Cell, Comparison, Rows, compare};
#[cfg(feature = "polars")]
pub use error::CompareError;
