//! Writing of a run.

use super::chain::VerifyReport;
use super::commit::Commit;
use super::date;
use super::draft::{
    Draft, KeyedEntry, Recompute, StoredResult, check_cells, clean_staging, encode, read_keyed,
};
use super::error::StoreError;
use super::file_system::{FileSystem, LockGuard};
use super::files::Files;
use super::history;
use super::key::StageKey;
use super::layout::{COMMIT_FILE, Layout};
use super::open::{self, LockedRun, Opening};
use super::reader::RunReader;
use super::record::{Failure, RunIdentity};
use super::record_file::RecordRead;
use super::sealed::sealed;
use crate::tables::{Provenance, Table, TableName, TypedTable};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

/// A run open for writing.
///
/// Committed data stays. If the process ends at any instant, the run reopens at the last commit. Tables of the
/// iteration in progress are reused if their inputs are the same.
pub struct RunStore {
    reader: RunReader,
    provenance: Provenance,
    _guard: Box<dyn LockGuard>,
}

/// Policy of pruning. The unworn iteration and the latest one are always kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Keep {
    /// Pruning keeps every iteration whose number is a multiple of `every`. `None` disables the rule.
    pub every: Option<u64>,
    /// Pruning keeps the last `last` iterations.
    pub last: u64,
    /// Pruning keeps the iterations in `also`, such as iterations with a model update.
    pub also: BTreeSet<u64>,
}

impl RunStore {
    /// Creates a run, completes an interrupted creation of a run, or continues an existing run.
    ///
    /// # Errors
    /// - [`StoreError::Locked`] if another process writes the run;
    /// - [`StoreError::SceneChanged`] if the scene differs from the scene of the run in keys that are not free;
    /// - [`StoreError::NotARun`] if the folder contains other files;
    /// - [`StoreError::UnfinishedSibling`] if [`RunStore::create_sibling`] has to complete the run;
    /// - [`StoreError::Damaged`] if `run.json` is missing or unreadable;
    /// - [`StoreError::OtherLayout`] if `run.json` has another layout;
    /// - [`StoreError::Io`].
    ///
    /// A damaged iteration is not an error: see [`Opening`].
    pub fn create_or_open(
        fs: Arc<dyn FileSystem>,
        root: &Path,
        identity: &RunIdentity,
    ) -> Result<(RunStore, Opening), StoreError> {
        let locked = open::lock(fs, root)?;
        if let Some(origin) = &locked.unfinished {
            return Err(StoreError::UnfinishedSibling {
                path: root.to_owned(),
                source_run: origin.run.clone(),
                wear_iteration: origin.wear_iteration,
            });
        }
        RunStore::from_locked(locked, identity)
    }

    /// Opens a run for reading, without the lock. Errors as for [`RunReader::open`].
    pub fn open_readonly(fs: Arc<dyn FileSystem>, root: &Path) -> Result<RunReader, StoreError> {
        RunReader::open(fs, root)
    }

    pub(super) fn from_locked(
        locked: LockedRun,
        identity: &RunIdentity,
    ) -> Result<(RunStore, Opening), StoreError> {
        let LockedRun {
            files,
            layout,
            guard,
            record,
            ..
        } = locked;
        let created = record.is_none();
        let record = match record {
            Some(record) => record,
            None => RecordRead {
                record: open::create(&files, &layout, identity, None)?,
                damage: None,
            },
        };
        let (reader, mut opening) = open::check_and_repair(files, layout, record, identity)?;
        opening.created = created;
        let provenance = Provenance {
            scene_hash: identity.scene_hash(),
            program_version: identity.program_version.clone(),
        };
        Ok((
            RunStore {
                reader,
                provenance,
                _guard: guard,
            },
            opening,
        ))
    }

    /// The reader of the run.
    pub fn reader(&self) -> &RunReader {
        &self.reader
    }

    /// Stores the reason why the current start failed. The next start removes the stored reason. The function ignores
    /// an error of storing the reason, for example on a full disk.
    pub fn note_failure(&self, message: &str) {
        let path = self.layout().failure();
        let failure = Failure {
            when: date::now(),
            message: message.to_owned(),
        };
        let bytes = sealed(&path, &failure);
        let _ = bytes.and_then(|bytes| self.files().replace(&path, &bytes));
    }

    /// See [`RunReader::latest`].
    pub fn latest(&self) -> Option<u64> {
        self.reader.latest()
    }

    /// The number of the next iteration.
    pub fn next(&self) -> u64 {
        self.latest().map_or(0, |latest| latest + 1)
    }

    /// See [`RunReader::read`].
    pub fn read(&self, wear_iteration: u64, table: TableName) -> Result<Table, StoreError> {
        self.reader.read(wear_iteration, table)
    }

