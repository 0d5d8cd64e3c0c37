//! `fretwear compare`.

use fretwear::report::{self, ComparedRun, Comparison, Rows, SkippedFolder, one_line_name};

use super::arguments::CompareArguments;
use super::figures::{DIGITS, FIGURES};
use super::{CliError, Exit};
use crate::progress::grouped;
use crate::terminal::{self, Results, say, wrapped};

/// Width of the table if neither a terminal nor `COLUMNS` gives one.
const WIDTH: usize = 80;

/// Prints the runs as one table, and writes the requested files.
pub fn compare(arguments: &CompareArguments, out: &mut Results) -> Result<Exit, CliError> {
    let rows = if arguments.all { Rows::All } else { Rows::Last };
    let comparison = report::compare(&arguments.runs, rows)?;
    let mut exit = report_skipped(comparison.passed_over());
    if let Some(path) = &arguments.parquet {
        comparison.write_parquet(path)?;
    }
    if let Some(path) = &arguments.csv {
        comparison.write_csv(path)?;
    }
    let table = Columns::of(&comparison, rows);
    for line in table.lines(terminal::width().unwrap_or(WIDTH), rows == Rows::Last) {
        writeln!(out, "{line}");
    }
    for damage in comparison.damage() {
        say(&one_line_name(&format!(
            "damaged: {damage}; the iterations from there on are left out"
        )));
        exit = Exit::Damaged;
    }
    Ok(exit)
}

/// Reports the skipped folders and returns the exit code for them.
pub fn report_skipped(passed_over: &[SkippedFolder]) -> Exit {
    for skipped in passed_over {
        say(&one_line_name(&format!("note: {skipped}")));
    }
    if passed_over.iter().any(SkippedFolder::is_damage_or_mismatch) {
        Exit::Damaged
    } else {
        Exit::Done
    }
}

/// A table with one column per figure and one cell per state. The table is fitted to the width of a terminal.
struct Columns {
    /// Name of the state of each row.
    labels: Vec<String>,
    /// Title, unit, and one cell per label.
    columns: Vec<(String, &'static str, Vec<String>)>,
}

/// Smallest width to which a table is fitted.
const LEAST_WIDTH: usize = 40;
/// The table wraps a label that is wider than the width of the table divided by `LABEL_SHARE_DIVISOR`.
const LABEL_SHARE_DIVISOR: usize = 4;
/// Spaces between columns.
const GAP: usize = 2;
/// Cell of a figure that a state lacks.
const NONE: &str = "–";

/// Rows of cells, and the lines of each cell. The first row has the titles.
type Grid = Vec<Vec<Vec<String>>>;

impl Columns {
    /// Collects the figures that any state has, each in one unit.
    fn of(comparison: &Comparison, rows: Rows) -> Columns {
        let compared = comparison.states();
        let iteration = |row: &ComparedRun| row.state.wear_iteration;
        let each = |cell: &dyn Fn(&ComparedRun) -> Option<String>| -> Vec<String> {
            let cells = compared.iter().map(cell);
            cells
                .map(|cell| cell.unwrap_or_else(|| NONE.to_owned()))
                .collect()
        };
        let mut columns = Vec::new();
        let mut add = |title: &str, unit, cells: Vec<String>| {
            if cells.iter().any(|cell| cell != NONE) {
                columns.push((title.to_owned(), unit, cells));
            }
        };
        if rows == Rows::Last {
            add(
                "iteration",
                "",
                each(&|row| Some(iteration(row).to_string())),
            );
        }
        let cycles = |row: &ComparedRun| Some(grouped(row.state.summary.cycles?.unsigned_abs()));
        add("cycles", "", each(&cycles));
        for figure in &FIGURES {
            let unit = figure.unit(compared.iter().map(|row| &row.state));
            let text =
                |row: &ComparedRun| figure.text(&row.state, |value| unit.rounded(value, DIGITS));
            add(figure.title, unit.symbol, each(&text));
        }
        add(
            "FFT pairs",
            "",
            each(&|row| Some(format!("{:.0}", row.fft_pairs))),
        );
        let labels = compared.iter().map(|row| match rows {
            Rows::Last => one_line_name(&row.run),
            Rows::All => format!("{}@{}", one_line_name(&row.run), iteration(row)),
        });
        Columns {
            labels: labels.collect(),
            columns,
        }
    }

