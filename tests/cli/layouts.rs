//! The program rejects a run with another layout or with an unknown plan, and does not change the run.

use std::fs;
use std::path::Path;

use fretwear::store::LAYOUT;
use serde_json::{Value, json};

use crate::support::{Bench, every_file, forge_record};

const DAMAGED: i32 = 4;

/// A finished run `a` without its lock and log files.
fn bench() -> Bench {
    let bench = Bench::new();
    let few = ["--set", "wear.cycles=2000", "-q"];
    bench.done(&[&["run", "small.toml", "--run", "a"], &few[..]].concat());
    fs::remove_file(bench.path("a/lock")).expect("removed");
    bench
}

/// Runs a command and checks that the program rejects the run with one error that contains all `parts`, and does not change the run.
fn rejected(bench: &Bench, command: &[&str], parts: &[&str]) {
    let root = bench.path("a");
    let before = every_file(&root);
    let did = bench.fretwear(command);
    let said = did.stderr();
    assert_eq!(did.code(), DAMAGED, "{command:?}: {said}");
    for part in parts {
        assert!(said.contains(part), "{command:?}: no {part:?} in {said}");
    }
    assert_eq!(said.matches("error: ").count(), 1, "{command:?}: {said}");
    assert!(every_file(&root) == before, "{command:?} changed the run");
}

/// Commands that read the plan of a run. `report` needs Polars.
fn readers() -> Vec<Vec<&'static str>> {
    let mut commands = vec![vec!["status", "a"], vec!["export", "a", "--vtu", "vtu"]];
    if cfg!(feature = "polars") {
        commands.push(vec!["report", "a"]);
    }
    commands
}

#[test]
fn a_run_of_another_layout_is_rejected_and_stays_as_it_is() {
    let bench = bench();
    for other in [0, LAYOUT - 1, LAYOUT + 1] {
        forge_record(&bench.path("a"), |record| {
            record["format"] = json!(other);
            record["program_version"] = json!("9.9.9");
        });
        let said = format!(
            "this program reads only layout {LAYOUT}: continue the run with the program that made it, or start a new run in another folder"
        );
        let mut commands = readers();
        if cfg!(feature = "polars") {
            commands.push(vec!["compare", "a"]);
        }
        commands.push(vec!["verify", "a"]);
        commands.push(vec!["run", "--run", "a"]);
        commands.push(vec!["run", "small.toml", "--run", "a"]);
        commands.push(vec!["run", "small.toml", "--from", "a@0", "--run", "b"]);
        commands.push(vec!["stage", "wear", "--run", "a@1", "-o", "tables"]);
        for command in commands {
            rejected(&bench, &command, &[&said]);
        }
        assert!(!bench.path("b").exists(), "`run --from` created a run");
        let listed = bench.done(&["status", "."]).stdout();
        assert!(listed.contains("has layout"), "{listed}");
    }
}

/// Files of another layout may lack the hash in the last line and the version of the program.
#[test]
fn another_layout_may_have_any_form() {
    let bench = bench();
    let record = bench.path("a/run.json");
    fs::remove_file(bench.path("a/run.copy.json")).expect("removed");
    fs::write(&record, "{\"format\": 1}").expect("written");
    let said = "the run a has layout 1; this program reads only layout";
    rejected(&bench, &["status", "a"], &[said]);
    rejected(&bench, &["run", "--run", "a"], &[said]);
}

/// Text of the plan of `a` after `change`.
fn plan(root: &Path, change: impl FnOnce(&mut Value)) -> String {
    let text = fs::read_to_string(root.join("plan.json")).expect("a plan");
    let mut plan = serde_json::from_str(&text).expect("JSON");
    change(&mut plan);
    plan.to_string()
}

#[test]
fn a_plan_that_this_program_does_not_write_is_rejected() {
    let bench = bench();
    let root = bench.path("a");
    let sound = fs::read(root.join("plan.json")).expect("a plan");
    let hash = |text: &[u8]| blake3::hash(text).to_hex().to_string();
    let remove = |at: &'static str, key: &'static str| {
        move |plan: &mut Value| {
            let object = plan.pointer_mut(at).expect("an object");
            let object = object.as_object_mut().expect("an object");
            assert!(object.remove(key).is_some());
        }
    };
    let add = |at: &'static str| {
        move |plan: &mut Value| plan.pointer_mut(at).expect("an object")["cost"] = json!(12.5)
    };
    let cases = [
        ("{".to_owned(), "EOF"),
        ("[1]".to_owned(), "invalid"),
        (plan(&root, remove("", "recipe")), "missing field `recipe`"),
        (
            plan(&root, remove("", "warnings")),
            "missing field `warnings`",
        ),
        (
            plan(&root, remove("/recipe", "joints")),
            "missing field `joints`",
        ),
        (
            plan(&root, remove("/recipe", "structure")),
            "missing field `recipe.structure`",
        ),
        (
            plan(&root, remove("/recipe/joints/0/contact", "pressure_cap")),
            "missing field `recipe.joints[0].contact.pressure_cap`",
        ),
        (
            plan(&root, remove("/recipe/joints/0/contact", "stiffness")),
            "missing field `stiffness`",
        ),
        (plan(&root, add("")), "unknown field `cost`"),
        (
            plan(&root, add("/recipe/joints/0/surface/heights")),
            "unknown field `recipe.joints[0].surface.heights.cost`",
        ),
    ];
    for (text, named) in cases {
        fs::write(root.join("plan.json"), &text).expect("written");
        forge_record(&root, |record| {
            record["plan_hash"] = json!(hash(text.as_bytes()))
        });
        let file = Path::new("a").join("plan.json").display().to_string();
        let version = format!("fretwear {}", env!("CARGO_PKG_VERSION"));
        let said = [&*file, "cannot read", named, &version];
        let mut commands = readers();
        commands.push(vec!["run", "--run", "a"]);
        commands.push(vec![
            "run",
            "small.toml",
            "--run",
            "a",
            "--set",
            "wear.cycles=2000",
        ]);
        for command in commands {
            rejected(&bench, &command, &said);
        }
        // `run.json` has the hash of another plan, so the plan is damaged: readers reject the run, and `run` writes the plan again.
        forge_record(&root, |record| record["plan_hash"] = json!(hash(&sound)));
        rejected(&bench, &["status", "a"], &said);
        bench.done(&["run", "--run", "a", "-q"]);
        fs::remove_file(root.join("lock")).expect("removed");
        assert_eq!(fs::read(root.join("plan.json")).expect("a plan"), sound);
        bench.done(&["status", "a"]);
    }
    // The plan is valid, but differs from the plan that the run wrote.
    let edited = plan(&root, |plan| {
        plan["recipe"]["wear"]["tolerance"] = json!(0.5)
    });
    fs::write(root.join("plan.json"), edited).expect("written");
    for command in readers() {
        rejected(&bench, &command, &["plan.json", "content has hash"]);
    }
    fs::remove_file(root.join("plan.json")).expect("removed");
    rejected(&bench, &["status", "a"], &["plan.json", "missing"]);
}
