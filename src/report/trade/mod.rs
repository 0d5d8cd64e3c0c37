//! Speed against accuracy: compares the runs of the variants of a scene, or of the presets over many scenes.
//!
//! Costs come from the tables of the runs, not from a clock. A trade that resumes after an interruption gives the same
//! numbers as before, because the tables of a run do not change. Errors are deviations from the variant `reference`,
//! whose own error is unknown.

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
pub use scenes::{FigureCount, Miss, PresetStatistics, misses, tallies};

use figures::{MeasuredVariant, errors, measure, work_of_pair};

/// Variant with the folder of its run, and the failure if the run failed.
#[derive(Debug, Clone)]
pub struct Trial {
    /// The variant.
    pub variant: Variant,
    /// Folder of the run.
    pub root: PathBuf,
    /// Peak memory, estimated from the recipe \[B\].
    pub memory: u64,
    /// Reason of the failure, or `None` if the run reached its end.
    pub failure: Option<String>,
}

/// Measure by which the costs of variants are compared.
///
/// Pairs are exact. Seconds are noisy, but the only complete measure if a structure vibrates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cost {
    /// FFT pairs. Pairs on another grid than that of `balanced` are weighted by their work.
    FftPairs,
    /// CPU time, or wall time if the CPU time is unknown \[s\].
    Seconds,
}

/// Cost and errors of a variant.
#[derive(Debug, Clone)]
pub struct Row {
    /// The variant.
    pub variant: Variant,
    /// Reason of the failure, or `None` if the run reached its end.
    pub failure: Option<String>,
    /// Wall time of all iterations \[s\].
    pub seconds: f64,
    /// CPU time of all iterations \[s\]. `None` if the run does not report it.
    pub cpu_seconds: Option<f64>,
    /// FFT pairs of all iterations.
    pub fft_pairs: f64,
    /// Cost in the measure [`Trade::cost_measure`].
    pub cost: f64,
    /// Peak memory, estimated from the recipe \[B\].
    pub memory: u64,
    /// Wear iterations.
    pub iterations: u64,
    /// True if the row is on the Pareto front: no other row (except the reference) costs less and is more exact.
    pub pareto: bool,
    /// Figures, in the order of [`FIGURES`]. `None` for a figure that the run lacks, and for a failed run.
    pub values: Values,
    /// Relative deviations of the figures from the reference.
    pub errors: Values,
    /// Relative error bars of the figures, from the run itself. `None` for a failed run.
    pub bars: Values,
    /// Part of the volume's error bar that comes from the closure: the rough contact dissipates more than its contact
    /// elements. `None` without vibration.
    pub closure: Option<f64>,
    /// Largest error of the promised figures. `None` if a promised figure of the reference has no error, which compares
    /// to nothing.
    pub largest_promised_error: Option<f64>,
    /// Worn depths.
    pub field: Option<WearField>,
}

