//! A fault at every call to the file system: what is committed verifies, and the continued run equals the undisturbed one.

use std::path::Path;
use std::sync::Arc;

use fretwear::store::FileSystem;

use super::Start;
use crate::support::faulty::{Fault, FaultyFileSystem};
use crate::support::{Bench, assert_same, content, latest, verified};

const FAULTS: [Fault; 4] = [
    Fault::Error,
    Fault::EndTruncating,
    Fault::EndBefore,
    Fault::PowerLoss,
];

/// Three iterations of a joint so small that a run takes milliseconds.
const TINY: [&str; 3] = [
    "joint.grid=[11, 9]",
    "wear.cycles=300_000",
    "wear.depth_step=\"0.05 um\"",
];

/// Runs with the fault at every `stride`-th call, then without.
fn sweep(fault: Fault, sets: &[&str], stride: usize) {
    let bench = Bench::new();
    let sets: Vec<&str> = TINY.iter().chain(sets).copied().collect();
    let scene = bench.scene("small.toml", &sets);
    let through =
        |fs: Arc<dyn FileSystem>, root: &Path| Start::new(scene.clone(), root).through(fs).run();
    let reference = bench.path("reference");
    let counted = Arc::new(FaultyFileSystem::sound());
    through(counted.clone(), &reference).0.expect("a run");
    let expected = content(&reference);
    let iterations = latest(&reference);
    assert!((2..=4).contains(&iterations), "{iterations} iterations");

    for call in (1..=counted.calls(fault)).step_by(stride) {
        let at = format!("{fault:?} at call {call}");
        let root = bench.path(&format!("{fault:?}-{call}"));
        let failing = Arc::new(FaultyFileSystem::failing(call, fault));
        let (result, seen) = through(failing.clone(), &root);
        assert!(result.is_err(), "{at} went unnoticed");
        failing.settle();

        let (result, again) = through(Arc::new(FaultyFileSystem::sound()), &root);
        let outcome = result.unwrap_or_else(|error| panic!("{at}: {error}"));
        assert_eq!(outcome.wear_iteration, Some(iterations), "{at}");
        // What was committed is not computed again.
        if let Some(last) = seen.committed.borrow().last() {
            let computed = again.stages.borrow();
            assert!(computed.iter().all(|(_, k)| k > last), "{at}: {computed:?}");
        }
        assert!(
            !root.join("damaged").exists(),
            "{at}: something was set aside"
        );
        verified(&root);
        assert_same(&content(&root), &expected, &at);
        std::fs::remove_dir_all(&root).expect("removed");
    }
}

#[test]
fn an_error_at_any_call() {
    sweep(Fault::Error, &[], 1);
}

#[test]
fn an_end_at_any_call() {
    sweep(Fault::EndTruncating, &[], 1);
}

#[test]
fn an_end_before_any_write() {
    sweep(Fault::EndBefore, &[], 1);
}

#[test]
fn a_loss_of_power_at_any_call() {
    sweep(Fault::PowerLoss, &[], 1);
}

/// A cycle that is marched depends on the shear it starts from.
#[test]
fn an_end_at_any_call_of_a_stepped_run() {
    let stepped = [
        "fidelity.cycle=stepped",
        "fidelity.steps_per_cycle=8",
        "wear.cycles=150_000",
        "motion.normal_load_amplitude=\"20 N\"",
    ];
    sweep(Fault::EndTruncating, &stepped, 1);
}

#[test]
fn an_end_at_any_call_of_an_explicit_run() {
    let explicit = ["wear.scheme=explicit", "wear.depth_step=\"0.03 um\""];
    sweep(Fault::EndTruncating, &explicit, 1);
}

#[test]
fn every_fault_at_some_calls_while_pruning() {
    for fault in FAULTS {
        sweep(fault, &["output.keep={ last = 1 }"], 7);
    }
}
