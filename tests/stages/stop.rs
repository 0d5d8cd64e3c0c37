//! Stops by Ctrl-C, SIGTERM and `--max-wall`. The run finishes and commits the iteration if this takes a short time.
//! The run prints the command that continues it.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::support::{Bench, assert_same, content, latest, verified};

/// Exit code of a run that can be continued.
const STOPPED: i32 = 75;

/// Arguments of a run that lasts until a signal arrives.
const LONG: [&str; 6] = [
    "--set",
    "joint.grid=[62, 46]",
    "--set",
    "wear.depth_step=\"0.03 um\"",
    "--set",
    "wear.cycles=300_000",
];

fn arguments(run: &str) -> Vec<&str> {
    let mut arguments = vec!["run", "small.toml", "--run", run];
    arguments.extend(LONG);
    arguments
}

/// Starts a run and sends a signal after the first commit.
fn signalled(signal: &str) {
    let bench = Bench::new();
    let root = bench.path("stopped");
    let mut child = bench
        .command(&arguments("stopped"))
        .spawn()
        .expect("started");
    let stderr = child.stderr.take().expect("piped");
    let mut lines = BufReader::new(stderr)
        .lines()
        .map(|line| line.expect("text"));
    lines
        .find(|line| line.starts_with("iteration 1"))
        .expect("a first iteration");
    let id = child.id().to_string();
    let sent = Command::new("kill").args([signal, &id]).status();
    assert!(sent.expect("kill runs").success());
    let said: Vec<String> = lines.collect();
    let status = child.wait().expect("a child");
    assert_eq!(status.code(), Some(STOPPED), "{said:?}");
    let last = said.last().expect("a last line");
    assert_eq!(last, "stopped; continue with: fretwear run --run stopped");
    let stopped_at = latest(&root);
    verified(&root);
    let draft = root.join(format!("staging/wear_iteration={}", stopped_at + 1));
    assert!(!draft.exists(), "the run began another iteration");

    bench.done(&["run", "--run", "stopped"]);
    bench.done(&arguments("unbroken"));
    assert!(stopped_at < latest(&root), "the signal came too late");
    let expected = content(&bench.path("unbroken"));
    assert_same(&content(&root), &expected, signal);
}

#[test]
fn sigterm() {
    signalled("-TERM");
}

#[test]
fn sigint() {
    signalled("-INT");
}

#[test]
fn a_start_without_time_makes_one_iteration() {
    let bench = Bench::new();
    let cycles = "wear.cycles=150_000";
    let root = bench.path("a");
    let limited = ["run", "small.toml", "--run", "a", "--max-wall", "1 us"];
    let limited = [&limited[..], &["--set", cycles]].concat();
    for expected in 0.. {
        let did = bench.fretwear(&limited);
        assert_eq!(latest(&root), expected);
        if did.code() == 0 {
            assert!(expected >= 3);
            break;
        }
        assert_eq!(did.code(), STOPPED, "{}", did.stderr());
        assert!(
            did.stderr()
                .ends_with("continue with: fretwear run --run a\n")
        );
    }
    bench.done(&["run", "small.toml", "--run", "b", "--set", cycles]);
    assert_same(&content(&root), &content(&bench.path("b")), "one a start");
}

