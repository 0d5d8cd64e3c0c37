//! A run open for writing.

use super::chain::VerifyReport;
use super::commit::Commit;
use super::date;
use super::draft::{
    Draft, DraftEntry, KeyedEntry, Recompute, check_cells, clean_staging, encode, read_keyed,
};
use super::error::StoreError;
use super::file_system::{FileSystem, LockGuard};
use super::files::Files;
use super::history;
use super::key::StageKey;
use super::layout::{COMMIT_FILE, Layout};
use super::open::{self, Locked, Opening};
use super::reader::RunReader;
use super::record::{Failure, RunIdentity};
use super::record_file::FoundRecord;
use super::sealed::sealed;
use crate::tables::{Provenance, Table, TableName, TypedTable};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

/// A run and the right to write to it.
///
/// What is committed stays: a process that ends at any instant leaves a run that opens at the last commit, and the tables of
/// the iteration in progress are used again where their inputs are the same.
pub struct RunStore {
    reader: RunReader,
    provenance: Provenance,
    _guard: Box<dyn LockGuard>,
}

/// Which iterations to keep. The unworn one and the latest stay in any case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Keep {
    /// Every iteration whose number is a multiple of this; `None` keeps none for its number.
    pub every: Option<u64>,
    /// That many of the last ones.
    pub last: u64,
    /// These besides, such as those with a model update.
    pub also: BTreeSet<u64>,
}

