//! The iteration being computed.

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

/// What may have been kept from before: a table, or all tables of a stage.
#[derive(Debug, Clone, PartialEq)]
pub enum DraftEntry<T = Table> {
    /// It was computed from the same inputs and verifies.
    Valid(T),
    /// It has to be computed, and why.
    Stale(Recompute),
}

/// Why something has to be computed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Recompute {
    /// It was never computed.
    #[error("not computed yet")]
    NotThere,
    /// It was computed from other inputs.
    #[error("computed from other inputs: {changes}")]
    KeyChanged {
        /// The inputs that differ.
        changes: String,
    },
    /// It was computed and does not verify.
    #[error("damaged: {0}")]
    Damaged(Damage),
}

/// A table's key and entry, in the small file beside a table that is not under a commit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct KeyedEntry {
    pub key: StageKey,
    pub entry: TableEntry,
}

/// The key of a stage and the entries of its tables by name, in a small file beside the draft: what the stage has completed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct StageEntry {
    key: StageKey,
    tables: BTreeMap<String, TableEntry>,
}

impl StageEntry {
    /// The tables with their entries. Files have the names that this stage gives them: what else a file says is refused.
    fn entries(&self) -> Result<Vec<(TableName, &TableEntry)>, String> {
        let tables = self.tables.iter().map(|(name, entry)| {
            let table = TableName::from_name(name).ok_or(format!("there is no table `{name}`"))?;
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
            return Err("a table is of another key".to_owned());
        }
        tables.collect()
    }
}

/// The file of a table that a later stage of the same iteration writes again: it does not outlive the draft.
fn interim_file(table: TableName, stage: &str) -> String {
    format!("{stage}.{}", table.file_name())
}

/// The tables of the next iteration, as far as they are computed. Dropped, it stays in staging for the next start.
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

    /// The tables of a stage as an earlier start left them, if they were computed under the same key and all verify. They are then
    /// part of the draft.
    ///
    /// # Errors
    /// [`StoreError::Io`] if something is there and cannot be read, [`StoreError::Table`] if a file holds another table.
    pub fn get(&mut self, key: &StageKey) -> Result<DraftEntry<Tables>, StoreError> {
        let key_path = self.key_path(key);
        if !self.files.is_there(&key_path)? {
            return Ok(DraftEntry::Stale(Recompute::NotThere));
        }
        let damaged = |damage| Ok(DraftEntry::Stale(Recompute::Damaged(damage)));
        let of_stage: StageEntry = match read_sealed(&self.files, &key_path)? {
            Ok(of_stage) => of_stage,
            Err(damage) => return damaged(damage),
        };
        if of_stage.key.hash() != key.hash() {
            return Ok(DraftEntry::Stale(Recompute::KeyChanged {
                changes: key.changes_from(&of_stage.key),
            }));
        }
        let entries = match of_stage.entries() {
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
            self.take(table, entry.clone());
        }
        Ok(DraftEntry::Valid(tables))
    }

