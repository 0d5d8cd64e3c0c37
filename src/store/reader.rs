//! A run as a reader sees it.

use super::chain::{self, Chain, CommitReport, VerifyReport};
use super::commit::Commit;
use super::draft::{KeyedEntry, read_entry};
use super::error::{Damage, DamageKind, StoreError};
use super::file_system::FileSystem;
use super::files::{Files, Layout};
use super::record::{RUN_FORMAT, RunRecord};
use crate::tables::{Table, TableName, provenance_of};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A run open for reading. Needs no lock: what is committed does not change.
pub struct RunReader {
    pub(super) files: Files,
    pub(super) layout: Layout,
    pub(super) record: RunRecord,
    pub(super) commits: BTreeMap<u64, Commit>,
    pub(super) reports: Vec<CommitReport>,
}

impl RunReader {
    /// Opens a run and verifies its iterations. Those after the first that is damaged do not count.
    ///
    /// # Errors
    /// [`StoreError::NoRun`], [`StoreError::Damaged`] for an unreadable `run.json`, [`StoreError::Format`],
    /// [`StoreError::Io`].
    pub fn open(fs: Arc<dyn FileSystem>, root: &Path) -> Result<RunReader, StoreError> {
        let files = Files(fs);
        let layout = Layout {
            root: root.to_owned(),
        };
        let (record, chain) = walk_beside_a_writer(&files, &layout)?;
        Ok(RunReader {
            files,
            layout,
            record,
            commits: chain.sound,
            reports: chain.reports,
        })
    }

    /// The folder of the run.
    pub fn path(&self) -> &Path {
        &self.layout.root
    }

    /// The content of `run.json`.
    pub fn record(&self) -> &RunRecord {
        &self.record
    }

    /// What was decided from the scene, the content of `plan.json`; `None` if it is not there or cannot be read.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn plan(&self) -> Result<Option<Value>, StoreError> {
        let path = self.layout.plan();
        if !self.files.is_there(&path)? {
            return Ok(None);
        }
        Ok(self.files.read_json(&path)?.ok())
    }

    /// The highest iteration whose whole chain verifies.
    pub fn latest(&self) -> Option<u64> {
        self.commits.keys().next_back().copied()
    }

    /// The iterations that verify, ascending; pruned ones are not among them.
    pub fn iterations(&self) -> impl Iterator<Item = u64> {
        self.commits.keys().copied()
    }

    /// The manifest of an iteration.
    ///
    /// # Errors
    /// [`StoreError::NoIteration`], with those there are.
    pub fn commit_of(&self, wear_iteration: u64) -> Result<&Commit, StoreError> {
        self.commits
            .get(&wear_iteration)
            .ok_or_else(|| StoreError::NoIteration {
                path: self.layout.root.clone(),
                wear_iteration,
                remaining: self.iterations().collect(),
            })
    }

    /// A table of an iteration, verified.
    ///
    /// # Errors
    /// [`StoreError::NoIteration`], [`StoreError::NoTable`], [`StoreError::Damaged`], [`StoreError::Table`],
    /// [`StoreError::Io`].
    pub fn read(&self, wear_iteration: u64, table: TableName) -> Result<Table, StoreError> {
        let commit = self.commit_of(wear_iteration)?;
        let folder = self.layout.iteration(wear_iteration);
        let entry = commit
            .table(table.as_str())
            .ok_or_else(|| StoreError::NoTable {
                path: folder.clone(),
                table: table.as_str().to_owned(),
                known: commit.names(),
            })?;
        read_entry(&self.files, &folder, table, entry)?.map_err(StoreError::Damaged)
    }

    /// The file of a table of an iteration, for readers of many files at once; nothing of it is verified.
    pub fn table_path(&self, wear_iteration: u64, table: TableName) -> PathBuf {
        self.layout
            .iteration(wear_iteration)
            .join(table.file_name())
    }

    /// Hash of the scene that an iteration was computed from: another than that of the run for what a sibling inherited.
    ///
    /// # Errors
    /// As for [`RunReader::read`].
    pub fn scene_hash_of(&self, wear_iteration: u64) -> Result<String, StoreError> {
        let (commit, folder) = (
            self.commit_of(wear_iteration)?,
            self.layout.iteration(wear_iteration),
        );
        let table = TableName::Summary;
        let entry = commit
            .table(table.as_str())
            .ok_or_else(|| StoreError::NoTable {
                path: folder.clone(),
                table: table.as_str().to_owned(),
                known: commit.names(),
            })?;
        let path = folder.join(&entry.file);
        let bytes = self
            .files
            .read_verified(&path, entry.bytes, &entry.blake3)?
            .map_err(StoreError::Damaged)?;
        provenance_of(&bytes, table.schema())
            .map(|provenance| provenance.scene_hash)
            .map_err(|source| StoreError::Table {
                path,
                source: Box::new(source),
            })
    }

    /// The tables that are drafted of an iteration, in no order that means anything; nothing of them is verified.
    ///
    /// # Errors
    /// [`StoreError::Io`], but for a draft that is committed meanwhile.
    pub fn drafted(&self, wear_iteration: u64) -> Result<Vec<TableName>, StoreError> {
        // A table whose key is not written yet counts for nothing.
        match self.files.list(&self.layout.draft_keys(wear_iteration)) {
            Ok(entries) => Ok(entries
                .iter()
                .filter_map(|entry| TableName::from_name(entry.name.strip_suffix(".json")?))
                .collect()),
            Err(StoreError::Io { source, .. }) if source.kind() == ErrorKind::NotFound => {
                Ok(Vec::new())
            }
            Err(error) => Err(error),
        }
    }

    /// A table of `once/`, verified, whatever it was computed from; `None` if it is not there.
    ///
    /// # Errors
    /// [`StoreError::Damaged`], [`StoreError::Table`], [`StoreError::Io`].
    pub fn read_once(&self, table: TableName) -> Result<Option<Table>, StoreError> {
        let folder = self.layout.once();
        let key_path = folder.join(format!("{table}.json"));
        if !self.files.is_there(&key_path)? {
            return Ok(None);
        }
        let keyed: KeyedEntry = self
            .files
            .read_json(&key_path)?
            .map_err(StoreError::Damaged)?;
        read_entry(&self.files, &folder, table, &keyed.entry)?
            .map(Some)
            .map_err(StoreError::Damaged)
    }

    /// What opening the run found of each iteration.
    pub fn reports(&self) -> &[CommitReport] {
        &self.reports
    }

    /// Verifies every file of the run as it is now.
    ///
    /// # Errors
    /// [`StoreError::Io`] if something that is there cannot be read.
    pub fn verify(&self) -> Result<VerifyReport, StoreError> {
        let (record, chain) = walk_beside_a_writer(&self.files, &self.layout)?;
        Ok(VerifyReport {
            commits: chain.reports,
            pruned: record.pruned.keys().copied().collect(),
            once: chain::check_once(&self.files, &self.layout)?,
        })
    }
}

