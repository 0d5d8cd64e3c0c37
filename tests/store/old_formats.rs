//! Runs of former versions, kept in `data/old_runs`: they are read, verified and continued.

use super::*;
use crate::support::{Bench, copy, latest, reader, table, verified};
use fretwear::tables::Column;

/// What a former version gave with its runs.
struct OldRun {
    name: String,
    root: PathBuf,
    expected: Value,
}

impl OldRun {
    fn expected_iterations(&self, key: &str) -> Vec<u64> {
        let list = self.expected[key].as_array().expect("a list");
        list.iter().map(|k| k.as_u64().expect("a number")).collect()
    }
}

/// Every old run of every version.
fn old_runs() -> Vec<OldRun> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/old_runs");
    let mut runs = Vec::new();
    for version in fs::read_dir(&folder).expect("a folder") {
        let version = version.expect("an entry").path();
        if !version.is_dir() {
            continue;
        }
        let text = fs::read_to_string(version.join("expected.json")).expect("what they give");
        let expected: Value = serde_json::from_str(&text).expect("JSON");
        let named = expected["runs"].as_object().expect("runs by name").clone();
        runs.extend(named.into_iter().map(|(name, expected)| OldRun {
            root: version.join(&name),
            name,
            expected,
        }));
    }
    assert!(!runs.is_empty());
    runs
}

/// Rows and columns are those of the schema that the table is read by.
fn assert_sound(table: &Table, at: &str) {
    assert!(table.rows() > 0, "{at} is empty");
    let mut columns = 0;
    for (schema, column) in table.columns() {
        assert_eq!(column.len(), table.rows(), "{at}, {}", schema.name);
        assert!(table.schema().column(&schema.name).is_some(), "{at}");
        columns += 1;
    }
    assert!(columns > 0, "{at} has no columns");
}

/// The time of the processor is told of the stages of a run where its first iteration tells it, and no sum of a part of it.
fn assert_cpu_is_told_as_a_whole(root: &Path, name: &str) {
    let run = reader(root);
    let first = run.iterations().next().expect("an iteration");
    let timing = run.read(first, TableName::Timing).expect("readable");
    let cost = run.history().expect("readable").cost();
    let stages = timing.text("stage").expect("stages");
    assert!(!stages.is_empty(), "{name}");
    for stage in stages {
        let cpu = cost[stage].cpu_seconds;
        assert_eq!(cpu.is_some(), timing.has("cpu_seconds"), "{name}, {stage}");
    }
}

#[test]
fn every_table_of_an_old_run_is_read() {
    for old in old_runs() {
        let name = &old.name;
        let run = reader(&old.root);
        let report = verified(&old.root);
        let found: Vec<u64> = run.iterations().collect();
        assert_eq!(found, old.expected_iterations("iterations"), "{name}");
        assert_eq!(report.pruned, old.expected_iterations("pruned"), "{name}");
        let origin = &run.record().origin;
        let origin = origin
            .as_ref()
            .map(|o| format!("{}@{}", o.run, o.wear_iteration));
        assert_eq!(origin.as_deref(), old.expected["origin"].as_str(), "{name}");
        for k in found {
            let commit = run.commit_of(k).expect("listed");
            let tables: Vec<&String> = commit
                .tables
                .keys()
                .chain(commit.unchained.keys())
                .collect();
            assert!(
                tables.iter().any(|table| *table == "summary"),
                "{name}, {k}"
            );
            for table in tables {
                let at = format!("{name}, iteration {k}, {table}");
                let known = TableName::from_name(table).unwrap_or_else(|| panic!("{at}: unknown"));
                let read = run
                    .read(k, known)
                    .unwrap_or_else(|error| panic!("{at}: {error}"));
                assert_sound(&read, &at);
            }
        }
        assert_cpu_is_told_as_a_whole(&old.root, name);
        for once in &report.once {
            let at = format!("{name}, {}", once.table);
            let known = once.table;
            let read = run
                .read_once(known)
                .unwrap_or_else(|error| panic!("{at}: {error}"));
            assert_sound(&read.expect("listed"), &at);
        }
        let next = latest(&old.root) + 1;
        let drafted: BTreeSet<String> = run.drafted(next).expect("readable").into_iter().collect();
        let expected: BTreeSet<String> = old.expected["drafted"]
            .as_array()
            .expect("a list")
            .iter()
            .map(|table| table.as_str().expect("a name").to_owned())
            .collect();
        assert_eq!(drafted, expected, "{name}");
    }
}

/// What another reader of Parquet found when the run was made, to the bit.
#[test]
fn the_last_summary_of_an_old_run_is_what_it_was() {
    for old in old_runs() {
        let name = &old.name;
        let row = table(&old.root, latest(&old.root), TableName::Summary);
        let expected = old.expected["summary"].as_object().expect("a row");
        let names: BTreeSet<&str> = row
            .columns()
            .map(|(schema, _)| schema.name.as_str())
            .collect();
        assert_eq!(
            names,
            expected.keys().map(String::as_str).collect(),
            "{name}"
        );
        for (schema, column) in row.columns() {
            let value = &expected[&schema.name];
            let at = format!("{name}, {}: {column:?} for {value}", schema.name);
            match column {
                Column::F64(values) => {
                    // Numbers are texts there: a reader of JSON may round the last digit.
                    let value: f64 = value.as_str().expect("a text").parse().expect("a number");
                    let same = values[0].to_bits() == value.to_bits();
                    assert!(same || values[0].is_nan() && value.is_nan(), "{at}");
                }
                Column::I64(values) => assert_eq!(Some(values[0]), value.as_i64(), "{at}"),
                Column::I32(values) => {
                    assert_eq!(Some(i64::from(values[0])), value.as_i64(), "{at}");
                }
                Column::Bool(values) => assert_eq!(Some(values[0]), value.as_bool(), "{at}"),
                _ => panic!("{at}: an unexpected type"),
            }
        }
    }
}

/// Part of its cycles by which a run that wears is extended, so that a finished one has a step to take.
const FURTHER: f64 = 1.5;

#[test]
#[ignore = "long: 8 seconds"]
fn an_old_run_goes_on() {
    let bench = Bench::new().sharing();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    // A file is named from the folder of the scene, which is elsewhere now.
    let files = [
        ("surface", "file", "path", "ground_face.x3p"),
        ("structure", "mesh", "file", "lap_of_bars.inp"),
    ];
    for old in old_runs() {
        let name = &old.name;
        let root = bench.path(name);
        copy(&old.root, &root);
        let before = latest(&root);
        let scene = reader(&root).record().scene.clone();
        let mut command = vec!["run".to_owned(), "--run".to_owned(), name.clone()];
        for (section, kind, key, file) in files {
            if scene[section]["kind"] == kind {
                let path = data.join(file);
                command.extend([
                    "--set".to_owned(),
                    format!("{section}.{key}={}", path.display()),
                ]);
            }
        }
        bench.done(&command);
        verified(&root);
        assert_cpu_is_told_as_a_whole(&root, name);
        let finished = old.expected["finished"].as_bool().expect("known");
        assert_eq!(latest(&root) == before, finished, "{name}");
        let Some(cycles) = scene["wear"]["cycles"].as_f64() else {
            continue;
        };
        let before = latest(&root);
        let further = format!("wear.cycles={}", (FURTHER * cycles).round());
        command.extend(["--set".to_owned(), further]);
        bench.done(&command);
        verified(&root);
        assert!(latest(&root) > before, "{name} ends where it was");
        assert!(!root.join("damaged").exists(), "{name}");
    }
}
