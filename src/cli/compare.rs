//! `fretwear compare`.

use fretwear::report::{self, ComparedRun, Comparison, Rows, SkippedFolder, one_line_name};

use super::arguments::CompareArguments;
use super::figures::{DIGITS, FIGURES};
use super::{CliError, Exit};
use crate::progress::grouped;
use crate::terminal::{self, Results, say, wrapped};

/// Width of the table where neither a terminal nor `COLUMNS` gives one.
const WIDTH: usize = 80;

/// Prints the runs as one table, and writes it where asked.
pub fn compare(arguments: &CompareArguments, out: &mut Results) -> Result<Exit, CliError> {
    let rows = if arguments.all { Rows::All } else { Rows::Last };
    let comparison = report::compare(&arguments.runs, rows)?;
    let mut exit = notices(comparison.passed_over());
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

/// Says what is passed over, and how the command ends for it.
pub fn notices(passed_over: &[SkippedFolder]) -> Exit {
    for each in passed_over {
        say(&one_line_name(&format!("note: {each}")));
    }
    if passed_over.iter().any(SkippedFolder::is_damage_or_mismatch) {
        Exit::Damaged
    } else {
        Exit::Done
    }
}

/// A table in which each column has a figure of all states, to be fitted to the width of a terminal.
struct Columns {
    /// What each row is of.
    labels: Vec<String>,
    /// Title, unit, and a cell a label.
    columns: Vec<(String, &'static str, Vec<String>)>,
}

/// Least width that a table is fitted to.
const LEAST_WIDTH: usize = 40;
/// A label is wrapped where it takes more than this part of the width.
const LABEL_PART: usize = 4;
/// Spaces between columns.
const GAP: usize = 2;
/// What a state does not have.
const NONE: &str = "–";

/// Cells of several lines each, a row of the table after another; the first row is the heads.
type Grid = Vec<Vec<Vec<String>>>;

impl Columns {
    /// The figures that any of the states has, each in one unit.
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

    /// The lines of the table, none longer than `width`: a line a figure where `turn` and all labels fit beside each other; else a line a label,
    /// and the figures that do not fit beside each other in blocks below each other. Cells are never cut; labels and titles are wrapped.
    fn lines(&self, width: usize, turn: bool) -> Vec<String> {
        let width = width.max(LEAST_WIDTH);
        let labels: Vec<Vec<String>> = self
            .labels
            .iter()
            .map(|label| folded(label, width / LABEL_PART))
            .collect();
        let turned = self.turned(&labels);
        let widths = widths(&turned);
        let whole: usize = widths.iter().sum::<usize>() + GAP * (widths.len() - 1);
        let grid = match turn && whole <= width {
            true => turned,
            false => self.upright(labels),
        };
        in_blocks(&grid, width)
    }

    /// A row a figure.
    fn turned(&self, labels: &[Vec<String>]) -> Grid {
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

    /// A row a label.
    fn upright(&self, labels: Vec<Vec<String>>) -> Grid {
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

/// The width of each column.
fn widths(grid: &Grid) -> Vec<usize> {
    let of = |column: usize| {
        let lines = grid.iter().flat_map(|row| &row[column]);
        lines.map(|line| line.chars().count()).max().unwrap_or(0)
    };
    (0..grid[0].len()).map(of).collect()
}

/// The lines of a grid: as many columns beside each other as fit, each block with the first column. Cells of a row end on the same line.
fn in_blocks(grid: &Grid, width: usize) -> Vec<String> {
    let widths = widths(grid);
    let mut lines = Vec::new();
    let mut next = 1;
    while next < widths.len() {
        let first = next;
        let mut taken = widths[0];
        while next < widths.len() && (next == first || taken + GAP + widths[next] <= width) {
            taken += GAP + widths[next];
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

/// A name in lines of at most `width` characters, ended after a `/`, a space or an escaped character where there is one.
fn folded(name: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    let mut taken = 0;
    for part in name.split_inclusive(['/', ' ', '}']) {
        if taken > 0 && taken + part.chars().count() > width {
            lines.push(String::new());
            taken = 0;
        }
        for c in part.chars() {
            if taken == width {
                lines.push(String::new());
                taken = 0;
            }
            lines.last_mut().expect("a line").push(c);
            taken += 1;
        }
    }
    lines
}
