//! What a plan expects of a run against what the run has cost, as `run --json` tells both.
//!
//! The scenes here have a few hundred to a few thousand cells, and a handful of asperities: chance is larger in them than in those
//! of tens of thousands of cells, where plans are within some 10 %.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use crate::support::Bench;

/// Factors by which pairs, iterations and disk may be off on scenes of thousands of cells, and of hundreds.
const SMALL: f64 = 1.45;
const TINY: f64 = 2.5;

fn ran(bench: &Bench, scene: &str, sets: &[&str], more: &[&str]) -> Value {
    let mut arguments = vec!["run", scene, "--json", "--run", "run"];
    arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
    arguments.extend(more);
    bench.done(&arguments).json()["cost"].clone()
}

fn pipeline(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines");
    let path = folder.join(format!("{name}.toml"));
    path.to_str().expect("text").to_owned()
}

/// The words of a case, the sides of a number of its cost, and by which factor they may differ.
fn hold(case: &str, cost: &Value, name: &str, factor: f64) {
    let side = |side: &str| cost[side][name].as_f64().expect("a number");
    let (predicted, actual) = (side("predicted"), side("actual"));
    assert!(
        predicted <= factor * actual && actual <= factor * predicted,
        "{case}: {name} {predicted} predicted, {actual} actual"
    );
}

/// Kinds of scenes.
#[test]
fn plans_expect_what_runs_cost() {
    let small = "small.toml".to_owned();
    let long = "wear.cycles=6_000_000";
    for (scene, sets) in [
        (small.clone(), vec![]),
        (small.clone(), vec![long, "wear.tolerance=0.01"]),
        (small.clone(), vec!["contact.transverse=absent"]),
        (small.clone(), vec!["contact.boundary=periodic"]),
        (
            small.clone(),
            vec!["motion.amplitude=4 um", "wear.tolerance=0.01"],
        ),
        (
            small.clone(),
            vec!["fidelity.cycle=stepped", "wear.tolerance=0.05"],
        ),
        (
            small.clone(),
            vec![
                "surface.kind=exponential",
                "surface.rq=0.5 um",
                "surface.correlation_length=0.4 mm",
            ],
        ),
        (pipeline("hertz_fretting"), vec![]),
        (pipeline("static_contact"), vec!["joint.grid=[96, 80]"]),
        (pipeline("prescribed_fretting"), vec!["joint.grid=[72, 60]"]),
        (pipeline("measured_surface"), vec!["joint.grid=[96, 72]"]),
    ] {
        let cost = ran(&Bench::new(), &scene, &sets, &[]);
        let case = format!("{scene} {sets:?}");
        let factor = if scene == small { TINY } else { SMALL };
        hold(&case, &cost, "fft_pairs", factor);
        hold(&case, &cost, "disk_bytes", factor);
        if cost["actual"]["wear_iterations"] != 0 {
            hold(&case, &cost, "wear_iterations", factor);
        }
        // The stages that cost pairs are those that the plan names.
        let stages = |side: &str| -> BTreeSet<String> {
            let pairs = cost[side]["fft_pairs_by_stage"]
                .as_object()
                .expect("stages");
            let some = pairs.iter().filter(|(_, v)| v.as_f64() > Some(0.0));
            some.map(|(stage, _)| stage.clone()).collect()
        };
        assert_eq!(stages("predicted"), stages("actual"), "{case}");
    }
}

/// A vibration moves the joint as far as it does: that is not known before, but about.
#[test]
fn a_plan_expects_what_a_vibrating_run_costs() {
    let cost = ran(&Bench::new(), "resonator.toml", &[], &[]);
    for name in ["fft_pairs", "wear_iterations"] {
        hold("resonator", &cost, name, TINY);
    }
    hold("resonator", &cost, "disk_bytes", TINY);
}

/// The truth is that of all starts, whatever the last of them did.
#[test]
fn a_run_in_pieces_has_cost_what_one_in_one_piece_has() {
    let whole = ran(&Bench::new(), "small.toml", &[], &[]);
    let bench = Bench::new();
    let stopped = ["run", "small.toml", "--run", "run", "--max-wall", "1 us"];
    while bench.fretwear(&stopped).code() == 75 {}
    let pieces = ran(&bench, "small.toml", &[], &[]);
    for name in ["wear_iterations", "pruned_iterations", "fft_pairs_by_stage"] {
        assert_eq!(pieces["actual"][name], whole["actual"][name], "{name}");
    }
    // What a run with other iterations kept does not know, it says.
    let sparse = ran(
        &Bench::new(),
        "small.toml",
        &["output.keep={ last = 1 }"],
        &[],
    );
    assert_eq!(
        sparse["actual"]["pruned_iterations"].as_u64(),
        // The unworn state and the last stay.
        whole["actual"]["wear_iterations"].as_u64().map(|n| n - 1)
    );
}

/// A person sees both at the end, and a plan without the run only what is expected.
#[test]
fn both_are_told() {
    let bench = Bench::new();
    let told = bench.done(&["run", "small.toml", "--run", "run"]).stderr();
    let line = told
        .lines()
        .find(|line| line.trim_start().starts_with("cost"))
        .expect("a line on cost");
    for word in ["iterations (expected", "FFT pairs (", " s (", "of disk ("] {
        assert!(line.contains(word), "{line}");
    }
    let planned = bench.done(&["plan", "small.toml"]).stdout();
    for word in ["iterations    about", "FFT pairs     about", "disk", "time"] {
        assert!(planned.contains(word), "{word}: {planned}");
    }
}
