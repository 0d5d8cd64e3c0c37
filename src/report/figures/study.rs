//! Runs of a report, with the data that most figures need.

use std::fmt::Display;

use polars::prelude::DataFrame;

use super::super::plot::style_of_run;
use super::super::quantity::{self, CYCLES, Unit, Units};
use super::super::results::sizes;
use super::super::run_tables::numeric_column;
use super::super::{ReportError, RunTables, WEAR_ITERATION};
use crate::store::table_file;
use crate::tables::TableName;

/// Run of a report.
pub struct ReportedRun<'a> {
    /// Tables of the run.
    pub tables: &'a RunTables,
    /// Rows of `summary` of all iterations.
    pub summary: DataFrame,
    /// Label: the name of the run, or its folder if two runs have the same name.
    pub label: String,
    /// Style of its curves.
    pub style: usize,
    /// Cycles up to each iteration of `summary`, all 0 without wear.
    pub cycles: Vec<f64>,
    /// Iterations of `summary`.
    iterations: Vec<f64>,
}

/// All runs of a report.
pub struct ReportedRuns<'a> {
    /// Runs in the order that the user gave.
    pub runs: Vec<ReportedRun<'a>>,
}

impl<'a> ReportedRuns<'a> {
    /// Reads the summaries of the runs.
    ///
    /// # Errors
    /// Returns [`ReportError`] for a table that cannot be read.
    pub fn read(runs: &'a [RunTables]) -> Result<ReportedRuns<'a>, ReportError> {
        let count_of_name = |name: &str| runs.iter().filter(|run| run.name() == name).count();
        let read = |(place, tables): (usize, &'a RunTables)| {
            let summary = tables.series(TableName::Summary)?.unwrap_or_default();
            let label = match count_of_name(tables.name()) {
                1 => tables.name().to_owned(),
                _ => tables.root().display().to_string(),
            };
            Ok(ReportedRun {
                cycles: numeric_column(&summary, "cycles")
                    .unwrap_or_else(|| vec![0.0; summary.height()]),
                iterations: numeric_column(&summary, WEAR_ITERATION).unwrap_or_default(),
                tables,
                summary,
                label,
                style: style_of_run(place),
            })
        };
        let runs: Result<Vec<ReportedRun>, ReportError> =
            runs.iter().enumerate().map(read).collect();
        Ok(ReportedRuns { runs: runs? })
    }

    /// Returns the labels of the runs.
    pub fn labels(&self) -> Vec<&str> {
        self.runs.iter().map(|run| run.label.as_str()).collect()
    }

    /// Returns true for a report of one run. In a report of one run, each curve shows a state of wear. In a report of
    /// several runs, each curve shows a run.
    pub fn is_single(&self) -> bool {
        self.runs.len() == 1
    }

    /// Returns the unit of cycles for all runs.
    pub fn cycles(&self) -> Unit {
        let all = self.runs.iter().flat_map(|run| &run.cycles);
        quantity::unit_of(CYCLES, quantity::largest(all))
    }

    /// Returns the unit of a column of `summary` for the whole page. The unit suits the largest of the first and last
    /// values of all runs.
    pub fn unit(&self, column: &str, units: Units) -> Unit {
        let columns = self.runs.iter().filter_map(|run| run.column(column));
        let ends = columns.flat_map(|values| [values.first().copied(), values.last().copied()]);
        let ends: Vec<f64> = ends.flatten().collect();
        quantity::unit_of(units, quantity::largest(&ends))
    }

    /// Returns the runs that have a table.
    fn runs_with(&self, table: &str) -> Vec<&ReportedRun<'a>> {
        let table = TableName::from_name(table);
        let has = |run: &&ReportedRun| {
            let in_iterations = |table| !run.iterations_with(table, 1).is_empty();
            let in_run = |table| {
                run.tables
                    .run_table(table)
                    .is_ok_and(|table| table.is_some())
            };
            table.is_some_and(|table| in_iterations(table) || in_run(table))
        };
        self.runs.iter().filter(has).collect()
    }