    /// Formats the table in lines of at most `width` characters. With `turn`, the table has one row per figure if all
    /// labels fit side by side. Without `turn`, or if the labels do not fit, the table has one row per label. If the
    /// figures do not fit side by side, the table continues in further blocks of lines. Labels and titles are wrapped;
    /// cells are never cut.
    fn lines(&self, width: usize, turn: bool) -> Vec<String> {
        let width = width.max(LEAST_WIDTH);
        let labels: Vec<Vec<String>> = self
            .labels
            .iter()
            .map(|label| folded(label, width / LABEL_SHARE_DIVISOR))
            .collect();
        let figure_rows = self.grid_by_figure(&labels);
        let widths = widths(&figure_rows);
        let full_width: usize = widths.iter().sum::<usize>() + GAP * (widths.len() - 1);
        let grid = match turn && full_width <= width {
            true => figure_rows,
            false => self.grid_by_label(labels),
        };
        in_blocks(&grid, width)
    }

    /// Grid with one row per figure.
    fn grid_by_figure(&self, labels: &[Vec<String>]) -> Grid {
        let heads = [Vec::new()].into_iter().chain(labels.iter().cloned());
        let rows = self.columns.iter().map(|(title, unit, cells)| {
            let head = match *unit {
                "" => title.clone(),
                unit => format!("{title} [{unit}]"),
            };
            let cells = [head].into_iter().chain(cells.iter().cloned());
            cells.map(|cell| vec![cell]).collect()
        });
        [heads.collect()].into_iter().chain(rows).collect()
    }

    /// Grid with one row per label.
    fn grid_by_label(&self, labels: Vec<Vec<String>>) -> Grid {
        let heads = self.columns.iter().map(|(title, unit, cells)| {
            let widest = cells.iter().map(|cell| cell.chars().count()).max();
            let mut head = wrapped(title, widest.unwrap_or(0));
            head.extend((!unit.is_empty()).then(|| format!("[{unit}]")));
            head
        });
        let heads = [Vec::new()].into_iter().chain(heads).collect();
        let rows = labels.into_iter().enumerate().map(|(row, label)| {
            let cells = self
                .columns
                .iter()
                .map(|(.., cells)| vec![cells[row].clone()]);
            [label].into_iter().chain(cells).collect()
        });
        [heads].into_iter().chain(rows).collect()
    }
}

/// Returns the width of each column.
fn widths(grid: &Grid) -> Vec<usize> {
    let width_of = |column: usize| {
        let lines = grid.iter().flat_map(|row| &row[column]);
        lines.map(|line| line.chars().count()).max().unwrap_or(0)
    };
    (0..grid[0].len()).map(width_of).collect()
}

/// Formats a grid in blocks of as many columns as fit. Each block repeats the first column. Cells of a row end on the
/// same line.
fn in_blocks(grid: &Grid, width: usize) -> Vec<String> {
    let widths = widths(grid);
    let mut lines = Vec::new();
    let mut next = 1;
    while next < widths.len() {
        let first = next;
        let mut used_width = widths[0];
        while next < widths.len() && (next == first || used_width + GAP + widths[next] <= width) {
            used_width += GAP + widths[next];
            next += 1;
        }
        if first > 1 {
            lines.push(String::new());
        }
        for row in grid {
            let columns = || [0].into_iter().chain(first..next);
            let height = columns().map(|column| row[column].len()).max().unwrap_or(0);
            for line in 0..height {
                let mut text = String::new();
                for column in columns() {
                    let cell = &row[column];
                    let above = height - cell.len();
                    let part = line.checked_sub(above).map_or("", |line| &cell[line]);
                    let width = widths[column];
                    match column {
                        0 => text += &format!("{part:<width$}"),
                        _ => text += &format!("  {part:>width$}"),
                    }
                }
                lines.push(text.trim_end().to_owned());
            }
        }
    }
    lines
}

/// Breaks a name into lines of at most `width` characters, after a `/`, a space or an escaped character if possible.
fn folded(name: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    let mut line_length = 0;
    for part in name.split_inclusive(['/', ' ', '}']) {
        if line_length > 0 && line_length + part.chars().count() > width {
            lines.push(String::new());
            line_length = 0;
        }
        for c in part.chars() {
            if line_length == width {
                lines.push(String::new());
                line_length = 0;
            }
            lines.last_mut().expect("a line").push(c);
            line_length += 1;
        }
    }
    lines
}
