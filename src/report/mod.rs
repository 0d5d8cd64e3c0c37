//! What is read from finished runs, and from those that go on. What reads tables of many iterations at once needs the feature
//! `polars`, which is named in this folder only.

#[cfg(feature = "polars")]
pub mod claims;
#[cfg(feature = "polars")]
mod compare;
#[cfg(feature = "polars")]
mod error;
#[cfg(feature = "polars")]
mod run_tables;
#[cfg(feature = "polars")]
mod scan;
pub mod trade;

#[cfg(feature = "polars")]
pub use compare::{Cell, Comparison, Rows, compare};
#[cfg(feature = "polars")]
pub use error::ReportError;
#[cfg(feature = "polars")]
pub use run_tables::{RunTables, numbers, scan_runs, texts};
#[cfg(feature = "polars")]
pub use scan::{ORDER, RUN, WEAR_ITERATION};
