//! Draft: the iteration in progress.

use super::commit::TableEntry;
use super::error::{Damage, DamageKind, StoreError};
use super::file_system::EntryKind;
use super::files::{Files, hash};
use super::key::StageKey;
use super::layout::Layout;
use super::parts;
use super::sealed::{read_sealed, sealed};
use crate::tables::{Provenance, Table, TableError, TableName, Tables, from_parquet, to_parquet};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Lookup of a stored result: a table, or all tables of a stage.
#[derive(Debug, Clone, PartialEq)]
pub enum StoredResult<T = Table> {
    /// The result has the same inputs and verifies.
    Valid(T),
    /// The result has to be computed, with the reason.
    Stale(Recompute),
}

/// Reason to compute a result.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Recompute {
    /// No result is stored.
    #[error("not computed yet")]
    Missing,
    /// The stored result has other inputs.
    #[error("computed from other inputs: {changes}")]
    KeyChanged {
        /// The inputs that differ.
        changes: String,
    },
    /// The stored result does not verify.
    #[error("damaged: {0}")]
    Damaged(Damage),
}

/// Key and entry of a table that belongs to no commit. A small JSON file next to the table contains the key and the
/// entry.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct KeyedEntry {
    pub key: StageKey,
    pub entry: TableEntry,
}

/// Key of a completed stage and the entries of its tables by name. A small JSON file next to the draft contains the key
/// and the entries.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct StageEntry {
    key: StageKey,
    tables: BTreeMap<String, TableEntry>,
}

impl StageEntry {
    /// Returns each table with the entry of the table. Rejects an entry if the file name in the entry is not the file
    /// name that the stage uses for the table.
    fn entries(&self) -> Result<Vec<(TableName, &TableEntry)>, String> {
        let tables = self.tables.iter().map(|(name, entry)| {
            let table =
                TableName::from_name(name).ok_or(format!("`{name}` is not the name of a table"))?;
            match entry.file == interim_file(table, self.key.stage()) {
                true => Ok((table, entry)),
                false => entry.check_name(table).map(|()| (table, entry)),
            }
        });
        if self
            .tables
            .values()
            .any(|entry| entry.stage_key != self.key.hash())
        {
            return Err("a table has another stage key than its stage".to_owned());
        }
        tables.collect()
    }
}

/// Returns the file name of an interim table: a later stage of the same iteration writes the table again. The commit
/// discards the interim file.
fn interim_file(table: TableName, stage: &str) -> String {
    format!("{stage}.{}", table.file_name())
}

/// The computed tables of the next iteration. A dropped draft stays in `staging/` for the next start.
pub struct Draft {
    files: Files,
    folder: PathBuf,
    keys: PathBuf,
    provenance: Provenance,
    wear_iteration: u64,
    cells: Cells,
    entries: BTreeMap<TableName, TableEntry>,
}

impl Draft {
    pub(super) fn begin(
        files: &Files,
        layout: &Layout,
        provenance: &Provenance,
        wear_iteration: u64,
        cells: Cells,
    ) -> Result<Draft, StoreError> {
        let folder = layout.draft(wear_iteration);
        let keys = layout.draft_keys(wear_iteration);
        files.make_dir_unsynced(&folder)?;
        files.make_dir_unsynced(&keys)?;
        Ok(Draft {
            files: files.clone(),
            folder,
            keys,
            provenance: provenance.clone(),
            wear_iteration,
            cells,
            entries: BTreeMap::new(),
        })
    }

    /// The iteration.
    pub fn wear_iteration(&self) -> u64 {
        self.wear_iteration
    }

    /// Returns the tables that an earlier start stored for a stage, if their key is the same and all verify. The
    /// returned tables then belong to the draft.
    ///
    /// # Errors
    /// Returns [`StoreError::Io`] if a stored file cannot be read, and [`StoreError::Table`] if a file contains another
    /// table.
    pub fn get(&mut self, key: &StageKey) -> Result<StoredResult<Tables>, StoreError> {
        let key_path = self.key_path(key);
        if !self.files.is_there(&key_path)? {
            return Ok(StoredResult::Stale(Recompute::Missing));
        }
        let damaged = |damage| Ok(StoredResult::Stale(Recompute::Damaged(damage)));
        let stage_entry: StageEntry = match read_sealed(&self.files, &key_path)? {
            Ok(stage_entry) => stage_entry,
            Err(damage) => return damaged(damage),
        };
        if stage_entry.key.hash() != key.hash() {
            return Ok(StoredResult::Stale(Recompute::KeyChanged {
                changes: key.changes_from(&stage_entry.key),
            }));
        }
        let entries = match stage_entry.entries() {
            Ok(entries) => entries,
            Err(reason) => {
                let kind = DamageKind::Unreadable { reason };
                return damaged(Damage {
                    path: key_path,
                    kind,
                });
            }
        };
        let mut tables = Tables::new();
        for (table, entry) in &entries {
            let path = self.folder.join(&entry.file);
            match read_file(&self.files, path.clone(), *table, entry)? {
                Ok(values) if describes(entry, &values) => {
                    if let Err(damage) = check_cells(self.cells, &path, &values) {
                        return damaged(damage);
                    }
                    tables.insert(*table, values)
                }
                Ok(_) => {
                    let reason = "its key file gives other rows or columns".to_owned();
                    let kind = DamageKind::Unreadable { reason };
                    return damaged(Damage { path, kind });
                }
                Err(damage) => return damaged(damage),
            };
        }
        for (table, entry) in entries {
            self.include(table, entry.clone());
        }
        Ok(StoredResult::Valid(tables))
    }

