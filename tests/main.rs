//! All tests of the public interface in one binary. The modules mirror `src/`.

mod campaign;
mod cli;
mod contact;
mod coupling;
mod doctor;
mod dynamics;
mod imports;
mod json;
mod linalg;
mod manifest;
mod milestones;
mod model_update;
mod plan;
mod quadrature;
mod reference;
mod report;
mod scene;
mod stages;
mod store;
mod structure;
#[cfg(feature = "polars")]
mod study;
mod support;
mod surface;
mod tables;
mod units;
mod wear;