    /// See [`RunReader::typed`].
    pub fn typed<T: TypedTable>(&self, wear_iteration: u64) -> Result<T, StoreError> {
        self.reader.typed(wear_iteration)
    }

    /// See [`RunReader::verify`].
    pub fn verify(&self) -> Result<VerifyReport, StoreError> {
        self.reader.verify()
    }

    /// Provenance of the tables that the run writes: scene hash and program version.
    pub fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// Reads a table that is computed once per run. The stored table must have the key `key`, and its hash must be
    /// correct. Otherwise the function returns the reason why the stored table is unusable.
    ///
    /// # Errors
    /// Returns [`StoreError::Io`] if the stored table cannot be read, and [`StoreError::Table`] if the file contains
    /// another table.
    pub fn once(&self, table: TableName, key: &StageKey) -> Result<StoredResult, StoreError> {
        let folder = self.layout().once();
        let key_path = folder.join(format!("{table}.json"));
        let stored = read_keyed(self.files(), &folder, &key_path, table, key)?.0;
        if let StoredResult::Valid(values) = &stored
            && let Err(damage) = check_cells(self.reader.cells(), &key_path, values)
        {
            return Ok(StoredResult::Stale(Recompute::Damaged(damage)));
        }
        Ok(stored)
    }

    /// Writes a table that is computed once per run, and replaces an existing one.
    ///
    /// # Errors
    /// Errors of [`Draft::put`].
    pub fn put_once(
        &mut self,
        table: TableName,
        key: &StageKey,
        values: &Table,
    ) -> Result<(), StoreError> {
        let (files, folder) = (self.files(), self.layout().once());
        let staging = self.layout().staged_once();
        let (file, key_file) = (table.file_name(), format!("{table}.json"));
        let (bytes, entry) = encode(&folder.join(&file), table, key, values, &self.provenance)?;
        files.require_space(&folder, entry.bytes)?;
        files.remove_dir_if_there(&staging)?;
        files.make_dir_unsynced(&staging)?;
        files.write_new(&staging.join(&file), &bytes)?;
        let key_path = staging.join(&key_file);
        let key = key.clone();
        let keyed = sealed(&key_path, &KeyedEntry { key, entry })?;
        files.write_new(&key_path, &keyed)?;
        // Between the two renames the hash in the old key file rejects the new table.
        files.rename(&staging.join(&file), &folder.join(&file))?;
        files.rename(&key_path, &folder.join(&key_file))?;
        files.sync_dir(&folder)
    }

    /// Begins the next iteration, or continues the draft of an earlier start.
    ///
    /// # Errors
    /// [`StoreError::OutOfOrder`] for another iteration than the next one, [`StoreError::Io`].
    pub fn draft(&self, wear_iteration: u64) -> Result<Draft, StoreError> {
        self.require_next(wear_iteration)?;
        clean_staging(self.files(), self.layout(), wear_iteration)?;
        Draft::begin(
            self.files(),
            self.layout(),
            &self.provenance,
            wear_iteration,
            self.reader.cells(),
        )
    }

    /// Commits a draft as the next iteration of the run. `commit` writes `commit.json` as the last file, renames the
    /// folder, and then appends a row to the history.
    ///
    /// # Errors
    /// [`StoreError::OutOfOrder`] unless the draft follows the latest iteration. [`StoreError::ColumnsChanged`] if the
    /// columns of a table change. [`StoreError::NoSpace`] if the disk is full, and [`StoreError::Io`] for other I/O
    /// errors. After an I/O error the run must be opened again.
    pub fn commit(&mut self, draft: Draft) -> Result<&Commit, StoreError> {
        let wear_iteration = draft.wear_iteration();
        self.require_next(wear_iteration)?;
        let entries = draft.into_entries();
        let parent = self.reader.commits.values().next_back();
        let (mut tables, mut unchained) = (BTreeMap::new(), BTreeMap::new());
        for (table, entry) in entries {
            let entries_by_name = if table.schema().chained {
                &mut tables
            } else {
                &mut unchained
            };
            entries_by_name.insert(table.as_str().to_owned(), entry);
        }
        let commit = Commit::new(
            wear_iteration,
            parent.map(|parent| parent.hash.clone()),
            tables,
            unchained,
        );
        if let Some(parent) = parent {
            self.require_same_columns(parent, &commit)?;
        }

        let (files, layout) = (self.files(), self.layout());
        let draft = layout.draft(wear_iteration);
        // An earlier start may have written tables to the draft. Remove the tables of the draft that the commit does
        // not contain.
        for entry in files.list(&draft)? {
            let is_committed = commit
                .tables
                .values()
                .chain(commit.unchained.values())
                .any(|table| table.file == entry.name);
            if !is_committed {
                files.remove_file_if_there(&draft.join(&entry.name))?;
            }
        }
        for table in commit.tables.values().chain(commit.unchained.values()) {
            files.sync_file(&draft.join(&table.file))?;
        }
        let manifest = draft.join(COMMIT_FILE);
        let bytes = sealed(&manifest, &commit)?;
        files.require_space(&draft, bytes.len() as u64)?;
        files.write_new(&manifest, &bytes)?;
        files.sync_dir(&draft)?;
        files.rename(&draft, &layout.iteration(wear_iteration))?;
        files.sync_dir(&layout.iterations())?;
        files.remove_dir_if_there(&layout.draft_keys(wear_iteration))?;
        self.reader.commits.insert(wear_iteration, commit);
        let history = std::mem::take(&mut self.reader.history);
        self.reader.history = self.reader.completed(history)?;
        if self.reader.history.is_due() {
            history::write(self.files(), self.layout(), &self.reader.history)?;
        }
        self.reader.commit_of(wear_iteration)
    }

