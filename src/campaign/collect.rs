//! Shards of collected histories (`collected/shard-NNNNN.parquet`), appended as runs end.
//!
//! Each row of a shard is one iteration of one run, with the index and the keys of the run. Rows are sorted by index
//! and iteration. A shard is written under another name and then renamed, so a reader of `collected/*.parquet` never
//! sees a partial shard. A shard never changes.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::thread;

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::error::CampaignError;
use super::folder::{COLLECTED, CampaignFolder, LONGEST_TABLE};
use super::table::Campaign;
use crate::store::{DamageKind, History, is_read_failure};
use crate::tables::{
    ColumnSchema, ColumnType, DescribedColumn, Nullable, columns_from_parquet, metadata_entry,
    nullable_to_parquet,
};

const NAME: &str = "collected";
/// Column with the index of the row in the campaign.
pub(super) const INDEX: &str = "index";
/// Column with the number of the wear iteration.
pub(super) const WEAR_ITERATION: &str = "wear_iteration";
/// Number of rows at which a shard is written. A shard with `ROWS_OF_A_SHARD` rows and about a hundred columns takes
/// about 100 MB.
const ROWS_OF_A_SHARD: usize = 1 << 17;
/// Largest number of rows that is read from a shard. The limit exceeds [`ROWS_OF_A_SHARD`] because the history of a
/// single run may have more rows than a shard.
const MOST_ROWS: i64 = 1 << 26;
/// Largest size of the history of a run \[B\].
const LONGEST_HISTORY: u64 = 1 << 30;
/// Number of histories that one thread reads per group.
const AT_ONCE: usize = 64;

/// Result of a collection.
#[derive(Debug, Default)]
pub struct CollectionSummary {
    /// Number of runs that `collect` has added to the shards.
    pub runs: usize,
    /// Number of runs in all shards, old and new.
    pub total: usize,
    /// Paths of the shards that `collect` has written.
    pub shards: Vec<PathBuf>,
    /// Damaged histories, each with the damage.
    pub damaged: Vec<(PathBuf, String)>,
    /// Errors of histories that could not be read, although the content of the histories may be intact.
    pub unread: Vec<CampaignError>,
}

/// Entry in the metadata of a shard.
#[derive(Debug, Serialize, Deserialize)]
struct Entry {
    schema: String,
    /// Ranges of the row indices in the shard, including both ends.
    runs: Vec<[usize; 2]>,
    /// Hash of the content keys of the rows in the shard.
    content: String,
}

/// Lists the shards of a campaign.
fn shards(folder: &CampaignFolder) -> Result<Vec<PathBuf>, CampaignError> {
    let names = folder.list(COLLECTED)?;
    let is_shard = |name: &String| name.starts_with("shard-") && name.ends_with(".parquet");
    let names = names.into_iter().filter(is_shard);
    Ok(names
        .map(|name| folder.root.join(COLLECTED).join(name))
        .collect())
}

fn shard_error(path: &Path, reason: impl ToString) -> CampaignError {
    CampaignError::Damaged {
        path: path.to_owned(),
        reason: format!(
            "{}; move it away and collect again while the files in `ended` still exist",
            reason.to_string()
        ),
    }
}

/// Returns the ranges of row indices in a shard, and checks that the rows of the shard belong to `campaign`.
fn shard_ranges(
    bytes: &[u8],
    shard: &Path,
    campaign: &Campaign,
) -> Result<Vec<[usize; 2]>, CampaignError> {
    let text = metadata_entry(bytes, NAME).map_err(|error| shard_error(shard, error))?;
    let entry: Option<Entry> = text.and_then(|text| serde_json::from_str(&text).ok());
    let Some(entry) = entry.filter(|entry| entry.schema == NAME) else {
        return Err(shard_error(shard, "it is not a shard of a campaign"));
    };
    let rows = campaign.rows.len();
    let ascends = |pair: &[[usize; 2]]| pair[0][1] < pair[1][0];
    if !entry.runs.windows(2).all(ascends) {
        return Err(shard_error(shard, "its ranges of rows overlap"));
    }
    let is_in_campaign = entry
        .runs
        .iter()
        .all(|[first, last]| first <= last && *last < rows);
    let all = || entry.runs.iter().flat_map(|[first, last]| *first..=*last);
    if !is_in_campaign || campaign.content_hash(all()) != entry.content {
        return Err(shard_error(shard, "it holds runs of another campaign"));
    }
    Ok(entry.runs)
}

