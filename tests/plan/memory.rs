//! The memory that a plan says against the peak that the operating system counts of a run.
#![cfg(target_os = "linux")]

use std::fs;
use std::path::Path;
use std::time::Duration;

use crate::support::Bench;

/// Part of the measured peak by which the plan may be off.
const OFF: f64 = 0.2;

/// Largest resident set of a run \[B\]: the high-water mark, read again and again until the run is over.
fn measured(bench: &Bench, arguments: &[&str]) -> f64 {
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
    ] {
        let scene = pipelines.join(format!("{name}.toml"));
        let scene = scene.to_str().expect("a path of text");
        let mut arguments = vec!["plan", scene, "--json"];
        arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
        let planned = bench.done(&arguments).json()["cost"]["memory"]
            .as_f64()
            .expect("bytes");
        let mut arguments = vec!["run", scene, "--json", "--run", "run"];
        arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
        let measured = measured(&bench, &arguments);
        fs::remove_dir_all(bench.path("run")).expect("removed");
        assert!(
            (planned / measured - 1.0).abs() < OFF,
            "{name} {sets:?}: planned {planned:e} B, measured {measured:e} B"
        );
    }
}
