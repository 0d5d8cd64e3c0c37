//! Rough surfaces of the joint: generated or measured, brought onto its grid, and described by numbers.
//!
//! Heights are in metres and positive towards the other body; the surface is the composite of both bodies against a flat. A
//! field of heights lies on a [`Patch`](crate::grid::Patch) (index `i * ny + j`, i along x); cells outside the patch have no
//! surface and hold 0. Everything here is pure except [`readers`], the one place that knows files.

pub mod correlation;
mod error;
pub mod generate;
pub mod prepare;
pub mod readers;
pub mod statistics;
pub mod topography;

pub use error::SurfaceError;
