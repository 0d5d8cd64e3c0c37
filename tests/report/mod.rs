//! What is read from finished runs.

#[cfg(feature = "polars")]
mod compare;
mod trade;
