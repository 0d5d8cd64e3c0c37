//! Reading of a run.

use super::chain::{self, CommitReport, OnceReport, VerifyReport};
use super::commit::Commit;
use super::draft::{Cells, KeyedEntry, check_cells, read_entry};
use super::error::{Damage, DamageKind, StoreError};
use super::file_system::{FileSystem, LockHolder, RealFileSystem};
use super::files::Files;
use super::history::{History, is_in_history};
use super::inspection::{RunSnapshot, verify_consistently};
use super::layout::Layout;
use super::record::{Failure, RunRecord};
use super::record_file::{check_metadata, check_text, read_plan};
use super::sealed::read_sealed;
use super::survey::check_folder;
use crate::json::{as_read, differences, matches};
use crate::tables::{Table, TableName, TypedTable, provenance_of, typed};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::Path;
use std::sync::Arc;

/// A run open for reading. A reader needs no lock, because committed data never changes.
pub struct RunReader {
    pub(super) files: Files,
    pub(super) layout: Layout,
    pub(super) record: RunRecord,
    pub(super) commits: BTreeMap<u64, Commit>,
    pub(super) reports: Vec<CommitReport>,
    /// The rows of the history file that agree with the commits.
    pub(super) history: History,
}

impl RunReader {
    /// Opens a run and verifies the iterations of the run. The reader ignores all iterations after the first damaged
    /// iteration.
    ///
    /// # Errors
    /// [`StoreError::NoRun`], [`StoreError::UnexpectedEntryKind`] for a folder with links in it, [`StoreError::Damaged`] if
    /// neither `run.json` nor its copy is readable, [`StoreError::OtherLayout`], [`StoreError::Io`].
    pub fn open(fs: Arc<dyn FileSystem>, root: &Path) -> Result<RunReader, StoreError> {
        let files = Files(fs);
        let layout = Layout::at(root);
        check_folder(&files, &layout).map_err(|error| match error {
            StoreError::Io { source, .. } if source.kind() == ErrorKind::NotADirectory => {
                StoreError::FileInsteadOfFolder {
                    path: root.to_owned(),
                }
            }
            error => error,
        })?;
        let RunSnapshot {
            record,
            past,
            chain,
        } = verify_consistently(&files, &layout)?;
        Ok(RunReader {
            files,
            layout,
            history: past.matching_rows(&chain),
            record,
            commits: chain.sound,
            reports: chain.reports,
        })
    }

    /// Returns the history of all iterations up to the latest, one row each, pruned iterations included.
    ///
    /// # Errors
    /// Errors of reading commits that are not in the history file yet.
    pub fn history(&self) -> Result<History, StoreError> {
        self.completed(self.history.clone())
    }

    /// Completes a history by the rows of later commits.
    pub(super) fn completed(&self, mut history: History) -> Result<History, StoreError> {
        let Some(latest) = self.latest() else {
            return Ok(History::default());
        };
        for wear_iteration in history.len() as u64..=latest {
            let Some(commit) = self.commits.get(&wear_iteration) else {
                // The iteration is pruned, and the row of the iteration was lost with the file `history.parquet`.
                let next = self.commits.get(&(wear_iteration + 1));
                let hash = next.and_then(|next| next.parent.as_deref());
                history.push_pruned(hash.unwrap_or_default());
                continue;
            };
            let mut tables = Vec::new();
            for name in commit
                .tables
                .keys()
                .filter_map(|name| TableName::from_name(name))
            {
                if is_in_history(name) {
                    tables.push((name, self.read(wear_iteration, name)?));
                }
            }
            history.push(commit, &tables);
            match self.typed::<typed::Timing>(wear_iteration) {
                Ok(timing) => history.push_timing(&timing),
                // No result depends on the timing.
                Err(StoreError::Damaged(_) | StoreError::NoTable { .. }) => (),
                Err(error) => return Err(error),
            }
        }
        Ok(history)
    }

    /// The folder of the run.
    pub fn path(&self) -> &Path {
        &self.layout.root
    }

