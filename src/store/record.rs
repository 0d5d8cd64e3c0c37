//! `run.json`: what a run is and how it came about.

use super::date;
use super::sealed::Seal;
use crate::COMMIT;
use crate::json::{flatten, hash, matches};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Version of the layout of the run folder and of `run.json`. A run of an older version becomes one of this version
/// when it is continued.
pub(super) const RUN_FORMAT: u32 = 3;
/// Runs of this version have JSON files without a hash at their end.
const UNSEALED_FORMAT: u32 = 1;

/// Whether the JSON files of a run of this version must have a hash at their end.
pub(super) fn seal_of(format: u32) -> Seal {
    match format {
        UNSEALED_FORMAT => Seal::IfThere,
        _ => Seal::Required,
    }
}

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
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
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
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub began: Option<String>,
    /// Version of the program.
    pub program_version: String,
    /// As [`RunRecord::program_commit`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
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
    /// Version of this layout.
    pub format: u32,
    /// Version of the program that began the run.
    pub program_version: String,
    /// The commit that it was built from, with `-dirty` where its sources were changed; `None` if that is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub program_commit: Option<String>,
    /// When the run began, as `2026-03-01T09:30:00Z`; `None` in a run that was begun before there was any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub began: Option<String>,
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
    /// The iterations that were pruned, in a run that was last continued before there was a `history.parquet`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) pruned: BTreeMap<u64, Pruned>,
    /// True of a run that has JSON files without a hash at their end, since it was begun before there were any.
    #[serde(default, skip_serializing_if = "is_false")]
    unsealed: bool,
    /// The scene as resolved.
    pub scene: Value,
    /// The text of `scene.toml`, which has the paths of the scene's files too; `None` in a run that was last started before there
    /// was any.
    #[serde(default)]
    pub scene_toml: Option<String>,
    /// The text of `scene.original.toml`; `None` in a run whose scene was not written by a user, or that was last started before it was
    /// kept here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene_written: Option<String>,
    /// Hash of `plan.json`, `None` likewise.
    #[serde(default)]
    pub plan_hash: Option<String>,
    /// Hash of `schemas.json`, `None` likewise.
    #[serde(default)]
    pub schemas_hash: Option<String>,
}

fn is_false(flag: &bool) -> bool {
    !flag
}

impl RunRecord {
    pub(super) fn new(identity: &RunIdentity, origin: Option<Origin>) -> RunRecord {
        RunRecord {
            format: RUN_FORMAT,
            program_version: identity.program_version.clone(),
            program_commit: COMMIT.map(str::to_owned),
            began: Some(date::now()),
            threads: identity.threads,
            machine: Machine::this(),
            seed: identity.seed,
            scene_hash: identity.scene_hash(),
            origin,
            continued: Vec::new(),
            pruned: BTreeMap::new(),
            unsealed: false,
            scene: identity.scene.clone(),
            scene_toml: None,
            scene_written: None,
            plan_hash: None,
            schemas_hash: None,
        }
    }

    /// Whether the JSON files of the run must have a hash at their end.
    pub(super) fn seal(&self) -> Seal {
        match self.unsealed {
            true => Seal::IfThere,
            false => seal_of(self.format),
        }
    }

    /// True if what is pruned stands in a history, and not here.
    pub(super) fn has_history(&self) -> bool {
        self.format >= RUN_FORMAT
    }

    /// Makes it one of this version; what was pruned stands in the history by now.
    pub(super) fn upgrade(&mut self) {
        self.unsealed |= self.format == UNSEALED_FORMAT;
        self.format = RUN_FORMAT;
        self.pruned.clear();
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