/// Comparison of all variants of a scene.
#[derive(Debug, Clone)]
pub struct Trade {
    /// Name of the scene.
    pub name: String,
    /// Kind of the motion that wears the joint.
    pub motion: MotionKind,
    /// One row per variant, in the order of the runs.
    pub rows: Vec<Row>,
    /// Values of the discretisation knobs in `balanced`: knob, value, size.
    pub base: Vec<(&'static str, String, f64)>,
    /// Measure by which costs are compared.
    pub cost_measure: Cost,
    /// Relative difference of the seconds of two equal runs. `None` if `balanced` was not run again.
    pub noise: Option<f64>,
    /// Machine that computed the reference.
    pub machine: Option<Machine>,
    /// Hash of the reference's scene.
    pub scene_hash: String,
}

/// Error of reading the runs or of writing the files.
#[derive(Debug, thiserror::Error)]
pub enum TradeError {
    /// A run cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The table is invalid.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
}

/// Reads the runs of the variants of a scene, and compares them with the reference.
///
/// # Errors
/// [`TradeError::Store`] for a run that cannot be read.
pub fn compare_variants(
    name: &str,
    motion: MotionKind,
    trials: Vec<Trial>,
    base: Vec<(&'static str, String, f64)>,
) -> Result<Trade, TradeError> {
    let mut reference = None;
    let mut measured = Vec::with_capacity(trials.len());
    for trial in trials {
        let mut result = measure(&trial.root)?;
        if trial.failure.is_some() {
            // The last state of a failed run is not its result.
            (result.values, result.field, result.bars) = Default::default();
            result.closure = None;
        } else if trial.variant.name == REFERENCE {
            reference = Some(result.clone());
        }
        measured.push((trial, result));
    }
    let reference_result = reference.unwrap_or_default();
    let result_of = |name: &str| -> Option<&MeasuredVariant> {
        let mut finished = measured.iter().filter(|(trial, _)| trial.failure.is_none());
        let (_, result) = finished.find(|(trial, _)| trial.variant.name == name)?;
        Some(result)
    };
    let noise = result_of(BALANCED).zip(result_of(AGAIN));
    let noise = noise.and_then(|(one, other)| figures::noise(&one.each, &other.each));
    let all = || measured.iter().map(|(_, result)| result);
    let by = if all().any(|result| result.vibrates) || all().all(|result| result.fft_pairs == 0.0) {
        Cost::Seconds
    } else {
        Cost::FftPairs
    };
    let balanced_work = result_of(BALANCED)
        .and_then(|result| result.cells)
        .map(work_of_pair);
    let cpu = all().all(|result| result.cpu_seconds.is_some());
    let cost = |result: &MeasuredVariant| match by {
        Cost::Seconds => result.cpu_seconds.filter(|_| cpu).unwrap_or(result.seconds),
        Cost::FftPairs => {
            let work = result.cells.map(work_of_pair).zip(balanced_work);
            result.fft_pairs * work.map_or(1.0, |(work, balanced_work)| work / balanced_work)
        }
    };
    let costs: Vec<f64> = all().map(cost).collect();
    let mut rows: Vec<Row> = measured
        .into_iter()
        .zip(costs)
        .map(|((trial, result), cost)| row(trial, result, cost, &reference_result))
        .collect();
    let points: Vec<Option<(f64, f64)>> = rows
        .iter()
        .map(|row| Some((row.cost, row.largest_promised_error?)).filter(|_| row.is_compared()))
        .collect();
    for (row, on_front) in rows.iter_mut().zip(pareto(&points)) {
        row.pareto = on_front;
    }
    Ok(Trade {
        name: name.to_owned(),
        motion,
        rows,
        base,
        cost_measure: by,
        noise,
        machine: reference_result.machine,
        scene_hash: reference_result.scene_hash,
    })
}

fn row(trial: Trial, result: MeasuredVariant, cost: f64, reference: &MeasuredVariant) -> Row {
    let errors = errors(&result, reference);
    Row {
        largest_promised_error: worst(&errors, reference),
        errors,
        variant: trial.variant,
        failure: trial.failure,
        seconds: result.seconds,
        cpu_seconds: result.cpu_seconds,
        fft_pairs: result.fft_pairs,
        cost,
        memory: trial.memory,
        iterations: result.iterations,
        pareto: false,
        values: result.values,
        bars: result.bars,
        closure: result.closure,
        field: result.field,
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

/// Marks the points (cost, error) on the Pareto front: no other point is as good in both and better in one.
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
    /// Returns true if the row solves the same model as `balanced`. Returns false for the reference, for a change of
    /// the model, and for a repetition of `balanced`.
    pub fn is_compared(&self) -> bool {
        let kind = self.variant.kind;
        self.variant.name != REFERENCE && !matches!(kind, KnobKind::Model | KnobKind::Repeat)
    }
}

impl Trade {
    /// Returns the row of a variant.
    pub fn row(&self, name: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.variant.name == name)
    }

    /// Returns the row of the reference, if its run reached its end.
    pub fn reference(&self) -> Option<&Row> {
        self.row(REFERENCE).filter(|row| row.failure.is_none())
    }

    /// Returns true if at least one row of the trade has the figure with index `figure`.
    pub fn has(&self, figure: usize) -> bool {
        let has_field = |row: &Row| figure == FIELD && row.field.is_some();
        self.rows
            .iter()
            .any(|row| row.values[figure].is_some() || has_field(row))
    }

    /// Returns true if the CPU time of all rows is known.
    pub fn has_cpu(&self) -> bool {
        self.rows.iter().all(|row| row.cpu_seconds.is_some())
    }

    /// Checks if the reference lies within the error bar of a figure of a row. Returns `None` without the figure or its
    /// bar.
    pub fn within(&self, row: &Row, figure: usize) -> Option<bool> {
        let (value, bar) = (row.values[figure]?, row.bars[figure]?);
        let exact = self.reference()?.values[figure]?;
        Some(value == exact || (value - exact).abs() <= bar * value.abs())
    }
}

/// Builds the table `compare_variants` of one or several scenes. Figures that no variant has get no column.
///
/// # Errors
/// [`TradeError::Table`]
pub fn table(trades: &[Trade]) -> Result<Table, TradeError> {
    let rows = || (trades.iter()).flat_map(|trade| trade.rows.iter().map(move |row| (trade, row)));
    let text = |value: for<'a> fn(&'a Trade, &'a Row) -> &'a str| -> Vec<String> {
        rows().map(|(t, row)| value(t, row).to_owned()).collect()
    };
    let float =
        |value: fn(&Row) -> f64| -> Vec<f64> { rows().map(|(_, row)| value(row)).collect() };
    let optional = |value: &dyn Fn(&Trade, &Row) -> Option<f64>| -> Vec<Option<f64>> {
        rows().map(|(trade, row)| value(trade, row)).collect()
    };
    let integer =
        |value: fn(&Row) -> u64| -> Vec<i64> { rows().map(|(_, row)| value(row) as i64).collect() };
    let flag =
        |value: fn(&Row) -> bool| -> Vec<bool> { rows().map(|(_, row)| value(row)).collect() };
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
        .column("cpu_seconds", optional(&|_, row| row.cpu_seconds))
        .column("fft_pairs", float(|row| row.fft_pairs))
        .column("relative_cost", optional(&relative))
        .column("memory", integer(|row| row.memory))
        .column("iterations", integer(|row| row.iterations))
        .column("pareto", flag(|row| row.pareto))
        .column(
            "error_promised",
            optional(&|_, row| row.largest_promised_error),
        );
    type Of = fn(&Row) -> &Values;
    let figure_columns: [(&str, Of); 3] = [
        ("", |row| &row.values),
        ("error_", |row| &row.errors),
        ("bar_", |row| &row.bars),
    ];
    for (prefix, value) in figure_columns {
        for (k, figure) in FIGURES.iter().enumerate() {
            // The wear field is not a number and only has an error.
            if k == FIELD && prefix != "error_" {
                continue;
            }
            let is_used = trades.iter().any(|trade| trade.has(k));
            let values = is_used.then(|| optional(&|_, row| value(row)[k]));
            table = table.optional_column(&format!("{prefix}{}", figure.name), values);
        }
    }
    let closure = rows().any(|(_, row)| row.closure.is_some());
    let closure = closure.then(|| optional(&|_, row| row.closure));
    Ok(table.optional_column("bar_closure", closure).build()?)
}

/// Writes `trade.parquet` for one or more scenes into a folder. Writes the page as `trade.md`, `trade.svg` and
/// `trade.html` into the same folder. Replaces existing files.
///
/// # Errors
/// [`TradeError`] for a file that cannot be created or written.
pub fn write(folder: &Path, trades: &[Trade], page: &Page) -> Result<(), TradeError> {
    let provenance = Provenance {
        // Several scenes have no common hash.
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
