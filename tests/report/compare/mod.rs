//! Several runs in one table: which rows and values it has, and what it refuses.

mod command;
mod files;
mod rows;

use fretwear::report::{Cell, Comparison};

use super::small_runs::{STATIC, WORN, compute, damage, summary_file};

/// The value of a column.
fn cell(comparison: &Comparison, row: usize, column: &str) -> Cell {
    let position = comparison
        .columns()
        .iter()
        .position(|known| known.name == column)
        .unwrap_or_else(|| panic!("no column {column}"));
    comparison.row(row)[position].clone()
}
