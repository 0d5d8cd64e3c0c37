//! The iteration being computed.

use super::commit::TableEntry;
use super::error::{Damage, DamageKind, StoreError};
use super::file_system::EntryKind;
use super::files::{Files, Layout, hash};
use super::key::StageKey;
use super::sealed::{Seal, read_sealed, sealed};
use crate::tables::{Provenance, Table, TableError, TableName, from_parquet, to_parquet};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A table that may have been kept from before.
#[derive(Debug, Clone, PartialEq)]
pub enum Kept {
    /// It was computed from the same inputs and verifies.
    Valid(Table),
    /// It has to be computed, and why.
    Stale(Recompute),
}

/// Why a table has to be computed.
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

/// The tables of the next iteration, as far as they are computed. Dropped, it stays in staging for the next start.
pub struct Draft {
    files: Files,
    folder: PathBuf,
    keys: PathBuf,
    provenance: Provenance,
    wear_iteration: u64,
    entries: BTreeMap<TableName, TableEntry>,
}

impl Draft {
    pub(super) fn begin(
        files: &Files,
        layout: &Layout,
        provenance: &Provenance,
        wear_iteration: u64,
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
            entries: BTreeMap::new(),
        })
    }

    /// The iteration.
    pub fn wear_iteration(&self) -> u64 {
        self.wear_iteration
    }

    /// The table as an earlier start left it, if it was computed under the same key and verifies. It is then part of the draft.
    ///
    /// # Errors
    /// [`StoreError::Io`] if it is there and cannot be read, [`StoreError::Table`] if it holds another table.
    pub fn get(&mut self, table: TableName, key: &StageKey) -> Result<Kept, StoreError> {
        let (kept, entry) =
            read_keyed(&self.files, &self.folder, &self.key_path(table), table, key)?;
        if let Some(entry) = entry {
            self.entries.insert(table, entry);
        }
        Ok(kept)
    }

    /// Writes a table to staging, in place of one that is there.
    ///
    /// # Errors
    /// [`StoreError::NoSpace`] before anything is written, [`StoreError::Table`] if the values are those of another table,
    /// [`StoreError::Io`].
    pub fn put(
        &mut self,
        table: TableName,
        key: &StageKey,
        values: &Table,
    ) -> Result<(), StoreError> {
        self.entries.remove(&table);
        let path = self.folder.join(table.file_name());
        let key_path = self.key_path(table);
        let (bytes, keyed) = encode(&path, table, key, values, &self.provenance)?;
        self.files.require_space(&self.folder, keyed.entry.bytes)?;
        // The key goes first and comes last: a table without one counts for nothing.
        self.files.remove_file_if_there(&key_path)?;
        self.files.remove_file_if_there(&path)?;
        // The commit waits for the disk, once for all. Until then the hash tells a cut file.
        self.files.write_unsynced(&path, &bytes)?;
        self.files
            .write_unsynced(&key_path, &sealed(&key_path, &keyed)?)?;
        self.entries.insert(table, keyed.entry);
        Ok(())
    }

    /// What there is of it.
    pub(super) fn into_entries(self) -> BTreeMap<TableName, TableEntry> {
        self.entries
    }

    fn key_path(&self, table: TableName) -> PathBuf {
        self.keys.join(format!("{table}.json"))
    }
}

/// The file of a table and what its key file says.
pub(super) fn encode(
    path: &Path,
    table: TableName,
    key: &StageKey,
    values: &Table,
    provenance: &Provenance,
) -> Result<(Vec<u8>, KeyedEntry), StoreError> {
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
    Ok((
        bytes,
        KeyedEntry {
            key: key.clone(),
            entry,
        },
    ))
}

/// A table beside its key file, if it was computed under this key and verifies.
pub(super) fn read_keyed(
    files: &Files,
    folder: &Path,
    key_path: &Path,
    table: TableName,
    key: &StageKey,
) -> Result<(Kept, Option<TableEntry>), StoreError> {
    let stale = |why| Ok((Kept::Stale(why), None));
    if !files.is_there(key_path)? {
        return stale(Recompute::NotThere);
    }
    let keyed: KeyedEntry = match read_sealed(files, key_path, Seal::IfThere)? {
        Ok(keyed) => keyed,
        Err(damage) => return stale(Recompute::Damaged(damage)),
    };
    if keyed.key.hash() != key.hash() {
        return stale(Recompute::KeyChanged {
            changes: key.changes_from(&keyed.key),
        });
    }
    match read_entry(files, folder, table, &keyed.entry)? {
        Ok(values) => Ok((Kept::Valid(values), Some(keyed.entry))),
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

/// Removes from staging what belongs to no draft of `next`, or does not verify. Returns what is left and what was removed.
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
    let mut kept = Vec::new();
    for entry in files.list(&draft)? {
        let path = draft.join(&entry.name);
        let stem = entry.name.strip_suffix(".parquet").unwrap_or_default();
        let key_path = keys.join(format!("{stem}.json"));
        if let Ok(keyed) = read_sealed::<KeyedEntry>(files, &key_path, Seal::IfThere)?
            && files
                .verify(&path, keyed.entry.bytes, &keyed.entry.blake3)?
                .is_ok()
        {
            kept.push(stem.to_owned());
        } else {
            files.remove_file_if_there(&path)?;
            removed.push(path);
        }
    }
    for entry in files.list(&keys)? {
        let stem = entry.name.strip_suffix(".json").unwrap_or_default();
        if !kept.iter().any(|table| table == stem) {
            files.remove_file_if_there(&keys.join(&entry.name))?;
        }
    }
    Ok((kept, removed))
}
