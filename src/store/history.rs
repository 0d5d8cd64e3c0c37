//! `history.parquet`: one row per iteration of a run, pruned iterations included.
//!
//! The row of an iteration contains the columns of the one-row tables and the hash of the commit. The row also contains
//! the time and the number of transform pairs of each stage. A column of `summary` has the same name in
//! `history.parquet`. For a column of another table, the name begins with the name of the table. The row of a pruned
//! iteration connects the chain of commits over the pruned iteration. The row of a kept iteration follows from the
//! folder of the iteration. `history.parquet` may lack the last rows, and the store computes the missing rows from the
//! folders of the kept iterations.
//!
//! `history.parquet` ends with a text that contains the hash of the file. For the computation of the hash, zeros
//! replace the hash in the text.

use super::commit::Commit;
use super::error::{Damage, DamageKind, StoreError};
use super::files::{Files, LONGEST_TABLE, hash};
use super::layout::Layout;
use super::record::Pruned;
use crate::tables::{
    ColumnSchema, ColumnType, DescribedColumn, Nullable, Table, TableBuilder, TableError,
    TableLocation, TableName, TypedTable, metadata_entry, nullable_from_parquet,
    nullable_to_parquet, typed,
};
use serde_json::json;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Number of rows up to which the file is written after every commit. The time of a write is proportional to the number
/// of rows. The store writes a long file less often, so that the share of the run time stays the same.
const ROWS_AT_ONCE: u64 = 1024;

/// Upper bound of the wear iterations of any run.
const MOST_ROWS: i64 = 1 << 24;

const NAME: &str = "history";
const WEAR_ITERATION: &str = "wear_iteration";
const COMMIT: &str = "commit";
const PRUNED: &str = "pruned";
const BYTES: &str = "bytes";
/// Metadata entry with the content key of a campaign's row.
const ROW: &str = "content_key";
const TIMING: [&str; 3] = [
    "timing_seconds_",
    "timing_fft_pairs_",
    "timing_cpu_seconds_",
];

/// Text before the hash, and the placeholder while the hash is computed.
const BEFORE_SEAL: &[u8] = b"\"seal\":\"";
const NO_SEAL: [u8; 64] = [b'0'; 64];

/// The one-row tables of all iterations of a run, from 0 on without a gap.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct History {
    links: Vec<Link>,
    /// By column name in the file. Each column has one value or null per row.
    columns: BTreeMap<String, Nullable>,
}

/// Place of an iteration in the chain.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Link {
    /// Hash of the commit.
    commit: String,
    pruned: bool,
    /// Bytes of the tables, if known.
    bytes: Option<i64>,
}

/// Cost of a stage, or of a part of one, in one or several iterations.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StageCost {
    /// Wall time \[s\].
    pub seconds: f64,
    /// Forward and inverse transform pairs.
    pub fft_pairs: f64,
    /// CPU time of all threads \[s\]; `None` if the system does not report it per iteration.
    pub cpu_seconds: Option<f64>,
}

/// A column of a one-row table, and its name in a history.
struct HistoryColumn {
    name: String,
    table: TableName,
    column: ColumnSchema,
}

/// All columns of one-row tables in the order of the file.
static HISTORY_COLUMNS: LazyLock<Vec<HistoryColumn>> = LazyLock::new(|| {
    let one_row = |table: &TableName| {
        table.schema().place == TableLocation::Iteration && table.schema().rows == Some(1)
    };
    let mut tables: Vec<TableName> = TableName::ALL.into_iter().filter(one_row).collect();
    tables.sort_by_key(|table| *table != TableName::Summary);
    let columns = tables.into_iter().flat_map(|table| {
        table
            .schema()
            .columns
            .iter()
            .map(move |column| HistoryColumn {
                name: history_name(table, &column.name),
                table,
                column: column.clone(),
            })
    });
    columns.collect()
});

fn history_name(table: TableName, column: &str) -> String {
    match table {
        TableName::Summary => column.to_owned(),
        table => format!("{table}_{column}"),
    }
}

/// True for a table whose rows are part of a history.
pub fn is_in_history(table: TableName) -> bool {
    HISTORY_COLUMNS
        .iter()
        .any(|history_column| history_column.table == table)
}

