//! Orbits in partial slip on which a single cell decides, against an independent dense solution (`tests/drawn/truth.py`). By steps of first
//! order the first of them wore half as much again, within a bar of a tenth.

use std::path::Path;

use fretwear::scene;

use super::Start;
use crate::support::{Bench, latest, summary};

/// Scenes with their truth beside them.
const CASES: [&str; 2] = ["orbit_204", "orbit_308"];

/// What the presets promise.
const PROMISES: [(&str, f64); 2] = [("balanced", 0.01), ("fast", 0.05)];

#[test]
fn orbits_that_a_single_cell_decides_wear_what_a_dense_solution_does() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/drawn/cases");
    let bench = Bench::new();
    for case in CASES {
        let truth = std::fs::read(folder.join(format!("{case}.truth.json"))).expect("a truth");
        let truth: serde_json::Value = serde_json::from_slice(&truth).expect("JSON");
        let number = |name: &str| truth[name].as_f64().expect("a number");
        for (preset, promise) in PROMISES {
            let sets = [format!("fidelity.preset={preset}")];
            let scene = scene::load(&folder.join(format!("{case}.toml")), &sets).expect("a scene");
            let root = bench.path(&format!("{case}-{preset}"));
            Start::new(scene, &root).done();
            let figure = |column: &str| summary(&root, latest(&root), column);
            let error = (figure("wear_volume") / number("volume") - 1.0).abs();
            let error = error - number("error_volume");
            let bar = figure("error_wear_volume");
            assert!(
                error < promise && error < bar,
                "{case}, {preset}: off by {error:e}, bar {bar:e}"
            );
        }
    }
}
