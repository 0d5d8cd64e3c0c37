//! The memory that is counted from a recipe against the peak that the operating system counts of a run.
#![cfg(target_os = "linux")]

use std::fs;
use std::path::Path;
use std::time::Duration;

use fretwear::rehearsal;
use fretwear::scene::{self, Plan};

use crate::support::Bench;

/// Part of the measured peak by which the plan may be off.
const OFF: f64 = 0.2;

/// Largest resident set of a run \[B\]: the high-water mark, read again and again until the run is over.
fn measured(bench: &Bench, arguments: &[String]) -> f64 {
    let mut child = bench.command(arguments).spawn().expect("the program runs");
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0.0f64;
    let ended = loop {
        let text = fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kibibytes = line.and_then(|line| line.trim().strip_suffix(" kB"));
        let found: f64 = kibibytes.and_then(|k| k.parse().ok()).unwrap_or(0.0);
        peak = peak.max(1024.0 * found);
        if let Some(ended) = child.try_wait().expect("its end") {
            break ended;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    assert!(ended.success(), "{arguments:?}");
    peak
}

/// The memory of a scene as it is counted \[B\], of a run that reduces its structure or finds it reduced.
fn planned(scene: &Path, sets: &[&str], cost: &str) -> f64 {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    let scene = scene::load(scene, &sets).expect("a scene");
    let (cold, cached) = rehearsal::memory(&Plan::of(&scene).expect("a plan").inputs);
    match cost {
        "memory" => cold as f64,
        _ => cached.expect("a structure") as f64,
    }
}

/// The memory that is counted, under one name of the cost, against that of a run.
fn check(bench: &Bench, scene: &str, sets: &[&str], cost: &str) {
    let with = |words: &[&str]| -> Vec<String> {
        let sets = sets.iter().flat_map(|set| ["--set", set]);
        words
            .iter()
            .copied()
            .chain(sets)
            .map(str::to_owned)
            .collect()
    };
    let planned = planned(&bench.path(scene), sets, cost);
    let measured = measured(bench, &with(&["run", scene, "--json", "--run", "run"]));
    fs::remove_dir_all(bench.path("run")).expect("removed");
    assert!(
        (planned / measured - 1.0).abs() < OFF,
        "{scene} {sets:?}: planned {planned:e} B, measured {measured:e} B"
    );
}

/// The memory that is counted of a scene of the bench, and that of its run \[B\].
pub fn planned_and_measured(scene: &str, sets: &[&str]) -> (f64, f64) {
    let bench = Bench::new();
    let words = ["run", scene, "--run", "run"]
        .into_iter()
        .chain(sets.iter().copied());
    let arguments: Vec<String> = words.map(str::to_owned).collect();
    let keys: Vec<&str> = sets
        .iter()
        .copied()
        .filter(|word| *word != "--set")
        .collect();
    (
        planned(&bench.path(scene), &keys, "memory"),
        measured(&bench, &arguments),
    )
}

#[test]
fn the_planned_memory_is_what_a_run_takes() {
    let pipelines = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines");
    let bench = Bench::new();
    for (name, sets) in [
        ("static_contact", vec!["joint.grid=[64, 64]"]),
        ("static_contact", vec!["joint.grid=[512, 384]"]),
        ("prescribed_fretting", vec!["wear.cycles=300_000"]),
        (
            "prescribed_fretting",
            vec![
                "joint.grid=[160, 128]",
                "wear.cycles=30_000",
                "motion.normal_load_amplitude=3 kN",
                "fidelity.steps_per_cycle=64",
            ],
        ),
        ("hertz_fretting", vec!["wear.cycles=30_000"]),
        ("oscillator", vec![]),
    ] {
        let scene = pipelines.join(format!("{name}.toml"));
        check(&bench, scene.to_str().expect("text"), &sets, "memory");
    }
}

/// A structure that is reduced takes more than one that is found in the cache.
#[test]
fn the_planned_memory_of_a_structure() {
    let bench = Bench::new();
    let sets = [
        "joint.elements=[15, 15]",
        "joint.grid=[45, 45]",
        "wear.cycles=1000",
    ];
    check(&bench, "resonator.toml", &sets, "memory");
    let bench = bench.sharing();
    let mut arguments = vec![
        "run",
        "resonator.toml",
        "--run",
        "first",
        "--until",
        "structure",
    ];
    arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
    bench.done(&arguments);
    check(&bench, "resonator.toml", &sets, "memory_cached");
}
