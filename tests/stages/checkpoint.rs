//! The published case, continued from the checkpoint in `data/`. Each user of the sources can continue this run.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use fretwear::scene::{Plan, load};
use fretwear::stages::{RunOptions, run};
use fretwear::store::{RealFileSystem, RunReader};
use fretwear::tables::{Column, TableName};
use serde_json::Value;

use crate::support::copy;

use super::Seen;

/// Largest relative difference. The scene solves friction to a duality gap of 1e-3, and other processors differ by less through rounding.
const REPRODUCED: f64 = 1e-3;
/// Columns that describe the effort of a solution.
const EFFORT: [&str; 6] = [
    "error_normal",
    "error_tangential",
    "error_wear",
    "fft_pairs",
    "normal_iterations",
    "tangential_iterations",
];

#[test]
#[ignore = "long: 15 seconds"]
fn the_published_case_goes_on_from_its_checkpoint() {
    goes_on("lap_joint_checkpoint");
}

#[test]
#[ignore = "long: 15 seconds"]
fn the_published_law_goes_on_from_its_checkpoint() {
    goes_on("lap_joint_checkpoint_total");
}

fn goes_on(checkpoint: &str) {
    let source = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("data")
        .join(checkpoint);
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    copy(&source, &root);
    let expected = fs::read_to_string(root.join("expected.json")).expect("what follows");
    fs::remove_file(root.join("expected.json")).expect("not part of the run");
    let expected: Vec<Value> = serde_json::from_str(&expected).expect("rows");
    assert!(
        expected.iter().any(|row| row["updated"] == true),
        "the run must contain an update"
    );

    let scene = load(&root.join("scene.toml"), &[]).expect("the scene");
    let inputs = Plan::of(&scene).expect("inputs").inputs;
    let commits = expected.len() as u64;
    let options = RunOptions {
        inputs: &inputs,
        root: root.clone(),
        source: None,
        until: None,
        threads: 1,
        cache: None,
        file_system: Arc::new(RealFileSystem),
        stop: &|done| done >= commits,
    };
    run(&options, &Seen::default()).expect("it goes on");
    let reader = RunReader::open(Arc::new(RealFileSystem), &root).expect("the run");
    let last = &expected[expected.len() - 1];
    let k = last["wear_iteration"].as_u64().expect("a number");
    assert_eq!(reader.latest(), Some(k));
    // The checkpoint contains its last iteration only. The test therefore compares the last iteration.
    let row = reader.read(k, TableName::Summary).expect("the summary");
    for (schema, column) in row.columns() {
        let name = schema.name.as_str();
        if EFFORT.contains(&name) {
            continue;
        }
        match column {
            Column::F64(values) => {
                let value = last[name].as_f64().expect("a number");
                let error = (values[0] / value - 1.0).abs();
                assert!(error <= REPRODUCED, "{name}: {} for {value}", values[0]);
            }
            Column::I64(values) => {
                let value = last[name].as_f64().expect("a number");
                let error = (values[0] as f64 / value - 1.0).abs();
                assert!(error <= REPRODUCED, "{name}: {} for {value}", values[0]);
            }
            Column::Bool(values) => assert_eq!(Value::from(values[0]), last[name], "{name}"),
            _ => panic!("{name} has an unexpected type"),
        }
    }
}
