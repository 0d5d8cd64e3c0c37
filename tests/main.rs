//! All tests of the crate's outside, one binary; its modules mirror `src/`.

mod scene;
mod store;
mod surface;
mod tables;
mod units;
mod wear;