    /// Returns the partial results of an earlier start for an unfinished stage with the same key. Also returns a writer
    /// for further partial results. [`Draft::put`] removes the partial results.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn partial_results(
        &self,
        key: &StageKey,
    ) -> Result<(Vec<u8>, parts::PartWriter), StoreError> {
        parts::open(&self.files, &self.keys, key)
    }

    /// Writes the tables of a stage to `staging/`, and replaces stored tables. A later stage of the same iteration
    /// writes the `interim` tables again. Each interim table has a separate file until the commit, so that a later
    /// stage can be computed again. The `timing` table also has a separate file, because its cost counts wherever the
    /// tables are reused.
    ///
    /// # Errors
    /// [`StoreError::NoSpace`] before a file is written, [`StoreError::Table`] if the values belong to another table,
    /// [`StoreError::Io`].
    pub fn put(
        &mut self,
        key: &StageKey,
        tables: &Tables,
        interim: &[TableName],
    ) -> Result<(), StoreError> {
        // Remove the key file first and write it last: tables without a key file do not count.
        let key_path = self.key_path(key);
        self.files.remove_file_if_there(&key_path)?;
        let mut stage_entry = StageEntry {
            key: key.clone(),
            tables: BTreeMap::new(),
        };
        for (&table, values) in tables {
            let mut file = table.file_name();
            if interim.contains(&table) {
                file = interim_file(table, key.stage());
            }
            let path = self.folder.join(&file);
            let (bytes, mut entry) = encode(&path, table, key, values, &self.provenance)?;
            entry.file = file;
            self.files.require_space(&self.folder, entry.bytes)?;
            self.files.remove_file_if_there(&path)?;
            // The commit syncs all files once. Until then the hash detects a truncated file.
            self.files.write_unsynced(&path, &bytes)?;
            stage_entry.tables.insert(table.as_str().to_owned(), entry);
        }
        self.files
            .write_unsynced(&key_path, &sealed(&key_path, &stage_entry)?)?;
        parts::remove(&self.files, &self.keys, key.stage(), 0)?;
        for (name, entry) in stage_entry.tables {
            let table = TableName::from_name(&name).expect("it was one");
            self.include(table, entry);
        }
        Ok(())
    }

    /// Returns the entries of the tables that belong to the draft.
    pub(super) fn into_entries(self) -> BTreeMap<TableName, TableEntry> {
        self.entries
    }

    fn include(&mut self, table: TableName, entry: TableEntry) {
        if entry.check_name(table).is_ok() {
            self.entries.insert(table, entry);
        }
    }

    fn key_path(&self, key: &StageKey) -> PathBuf {
        self.keys.join(format!("{}.json", key.stage()))
    }
}

/// Checks that an entry states the rows and columns of a table. The commit contains the rows and the columns of each
/// table.
fn describes(entry: &TableEntry, table: &Table) -> bool {
    let columns = table.columns().map(|(column, _)| &column.name);
    entry.rows == table.rows() && columns.eq(&entry.columns)
}

/// Encodes a table, and returns the bytes of its file and its entry.
pub(super) fn encode(
    path: &Path,
    table: TableName,
    key: &StageKey,
    values: &Table,
    provenance: &Provenance,
) -> Result<(Vec<u8>, TableEntry), StoreError> {
    let table_error = |source| StoreError::Table {
        path: path.to_owned(),
        source: Box::new(source),
    };
    if values.schema() != table.schema() {
        return Err(table_error(TableError::OtherTable {
            found: values.schema().name.clone(),
            expected: table.as_str().to_owned(),
        }));
    }
    let bytes = to_parquet(values, provenance).map_err(table_error)?;
    let entry = TableEntry {
        file: table.file_name(),
        bytes: bytes.len() as u64,
        rows: values.rows(),
        columns: values
            .columns()
            .map(|(column, _)| column.name.clone())
            .collect(),
        blake3: hash(&bytes),
        stage_key: key.hash().to_owned(),
    };
    Ok((bytes, entry))
}

