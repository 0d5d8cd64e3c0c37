//! The stages of a run: each reads tables, calls numerics and writes tables.
//!
//! ```text
//! surface (once) ─> static_contact ─> fretting_cycle ─> commit ─> wear ─┐
//!                        ^                                              │
//!                        └───────────────── one wear iteration ─────────┘
//! ```

mod context;
mod curves;
mod dynamic_response;
mod error;
mod error_bars;
mod fretting_cycle;
mod indentation;
mod ledger;
mod model_update;
mod reference;
mod run;
mod spent;
mod standing;
mod state;
mod static_contact;
mod structure;
mod summary;
mod surface;
mod vibrating;
mod vibration_alone;
mod wear;

use std::fmt;
use std::str::FromStr;

pub use error::RunError;
pub use run::{Ending, Observer, Outcome, Progress, RunOptions, Source, run};
pub use spent::Spent;
pub use standing::{LastUpdate, Standing};
pub use summary::FREE_KEYS;

/// A stage, in the order in which an iteration passes through them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// The reduced structure, once a run and shared between runs.
    Structure,
    /// The unworn surface, once a run.
    Surface,
    /// The unworn joint under its load, once a run.
    Reference,
    /// The wear step that leads to an iteration.
    Wear,
    /// Pressure, gap and stiffness.
    StaticContact,
    /// The contact elements of the structure, where they are due.
    ModelUpdate,
    /// The steady vibration.
    DynamicResponse,
    /// Shear, slip and dissipation over a steady cycle.
    FrettingCycle,
}

impl Stage {
    /// All stages.
    pub const ALL: [Stage; 8] = [
        Stage::Structure,
        Stage::Surface,
        Stage::Reference,
        Stage::Wear,
        Stage::StaticContact,
        Stage::ModelUpdate,
        Stage::DynamicResponse,
        Stage::FrettingCycle,
    ];

    /// Name in tables, keys and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Structure => "structure",
            Stage::Surface => "surface",
            Stage::Reference => "reference",
            Stage::Wear => "wear",
            Stage::StaticContact => "static_contact",
            Stage::ModelUpdate => "model_update",
            Stage::DynamicResponse => "dynamic_response",
            Stage::FrettingCycle => "fretting_cycle",
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A name that is no stage.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("\"{name}\" is no stage; the stages are {}", Stage::ALL.map(Stage::name).join(", "))]
pub struct UnknownStage {
    /// The name.
    pub name: String,
}

impl FromStr for Stage {
    type Err = UnknownStage;

    fn from_str(name: &str) -> Result<Self, UnknownStage> {
        Stage::ALL
            .into_iter()
            .find(|stage| stage.name() == name)
            .ok_or_else(|| UnknownStage {
                name: name.to_owned(),
            })
    }
}
