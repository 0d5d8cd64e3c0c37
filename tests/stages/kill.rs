//! The program is killed at random times and restarted. The final run has the same bits as an undisturbed run.

use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::support::{Bench, Chance, assert_same, content, latest, verified};

/// Smallest number of kills over all runs of a case.
const KILLS: usize = 12;

/// Largest number of runs of a case. Each run is killed until it ends.
const RUNS: usize = 20;

/// Latest times of a kill, relative to the time of an undisturbed run. The times alternate: during the creation and opening of the run,
/// during the first stages, and later.
const PARTS: [f64; 3] = [0.02, 0.1, 0.4];

/// Kills runs of the scene at random times with a fixed seed, and restarts each run until it ends.
fn killed(scene: &str, sets: &[&str], seed: u64) {
    let bench = Bench::new();
    let arguments = |run: &str| -> Vec<String> {
        let mut arguments = vec!["run", scene, "--run", run];
        arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
        arguments.into_iter().map(str::to_owned).collect()
    };
    let begin = Instant::now();
    bench.done(&arguments("undisturbed"));
    let whole = begin.elapsed();
    let root = bench.path("undisturbed");
    let expected = content(&root);
    assert!(latest(&root) >= 4, "{} iterations", latest(&root));

    let mut chance = Chance::new(seed);
    let mut kills = 0;
    for run in 0..RUNS {
        let name = format!("killed-{run}");
        let mut starts = 0;
        loop {
            let part = PARTS[kills % PARTS.len()] * chance.next();
            if !is_killed(&bench, &arguments(&name), whole.mul_f64(part)) {
                break;
            }
            kills += 1;
            starts += 1;
            assert!(starts < 200, "{name} does not end");
        }
        let root = bench.path(&name);
        verified(&root);
        assert_same(
            &content(&root),
            &expected,
            &format!("{name}, {starts} times"),
        );
        assert!(!root.join("damaged").exists(), "a file was set aside");
        if kills >= KILLS {
            return;
        }
    }
    panic!("only {kills} kills in {RUNS} runs");
}

/// Starts the program. Returns true if the program was killed, and false if it ended before.
fn is_killed(bench: &Bench, arguments: &[String], after: Duration) -> bool {
    let end = Instant::now() + after;
    let mut child = bench.command(arguments).spawn().expect("started");
    let status = loop {
        if let Some(status) = child.try_wait().expect("a child") {
            break status;
        }
        if Instant::now() >= end {
            child.kill().expect("killed");
            break child.wait().expect("a child");
        }
        sleep(Duration::from_micros(200));
    };
    if let Some(code) = status.code() {
        assert_eq!(code, 0, "a start failed without a kill");
    }
    !status.success()
}

#[test]
fn a_killed_run_ends_in_the_same_bits() {
    killed("small.toml", &[], 1);
}

/// The joint is larger, so that stages take longer than files. The cycle is stepped under a varying load.
#[test]
fn a_killed_stepped_run_ends_in_the_same_bits() {
    let sets = [
        "joint.grid=[38, 30]",
        "fidelity.cycle=stepped",
        "fidelity.steps_per_cycle=12",
        "motion.normal_load_amplitude=\"20 N\"",
        "wear.cycles=200_000",
    ];
    killed("small.toml", &sets, 2);
}

/// The run prunes iterations while it computes.
#[test]
fn a_killed_run_that_keeps_little_ends_in_the_same_bits() {
    let sets = ["output.keep={ every = 4, last = 2 }"];
    killed("small.toml", &sets, 3);
}

/// The response of an iteration starts from the response before. The contact elements remain over several iterations.
#[test]
fn a_killed_vibrating_run_ends_in_the_same_bits() {
    killed("resonator.toml", &["output.response_at=[100_000]"], 4);
}

/// The search of the bolt load starts from the load of the iteration before.
#[test]
fn a_killed_run_that_loses_its_bolt_load_ends_in_the_same_bits() {
    let sets = ["contact.bolt_stiffness=\"500 N/um\"", "wear.cycles=150_000"];
    killed("resonator.toml", &sets, 5);
}

/// The laws of the contact elements and the remaining compliance of the fine contact stay over several iterations.
#[test]
#[ignore = "long: 10 seconds"]
fn a_killed_run_of_many_sliders_ends_in_the_same_bits() {
    let sets = [
        "contact.stiffness=sliders",
        "update.stiffness_change=0.05",
        "wear.cycles=150_000",
    ];
    killed("resonator.toml", &sets, 5);
}
