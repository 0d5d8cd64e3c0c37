//! `commit.json`: the manifest of a committed iteration.

use super::error::{Damage, DamageKind, StoreError};
use super::files::Files;
use super::layout::Layout;
use super::sealed::read_sealed;
use crate::json;
use crate::tables::TableName;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One file of an iteration.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TableEntry {
    /// Name of the file in the iteration's folder.
    pub file: String,
    /// Length of the file in bytes.
    pub bytes: u64,
    /// Rows of the table.
    pub rows: usize,
    /// Columns of the table, in order.
    pub columns: Vec<String>,
    /// Hash of the file.
    pub blake3: String,
    /// Hash of the key of the stage that wrote the table.
    pub stage_key: String,
}

impl TableEntry {
    /// Checks that the entry names the file of the table.
    pub(super) fn check_name(&self, table: TableName) -> Result<(), String> {
        let expected = table.file_name();
        if self.file == expected {
            return Ok(());
        }
        Err(format!(
            "`{table}` names the file {:?}; it must name {expected:?}",
            self.file
        ))
    }
}

/// The manifest of an iteration.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Commit {
    /// The iteration.
    pub wear_iteration: u64,
    /// Hash of the previous commit, `None` for the first.
    pub parent: Option<String>,
    /// The chained tables by name.
    pub tables: BTreeMap<String, TableEntry>,
    /// Hash of the fields above. Equal runs have equal hashes.
    pub hash: String,
    /// The tables outside the chain by name. Tables outside the chain differ between equal runs.
    pub unchained: BTreeMap<String, TableEntry>,
}

impl Commit {
    pub(super) fn new(
        wear_iteration: u64,
        parent: Option<String>,
        tables: BTreeMap<String, TableEntry>,
        unchained: BTreeMap<String, TableEntry>,
    ) -> Commit {
        let mut commit = Commit {
            wear_iteration,
            parent,
            tables,
            hash: String::new(),
            unchained,
        };
        commit.hash = commit.computed_hash();
        commit
    }

    /// Returns the entry of a table, chained or not.
    pub fn table(&self, name: &str) -> Option<&TableEntry> {
        self.tables.get(name).or_else(|| self.unchained.get(name))
    }

    /// Bytes of all tables.
    pub fn bytes(&self) -> u64 {
        let tables = self.tables.values().chain(self.unchained.values());
        tables.map(|entry| entry.bytes).sum()
    }

    /// The names of all tables.
    pub(super) fn names(&self) -> Vec<String> {
        self.tables
            .keys()
            .chain(self.unchained.keys())
            .cloned()
            .collect()
    }

    /// Computes the hash of the content.
    fn computed_hash(&self) -> String {
        json::hash(&serde_json::json!({
            "wear_iteration": self.wear_iteration,
            "parent": self.parent,
            "tables": self.tables,
        }))
    }

    /// Reads the manifest of an iteration and checks it on its own, without the chain.
    pub(super) fn read(
        files: &Files,
        layout: &Layout,
        wear_iteration: u64,
    ) -> Result<Result<Commit, Damage>, StoreError> {
        let path = layout.commit(wear_iteration);
        let commit: Commit = match read_sealed(files, &path)? {
            Ok(commit) => commit,
            Err(damage) => return Ok(Err(damage)),
        };
        let computed = commit.computed_hash();
        let kind = if commit.hash != computed {
            DamageKind::Hash {
                expected: commit.hash,
                found: computed,
            }
        } else if commit.wear_iteration != wear_iteration {
            DamageKind::Iteration {
                expected: wear_iteration,
                found: commit.wear_iteration,
            }
        } else if let Err(reason) = commit.check_names() {
            DamageKind::Unreadable { reason }
        } else {
            return Ok(Ok(commit));
        };
        Ok(Err(Damage { path, kind }))
    }

    /// Checks that each table is in the right list and names its standard file. A stranger's file must not choose
    /// paths.
    fn check_names(&self) -> Result<(), String> {
        let chained = self.tables.iter().map(|entry| (entry, true));
        let unchained = self.unchained.iter().map(|entry| (entry, false));
        for ((name, entry), chained) in chained.chain(unchained) {
            let table = TableName::from_name(name)
                .ok_or_else(|| format!("`{name}` is not the name of a table"))?;
            if table.schema().chained != chained {
                return Err(format!("`{name}` is in the wrong list of tables"));
            }
            entry.check_name(table)?;
        }
        Ok(())
    }
}
