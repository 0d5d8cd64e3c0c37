//! Tests of `fretwear doctor` on this machine and with injected failures.

mod orders;

use std::fs;
use std::path::Path;

use fretwear::doctor::closed_forms::{CASES, Measure, RESOLUTION};
use fretwear::doctor::{Check, State, examine};
use fretwear::store::{FileSystem, RealFileSystem};
use serde_json::Value;

use crate::support::Bench;
use crate::support::faulty::{Fault, FaultyFileSystem};

const NAMES: [&str; 20] = [
    "free space",
    "commit",
    "lock",
    "Parquet",
    "processor",
    "transforms",
    "linear algebra",
    "Hertz: approach",
    "Hertz: peak pressure",
    "Hertz: normal stiffness",
    "circular punch: normal stiffness",
    "circular punch: stiffness along x",
    "capped Hertz: plateau radius",
    "capped Hertz: approach",
    "Westergaard: mean gap",
    "Cattaneo-Mindlin: force",
    "Cattaneo-Mindlin: energy per cycle",
    "Jenkins oscillator: force",
    "Jenkins oscillator: angular frequency",
    "cache",
];

fn found<'a>(checks: &'a [Check], name: &str) -> &'a Check {
    checks
        .iter()
        .find(|check| check.name == name)
        .unwrap_or_else(|| panic!("no {name} in {checks:?}"))
}

fn look(fs: &dyn FileSystem, folder: &Path) -> Vec<Check> {
    examine(fs, folder, None)
}

#[test]
fn a_sound_machine_passes_and_nothing_is_left_behind() {
    let bench = Bench::new().sharing();
    let before: Vec<_> = fs::read_dir(bench.path(".")).expect("a folder").collect();
    let did = bench.done(&["doctor"]);
    for name in NAMES {
        assert!(did.stdout().contains(name), "{}", did.stdout());
    }
    assert!(!did.stdout().contains("failed"), "{}", did.stdout());
    let after: Vec<_> = fs::read_dir(bench.path(".")).expect("a folder").collect();
    assert_eq!(before.len(), after.len(), "{after:?}");

    let object = bench.done(&["doctor", ".", "--json"]).json();
    assert_eq!(object["sound"], true);
    let checks = object["checks"].as_array().expect("checks");
    assert!(checks.iter().map(|c| &c["name"]).eq(NAMES.iter()));
    let number = |name: &str, value: &str| {
        let check = checks.iter().find(|c| c["name"] == name).expect("a check");
        let number = check["numbers"][value].as_f64();
        number.unwrap_or_else(|| panic!("no {value} in {check}"))
    };
    assert!(number("free space", "bytes") > 1e6);
    assert!((1e-5..1.0).contains(&number("transforms", "seconds_of_pair")));
    assert!((0.0..1e-12).contains(&number("transforms", "relative_error")));
    assert!((0.0..1e-12).contains(&number("linear algebra", "residual_lu")));
    assert!((0.0..1e-12).contains(&number("linear algebra", "residual_cholesky")));
    assert!(number("processor", "threads") >= 1.0);
    assert!((0.0..60.0).contains(&number("commit", "seconds")));
    assert_eq!(number("cache", "structures"), 0.0);
}

#[test]
fn a_value_beyond_its_tolerance_fails() {
    let mut checked = 0;
    for (name, solve) in CASES {
        let measures = solve(RESOLUTION).unwrap_or_else(|error| panic!("{name}: {error}"));
        for measure in measures {
            let Some(tolerance) = measure.tolerance else {
                assert_eq!(measure.check(), None);
                continue;
            };
            let state_of = |measure: Measure| measure.check().expect("a check").state;
            let computed = |error: f64| {
                let computed = (1.0 + error) * measure.exact;
                state_of(Measure::value(measure.name, computed, measure.exact).within(tolerance))
            };
            for error in [1.01 * tolerance, -1.01 * tolerance, -2.0, f64::NAN] {
                assert_eq!(computed(error), State::Failed, "{}: {error}", measure.name);
            }
            assert_eq!(computed(0.99 * tolerance), State::Ok);
            assert_eq!(state_of(measure), State::Ok);
            checked += 1;
        }
    }
    assert_eq!(checked, 12);
}

#[test]
fn the_cache_is_measured_and_may_be_switched_off() {
    let folder = tempfile::tempdir().expect("a folder");
    let cache = folder.path().join("cache");
    fs::create_dir_all(cache.join("abc")).expect("a folder");
    fs::write(cache.join("abc/table.parquet"), [0; 1234]).expect("written");
    let checks = examine(&RealFileSystem, folder.path(), Some(&cache));
    let check = found(&checks, "cache");
    assert_eq!(check.state, State::Ok);
    assert_eq!(check.numbers["bytes"], 1234.0);
    assert_eq!(check.numbers["structures"], 1.0);
    let checks = look(&RealFileSystem, folder.path());
    let check = found(&checks, "cache");
    assert_eq!(check.state, State::Warning);
    assert!(
        check
            .advice
            .as_ref()
            .expect("advice")
            .contains("FRETWEAR_CACHE")
    );
}

#[test]
fn little_room_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    for (free, state) in [
        (1 << 40, State::Ok),
        (500_000_000, State::Warning),
        (1_000_000, State::Failed),
    ] {
        let checks = look(&FaultyFileSystem::with_free_space(free), folder.path());
        assert_eq!(found(&checks, "free space").state, state, "{free}");
    }
}

/// The test file system grants every lock.
#[test]
fn a_lock_that_two_can_take_fails() {
    let folder = tempfile::tempdir().expect("a folder");
    let checks = look(&FaultyFileSystem::sound(), folder.path());
    let lock = found(&checks, "lock");
    assert_eq!(
        (lock.state, &lock.found[..]),
        (State::Failed, "taken twice")
    );
}

#[test]
fn some_calls_that_fail_are_told() {
    failing_calls_are_told(5);
}

#[test]
#[ignore = "long: all checks for each call to the file system"]
fn every_call_that_fails_is_told() {
    failing_calls_are_told(1);
}

/// If a call of the file system fails, at least one check fails and reports the reason.
fn failing_calls_are_told(stride: usize) {
    let folder = tempfile::tempdir().expect("a folder");
    let sound = FaultyFileSystem::sound();
    look(&sound, folder.path());
    let calls = sound.calls(Fault::Error);
    assert!(calls > 50, "{calls}");
    for call in (1..=calls).step_by(stride) {
        let checks = look(
            &FaultyFileSystem::failing(call, Fault::Error),
            folder.path(),
        );
        let told = checks
            .iter()
            .any(|check| check.state == State::Failed && check.found.contains("injected"));
        assert!(told, "call {call}: {checks:?}");
        // Each examination starts in an empty folder.
        for entry in fs::read_dir(folder.path()).expect("a folder") {
            drop(fs::remove_dir_all(entry.expect("an entry").path()));
        }
    }
}

#[test]
fn a_file_is_no_folder_for_runs() {
    let bench = Bench::new();
    let did = bench.fretwear(&["doctor", "small.toml", "--json"]);
    assert_eq!(did.code(), 1);
    assert_eq!(did.json()["sound"], Value::Bool(false));
    let check = &did.json()["checks"][0];
    assert_eq!(check["state"], "failed");
    assert!(check["found"].to_string().contains("is a file"), "{check}");
    assert!(check["advice"].is_string());
}
