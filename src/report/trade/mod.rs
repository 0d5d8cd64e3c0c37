//! Speed against accuracy: the runs of the variants of a scene, or of the presets over many scenes, as one table, and what follows from it.
//!
//! Costs are read from the tables of the runs, never from a clock, so that a trade that was interrupted, or is read again, gives
//! the same numbers. Errors are against the variant `reference`, whose own is not known.

mod chart;
mod figures;
mod findings;
mod page;
mod scenes;

use std::path::{Path, PathBuf};

use super::output::replace;
use crate::recipe::MotionKind;
use crate::scene::variants::{AGAIN, BALANCED, KnobKind, REFERENCE, Variant};
use crate::store::{Machine, StoreError};
use crate::tables::{Provenance, Table, TableError, TableName, to_parquet};

pub use figures::{
    COUNT, FIELD, FIGURES, Figure, Values, WearField, deviation, field_error, noise,
};
pub use findings::{Convergence, Findings, KnobEffect, PresetPromise, Saving, Step, findings};
pub use page::{Page, page, page_of_scenes};
pub use scenes::{FigureCount, Miss, Tally, misses, tallies};

use figures::{MeasuredVariant, errors, measure, work_of_pair};

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

/// What variants are compared by. Pairs are exact; seconds are noisy, and all there is where a structure vibrates too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cost {
    /// Transform pairs; those on another grid than that of `balanced` count by the work of one there.
    FftPairs,
    /// CPU time, or that of the wall where no CPU time is told \[s\].
    Seconds,
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
    /// CPU time of them \[s\]; none where a run does not tell it.
    pub cpu_seconds: Option<f64>,
    /// Transform pairs of all its iterations.
    pub fft_pairs: f64,
    /// What it is compared by, in what [`Trade::by`] says.
    pub cost: f64,
    /// Peak of memory, counted from its recipe \[B\].
    pub memory: u64,
    /// Wear iterations.
    pub iterations: u64,
    /// True if no other row, the reference aside, costs less and is more exact.
    pub pareto: bool,
    /// Its figures, in the order of [`FIGURES`]; none where it has no such figure, or failed.
    pub values: Values,
    /// Their errors against the reference.
    pub errors: Values,
    /// Its own error bars of them, relative; none where it failed.
    pub bars: Values,
    /// The part of the bar of the volume by what the fine contact dissipates beyond its contact elements; none without vibration.
    pub closure: Option<f64>,
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
    /// What kind of motion wears it.
    pub motion: MotionKind,
    /// One row a variant, in the order in which they were run.
    pub rows: Vec<Row>,
    /// What `balanced` has in place of each knob that is finer or coarser: knob, value, size.
    pub base: Vec<(&'static str, String, f64)>,
    /// What its variants are compared by.
    pub by: Cost,
    /// How far the seconds of two equal runs are apart, in parts of them; none where `balanced` was not run again.
    pub noise: Option<f64>,
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
}