    /// Returns a Polars expression that reads some columns of a table of all iterations.
    pub fn query(&self, table: &str, columns: &[&str]) -> String {
        let scan = file(table, "*");
        let columns = quoted_list(columns);
        let hive = "hive_partitioning=True";
        match &self.runs_with(table)[..] {
            [run] => format!(
                "pl.scan_parquet({}, {hive}).select(\"wear_iteration\", {columns}).collect()",
                quoted(&format!("{}/{scan}", run.folder()))
            ),
            runs => format!(
                "pl.concat([pl.scan_parquet(f\"{{run}}/{scan}\", {hive}).with_columns(run=pl.lit(run)) for run in [{}]], \
                 how=\"diagonal\").select(\"run\", \"wear_iteration\", {columns}).collect()",
                quoted_list(&runs.iter().map(|run| run.folder()).collect::<Vec<_>>())
            ),
        }
    }

    /// Returns a Polars expression that reads some columns of a table of the last iteration.
    pub fn query_last(&self, table: &str, columns: &[&str]) -> String {
        let columns = quoted_list(columns);
        match &self.runs_with(table)[..] {
            [run] => format!(
                "pl.read_parquet({}, columns=[{columns}])",
                quoted(&format!(
                    "{}/{}",
                    run.folder(),
                    file(table, run.tables.latest())
                ))
            ),
            runs => {
                let each = |run: &&ReportedRun| {
                    format!("{}: {}", quoted(&run.folder()), run.tables.latest())
                };
                let each: Vec<String> = runs.iter().map(each).collect();
                format!(
                    "{{run: pl.read_parquet(f\"{{run}}/{}\", columns=[{columns}]) for run, k in {{{}}}.items()}}",
                    file(table, "{k}"),
                    each.join(", ")
                )
            }
        }
    }

    /// Returns a Polars expression for reading a table with one file per run.
    pub fn query_once(&self, table: &str) -> String {
        let file = file(table, "*");
        match &self.runs_with(table)[..] {
            [run] => format!(
                "pl.read_parquet({})",
                quoted(&format!("{}/{file}", run.folder()))
            ),
            runs => format!(
                "{{run: pl.read_parquet(f\"{{run}}/{file}\") for run in [{}]}}",
                quoted_list(&runs.iter().map(|run| run.folder()).collect::<Vec<_>>())
            ),
        }
    }
}

/// Returns the path of a table below the folder of a run.
fn file(table: &str, wear_iteration: impl Display) -> String {
    let table = TableName::from_name(table);
    table.map_or(String::new(), |table| table_file(table, wear_iteration))
}

/// Quotes a text for Python.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

fn quoted_list<T: AsRef<str>>(texts: &[T]) -> String {
    let quoted: Vec<String> = texts.iter().map(|text| quoted(text.as_ref())).collect();
    quoted.join(", ")
}

