//! Tests of the program parts that read finished runs.

#[cfg(feature = "polars")]
mod compare;
#[cfg(feature = "polars")]
mod compared;
#[cfg(feature = "polars")]
mod page;
#[cfg(feature = "polars")]
mod run_tables;
#[cfg(feature = "polars")]
mod small_runs;
mod trade;
#[cfg(feature = "polars")]
mod words;
