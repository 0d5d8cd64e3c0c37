//! Faults at each call of a sequence of commits. No commit is lost, and the final run is the same.

use super::*;
use crate::support::faulty::{Fault, FaultyFileSystem};

const LAST: u64 = 4;

const ENDS: [Fault; 3] = [Fault::EndTruncating, Fault::EndBefore, Fault::PowerLoss];
const FAULTS: [Fault; 4] = [Fault::Error, ENDS[0], ENDS[1], ENDS[2]];

/// Runs with a fault. Returns the record of the caller, and true if the run ended.
fn run_with(fs: &Arc<FaultyFileSystem>, root: &Path, prune: bool) -> (Seen, bool) {
    let mut seen = Seen::default();
    let result = open(fs.clone(), root)
        .and_then(|(mut store, _)| run(&mut store, 5e-6, LAST, prune, &mut seen));
    fs.settle();
    (seen, result.is_ok())
}

/// Runs with the fault at each `stride`-th call.
fn sweep(faults: &[Fault], prune: bool, stride: usize) {
    let folder = tempfile::tempdir().expect("a folder");
    let reference = folder.path().join("reference");
    let fs = Arc::new(FaultyFileSystem::sound());
    assert!(run_with(&fs, &reference, prune).1);
    let counted = fs;
    let changes = counted.calls(Fault::PowerLoss);
    assert!(changes > 60, "only {changes} changes for faults");
    let expected = content(&reference.join("iterations"));
    let (store, _) = open(quick(), &reference).expect("the reference");
    let expected_hashes = hashes(&store);
    drop(store);

    for &fault in faults {
        for call in (1..=counted.calls(fault)).step_by(stride) {
            let at = format!("{fault:?} at call {call}");
            let root = folder.path().join(format!("{fault:?}-{call}"));
            let fs = Arc::new(FaultyFileSystem::failing(call, fault));
            let (seen, finished) = run_with(&fs, &root, prune);
            assert!(!finished, "{at}: the fault caused no error");

            let (mut store, opening) = open(quick(), &root).unwrap_or_else(|e| panic!("{at}: {e}"));
            assert_eq!(opening.set_aside, [], "{at}");
            assert_eq!(opening.repaired, [], "{at}");
            assert!(opening.latest >= seen.committed, "{at}: lost a commit");
            let report = store.verify().expect("readable");
            assert!(
                report.commits.iter().all(|commit| commit.damage.is_empty()),
                "{at}"
            );
            run(&mut store, 5e-6, LAST, prune, &mut Seen::default())
                .unwrap_or_else(|e| panic!("{at}: {e}"));
            assert!(store.verify().expect("readable").is_sound(), "{at}");
            if prune {
                // The fault may be between the last commit and its pruning.
                let keep = Keep {
                    every: Some(3),
                    last: 2,
                    also: BTreeSet::new(),
                };
                store.prune(&keep).unwrap_or_else(|e| panic!("{at}: {e}"));
            }
            assert_eq!(hashes(&store), expected_hashes, "{at}");
            assert_eq!(content(&root.join("iterations")), expected, "{at}");
            fs::remove_dir_all(&root).expect("removed");
        }
    }
}

#[test]
fn an_error_at_some_calls_loses_nothing() {
    sweep(&[Fault::Error], false, 7);
}

#[test]
fn an_end_at_some_calls_loses_nothing() {
    sweep(&ENDS, false, 7);
}

#[test]
fn an_end_at_some_calls_loses_nothing_while_pruning() {
    sweep(&ENDS, true, 11);
}

#[test]
#[ignore = "long: a run for each call to the file system"]
fn a_fault_at_any_call_loses_nothing() {
    sweep(&FAULTS, false, 1);
    sweep(&FAULTS, true, 1);
    a_copied_beginning(1);
    a_changed_free_key(1);
}

#[test]
fn a_copied_beginning_survives_a_fault_at_some_calls() {
    a_copied_beginning(5);
}

