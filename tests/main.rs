//! All tests of the crate's outside, one binary; its modules mirror `src/`.

mod store;
mod tables;