impl History {
    /// Number of rows. The rows belong to the iterations from 0 on.
    pub fn len(&self) -> usize {
        self.links.len()
    }

    /// True for a run without iterations.
    pub fn is_empty(&self) -> bool {
        self.links.is_empty()
    }

    /// Returns the one-row table `T` of an iteration; `None` if the iteration has no table `T`.
    ///
    /// # Errors
    /// [`TableError`] for a row that lacks a column.
    pub fn row<T: TypedTable>(&self, wear_iteration: u64) -> Result<Option<T>, TableError> {
        let mut table: Option<TableBuilder> = None;
        for (column, values) in self.columns_of(T::TABLE) {
            if let Some(value) = values.at(wear_iteration as usize) {
                let builder = table.unwrap_or_else(|| Table::builder(T::TABLE));
                table = Some(builder.column(&column.name, value));
            }
        }
        let table = table.map(TableBuilder::build).transpose()?;
        table.map(|table| T::of(&table)).transpose()
    }

    /// The columns of a one-row table over all iterations, by the names of its schema. Columns without any value are
    /// skipped.
    pub fn columns_of(&self, table: TableName) -> impl Iterator<Item = DescribedColumn<'_>> {
        HISTORY_COLUMNS
            .iter()
            .filter(move |history_column| history_column.table == table)
            .filter_map(|history_column| {
                Some((
                    &history_column.column,
                    self.columns.get(&history_column.name)?,
                ))
            })
    }

    /// Returns the columns of `history.parquet` in alphabetical order, without the columns of the commit chain.
    pub fn columns(&self) -> impl Iterator<Item = (ColumnSchema, &Nullable)> {
        self.columns.iter().map(|(name, values)| {
            let column = match is_timing(name) {
                true => timing_column(name),
                false => in_file(name).clone(),
            };
            (column, values)
        })
    }

    /// Sums the cost of all iterations per stage and per part of a stage, by the names of the `timing` table.
    pub fn cost(&self) -> BTreeMap<String, StageCost> {
        let mut costs: BTreeMap<String, StageCost> = BTreeMap::new();
        for (name, values) in &self.columns {
            let Nullable::F64(values) = values else {
                continue;
            };
            let sum = values.iter().flatten().sum::<f64>();
            if let Some(stage) = name.strip_prefix(TIMING[0]) {
                costs.entry(stage.to_owned()).or_default().seconds = sum;
            } else if let Some(stage) = name.strip_prefix(TIMING[1]) {
                costs.entry(stage.to_owned()).or_default().fft_pairs = sum;
            } else if let Some(stage) = name.strip_prefix(TIMING[2]) {
                let wall = self.columns.get(&format!("{}{stage}", TIMING[0]));
                let is_complete = matches!(wall, Some(Nullable::F64(wall)) if (wall.iter().zip(values))
                    .all(|(wall, cpu)| wall.is_none() || cpu.is_some()));
                costs.entry(stage.to_owned()).or_default().cpu_seconds = is_complete.then_some(sum);
            }
        }
        costs
    }

    /// Wall time \[s\] of an iteration, per stage and per part of a stage.
    pub fn seconds(&self, wear_iteration: u64) -> BTreeMap<String, f64> {
        self.timing(TIMING[0], wear_iteration).collect()
    }

    /// Forward and inverse transform pairs of an iteration, summed over all stages.
    pub fn fft_pairs(&self, wear_iteration: u64) -> f64 {
        self.timing(TIMING[1], wear_iteration).map(|(_, n)| n).sum()
    }

    /// A column of the `timing` table of an iteration, per stage and per part of a stage.
    fn timing(&self, prefix: &str, wear_iteration: u64) -> impl Iterator<Item = (String, f64)> {
        self.columns.iter().filter_map(move |(name, values)| {
            let Nullable::F64(values) = values else {
                return None;
            };
            let value = values.get(wear_iteration as usize).copied()??;
            Some((name.strip_prefix(prefix)?.to_owned(), value))
        })
    }

    /// Returns each pruned iteration with the hash of the commit and the hash of the previous commit.
    pub(super) fn pruned(&self) -> BTreeMap<u64, Pruned> {
        let links = self.links.iter().enumerate();
        links
            .filter(|(_, link)| link.pruned)
            .map(|(k, link)| {
                let previous = k.checked_sub(1).map(|previous| &self.links[previous]);
                let parent = previous.map(|previous| previous.commit.clone());
                let hash = link.commit.clone();
                (k as u64, Pruned { hash, parent })
            })
            .collect()
    }

    /// Returns the hash of an iteration's commit.
    pub fn commit_of(&self, wear_iteration: u64) -> Option<&str> {
        let link = self.links.get(wear_iteration as usize)?;
        Some(&link.commit)
    }

    /// Removes the last rows of the history, so that at most `rows` rows remain.
    pub(super) fn truncate(&mut self, rows: usize) {
        if rows < self.links.len() {
            self.links.truncate(rows);
            self.columns
                .values_mut()
                .for_each(|column| column.resize(rows));
        }
    }

    /// Appends the row of the next iteration, from its commit and from its tables that belong to the history.
    pub(super) fn push(&mut self, commit: &Commit, tables: &[(TableName, Table)]) {
        let rows = self.links.len();
        self.links.push(Link {
            commit: commit.hash.clone(),
            pruned: false,
            bytes: Some(commit.bytes() as i64),
        });
        for (name, table) in tables {
            for (column, values) in table.columns() {
                self.column(history_name(*name, &column.name), column.kind, rows)
                    .push(values);
            }
        }
        self.fill();
    }

    /// Adds the times to the last row.
    pub(super) fn push_timing(&mut self, timing: &typed::Timing) {
        let rows = self.links.len() - 1;
        let all_some = |values: &[f64]| values.iter().map(|value| Some(*value)).collect();
        let series: [Vec<Option<f64>>; 3] = [
            all_some(&timing.seconds),
            all_some(&timing.fft_pairs),
            timing.cpu_seconds.clone(),
        ];
        for (prefix, values) in TIMING.into_iter().zip(series) {
            let mut sums: BTreeMap<&str, Option<f64>> = BTreeMap::new();
            for (stage, value) in timing.stage.iter().zip(values) {
                let sum = sums.entry(stage).or_insert(Some(0.0));
                *sum = sum.zip(value).map(|(sum, value)| sum + value);
            }
            for (stage, sum) in sums
                .into_iter()
                .filter_map(|(stage, sum)| Some((stage, sum?)))
            {
                let column = self.column(format!("{prefix}{stage}"), ColumnType::F64, rows);
                column.resize(rows);
                column.push(&vec![sum].into());
            }
        }
        self.fill();
    }

    /// Appends the row of a pruned iteration of which only the commit hash is known.
    pub(super) fn push_pruned(&mut self, hash: &str) {
        self.links.push(Link {
            commit: hash.to_owned(),
            pruned: true,
            bytes: None,
        });
        self.fill();
    }

    /// Marks iterations as pruned.
    pub(super) fn prune(&mut self, iterations: &[u64]) {
        for &k in iterations {
            if let Some(link) = self.links.get_mut(k as usize) {
                link.pruned = true;
            }
        }
    }

    /// True if an iteration is pruned. After pruning, the folders no longer contain the whole content of the history.
    pub(super) fn has_pruned(&self) -> bool {
        self.links.iter().any(|link| link.pruned)
    }

    /// True if the file has to be written after the commit of the last row. The interval grows with the run, so that
    /// writing takes a constant share of the time.
    pub(super) fn is_due(&self) -> bool {
        let rows = self.links.len() as u64;
        let interval = (rows / ROWS_AT_ONCE).max(1).next_power_of_two();
        rows.is_multiple_of(interval)
    }

    fn column(&mut self, name: String, kind: ColumnType, rows: usize) -> &mut Nullable {
        let column = self.columns.entry(name);
        column.or_insert_with(|| Nullable::absent(kind, rows))
    }

    /// Extends every column to the number of rows.
    fn fill(&mut self) {
        let rows = self.links.len();
        self.columns
            .values_mut()
            .for_each(|column| column.resize(rows));
    }

    /// Encodes the history as the content of `history.parquet`, with the hash of the file at the end.
    ///
    /// # Errors
    /// [`TableError`] if the Parquet library fails.
    pub fn to_bytes(&self) -> Result<Vec<u8>, TableError> {
        self.to_bytes_of(None)
    }

    /// Encodes the file with the content key of a campaign row, which [`History::row_in`] reads.
    ///
    /// # Errors
    /// As [`History::to_bytes`].
    pub fn to_bytes_of(&self, row: Option<&str>) -> Result<Vec<u8>, TableError> {
        let own = own_columns();
        let links = self.links.iter();
        let own_values = [
            Nullable::I64((0..self.len()).map(|k| Some(k as i64)).collect()),
            Nullable::Text(
                links
                    .clone()
                    .map(|link| Some(link.commit.clone()))
                    .collect(),
            ),
            Nullable::Bool(links.clone().map(|link| Some(link.pruned)).collect()),
            Nullable::I64(links.map(|link| link.bytes).collect()),
        ];
        let mut columns: Vec<DescribedColumn> = own.iter().zip(&own_values).collect();
        for HistoryColumn { name, .. } in HISTORY_COLUMNS.iter() {
            columns.extend(self.columns.get(name).map(|values| (in_file(name), values)));
        }
        let timing = self.columns.iter().filter(|(name, _)| is_timing(name));
        let timing: Vec<(ColumnSchema, &Nullable)> = timing
            .map(|(name, values)| (timing_column(name), values))
            .collect();
        columns.extend(timing.iter().map(|(column, values)| (column, *values)));
        let units: BTreeMap<&str, serde_json::Value> = columns
            .iter()
            .map(|(column, _)| (column.name.as_str(), json!({ "unit": column.unit })))
            .collect();
        let mut entry = json!({
            "schema": NAME,
            "program_version": env!("CARGO_PKG_VERSION"),
            "columns": units,
        });
        if let Some(row) = row {
            entry[ROW] = json!(row);
        }
        // The seal comes last and is appended as text, because a JSON object need not keep the order of its keys.
        let mut entry = entry.to_string();
        entry.truncate(entry.len() - 1);
        entry += ",";
        entry += &String::from_utf8_lossy(BEFORE_SEAL);
        entry += &String::from_utf8_lossy(&NO_SEAL);
        entry += "\"}";
        let mut bytes = nullable_to_parquet(NAME, &columns, entry)?;
        if let Some(place) = place_of_seal(&bytes) {
            let seal = hash(&bytes);
            bytes[place..place + NO_SEAL.len()].copy_from_slice(seal.as_bytes());
        }
        Ok(bytes)
    }

    /// Reads the content key of the campaign row from the bytes of a file. Returns `None` if the file has no content
    /// key.
    pub fn row_in(bytes: &[u8]) -> Option<String> {
        let entry = metadata_entry(bytes, NAME).ok().flatten()?;
        let entry: serde_json::Value = serde_json::from_str(&entry).ok()?;
        entry[ROW].as_str().map(str::to_owned)
    }

    /// Decodes a history from the bytes of a file.
    ///
    /// # Errors
    /// [`DamageKind`] for bytes that do not match their hash, and for another file.
    pub fn of_bytes(bytes: &[u8]) -> Result<History, DamageKind> {
        check_seal(bytes)?;
        let unreadable = |reason: String| DamageKind::Unreadable { reason };
        let file_columns = nullable_from_parquet(bytes, NAME, MOST_ROWS)
            .map_err(|error| unreadable(error.to_string()))?;
        let mut columns: BTreeMap<String, Nullable> = file_columns.into_iter().collect();
        let own = own_columns().map(|column| columns.remove(&column.name));
        let [
            Some(Nullable::I64(numbers)),
            Some(Nullable::Text(commits)),
            Some(Nullable::Bool(pruned)),
            Some(Nullable::I64(bytes)),
        ] = own
        else {
            return Err(unreadable("the file is not a history".to_owned()));
        };
        let mut links = Vec::with_capacity(numbers.len());
        for (k, number) in numbers.into_iter().enumerate() {
            let (Some(commit), Some(pruned)) = (&commits[k], pruned[k]) else {
                return Err(unreadable(format!("row {k} has no commit")));
            };
            if number != Some(k as i64) {
                return Err(unreadable(format!("row {k} belongs to another iteration")));
            }
            links.push(Link {
                commit: commit.clone(),
                pruned,
                bytes: bytes[k],
            });
        }
        for (name, values) in &columns {
            let history_column = HISTORY_COLUMNS
                .iter()
                .find(|history_column| history_column.name == *name);
            let kind = history_column.map(|history_column| history_column.column.kind);
            let kind = kind.or(is_timing(name).then_some(ColumnType::F64));
            if !kind.is_some_and(|kind| has_kind(values, kind)) {
                return Err(unreadable(format!("a history has no such column `{name}`")));
            }
        }
        Ok(History { links, columns })
    }
}

