//! Campaigns: many runs of one scene of which some keys vary, as one table with a row a run.
//!
//! ```text
//! DIR/
//!   campaign.json campaign.toml   what it is: the scene as a text, what is kept of a run; the file as it was written, for people
//!   campaign.parquet              a row a run: index from 0, keys as resolved, content key, expected cost
//!   runs/000017/                  the run of a row, as `fretwear run` leaves it
//!   ended/000017.parquet          its history, once it has ended: one file a run
//!   failed/000017.json            why it failed, until it ends
//!   collected/shard-00000.parquet the histories of many runs, every row with its index and keys
//!   locks/000017                  held by who computes a row, and gone once it has ended
//!   lock                          one planner or collector at a time
//! ```
//!
//! A row is run from what the folder holds, so that a scene or a campaign file that is changed later changes no row. What became of a row
//! is said by which of these files there is: nothing is opened to count them. Queues, retries and places are the business of whoever starts
//! rows (a shell, Slurm, HyperQueue). Two that start the same row meet at its lock.
//!
//! A [`Definition`] is read from a campaign file and says the settings of every row, [`Draws`](definition) among them; the command line
//! resolves each to a scene; [`Folder`] keeps them; [`collect`](Folder::collect) and [`Findings`] read what came of them.

mod collect;
pub mod definition;
mod distribution;
mod error;
mod findings;
mod folder;
mod lifetimes;
mod rows;
pub mod statistics;
pub mod survival;
mod table;

pub use collect::CollectionSummary;
pub use definition::{Definition, Setting};
pub use distribution::Distribution;
pub use error::CampaignError;
pub use findings::{CollectedRuns, FIGURES, Figure, Findings, Sensitivity};
pub use folder::{About, Folder, KeepRuns, Section};
pub use lifetimes::{Histories, Lifetimes};
pub use rows::{Failure, State, indices};
pub use table::{Campaign, KeyColumn, PlannedRun, Resolved};
