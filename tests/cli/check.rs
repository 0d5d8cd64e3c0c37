//! Tests of `fretwear check`, which reports all errors of a scene, and of the errors of `plan` and `run` before a run folder exists.

use fretwear::tables::TableName;

use crate::support::{Bench, SMALL, latest, table};

/// Scene with six errors of six kinds in four sections.
fn broken() -> String {
    SMALL
        .replace("rq = \"1 um\"", "rq = \"1 um/s\"")
        .replace("normal_load = \"200 N\"", "normal_load = \"-200 N\"")
        .replace("friction_coefficient", "friction_coeficient")
        .replace("correlation_length = [\"0.5 mm\", \"0.4 mm\"]\n", "")
        .replace("cycles = 600_000\n", "")
        .replace("[output]", "[fidelity]\npreset = \"exact\"\n[output]")
}

#[test]
fn all_errors_of_a_scene_are_said_at_once() {
    let bench = Bench::new();
    bench.write("broken.toml", broken());
    let did = bench.fretwear(&["check", "broken.toml", "small.toml", "--json"]);
    assert_eq!(did.code(), 2, "{}", did.stderr());
    let lines: Vec<serde_json::Value> = did
        .stdout()
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    assert_eq!(lines.len(), 2);
    let errors = lines[0]["errors"].as_array().expect("a list");
    let keys: Vec<&str> = errors
        .iter()
        .map(|error| error["key"].as_str().expect("a key"))
        .collect();
    // `check` sorts errors by line, and reports missing keys last. A misspelt key is not reported as missing, too.
    assert_eq!(
        keys,
        [
            "surface.rq",
            "contact.friction_coeficient",
            "contact.normal_load",
            "fidelity.preset",
            "surface.correlation_length",
            "wear.cycles",
        ],
        "{errors:#?}"
    );
    assert_eq!(errors[2]["line"], 14, "{errors:#?}");
    assert_eq!(errors[2]["value"], "\"-200 N\"");
    let message = errors[2]["message"].as_str().expect("a text");
    assert!(message.contains("greater than zero"), "{message}");
    assert_eq!(lines[1]["errors"], serde_json::json!([]));
    assert_eq!(lines[1]["warnings"], serde_json::json!([]));
    // The text output and the other commands report the same errors.
    let words = bench.fretwear(&["check", "broken.toml"]).stdout();
    assert!(words.ends_with("broken.toml: 6 errors\n"), "{words}");
    for command in [&["plan", "broken.toml"][..], &["run", "broken.toml"]] {
        let did = bench.fretwear(command);
        assert_eq!(did.code(), 2);
        assert_eq!(
            did.stderr().matches("error: ").count(),
            6,
            "{}",
            did.stderr()
        );
    }
    assert!(!bench.path("runs").exists());
}

#[test]
fn what_can_be_run_is_warned_of_and_no_error() {
    let bench = Bench::new();
    let sets = ["--set", "wear.coefficient=2e3 mm^3/J"];
    let did = bench.fretwear(&[&["check", "small.toml"][..], &sets].concat());
    assert_eq!(did.code(), 0, "{}", did.stdout());
    assert!(
        did.stdout().contains("wear.coefficient"),
        "{}",
        did.stdout()
    );
    assert!(did.stdout().contains("can be run"), "{}", did.stdout());
    assert_eq!(bench.fretwear(&["check", "nowhere.toml"]).code(), 2);
}

/// `plan` reports all errors that `run` would report.
#[test]
fn a_plan_refuses_what_a_run_refuses_and_no_folder_is_left() {
    let bench = Bench::new();
    for (set, named) in [
        ("surface.correlation_length=1 m", "correlation length"),
        ("contact.normal_load=1e300 N", "contact.normal_load"),
        ("joint.grid=[2, 2]", "surface.correlation_length"),
        ("motion.history=nowhere.csv", "nowhere.csv"),
    ] {
        for command in ["check", "plan", "run"] {
            let did = bench.fretwear(&[command, "small.toml", "--set", set]);
            assert_eq!(did.code(), 2, "{command} {set}: {}", did.stderr());
            let said = did.stdout() + &did.stderr();
            assert!(said.contains(named), "{command} {set}: {said}");
        }
        assert!(!bench.path("runs").exists(), "{set}");
    }
}

/// At the start, a run prints plausibility checks; at the end, the run warns of unrealistic pressures.
#[test]
fn a_run_says_what_to_look_at() {
    let bench = Bench::new();
    let rough = [
        "--set",
        "surface.rq=60 um",
        "--set",
        "contact.normal_load=2 kN",
    ];
    let did = bench.done(&[&["run", "small.toml", "--run", "a"][..], &rough].concat());
    let said = did.stderr();
    let place = |text: &str| said.find(text).unwrap_or_else(|| panic!("{text}: {said}"));
    assert!(place("begins ") < place("plausibility checks, by rules of thumb"));
    assert!(
        place("plausibility checks, by rules of thumb") < place("number of cells that touch: some")
    );
    let end = did.stdout();
    for text in [
        "largest pressure, unworn",
        "note: the largest pressure of",
        "slip over a cell",
        "deepest wear over Rq",
    ] {
        assert!(end.contains(text), "{text}: {end}");
    }
    let status = bench.done(&["status", "a"]).stdout();
    assert!(status.contains("largest pressure, unworn"), "{status}");
    // A restart and `--quiet` do not print the plausibility checks.
    let again = bench.done(&[&["run", "small.toml", "--run", "a"][..], &rough].concat());
    assert!(!again.stderr().contains("plausibility checks"));
    let quiet = bench.done(&["run", "small.toml", "--run", "b", "--quiet"]);
    assert!(!quiet.stderr().contains("plausibility checks"));
    // Cells without contact move more than cells in contact, but do not rub.
    let root = bench.path("b");
    let fields = table(&root, latest(&root), TableName::ContactField);
    let column = |name: &str| fields.f64(name).expect("a column");
    let all = || column("slip_path").iter().zip(column("pressure"));
    let largest = |paths: &mut dyn Iterator<Item = &f64>| paths.copied().fold(0.0, f64::max);
    let touching = largest(&mut all().filter(|(_, p)| **p > 0.0).map(|(path, _)| path));
    assert!(0.0 < touching && touching < largest(&mut all().map(|(path, _)| path)));
    let told = format!("half range of {:.3} µm over", touching / 4.0 * 1e6);
    let end = quiet.stdout();
    assert!(end.contains(&told), "{told}: {end}");
}

/// If the size of the joint does not fit the hole, the error names the implausible dimension.
#[test]
fn a_size_that_does_not_fit_its_hole_is_named() {
    let shipped = |name: &str| format!("{}/pipelines/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let bench = Bench::new();
    for (name, set, key) in [
        ("lap_joint", "joint.size=[\"40 m\", \"40 m\"]", "joint.size"),
        (
            "lap_joint",
            "joint.size=[\"40 um\", \"40 um\"]",
            "joint.size",
        ),
        (
            "lap_joint",
            "joint.hole.diameter=11 um",
            "joint.hole.diameter",
        ),
        (
            "lap_joint",
            "joint.hole.diameter=11 m",
            "joint.hole.diameter",
        ),
    ] {
        let did = bench.fretwear(&["check", &shipped(name), "--json", "--set", set]);
        let found: serde_json::Value = serde_json::from_str(&did.stdout()).expect("JSON");
        assert_eq!(found["errors"][0]["key"], key, "{set}: {found}");
    }
}
