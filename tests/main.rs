//! All tests of the crate's outside, one binary; its modules mirror `src/`.

mod quadrature;
mod reference;
mod wear;
