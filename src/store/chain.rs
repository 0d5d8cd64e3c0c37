//! Verification: which commits are sound, and what is wrong with the others.

use super::commit::{Commit, TableEntry};
use super::draft::KeyedEntry;
use super::error::{Damage, DamageKind, StoreError};
use super::file_system::EntryKind;
use super::files::Files;
use super::layout::{Layout, iteration_of};
use super::record::Pruned;
use super::sealed::read_sealed;
use crate::tables::TableName;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// What verification found of one iteration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommitReport {
    /// The iteration.
    pub wear_iteration: u64,
    /// What keeps it from being continued; empty if it is sound.
    pub damage: Vec<Damage>,
    /// Damage to tables outside the chain, which no result depends on.
    pub unchained_damage: Vec<Damage>,
}

/// What verification found of one table of `once/`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OnceReport {
    /// The table.
    pub table: TableName,
    /// What is wrong with it; it is then computed again.
    pub damage: Option<Damage>,
}

/// What verification found of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VerifyReport {
    /// What is wrong with `run.json`, its copy, `scene.toml`, `plan.json`, `schemas.json` and `history.parquet`; a start mends it, but for
    /// the rows of pruned iterations, which nothing else has.
    pub metadata: Vec<Damage>,
    /// The iterations, ascending, those missing without having been pruned among them.
    pub commits: Vec<CommitReport>,
    /// The iterations that were pruned, ascending; the chain passes over them by their recorded hashes.
    pub pruned: Vec<u64>,
    /// The tables of `once/`.
    pub once: Vec<OnceReport>,
}

impl VerifyReport {
    /// True if nothing at all is damaged.
    pub fn is_sound(&self) -> bool {
        self.damage().next().is_none()
    }

    /// Everything that is damaged.
    pub fn damage(&self) -> impl Iterator<Item = &Damage> {
        self.commits
            .iter()
            .flat_map(|commit| commit.damage.iter().chain(&commit.unchained_damage))
            .chain(&self.metadata)
            .chain(self.once.iter().filter_map(|once| once.damage.as_ref()))
    }
}

/// What the chain passes over.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Past {
    /// The iterations that were pruned.
    pub pruned: BTreeMap<u64, Pruned>,
    /// True where it is not known which ones were: then no gap breaks the chain, and what stands behind one is held to its own hash
    /// alone.
    pub lost: bool,
}

/// Most iterations in a row that may be missing where it is not known what was pruned: a stray folder may have any number.
const LONGEST_GAP: u64 = 1_000_000;

/// The iterations of a run as found on disk.
pub(super) struct Chain {
    /// The commits up to the first that does not verify.
    pub sound: BTreeMap<u64, Commit>,
    /// One report an iteration.
    pub reports: Vec<CommitReport>,
}

/// The iterations whose folders are there, ascending.
pub(super) fn folders(files: &Files, layout: &Layout) -> Result<BTreeSet<u64>, StoreError> {
    Ok(files
        .list(&layout.iterations())?
        .iter()
        .filter(|entry| entry.kind == EntryKind::Folder)
        .filter_map(|entry| iteration_of(&entry.name))
        .collect())
}

