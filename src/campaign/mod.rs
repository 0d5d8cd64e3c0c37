//! Campaigns: many runs of one scene with varying keys, as a table with one row per run.
//!
//! ```text
//! DIR/
//!   campaign.json campaign.toml   the plan: text of the scene, kept files; a copy of the campaign file
//!   campaign.parquet              one row per run: index from 0, keys as resolved, content key, expected cost
//!   runs/000017/                  the run folder of a row, as of `fretwear run`
//!   ended/000017.parquet          the history of a completed run: one file per run
//!   failed/000017.json            the reason of a failure, until the row completes
//!   collected/shard-00000.parquet the histories of many runs; each row has its index and keys
//!   locks/000017                  lock of the process that computes the row; removed when the row completes
//!   lock                          lock of the single planner or collector
//! ```
//!
//! A process computes a row from the files in the campaign folder. A later change of the original scene or campaign
//! file does not change the rows. The names of the existing files give the state of a row; counting states opens no
//! file. A shell, Slurm or HyperQueue starts the rows. The starting program queues the rows, chooses the machines, and
//! retries failed rows. The lock of a row keeps two processes from computing it at the same time.
//!
//! [`Definition`] reads a campaign file and returns the settings of every row, including [random draws](definition).
//! The command line resolves each row to a scene. [`CampaignFolder`] stores the rows; [`collect`](CampaignFolder::collect) and
//! [`Findings`] read their results.

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
pub use folder::{CampaignFolder, KeepRuns, Section, StoredCampaign};
pub use lifetimes::{Histories, Lifetimes};
pub use rows::{Failure, State, indices};
pub use table::{Campaign, KeyColumn, PlannedRun, ResolvedValue};
