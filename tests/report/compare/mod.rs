//! Comparison of several runs in one table: its rows, its values, and its errors.

mod command;
mod files;
mod rows;

use fretwear::report::{Cell, Comparison};

use super::small_runs::{STATIC, WORN, compute, damage, summary_file};

/// Value of a column in a row.
fn cell(comparison: &Comparison, row: usize, column: &str) -> Cell {
    let position = comparison
        .columns()
        .iter()
        .position(|known| known.name == column)
        .unwrap_or_else(|| panic!("no column {column}"));
    comparison.row(row)[position].clone()
}