fn a_copied_beginning(stride: usize) {
    let folder = tempfile::tempdir().expect("a folder");
    let source = folder.path().join("source");
    drop(finished(&source, 2));
    let sibling = |fs: Arc<dyn FileSystem>, root: &Path| {
        RunStore::create_sibling(fs, root, &identity(), &source, 1)
    };
    let fs = Arc::new(FaultyFileSystem::sound());
    let reference = folder.path().join("reference");
    drop(sibling(fs.clone(), &reference).expect("a sibling"));
    let counted = fs;
    let expected = content(&reference.join("iterations"));
    for fault in FAULTS {
        for call in (1..=counted.calls(fault)).step_by(stride) {
            let at = format!("{fault:?} at call {call}");
            let root = folder.path().join(format!("{fault:?}-{call}"));
            let fs = Arc::new(FaultyFileSystem::failing(call, fault));
            assert!(
                sibling(fs.clone(), &root).is_err(),
                "{at}: the fault caused no error"
            );
            fs.settle();
            let (store, opening) = sibling(quick(), &root).unwrap_or_else(|e| panic!("{at}: {e}"));
            assert_eq!(opening.set_aside, [], "{at}");
            assert_eq!(store.latest(), Some(1), "{at}");
            assert!(store.verify().expect("readable").is_sound(), "{at}");
            assert_eq!(content(&root.join("iterations")), expected, "{at}");
            assert_eq!(
                content(&root.join("once")),
                content(&reference.join("once")),
                "{at}"
            );
            fs::remove_dir_all(&root).expect("removed");
        }
    }
}

#[test]
fn a_changed_free_key_survives_a_fault_at_some_calls() {
    a_changed_free_key(3);
}

fn a_changed_free_key(stride: usize) {
    let folder = tempfile::tempdir().expect("a folder");
    let extended = identity_of(scene(5000, 5e-6));
    let begin = |name: &str| {
        let root = folder.path().join(name);
        drop(finished(&root, 1));
        root
    };
    let reference = begin("reference");
    let fs = Arc::new(FaultyFileSystem::sound());
    drop(RunStore::create_or_open(fs.clone(), &reference, &extended).expect("extended"));
    for fault in FAULTS {
        for call in (1..=fs.calls(fault)).step_by(stride) {
            let at = format!("{fault:?} at call {call}");
            let root = begin(&format!("{fault:?}-{call}"));
            let failing = Arc::new(FaultyFileSystem::failing(call, fault));
            let broken = RunStore::create_or_open(failing.clone(), &root, &extended);
            assert!(broken.is_err(), "{at}: the fault caused no error");
            drop(broken);
            failing.settle();
            let (store, _) = RunStore::create_or_open(quick(), &root, &extended)
                .unwrap_or_else(|e| panic!("{at}: {e}"));
            assert_eq!(store.latest(), Some(1), "{at}");
            assert_eq!(store.reader().record().scene, extended.scene, "{at}");
            assert_eq!(store.reader().record().continued.len(), 1, "{at}");
            let toml = fs::read_to_string(root.join("scene.toml")).expect("a file");
            assert_eq!(toml, extended.scene_toml, "{at}");
        }
    }
}

#[test]
fn tables_of_an_unfinished_iteration_are_used_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    let fs = Arc::new(FaultyFileSystem::sound());
    let mut store = open(fs.clone(), &root).expect("a run").0;
    run(&mut store, 5e-6, 1, false, &mut Seen::default()).expect("two iterations");
    let state = StageKey::of_commit(store.reader().commit_of(1).expect("committed"));
    let key = StageKey::new(
        "cycle",
        &[TableName::Cycle],
        &json!({ "amplitude": 3e-6 }),
        &[&state],
    );
    let mut draft = store.draft(2).expect("a draft");
    let tables = Tables::from([(TableName::Cycle, cycle(3e-6 + 2e-9))]);
    draft.put(&key, &tables, &[]).expect("put");
    drop(draft);
    drop(store);
    // The draft contains a truncated table and a file of an unknown stage.
    fs::write(
        root.join("staging/wear_iteration=2/wear_field.parquet"),
        b"PAR1",
    )
    .expect("written");
    fs::write(root.join("staging/stray"), b"").expect("written");

    let (mut store, opening) = open(quick(), &root).expect("a run");
    assert_eq!(opening.drafts_kept, ["cycle"]);
    assert_eq!(opening.drafts_removed.len(), 2);
    let mut seen = Seen::default();
    run(&mut store, 5e-6, 2, false, &mut seen).expect("the third");
    assert_eq!(seen.computed, ["wear 2"]);
}

#[test]
fn a_full_disk_is_told_before_anything_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    drop(finished(&root, 0));
    let little: Arc<dyn FileSystem> = Arc::new(FaultyFileSystem::with_free_space(5000));
    let (mut store, _) = open(little, &root).expect("a run");
    let error = run(&mut store, 5e-6, 1, false, &mut Seen::default()).expect_err("no room");
    let StoreError::NoSpace {
        free: 5000, needed, ..
    } = error
    else {
        panic!("{error}");
    };
    assert!(needed > 5000);
    assert_eq!(content(&root.join("staging")), BTreeMap::new());
    drop(store);
    let (mut store, _) = open(quick(), &root).expect("a run");
    run(&mut store, 5e-6, 1, false, &mut Seen::default()).expect("room");
}
