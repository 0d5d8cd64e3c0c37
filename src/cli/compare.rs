//! `fretwear compare`.

use fretwear::report::{self, Cell, Comparison, PassedOver, Rows, one_line_name};

use super::arguments::CompareArguments;
use super::report::readable;
use super::{CliError, Exit};
use crate::terminal::{Results, say};

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
    write_aligned(out, &comparison);
    for damage in comparison.damage() {
        say(&one_line_name(&format!(
            "damaged: {damage}; the iterations from there on are left out"
        )));
        exit = Exit::Damaged;
    }
    Ok(exit)
}

/// Says what is passed over, and how the command ends for it.
pub fn notices(passed_over: &[PassedOver]) -> Exit {
    for each in passed_over {
        say(&one_line_name(&format!("note: {each}")));
    }
    if passed_over.iter().any(PassedOver::is_damage_or_mismatch) {
        Exit::Damaged
    } else {
        Exit::Done
    }
}

/// One line of names, one of units, then one a row; names to the left, numbers to the right.
fn write_aligned(out: &mut Results, comparison: &Comparison) {
    let columns = comparison.columns();
    let names = columns.iter().map(|column| column.name.clone()).collect();
    let units = columns
        .iter()
        .map(|column| match column.unit.as_str() {
            "1" => String::new(),
            unit => format!("[{unit}]"),
        })
        .collect();
    let values = (0..comparison.height()).map(|row| {
        let cells = comparison.row(row).into_iter().map(|cell| match cell {
            Cell::Absent => String::new(),
            Cell::Integer(value) => value.to_string(),
            Cell::Number(value) => readable(value),
            Cell::Text(text) => one_line_name(&text),
        });
        cells.collect()
    });
    let lines: Vec<Vec<String>> = [names, units].into_iter().chain(values).collect();
    let widths: Vec<usize> = (0..columns.len())
        .map(|column| {
            lines
                .iter()
                .map(|line| line[column].chars().count())
                .max()
                .unwrap_or(0)
        })
        .collect();
    for line in &lines {
        let mut text = String::new();
        for (column, (cell, width)) in line.iter().zip(&widths).enumerate() {
            if column == 0 {
                text += &format!("{cell:<width$}");
            } else {
                text += &format!("  {cell:>width$}");
            }
        }
        writeln!(out, "{}", text.trim_end());
    }
}
