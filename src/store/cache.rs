//! Cache of results that runs share, addressed by the stage keys of the results.

use super::draft::{KeyedEntry, StoredResult, encode, read_keyed};
use super::error::StoreError;
use super::file_system::FileSystem;
use super::files::Files;
use super::key::StageKey;
use super::sealed::sealed;
use crate::tables::{Provenance, Table, TableName};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A folder of results with one subfolder per key. An entry appears as a whole or not at all, so several runs can share
/// the cache while they write.
#[derive(Clone)]
pub struct Cache {
    files: Files,
    root: PathBuf,
}

impl Cache {
    /// The cache in the folder `root`, which need not exist.
    pub fn new(file_system: Arc<dyn FileSystem>, root: &Path) -> Cache {
        Cache {
            files: Files(file_system),
            root: root.to_owned(),
        }
    }

    /// The folder of the cache.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Returns the tables of a result if the cache has all tables under the key `key` and all tables verify. Otherwise
    /// returns the reason.
    ///
    /// # Errors
    /// Returns [`StoreError::Io`] if a stored table cannot be read, and [`StoreError::Table`] if a file contains
    /// another table.
    pub fn get(
        &self,
        tables: &[TableName],
        key: &StageKey,
    ) -> Result<StoredResult<Vec<Table>>, StoreError> {
        let folder = self.root.join(key.hash());
        let mut values_by_table = Vec::with_capacity(tables.len());
        for &table in tables {
            let key_path = folder.join(format!("{table}.json"));
            match read_keyed(&self.files, &folder, &key_path, table, key)?.0 {
                StoredResult::Valid(table_values) => values_by_table.push(table_values),
                StoredResult::Stale(why) => return Ok(StoredResult::Stale(why)),
            }
        }
        Ok(StoredResult::Valid(values_by_table))
    }

    /// Stores a result, and replaces a stored result that does not verify.
    ///
    /// # Errors
    /// [`StoreError::Locked`] while another process writes, [`StoreError::NoSpace`] before anything is written,
    /// [`StoreError::Io`].
    pub fn put(
        &self,
        key: &StageKey,
        tables: &[(TableName, &Table)],
        provenance: &Provenance,
    ) -> Result<(), StoreError> {
        self.files.make_dir(&self.root)?;
        // One writer at a time. Process numbers cannot name drafts, because processes in two containers that share a
        // cache may have equal numbers.
        let _guard = self.files.lock(&self.root.join("lock"), &self.root)?;
        let draft = self.root.join("draft");
        self.files.remove_dir_if_there(&draft)?;
        let added = self.add(key, tables, provenance, &draft);
        if added.is_err() {
            // Remove the useless draft and ignore an error of the removal, because that error would hide the error of
            // the write.
            drop(self.files.remove_dir_if_there(&draft));
        }
        added
    }

    fn add(
        &self,
        key: &StageKey,
        tables: &[(TableName, &Table)],
        provenance: &Provenance,
        draft: &Path,
    ) -> Result<(), StoreError> {
        let folder = self.root.join(key.hash());
        self.files.make_dir_unsynced(draft)?;
        for &(table, values) in tables {
            let path = draft.join(table.file_name());
            let (bytes, entry) = encode(&path, table, key, values, provenance)?;
            self.files.require_space(&self.root, entry.bytes)?;
            self.files.write_new(&path, &bytes)?;
            let key_path = draft.join(format!("{table}.json"));
            let key = key.clone();
            let keyed = sealed(&key_path, &KeyedEntry { key, entry })?;
            self.files.write_new(&key_path, &keyed)?;
        }
        self.files.remove_dir_if_there(&folder)?;
        self.files.rename(draft, &folder)?;
        self.files.sync_dir(&self.root)
    }
}
