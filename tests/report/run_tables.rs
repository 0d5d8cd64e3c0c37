//! Tables of a run as frames, compared with the reader of the store.

use fretwear::report::{ReportError, RunTables, WEAR_ITERATION, numeric_column, scan_runs};
use fretwear::store::StoreError;
use fretwear::tables::TableName;
use tempfile::TempDir;

use super::small_runs::{STATIC, WORN, compute, damage, summary_file};

#[test]
fn a_series_holds_what_the_store_reads() {
    let folder = TempDir::new().unwrap();
    let run = RunTables::open(&compute(&folder, "worn", WORN, None)).unwrap();
    assert_eq!(run.name(), "worn");
    assert!(run.iterations().len() > 3 && run.damage().is_empty());
    assert_eq!(run.recipe().wear.as_ref().unwrap().cycles, Some(400_000));

    let summaries = run.series(TableName::Summary).unwrap().unwrap();
    assert_eq!(summaries.get_column_names()[0], WEAR_ITERATION);
    let read = |k: &u64| run.reader().read(*k, TableName::Summary).unwrap();
    for name in ["wear_volume", "kn", "rq", "error_kn"] {
        let stored: Vec<f64> = run
            .iterations()
            .iter()
            .map(|k| read(k).f64(name).unwrap()[0])
            .collect();
        assert_eq!(numeric_column(&summaries, name).unwrap(), stored, "{name}");
    }
    // Without vibration, the column is missing in the series and in each iteration.
    assert_eq!(numeric_column(&summaries, "resonance_frequency"), None);
    let last = run
        .iteration_table(run.latest(), TableName::Summary)
        .unwrap()
        .unwrap();
    assert_eq!(numeric_column(&last, "resonance_frequency"), None);
    assert_eq!(
        numeric_column(&last, "kn").unwrap()[..],
        numeric_column(&summaries, "kn").unwrap()[run.iterations().len() - 1..]
    );

    // A table with many rows per iteration keeps the order of the file.
    let fields = run.series(TableName::WearField).unwrap().unwrap();
    let depth = numeric_column(&fields, "wear_depth").unwrap();
    let stored: Vec<f64> = run
        .iterations()
        .iter()
        .flat_map(|k| {
            run.reader()
                .read(*k, TableName::WearField)
                .unwrap()
                .f64("wear_depth")
                .unwrap()
                .to_vec()
        })
        .collect();
    assert_eq!(depth, stored);
}

#[test]
fn what_a_run_lacks_is_none() {
    let folder = TempDir::new().unwrap();
    let run = RunTables::open(&compute(&folder, "pressed", STATIC, None)).unwrap();
    assert!(run.series(TableName::Frf).unwrap().is_none());
    assert!(run.iteration_table(0, TableName::Frf).unwrap().is_none());
    assert!(run.run_table(TableName::Structure).unwrap().is_none());
    let surface = run.run_table(TableName::Surface).unwrap().unwrap();
    assert_eq!(numeric_column(&surface, "height").unwrap().len(), 24 * 20);
    assert_eq!(
        numeric_column(&surface, "kept").unwrap(),
        vec![1.0; 24 * 20]
    );
    assert!(matches!(
        run.iteration_table(7, TableName::Summary),
        Err(ReportError::Run {
            source: StoreError::NoIteration {
                wear_iteration: 7,
                ..
            },
            ..
        })
    ));
}

#[test]
fn what_does_not_verify_does_not_count() {
    let folder = TempDir::new().unwrap();
    let root = compute(&folder, "worn", WORN, None);
    damage(&summary_file(&root, 2));
    let run = RunTables::open(&root).unwrap();
    assert_eq!(run.iterations(), [0, 1]);
    assert!(run.damage()[0].to_string().contains("wear_iteration=2"));
    let summaries = run.series(TableName::Summary).unwrap().unwrap();
    assert_eq!(
        numeric_column(&summaries, WEAR_ITERATION).unwrap(),
        [0.0, 1.0]
    );
}

/// Damage after the opening of the run is an error, too.
#[test]
fn damage_found_while_reading_is_an_error() {
    let folder = TempDir::new().unwrap();
    let root = compute(&folder, "worn", WORN, None);
    let run = RunTables::open(&root).unwrap();
    let file = root.join("iterations/wear_iteration=1/cycle.parquet");
    damage(&file);
    let is_damage = |error: ReportError| {
        assert!(
            matches!(
                &error,
                ReportError::Run { source: StoreError::Damaged(damage), .. } if damage.path == file
            ),
            "{error:?}"
        );
        assert!(error.is_damage_or_mismatch());
    };
    is_damage(run.series(TableName::Cycle).unwrap_err());
    is_damage(scan_runs(&[run], TableName::Cycle).err().unwrap());
}

/// The table `timing` is outside the hash chain. Its damage removes only its rows.
#[test]
fn damaged_times_are_passed_over() {
    let folder = TempDir::new().unwrap();
    let root = compute(&folder, "worn", WORN, None);
    damage(&root.join("iterations/wear_iteration=1/timing.parquet"));
    let run = RunTables::open(&root).unwrap();
    assert!(run.damage().is_empty() && run.latest() > 2);
    let timing = run.series(TableName::Timing).unwrap().unwrap();
    let iterations = numeric_column(&timing, WEAR_ITERATION).unwrap();
    assert!(iterations.contains(&0.0) && iterations.contains(&2.0) && !iterations.contains(&1.0));
}

#[test]
fn several_runs_are_one_scan() {
    let folder = TempDir::new().unwrap();
    let runs: Vec<RunTables> = [("b", WORN), ("a", STATIC)]
        .map(|(name, scene)| RunTables::open(&compute(&folder, name, scene, None)).unwrap())
        .into();
    let both = scan_runs(&runs, TableName::Summary)
        .unwrap()
        .unwrap()
        .collect()
        .unwrap();
    let iterations = runs[0].iterations().len();
    let order = numeric_column(&both, "order").unwrap();
    assert_eq!(order, [vec![0.0; iterations], vec![1.0]].concat());
    let volume = numeric_column(&both, "wear_volume").unwrap();
    assert!(volume[..iterations].iter().all(|v| v.is_finite()) && volume[iterations].is_nan());
    assert!(scan_runs(&runs, TableName::Frf).unwrap().is_none());
}
