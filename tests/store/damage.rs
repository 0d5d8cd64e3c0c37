//! The store finds damage, names the file, and returns to the last sound iteration. The store deletes no file because of damage.

use super::*;
use fretwear::store::{DamageKind, RunReader};
use proptest::prelude::*;

const LAST: u64 = 3;

fn iteration(root: &Path, k: u64) -> PathBuf {
    root.join(format!("iterations/wear_iteration={k}"))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn a_flipped_byte_is_found_wherever_it_is(k in 0..=LAST, which in 0..3usize, at in any::<usize>()) {
        let folder = tempfile::tempdir().expect("a folder");
        let root = folder.path().join("run");
        let expected = hashes(&finished(&root, LAST));
        let file = iteration(&root, k).join(["cycle.parquet", "wear_field.parquet", "commit.json"][which]);
        flip(&file, at);

        let reader = RunStore::open_readonly(quick(), &root).expect("readable");
        let report = reader.verify().expect("readable");
        prop_assert!(!report.is_sound());
        let first = report.commits.iter().find(|c| !c.damage.is_empty()).expect("damaged");
        prop_assert_eq!(first.wear_iteration, k);
        prop_assert_eq!(&first.damage[0].path, &file);

        let (mut store, opening) = open(quick(), &root).expect("steps back");
        prop_assert_eq!(opening.latest, k.checked_sub(1));
        let aside: Vec<u64> = opening.set_aside.iter().map(|a| a.wear_iteration).collect();
        prop_assert_eq!(aside, (k..=LAST).collect::<Vec<_>>());
        prop_assert!(opening.notices()[0].contains(&file.display().to_string()));
        for aside in &opening.set_aside {
            prop_assert!(aside.moved_to.join("wear_field.parquet").is_file());
        }
        run(&mut store, 5e-6, LAST, false, &mut Seen::default()).expect("computed again");
        prop_assert_eq!(hashes(&store), expected);
        drop(store);
        let (_, opening) = open(quick(), &root).expect("in order");
        prop_assert!(opening.set_aside.is_empty());
    }
}

#[test]
fn what_is_wrong_with_a_file_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let kind_after = |name: &str, damage: &dyn Fn(&Path)| {
        let root = folder.path().join(name);
        drop(finished(&root, 2));
        damage(&root);
        let reader = RunStore::open_readonly(quick(), &root).expect("readable");
        assert_eq!(reader.latest(), Some(0), "{name}");
        let report = reader.verify().expect("readable");
        assert!(
            matches!(
                report.commits[2].damage.last().expect("follows").kind,
                DamageKind::After(1)
            ),
            "{name}"
        );
        report.commits[1].damage[0].kind.clone()
    };
    let wear = |root: &Path| iteration(root, 1).join("wear_field.parquet");
    assert_eq!(
        kind_after("missing", &|root| fs::remove_file(wear(root))
            .expect("removed")),
        DamageKind::Missing
    );
    assert!(matches!(
        kind_after("short", &|root| fs::write(wear(root), b"PAR1")
            .expect("written")),
        DamageKind::Size { found: 4, .. }
    ));
    assert!(matches!(
        kind_after("flipped", &|root| flip(&wear(root), 100)),
        DamageKind::Hash { .. }
    ));
    assert!(matches!(
        kind_after("no json", &|root| fs::write(
            iteration(root, 1).join("commit.json"),
            "{"
        )
        .expect("written")),
        DamageKind::Unreadable { .. }
    ));
    assert_eq!(
        kind_after("gone", &|root| fs::remove_dir_all(iteration(root, 1))
            .expect("removed")),
        DamageKind::Missing
    );
    assert_eq!(
        kind_after("renamed", &|root| {
            fs::remove_dir_all(iteration(root, 1)).expect("removed");
            fs::create_dir(iteration(root, 1)).expect("created");
            for entry in fs::read_dir(iteration(root, 2)).expect("a folder") {
                let entry = entry.expect("an entry");
                fs::copy(entry.path(), iteration(root, 1).join(entry.file_name())).expect("copied");
            }
        }),
        DamageKind::Iteration {
            expected: 1,
            found: 2
        }
    );
}

#[test]
fn an_iteration_of_another_run_breaks_the_chain() {
    let folder = tempfile::tempdir().expect("a folder");
    let (ours, theirs) = (folder.path().join("ours"), folder.path().join("theirs"));
    drop(finished(&ours, 2));
    let (mut store, _) =
        RunStore::create_or_open(quick(), &theirs, &identity_of(scene(1000, 1e-6))).expect("a run");
    run(&mut store, 1e-6, 2, false, &mut Seen::default()).expect("a run");
    fs::remove_dir_all(iteration(&ours, 1)).expect("removed");
    fs::rename(iteration(&theirs, 1), iteration(&ours, 1)).expect("renamed");
    let reader = RunStore::open_readonly(quick(), &ours).expect("readable");
    assert_eq!(reader.latest(), Some(0));
    let report = reader.verify().expect("readable");
    assert!(matches!(
        report.commits[1].damage[0].kind,
        DamageKind::Parent { .. }
    ));
}

