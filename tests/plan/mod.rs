//! Tests of the recipes of the shipped scenes: the output of `fretwear plan --json` against stored recipes.
//!
//! After an intended change, run the tests once with FRETWEAR_REWRITE_PLANS=1 and read the difference.

mod absence;
mod memory;
mod plausible;
mod rehearsal;
mod stability;

use std::fs;
use std::path::{Path, PathBuf};

use fretwear::recipe::{Heights, Recipe, StructureSource, Surface};
use fretwear::scene::{self, Plan};
use serde_json::Value;

use crate::support::Bench;

const REWRITE: &str = "FRETWEAR_REWRITE_PLANS";

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// File names without extension, sorted.
fn stems(folder: &Path, extension: &str) -> Vec<String> {
    let mut stems: Vec<String> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|e| e == extension))
        .map(|path| {
            path.file_stem()
                .expect("a name")
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    stems.sort();
    stems
}

#[test]
fn the_recipes_of_the_pipelines_are_those_on_record() {
    let golden = folder("tests/plan/golden");
    let pipelines = folder("pipelines");
    let bench = Bench::new();
    let rewrite = std::env::var_os(REWRITE).is_some();
    for name in stems(&pipelines, "toml") {
        let scene = pipelines.join(format!("{name}.toml"));
        let scene = scene.to_str().expect("a path of text");
        let found = bench
            .done(&["plan", scene, "--json", "--no-rehearsal"])
            .json()["recipe"]
            .clone();
        let path = golden.join(format!("{name}.json"));
        if rewrite {
            let text = serde_json::to_string_pretty(&found).expect("a value");
            fs::write(&path, text + "\n").expect("written");
        }
        let text = fs::read_to_string(&path)
            .unwrap_or_else(|error| panic!("{}: {error}; set {REWRITE}=1", path.display()));
        let expected: Value = serde_json::from_str(&text).expect("a plan");
        assert_eq!(
            found, expected,
            "{name}: if the change is intended, set {REWRITE}=1"
        );
    }
    assert_eq!(stems(&golden, "json"), stems(&pipelines, "toml"));
}

/// A recipe that is read from a run folder has exactly the numbers that the run used.
#[test]
fn a_recipe_is_read_back_as_it_was() {
    let pipelines = folder("pipelines");
    for name in stems(&pipelines, "toml") {
        let scene = scene::load(&pipelines.join(format!("{name}.toml")), &[]).expect("a scene");
        let recipe = Plan::of(&scene).expect("a plan").inputs.recipe;
        let text = serde_json::to_string(&recipe).expect("text");
        let mut read: Recipe = serde_json::from_str(&text).expect("a recipe");
        // The path of a file is not part of a recipe.
        if let (Some(Surface { heights, .. }), Some(own)) = (
            read.joints.first_mut().and_then(|j| j.surface.as_mut()),
            recipe.surface(),
        ) && let (Heights::File(file), Heights::File(own)) = (heights, &own.heights)
        {
            file.path.clone_from(&own.path);
        }
        if let (Some(structure), Some(own)) = (&mut read.structure, &recipe.structure)
            && let (StructureSource::Matrices(import), StructureSource::Matrices(own)) =
                (&mut structure.source, &own.source)
        {
            import.files.clone_from(&own.files);
        }
        assert_eq!(read, recipe, "{name}");
    }
}

/// Except for its seconds, a plan depends only on the scene, not on the machine, the time or the folder.
#[test]
fn a_plan_is_the_same_each_time_and_anywhere() {
    let (here, there) = (Bench::new(), Bench::new());
    let planned = |bench: &Bench| {
        let mut plan = bench.done(&["plan", "small.toml", "--json"]).json();
        let seconds = plan.as_object_mut().expect("an object").remove("seconds");
        assert!(seconds.is_some_and(|seconds| seconds["rehearsal"].as_f64() > Some(0.0)));
        plan
    };
    let first = planned(&here);
    assert_eq!(planned(&here), first);
    assert_eq!(planned(&there), first);
    assert!(!here.path("runs").exists(), "a plan runs nothing");
}

/// The decision of the plan that each key changes.
#[test]
fn a_plan_follows_the_scene() {
    let bench = Bench::new();
    let choices = |sets: &[&str]| -> Vec<(String, String)> {
        let mut arguments = vec!["plan", "small.toml", "--json", "--no-rehearsal"];
        arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
        let plan = bench.done(&arguments).json();
        let decisions = plan["decisions"].as_array().expect("a list").clone();
        decisions
            .iter()
            .map(|d| [&d["what"], &d["choice"]].map(|v| v.as_str().expect("text").to_owned()))
            .map(|[what, choice]| (what, choice))
            .collect()
    };
    let plain = choices(&[]);
    for (set, what) in [
        ("contact.boundary=periodic", "transforms"),
        ("joint.hole.diameter=\"1 mm\"", "cells"),
        ("contact.pressure_cap=\"600 MPa\"", "pressure cap"),
        ("contact.transverse=absent", "shear"),
        ("contact.transverse=free", "shear"),
        ("contact.rotation=free", "rotations about x and y"),
        ("motion.phase=\"30 deg\"", ""),
        ("fidelity.cycle=stepped", "fretting cycle"),
        ("motion.normal_load_amplitude=\"1 N\"", "fretting cycle"),
        ("wear.tolerance=0.1", "wear"),
        ("wear.cycles=5", ""),
        ("surface.seed=8", ""),
    ] {
        let changed: Vec<String> = plain
            .iter()
            .zip(choices(&[set]))
            .filter(|(a, b)| **a != *b)
            .map(|(a, _)| a.0.clone())
            .collect();
        let expected: Vec<&str> = [what].into_iter().filter(|w| !w.is_empty()).collect();
        assert_eq!(changed, expected, "{set}");
    }
}

/// The recipe gives a reason for each number that a preset may set, and no reason for a number that the recipe lacks.
#[test]
fn a_recipe_says_where_its_numbers_come_from() {
    let bench = Bench::new();
    let reasons = |sets: &[&str]| {
        let mut arguments = vec!["plan", "small.toml", "--json", "--no-rehearsal"];
        arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
        bench.done(&arguments).json()["recipe"]["why"].clone()
    };
    let plain = reasons(&["fidelity.preset=fast"]);
    assert_eq!(
        plain["fidelity.normal_tolerance"],
        "fidelity.preset = \"fast\""
    );
    assert_eq!(plain["wear.tolerance"], "wear.tolerance is given");
    let asked = reasons(&["fidelity.tolerance=0.02", "fidelity.steps_per_cycle=40"]);
    for (key, reason) in [
        ("fidelity.cycle_tolerance", "fidelity.tolerance = 0.02"),
        (
            "fidelity.steps_per_cycle",
            "fidelity.steps_per_cycle is given",
        ),
        (
            "fidelity.cycle_extrapolation",
            "fidelity.preset = \"balanced\"",
        ),
    ] {
        assert_eq!(asked[key], reason, "{key}");
    }
    // The bodies have equal materials, and the scene has no vibration.
    for key in [
        "fidelity.load_steps",
        "fidelity.aft_samples",
        "fidelity.harmonic_tolerance",
    ] {
        assert!(plain[key].is_null(), "{key}");
    }
}
