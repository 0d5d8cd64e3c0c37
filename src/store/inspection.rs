//! Reads a consistent state of a run from disk, even while another process writes the run.

use super::chain::{self, Chain, PrunedIterations};
use super::error::{Damage, DamageKind, StoreError};
use super::files::Files;
use super::history::{self, History, HistoryFile};
use super::layout::Layout;
use super::record::RunRecord;
use super::record_file::read_record;

/// Most attempts to read a run while its writer prunes.
const MOST_READS: usize = 8;

/// Record, history and chain of a run, read at one time.
pub(super) struct RunSnapshot {
    pub record: RunRecord,
    pub past: PastAndHistory,
    pub chain: Chain,
}

/// Pruned iterations of a run, and the state of its history file.
pub(super) struct PastAndHistory {
    pub past: PrunedIterations,
    pub found: HistoryFile,
}

impl PastAndHistory {
    /// Reads the history file and derives the pruned iterations.
    pub fn read(files: &Files, layout: &Layout) -> Result<Self, StoreError> {
        let found = history::read(files, layout)?;
        let mut past = PrunedIterations::default();
        match &found {
            HistoryFile::Sound(history) => past.pruned = history.pruned(),
            // Without a sound `history.parquet`, the pruned iterations are unknown. The file may be absent because the
            // run ended before the first row was written.
            HistoryFile::Absent | HistoryFile::Damaged(_) => past.lost = true,
        }
        Ok(PastAndHistory { past, found })
    }

    /// Number of rows in the file.
    pub fn rows(&self) -> usize {
        match &self.found {
            HistoryFile::Sound(history) => history.len(),
            HistoryFile::Absent | HistoryFile::Damaged(_) => 0,
        }
    }

    /// Returns the leading rows that agree with the commits.
    pub fn matching_rows(self, chain: &Chain) -> History {
        let HistoryFile::Sound(mut history) = self.found else {
            return History::default();
        };
        let rows = agreeing_rows(&history, &self.past, chain);
        history.truncate(rows);
        history
    }

    /// Returns the damage of the history file. A file that is only behind is not damaged.
    pub fn damage(&self, layout: &Layout, chain: &Chain) -> Option<Damage> {
        let path = layout.history();
        match &self.found {
            HistoryFile::Damaged(damage) => Some(damage.clone()),
            // Without a gap the folders have all content of the history.
            HistoryFile::Absent => has_gap(chain, &self.past).then_some(Damage {
                path,
                kind: DamageKind::Missing,
            }),
            HistoryFile::Sound(history) => {
                let rows = agreeing_rows(history, &self.past, chain) as u64;
                let commit = chain.sound.get(&rows)?;
                let found = history.commit_of(rows)?;
                Some(Damage {
                    path,
                    kind: DamageKind::Hash {
                        expected: commit.hash.clone(),
                        found: found.to_owned(),
                    },
                })
            }
        }
    }
}

/// True if an iteration below the latest is neither committed nor recorded as pruned.
pub(super) fn has_gap(chain: &Chain, past: &PrunedIterations) -> bool {
    let Some(&latest) = chain.sound.keys().next_back() else {
        return false;
    };
    let pruned = past.pruned.range(..latest).count() as u64;
    pruned + (chain.sound.len() as u64) < latest + 1
}

/// Counts the leading rows of a history whose commit hashes match the run.
fn agreeing_rows(history: &History, past: &PrunedIterations, chain: &Chain) -> usize {
    let latest = chain.sound.keys().next_back().copied();
    let rows = latest
        .map_or(0, |latest| latest as usize + 1)
        .min(history.len());
    let agrees = |k: &usize| {
        let k = *k as u64;
        let hash = chain.sound.get(&k).map(|commit| commit.hash.as_str());
        let hash = hash.or(past.pruned.get(&k).map(|pruned| pruned.hash.as_str()));
        hash.is_some() && hash == history.commit_of(k)
    };
    (0..rows).take_while(agrees).count()
}

/// Verifies the iterations. Reads the run again when the history has changed meanwhile: an iteration that a writer has
/// just pruned looks like damage.
pub(super) fn verify_consistently(
    files: &Files,
    layout: &Layout,
) -> Result<RunSnapshot, StoreError> {
    let read = || {
        let found = read_record(files, layout)?.ok_or_else(|| StoreError::NoRun {
            path: layout.root.clone(),
        })?;
        let past = PastAndHistory::read(files, layout)?;
        Ok::<_, StoreError>((found.record, past))
    };
    let (mut record, mut past) = read()?;
    let mut looks = 1;
    loop {
        let chain = chain::verify_chain(files, layout, &past.past)?;
        let sound = chain.reports.iter().all(|report| report.damage.is_empty());
        if sound || looks == MOST_READS {
            return Ok(RunSnapshot {
                record,
                past,
                chain,
            });
        }
        let reread = read()?;
        if reread.1.past == past.past {
            return Ok(RunSnapshot {
                record,
                past,
                chain,
            });
        }
        (record, past) = reread;
        looks += 1;
    }
}