    /// The content of `run.json`.
    pub fn record(&self) -> &RunRecord {
        &self.record
    }

    /// Returns the decisions made from the scene: `read` parses the content of `plan.json`, or says why it is not a
    /// plan.
    ///
    /// # Errors
    /// [`StoreError::Plan`], [`StoreError::Io`].
    pub fn plan<P>(&self, read: impl FnOnce(&Value) -> Result<P, String>) -> Result<P, StoreError> {
        read_plan(&self.files, &self.layout, &self.record, read)
    }

    /// Returns the damage of `scene.original.toml`, which contains the scene as the user wrote the scene. Returns
    /// `None` if the file is sound or if the run has no written scene.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn written_scene_damage(&self) -> Result<Option<Damage>, StoreError> {
        match &self.record.scene_written {
            Some(text) => check_text(&self.files, self.layout.written_scene(), text),
            None => Ok(None),
        }
    }

    /// Returns the reason why the last start failed. Returns `None` if the last start did not fail, if the run is
    /// continuing, or if `failure.json` is damaged.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn failure(&self) -> Result<Option<Failure>, StoreError> {
        let failure = read_sealed(&self.files, &self.layout.failure())?;
        Ok(failure.ok())
    }

    /// Returns the process that is writing the run, or `None` if no process is writing the run.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn holder(&self) -> Result<Option<LockHolder>, StoreError> {
        let path = self.layout.lock();
        RealFileSystem
            .lock_holder(&path)
            .map_err(|source| StoreError::Io {
                action: "look at",
                path,
                source,
            })
    }

    /// The highest iteration whose whole chain verifies.
    pub fn latest(&self) -> Option<u64> {
        self.commits.keys().next_back().copied()
    }

    /// The iterations that verify, ascending, without pruned ones.
    pub fn iterations(&self) -> impl Iterator<Item = u64> {
        self.commits.keys().copied()
    }

    /// Returns the manifest of an iteration.
    ///
    /// # Errors
    /// [`StoreError::NoIteration`] with the existing iterations.
    pub fn commit_of(&self, wear_iteration: u64) -> Result<&Commit, StoreError> {
        self.commits
            .get(&wear_iteration)
            .ok_or_else(|| StoreError::NoIteration {
                path: self.layout.root.clone(),
                wear_iteration,
                remaining: self.iterations().collect(),
            })
    }

    /// Reads and verifies a table of an iteration.
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
        let values =
            read_entry(&self.files, &folder, table, entry)?.map_err(StoreError::Damaged)?;
        let path = folder.join(table.file_name());
        check_cells(self.cells(), &path, &values).map_err(StoreError::Damaged)?;
        Ok(values)
    }

    /// Number of cells of the joint, from the scene of the run.
    pub(super) fn cells(&self) -> Cells {
        let grid = self.record.scene.pointer("/joint/grid")?;
        Some([grid.get(0)?.as_i64()?, grid.get(1)?.as_i64()?])
    }

    /// Reads a table of an iteration as its type. Errors as for [`RunReader::read`].
    pub fn typed<T: TypedTable>(&self, wear_iteration: u64) -> Result<T, StoreError> {
        let table = self.read(wear_iteration, T::TABLE)?;
        T::of(&table).map_err(|source| StoreError::Table {
            path: self.layout.iteration(wear_iteration),
            source: Box::new(source),
        })
    }

    /// Returns the hash of the scene that an iteration was computed from. For an inherited iteration, the returned hash
    /// can differ from the hash of the scene of the sibling run.
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
        let path = folder.join(table.file_name());
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

    /// Rejects a scene that differs from the scene of the run in other keys than `free`.
    ///
    /// # Errors
    /// [`StoreError::SceneChanged`] with the keys that differ.
    pub fn require_scene(&self, scene: &Value, free: &[&str]) -> Result<(), StoreError> {
        let free: Vec<String> = free.iter().map(|key| (*key).to_owned()).collect();
        let mut keys = differences(&self.record.scene, &as_read(scene));
        keys.retain(|change| !matches(&change.key, &free));
        match keys.is_empty() {
            true => Ok(()),
            false => Err(StoreError::SceneChanged {
                path: self.path().to_owned(),
                keys,
                edited: false,
            }),
        }
    }

    /// Lists the names of the complete stages in the draft of an iteration, in arbitrary order and unverified.
    ///
    /// # Errors
    /// [`StoreError::Io`]. A draft that is committed meanwhile is not an error.
    pub fn drafted_stages(&self, wear_iteration: u64) -> Result<Vec<String>, StoreError> {
        match self.files.list(&self.layout.draft_keys(wear_iteration)) {
            Ok(entries) => Ok(entries
                .iter()
                .filter_map(|entry| entry.name.strip_suffix(".json"))
                .map(str::to_owned)
                .collect()),
            Err(StoreError::Io { source, .. }) if source.kind() == ErrorKind::NotFound => {
                Ok(Vec::new())
            }
            Err(error) => Err(error),
        }
    }

    /// Reads and verifies a table of `once/`, without a check of the stage key. Returns `None` if the table does not
    /// exist.
    ///
    /// # Errors
    /// [`StoreError::Damaged`], [`StoreError::Table`], [`StoreError::Io`].
    pub fn read_once(&self, table: TableName) -> Result<Option<Table>, StoreError> {
        let folder = self.layout.once();
        let key_path = folder.join(format!("{table}.json"));
        if !self.has_once(table)? {
            return Ok(None);
        }
        let keyed: KeyedEntry =
            read_sealed(&self.files, &key_path)?.map_err(StoreError::Damaged)?;
        let values =
            read_entry(&self.files, &folder, table, &keyed.entry)?.map_err(StoreError::Damaged)?;
        let path = folder.join(table.file_name());
        check_cells(self.cells(), &path, &values).map_err(StoreError::Damaged)?;
        Ok(Some(values))
    }

    /// True if a table of `once/` exists, sound or not.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn has_once(&self, table: TableName) -> Result<bool, StoreError> {
        let path = self.layout.once().join(format!("{table}.json"));
        self.files.is_there(&path)
    }

    /// True if every table of `once/` verifies.
    ///
    /// # Errors
    /// [`StoreError::Io`] if an existing table cannot be read.
    pub fn is_once_sound(&self) -> Result<bool, StoreError> {
        let reports = chain::check_once(&self.files, &self.layout)?;
        Ok(reports.iter().all(|report| report.damage.is_none()))
    }

    /// Verifies every table of `once/`, and checks that it can be decoded.
    ///
    /// # Errors
    /// [`StoreError::Io`] if an existing table cannot be read.
    pub fn verify_once(&self) -> Result<Vec<OnceReport>, StoreError> {
        let mut reports = chain::check_once(&self.files, &self.layout)?;
        for report in reports.iter_mut().filter(|report| report.damage.is_none()) {
            report.damage = match self.read_once(report.table) {
                Ok(_) => None,
                Err(StoreError::Damaged(damage)) => Some(damage),
                Err(StoreError::Table { path, source }) => Some(Damage {
                    path,
                    kind: DamageKind::Unreadable {
                        reason: source.to_string(),
                    },
                }),
                Err(error) => return Err(error),
            };
        }
        Ok(reports)
    }

    /// The reports from opening the run, one per iteration.
    pub fn reports(&self) -> &[CommitReport] {
        &self.reports
    }

    /// Verifies every file of the run in its present state.
    ///
    /// # Errors
    /// [`StoreError::Io`] if an existing file cannot be read.
    pub fn verify(&self) -> Result<VerifyReport, StoreError> {
        let RunSnapshot {
            record,
            past,
            chain,
        } = verify_consistently(&self.files, &self.layout)?;
        let mut metadata = check_metadata(&self.files, &self.layout, &record)?;
        metadata.extend(past.damage(&self.layout, &chain));
        Ok(VerifyReport {
            metadata,
            once: self.verify_once()?,
            commits: chain.reports,
            pruned: past.past.pruned.keys().copied().collect(),
        })
    }
}
