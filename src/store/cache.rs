//! Results shared between runs, found by what they were computed from.

use super::draft::{DraftEntry, KeyedEntry, encode, read_keyed};
use super::error::StoreError;
use super::file_system::FileSystem;
use super::files::Files;
use super::key::StageKey;
use super::sealed::sealed;
use crate::tables::{Provenance, Table, TableName};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A folder of results, one folder a key. Entries appear whole or not at all, so that runs may share it while they write.
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

    /// Its folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The tables of a result, if all of them are there under this key and verify; otherwise why not.
    ///
    /// # Errors
    /// [`StoreError::Io`] if one is there and cannot be read, [`StoreError::Table`] if it holds another table.
    pub fn get(
        &self,
        tables: &[TableName],
        key: &StageKey,
    ) -> Result<DraftEntry<Vec<Table>>, StoreError> {
        let folder = self.root.join(key.hash());
        let mut found = Vec::with_capacity(tables.len());
        for &table in tables {
            let key_path = folder.join(format!("{table}.json"));
            match read_keyed(&self.files, &folder, &key_path, table, key)?.0 {
                DraftEntry::Valid(values) => found.push(values),
                DraftEntry::Stale(why) => return Ok(DraftEntry::Stale(why)),
            }
        }
        Ok(DraftEntry::Valid(found))
    }

    /// Adds a result, in place of one that does not verify.
    ///
    /// # Errors
    /// [`StoreError::Locked`] while another process adds one, [`StoreError::NoSpace`] before anything is written, [`StoreError::Io`].
    pub fn put(
        &self,
        key: &StageKey,
        tables: &[(TableName, &Table)],
        provenance: &Provenance,
    ) -> Result<(), StoreError> {
        self.files.make_dir(&self.root)?;
        // One writer at a time: names by the number of the process would not tell two containers apart that share a cache.
        let _guard = self.files.lock(&self.root.join("lock"), &self.root)?;
        let draft = self.root.join("draft");
        self.files.remove_dir_if_there(&draft)?;
        let added = self.add(key, tables, provenance, &draft);
        if added.is_err() {
            // What is left of it serves nobody. That it cannot be removed would say less than why it was not finished.
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