impl ReportedRun<'_> {
    /// Returns the folder of the run, as the user gave it.
    pub fn folder(&self) -> String {
        self.tables.root().display().to_string()
    }

    /// Returns a column of `summary` over the iterations.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        numeric_column(&self.summary, name)
    }

    /// Returns the bound of rounding errors of a column of `summary`.
    pub fn resolution(&self, column: &str) -> f64 {
        let schema = TableName::Summary.schema().column(column);
        schema.map_or(0.0, |schema| {
            sizes(self.tables, &self.summary).resolution(column, &schema.unit)
        })
    }

    /// Returns the row of an iteration in `summary`.
    pub fn row(&self, wear_iteration: u64) -> usize {
        let place = self
            .iterations
            .iter()
            .position(|k| *k == wear_iteration as f64);
        place.unwrap_or(self.iterations.len().max(1) - 1)
    }

    /// Returns the cycles up to an iteration.
    pub fn cycles_at(&self, wear_iteration: u64) -> f64 {
        self.cycles[self.row(wear_iteration)]
    }

    /// Returns the name of a state of wear.
    pub fn state(&self, wear_iteration: u64) -> String {
        if self.column("cycles").is_none() {
            "without wear".to_owned()
        } else if self.cycles_at(wear_iteration) == 0.0 {
            "unworn".to_owned()
        } else {
            quantity::with_best_unit(self.cycles_at(wear_iteration), CYCLES)
        }
    }

    /// Returns the first and the last iteration, or one iteration if they are the same.
    pub fn ends(&self) -> Vec<u64> {
        let iterations = self.tables.iterations();
        let mut ends = vec![iterations[0], self.tables.latest()];
        ends.dedup();
        ends
    }

    /// Returns the iterations that have a table: at most `most`, with the first and the last.
    ///
    /// # Errors
    /// Returns [`ReportError`] for an iteration that cannot be read.
    pub fn iterations_with(&self, table: TableName, most: usize) -> Vec<u64> {
        let has = |k: &&u64| {
            let commit = self.tables.reader().commit_of(**k);
            commit.is_ok_and(|commit| commit.table(table.as_str()).is_some())
        };
        let all: Vec<u64> = self
            .tables
            .iterations()
            .iter()
            .filter(has)
            .copied()
            .collect();
        if all.len() <= most {
            return all;
        }
        let at = |k: usize| all[k * (all.len() - 1) / (most - 1).max(1)];
        (0..most).map(at).collect()
    }

    /// Returns the iterations that have all of some tables: at most `most`, with the first and the last. The logarithm
    /// of the cycles increases evenly between them.
    pub fn states_along_wear(&self, tables: &[TableName], most: usize) -> Vec<u64> {
        let has = |k: &u64, table: &TableName| {
            let commit = self.tables.reader().commit_of(*k);
            commit.is_ok_and(|commit| commit.table(table.as_str()).is_some())
        };
        let iterations = self.tables.iterations().iter().copied();
        let all: Vec<u64> = iterations
            .filter(|k| tables.iter().all(|table| has(k, table)))
            .collect();
        let worn = |k: &&u64| self.cycles_at(**k) > 0.0;
        let Some((first, last)) = all.iter().find(worn).zip(all.last()) else {
            return all.into_iter().take(most).collect();
        };
        let [low, high] = [*first, *last].map(|k| self.cycles_at(k).ln());
        let steps = most.saturating_sub(1).max(1);
        let nearest = |step: usize| {
            let goal = low + (high - low) * step as f64 / steps as f64;
            let distance = |k: &u64| (self.cycles_at(*k).ln() - goal).abs();
            all.iter()
                .filter(worn)
                .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        };
        let mut chosen: Vec<u64> = all
            .first()
            .into_iter()
            .chain((1..=steps).filter_map(nearest))
            .copied()
            .collect();
        chosen.dedup();
        chosen
    }

    /// Returns the cells of the joint's grid and its side lengths \[m\].
    pub fn grid(&self) -> Option<([usize; 2], [f64; 2])> {
        let surface = self.tables.recipe().surface()?;
        Some((surface.grid, surface.size))
    }

    /// Returns a column of a field of an iteration on the whole grid, x slowest. A cell without a row is NaN. Returns
    /// `None` if the iteration did not store the field.
    ///
    /// # Errors
    /// Returns [`ReportError`] for a table that cannot be read.
    pub fn field(
        &self,
        wear_iteration: u64,
        table: TableName,
        column: &str,
    ) -> Result<Option<Vec<f64>>, ReportError> {
        let frame = self.tables.iteration_table(wear_iteration, table)?;
        Ok(frame.and_then(|frame| self.on_grid(&frame, column)))
    }

    /// Returns the heights of the unworn surface \[m\]. A cell outside the joint is NaN.
    ///
    /// # Errors
    /// Returns [`ReportError`] for a table that cannot be read.
    pub fn heights(&self) -> Result<Option<Vec<f64>>, ReportError> {
        let Some(frame) = self.tables.run_table(TableName::Surface)? else {
            return Ok(None);
        };
        let kept = self.on_grid(&frame, "kept");
        let heights = self.on_grid(&frame, "height");
        Ok(heights.zip(kept).map(|(mut heights, kept)| {
            for (height, kept) in heights.iter_mut().zip(kept) {
                if kept != 1.0 {
                    *height = f64::NAN;
                }
            }
            heights
        }))
    }

    fn on_grid(&self, frame: &DataFrame, column: &str) -> Option<Vec<f64>> {
        let ([nx, ny], _) = self.grid()?;
        let mut values = vec![f64::NAN; nx * ny];
        let (i, j) = (numeric_column(frame, "i")?, numeric_column(frame, "j")?);
        for ((i, j), value) in i.iter().zip(&j).zip(numeric_column(frame, column)?) {
            if let Some(cell) = values.get_mut(*i as usize * ny + *j as usize) {
                *cell = value;
            }
        }
        Some(values)
    }
}