/// Reads a table with a key file, if its key is the same and it verifies. Otherwise returns the reason.
pub(super) fn read_keyed(
    files: &Files,
    folder: &Path,
    key_path: &Path,
    table: TableName,
    key: &StageKey,
) -> Result<(StoredResult, Option<TableEntry>), StoreError> {
    let stale = |why| Ok((StoredResult::Stale(why), None));
    if !files.is_there(key_path)? {
        return stale(Recompute::Missing);
    }
    let keyed: KeyedEntry = match read_sealed(files, key_path)? {
        Ok(keyed) => keyed,
        Err(damage) => return stale(Recompute::Damaged(damage)),
    };
    if keyed.key.hash() != key.hash() {
        return stale(Recompute::KeyChanged {
            changes: key.changes_from(&keyed.key),
        });
    }
    match read_entry(files, folder, table, &keyed.entry)? {
        Ok(values) => Ok((StoredResult::Valid(values), Some(keyed.entry))),
        Err(damage) => stale(Recompute::Damaged(damage)),
    }
}

/// Reads the table of an entry, or returns the damage of its file.
pub(super) fn read_entry(
    files: &Files,
    folder: &Path,
    table: TableName,
    entry: &TableEntry,
) -> Result<Result<Table, Damage>, StoreError> {
    let path = folder.join(table.file_name());
    if let Err(reason) = entry.check_name(table) {
        let kind = DamageKind::Unreadable { reason };
        return Ok(Err(Damage { path, kind }));
    }
    read_file(files, path, table, entry)
}

fn read_file(
    files: &Files,
    path: PathBuf,
    table: TableName,
    entry: &TableEntry,
) -> Result<Result<Table, Damage>, StoreError> {
    let bytes = match files.read_verified(&path, entry.bytes, &entry.blake3)? {
        Ok(bytes) => bytes,
        Err(damage) => return Ok(Err(damage)),
    };
    from_parquet(&bytes, table.schema())
        .map(Ok)
        .map_err(|source| StoreError::Table {
            path,
            source: Box::new(source),
        })
}

/// Number of cells along x and y; `None` in a run without a grid.
pub(super) type Cells = Option<[i64; 2]>;

/// Checks that the indices of a table lie in the grid of the joint.
pub(super) fn check_cells(cells: Cells, path: &Path, table: &Table) -> Result<(), Damage> {
    let Some(cells) = cells else {
        return Ok(());
    };
    for (name, count) in ["i", "j"].into_iter().zip(cells) {
        let Ok(values) = table.i32(name) else {
            continue;
        };
        let is_outside = |value: &&i32| !(0..count).contains(&i64::from(**value));
        if let Some(value) = values.iter().find(is_outside) {
            let reason = format!(
                "a cell has {name} = {value}, but joint.grid allows 0 to {}",
                count - 1
            );
            return Err(Damage {
                path: path.to_owned(),
                kind: DamageKind::Unreadable { reason },
            });
        }
    }
    Ok(())
}

/// Removes files from `staging/` that do not belong to the draft of `next` or do not verify. Returns the remaining
/// stages and the removed paths.
pub(super) fn clean_staging(
    files: &Files,
    layout: &Layout,
    next: u64,
) -> Result<(Vec<String>, Vec<PathBuf>), StoreError> {
    let (draft, keys) = (layout.draft(next), layout.draft_keys(next));
    let mut removed = Vec::new();
    for entry in files.list(&layout.staging())? {
        let path = layout.staging().join(&entry.name);
        if path == draft || path == keys {
            continue;
        }
        if entry.kind == EntryKind::Folder {
            files.remove_dir_if_there(&path)?;
        } else {
            files.remove_file_if_there(&path)?;
        }
        removed.push(path);
    }
    let (mut stages, mut kept_files) = (Vec::new(), BTreeSet::new());
    for entry in files.list(&keys)? {
        // Skip the parts of a stage, because the stage checks the parts when the stage starts.
        if parts::is_part(&entry.name) {
            continue;
        }
        let key_path = keys.join(&entry.name);
        match complete_stage(files, &draft, &key_path)? {
            Some((stage, names)) => {
                stages.push(stage);
                kept_files.extend(names);
            }
            None => files.remove_file_if_there(&key_path)?,
        }
    }
    stages.sort();
    for entry in files.list(&draft)? {
        if !kept_files.contains(&entry.name) {
            let path = draft.join(&entry.name);
            files.remove_file_if_there(&path)?;
            removed.push(path);
        }
    }
    Ok((stages, removed))
}

/// Returns a complete stage of a draft with the names of its files. Returns `None` if a file does not verify.
fn complete_stage(
    files: &Files,
    draft: &Path,
    key_path: &Path,
) -> Result<Option<(String, Vec<String>)>, StoreError> {
    let Ok(stage_entry) = read_sealed::<StageEntry>(files, key_path)? else {
        return Ok(None);
    };
    let stage = stage_entry.key.stage();
    let is_own = key_path.file_stem().is_some_and(|stem| stem == stage);
    let Some(entries) = stage_entry.entries().ok().filter(|_| is_own) else {
        return Ok(None);
    };
    let mut names = Vec::with_capacity(entries.len());
    for (_, entry) in entries {
        let verified = files.verify(&draft.join(&entry.file), entry.bytes, &entry.blake3)?;
        if verified.is_err() {
            return Ok(None);
        }
        names.push(entry.file.clone());
    }
    Ok(Some((stage.to_owned(), names)))
}