#[test]
fn damage_to_timing_is_told_and_steps_nowhere() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    drop(finished(&root, 2));
    flip(&iteration(&root, 1).join("timing.parquet"), 50);
    let (store, opening) = open(quick(), &root).expect("a run");
    assert_eq!(opening.latest, Some(2));
    assert_eq!(opening.repaired.len(), 1);
    assert!(opening.notices()[0].contains("timing.parquet"));
    // The store removes the table from the commit and keeps the file aside. The run is sound afterwards.
    assert!(store.verify().expect("readable").is_sound());
    let error = store.read(1, TableName::Timing).expect_err("gone");
    assert!(matches!(error, StoreError::NoTable { .. }), "{error}");
    let aside = root.join("damaged/wear_iteration=1-timing.parquet");
    assert!(aside.is_file());
    drop(store);
    let (_, opening) = open(quick(), &root).expect("a run");
    assert_eq!(opening.repaired, []);
    assert!(reader_of(&root).read(2, TableName::Timing).is_ok());
}

fn reader_of(root: &Path) -> RunReader {
    RunStore::open_readonly(quick(), root).expect("readable")
}

/// Each bit of each metadata file matters. The test omits the lock, and the tables, which have one hash each.
#[test]
fn a_flipped_bit_of_any_metadata_is_found_and_mended() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    let expected = hashes(&finished(&root, 1));
    for name in [
        "run.json",
        "run.copy.json",
        "plan.json",
        "scene.toml",
        "once/surface.json",
    ] {
        let path = root.join(name);
        let sound = fs::read(&path).expect("a file");
        // The step is seven bytes: no length of a record is a multiple of seven.
        for at in (0..sound.len()).step_by(7) {
            let mut bytes = sound.clone();
            bytes[at] ^= 1 << (at % 8);
            fs::write(&path, bytes).expect("written");
            let report = reader_of(&root).verify().expect("readable");
            assert!(!report.is_sound(), "{name}, byte {at}");
            assert_eq!(report.damage().next().expect("damage").path, path);
        }
        let (mut store, opening) = open(quick(), &root).expect("goes on");
        assert_eq!(opening.latest, Some(1), "{name}");
        run(&mut store, 5e-6, 1, false, &mut Seen::default()).expect("a run");
        assert_eq!(hashes(&store), expected);
        assert!(store.verify().expect("readable").is_sound(), "{name}");
        if name == "run.json" {
            assert_eq!(opening.repaired.len(), 1);
            assert!(opening.notices()[0].contains("run.json"));
        }
    }
    fs::remove_file(root.join("once/surface.parquet")).expect("removed");
    let report = reader_of(&root).verify().expect("readable");
    assert_eq!(
        report.once[0].damage.as_ref().expect("damage").kind,
        DamageKind::Missing
    );
}

#[test]
fn a_second_damage_is_kept_beside_the_first() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    drop(finished(&root, 1));
    for _ in 0..2 {
        flip(&iteration(&root, 1).join("cycle.parquet"), 60);
        let (mut store, opening) = open(quick(), &root).expect("steps back");
        assert_eq!(opening.set_aside.len(), 1);
        run(&mut store, 5e-6, 1, false, &mut Seen::default()).expect("computed again");
    }
    let kept = fs::read_dir(root.join("damaged"))
        .expect("a folder")
        .count();
    assert_eq!(kept, 2);
}

#[test]
fn a_damaged_once_table_is_computed_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    drop(finished(&root, 0));
    flip(&root.join("once/surface.parquet"), 200);
    let (mut store, _) = open(quick(), &root).expect("a run");
    let report = store.verify().expect("readable");
    let damage = report.once[0].damage.as_ref().expect("damaged");
    assert_eq!(damage.path, root.join("once/surface.parquet"));
    let mut seen = Seen::default();
    run(&mut store, 5e-6, 1, false, &mut seen).expect("a run");
    assert_eq!(seen.computed[0], "surface");
    assert!(store.verify().expect("readable").is_sound());
}

#[test]
fn a_lost_or_broken_run_json_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    drop(finished(&root, 0));
    let path = root.join("run.json");
    let text = fs::read_to_string(&path).expect("a file");

    let copy = root.join("run.copy.json");
    for broken in [Some(&text[..text.len() / 2]), None] {
        // The remaining copy contains the whole record.
        for lost in [&path, &copy] {
            match broken {
                Some(half) => fs::write(lost, half).expect("written"),
                None => fs::remove_file(lost).expect("removed"),
            }
            let (store, opening) = open(quick(), &root).expect("the other");
            assert_eq!((store.latest(), opening.created), (Some(0), false));
            assert_eq!(fs::read_to_string(lost).expect("a file"), text);
        }
    }
    fs::write(&path, &text[..text.len() / 2]).expect("written");
    fs::write(&copy, &text[..text.len() / 2]).expect("written");
    let error = open(quick(), &root).err().expect("half a file");
    assert!(
        matches!(&error, StoreError::Damaged(damage) if damage.path == path),
        "{error}"
    );
    assert!(error.is_damage_or_mismatch());

    let mut without_seal: Value = serde_json::from_str(&text).expect("an object");
    without_seal
        .as_object_mut()
        .expect("an object")
        .remove("seal");
    // A record without a hash is damaged.
    for path in [&path, &copy] {
        fs::write(path, without_seal.to_string()).expect("written");
    }
    let error = open(quick(), &root).err().expect("no hash");
    assert!(matches!(error, StoreError::Damaged(_)), "{error}");

    fs::remove_file(&path).expect("removed");
    fs::remove_file(&copy).expect("removed");
    let error = open(quick(), &root).err().expect("no file");
    assert!(
        matches!(&error, StoreError::Damaged(damage) if damage.kind == DamageKind::Missing),
        "{error}"
    );
    assert!(iteration(&root, 0).is_dir(), "the iteration is missing");
}
