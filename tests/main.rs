//! All tests of the crate's outside, one binary; its modules mirror `src/`.

mod cli;
mod contact;
mod dynamics;
mod imports;
mod plan;
mod quadrature;
mod reference;
mod scene;
mod stages;
mod store;
mod support;
mod surface;
mod tables;
mod units;
mod validate;
mod wear;
