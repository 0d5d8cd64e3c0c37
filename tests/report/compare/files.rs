use super::{STATIC, WORN, cell, compute};
use fretwear::report::{Cell, Comparison, ReportError, Rows, compare};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use std::fs::File;
use std::path::PathBuf;
use tempfile::TempDir;

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
                other => panic!("{name} holds {other:?}"),
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
                // Bit for bit: a table that is written and read again is the same table.
                Cell::Number(value) => assert_eq!(text.parse(), Ok(value)),
                Cell::Text(value) => assert_eq!(text, value),
            }
        }
        rows += 1;
    }
    assert_eq!(rows, comparison.height());
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
        matches!(&csv, ReportError::Csv { path: named, .. } if *named == path),
        "{csv:?}"
    );
}
