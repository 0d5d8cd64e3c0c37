//! Tests of runs that start from an iteration of another run.

use super::*;
use fretwear::store::Origin;

fn sibling(
    root: &Path,
    identity: &RunIdentity,
    source: &Path,
    k: u64,
) -> Result<(RunStore, Opening), StoreError> {
    RunStore::create_sibling(quick(), root, identity, source, k)
}

#[test]
fn a_sibling_has_the_history_and_goes_its_own_way() {
    let folder = tempfile::tempdir().expect("a folder");
    let (source, root) = (folder.path().join("source"), folder.path().join("sibling"));
    let original = finished(&source, 5);
    let before = content(&source);
    let (mut store, opening) =
        sibling(&root, &identity_of(scene(9000, 1e-6)), &source, 3).expect("a sibling");
    assert!(opening.created);
    assert_eq!(opening.latest, Some(3));
    let expected = Origin {
        run: "source".to_owned(),
        wear_iteration: 3,
        commit: hashes(&original)[&3].clone(),
    };
    assert_eq!(store.reader().record().origin, Some(expected));
    assert!(store.verify().expect("readable").is_sound());
    for k in 0..=3 {
        assert_eq!(hashes(&store)[&k], hashes(&original)[&k]);
    }
    let mut seen = Seen::default();
    run(&mut store, 1e-6, 5, false, &mut seen).expect("on");
    assert_eq!(
        seen.computed[0], "surface",
        "the key of the surface must differ"
    );
    assert_ne!(hashes(&store)[&5], hashes(&original)[&5]);
    assert_eq!(content(&source), before, "the source has changed");
}

#[test]
fn a_sibling_of_the_same_scene_ends_where_its_source_does() {
    let folder = tempfile::tempdir().expect("a folder");
    let (source, root) = (folder.path().join("source"), folder.path().join("sibling"));
    let mut original = finished(&source, 4);
    original
        .prune(&Keep {
            every: Some(2),
            last: 1,
            also: BTreeSet::new(),
        })
        .expect("pruned");
    let (mut store, _) = sibling(&root, &identity(), &source, 2).expect("a sibling");
    let mut seen = Seen::default();
    run(&mut store, 5e-6, 4, false, &mut seen).expect("on");
    assert!(!seen.computed.contains(&"surface".to_owned()));
    assert_eq!(hashes(&store)[&4], hashes(&original)[&4]);
    assert!(store.verify().expect("readable").is_sound());
}

#[test]
fn the_same_command_twice_continues() {
    let folder = tempfile::tempdir().expect("a folder");
    let (source, root) = (folder.path().join("source"), folder.path().join("sibling"));
    drop(finished(&source, 2));
    drop(sibling(&root, &identity(), &source, 1).expect("a sibling"));
    // The sibling does not need its source any more.
    fs::remove_dir_all(&source).expect("removed");
    let (store, opening) = sibling(&root, &identity(), &source, 1).expect("the same");
    assert!(!opening.created);
    assert_eq!(store.latest(), Some(1));
    drop(store);
    let error = sibling(&root, &identity(), &source, 0)
        .err()
        .expect("another beginning");
    assert!(matches!(error, StoreError::OtherOrigin { .. }), "{error}");
    open(quick(), &root).expect("without its source");
}

#[test]
fn a_run_of_its_own_is_not_overwritten() {
    let folder = tempfile::tempdir().expect("a folder");
    let (source, root) = (folder.path().join("source"), folder.path().join("other"));
    drop(finished(&source, 1));
    drop(finished(&root, 2));
    let before = content(&root);
    let error = sibling(&root, &identity(), &source, 1)
        .err()
        .expect("a run is there");
    assert!(matches!(error, StoreError::OtherOrigin { .. }) && error.is_damage_or_mismatch());
    assert_eq!(content(&root), before);
}

#[test]
fn an_absent_iteration_is_told_with_those_that_remain() {
    let folder = tempfile::tempdir().expect("a folder");
    let (source, root) = (folder.path().join("source"), folder.path().join("sibling"));
    let mut original = finished(&source, 6);
    original
        .prune(&Keep {
            every: Some(4),
            last: 2,
            also: BTreeSet::new(),
        })
        .expect("pruned");
    for k in [3, 40] {
        let error = sibling(&root, &identity(), &source, k)
            .err()
            .expect("absent");
        assert!(
            matches!(&error, StoreError::NoIteration { remaining, .. } if remaining == &[0, 4, 5, 6])
        );
        assert!(error.to_string().contains("0, 4-6"), "{error}");
    }
    let (store, _) = sibling(&root, &identity(), &source, 4).expect("another one");
    assert_eq!(store.reader().iterations().collect::<Vec<_>>(), [0, 4]);
}

#[test]
fn damage_before_the_beginning_is_refused_and_after_it_is_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let (source, root) = (folder.path().join("source"), folder.path().join("sibling"));
    drop(finished(&source, 4));
    let file = source.join("iterations/wear_iteration=2/wear_field.parquet");
    flip(&file, 333);
    let error = sibling(&root, &identity(), &source, 3)
        .err()
        .expect("damaged");
    assert!(
        matches!(&error, StoreError::Damaged(damage) if damage.path == file),
        "{error}"
    );
    sibling(&root, &identity(), &source, 1).expect("before the damage");
}

#[test]
fn an_unfinished_copy_says_how_to_finish_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let (source, root) = (folder.path().join("source"), folder.path().join("sibling"));
    drop(finished(&source, 2));
    drop(sibling(&root, &identity(), &source, 2).expect("a sibling"));
    // The files are the same as after a kill before the record.
    let origin = json!({ "run": "source", "wear_iteration": 2, "commit": "" });
    fs::write(root.join("copying.json"), origin.to_string()).expect("written");
    for record in ["run.json", "run.copy.json"] {
        fs::remove_file(root.join(record)).expect("removed");
    }
    let error = open(quick(), &root).err().expect("unfinished");
    assert!(error.to_string().contains("--from source@2"), "{error}");
    sibling(&root, &identity(), &source, 2).expect("finished");
}
