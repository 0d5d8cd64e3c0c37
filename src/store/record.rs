//! `run.json`: what a run is and how it came about.

use super::date;
use crate::COMMIT;
use crate::json::{flatten, hash, matches};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Number of the layout of run folders, campaign folders and caches: their files, tables and recipes. Every change of one of these raises
/// it, and folders of another number are rejected.
pub const LAYOUT: u32 = 10;

/// What the caller says a run is.
#[derive(Debug, Clone, PartialEq)]
pub struct RunIdentity {
    /// The scene as resolved, all defaults in it, as nested JSON objects.
    pub scene: Value,
    /// The scene as resolved, as the text of `scene.toml`.
    pub scene_toml: String,
    /// The scene as its user wrote it, for people; `None` leaves what the run has of it.
    pub scene_written: Option<String>,
    /// What was decided from the scene, as `plan.json` shows it.
    pub plan: Value,
    /// Version of the program.
    pub program_version: String,
    /// Threads that compute.
    pub threads: usize,
    /// Seed of the random surface, if there is one.
    pub seed: Option<u64>,
    /// Keys that cannot alter what is already computed: in full, as `wear.cycles`, or a section as `output.*`. They may change
    /// on an existing run and do not count in the scene hash.
    pub free_keys: Vec<String>,
    /// Keys, in the same form, whose values follow from others: a changed scene is refused with those others alone.
    pub following_keys: Vec<String>,
    /// Keys, in the same form, that a run must share with the one it begins from: its state would mean nothing with others.
    pub inherited_keys: Vec<String>,
}

impl RunIdentity {
    /// Hash of the scene without the free keys, so that a run that was extended has the same as one that was not.
    pub fn scene_hash(&self) -> String {
        let fixed: BTreeMap<String, Value> = flatten(&self.scene)
            .into_iter()
            .filter(|(key, _)| !matches(key, &self.free_keys))
            .collect();
        hash(&json!(fixed))
    }
}

/// The machine that computes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Operating system.
    pub os: String,
    /// Processor architecture.
    pub architecture: String,
    /// The vector instructions of the processor that the transforms choose by.
    pub cpu_features: Vec<String>,
    /// Processors there are.
    pub processors: usize,
}

impl Machine {
    /// This machine.
    pub fn this() -> Machine {
        Machine {
            os: std::env::consts::OS.to_owned(),
            architecture: std::env::consts::ARCH.to_owned(),
            cpu_features: cpu_features(),
            processors: std::thread::available_parallelism().map_or(1, usize::from),
        }
    }
}

#[cfg(target_arch = "x86_64")]
fn cpu_features() -> Vec<String> {
    [
        ("sse4.1", std::arch::is_x86_feature_detected!("sse4.1")),
        ("avx", std::arch::is_x86_feature_detected!("avx")),
        ("avx2", std::arch::is_x86_feature_detected!("avx2")),
        ("fma", std::arch::is_x86_feature_detected!("fma")),
        ("avx512f", std::arch::is_x86_feature_detected!("avx512f")),
    ]
    .into_iter()
    .filter(|(_, present)| *present)
    .map(|(name, _)| name.to_owned())
    .collect()
}

#[cfg(not(target_arch = "x86_64"))]
fn cpu_features() -> Vec<String> {
    Vec::new()
}

/// Where a sibling run began.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origin {
    /// Folder name of the run it was copied from.
    pub run: String,
    /// The iteration it began from.
    pub wear_iteration: u64,
    /// Hash of that iteration's commit.
    pub commit: String,
}

/// What remains of an iteration that was pruned: its place in the chain.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Pruned {
    /// Hash of its commit.
    pub hash: String,
    /// Hash of its parent.
    pub parent: Option<String>,
}

/// A start that continued the run under other circumstances than before.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Continuation {
    /// The iteration it continued from, `None` before the first.
    pub wear_iteration: Option<u64>,
    /// When that was, as [`RunRecord::began`].
    pub began: String,
    /// Version of the program.
    pub program_version: String,
    /// As [`RunRecord::program_commit`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub program_commit: Option<String>,
    /// Threads that computed.
    pub threads: usize,
    /// The machine.
    pub machine: Machine,
    /// Free keys whose values changed, each in words.
    pub changed_keys: Vec<String>,
}

/// The content of `failure.json`: why the last start failed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// When that was, as [`RunRecord::began`].
    pub when: String,
    /// The error, as it was printed.
    pub message: String,
}

/// The content of `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// The [`LAYOUT`] of the run.
    pub format: u32,
    /// Version of the program that began the run.
    pub program_version: String,
    /// The commit that it was built from, with `-dirty` where its sources were changed; `None` if that is not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub program_commit: Option<String>,
    /// When the run began, as `2026-03-01T09:30:00Z`.
    pub began: String,
    /// Threads that it began with.
    pub threads: usize,
    /// The machine it began on.
    pub machine: Machine,
    /// Seed of the random surface.
    pub seed: Option<u64>,
    /// See [`RunIdentity::scene_hash`].
    pub scene_hash: String,
    /// Where a sibling began.
    pub origin: Option<Origin>,
    /// The starts that continued under other circumstances, in order.
    pub continued: Vec<Continuation>,
    /// The scene as resolved.
    pub scene: Value,
    /// The text of `scene.toml`, which has the paths of the scene's files too.
    pub scene_toml: String,
    /// The text of `scene.original.toml`; `None` in a run whose scene was not written by a user.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene_written: Option<String>,
    /// Hash of `plan.json`.
    pub plan_hash: String,
    /// Hash of `schemas.json`.
    pub schemas_hash: String,
}

impl RunRecord {
    pub(super) fn new(identity: &RunIdentity, origin: Option<Origin>) -> RunRecord {
        RunRecord {
            format: LAYOUT,
            program_version: identity.program_version.clone(),
            program_commit: COMMIT.map(str::to_owned),
            began: date::now(),
            threads: identity.threads,
            machine: Machine::this(),
            seed: identity.seed,
            scene_hash: identity.scene_hash(),
            origin,
            continued: Vec::new(),
            scene: identity.scene.clone(),
            scene_toml: String::new(),
            scene_written: None,
            plan_hash: String::new(),
            schemas_hash: String::new(),
        }
    }

    /// The commit of the program of the last start that is on record.
    pub(super) fn commit(&self) -> Option<&str> {
        match self.continued.last() {
            Some(last) => last.program_commit.as_deref(),
            None => self.program_commit.as_deref(),
        }
    }

    /// Version, threads and machine of the last start that is on record.
    pub(super) fn circumstances(&self) -> (&str, usize, &Machine) {
        match self.continued.last() {
            Some(last) => (&last.program_version, last.threads, &last.machine),
            None => (&self.program_version, self.threads, &self.machine),
        }
    }
}
