//! The program, killed at any instant and started again, ends where an undisturbed one does, bit for bit.

use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::support::{Bench, Chance, assert_same, content, latest, verified};

/// Kills at least, over all cases.
const KILLS: usize = 10;

/// Starts at most: with delays that grow, a run gets through long before.
const STARTS: usize = 200;

/// Kills runs of the scene at delays spread over the time of an undisturbed run, until one gets through.
fn killed(sets: &[&str], seed: u64) {
    let bench = Bench::new();
    let with = |run: &str| -> Vec<String> {
        let mut arguments = vec!["run".to_owned(), "small.toml".to_owned()];
        arguments.extend(["--run".to_owned(), run.to_owned()]);
        for set in sets {
            arguments.extend(["--set".to_owned(), (*set).to_owned()]);
        }
        arguments
    };
    fn borrowed(arguments: &[String]) -> Vec<&str> {
        arguments.iter().map(String::as_str).collect()
    }
    let begin = Instant::now();
    bench.done(&borrowed(&with("undisturbed")));
    let whole = begin.elapsed();
    let root = bench.path("undisturbed");
    let expected = content(&root);
    assert!(latest(&root) >= 4, "{} iterations", latest(&root));

    let arguments = with("killed");
    let mut chance = Chance::new(seed);
    // Every start but the last is killed.
    for kills in 0..STARTS {
        let mut child = bench
            .command(&borrowed(&arguments))
            .spawn()
            .expect("started");
        // The first come within the creation of the run and its first stages.
        let part = if kills < 3 { 0.02 } else { 0.5 };
        let end = Instant::now() + whole.mul_f64(part * chance.next());
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
        if status.success() {
            assert!(kills >= KILLS, "only {kills} kills before it got through");
            let root = bench.path("killed");
            verified(&root);
            assert_same(&content(&root), &expected, &format!("after {kills} kills"));
            assert!(!root.join("damaged").exists(), "something was set aside");
            return;
        }
        assert_eq!(status.code(), None, "a start failed by itself");
    }
    panic!("not through after {STARTS} starts");
}

#[test]
fn a_killed_run_ends_in_the_same_bits() {
    killed(&[], 1);
}

/// Larger, so that stages take longer than files, and marched sample by sample.
#[test]
fn a_killed_stepped_run_ends_in_the_same_bits() {
    let sets = [
        "joint.grid=[62, 46]",
        "fidelity.cycle=stepped",
        "motion.normal_load_amplitude=\"20 N\"",
        "wear.cycles=200_000",
    ];
    killed(&sets, 2);
}

/// Iterations disappear while the run goes on.
#[test]
fn a_killed_run_that_keeps_little_ends_in_the_same_bits() {
    killed(&["output.keep={ every = 4, last = 2 }"], 3);
}
