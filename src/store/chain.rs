//! Verification: finds the sound commits and reports the damage of the others.

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

/// Result of verifying one iteration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommitReport {
    /// The iteration.
    pub wear_iteration: u64,
    /// Damage that prevents the run from continuing from the iteration; empty for a sound iteration.
    pub damage: Vec<Damage>,
    /// Damage to tables outside the chain, which no result depends on.
    pub unchained_damage: Vec<Damage>,
}

/// Result of verifying one table of `once/`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OnceReport {
    /// The table.
    pub table: TableName,
    /// Damage of the table. A damaged table is computed again.
    pub damage: Option<Damage>,
}

/// Result of verifying a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VerifyReport {
    /// Damage of the files `run.json`, `run.copy.json`, `scene.toml`, `plan.json`, `schemas.json` and
    /// `history.parquet`. The next start repairs the damaged files. If `history.parquet` is damaged, the repair loses
    /// the rows of pruned iterations. Only `history.parquet` contains the rows of pruned iterations.
    pub metadata: Vec<Damage>,
    /// Reports of the iterations, ascending. An iteration that is missing but not pruned has a report with damage.
    pub commits: Vec<CommitReport>,
    /// The pruned iterations, ascending. The recorded hash of each pruned iteration connects the chain of commits.
    pub pruned: Vec<u64>,
    /// The tables of `once/`.
    pub once: Vec<OnceReport>,
}

impl VerifyReport {
    /// True if nothing is damaged.
    pub fn is_sound(&self) -> bool {
        self.damage().next().is_none()
    }

    /// All damage of the run.
    pub fn damage(&self) -> impl Iterator<Item = &Damage> {
        self.commits
            .iter()
            .flat_map(|commit| commit.damage.iter().chain(&commit.unchained_damage))
            .chain(&self.metadata)
            .chain(self.once.iter().filter_map(|once| once.damage.as_ref()))
    }
}

/// Iterations that the chain skips.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct PrunedIterations {
    /// The pruned iterations.
    pub pruned: BTreeMap<u64, Pruned>,
    /// True if the list of pruned iterations is lost. If the list is lost, a gap does not break the chain. The store
    /// then checks the commit after the gap only against the hash of that commit.
    pub lost: bool,
}

/// Longest gap accepted while the list of pruned iterations is lost. A stray folder may have any number.
const LONGEST_GAP: u64 = 1_000_000;

/// Chain of the iterations on disk.
pub(super) struct Chain {
    /// The sound commits, up to the first one that does not verify.
    pub sound: BTreeMap<u64, Commit>,
    /// One report per iteration. Pruned iterations without damage have no report.
    pub reports: Vec<CommitReport>,
}

/// Lists the iterations that have a folder, ascending.
pub(super) fn folders(files: &Files, layout: &Layout) -> Result<BTreeSet<u64>, StoreError> {
    Ok(files
        .list(&layout.iterations())?
        .iter()
        .filter(|entry| entry.kind == EntryKind::Folder)
        .filter_map(|entry| iteration_of(&entry.name))
        .collect())
}

/// Verifies every iteration, and that each follows its predecessor.
///
/// A pruned iteration is a link of the chain by the hashes in the history. An absent iteration that was not pruned
/// breaks the chain. Of several absent ones in a row only the first gets a report, since a stray folder may have any
/// number.
pub(super) fn verify_chain(
    files: &Files,
    layout: &Layout,
    past: &PrunedIterations,
) -> Result<Chain, StoreError> {
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
    // Hash of the previous commit: `None` if unknown, `Some(None)` before the first commit.
    let mut previous_hash: Option<Option<String>> = Some(None);
    let mut broken_at: Option<u64> = None;
    // Insert the first missing iteration before every number that does not follow its predecessor.
    let mut next_number = 0;
    let mut numbers: BTreeSet<u64> = present.clone();
    numbers.extend(pruned.keys().filter(|k| **k < highest));
    let mut in_order = Vec::new();
    for number in numbers {
        let gap = number.saturating_sub(next_number);
        if gap > 0 && (!past.lost || gap > LONGEST_GAP) {
            in_order.push(next_number);
        }
        in_order.push(number);
        next_number = number.saturating_add(1);
    }
    let mut next_number = 0;
    for wear_iteration in in_order {
        if past.lost && wear_iteration > next_number {
            previous_hash = None;
        }
        next_number = wear_iteration.saturating_add(1);
        let mut report = CommitReport {
            wear_iteration,
            damage: Vec::new(),
            unchained_damage: Vec::new(),
        };
        let mut sound_commit = None;
        let link = if let Some(pruned_link) = pruned.get(&wear_iteration) {
            Some((
                layout.history(),
                pruned_link.parent.clone(),
                pruned_link.hash.clone(),
            ))
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
                    sound_commit = Some(commit);
                    Some(link)
                }
            }
        };
        if let Some(first_broken) = broken_at {
            report.damage.push(Damage {
                path: layout.iteration(wear_iteration),
                kind: DamageKind::After(first_broken),
            });
        } else if let (Some((path, parent, _)), Some(previous_hash)) = (&link, &previous_hash)
            && parent != previous_hash
        {
            report.damage.push(Damage {
                path: path.clone(),
                kind: DamageKind::Parent {
                    expected: previous_hash.clone(),
                    found: parent.clone(),
                },
            });
        }
        if broken_at.is_none() && !report.damage.is_empty() {
            broken_at = Some(wear_iteration);
        }
        previous_hash = Some(link.map(|(_, _, hash)| hash));
        if let (Some(commit), None) = (sound_commit, broken_at) {
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
    // Each table of `once/` has a table file and a key file. A table is damaged if the table file or the key file is
    // missing.
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
