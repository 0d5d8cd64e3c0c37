//! Speed against accuracy: the runs of the variants of a scene as one table, and what follows from it.
//!
//! Costs are read from the tables of the runs, never from a clock, so that a trade that was interrupted, or is read again, gives
//! the same numbers. Errors are against the variant `reference`.

mod chart;
mod figures;
mod findings;
mod page;

use std::path::{Path, PathBuf};

use super::output::replace;
use crate::scene::variants::{KnobKind, REFERENCE, Variant};
use crate::store::{Machine, StoreError};
use crate::tables::{Provenance, Table, TableBuilder, TableError, TableName, to_parquet};

pub use chart::chart;
pub use figures::{Bars, COUNT, FIELD, FIGURES, Figure, Values, WearField, deviation, field_error};
pub use findings::{Buy, Convergence, Cost, Findings, Kept, Saving, Step, findings};
pub use page::{html, markdown};

use figures::{Measured, errors, measure};

/// A variant that was run, or that failed.
#[derive(Debug, Clone)]
pub struct Trial {
    /// What it is.
    pub variant: Variant,
    /// Folder of its run.
    pub root: PathBuf,
    /// Peak of memory, counted from its recipe \[B\].
    pub memory: u64,
    /// Why it did not come to its end; none if it did.
    pub failure: Option<String>,
}

/// Cost and errors of one variant.
#[derive(Debug, Clone)]
pub struct Row {
    /// What it is.
    pub variant: Variant,
    /// Why it did not come to its end; none if it did.
    pub failure: Option<String>,
    /// Wall time of all its iterations \[s\].
    pub seconds: f64,
    /// Transform pairs of all its iterations.
    pub fft_pairs: f64,
    /// Peak of memory, counted from its recipe \[B\].
    pub memory: u64,
    /// Wear iterations.
    pub iterations: u64,
    /// True if no other row is both faster and more exact.
    pub pareto: bool,
    /// Its figures, in the order of [`FIGURES`]; none where it has no such figure, or failed.
    pub values: Values,
    /// Their errors against the reference.
    pub errors: Values,
    /// Its own error bars; none where it failed.
    pub bars: Bars,
    /// The largest error among the promised figures; none where one of those of the reference has no error, which compares with
    /// nothing.
    pub worst: Option<f64>,
    /// Its worn depths.
    pub field: Option<WearField>,
}

/// All variants of a scene.
#[derive(Debug, Clone)]
pub struct Trade {
    /// Name of the scene.
    pub name: String,
    /// One row a variant, in the order in which they were run.
    pub rows: Vec<Row>,
    /// What `balanced` has in place of each knob that is finer or coarser: knob, value, size.
    pub base: Vec<(&'static str, String, f64)>,
    /// The machine that the reference was computed on.
    pub machine: Option<Machine>,
    /// Hash of the reference's scene.
    pub scene_hash: String,
}

/// Runs that do not go into a table, or files that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum TradeError {
    /// A run.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A file that cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The chart.
    #[error("cannot draw the chart: {reason}")]
    Chart {
        /// What the drawing library says.
        reason: String,
    },
}