fn has_kind(values: &Nullable, kind: ColumnType) -> bool {
    std::mem::discriminant(values) == std::mem::discriminant(&Nullable::absent(kind, 0))
}

fn is_timing(name: &str) -> bool {
    TIMING.iter().any(|prefix| name.starts_with(prefix))
}

/// The columns of the history that belong to no table.
fn own_columns() -> [ColumnSchema; 4] {
    [
        ColumnSchema::plain(WEAR_ITERATION, ColumnType::I64, "1"),
        ColumnSchema::plain(COMMIT, ColumnType::Text, "1"),
        ColumnSchema::plain(PRUNED, ColumnType::Bool, "1"),
        ColumnSchema::plain(BYTES, ColumnType::I64, "B"),
    ]
}

fn timing_column(name: &str) -> ColumnSchema {
    let unit = if name.starts_with(TIMING[1]) {
        "1"
    } else {
        "s"
    };
    ColumnSchema::plain(name, ColumnType::F64, unit)
}

/// Returns a column of a one-row table, under its name in the file.
fn in_file(name: &str) -> &'static ColumnSchema {
    static IN_FILE: LazyLock<BTreeMap<String, ColumnSchema>> = LazyLock::new(|| {
        let columns = HISTORY_COLUMNS.iter().map(|column_of_table| {
            let name = column_of_table.name.clone();
            let column = ColumnSchema {
                name: name.clone(),
                ..column_of_table.column.clone()
            };
            (name, column)
        });
        columns.collect()
    });
    &IN_FILE[name]
}

