//! Joints in partial slip with a result that depends on a single cell. For orbits, the reference is an independent dense solution
//! (`tests/drawn/truth.py`). Steps of first order gave 50 % too much wear in the first orbit, with an error bar of 10 %.
//! For a straight motion, the reference is a run with short steps.

use std::path::Path;

use fretwear::scene;

use super::Start;
use crate::support::{Bench, latest, summary};

/// Scenes with a stored reference solution.
const CASES: [&str; 2] = ["orbit_204", "orbit_308"];

/// Promised accuracy of the presets.
const PROMISES: [(&str, f64); 2] = [("balanced", 0.01), ("fast", 0.05)];

#[test]
fn an_orbit_that_a_single_cell_decides_wears_what_a_dense_solution_does() {
    wear_what_a_dense_solution_does(&CASES[..1]);
}

#[test]
#[ignore = "long: 20 seconds"]
fn orbits_that_a_single_cell_decides_wear_what_a_dense_solution_does() {
    wear_what_a_dense_solution_does(&CASES);
}

fn wear_what_a_dense_solution_does(cases: &[&str]) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/drawn/cases");
    let bench = Bench::new();
    for case in cases {
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

/// Straight motion. In the reference, one cell sticks. With long steps, this cell wears and its neighbours wear more.
const ON_THE_VERGE: &str = "line_7124";
/// Smallest known relative error of the worn volume with long steps.
const WRONG: f64 = 0.15;
/// Largest error bar of the run with short steps.
const KNOWN: f64 = 0.03;

#[test]
#[ignore = "long: 6 seconds"]
fn the_bar_holds_what_a_cell_on_the_verge_decides_otherwise() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/drawn/cases");
    let bench = Bench::new();
    let worn = |name: &str, sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
        let scene = scene::load(&folder.join(format!("{ON_THE_VERGE}.toml")), &sets);
        let root = bench.path(name);
        Start::new(scene.expect("a scene"), &root).done();
        ["wear_volume", "error_wear_volume"].map(|figure| summary(&root, latest(&root), figure))
    };
    let [volume, bar] = worn("balanced", &[]);
    let [truth, of_truth] = worn("short", &["fidelity.preset=reference"]);
    let error = (truth / volume - 1.0).abs();
    println!("{volume:e} m³ ± {bar:e}, by short steps {truth:e} ± {of_truth:e}: {error:e}");
    assert!(
        error > WRONG,
        "the error is too small for a test: {error:e}"
    );
    assert!(of_truth < KNOWN, "bar of short steps: {of_truth:e}");
    assert!(error < bar, "off by {error:e}, bar {bar:e}");
}

/// Scene whose wear dies out, and its dissipated energy per cycle at the end with short steps \[J\]. Long steps give a smaller energy.
const DEAD: (&str, f64) = ("force_7115", 4.26e-12);
/// Largest share of the unworn joint's energy that counts as negligible.
const NEXT_TO_NOTHING: f64 = 0.1;

#[test]
fn of_wear_that_has_died_out_the_energy_is_known_in_joules() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/drawn/cases");
    let (case, truth) = DEAD;
    let bench = Bench::new();
    let root = bench.path(case);
    let scene = scene::load(&folder.join(format!("{case}.toml")), &[]).expect("a scene");
    Start::new(scene, &root).done();
    let end = latest(&root);
    let unworn = summary(&root, 0, "dissipated_energy");
    let figure = |column: &str| summary(&root, end, column);
    let (energy, bar) = (
        figure("dissipated_energy"),
        figure("error_dissipated_energy_absolute"),
    );
    assert!(
        energy < truth,
        "wear does not die out with long steps: {energy:e} J"
    );
    assert!(
        truth - energy <= bar && bar < NEXT_TO_NOTHING * unworn,
        "{energy:e} J ± {bar:e} of {unworn:e} J"
    );
}