    /// What an earlier start has kept of a stage that it did not complete, under the same key, and what takes more of it. It is removed
    /// once the tables of the stage are there.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn parts(&self, key: &StageKey) -> Result<(Vec<u8>, parts::Keep), StoreError> {
        parts::open(&self.files, &self.keys, key)
    }

    /// Writes the tables of a stage to staging, in place of those that are there. A later stage of the iteration writes the `interim`
    /// ones again: they stay beside its own until the commit, so that it can be computed again. So does what the stage cost, which counts
    /// wherever its tables are used again.
    ///
    /// # Errors
    /// [`StoreError::NoSpace`] before a file is written, [`StoreError::Table`] if the values are those of another table,
    /// [`StoreError::Io`].
    pub fn put(
        &mut self,
        key: &StageKey,
        tables: &Tables,
        interim: &[TableName],
    ) -> Result<(), StoreError> {
        // The key goes first and comes last: tables without one count for nothing.
        let key_path = self.key_path(key);
        self.files.remove_file_if_there(&key_path)?;
        let mut of_stage = StageEntry {
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
            // The commit waits for the disk, once for all. Until then the hash tells a cut file.
            self.files.write_unsynced(&path, &bytes)?;
            of_stage.tables.insert(table.as_str().to_owned(), entry);
        }
        self.files
            .write_unsynced(&key_path, &sealed(&key_path, &of_stage)?)?;
        parts::remove(&self.files, &self.keys, key.stage(), 0)?;
        for (name, entry) in of_stage.tables {
            let table = TableName::from_name(&name).expect("it was one");
            self.take(table, entry);
        }
        Ok(())
    }

    /// What there is of it.
    pub(super) fn into_entries(self) -> BTreeMap<TableName, TableEntry> {
        self.entries
    }

    fn take(&mut self, table: TableName, entry: TableEntry) {
        if entry.check_name(table).is_ok() {
            self.entries.insert(table, entry);
        }
    }

    fn key_path(&self, key: &StageKey) -> PathBuf {
        self.keys.join(format!("{}.json", key.stage()))
    }
}

/// True if an entry has the rows and columns of a table: both go into the commit.
fn describes(entry: &TableEntry, table: &Table) -> bool {
    let columns = table.columns().map(|(column, _)| &column.name);
    entry.rows == table.rows() && columns.eq(&entry.columns)
}

/// The file of a table, and its entry.
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

/// A table beside its key file, if it was computed under this key and verifies.
pub(super) fn read_keyed(
    files: &Files,
    folder: &Path,
    key_path: &Path,
    table: TableName,
    key: &StageKey,
) -> Result<(DraftEntry, Option<TableEntry>), StoreError> {
    let stale = |why| Ok((DraftEntry::Stale(why), None));
    if !files.is_there(key_path)? {
        return stale(Recompute::NotThere);
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
        Ok(values) => Ok((DraftEntry::Valid(values), Some(keyed.entry))),
        Err(damage) => stale(Recompute::Damaged(damage)),
    }
}

/// The table of an entry, or what is wrong with its file.
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

/// Checks that every cell of a table is in the grid of the joint.
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
                "a cell has {name} = {value}, and joint.grid has 0 to {}",
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

/// Removes from staging what belongs to no draft of `next`, or does not verify. Returns the stages that are left and what was removed.
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
    let (mut stages, mut kept) = (Vec::new(), BTreeSet::new());
    for entry in files.list(&keys)? {
        // Whether they count is seen by the stage that they are of.
        if parts::is_part(&entry.name) {
            continue;
        }
        let key_path = keys.join(&entry.name);
        match whole_stage(files, &draft, &key_path)? {
            Some((stage, names)) => {
                stages.push(stage);
                kept.extend(names);
            }
            None => files.remove_file_if_there(&key_path)?,
        }
    }
    stages.sort();
    for entry in files.list(&draft)? {
        if !kept.contains(&entry.name) {
            let path = draft.join(&entry.name);
            files.remove_file_if_there(&path)?;
            removed.push(path);
        }
    }
    Ok((stages, removed))
}

/// A stage that is complete in a draft, with its files; none if one of them does not verify.
fn whole_stage(
    files: &Files,
    draft: &Path,
    key_path: &Path,
) -> Result<Option<(String, Vec<String>)>, StoreError> {
    let Ok(of_stage) = read_sealed::<StageEntry>(files, key_path)? else {
        return Ok(None);
    };
    let stage = of_stage.key.stage();
    let is_own = key_path.file_stem().is_some_and(|stem| stem == stage);
    let Some(entries) = of_stage.entries().ok().filter(|_| is_own) else {
        return Ok(None);
    };
    let mut names = Vec::with_capacity(entries.len());
    for (_, entry) in entries {
        let found = files.verify(&draft.join(&entry.file), entry.bytes, &entry.blake3)?;
        if found.is_err() {
            return Ok(None);
        }
        names.push(entry.file.clone());
    }
    Ok(Some((stage.to_owned(), names)))
}
