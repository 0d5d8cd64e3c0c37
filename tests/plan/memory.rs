//! Tests of the memory estimate of a recipe against the peak of a run according to the operating system.
#![cfg(target_os = "linux")]

use std::fs;
use std::io::Write;
use std::path::Path;
use std::time::Duration;

use fretwear::recipe::ResourceEstimate;
use fretwear::scene::{self, Plan};

use crate::support::Bench;

/// Largest error of the planned memory, relative to the measured peak.
const OFF: f64 = 0.2;
const OFF_OF_MESH: f64 = 0.5;

/// Capacity of a pipe on Linux \[B\].
const PIPE: usize = 65_536;
/// A run without computation for this number of ticks waits for a reader of its output.
const WAITS: u32 = 40;
const TICK: Duration = Duration::from_millis(5);

/// Largest resident set of a run \[B\]. The run blocks at its end, where it prints into a full pipe: the peak may be at the end, and the
/// operating system has no peak of a process that has ended.
fn measured(bench: &Bench, arguments: &[String]) -> f64 {
    let (mut reader, writer) = std::io::pipe().expect("a pipe");
    let mut filler = writer.try_clone().expect("a pipe");
    let filled = std::thread::spawn(move || filler.write_all(&[b' '; PIPE]));
    filled.join().expect("a thread").expect("room in a pipe");
    let mut child = bench
        .command(arguments)
        .stdout(writer)
        .spawn()
        .expect("the program runs");
    let of = |file: &str| {
        let path = format!("/proc/{}/{file}", child.id());
        fs::read_to_string(path).unwrap_or_default()
    };
    let (mut peak, mut before, mut waits) = (0.0, String::new(), 0);
    while waits < WAITS {
        let text = of("status");
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kibibytes = line.and_then(|line| line.trim().strip_suffix(" kB"));
        let Some(found) = kibibytes.and_then(|k| k.parse::<f64>().ok()) else {
            break;
        };
        // The peak only increases, except at the start: until the program replaces the test process, the peak is the peak of the test
        // process.
        peak = 1024.0 * found;
        // State of the process, and its computing time in user and kernel mode.
        let stat = of("stat");
        let (_, fields) = stat.rsplit_once(')').unwrap_or_default();
        let fields: Vec<&str> = fields.split_whitespace().collect();
        let now = [0, 11, 12].map(|k| *fields.get(k).unwrap_or(&"")).join(" ");
        waits = match now.starts_with('S') && now == before {
            true => waits + 1,
            false => 0,
        };
        before = now;
        std::thread::sleep(TICK);
    }
    std::io::copy(&mut reader, &mut std::io::sink()).expect("what it prints");
    let ended = child.wait().expect("its end");
    assert!(ended.success(), "{arguments:?}");
    peak
}

/// Estimated memory of a scene \[B\], for a run that reduces its structure or reads the reduction from the cache.
fn planned(scene: &Path, sets: &[&str], cost: &str) -> f64 {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    let scene = scene::load(scene, &sets).expect("a scene");
    let counted = ResourceEstimate::of(&Plan::of(&scene).expect("a plan").inputs);
    match cost {
        "memory" => counted.memory as f64,
        _ => counted.memory_cached.expect("a structure") as f64,
    }
}

/// Compares the estimated memory, under this name of the cost, with the memory of a run.
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
    let measured = measured(
        bench,
        &with(&[
            "run",
            scene,
            "--json",
            "--run",
            "run",
            // Each thread reserves memory but may use little of it.
            "--threads",
            "1",
        ]),
    );
    fs::remove_dir_all(bench.path("run")).expect("removed");
    assert!(
        (planned / measured - 1.0).abs() < OFF,
        "{scene} {sets:?}: planned {planned:e} B, measured {measured:e} B"
    );
}

/// Estimated memory of a scene of the bench, and measured memory of its run \[B\].
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
#[ignore = "long: half a minute"]
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

/// The reduction of a mesh determines the peak of its run.
#[test]
fn the_planned_memory_of_a_mesh() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/lap_of_bars.toml");
    let bench = Bench::new();
    let words = ["run", scene.to_str().expect("text"), "--run", "run"];
    let words = words.into_iter().chain(["--until", "structure"]);
    let arguments: Vec<String> = words.map(str::to_owned).collect();
    let (planned, measured) = (planned(&scene, &[], "memory"), measured(&bench, &arguments));
    assert!(
        (planned / measured - 1.0).abs() < OFF_OF_MESH,
        "planned {planned:e} B, measured {measured:e} B"
    );
}

/// A run that reduces its structure needs more memory than a run that reads the reduction from the cache.
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
