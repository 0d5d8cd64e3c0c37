//! Tests of `campaign collect`, which appends whole shards.

use std::fs;

use fretwear::tables::Nullable;

use super::rows::columns;
use super::{GRID, planned};
use crate::support::{Bench, latest, summary};

fn collect(bench: &Bench) -> serde_json::Value {
    bench
        .done(&["campaign", "collect", "--dir", "c", "--json"])
        .json()
}

fn integers(values: &Nullable) -> Vec<i64> {
    match values {
        Nullable::I64(values) => values.iter().map(|v| v.expect("a number")).collect(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_row_of_a_shard_has_its_index_and_its_keys() {
    let bench = planned(GRID);
    let none = collect(&bench);
    assert_eq!(
        (&none["runs"], none["shards"].as_array().map(Vec::len)),
        (&0.into(), Some(0))
    );
    bench.done(&["campaign", "run", "--dir", "c", "--index", "2-4", "-q"]);
    assert_eq!(collect(&bench)["runs"], 3);
    let first = bench.path("c/collected/shard-00000.parquet");
    let before = fs::read(&first).expect("a shard");
    let found = columns(&bench, "c/collected/shard-00000.parquet");
    let (index, k) = (
        integers(&found["index"]),
        integers(&found["wear_iteration"]),
    );
    let seeds = integers(&found["surface.seed"]);
    let numbers = |name: &str| match &found[name] {
        Nullable::F64(values) => values.clone(),
        other => panic!("{other:?}"),
    };
    let (friction, volume) = (
        numbers("contact.friction_coefficient"),
        numbers("wear_volume"),
    );
    let mut expected = Vec::new();
    for row in 2..=4 {
        let root = bench.path(&format!("c/runs/00000{row}"));
        expected.extend((0..=latest(&root) as i64).map(|k| (row, k)));
    }
    let keys: Vec<(i64, i64)> = index.iter().copied().zip(k.iter().copied()).collect();
    assert_eq!(keys, expected);
    for (at, (row, k)) in keys.into_iter().enumerate() {
        assert_eq!(seeds[at], row % 3 + 1);
        assert_eq!(friction[at], Some(if row < 3 { 0.5 } else { 0.7 }));
        let root = bench.path(&format!("c/runs/00000{row}"));
        assert_eq!(volume[at], Some(summary(&root, k as u64, "wear_volume")));
    }

    // Later rows are appended in another shard; existing shards do not change.
    bench.done(&["campaign", "run", "--dir", "c", "--jobs", "2", "-q"]);
    assert_eq!(collect(&bench)["runs"], 3);
    assert_eq!(collect(&bench)["collected"], 6);
    assert_eq!(fs::read(&first).expect("a shard"), before);
    let second = columns(&bench, "c/collected/shard-00001.parquet");
    let mut rows = integers(&second["index"]);
    assert!(rows.is_sorted());
    rows.dedup();
    assert_eq!(rows, [0, 1, 5]);
    // The shards have the same columns with the same types.
    let types = |found: &std::collections::BTreeMap<String, Nullable>| {
        let kinds = found
            .iter()
            .map(|(name, values)| (name.clone(), std::mem::discriminant(values)));
        kinds.collect::<Vec<_>>()
    };
    assert_eq!(types(&found), types(&second));
}

#[test]
fn a_history_that_was_touched_is_left_out_and_said() {
    let bench = planned(GRID);
    bench.done(&["campaign", "run", "--dir", "c", "--index", "0-1", "-q"]);
    crate::support::flip(&bench.path("c/ended/000001.parquet"));
    let did = bench.fretwear(&["campaign", "collect", "--dir", "c", "--json"]);
    assert_eq!((did.code(), &did.json()["runs"]), (4, &1.into()));
    assert!(
        did.stderr().contains("ended/000001.parquet"),
        "{}",
        did.stderr()
    );
    fs::remove_file(bench.path("c/ended/000001.parquet")).expect("removed");
    bench.done(&["campaign", "run", "--dir", "c", "--index", "1", "-q"]);
    assert_eq!(collect(&bench)["runs"], 1);
    assert_eq!(collect(&bench)["collected"], 2);
    // Leftovers of a killed collection do not count as shards.
    fs::write(bench.path("c/collected/shard-00002.parquet.77.new"), "half").expect("written");
    assert_eq!(collect(&bench)["collected"], 2);
    crate::support::flip(&bench.path("c/collected/shard-00000.parquet"));
    fs::write(bench.path("c/collected/shard-00001.parquet"), "half").expect("written");
    let did = bench.fretwear(&["campaign", "collect", "--dir", "c"]);
    assert_eq!(did.code(), 4);
    assert!(
        did.stderr().contains("shard-00001.parquet"),
        "{}",
        did.stderr()
    );
}