/// Reads the runs of the variants of a scene, and compares them with the reference among them.
///
/// # Errors
/// [`TradeError::Store`] for a run that cannot be read.
pub fn trade(
    name: &str,
    motion: MotionKind,
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
            found.closure = None;
        } else if trial.variant.name == REFERENCE {
            reference = Some(found.clone());
        }
        measured.push((trial, found));
    }
    let against = reference.unwrap_or_default();
    let of = |name: &str| -> Option<&MeasuredVariant> {
        let mut named = measured.iter().filter(|(trial, _)| trial.failure.is_none());
        let (_, found) = named.find(|(trial, _)| trial.variant.name == name)?;
        Some(found)
    };
    let noise = of(BALANCED).zip(of(AGAIN));
    let noise = noise.and_then(|(one, other)| figures::noise(&one.each, &other.each));
    let all = || measured.iter().map(|(_, found)| found);
    let by = if all().any(|found| found.vibrates) || all().all(|found| found.fft_pairs == 0.0) {
        Cost::Seconds
    } else {
        Cost::FftPairs
    };
    let unit = of(BALANCED).and_then(|found| found.cells).map(work_of_pair);
    let cpu = all().all(|found| found.cpu_seconds.is_some());
    let cost = |found: &MeasuredVariant| match by {
        Cost::Seconds => found.cpu_seconds.filter(|_| cpu).unwrap_or(found.seconds),
        Cost::FftPairs => {
            let work = found.cells.map(work_of_pair).zip(unit);
            found.fft_pairs * work.map_or(1.0, |(work, unit)| work / unit)
        }
    };
    let costs: Vec<f64> = all().map(cost).collect();
    let mut rows: Vec<Row> = measured
        .into_iter()
        .zip(costs)
        .map(|((trial, found), cost)| row(trial, found, cost, &against))
        .collect();
    let points: Vec<Option<(f64, f64)>> = rows
        .iter()
        .map(|row| Some((row.cost, row.worst?)).filter(|_| row.is_compared()))
        .collect();
    for (row, on_front) in rows.iter_mut().zip(pareto(&points)) {
        row.pareto = on_front;
    }
    Ok(Trade {
        name: name.to_owned(),
        motion,
        rows,
        base,
        by,
        noise,
        machine: against.machine,
        scene_hash: against.scene_hash,
    })
}

fn row(trial: Trial, found: MeasuredVariant, cost: f64, reference: &MeasuredVariant) -> Row {
    let errors = errors(&found, reference);
    Row {
        worst: worst(&errors, reference),
        errors,
        variant: trial.variant,
        failure: trial.failure,
        seconds: found.seconds,
        cpu_seconds: found.cpu_seconds,
        fft_pairs: found.fft_pairs,
        cost,
        memory: trial.memory,
        iterations: found.iterations,
        pareto: false,
        values: found.values,
        bars: found.bars,
        closure: found.closure,
        field: found.field,
    }
}

fn worst(errors: &Values, reference: &MeasuredVariant) -> Option<f64> {
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

impl Row {
    /// True if its error and cost are those of a way to solve the same model: not the reference, nor `balanced` again.
    pub fn is_compared(&self) -> bool {
        let kind = self.variant.kind;
        self.variant.name != REFERENCE && !matches!(kind, KnobKind::Model | KnobKind::Repeat)
    }
}

impl Trade {
    /// The row of a variant.
    pub fn row(&self, name: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.variant.name == name)
    }

    /// The row of the reference, if it came to its end.
    pub fn reference(&self) -> Option<&Row> {
        self.row(REFERENCE).filter(|row| row.failure.is_none())
    }

    /// True where some row has this figure.
    pub fn has(&self, figure: usize) -> bool {
        let of_field = |row: &Row| figure == FIELD && row.field.is_some();
        self.rows
            .iter()
            .any(|row| row.values[figure].is_some() || of_field(row))
    }

    /// True if the CPU time of all rows is told.
    pub fn has_cpu(&self) -> bool {
        self.rows.iter().all(|row| row.cpu_seconds.is_some())
    }

    /// Whether a figure of a row lies within its own error bar of that of the reference; none where there is no such figure or bar.
    pub fn within(&self, row: &Row, figure: usize) -> Option<bool> {
        let (value, bar) = (row.values[figure]?, row.bars[figure]?);
        let exact = self.reference()?.values[figure]?;
        Some(value == exact || (value - exact).abs() <= bar * value.abs())
    }
}

