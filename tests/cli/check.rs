//! `fretwear check`: all that is wrong, at once; and what `plan` and `run` refuse before there is a folder.

use crate::support::{Bench, SMALL};

/// Six mistakes of six kinds, in four sections.
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
    // By line, and last what stands nowhere. What is spelt wrong is not missing too.
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
    // The others say the same.
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

/// What a run would find out when it is there already is found by its plan.
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