/// Verifies every iteration, and that each follows the one before it.
///
/// A pruned iteration stands in the chain with the hashes that the history keeps of it. An iteration that is absent and was not
/// pruned breaks the chain; of several in a row the first stands for all, since a stray folder may have any number.
pub(super) fn walk(files: &Files, layout: &Layout, past: &Past) -> Result<Chain, StoreError> {
    let pruned = &past.pruned;
    let mut present = folders(files, layout)?;
    present.retain(|wear_iteration| !pruned.contains_key(wear_iteration));
    let mut chain = Chain {
        sound: BTreeMap::new(),
        reports: Vec::new(),
    };
    let Some(&highest) = present.last() else {
        return Ok(chain);
    };
    // Hash of the commit before, where it is known.
    let mut before: Option<Option<String>> = Some(None);
    let mut broken_at: Option<u64> = None;
    // Before each number that does not follow the one before it stands the first that is absent.
    let mut expected = 0;
    let mut numbers: BTreeSet<u64> = present.clone();
    numbers.extend(pruned.keys().filter(|k| **k < highest));
    let mut in_order = Vec::new();
    for number in numbers {
        let gap = number.saturating_sub(expected);
        if gap > 0 && (!past.lost || gap > LONGEST_GAP) {
            in_order.push(expected);
        }
        in_order.push(number);
        expected = number.saturating_add(1);
    }
    let mut expected = 0;
    for wear_iteration in in_order {
        if past.lost && wear_iteration > expected {
            before = None;
        }
        expected = wear_iteration.saturating_add(1);
        let mut report = CommitReport {
            wear_iteration,
            damage: Vec::new(),
            unchained_damage: Vec::new(),
        };
        let mut found = None;
        let link = if let Some(gone) = pruned.get(&wear_iteration) {
            Some((layout.history(), gone.parent.clone(), gone.hash.clone()))
        } else if !present.contains(&wear_iteration) {
            report.damage.push(Damage {
                path: layout.iteration(wear_iteration),
                kind: DamageKind::Missing,
            });
            None
        } else {
            match Commit::read(files, layout, wear_iteration)? {
                Err(damage) => {
                    report.damage.push(damage);
                    None
                }
                Ok(commit) => {
                    let folder = layout.iteration(wear_iteration);
                    report.damage = check_files(files, &folder, commit.tables.values())?;
                    report.unchained_damage =
                        check_files(files, &folder, commit.unchained.values())?;
                    let link = (
                        layout.commit(wear_iteration),
                        commit.parent.clone(),
                        commit.hash.clone(),
                    );
                    found = Some(commit);
                    Some(link)
                }
            }
        };
        if let Some(first) = broken_at {
            report.damage.push(Damage {
                path: layout.iteration(wear_iteration),
                kind: DamageKind::After(first),
            });
        } else if let (Some((path, parent, _)), Some(before)) = (&link, &before)
            && parent != before
        {
            report.damage.push(Damage {
                path: path.clone(),
                kind: DamageKind::Parent {
                    expected: before.clone(),
                    found: parent.clone(),
                },
            });
        }
        if broken_at.is_none() && !report.damage.is_empty() {
            broken_at = Some(wear_iteration);
        }
        before = Some(link.map(|(_, _, hash)| hash));
        if let (Some(commit), None) = (found, broken_at) {
            chain.sound.insert(wear_iteration, commit);
        }
        if !pruned.contains_key(&wear_iteration) || !report.damage.is_empty() {
            chain.reports.push(report);
        }
    }
    Ok(chain)
}

fn check_files<'a>(
    files: &Files,
    folder: &Path,
    entries: impl Iterator<Item = &'a TableEntry>,
) -> Result<Vec<Damage>, StoreError> {
    let mut damage = Vec::new();
    for entry in entries {
        let path = folder.join(&entry.file);
        damage.extend(files.verify(&path, entry.bytes, &entry.blake3)?.err());
    }
    Ok(damage)
}

/// Verifies the tables of `once/`.
pub(super) fn check_once(files: &Files, layout: &Layout) -> Result<Vec<OnceReport>, StoreError> {
    let folder = layout.once();
    let entries = files.list(&folder)?;
    // A table without its key file is as damaged as a key file without its table.
    let tables: BTreeSet<TableName> = entries
        .iter()
        .filter_map(|entry| entry.name.rsplit_once('.'))
        .filter(|(_, extension)| ["parquet", "json"].contains(extension))
        .filter_map(|(stem, _)| TableName::from_name(stem))
        .collect();
    let mut reports = Vec::new();
    for table in tables {
        let key_path = folder.join(format!("{table}.json"));
        let damage = match read_sealed::<KeyedEntry>(files, &key_path)? {
            Err(damage) => Some(damage),
            Ok(keyed) => check_keyed(files, &folder, table, &keyed.entry)?,
        };
        reports.push(OnceReport { table, damage });
    }
    Ok(reports)
}

fn check_keyed(
    files: &Files,
    folder: &Path,
    table: TableName,
    entry: &TableEntry,
) -> Result<Option<Damage>, StoreError> {
    let path = folder.join(table.file_name());
    if let Err(reason) = entry.check_name(table) {
        let kind = DamageKind::Unreadable { reason };
        return Ok(Some(Damage { path, kind }));
    }
    Ok(files.verify(&path, entry.bytes, &entry.blake3)?.err())
}