/// The table `trade` of one scene or of several: figures that no variant has, have no column.
///
/// # Errors
/// [`TradeError::Table`]
pub fn table(trades: &[Trade]) -> Result<Table, TradeError> {
    let rows = || (trades.iter()).flat_map(|trade| trade.rows.iter().map(move |row| (trade, row)));
    let text = |of: for<'a> fn(&'a Trade, &'a Row) -> &'a str| -> Vec<String> {
        rows().map(|(t, row)| of(t, row).to_owned()).collect()
    };
    let float = |of: fn(&Row) -> f64| -> Vec<f64> { rows().map(|(_, row)| of(row)).collect() };
    let maybe = |of: &dyn Fn(&Trade, &Row) -> Option<f64>| -> Vec<Option<f64>> {
        rows().map(|(trade, row)| of(trade, row)).collect()
    };
    let integer =
        |of: fn(&Row) -> u64| -> Vec<i64> { rows().map(|(_, row)| of(row) as i64).collect() };
    let flag = |of: fn(&Row) -> bool| -> Vec<bool> { rows().map(|(_, row)| of(row)).collect() };
    let relative = |trade: &Trade, row: &Row| {
        let balanced = trade.row(BALANCED)?.cost;
        Some(row.cost / balanced).filter(|part| part.is_finite())
    };
    let mut table = Table::builder(TableName::Trade)
        .column("scene", text(|trade, _| &trade.name))
        .column("motion", text(|trade, _| trade.motion.word()))
        .column("variant", text(|_, row| &row.variant.name))
        .column("knob", text(|_, row| row.variant.knob))
        .column("value", text(|_, row| &row.variant.value))
        .column("done", flag(|row| row.failure.is_none()))
        .column(
            "message",
            text(|_, row| row.failure.as_deref().unwrap_or("")),
        )
        .column("seconds", float(|row| row.seconds))
        .column("cpu_seconds", maybe(&|_, row| row.cpu_seconds))
        .column("fft_pairs", float(|row| row.fft_pairs))
        .column("relative_cost", maybe(&relative))
        .column("memory", integer(|row| row.memory))
        .column("iterations", integer(|row| row.iterations))
        .column("pareto", flag(|row| row.pareto))
        .column("error_promised", maybe(&|_, row| row.worst));
    type Of = fn(&Row) -> &Values;
    let of_figures: [(&str, Of); 3] = [
        ("", |row| &row.values),
        ("error_", |row| &row.errors),
        ("bar_", |row| &row.bars),
    ];
    for (prefix, of) in of_figures {
        for (k, figure) in FIGURES.iter().enumerate() {
            // The field is no number, and has an error only.
            if k == FIELD && prefix != "error_" {
                continue;
            }
            let known = trades.iter().any(|trade| trade.has(k));
            let values = known.then(|| maybe(&|_, row| of(row)[k]));
            table = table.maybe(&format!("{prefix}{}", figure.name), values);
        }
    }
    let closure = rows().any(|(_, row)| row.closure.is_some());
    let closure = closure.then(|| maybe(&|_, row| row.closure));
    Ok(table.maybe("bar_closure", closure).build()?)
}

/// Writes `trade.parquet` of one scene or of several, and `trade.md`, `trade.svg` and `trade.html` of their page, into a folder. Files that
/// are there are replaced.
///
/// # Errors
/// [`TradeError`] for a file that cannot be made or written.
pub fn write(folder: &Path, trades: &[Trade], page: &Page) -> Result<(), TradeError> {
    let provenance = Provenance {
        // Several scenes have no hash together.
        scene_hash: match trades {
            [trade] => trade.scene_hash.clone(),
            _ => String::new(),
        },
        program_version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    std::fs::create_dir_all(folder).map_err(|source| TradeError::Io {
        path: folder.to_owned(),
        source,
    })?;
    let files = [
        ("trade.parquet", to_parquet(&table(trades)?, &provenance)?),
        ("trade.md", page.markdown().into_bytes()),
        ("trade.svg", page.svg().into_bytes()),
        ("trade.html", page.html().into_bytes()),
    ];
    for (name, bytes) in files {
        let path = folder.join(name);
        replace(&path, &bytes).map_err(|source| TradeError::Io { path, source })?;
    }
    Ok(())
}
