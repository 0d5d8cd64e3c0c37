//! The stages of a run. A stage declares input tables, parts of the recipe, output tables, and a function that computes
//! the output tables. A runner runs the stages.
//!
//! ```text
//! structure, surface, reference (once) ─> unworn ─┐
//!                  ┌──────────────────────────────┴─────── wear <─────────────────────────────┐
//!                  └> static_contact ─> model_update ─> dynamic_response ─> fretting_cycle ─> summary
//! ```

mod agreement;
mod backbone;
mod clock;
mod coarse_trajectory;
mod computed_motion;
mod contact_elements;
mod contact_state;
mod cycle_check;
mod declaration;
mod dynamic_response;
mod error;
mod error_bars;
mod exported;
mod forced_response;
mod fretting_cycle;
mod graph;
mod grid_twin;
mod half_grid;
mod joint_state;
mod ledger;
mod linear_resonances;
mod list;
mod model_update;
mod observer;
mod output_schedule;
mod pace;
mod plausibility;
mod recompute;
mod reduced;
mod reference;
mod response_notices;
mod run;
mod run_cost;
mod run_status;
mod runner;
mod solvers;
mod stage;
mod stage_inputs;
mod static_contact;
mod structure;
mod summary;
mod surface;
mod wear;

pub use backbone::{add_backbone, backbone_of_run, backbone_of_scene, resonance_of_scenes};
pub use declaration::{Declaration, is_in};
pub use error::RunError;
pub use exported::{ExportedContact, exported_contact};
pub use graph::graph;
pub use joint_state::{JointState, RunEnds};
pub use linear_resonances::linear_resonances;
pub use list::{STAGES, stages_of};
pub use observer::{Observer, Progress};
pub use pace::Pace;
pub use plausibility::plausibility_checks;
pub use recompute::{Recomputed, recompute};
pub use reduced::ReducedTables;
pub use response_notices::no_resonance_message;
pub use run::{Ending, FREE_KEYS, Outcome, RunOptions, Source, identity_of, run};
pub use run_cost::RunCost;
pub use run_status::{LastUpdate, RunStatus};
pub use stage::{Stage, UnknownStage, When};
