//! Runs with a fault at each call to the file system. The committed tables verify, and the continued run equals an undisturbed run.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use fretwear::scene::Scene;
use fretwear::store::FileSystem;

use super::Start;
use crate::support::faulty::{Fault, FaultyFileSystem};
use crate::support::{Bench, OSCILLATOR, RESONATOR, SLIDER, assert_same, content, latest};

const FAULTS: [Fault; 4] = [
    Fault::Error,
    Fault::EndTruncating,
    Fault::EndBefore,
    Fault::PowerLoss,
];

/// Three wear iterations of a very small joint. A run takes milliseconds.
const TINY: [&str; 3] = [
    "joint.grid=[11, 9]",
    "wear.cycles=200_000",
    "wear.depth_step=\"0.05 um\"",
];

/// A stepped cycle depends on the shear at its start.
const STEPPED: [&str; 4] = [
    "fidelity.cycle=stepped",
    "fidelity.steps_per_cycle=8",
    "wear.cycles=160_000",
    "motion.normal_load_amplitude=\"20 N\"",
];
const EXPLICIT: [&str; 2] = ["wear.scheme=explicit", "wear.depth_step=\"0.05 um\""];
const PRUNING: [&str; 1] = ["output.keep={ last = 1 }"];

/// Runs the scene with the fault at each `stride`-th call, then without a fault.
fn sweep(fault: Fault, sets: &[&str], stride: usize) {
    let bench = Bench::new();
    let sets: Vec<&str> = TINY.iter().chain(sets).copied().collect();
    sweep_scene(fault, &bench, bench.scene("small.toml", &sets), stride);
}

fn sweep_scene(fault: Fault, bench: &Bench, scene: Scene, stride: usize) {
    let through =
        |fs: Arc<dyn FileSystem>, root: &Path| Start::new(scene.clone(), root).through(fs).run();
    let reference = bench.path("reference");
    let counted = Arc::new(FaultyFileSystem::sound());
    through(counted.clone(), &reference).0.expect("a run");
    let expected = content(&reference);
    let iterations = latest(&reference);
    assert_eq!(iterations, 2, "the run must have three iterations");

    for call in (1..=counted.calls(fault)).step_by(stride) {
        let at = format!("{fault:?} at call {call}");
        let root = bench.path(&format!("{fault:?}-{call}"));
        let failing = Arc::new(FaultyFileSystem::failing(call, fault));
        let (result, seen) = through(failing.clone(), &root);
        assert!(result.is_err(), "{at}: the fault caused no error");
        failing.settle();

        let (result, again) = through(Arc::new(FaultyFileSystem::sound()), &root);
        let outcome = result.unwrap_or_else(|error| panic!("{at}: {error}"));
        assert_eq!(outcome.wear_iteration, Some(iterations), "{at}");
        // The restart does not compute committed stages again.
        if let Some(last) = seen.committed.borrow().last() {
            let computed = again.stages.borrow();
            assert!(computed.iter().all(|(_, k)| k > last), "{at}: {computed:?}");
        }
        assert!(!root.join("damaged").exists(), "{at}: a file was set aside");
        assert_same(&content(&root), &expected, &at);
        std::fs::remove_dir_all(&root).expect("removed");
    }
}

#[test]
fn every_fault_at_some_calls() {
    for (fault, stride) in FAULTS.into_iter().zip([31, 29, 17, 13]) {
        sweep(fault, &[], stride);
    }
}

#[test]
fn an_end_at_some_calls_of_a_stepped_run() {
    sweep(Fault::EndTruncating, &STEPPED, 11);
}

#[test]
fn an_end_at_some_calls_of_an_explicit_run() {
    sweep(Fault::EndTruncating, &EXPLICIT, 11);
}

#[test]
fn every_fault_at_some_calls_while_pruning() {
    for fault in FAULTS {
        sweep(fault, &PRUNING, 37);
    }
}

#[test]
#[ignore = "long: a run for each call to the file system"]
fn every_fault_at_any_call() {
    for fault in FAULTS {
        for sets in [&[][..], &STEPPED, &EXPLICIT, &PRUNING] {
            sweep(fault, sets, 1);
        }
    }
}

/// Three wear iterations of a structure with a sticking joint. The response takes milliseconds.
const SHAKEN: [&str; 4] = [
    "dynamics.points=2",
    "wear.tolerance=0.5",
    "wear.cycles=60_000",
    "output.curves_every=1",
];

/// Folder with a resonator whose contact elements are updated every `iterations` iterations.
fn renewed_every(iterations: u64) -> Bench {
    let bench = Bench::new();
    let every = format!("iterations = {iterations}");
    let text = RESONATOR.replace("stiffness_change = 0.01\nvolume_growth = \"never\"", &every);
    bench.write("resonator.toml", text);
    bench
}

