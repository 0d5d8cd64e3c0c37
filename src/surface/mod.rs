//! Rough surfaces of the joint: generated or measured, resampled to its grid, and described by statistics.
//!
//! Surface heights are in metres, and positive heights of one body point towards the opposite body. The surface is the
//! composite of both bodies against a flat. A field of heights lies on a [`Patch`](crate::grid::Patch) (index `i * ny +
//! j`, i along x). Cells outside the patch have no surface and contain 0. All functions of the module `surface` are
//! pure, except the functions of [`readers`], which read files.

pub mod correlation;
mod error;
pub mod generate;
pub mod prepare;
pub mod readers;
pub mod statistics;
pub mod topography;

pub use error::SurfaceError;
