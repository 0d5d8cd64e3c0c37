//! Tests of the cost that a rehearsal estimates, against the cost of the run.
//!
//! The scenes in this file have a few thousand cells and few asperities. `rehearsed.py` in the same folder draws scenes with all kinds of
//! motion, and `.ci/long` runs it.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

use fretwear::rehearsal::{self, Rehearsal};
use fretwear::scene::{self, Plan};
use serde_json::{Value, json};

use crate::support::Bench;

/// Grid that allows a coarser grid on the joint of the bench.
const ROOM: &str = "joint.grid=[64, 54]";

fn with_sets<'a>(words: &[&'a str], sets: &[&'a str]) -> Vec<&'a str> {
    let sets = sets.iter().flat_map(|set| ["--set", set]);
    words.iter().copied().chain(sets).collect()
}

/// Rehearsal with a limit by counts, because the machine may be busy.
fn rehearsed(bench: &Bench, scene: &str, sets: &[&str]) -> Rehearsal {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    let scene = scene::load(&bench.path(scene), &sets).expect("a scene");
    let longest = Duration::from_secs(600);
    rehearsal::rehearse(&Plan::of(&scene).expect("a plan").inputs, longest)
}

fn planned(bench: &Bench, scene: &str, sets: &[&str]) -> Value {
    json!(rehearsed(bench, scene, sets).cost)
}

fn ran(bench: &Bench, scene: &str, sets: &[&str]) -> Value {
    let arguments = with_sets(&["run", scene, "--json", "--run", "run"], sets);
    bench.done(&arguments).json()["cost"].clone()
}

fn pipeline(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines");
    let path = folder.join(format!("{name}.toml"));
    path.to_str().expect("text").to_owned()
}

/// Checks that the range contains the actual number.
fn hold(case: &str, expected: &Value, actual: &Value) {
    let actual = actual.as_f64().expect("a number");
    let of = |name: &str| expected[name].as_f64().expect("a number");
    let held = (of("least")..=of("most")).contains(&actual);
    assert!(held, "{case}: {expected} expected, {actual} actual");
}

fn hold_all(case: &str, plan: &Value, run: &Value) {
    let names = [
        ("fft_pairs", "fft_pairs"),
        ("disk", "disk_bytes"),
        ("iterations", "wear_iterations"),
    ];
    for (planned, spent) in names {
        hold(&format!("{case}, {planned}"), &plan[planned], &run[spent]);
    }
}

/// Kinds of scenes and of motion.
#[test]
#[ignore = "long: 15 seconds"]
fn a_coarse_run_says_what_a_run_costs() {
    let small = "small.toml".to_owned();
    let torsion = [ROOM, "motion={ rotation = \"0.4 mrad\" }"];
    for (scene, sets) in [
        (small.clone(), vec![ROOM]),
        (small.clone(), vec![ROOM, "contact.transverse=absent"]),
        (small.clone(), vec![ROOM, "contact.boundary=periodic"]),
        (small.clone(), vec![ROOM, "contact.pressure_cap=1 GPa"]),
        (small.clone(), vec![ROOM, "motion={ force = \"20 N\" }"]),
        (small.clone(), torsion.to_vec()),
        (
            small.clone(),
            vec![
                ROOM,
                "motion.normal_load_amplitude=40 N",
                "fidelity.preset=fast",
                "wear.cycles=20_000",
            ],
        ),
        (
            small,
            vec![ROOM, "wear.scheme=explicit", "wear.depth_step=50 nm"],
        ),
        (pipeline("hertz_fretting"), vec![]),
        (pipeline("static_contact"), vec!["joint.grid=[200, 200]"]),
    ] {
        let bench = Bench::new();
        let case = format!("{scene} {sets:?}");
        let (plan, run) = (planned(&bench, &scene, &sets), ran(&bench, &scene, &sets));
        hold_all(&case, &plan, &run);
        let coarse = &plan["coarse_run"]["cells"][0];
        assert!(coarse.as_u64() >= Some(24), "{case}: {plan}");
        // The plan names the stages that need FFT pairs.
        let stages = |pairs: &Value| -> BTreeSet<String> {
            let pairs = pairs.as_object().expect("stages").iter();
            let some = pairs.filter(|(_, v)| v.as_f64() > Some(0.0));
            some.map(|(stage, _)| stage.clone()).collect()
        };
        let by_stage = "fft_pairs_by_stage";
        assert_eq!(stages(&plan[by_stage]), stages(&run[by_stage]), "{case}");
    }
}

/// The rehearsal runs a scene itself if its grid cannot be coarser; the counts are then exact.
#[test]
fn a_scene_of_few_cells_is_run_itself() {
    let bench = Bench::new();
    let plan = planned(&bench, "small.toml", &[]);
    let run = ran(&bench, "small.toml", &[]);
    let coarse_run =
        json!({ "cells": [26, 22], "iterations": run["wear_iterations"], "whole": true });
    assert_eq!(plan["coarse_run"], coarse_run);
    assert_eq!(
        plan["iterations"]["most"],
        run["wear_iterations"].as_f64().expect("a count")
    );
    let expected = plan["fft_pairs"]["expected"].as_f64().expect("pairs");
    let actual = run["fft_pairs"].as_f64().expect("pairs");
    assert!(
        (expected / actual - 1.0).abs() < 5e-3,
        "{expected} {actual}"
    );
}

/// The program does not rehearse a structure with a mesh, but it counts its memory and unknowns.
#[test]
fn the_cost_of_a_mesh_is_counted_alone() {
    let bench = Bench::new();
    for scene in ["resonator.toml".to_owned(), pipeline("lap_joint")] {
        let found = rehearsed(&bench, &scene, &[]);
        let cost = json!(found.cost);
        assert_eq!(
            cost["not_known"],
            "the structure comes from a mesh, which is not reduced in a rehearsal"
        );
        assert!(
            found.seconds.is_none() && cost["coarse_run"].is_null(),
            "{cost}"
        );
        for name in ["fft_pairs", "iterations", "disk"] {
            assert!(cost[name].is_null(), "{name}: {cost}");
        }
        for name in ["memory", "memory_cached", "unknowns", "disk_per_iteration"] {
            assert!(cost[name].as_f64() > Some(0.0), "{name}: {cost}");
        }
    }
    let said = bench.done(&["plan", "resonator.toml"]).stdout();
    assert!(
        said.contains("not known     iterations, FFT pairs, time and total disk: the structure comes from a mesh"),
        "{said}"
    );
}

/// A cycle of many samples uses the operations of a rehearsal before the end of the scene.
#[test]
fn a_coarse_run_that_is_broken_off_has_a_range() {
    let sets = [
        "joint.grid=[110, 100]",
        "surface.correlation_length=0.1 mm",
        "motion.normal_load_amplitude=60 N",
    ];
    let cost = rehearsed(&Bench::new(), "small.toml", &sets).cost;
    assert!(!cost.coarse_run.expect("a run").whole, "{cost:?}");
    for range in [cost.iterations, cost.fft_pairs, cost.disk] {
        let range = range.expect("a range");
        assert!(range.least < range.expected && range.expected < range.most);
        assert!(range.most < 1000.0 * range.least, "{range:?}");
    }
}

/// A rehearsal begins no stage after its time limit, and gives the reason.
#[test]
fn a_rehearsal_ends_in_time() {
    let scene = scene::load(Path::new(&pipeline("prescribed_fretting")), &[]).expect("a scene");
    let inputs = Plan::of(&scene).expect("a plan").inputs;
    let found = rehearsal::rehearse(&inputs, Duration::ZERO);
    let why = found.cost.not_known.expect("a reason");
    assert!(why.contains("takes more than 0 s"), "{why}");
    assert!(found.cost.counted.memory > 30_000_000 && found.cost.disk.is_none());
}

/// A plan does not change the run that follows, and the stored plan contains no result of the rehearsal.
#[test]
fn nothing_that_is_rehearsed_enters_a_recipe() {
    let bench = Bench::new();
    let at_once = bench
        .done(&["plan", "small.toml", "--json", "--no-rehearsal"])
        .json();
    let rehearsed = bench.done(&["plan", "small.toml", "--json"]).json();
    assert_eq!(at_once["recipe"], rehearsed["recipe"]);
    assert_eq!(at_once["decisions"], rehearsed["decisions"]);
    assert!(at_once["cost"].is_null() && at_once["seconds"].is_null());
    bench.done(&["run", "small.toml", "--run", "run", "--quiet"]);
    let text = std::fs::read_to_string(bench.path("run/plan.json")).expect("a plan");
    let kept: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(kept["recipe"], rehearsed["recipe"]);
    let keys: BTreeSet<&str> = kept
        .as_object()
        .expect("an object")
        .keys()
        .map(|k| &**k)
        .collect();
    assert!(!keys.contains("cost"), "{keys:?}");
}

/// The cost of a run in pieces is the sum over all starts.
#[test]
fn a_run_in_pieces_has_cost_what_one_in_one_piece_has() {
    let whole = ran(&Bench::new(), "small.toml", &[]);
    let bench = Bench::new();
    let stopped = ["run", "small.toml", "--run", "run", "--max-wall", "1 us"];
    while bench.fretwear(&stopped).code() == 75 {}
    let pieces = ran(&bench, "small.toml", &[]);
    for name in ["wear_iterations", "pruned_iterations", "fft_pairs_by_stage"] {
        assert_eq!(pieces[name], whole[name], "{name}");
    }
    // A run that keeps fewer iterations reports the number of pruned ones.
    let sparse = ran(&Bench::new(), "small.toml", &["output.keep={ last = 1 }"]);
    assert_eq!(
        sparse["pruned_iterations"].as_u64(),
        // The run keeps the unworn state and the last iteration.
        whole["wear_iterations"].as_u64().map(|n| n - 1)
    );
}

/// The text output gives the estimated cost before a run and the actual cost after it.
#[test]
fn both_are_told() {
    let bench = Bench::new();
    let told = bench.done(&["run", "small.toml", "--run", "run"]).stderr();
    let line = told
        .lines()
        .find(|line| line.trim_start().starts_with("cost"))
        .expect("a line on cost");
    for word in ["iterations", "FFT pairs", " s, ", "of disk"] {
        assert!(line.contains(word), "{line}");
    }
    let planned = bench.done(&["plan", "small.toml", "--set", ROOM]).stdout();
    for word in [
        "iterations    about",
        "FFT pairs     about",
        "disk          ",
        "time          about",
        "rehearsal     ",
    ] {
        assert!(planned.contains(word), "{word}: {planned}");
    }
    let at_once = bench
        .done(&["plan", "small.toml", "--no-rehearsal"])
        .stdout();
    assert!(!at_once.contains("cost"), "{at_once}");
}