fn vibrating(strides: [usize; 4]) {
    for (fault, stride) in FAULTS.into_iter().zip(strides) {
        let bench = renewed_every(2);
        let scene = bench.scene("resonator.toml", &SHAKEN);
        sweep_scene(fault, &bench, scene, stride);
    }
}

#[test]
fn every_fault_at_some_calls_of_a_vibrating_run() {
    vibrating([797, 431, 443, 313]);
}

#[test]
#[ignore = "long: some hundred runs with a vibration"]
fn every_fault_at_more_calls_of_a_vibrating_run() {
    vibrating([131, 71, 73, 53]);
}

/// After a loss of power, any file that was not synced may be missing. The restart from the remaining files of the draft gives the same
/// bits, for each single missing file.
fn a_draft_lost_any_file(stride: usize) -> usize {
    let bench = Bench::new();
    let sets = ["fidelity.cycle=stepped", "fidelity.steps_per_cycle=8"];
    let sets: Vec<&str> = TINY.iter().chain(&sets).copied().collect();
    let scene = bench.scene("small.toml", &sets);
    lose_any(&bench, scene, stride)
}

#[test]
fn a_draft_that_lost_any_file() {
    let lost = a_draft_lost_any_file(97);
    assert!(lost > 5, "only {lost} files were lost");
}

/// The restart gives the same bits for each single missing file in a draft of a run with a structure. The run computes the last tables of
/// an iteration too: this draft has the largest number of tables.
fn a_draft_of_a_vibrating_run_lost_any_file(stride: usize) -> usize {
    let bench = renewed_every(1);
    let once = ["wear.cycles=1"];
    let sets: Vec<&str> = SHAKEN.iter().chain(&once).copied().collect();
    lose_any(&bench, bench.scene("resonator.toml", &sets), stride)
}

#[test]
fn a_draft_of_a_vibrating_run_that_lost_any_file() {
    let lost = a_draft_of_a_vibrating_run_lost_any_file(251);
    assert!(lost > 3, "only {lost} files were lost");
}

fn a_draft_of_a_vibration_alone_lost_any_file(stride: usize) -> usize {
    let bench = Bench::new();
    bench.write("alone.toml", format!("{OSCILLATOR}{SLIDER}"));
    lose_any(&bench, bench.scene("alone.toml", &[]), stride)
}

#[test]
fn a_draft_of_a_vibration_alone_that_lost_any_file() {
    let lost = a_draft_of_a_vibration_alone_lost_any_file(41);
    assert!(lost > 1, "only {lost} files were lost");
}

/// Each stride is about the number of calls for one table.
#[test]
#[ignore = "long: a run for each file of many drafts"]
fn many_drafts_that_lost_any_file() {
    for (lost, least) in [
        (a_draft_lost_any_file(7), 50),
        (a_draft_of_a_vibrating_run_lost_any_file(31), 30),
        (a_draft_of_a_vibration_alone_lost_any_file(3), 20),
    ] {
        assert!(lost > least, "only {lost} files were lost");
    }
}

/// Stops runs at each `stride`-th call, and removes each single file of the remaining draft. Returns the number of removed files.
fn lose_any(bench: &Bench, scene: Scene, stride: usize) -> usize {
    let reference = bench.path("reference");
    let counted = Arc::new(FaultyFileSystem::sound());
    Start::new(scene.clone(), &reference)
        .through(counted.clone())
        .done();
    let expected = content(&reference);

    let mut lost = 0;
    for call in (1..=counted.calls(Fault::EndBefore)).step_by(stride) {
        let ended = bench.path("ended");
        let failing = FaultyFileSystem::failing(call, Fault::EndBefore);
        let (result, _) = Start::new(scene.clone(), &ended)
            .through(Arc::new(failing))
            .run();
        assert!(result.is_err());
        for name in files_below(&ended.join("staging")) {
            let root = bench.path("lost");
            copy(&ended, &root);
            std::fs::remove_file(root.join("staging").join(&name)).expect("removed");
            Start::new(scene.clone(), &root).done();
            let at = format!("call {call} without {}", name.display());
            assert_same(&content(&root), &expected, &at);
            std::fs::remove_dir_all(&root).expect("removed");
            lost += 1;
        }
        if ended.exists() {
            std::fs::remove_dir_all(&ended).expect("removed");
        }
    }
    lost
}

/// Files below a folder, relative to the folder. The list is empty if the folder does not exist.
fn files_below(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let mut files = Vec::new();
    for entry in entries {
        let path = entry.expect("an entry").path();
        let name = PathBuf::from(path.file_name().expect("a name"));
        if path.is_dir() {
            files.extend(files_below(&path).into_iter().map(|below| name.join(below)));
        } else {
            files.push(name);
        }
    }
    files
}

fn copy(from: &Path, to: &Path) {
    for name in files_below(from) {
        let target = to.join(&name);
        std::fs::create_dir_all(target.parent().expect("a parent")).expect("made");
        std::fs::copy(from.join(&name), target).expect("copied");
    }
}
