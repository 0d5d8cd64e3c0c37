use super::{STATIC, WORN, cell, compute, damage, summary_file};
use fretwear::report::{Cell, ReportError, Rows, compare};
use fretwear::stages::Stage;
use fretwear::store::{RealFileSystem, RunReader, StoreError};
use fretwear::tables::{Column, Table, TableName};
use std::path::Path;
use std::sync::Arc;
use tempfile::TempDir;

/// Columns that a comparison adds to the summary.
const KEYS: [&str; 2] = ["run", "wear_iteration"];

/// Summaries of a run, read by the store.
fn summaries(run: &Path) -> Vec<(u64, Table)> {
    let reader = RunReader::open(Arc::new(RealFileSystem), run).unwrap();
    let iterations: Vec<u64> = reader.iterations().collect();
    iterations
        .into_iter()
        .map(|k| (k, reader.read(k, TableName::Summary).unwrap()))
        .collect()
}

fn in_summary(summary: &Table, name: &str) -> Cell {
    summary
        .columns()
        .find(|(schema, _)| schema.name == name)
        .map_or(Cell::Absent, |(_, column)| match column {
            Column::F64(values) => Cell::Number(values[0]),
            Column::I64(values) => Cell::Integer(values[0]),
            other => panic!("unexpected type of a column: {other:?}"),
        })
}

fn fft_pairs(summaries: &[(u64, Table)]) -> f64 {
    summaries
        .iter()
        .map(|(_, summary)| summary.f64("fft_pairs").unwrap()[0])
        .sum()
}

#[test]
fn a_run_has_its_last_state_and_the_pairs_of_all_its_iterations() {
    let folder = TempDir::new().unwrap();
    let pressed = compute(&folder, "pressed", STATIC, None);
    let worn = compute(&folder, "worn", WORN, None);
    // The run with fewer columns is the first and the last. Its columns must not decide the columns of the other run.
    let runs = [pressed.clone(), worn.clone(), pressed.clone()];
    let comparison = compare(&runs, Rows::Last).unwrap();

    assert_eq!(comparison.height(), 3);
    for (row, run) in runs.iter().enumerate() {
        let summaries = summaries(run);
        let (last, summary) = summaries.last().unwrap();
        assert_eq!(
            cell(&comparison, row, "run"),
            Cell::Text(run.display().to_string())
        );
        assert_eq!(
            cell(&comparison, row, "wear_iteration"),
            Cell::Integer(*last as i64)
        );
        for column in comparison.columns() {
            let expected = match column.name.as_str() {
                name if KEYS.contains(&name) => continue,
                "fft_pairs" => Cell::Number(fft_pairs(&summaries)),
                name => in_summary(summary, name),
            };
            assert_eq!(
                cell(&comparison, row, &column.name),
                expected,
                "{} of {}",
                column.name,
                run.display()
            );
        }
    }
    assert_eq!(cell(&comparison, 0, "wear_volume"), Cell::Absent);
    assert!(matches!(cell(&comparison, 1, "wear_volume"), Cell::Number(v) if v > 0.0));
    // The value is a sum over several iterations, not the FFT pairs of the last one.
    let worn = summaries(&worn);
    assert!(worn.len() > 2, "{} iterations", worn.len());
    assert!(fft_pairs(&worn) > worn.last().unwrap().1.f64("fft_pairs").unwrap()[0]);
}

#[test]
fn every_iteration_has_a_row_in_the_order_of_wear() {
    let folder = TempDir::new().unwrap();
    // The run has more than ten iterations. In alphabetical order, 10 would come before 2.
    let fine = WORN.replace("0.2 um", "0.02 um");
    let worn = compute(&folder, "worn", &fine, None);
    let pressed = compute(&folder, "pressed", STATIC, None);
    let comparison = compare(&[worn.clone(), pressed], Rows::All).unwrap();

    let summaries = summaries(&worn);
    assert!(summaries.len() > 11, "{} iterations", summaries.len());
    assert_eq!(comparison.height(), summaries.len() + 1);
    for (row, (wear_iteration, summary)) in summaries.iter().enumerate() {
        assert_eq!(
            cell(&comparison, row, "wear_iteration"),
            Cell::Integer(*wear_iteration as i64)
        );
        for name in ["cycles", "wear_volume", "kn", "fft_pairs"] {
            assert_eq!(cell(&comparison, row, name), in_summary(summary, name));
        }
    }
    let last = comparison.height() - 1;
    assert_eq!(cell(&comparison, last, "cycles"), Cell::Absent);
}

#[test]
fn the_name_of_a_folder_means_nothing() {
    let folder = TempDir::new().unwrap();
    let mut before = compute(&folder, "plain", WORN, None);
    let expected = compare(std::slice::from_ref(&before), Rows::Last).unwrap();
    for name in ["rq=1um", "kn=7", "wear_iteration=99", "a[bc]*?", "Rq 5 µm"] {
        let run = folder.path().join(name);
        std::fs::rename(&before, &run).unwrap();
        let comparison = compare(std::slice::from_ref(&run), Rows::Last).unwrap();
        assert_eq!(
            cell(&comparison, 0, "run"),
            Cell::Text(run.display().to_string())
        );
        assert_eq!(comparison.row(0)[1..], expected.row(0)[1..], "{name}");
        before = run;
    }
}

#[test]
fn a_folder_without_a_run_is_named() {
    let folder = TempDir::new().unwrap();
    let pressed = compute(&folder, "pressed", STATIC, None);
    let absent = folder.path().join("absent");
    let error = compare(&[pressed, absent.clone()], Rows::Last).unwrap_err();
    assert!(
        matches!(&error, ReportError::Run { run, source: StoreError::NoRun { .. } } if *run == absent),
        "{error:?}"
    );
    assert!(
        error.to_string().contains(absent.to_str().unwrap()),
        "{error}"
    );
    assert!(error.is_no_run() && !error.is_damage_or_mismatch());
}

#[test]
fn a_run_without_an_iteration_is_named() {
    let folder = TempDir::new().unwrap();
    let begun = compute(&folder, "begun", WORN, Some(Stage::Surface));
    let error = compare(std::slice::from_ref(&begun), Rows::All).unwrap_err();
    assert!(
        matches!(&error, ReportError::Empty { run, .. } if *run == begun),
        "{error:?}"
    );
}

#[test]
fn what_does_not_verify_is_left_out_and_listed() {
    let folder = TempDir::new().unwrap();
    let worn = compute(&folder, "worn", WORN, None);
    let sound = summaries(&worn);
    damage(&summary_file(&worn, 2));

    let comparison = compare(std::slice::from_ref(&worn), Rows::Last).unwrap();
    assert_eq!(cell(&comparison, 0, "wear_iteration"), Cell::Integer(1));
    assert_eq!(cell(&comparison, 0, "kn"), in_summary(&sound[1].1, "kn"));
    assert_eq!(
        cell(&comparison, 0, "fft_pairs"),
        Cell::Number(fft_pairs(&sound[..2]))
    );
    assert!(
        comparison
            .damage()
            .iter()
            .any(|damage| damage.path == summary_file(&worn, 2)),
        "{:?}",
        comparison.damage()
    );

    damage(&summary_file(&worn, 0));
    let error = compare(&[worn], Rows::Last).unwrap_err();
    assert!(matches!(error, ReportError::Empty { .. }), "{error:?}");
}
