//! What a plan says of the stability of the explicit wear step, before anything is computed.

use std::path::Path;

use serde_json::Value;

use crate::support::Bench;

fn plan(name: &str, sets: &[&str]) -> Value {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("pipelines/{name}.toml"));
    let mut arguments = vec!["plan", scene.to_str().expect("text"), "--json"];
    arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
    Bench::new().done(&arguments).json()
}

fn choice(plan: &Value) -> Option<&str> {
    let decisions = plan["decisions"].as_array().expect("a list");
    let about = |d: &&Value| d["what"] == "stability of the explicit step";
    decisions.iter().find(about)?["choice"].as_str()
}

fn warnings(plan: &Value) -> usize {
    plan["warnings"].as_array().map_or(0, Vec::len)
}

/// The published step, 0.1 um on cells of 40 mm/256: stable on asperities of GPa, and not on the worn plateaus of some 60 MPa.
#[test]
fn the_published_step_becomes_unstable() {
    let published = plan("lap_joint", &["fidelity.preset=paper"]);
    assert_eq!(
        choice(&published),
        Some("stable at first, beyond stability once wear has spread the load")
    );
    assert_eq!(warnings(&published), 1);
    let said = published["warnings"][0].as_str().expect("text");
    assert!(
        said.contains("wear.depth_step") && said.contains("implicit"),
        "{said}"
    );
    let named: f64 = said
        .split_once("below ")
        .and_then(|(_, rest)| rest.split_once(" Pa"))
        .and_then(|(number, _)| number.parse().ok())
        .expect("a pressure");
    // depth_step = 2 lambda_min p with lambda_min = 8e-13 m/MPa of these cells.
    assert!((named / 6.2e7 - 1.0).abs() < 0.05, "{named}");
}

#[test]
fn a_short_step_is_stable_and_an_implicit_one_always() {
    let short = plan(
        "lap_joint",
        &["fidelity.preset=paper", "wear.depth_step=1 nm"],
    );
    assert_eq!((choice(&short), warnings(&short)), (Some("stable"), 0));
    let implicit = plan("lap_joint", &["wear.depth_step=1 mm"]);
    assert_eq!((choice(&implicit), warnings(&implicit)), (None, 0));
}

/// A cap bounds the pressure, and with it the step, to the number: 2 lambda_min p_max.
#[test]
fn a_cap_bounds_the_step() {
    let sets = ["fidelity.preset=paper", "wear.depth_step=2 um"];
    let capped = plan("lap_joint_plastic", &sets);
    assert_eq!(
        choice(&capped),
        Some("beyond stability from the first step on")
    );
    assert_eq!(warnings(&capped), 1);
}

/// A person sees the warning too.
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
