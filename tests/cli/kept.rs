//! A run stores the original scene, the log, and the version of the program.

use std::fs;

use crate::support::{Bench, SMALL, summary};

const FEW: [&str; 2] = ["--set", "wear.cycles=100_000"];

fn text(bench: &Bench, path: &str) -> String {
    fs::read_to_string(bench.path(path)).expect("a file")
}

#[test]
fn the_scene_is_kept_as_it_was_written() {
    let bench = Bench::new();
    let base = format!("# the joint of the bench\n{SMALL}");
    bench.write("base.toml", &base);
    let own = "base = \"base.toml\"  # all but the load\n[contact]\nnormal_load = \"150 N\"\n";
    bench.write("own.toml", own);
    bench.done(&[&["run", "own.toml", "--run", "a", "--quiet"][..], &FEW].concat());
    let kept = text(&bench, "a/scene.original.toml");
    assert!(kept.starts_with(own), "{kept}");
    assert!(kept.contains("\n# # the joint of the bench\n"), "{kept}");
    assert!(kept.contains("\n# --set wear.cycles=100_000\n"), "{kept}");
    kept.parse::<toml::Table>().expect("TOML");
    // A restart reads the resolved scene. A restart without the scene file does not change `scene.original.toml`.
    assert!(text(&bench, "a/scene.toml").contains("150 N"));
    bench.done(&[
        "run",
        "--run",
        "a",
        "--set",
        "wear.cycles=120_000",
        "--quiet",
    ]);
    assert_eq!(text(&bench, "a/scene.original.toml"), kept);
    // `verify` checks `scene.original.toml`, and the next start writes a damaged or missing file again.
    for replaced in [Some("no TOML ["), None] {
        let file = bench.path("a/scene.original.toml");
        match replaced {
            Some(text) => fs::write(file, text).expect("written"),
            None => fs::remove_file(file).expect("removed"),
        }
        let did = bench.fretwear(&["verify", "a"]);
        assert_eq!(did.code(), 4, "{}", did.stdout());
        assert!(
            did.stdout().contains("scene.original.toml"),
            "{}",
            did.stdout()
        );
        bench.done(&["run", "--run", "a", "--quiet"]);
        assert_eq!(text(&bench, "a/scene.original.toml"), kept);
        bench.done(&["verify", "a"]);
    }
}

#[test]
fn what_was_said_stands_in_the_log_over_all_starts() {
    let bench = Bench::new();
    let run = [&["run", "small.toml", "--run", "a"][..], &FEW].concat();
    let said = bench.done(&run).stderr();
    let log = text(&bench, "a/log.txt");
    for line in said.lines() {
        assert!(log.contains(line), "{line} is not in\n{log}");
    }
    for line in log.lines() {
        let (time, rest) = line.split_once("  ").expect("a time");
        assert!(time.len() == 20 && time.ends_with('Z'), "{line}");
        assert!(!rest.is_empty());
    }
    assert!(log.contains("static_contact of iteration 0"), "{log}");
    // A start with `--quiet` appends to the log, too.
    bench.done(&[&run[..], &["--quiet"]].concat());
    let longer = text(&bench, "a/log.txt");
    assert!(
        longer.starts_with(&log) && longer.len() > log.len(),
        "{longer}"
    );
    assert!(
        longer
            .lines()
            .filter(|line| line.contains("  fretwear 0."))
            .count()
            == 2
    );
    // A log that cannot be written does not change the results.
    fs::remove_file(bench.path("a/log.txt")).expect("removed");
    fs::create_dir(bench.path("b")).expect("a folder");
    bench.done(&[&["run", "small.toml", "--run", "b", "--quiet"][..], &FEW].concat());
    fs::remove_file(bench.path("b/log.txt")).expect("removed");
    bench.done(&["run", "--run", "b", "--quiet"]);
    bench.done(&["verify", "b"]);
}

/// The program appends to the log, so the log must not be a link to another file.
#[cfg(unix)]
#[test]
fn a_log_that_leads_elsewhere_is_refused() {
    let bench = Bench::new();
    let run = [&["run", "small.toml", "--run", "a", "--quiet"][..], &FEW].concat();
    bench.done(&run);
    bench.write("precious", "mine\n");
    for name in ["log.txt", "scene.original.toml"] {
        let path = bench.path("a").join(name);
        fs::remove_file(&path).expect("removed");
        std::os::unix::fs::symlink("../precious", &path).expect("a link");
        let did = bench.fretwear(&run);
        assert_eq!(did.code(), 4, "{name}: {}", did.stderr());
        assert_eq!(text(&bench, "precious"), "mine\n");
        fs::remove_file(&path).expect("removed");
    }
}