fn place_of_seal(bytes: &[u8]) -> Option<usize> {
    let before = bytes.windows(BEFORE_SEAL.len());
    let place = before.rev().position(|window| window == BEFORE_SEAL)?;
    let place = bytes.len() - place;
    (place + NO_SEAL.len() <= bytes.len()).then_some(place)
}

fn check_seal(bytes: &[u8]) -> Result<(), DamageKind> {
    let Some(place) = place_of_seal(bytes) else {
        let reason = "the hash at its end is missing".to_owned();
        return Err(DamageKind::Unreadable { reason });
    };
    let mut unsealed = bytes.to_vec();
    let seal = &mut unsealed[place..place + NO_SEAL.len()];
    let expected = String::from_utf8_lossy(seal).into_owned();
    seal.copy_from_slice(&NO_SEAL);
    let found = hash(&unsealed);
    if found == expected {
        return Ok(());
    }
    Err(DamageKind::Hash { expected, found })
}

/// State of the history file on disk.
pub(super) enum HistoryFile {
    Sound(History),
    Absent,
    Damaged(Damage),
}

/// Reads the history of a run.
pub(super) fn read(files: &Files, layout: &Layout) -> Result<HistoryFile, StoreError> {
    let path = layout.history();
    Ok(match files.read_bounded(&path, LONGEST_TABLE)? {
        Ok(bytes) => match History::of_bytes(&bytes) {
            Ok(history) => HistoryFile::Sound(history),
            Err(kind) => HistoryFile::Damaged(Damage { path, kind }),
        },
        Err(damage) if damage.kind == DamageKind::Missing => HistoryFile::Absent,
        Err(damage) => HistoryFile::Damaged(damage),
    })
}

/// Writes the history of a run. `write` syncs the history file only after an iteration is pruned. Before the first
/// pruning, the folders contain the whole content of the history.
pub(super) fn write(files: &Files, layout: &Layout, history: &History) -> Result<(), StoreError> {
    let path = layout.history();
    let bytes = history.to_bytes().map_err(|source| StoreError::Table {
        path: path.clone(),
        source: Box::new(source),
    })?;
    files.require_space(&layout.root, bytes.len() as u64)?;
    match history.has_pruned() {
        true => files.replace(&path, &bytes),
        false => files.replace_unsynced(&path, &bytes),
    }
}