/// Joins ascending indices into ranges.
fn ranges(indices: &[usize]) -> Vec<[usize; 2]> {
    let mut ranges: Vec<[usize; 2]> = Vec::new();
    for &index in indices {
        match ranges.last_mut() {
            Some(last) if last[1] + 1 == index => last[1] = index,
            _ => ranges.push([index, index]),
        }
    }
    ranges
}

/// Rows of the next shard, appended run by run. A column that a run lacks is null in its rows.
#[derive(Default)]
struct ShardBuilder {
    index: Vec<Option<i64>>,
    wear_iteration: Vec<Option<i64>>,
    columns: BTreeMap<String, (ColumnSchema, Nullable)>,
    /// Campaign row of every row of the shard.
    of: Vec<usize>,
    runs: Vec<usize>,
}

impl ShardBuilder {
    fn add(&mut self, index: usize, history: &History) {
        let (rows_before, rows) = (self.index.len(), history.len());
        self.index.resize(rows_before + rows, Some(index as i64));
        self.wear_iteration.extend((0..rows as i64).map(Some));
        self.of.resize(rows_before + rows, index);
        self.runs.push(index);
        for (column, values) in history.columns() {
            let name = column.name.clone();
            let collected_values = self.columns.entry(name);
            let (_, collected_values) = collected_values.or_insert_with(|| {
                let empty = Nullable::absent(column.kind, rows_before);
                (column, empty)
            });
            collected_values.append(values);
        }
        for (_, values) in self.columns.values_mut() {
            values.resize(rows_before + rows);
        }
    }

    fn to_bytes(&self, campaign: &Campaign) -> Result<Vec<u8>, crate::tables::TableError> {
        let plain = |name| ColumnSchema::plain(name, ColumnType::I64, "1");
        let mut row_columns = vec![
            (plain(INDEX), Nullable::I64(self.index.clone())),
            (
                plain(WEAR_ITERATION),
                Nullable::I64(self.wear_iteration.clone()),
            ),
        ];
        row_columns.splice(1..1, campaign.key_columns(&self.of));
        // If a key had the name of a history column, the history column would win.
        row_columns.retain(|(column, _)| !self.columns.contains_key(&column.name));
        let all: Vec<DescribedColumn> = row_columns
            .iter()
            .chain(self.columns.values())
            .map(|(column, values)| (column, values))
            .collect();
        let units: BTreeMap<&str, serde_json::Value> = all
            .iter()
            .map(|(column, _)| (column.name.as_str(), json!({ "unit": column.unit })))
            .collect();
        let entry = json!({
            "schema": NAME,
            "program_version": env!("CARGO_PKG_VERSION"),
            "runs": ranges(&self.runs),
            "content": campaign.content_hash(self.runs.iter().copied()),
            "columns": units,
        });
        nullable_to_parquet(NAME, &all, entry.to_string())
    }
}

fn history(
    folder: &CampaignFolder,
    path: &Path,
    content_key: &str,
) -> Result<History, CampaignError> {
    let damaged = |reason: String| CampaignError::Damaged {
        path: path.to_owned(),
        reason,
    };
    let bytes = match folder.read(path, LONGEST_HISTORY) {
        Err(CampaignError::Io { source, .. }) if !is_read_failure(&source) => {
            return Err(damaged(format!("it cannot be read ({source})")));
        }
        bytes => bytes?,
    };
    let history =
        History::of_bytes(&bytes).map_err(|damage: DamageKind| damaged(damage.to_string()))?;
    match History::row_in(&bytes) {
        Some(row) if row != content_key => {
            Err(damaged("it is the history of another row".to_owned()))
        }
        _ if history.is_empty() => Err(damaged("it has no iteration".to_owned())),
        _ => Ok(history),
    }
}

/// Reads histories with several threads. The result has the order of `ended`.
fn histories(
    folder: &CampaignFolder,
    campaign: &Campaign,
    ended: &[(usize, PathBuf)],
    threads: usize,
) -> Vec<Result<History, CampaignError>> {
    let part = ended.len().div_ceil(threads).max(1);
    thread::scope(|scope| {
        let parts = ended.chunks(part).map(|part| {
            scope.spawn(move || {
                let key = |index: usize| &campaign.rows[index].content_key;
                let results = part
                    .iter()
                    .map(|(index, path)| history(folder, path, key(*index)));
                results.collect::<Vec<_>>()
            })
        });
        let parts: Vec<_> = parts.collect();
        let parts = parts.into_iter().map(|part| part.join());
        parts
            .flat_map(|part| part.expect("reading does not panic"))
            .collect()
    })
}