/// The program rejects a second writer as long as the first one runs. Readers are allowed.
#[test]
fn one_writer() {
    let bench = Bench::new();
    // The test kills this run. Its cycles are enough for any machine.
    let long = [&arguments("a")[..], &["--set", "wear.cycles=3e9"]].concat();
    let mut first = bench
        .command(&long)
        .stderr(Stdio::piped())
        .spawn()
        .expect("started");
    let stderr = first.stderr.take().expect("piped");
    let mut lines = BufReader::new(stderr)
        .lines()
        .map(|line| line.expect("text"));
    lines
        .find(|line| line.starts_with("iteration 1"))
        .expect("a first iteration");
    let second = bench.fretwear(&long);
    let status = bench.done(&["status", "a", "--json"]).json();
    let words = bench.done(&["status", "a"]).stdout();
    // Readers never count as writers.
    for _ in 0..5 {
        bench.done(&["status", "a"]);
        sleep(Duration::from_millis(5));
    }
    let id = first.id();
    assert!(
        first.try_wait().expect("a child").is_none(),
        "the run was too short"
    );
    first.kill().expect("killed");
    first.wait().expect("a child");

    assert_eq!(second.code(), 1, "{}", second.stderr());
    let message = format!("a is being written by process {id}; wait for it or stop it");
    assert!(second.stderr().contains(&message), "{}", second.stderr());
    assert_eq!(status["running"], true);
    assert_eq!(
        (&status["state"], &status["process"]),
        (&"running".into(), &id.into())
    );
    assert!(
        status["stage"].is_string() && status["continue"].is_null(),
        "{status}"
    );
    assert!(
        words.contains(&format!("running (process {id})")),
        "{words}"
    );
    let status = bench.done(&["status", "a", "--json"]).json();
    assert_eq!(status["running"], false);
    assert_eq!(
        (&status["state"], &status["process"]),
        (&"stopped".into(), &Value::Null)
    );
    assert_eq!(status["continue"], "fretwear run --run a");
    let lock = std::fs::read_to_string(bench.path("a/lock")).expect("a lock");
    assert_eq!(lock, id.to_string(), "a reader wrote into the lock");
}

/// Largest time of a stop: two seconds, and two more for a loaded machine.
const STOPS_WITHIN: Duration = Duration::from_secs(4);

/// Arguments of a run whose static contact and cycle take seconds or more.
const LONG_STAGE: [&str; 12] = [
    "run",
    "small.toml",
    "--run",
    "a",
    "--set",
    "joint.grid=[1024, 768]",
    "--set",
    "contact.normal_load=\"2 kN\"",
    "--set",
    "fidelity.cycle=stepped",
    "--set",
    "fidelity.steps_per_cycle=512",
];

/// The program stops within a long stage and reports this. The continued run has the same bits.
#[test]
fn a_long_stage_is_ended_within_two_seconds() {
    let bench = Bench::new();
    let mut child = bench.command(&LONG_STAGE).spawn().expect("started");
    let stderr = child.stderr.take().expect("piped");
    let mut lines = BufReader::new(stderr)
        .lines()
        .map(|line| line.expect("text"));
    lines
        .find(|line| line.starts_with("begins"))
        .expect("a beginning");
    sleep(Duration::from_secs(1));
    let sent = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(sent.expect("kill runs").success());
    let asked = Instant::now();
    let said: Vec<String> = lines.collect();
    let status = child.wait().expect("a child");
    assert_eq!(status.code(), Some(STOPPED), "{said:?}");
    let took = asked.elapsed();
    assert!(took < STOPS_WITHIN, "{took:?}: {said:?}");
    // The answer is the first message after the figures that a run prints at its start.
    let is_figure =
        |line: &&String| line.starts_with("plausibility checks") || line.starts_with("    ");
    let answer = said
        .iter()
        .find(|line| !is_figure(line))
        .expect("an answer");
    assert!(answer.starts_with("stopping:"), "{said:?}");
    assert!(
        said.iter().any(|line| line.starts_with("stopped within ")),
        "{said:?}"
    );
    let last = said.last().expect("a last line");
    assert_eq!(last, "stopped; continue with: fretwear run --run a");
}

/// The limit of `--max-wall` acts like a signal. A start that completes no stage reports this.
#[test]
fn max_wall_ends_a_long_stage_within_two_seconds() {
    let bench = Bench::new();
    let limited = [&LONG_STAGE[..], &["--max-wall", "0.5 s"]].concat();
    // Each start completes at least one stage. No start completes the cycle, which takes a minute or more.
    const MOST_STARTS: usize = 5;
    for _ in 0..MOST_STARTS {
        let begun = Instant::now();
        let did = bench.fretwear(&limited);
        let took = begun.elapsed();
        let said = did.stderr();
        assert_eq!(did.code(), STOPPED, "{said}");
        assert!(took < Duration::from_millis(500) + STOPS_WITHIN, "{took:?}");
        assert!(said.contains("--max-wall is reached: "), "{said}");
        assert!(said.contains("stopped within "), "{said}");
        assert!(said.ends_with("stopped; continue with: fretwear run --run a\n"));
        if said.contains("the first stage of this start: increase --max-wall") {
            return;
        }
    }
    panic!("{MOST_STARTS} starts have all completed a stage");
}