    /// True if the run has to write the history after the last commit. The run should prune after the same commit,
    /// because pruning writes the history. In a long run, writing the history takes as long as several iterations.
    pub fn is_history_due(&self) -> bool {
        self.reader.history.is_due()
    }

    /// Writes the history file up to the last commit.
    ///
    /// # Errors
    /// [`StoreError::NoSpace`], [`StoreError::Io`].
    pub fn write_history(&self) -> Result<(), StoreError> {
        match self.reader.history.is_due() {
            true => Ok(()),
            false => history::write(self.files(), self.layout(), &self.reader.history),
        }
    }

    /// Removes the iterations that the policy does not keep, and returns them. The rows and hashes of the removed
    /// iterations stay in the history, so that the chain remains verifiable.
    ///
    /// # Errors
    /// [`StoreError::Io`]. The next start completes an interrupted pruning.
    pub fn prune(&mut self, keep: &Keep) -> Result<Vec<u64>, StoreError> {
        let Some(latest) = self.latest() else {
            return Ok(Vec::new());
        };
        let is_kept = |k: u64| {
            k == 0
                || k == latest
                || k + keep.last > latest
                || keep.every.is_some_and(|every| k.is_multiple_of(every))
                || keep.also.contains(&k)
        };
        let pruned: Vec<u64> = self.reader.iterations().filter(|&k| !is_kept(k)).collect();
        if pruned.is_empty() {
            return Ok(pruned);
        }
        let mut pruned_history = self.reader.history.clone();
        pruned_history.prune(&pruned);
        history::write(self.files(), self.layout(), &pruned_history)?;
        self.reader.history = pruned_history;
        for wear_iteration in &pruned {
            self.reader.commits.remove(wear_iteration);
        }
        open::discard(self.files(), self.layout(), pruned.iter().copied())?;
        Ok(pruned)
    }

    /// Removes all files in `staging/`, including the draft of the next iteration. Call `clear_staging` only if no
    /// commit will follow.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn clear_staging(&self) -> Result<(), StoreError> {
        let (files, layout) = (self.files(), self.layout());
        let next = self.next();
        for folder in [
            layout.draft(next),
            layout.draft_keys(next),
            layout.staged_once(),
        ] {
            files.remove_dir_if_there(&folder)?;
        }
        Ok(())
    }

    fn files(&self) -> &Files {
        &self.reader.files
    }

    fn layout(&self) -> &Layout {
        &self.reader.layout
    }

    fn require_next(&self, wear_iteration: u64) -> Result<(), StoreError> {
        if wear_iteration == self.next() {
            return Ok(());
        }
        Err(StoreError::OutOfOrder {
            path: self.reader.path().to_owned(),
            wear_iteration,
            next: self.next(),
        })
    }

    /// Checks that the columns of all tables are the same as in the parent. A sibling may differ from the iterations
    /// that it inherited.
    fn require_same_columns(&self, parent: &Commit, commit: &Commit) -> Result<(), StoreError> {
        let sibling_origin = self.reader.record.origin.as_ref();
        if sibling_origin.is_some_and(|origin| parent.wear_iteration <= origin.wear_iteration) {
            return Ok(());
        }
        for (name, entry) in commit.tables.iter().chain(&commit.unchained) {
            if let Some(parent_entry) = parent.table(name)
                && parent_entry.columns != entry.columns
            {
                return Err(StoreError::ColumnsChanged {
                    table: name.clone(),
                    wear_iteration: commit.wear_iteration,
                    found: entry.columns.clone(),
                    expected: parent_entry.columns.clone(),
                });
            }
        }
        Ok(())
    }
}