impl CampaignFolder {
    /// Returns the indices of the runs that are in shards.
    ///
    /// # Errors
    /// [`CampaignError::Damaged`], [`CampaignError::Io`].
    pub fn collected(&self, campaign: &Campaign) -> Result<BTreeSet<usize>, CampaignError> {
        let mut collected_rows = BTreeSet::new();
        for shard in shards(self)? {
            let bytes = match self.read(&shard, LONGEST_TABLE) {
                Err(CampaignError::Io { source, .. }) if !is_read_failure(&source) => {
                    return Err(shard_error(&shard, source));
                }
                bytes => bytes?,
            };
            for run in shard_ranges(&bytes, &shard, campaign)?
                .into_iter()
                .flat_map(|[first, last]| first..=last)
            {
                if !collected_rows.insert(run) {
                    let reason = format!("it holds row {run}, which another shard also holds");
                    return Err(shard_error(&shard, reason));
                }
            }
        }
        Ok(collected_rows)
    }

    /// Appends the runs that have ended since the last collection.
    ///
    /// # Errors
    /// [`CampaignError::Locked`], [`CampaignError::Io`], [`CampaignError::Damaged`] for a shard that cannot be read.
    pub fn collect(&self, campaign: &Campaign) -> Result<CollectionSummary, CampaignError> {
        let _guard = self.lock()?;
        let before = self.collected(campaign)?;
        let mut ended = self.all_ended()?;
        ended.retain(|(index, _)| *index < campaign.rows.len() && !before.contains(index));
        let mut next = match shards(self)?.last().and_then(|last| number_of(last)) {
            Some(last) => last + 1,
            None => 0,
        };
        let mut collected = CollectionSummary {
            total: before.len(),
            ..CollectionSummary::default()
        };
        let threads = thread::available_parallelism().map_or(1, usize::from);
        let mut gathered = ShardBuilder::default();
        for group in ended.chunks(AT_ONCE * threads) {
            for ((index, _), read) in group.iter().zip(histories(self, campaign, group, threads)) {
                match read {
                    Ok(history) => gathered.add(*index, &history),
                    Err(CampaignError::Damaged { path, reason }) => {
                        collected.damaged.push((path, reason));
                    }
                    Err(error) => collected.unread.push(error),
                }
            }
            if gathered.index.len() >= ROWS_OF_A_SHARD {
                self.append(
                    &mut next,
                    campaign,
                    std::mem::take(&mut gathered),
                    &mut collected,
                )?;
            }
        }
        if !gathered.runs.is_empty() {
            self.append(&mut next, campaign, gathered, &mut collected)?;
        }
        Ok(collected)
    }

    fn append(
        &self,
        next: &mut u64,
        campaign: &Campaign,
        gathered: ShardBuilder,
        collected: &mut CollectionSummary,
    ) -> Result<(), CampaignError> {
        let path = self
            .root
            .join(COLLECTED)
            .join(format!("shard-{next:05}.parquet"));
        let bytes = gathered
            .to_bytes(campaign)
            .map_err(|source| CampaignError::Table {
                path: path.clone(),
                source: Box::new(source),
            })?;
        self.replace(&path, &bytes)?;
        *next += 1;
        collected.runs += gathered.runs.len();
        collected.total += gathered.runs.len();
        collected.shards.push(path);
        Ok(())
    }

    /// Concatenates the wanted columns of all shards. Columns that no shard has are missing from the result.
    ///
    /// # Errors
    /// [`CampaignError::Damaged`], [`CampaignError::Io`].
    pub(super) fn scan(
        &self,
        campaign: &Campaign,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<BTreeMap<String, Nullable>, CampaignError> {
        let mut all: BTreeMap<String, Nullable> = BTreeMap::new();
        let mut rows = 0;
        for shard in shards(self)? {
            let bytes = self.read(&shard, LONGEST_TABLE)?;
            shard_ranges(&bytes, &shard, campaign)?;
            let shard_columns = columns_from_parquet(&bytes, NAME, MOST_ROWS, wanted)
                .map_err(|error| shard_error(&shard, error))?;
            let shard_rows = shard_columns.first().map_or(0, |(_, values)| values.len());
            for (name, values) in shard_columns {
                match all.get_mut(&name) {
                    Some(column) => column.append(&values),
                    None => {
                        let mut column = values.clone();
                        column.resize(0);
                        column.resize(rows);
                        column.append(&values);
                        all.insert(name, column);
                    }
                }
            }
            rows += shard_rows;
            all.values_mut().for_each(|values| values.resize(rows));
        }
        Ok(all)
    }
}

fn number_of(shard: &Path) -> Option<u64> {
    let name = shard.file_stem()?.to_str()?;
    name.strip_prefix("shard-")?.parse().ok()
}
