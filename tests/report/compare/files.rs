use super::{STATIC, WORN, cell, compute};
use fretwear::report::{Cell, Comparison, ReportError, Rows, compare};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use std::fs::File;
use std::path::PathBuf;
use tempfile::TempDir;

use crate::support::copy;

fn comparison(folder: &TempDir) -> Comparison {
    let worn = compute(folder, "worn", WORN, None);
    let pressed = compute(folder, "pressed, once", STATIC, None);
    compare(&[worn, pressed], Rows::All).unwrap()
}

#[test]
fn parquet_holds_the_cells_and_their_units() {
    let folder = TempDir::new().unwrap();
    let comparison = comparison(&folder);
    let path = folder.path().join("comparison.parquet");
    comparison.write_parquet(&path).unwrap();

    let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
    let rows: Vec<_> = reader
        .get_row_iter(None)
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert_eq!(rows.len(), comparison.height());
    for (row, found) in rows.iter().enumerate() {
        for (name, field) in found.get_column_iter() {
            let found = match field {
                Field::Null => Cell::Absent,
                Field::Long(value) => Cell::Integer(*value),
                Field::Double(value) => Cell::Number(*value),
                Field::Str(text) => Cell::Text(text.clone()),
                other => panic!("{name} has the type {other:?}"),
            };
            assert_eq!(found, cell(&comparison, row, name), "{name} of row {row}");
        }
        assert_eq!(found.len(), comparison.columns().len());
    }

    let metadata = reader.metadata().file_metadata().key_value_metadata();
    let entry = metadata
        .unwrap()
        .iter()
        .find(|entry| entry.key == "fretwear")
        .unwrap();
    let entry: serde_json::Value = serde_json::from_str(entry.value.as_ref().unwrap()).unwrap();
    for (column, unit) in [("wear_volume", "m^3"), ("kn", "N/m"), ("run", "1")] {
        assert_eq!(entry["columns"][column]["unit"], unit);
    }
    for column in comparison.columns() {
        assert_eq!(
            entry["columns"][&column.name]["description"],
            column.description.as_str()
        );
    }
}

#[test]
fn csv_holds_the_cells_in_full() {
    let folder = TempDir::new().unwrap();
    let comparison = comparison(&folder);
    let path = folder.path().join("comparison.csv");
    comparison.write_csv(&path).unwrap();

    let mut reader = csv::Reader::from_path(&path).unwrap();
    let names: Vec<String> = reader
        .headers()
        .unwrap()
        .iter()
        .map(str::to_owned)
        .collect();
    let expected: Vec<&str> = comparison
        .columns()
        .iter()
        .map(|c| c.name.as_str())
        .collect();
    assert_eq!(names, expected);
    let mut rows = 0;
    for (row, record) in reader.records().enumerate() {
        let record = record.unwrap();
        for (text, expected) in record.iter().zip(comparison.row(row)) {
            match expected {
                Cell::Absent => assert_eq!(text, ""),
                Cell::Integer(value) => assert_eq!(text.parse(), Ok(value)),
                // The CSV text is exact: writing and reading keeps each bit of a number.
                Cell::Number(value) => assert_eq!(text.parse(), Ok(value)),
                Cell::Text(value) => assert_eq!(text, value),
            }
        }
        rows += 1;
    }
    assert_eq!(rows, comparison.height());
}

/// Folders may come from strangers. A spreadsheet evaluates each cell that looks like a formula.
#[cfg(unix)]
#[test]
fn no_name_of_a_run_is_a_formula_in_csv() {
    let folder = TempDir::new().unwrap();
    let skewed = STATIC.replace("seed = 7", "seed = 2");
    let plain = compute(&folder, "plain", &skewed, None);
    let names = [
        "=cmd|calc!A0",
        "+SUM(1)",
        "-1",
        "@x",
        "\tx",
        "\rx",
        "a=1",
        "plain",
    ];
    for name in &names[..7] {
        copy(&plain, &folder.path().join(name));
    }
    let did = std::process::Command::new(env!("CARGO_BIN_EXE_fretwear"))
        .args(["compare", "--csv", "o.csv", "--"])
        .args(names)
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert_eq!(did.status.code(), Some(0));
    let mut reader = csv::Reader::from_path(folder.path().join("o.csv")).unwrap();
    let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), names.len());
    for (row, name) in rows.iter().zip(names) {
        let expected = match name {
            "a=1" | "plain" => name.to_owned(),
            name => format!("./{name}"),
        };
        assert_eq!(row[0], expected);
        // The numbers are unchanged, also the negative ones.
        assert!(row.iter().skip(1).eq(rows[7].iter().skip(1)));
    }
    assert!(rows[7].iter().any(|cell| cell.starts_with('-')), "{rows:?}");
}

#[test]
fn a_file_that_cannot_be_written_is_named() {
    let folder = TempDir::new().unwrap();
    let comparison = comparison(&folder);
    let path: PathBuf = folder.path().join("no such folder/table");
    let parquet = comparison.write_parquet(&path).unwrap_err();
    assert!(
        matches!(&parquet, ReportError::Io { path: named, .. } if *named == path),
        "{parquet:?}"
    );
    let csv = comparison.write_csv(&path).unwrap_err();
    assert!(
        matches!(&csv, ReportError::Io { path: named, .. } if *named == path),
        "{csv:?}"
    );
}