impl RunStore {
    /// Creates a run, completes its creation, or continues it.
    ///
    /// # Errors
    /// [`StoreError::Locked`] if another process writes it; [`StoreError::SceneChanged`] if the scene differs in keys that are not
    /// free; [`StoreError::NotARun`] for a folder of something else; [`StoreError::UnfinishedSibling`] for one that
    /// [`RunStore::create_sibling`] has to complete; [`StoreError::Damaged`] and [`StoreError::OtherLayout`] for a `run.json` that
    /// is lost, unreadable or of another layout; [`StoreError::Io`]. Damaged iterations are no error: see [`Opening`].
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
        RunStore::over(locked, identity)
    }

    /// Opens a run for reading, without the lock. Errors as for [`RunReader::open`].
    pub fn open_readonly(fs: Arc<dyn FileSystem>, root: &Path) -> Result<RunReader, StoreError> {
        RunReader::open(fs, root)
    }

    pub(super) fn over(
        locked: Locked,
        identity: &RunIdentity,
    ) -> Result<(RunStore, Opening), StoreError> {
        let Locked {
            files,
            layout,
            guard,
            record,
            ..
        } = locked;
        let created = record.is_none();
        let record = match record {
            Some(record) => record,
            None => FoundRecord {
                record: open::create(&files, &layout, identity, None)?,
                damage: None,
            },
        };
        let (reader, mut opening) = open::resume(files, layout, record, identity)?;
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

    /// The run as a reader sees it.
    pub fn reader(&self) -> &RunReader {
        &self.reader
    }

    /// Keeps why this start failed, until the run goes on. A disk that is full has no place for it, which is no other failure.
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

    /// The iteration that comes next.
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

    /// Where the tables of this run come from.
    pub fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// A table that is computed once a run, if it was computed under this key and verifies; otherwise why not.
    ///
    /// # Errors
    /// [`StoreError::Io`] if it is there and cannot be read, [`StoreError::Table`] if it holds another table.
    pub fn once(&self, table: TableName, key: &StageKey) -> Result<DraftEntry, StoreError> {
        let folder = self.layout().once();
        let key_path = folder.join(format!("{table}.json"));
        let kept = read_keyed(self.files(), &folder, &key_path, table, key)?.0;
        if let DraftEntry::Valid(values) = &kept
            && let Err(damage) = check_cells(self.reader.cells(), &key_path, values)
        {
            return Ok(DraftEntry::Stale(Recompute::Damaged(damage)));
        }
        Ok(kept)
    }

    /// Writes a table that is computed once a run, in place of one that is there.
    ///
    /// # Errors
    /// Those of [`Draft::put`].
    pub fn put_once(
        &mut self,
        table: TableName,
        key: &StageKey,
        values: &Table,
    ) -> Result<(), StoreError> {
        let (files, folder) = (self.files(), self.layout().once());
        let staged = self.layout().staged_once();
        let (file, key_file) = (table.file_name(), format!("{table}.json"));
        let (bytes, entry) = encode(&folder.join(&file), table, key, values, &self.provenance)?;
        files.require_space(&folder, entry.bytes)?;
        files.remove_dir_if_there(&staged)?;
        files.make_dir_unsynced(&staged)?;
        files.write_new(&staged.join(&file), &bytes)?;
        let key_path = staged.join(&key_file);
        let key = key.clone();
        let keyed = sealed(&key_path, &KeyedEntry { key, entry })?;
        files.write_new(&key_path, &keyed)?;
        // Between the two the hash in the old key file refuses the new table.
        files.rename(&staged.join(&file), &folder.join(&file))?;
        files.rename(&key_path, &folder.join(&key_file))?;
        files.sync_dir(&folder)
    }

    /// Begins the next iteration, or takes up what an earlier start left of it.
    ///
    /// # Errors
    /// [`StoreError::OutOfOrder`] for another iteration than the next, [`StoreError::Io`].
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

    /// Makes a draft the next iteration of the run: `commit.json` last, then one rename. Its row in the history comes after that.
    ///
    /// # Errors
    /// [`StoreError::OutOfOrder`] unless it follows the latest, [`StoreError::ColumnsChanged`] if a table has other columns than
    /// before, [`StoreError::NoSpace`], [`StoreError::Io`]. After an I/O error the run is to be opened anew.
    pub fn commit(&mut self, draft: Draft) -> Result<&Commit, StoreError> {
        let wear_iteration = draft.wear_iteration();
        self.require_next(wear_iteration)?;
        let entries = draft.into_entries();
        let parent = self.reader.commits.values().next_back();
        let (mut tables, mut unchained) = (BTreeMap::new(), BTreeMap::new());
        for (table, entry) in entries {
            let place = if table.schema().chained {
                &mut tables
            } else {
                &mut unchained
            };
            place.insert(table.as_str().to_owned(), entry);
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
        // An earlier start may have left tables that this one did not take up.
        for entry in files.list(&draft)? {
            let taken = commit
                .tables
                .values()
                .chain(commit.unchained.values())
                .any(|table| table.file == entry.name);
            if !taken {
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

    /// True if the history has been written after the last commit. It is a time to prune: that writes the history too, which in a
    /// long run takes as long as several iterations.
    pub fn is_history_due(&self) -> bool {
        self.reader.history.is_due()
    }

    /// Brings the file of the history up to the last commit.
    ///
    /// # Errors
    /// [`StoreError::NoSpace`], [`StoreError::Io`].
    pub fn write_history(&self) -> Result<(), StoreError> {
        match self.reader.history.is_due() {
            true => Ok(()),
            false => history::write(self.files(), self.layout(), &self.reader.history),
        }
    }

    /// Removes the iterations that the policy does not keep, and returns them. Their rows stay in the history with their hashes, so
    /// that the chain over them remains verifiable.
    ///
    /// # Errors
    /// [`StoreError::Io`]; what was begun is completed when the run is next opened.
    pub fn prune(&mut self, keep: &Keep) -> Result<Vec<u64>, StoreError> {
        let Some(latest) = self.latest() else {
            return Ok(Vec::new());
        };
        let kept = |k: u64| {
            k == 0
                || k == latest
                || k + keep.last > latest
                || keep.every.is_some_and(|every| k.is_multiple_of(every))
                || keep.also.contains(&k)
        };
        let gone: Vec<u64> = self.reader.iterations().filter(|&k| !kept(k)).collect();
        if gone.is_empty() {
            return Ok(gone);
        }
        let mut without = self.reader.history.clone();
        without.prune(&gone);
        history::write(self.files(), self.layout(), &without)?;
        self.reader.history = without;
        for wear_iteration in &gone {
            self.reader.commits.remove(wear_iteration);
        }
        open::discard(self.files(), self.layout(), gone.iter().copied())?;
        Ok(gone)
    }

    /// Removes what is staged, also of a next iteration: nobody will commit it.
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

    /// A run has the same columns in all its iterations; a sibling may differ from what it began with.
    fn require_same_columns(&self, parent: &Commit, commit: &Commit) -> Result<(), StoreError> {
        let inherited = self.reader.record.origin.as_ref();
        if inherited.is_some_and(|origin| parent.wear_iteration <= origin.wear_iteration) {
            return Ok(());
        }
        for (name, entry) in commit.tables.iter().chain(&commit.unchained) {
            if let Some(before) = parent.table(name)
                && before.columns != entry.columns
            {
                return Err(StoreError::ColumnsChanged {
                    table: name.clone(),
                    wear_iteration: commit.wear_iteration,
                    found: entry.columns.clone(),
                    expected: before.columns.clone(),
                });
            }
        }
        Ok(())
    }
}