#[test]
fn a_run_says_when_and_by_what_it_was_begun() {
    let bench = Bench::new();
    bench.done(&[&["run", "small.toml", "--run", "a", "--quiet"][..], &FEW].concat());
    // The last line of `run.json` contains the hash of the file.
    let record = text(&bench, "a/run.json");
    let began = record.split("\"began\"").nth(1).expect("a date");
    let began = began.split('"').nth(1).expect("a text");
    assert!(began.starts_with("20") && began.ends_with('Z'), "{began}");
    let short = bench.done(&["-V"]).stdout();
    assert_eq!(short, format!("fretwear {}\n", env!("CARGO_PKG_VERSION")));
    let long = bench.done(&["--version"]).stdout();
    assert_eq!(long, format!("fretwear {}\n", fretwear::VERSION));
    match fretwear::COMMIT {
        Some(commit) => {
            assert!(long.contains(commit), "{long}");
            assert!(record.contains(commit), "{record}");
        }
        None => assert!(!record.contains("program_commit"), "{record}"),
    }
}

#[test]
fn a_run_keeps_the_accuracy_that_it_began_with() {
    let bench = Bench::new();
    let (given, open) = ("tolerance = 1e-3\n", "");
    assert!(SMALL.contains(given));
    bench.write("open.toml", SMALL.replace(given, open));
    let run = ["run", "open.toml", "--run", "a", "--set"];
    let with = |more: &[&str]| bench.fretwear(&[&run[..], more].concat());
    let began = with(&["wear.cycles=1000", "--set", "wear.tolerance=0.02"]);
    assert_eq!(began.code(), 0, "{}", began.stderr());
    let told = "note: wear.tolerance=0.02, as at the start of a: the scene does not give it";
    // The first restart takes the key from the run and stores it in the scene; the second restart reads the stored key.
    for cycles in ["wear.cycles=1100", "wear.cycles=1200"] {
        let gone_on = with(&[cycles]);
        assert_eq!(gone_on.code(), 0, "{}", gone_on.stderr());
        assert!(gone_on.stderr().contains(told), "{}", gone_on.stderr());
    }
    assert!(text(&bench, "a/scene.toml").contains("tolerance = 0.02"));
    // A different value in the scene changes the scene under both names of the key.
    for given in ["wear.tolerance=0.03", "fidelity.wear_tolerance=0.03"] {
        let refused = with(&[given]);
        assert_eq!(refused.code(), 4, "{}", refused.stderr());
        let named = "`wear.tolerance` was 0.02, is 0.03";
        assert!(refused.stderr().contains(named), "{}", refused.stderr());
    }
}

/// Small scene whose wear coefficient has a unit that both wear laws accept.
fn of_both_laws(law: &str) -> String {
    let given = "coefficient = \"2e3 um^3/J\"\n";
    assert!(SMALL.contains(given));
    SMALL.replace(given, &format!("coefficient = \"2e-9 mm^3/(N mm)\"\n{law}"))
}

#[test]
fn archards_law_wears_by_the_friction_coefficient_more() {
    let bench = Bench::new();
    for law in ["energy", "archard"] {
        bench.write("law.toml", of_both_laws(&format!("law = \"{law}\"\n")));
        bench.done(&[
            "run",
            "law.toml",
            "--run",
            law,
            "-q",
            "--set",
            "wear.cycles=2000",
        ]);
    }
    // Both wear laws give the same first cycle, and wear of few cycles hardly changes the following cycles.
    for (iteration, column, error) in [(0, "wear_rate", 1e-12), (1, "wear_volume", 1e-3)] {
        let [energy, archard] =
            ["energy", "archard"].map(|law| summary(&bench.path(law), iteration, column));
        let ratio = archard / energy;
        assert!((0.6 * ratio - 1.0).abs() < error, "{column}: {ratio}");
    }
    let kept = text(&bench, "archard/scene.toml");
    assert!(kept.contains("law = \"archard\""), "{kept}");
}
