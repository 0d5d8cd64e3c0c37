//! All tests of the crate's outside, one binary; its modules mirror `src/`.

mod contact;
mod quadrature;
mod reference;
#[cfg(feature = "polars")]
mod report;
mod scene;
mod surface;
mod units;
mod validate;
mod wear;