/// Reads the runs of the variants of a scene, and compares them with the reference among them.
///
/// # Errors
/// [`TradeError::Store`] for a run that cannot be read.
pub fn trade(
    name: &str,
    trials: Vec<Trial>,
    base: Vec<(&'static str, String, f64)>,
) -> Result<Trade, TradeError> {
    let mut reference = None;
    let mut measured = Vec::with_capacity(trials.len());
    for trial in trials {
        let mut found = measure(&trial.root)?;
        if trial.failure.is_some() {
            // Where it broke off is no result of it.
            (found.values, found.field, found.bars) = Default::default();
        } else if trial.variant.name == REFERENCE {
            reference = Some(found.clone());
        }
        measured.push((trial, found));
    }
    let against = reference.clone().unwrap_or_default();
    let mut rows: Vec<Row> = measured
        .into_iter()
        .map(|(trial, found)| row(trial, found, &against))
        .collect();
    let points: Vec<Option<(f64, f64)>> = rows
        .iter()
        .map(|row| {
            let comparable = row.variant.kind != KnobKind::Model;
            Some((row.seconds, row.worst?)).filter(|_| comparable)
        })
        .collect();
    for (row, on_front) in rows.iter_mut().zip(pareto(&points)) {
        row.pareto = on_front;
    }
    Ok(Trade {
        name: name.to_owned(),
        rows,
        base,
        machine: against.machine,
        scene_hash: against.scene_hash,
    })
}

fn row(trial: Trial, found: Measured, reference: &Measured) -> Row {
    let errors = errors(&found, reference);
    Row {
        worst: worst(&errors, reference),
        errors,
        variant: trial.variant,
        failure: trial.failure,
        seconds: found.seconds,
        fft_pairs: found.fft_pairs,
        memory: trial.memory,
        iterations: found.iterations,
        pareto: false,
        values: found.values,
        bars: found.bars,
        field: found.field,
    }
}

fn worst(errors: &Values, reference: &Measured) -> Option<f64> {
    let mut worst = None;
    for (k, figure) in FIGURES.iter().enumerate() {
        if figure.promised && reference.values[k].is_some() {
            worst = Some(errors[k]?.abs().max(worst.unwrap_or(0.0)));
        }
    }
    worst
}

/// Which of the points (cost, error) no other point beats: none is as good in both and better in one.
pub fn pareto(points: &[Option<(f64, f64)>]) -> Vec<bool> {
    let beats =
        |a: &(f64, f64), b: &(f64, f64)| a.0 <= b.0 && a.1 <= b.1 && (a.0 < b.0 || a.1 < b.1);
    points
        .iter()
        .map(|point| {
            point
                .as_ref()
                .is_some_and(|point| !points.iter().flatten().any(|other| beats(other, point)))
        })
        .collect()
}

impl Trade {
    /// The row of a variant.
    pub fn row(&self, name: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.variant.name == name)
    }

    /// True where some row has this figure.
    pub fn has(&self, figure: usize) -> bool {
        let of_field = |row: &Row| figure == FIELD && row.field.is_some();
        self.rows
            .iter()
            .any(|row| row.values[figure].is_some() || of_field(row))
    }

    /// The table `trade`: figures that no variant has, have no column.
    ///
    /// # Errors
    /// [`TradeError::Table`]
    pub fn table(&self) -> Result<Table, TradeError> {
        let text = |of: fn(&Row) -> &str| -> Vec<String> {
            self.rows.iter().map(|row| of(row).to_owned()).collect()
        };
        let float = |of: fn(&Row) -> f64| -> Vec<f64> { self.rows.iter().map(of).collect() };
        let integer = |of: fn(&Row) -> i64| -> Vec<i64> { self.rows.iter().map(of).collect() };
        let flag = |of: fn(&Row) -> bool| -> Vec<bool> { self.rows.iter().map(of).collect() };
        let table = Table::builder(TableName::Trade)
            .column("variant", text(|row| &row.variant.name))
            .column("knob", text(|row| row.variant.knob))
            .column("value", text(|row| &row.variant.value))
            .column("done", flag(|row| row.failure.is_none()))
            .column("message", text(|row| row.failure.as_deref().unwrap_or("")))
            .column("seconds", float(|row| row.seconds))
            .column("fft_pairs", float(|row| row.fft_pairs))
            .column("memory", integer(|row| row.memory as i64))
            .column("iterations", integer(|row| row.iterations as i64))
            .column("pareto", flag(|row| row.pareto));
        let add = |mut table: TableBuilder, prefix: &str, of: fn(&Row) -> &Values| {
            for (k, figure) in FIGURES.iter().enumerate() {
                let values: Vec<Option<f64>> = self.rows.iter().map(|row| of(row)[k]).collect();
                let absent = prefix.is_empty() && k == FIELD;
                let values = (self.has(k) && !absent).then_some(values);
                table = table.maybe(&format!("{prefix}{}", figure.name), values);
            }
            table
        };
        let table = add(table, "", |row| &row.values);
        let table = add(table, "error_", |row| &row.errors);
        let bars = |of: fn(&Bars) -> Option<f64>| {
            let bars: Vec<Option<f64>> = self.rows.iter().map(|row| of(&row.bars)).collect();
            bars.iter().any(Option::is_some).then_some(bars)
        };
        let table = table
            .maybe("bar_wear_volume", bars(|bars| bars.volume))
            .maybe("bar_closure", bars(|bars| bars.closure));
        Ok(table.build()?)
    }

    /// Writes `trade.parquet`, `trade.md`, `trade.svg` and `trade.html` into a folder. Files that are there are replaced.
    ///
    /// # Errors
    /// [`TradeError`] for a file that cannot be made or written.
    pub fn write(&self, folder: &Path, left_out: &[(String, String)]) -> Result<(), TradeError> {
        let provenance = Provenance {
            scene_hash: self.scene_hash.clone(),
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
        };
        std::fs::create_dir_all(folder).map_err(|source| TradeError::Io {
            path: folder.to_owned(),
            source,
        })?;
        let found = findings(self);
        let svg = chart(self)?;
        let files: [(&str, Vec<u8>); 4] = [
            ("trade.parquet", to_parquet(&self.table()?, &provenance)?),
            ("trade.md", markdown(self, &found, left_out).into_bytes()),
            (
                "trade.html",
                html(self, &found, left_out, &svg).into_bytes(),
            ),
            ("trade.svg", svg.into_bytes()),
        ];
        for (name, bytes) in files {
            let path = folder.join(name);
            replace(&path, &bytes).map_err(|source| TradeError::Io { path, source })?;
        }
        Ok(())
    }
}
