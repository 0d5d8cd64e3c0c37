//! Contact of two elastic half spaces: kernels, convolution, normal and tangential problem, stiffness.

mod error;

pub use error::ContactError;