/// Times that a run is looked at while its writer prunes.
const LOOKS: usize = 8;

/// Verifies the iterations. What a writer prunes meanwhile looks like damage to whoever read `run.json` before.
fn walk_beside_a_writer(files: &Files, layout: &Layout) -> Result<(RunRecord, Chain), StoreError> {
    let read = || {
        read_record(files, layout)?.ok_or_else(|| StoreError::NoRun {
            path: layout.root.clone(),
        })
    };
    let mut record = read()?;
    let mut looks = 1;
    loop {
        let chain = chain::walk(files, layout, &record)?;
        let sound = chain.reports.iter().all(|report| report.damage.is_empty());
        if sound || looks == LOOKS {
            return Ok((record, chain));
        }
        let now = read()?;
        if now.pruned == record.pruned {
            return Ok((record, chain));
        }
        record = now;
        looks += 1;
    }
}

/// The content of `run.json`, `None` if there is none.
pub(super) fn read_record(files: &Files, layout: &Layout) -> Result<Option<RunRecord>, StoreError> {
    let path = layout.record();
    if !files.is_there(&path)? {
        return Ok(None);
    }
    let damaged = |reason: String| {
        StoreError::Damaged(Damage {
            path: path.clone(),
            kind: DamageKind::Unreadable { reason },
        })
    };
    let value: Value = files.read_json(&path)?.map_err(StoreError::Damaged)?;
    // The version is looked at first: another one may lack what this one needs.
    let format = value["format"]
        .as_u64()
        .and_then(|format| u32::try_from(format).ok())
        .ok_or_else(|| damaged("no `format`".to_owned()))?;
    if format != RUN_FORMAT {
        return Err(StoreError::Format {
            path,
            found: format,
            expected: RUN_FORMAT,
        });
    }
    serde_json::from_value(value)
        .map(Some)
        .map_err(|error| damaged(error.to_string()))
}
