//! Tests of the stability check of the explicit wear step in a plan, before the computation.

use std::path::Path;

use serde_json::Value;

use crate::support::Bench;

fn plan(name: &str, sets: &[&str], more: &[&str]) -> Value {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("pipelines/{name}.toml"));
    let mut arguments = vec!["plan", scene.to_str().expect("text"), "--json"];
    arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
    arguments.extend(more);
    Bench::new().done(&arguments).json()
}

fn warnings(plan: &Value) -> usize {
    plan["warnings"].as_array().map_or(0, Vec::len)
}

/// For an explicit step of the published joint on cells of 40 mm/256, the pressure limit from the rehearsal is the closed form.
#[test]
fn a_step_is_judged_by_the_pressures_that_were_rehearsed() {
    // The limit is the same for asperities at GPa and for the worn surface.
    let sets = ["wear.scheme=explicit", "wear.depth_step=10 um"];
    let long = plan("prescribed_fretting", &sets, &[]);
    assert_eq!(warnings(&long), 1);
    let said = long["warnings"][0].as_str().expect("text");
    for words in ["wear.depth_step", "implicit", "from the first step on"] {
        assert!(said.contains(words), "{said}");
    }
    let named: f64 = said
        .split_once("below ")
        .and_then(|(_, rest)| rest.split_once(" Pa"))
        .and_then(|(number, _)| number.parse().ok())
        .expect("a pressure");
    // depth_step = 2 lambda_min p with lambda_min = 8e-13 m/MPa of these cells.
    assert!((named / 6.2e9 - 1.0).abs() < 0.05, "{named}");
}

#[test]
fn a_short_step_is_stable_and_an_implicit_one_always() {
    let short = [
        "wear.scheme=explicit",
        "wear.depth_step=50 nm",
        "wear.cycles=100_000",
    ];
    assert_eq!(warnings(&plan("prescribed_fretting", &short, &[])), 0);
    let implicit = ["wear.depth_step=1 mm", "wear.cycles=100_000"];
    assert_eq!(warnings(&plan("prescribed_fretting", &implicit, &[])), 0);
}

/// A cap bounds the pressure, so the largest stable step is 2 lambda_min p_max, without a rehearsal.
#[test]
fn a_cap_bounds_the_step() {
    let at_once = |depth: &str| {
        let sets = ["fidelity.preset=paper", depth];
        plan("lap_joint_plastic", &sets, &["--no-rehearsal"])
    };
    assert_eq!(warnings(&at_once("wear.depth_step=2 um")), 1);
    assert_eq!(warnings(&at_once("wear.depth_step=0.9 um")), 0);
}

/// The text output of a plan includes the warning, too.
#[test]
fn the_warning_is_printed() {
    let bench = Bench::new();
    let explicit = [
        "--set",
        "wear.scheme=explicit",
        "--set",
        "wear.depth_step=1 mm",
    ];
    let mut arguments = vec!["plan", "small.toml"];
    let plain = bench.done(&arguments).stdout();
    assert!(!plain.contains("warning"), "{plain}");
    arguments.extend(explicit);
    let warned = bench.done(&arguments).stdout();
    assert!(warned.contains("\nwarning: wear.depth_step"), "{warned}");
}
