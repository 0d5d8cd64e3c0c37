//! The stages of a run: each is a value that says which tables and which parts of the recipe it reads, which tables it writes, and how
//! it computes the one from the other. A runner passes through them.
//!
//! ```text
//! structure, surface, reference (once) ─> unworn ─┐
//!                  ┌──────────────────────────────┴─────── wear <─────────────────────────────┐
//!                  └> static_contact ─> model_update ─> dynamic_response ─> fretting_cycle ─> summary
//! ```

mod contact_elements;
mod contact_state;
mod curves;
mod declaration;
mod dynamic_response;
mod error;
mod error_bars;
mod forced_response;
mod fretting_cycle;
mod graph;
mod indentation;
mod ledger;
mod model_update;
mod moment;
mod reads;
mod recompute;
mod reference;
mod run;
mod runner;
mod solvers;
mod spent;
mod standing;
mod static_contact;
mod structure;
mod summary;
mod surface;
mod wear;

pub use declaration::{Declaration, Stage, UnknownStage, When, is_in, stages_of};
pub use error::RunError;
pub use graph::graph;
pub use recompute::{Recomputed, recompute};
pub use run::{Ending, FREE_KEYS, Observer, Outcome, Progress, RunOptions, Source, run};
pub use spent::Spent;
pub use standing::{LastUpdate, Standing};

/// All stages, in the order in which they are passed through.
pub const STAGES: [&Declaration; 12] = [
    &structure::DECLARATION,
    &surface::DECLARATION,
    &reference::DECLARATION,
    &wear::UNWORN,
    &wear::DECLARATION,
    &static_contact::DECLARATION,
    &model_update::DECLARATION,
    &dynamic_response::DECLARATION,
    &forced_response::DECLARATION,
    &fretting_cycle::DECLARATION,
    &ledger::DECLARATION,
    &summary::DECLARATION,
];
