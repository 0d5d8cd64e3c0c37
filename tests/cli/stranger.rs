//! Tests of run folders that another person has edited, damaged or prepared as an attack.

use std::fs;

use crate::support::{Bench, Did, flip, latest};

const FEW_CYCLES: [&str; 2] = ["--set", "wear.cycles=100_000"];

/// A bench with the finished run `a`.
fn finished() -> Bench {
    let bench = Bench::new();
    bench.done(&[&["run", "small.toml", "--run", "a"][..], &FEW_CYCLES].concat());
    bench
}

fn go_on(bench: &Bench) -> Did {
    bench.fretwear(&["run", "--run", "a"])
}

#[test]
fn a_lost_scene_is_taken_from_the_record() {
    let bench = finished();
    let scene = bench.path("a/scene.toml");
    let text = fs::read_to_string(&scene).expect("a file");
    fs::remove_file(&scene).expect("removed");
    bench.done(&["status", "a"]);
    let did = go_on(&bench);
    assert_eq!(did.code(), 0, "{}", did.stderr());
    assert_eq!(fs::read_to_string(&scene).expect("a file"), text);
    fs::remove_file(&scene).expect("removed");
    bench.done(&["run", "--from", "a@1", "--until", "static_contact"]);
}

/// A run accepts an edited scene if the edit does not change the computed iterations; otherwise the run rejects the scene.
#[test]
fn an_edited_scene_is_gone_on_with_or_told() {
    let bench = finished();
    let scene = bench.path("a/scene.toml");
    let text = fs::read_to_string(&scene).expect("a file");
    let before = latest(&bench.path("a"));
    let longer = text.replace("cycles = 100000", "cycles = 130000");
    assert_ne!(longer, text);
    fs::write(&scene, &longer).expect("written");
    let did = go_on(&bench);
    assert_eq!(did.code(), 0, "{}", did.stderr());
    assert!(did.stderr().contains("`wear.cycles` was 100000, is 130000"));
    assert!(latest(&bench.path("a")) > before);

    let stiffer = longer.replace("198.4 GPa", "210 GPa");
    assert_ne!(stiffer, longer);
    for (edited, code) in [(stiffer.as_str(), 4), ("[joint", 2), ("[jiont]\n", 2)] {
        fs::write(&scene, edited).expect("written");
        let did = go_on(&bench);
        assert_eq!(did.code(), code, "{}", did.stderr());
        assert!(did.stderr().contains("remove "), "{}", did.stderr());
        assert_eq!(fs::read_to_string(&scene).expect("a file"), edited);
        fs::remove_file(&scene).expect("removed");
        assert_eq!(go_on(&bench).code(), 0);
    }
}

/// The stored scene of a run must not refer to a base file, because the base could be a private file of the reader.
#[test]
fn a_kept_scene_has_no_base() {
    let bench = finished();
    bench.write("private.toml", "password = 1\n");
    let scene = bench.path("a/scene.toml");
    let text = fs::read_to_string(&scene).expect("a file");
    fs::write(&scene, format!("base = \"../private.toml\"\n{text}")).expect("written");
    for command in [&["run", "--run", "a"][..], &["run", "--from", "a@1"]] {
        let did = bench.fretwear(command);
        assert_eq!(did.code(), 2, "{}", did.stderr());
        assert!(
            did.stderr().contains("must not have a base"),
            "{}",
            did.stderr()
        );
        assert!(!did.stderr().contains("password"), "{}", did.stderr());
    }
}

#[test]
fn verify_names_every_file_that_was_touched() {
    let bench = finished();
    for file in [
        "plan.json",
        "run.json",
        "scene.toml",
        "schemas.json",
        "history.parquet",
        "once/surface.json",
    ] {
        flip(&bench.path("a").join(file));
        let did = bench.fretwear(&["verify", "a"]);
        assert_eq!(did.code(), 4, "{file}: {}", did.stdout());
        assert!(did.stdout().contains(&format!("{file}: content has hash")));
        // The scene `small.toml` is the scene of the run, so the run repairs its files.
        bench.done(&[&["run", "small.toml", "--run", "a"][..], &FEW_CYCLES].concat());
        bench.done(&["verify", "a"]);
    }
}

#[cfg(unix)]
#[test]
fn nothing_outside_of_a_run_is_touched() {
    use std::os::unix::fs::symlink;
    let bench = finished();
    fs::create_dir(bench.path("victim")).expect("a folder");
    let precious = bench.write("victim/results.csv", "a month of measurements");
    fs::remove_dir_all(bench.path("a/staging")).expect("removed");
    symlink("../victim", bench.path("a/staging")).expect("a link");
    for command in [
        &["run", "--run", "a"][..],
        &["status", "a"],
        &["verify", "a"],
    ] {
        let did = bench.fretwear(command);
        assert_eq!(did.code(), 4, "{command:?}: {}", did.stderr());
        assert!(
            did.stderr().contains("staging is a link"),
            "{}",
            did.stderr()
        );
    }
    fs::remove_file(bench.path("a/staging")).expect("removed");
    symlink("../victim/results.csv", bench.path("a/report.html")).expect("a link");
    if cfg!(feature = "polars") {
        bench.done(&["report", "a"]);
        assert!(bench.path("a/report.html").is_file());
    }
    let text = fs::read_to_string(&precious).expect("still there");
    assert!(
        text == "a month of measurements",
        "a command changed a file outside the run"
    );
}
