//! `run.json`: identity and origin of a run.

use super::date;
use crate::COMMIT;
use crate::json::{flatten, hash, matches};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Version number of the files, tables and recipes in run folders, campaign folders and caches. Every change of the
/// files, tables or recipes increases the version number. The program rejects folders with another version number.
pub const LAYOUT: u32 = 10;

/// Identity of a run, as the caller states it.
#[derive(Debug, Clone, PartialEq)]
pub struct RunIdentity {
    /// The resolved scene with all defaults, as nested JSON objects.
    pub scene: Value,
    /// The resolved scene as the text of `scene.toml`.
    pub scene_toml: String,
    /// The scene as the user wrote it, for display. `None` keeps the text that the run already has.
    pub scene_written: Option<String>,
    /// The decisions made from the scene, as in `plan.json`.
    pub plan: Value,
    /// Version of the program.
    pub program_version: String,
    /// Number of computing threads.
    pub threads: usize,
    /// Seed of the random surface, if there is one.
    pub seed: Option<u64>,
    /// Keys of the scene that cannot affect committed results. A key is a full key such as `wear.cycles`, or a section
    /// such as `output.*`. Free keys may change in an existing run and are not part of the scene hash.
    pub free_keys: Vec<String>,
    /// Keys in the form of `free_keys` whose values follow from other keys. The error for a changed scene omits the
    /// keys in `following_keys`.
    pub following_keys: Vec<String>,
    /// Keys whose values must be the same in a sibling run and in its source run, in the form of `free_keys`. A worn
    /// state is meaningless if the values of these keys change.
    pub inherited_keys: Vec<String>,
}

impl RunIdentity {
    /// Returns the hash of the scene without the free keys, so that extending a run does not change its hash.
    pub fn scene_hash(&self) -> String {
        let fixed: BTreeMap<String, Value> = flatten(&self.scene)
            .into_iter()
            .filter(|(key, _)| !matches(key, &self.free_keys))
            .collect();
        hash(&json!(fixed))
    }
}

/// Machine that computes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Operating system.
    pub os: String,
    /// Processor architecture.
    pub architecture: String,
    /// Vector instructions of the processor that affect the choice of the transforms.
    pub cpu_features: Vec<String>,
    /// Number of processors.
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

/// Origin of a sibling run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origin {
    /// Folder name of the source run.
    pub run: String,
    /// The iteration of the source run from which the sibling run continues.
    pub wear_iteration: u64,
    /// Hash of the commit of the iteration `wear_iteration` of the source run.
    pub commit: String,
}

/// Position of a pruned iteration in the chain of commits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Pruned {
    /// Hash of the commit of the pruned iteration.
    pub hash: String,
    /// Hash of the commit before the pruned iteration.
    pub parent: Option<String>,
}

/// A start under other circumstances than the previous start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Continuation {
    /// The iteration from which the start continued the run; `None` before the first iteration.
    pub wear_iteration: Option<u64>,
    /// Time of the start, in the format of [`RunRecord::began`].
    pub began: String,
    /// Version of the program.
    pub program_version: String,
    /// As [`RunRecord::program_commit`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub program_commit: Option<String>,
    /// Number of computing threads.
    pub threads: usize,
    /// The machine.
    pub machine: Machine,
    /// Free keys whose values changed, each change as a sentence.
    pub changed_keys: Vec<String>,
}

/// Content of `failure.json`: the reason why the last start failed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// Time of the failure, in the format of [`RunRecord::began`].
    pub when: String,
    /// The printed error message.
    pub message: String,
}

/// Content of `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// The [`LAYOUT`] of the run.
    pub format: u32,
    /// Version of the program that created the run.
    pub program_version: String,
    /// Commit that the program was built from, with `-dirty` if its sources were modified. `None` if unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub program_commit: Option<String>,
    /// Time of creation, as `2026-03-01T09:30:00Z`.
    pub began: String,
    /// Number of threads at creation.
    pub threads: usize,
    /// Machine at creation.
    pub machine: Machine,
    /// Seed of the random surface.
    pub seed: Option<u64>,
    /// See [`RunIdentity::scene_hash`].
    pub scene_hash: String,
    /// Origin of a sibling.
    pub origin: Option<Origin>,
    /// The starts under other circumstances, in order.
    pub continued: Vec<Continuation>,
    /// The resolved scene.
    pub scene: Value,
    /// Text of `scene.toml`, which includes the paths of the scene's files.
    pub scene_toml: String,
    /// Text of `scene.original.toml`. `None` if the scene was not written by a user.
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

    /// Commit of the program at the last recorded start.
    pub(super) fn commit(&self) -> Option<&str> {
        match self.continued.last() {
            Some(last) => last.program_commit.as_deref(),
            None => self.program_commit.as_deref(),
        }
    }

    /// Version, threads and machine at the last recorded start.
    pub(super) fn circumstances(&self) -> (&str, usize, &Machine) {
        match self.continued.last() {
            Some(last) => (&last.program_version, last.threads, &last.machine),
            None => (&self.program_version, self.threads, &self.machine),
        }
    }
}
