//! Tests of creation, locking, continuation, change and pruning of a run.

use super::*;
use fretwear::store::RealFileSystem;
use fretwear::tables::{TableError, from_parquet, provenance_of};

fn real() -> Arc<dyn FileSystem> {
    Arc::new(RealFileSystem)
}

#[test]
fn a_run_on_the_real_file_system_has_the_layout_that_readers_expect() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("deep/er/run");
    let (mut store, opening) = open(real(), &root).expect("a new run");
    assert!(opening.created && opening.latest.is_none());
    run(&mut store, 5e-6, 2, false, &mut Seen::default()).expect("a run");
    for file in [
        "scene.toml",
        "plan.json",
        "run.json",
        "schemas.json",
        "history.parquet",
        "lock",
        "once/surface.parquet",
    ] {
        assert!(root.join(file).is_file(), "{file}");
    }
    let partitions: Vec<String> = RealFileSystem
        .list(&root.join("iterations"))
        .expect("a folder")
        .into_iter()
        .map(|entry| entry.name)
        .collect();
    assert_eq!(
        partitions,
        ["wear_iteration=0", "wear_iteration=1", "wear_iteration=2"]
    );
    for entry in RealFileSystem
        .list(&root.join("iterations/wear_iteration=1"))
        .expect("a folder")
    {
        assert!(
            entry.name.ends_with(".parquet") || entry.name == "commit.json",
            "{}",
            entry.name
        );
        if let Some(table) = entry
            .name
            .strip_suffix(".parquet")
            .and_then(TableName::from_name)
        {
            let path = root
                .join("iterations/wear_iteration=1")
                .join(table.file_name());
            let bytes = fs::read(path).expect("a file");
            from_parquet(&bytes, table.schema()).expect("holds to its schema");
            let provenance = provenance_of(&bytes, table.schema()).expect("says where it is from");
            assert_eq!(provenance.scene_hash, identity().scene_hash());
        }
    }
    let record = store.reader().record();
    assert_eq!((record.threads, record.seed), (1, Some(1)));
    drop(store);
    let (store, opening) = open(real(), &root).expect("the same run");
    assert!(!opening.created);
    assert_eq!(opening.latest, Some(2));
    assert_eq!(opening.notices(), [] as [&str; 0]);
    assert!(store.verify().expect("readable").is_sound());
}

#[test]
fn equal_runs_have_equal_hashes_and_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let (one, two) = (folder.path().join("one"), folder.path().join("two"));
    let first = finished(&one, 3);
    drop(finished(&two, 1));
    let (mut second, _) = open(quick(), &two).expect("a run");
    // The second run has two starts and other timings. The hash chain does not contain them.
    let mut seen = Seen {
        computed: vec!["before".to_owned(); 9],
        ..Seen::default()
    };
    run(&mut second, 5e-6, 3, false, &mut seen).expect("the rest");
    assert_eq!(hashes(&first), hashes(&second));
    assert_eq!(
        content(&one.join("iterations")),
        content(&two.join("iterations"))
    );
    assert_ne!(
        first.read(3, TableName::Timing).expect("a table"),
        second.read(3, TableName::Timing).expect("a table")
    );
}

#[test]
fn a_second_writer_is_refused_and_a_reader_is_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    let (store, _) = open(real(), &root).expect("the first");
    let error = open(real(), &root).err().expect("the second");
    let StoreError::Locked { pid, .. } = &error else {
        panic!("{error}");
    };
    assert_eq!(*pid, Some(std::process::id()));
    assert!(error.to_string().contains(&std::process::id().to_string()));
    assert!(!error.is_damage_or_mismatch());
    RunStore::open_readonly(real(), &root).expect("a reader");
    drop(store);
    open(real(), &root).expect("after the first");
}

#[test]
fn a_changed_scene_is_refused_with_its_keys() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    drop(finished(&root, 1));
    let mut changed = scene(1000, 1e-6);
    changed["contact"] = json!({ "friction_coefficient": 0.6 });
    changed["wear"]["cycles"] = json!(7000);
    changed["surface"]
        .as_object_mut()
        .expect("an object")
        .remove("seed");
    let error = RunStore::create_or_open(quick(), &root, &identity_of(changed))
        .err()
        .expect("another scene");
    assert!(error.is_damage_or_mismatch());
    let StoreError::SceneChanged { keys, .. } = &error else {
        panic!("{error}");
    };
    let names: Vec<&str> = keys.iter().map(|change| change.key.as_str()).collect();
    assert_eq!(
        names,
        ["contact.friction_coefficient", "surface.rq", "surface.seed"]
    );
    assert_eq!(
        (keys[0].before.clone(), keys[0].after.clone()),
        (None, Some(json!(0.6)))
    );
    assert_eq!(
        (keys[1].before.clone(), keys[1].after.clone()),
        (Some(json!(5e-6)), Some(json!(1e-6)))
    );
    let (store, opening) = open(quick(), &root).expect("untouched");
    assert_eq!(opening.changed_keys, []);
    assert_eq!(store.latest(), Some(1));
}

#[test]
fn a_scene_of_which_nothing_is_committed_may_be_mended() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    drop(open(quick(), &root).expect("a run without a commit"));
    let mended = identity_of(scene(1000, 1e-6));
    let (store, _) = RunStore::create_or_open(quick(), &root, &mended).expect("the mended scene");
    assert_eq!(store.reader().record().scene_hash, mended.scene_hash());
    drop(store);
    let text = fs::read_to_string(root.join("scene.toml")).expect("a file");
    assert_eq!(text, mended.scene_toml);
}

#[test]
fn free_keys_may_change_and_are_recorded() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    drop(finished(&root, 1));
    let mut extended = identity_of(scene(5000, 5e-6));
    extended.scene["output"] = json!({ "keep": { "every": 50 } });
    extended.plan = json!({ "cycles": 5000 });
    extended.threads = 2;
    extended.program_version = "0.2.0".to_owned();
    assert_eq!(extended.scene_hash(), identity().scene_hash());
    let (mut store, opening) =
        RunStore::create_or_open(quick(), &root, &extended).expect("extended");
    let names: Vec<&str> = opening
        .changed_keys
        .iter()
        .map(|change| change.key.as_str())
        .collect();
    assert_eq!(names, ["output.keep", "output.keep.every", "wear.cycles"]);
    assert_eq!(opening.threads_changed, Some((1, 2)));
    assert_eq!(
        opening.program_changed,
        Some(("0.1.0".to_owned(), "0.2.0".to_owned()))
    );
    assert_eq!(opening.notices().len(), 5);
    run(&mut store, 5e-6, 2, false, &mut Seen::default()).expect("on");
    drop(store);
    let plan = fs::read_to_string(root.join("plan.json")).expect("a file");
    assert!(plan.contains("5000"));
    let (store, opening) = RunStore::create_or_open(quick(), &root, &extended).expect("again");
    assert_eq!(opening.notices(), [] as [&str; 0]);
    let record = store.reader().record();
    assert_eq!((record.threads, record.continued.len()), (1, 1));
    assert_eq!(record.continued[0].wear_iteration, Some(1));
    assert_eq!(record.continued[0].changed_keys.len(), 3);
    assert_eq!(record.scene["wear"]["cycles"], 5000);
}

#[test]
fn a_folder_of_something_else_is_left_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("thesis.tex"), "precious").expect("written");
    let error = open(quick(), folder.path()).err().expect("no run");
    assert!(
        matches!(&error, StoreError::NotARun { found, .. } if found == "thesis.tex"),
        "{error}"
    );
    let left: Vec<_> = fs::read_dir(folder.path()).expect("a folder").collect();
    assert_eq!(left.len(), 1);
    let error = RunStore::open_readonly(quick(), folder.path())
        .err()
        .expect("no run");
    assert!(matches!(error, StoreError::NoRun { .. }), "{error}");
}

#[test]
fn iterations_come_in_order_with_the_same_columns() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut store = finished(&folder.path().join("run"), 1);
    let error = store.draft(5).err().expect("out of order");
    let StoreError::OutOfOrder {
        wear_iteration,
        next,
        ..
    } = &error
    else {
        panic!("{error}");
    };
    assert_eq!((*wear_iteration, *next), (5, 2));

    let key = StageKey::new("cycle", &[TableName::Cycle], &json!({}), &[]);
    let mut draft = store.draft(2).expect("a draft");
    let error = draft
        .put(&key, &Tables::from([(TableName::Cycle, timing(0.1))]), &[])
        .expect_err("another table");
    let StoreError::Table { source, .. } = &error else {
        panic!("{error}");
    };
    assert!(
        matches!(**source, TableError::OtherTable { .. }),
        "{source}"
    );
    let two_axes = Table::builder(TableName::Cycle)
        .column("time", vec![0.0])
        .column("displacement_x", vec![0.0])
        .column("displacement_y", vec![0.0])
        .column("normal_load", vec![3e4])
        .column("force_x", vec![0.0])
        .build()
        .expect("a cycle");
    let tables = Tables::from([(TableName::Cycle, two_axes)]);
    draft.put(&key, &tables, &[]).expect("put");
    let error = store.commit(draft).expect_err("another column");
    let StoreError::ColumnsChanged {
        table,
        found,
        expected,
        ..
    } = &error
    else {
        panic!("{error}");
    };
    assert_eq!(
        (table.as_str(), found.len(), expected.len()),
        ("cycle", 5, 4)
    );

    let error = store
        .read(1, TableName::Summary)
        .expect_err("no such table");
    assert!(
        matches!(&error, StoreError::NoTable { known, .. } if known == &["cycle", "wear_field", "wear_step", "timing"])
    );
}

#[test]
fn a_table_not_taken_up_is_not_committed() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    let (mut store, _) = open(quick(), &root).expect("a run");
    let key = StageKey::new("hysteresis", &[TableName::Hysteresis], &json!({}), &[]);
    let curve = Table::builder(TableName::Hysteresis)
        .column("load", vec![0.0])
        .column("displacement", vec![0.0])
        .build()
        .expect("a curve");
    let mut draft = store.draft(0).expect("a draft");
    let tables = Tables::from([(TableName::Hysteresis, curve)]);
    draft.put(&key, &tables, &[]).expect("put");
    drop(draft);
    run(&mut store, 5e-6, 0, false, &mut Seen::default()).expect("the first");
    assert!(
        !root
            .join("iterations/wear_iteration=0/hysteresis.parquet")
            .exists()
    );
    assert!(store.verify().expect("readable").is_sound());
}

/// A later stage may overwrite a table. The draft keeps the first version until the commit, so that the later stage can be repeated.
#[test]
fn a_table_that_is_written_again_is_not_lost_before_the_commit() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    let (mut store, _) = open(quick(), &root).expect("a run");
    let first = StageKey::new("first", &[TableName::Cycle], &json!({}), &[]);
    let later = StageKey::new("later", &[TableName::Cycle], &json!({}), &[&first]);
    let of = |amplitude| Tables::from([(TableName::Cycle, cycle(amplitude))]);
    let mut draft = store.draft(0).expect("a draft");
    let interim = [TableName::Cycle];
    draft.put(&first, &of(1e-6), &interim).expect("put");
    draft.put(&later, &of(2e-6), &[]).expect("put");
    drop(draft);
    drop(store);
    let (reopened, opening) = open(quick(), &root).expect("a run");
    store = reopened;
    assert_eq!(opening.drafts_kept, ["first", "later"]);
    let mut draft = store.draft(0).expect("a draft");
    for (key, amplitude) in [(&first, 1e-6), (&later, 2e-6)] {
        let kept = draft.get(key).expect("readable");
        assert_eq!(kept, StoredResult::Valid(of(amplitude)));
    }
    store.commit(draft).expect("a commit");
    let committed = store.read(0, TableName::Cycle).expect("a cycle");
    assert_eq!(committed, cycle(2e-6));
    assert_eq!(
        fs::read_dir(root.join("iterations/wear_iteration=0"))
            .expect("a folder")
            .count(),
        2
    );
    assert!(store.verify().expect("readable").is_sound());
}

/// A key file of staging is untrusted input. The store ignores a key file with the path of another file.
#[test]
fn a_draft_that_names_another_file_is_computed_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    let (store, _) = open(quick(), &root).expect("a run");
    let key = StageKey::new("cycle", &[TableName::Cycle], &json!({}), &[]);
    let mut draft = store.draft(0).expect("a draft");
    let tables = Tables::from([(TableName::Cycle, cycle(1e-6))]);
    draft.put(&key, &tables, &[]).expect("put");
    let path = root.join("staging/keys-0/cycle.json");
    let mut text: Value = serde_json::from_slice(&fs::read(&path).expect("a key")).expect("JSON");
    let inside = text.pointer_mut("/tables/cycle/file").expect("a file");
    *inside = json!("../keys-0/cycle.json");
    text.as_object_mut().expect("an object").remove("seal");
    fs::write(&path, text.to_string()).expect("written");
    let kept = draft.get(&key).expect("readable");
    assert!(matches!(kept, StoredResult::Stale(_)), "{kept:?}");
}

#[test]
fn pruning_keeps_what_it_must_and_the_chain() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    let mut store = finished(&root, 9);
    let all = hashes(&store);
    let keep = Keep {
        every: Some(4),
        last: 2,
        also: BTreeSet::from([3]),
    };
    assert_eq!(store.prune(&keep).expect("pruned"), [1, 2, 5, 6, 7]);
    assert_eq!(
        store.reader().iterations().collect::<Vec<_>>(),
        [0, 3, 4, 8, 9]
    );
    assert!(!root.join("iterations/wear_iteration=5").exists());
    let report = store.verify().expect("readable");
    assert!(report.is_sound());
    assert_eq!(report.pruned, [1, 2, 5, 6, 7]);
    let error = store.read(5, TableName::WearField).expect_err("pruned");
    assert!(error.to_string().contains("0, 3-4, 8-9"), "{error}");
    drop(store);

    let (mut store, opening) = open(quick(), &root).expect("a run");
    assert_eq!(opening.set_aside, []);
    run(&mut store, 5e-6, 10, false, &mut Seen::default()).expect("on");
    assert!(
        store
            .prune(&Keep {
                every: None,
                last: 0,
                also: BTreeSet::new()
            })
            .is_ok()
    );
    assert_eq!(store.reader().iterations().collect::<Vec<_>>(), [0, 10]);
    drop(store);

    // The latest iteration is damaged. The store returns to iteration 0, and the final run is the same.
    flip(&root.join("iterations/wear_iteration=10/cycle.parquet"), 70);
    let (mut store, opening) = open(quick(), &root).expect("a run");
    assert_eq!(opening.latest, Some(0));
    assert!(store.verify().expect("readable").pruned.is_empty());
    assert_eq!(store.reader().history().expect("readable").len(), 1);
    run(&mut store, 5e-6, 9, false, &mut Seen::default()).expect("again");
    assert_eq!(hashes(&store), all);
    assert!(store.verify().expect("readable").is_sound());
}

#[test]
fn the_history_has_a_row_of_every_iteration_also_of_those_that_are_pruned() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    let (mut store, _) = open(quick(), &root).expect("a new run");
    run(&mut store, 5e-6, 7, true, &mut Seen::default()).expect("a run");
    let record = fs::read(root.join("run.json")).expect("a file").len();
    run(&mut store, 5e-6, 25, true, &mut Seen::default()).expect("on");
    let of_writer = store.reader().history().expect("whole");
    let reader = RunStore::open_readonly(quick(), &root).expect("readable");
    let history = reader.history().expect("readable");
    assert_eq!(history, of_writer);
    assert_eq!(history.len(), 26);
    assert!(reader.iterations().count() < 12, "pruned");
    for k in 0..26 {
        let row: Option<typed::WearStep> = history.row(k).expect("readable");
        assert_eq!(row, Some(wear_step(k)), "{k}");
        // The runs of this test have no summary.
        assert_eq!(history.row::<typed::Summary>(k).expect("readable"), None);
    }
    assert_eq!(history.cost()["wear"].fft_pairs, 26.0 * 12.0);
    // Pruned iterations do not increase the length of the record, which the program reads completely.
    assert_eq!(
        fs::read(root.join("run.json")).expect("a file").len(),
        record
    );
    // A restart finds the history complete. After a kill before the last rows, a restart adds the missing rows.
    drop((reader, store));
    let before = fs::read(root.join("history.parquet")).expect("a file");
    let (mut store, _) = open(quick(), &root).expect("a run");
    assert_eq!(
        fs::read(root.join("history.parquet")).expect("a file"),
        before
    );
    run(&mut store, 5e-6, 26, false, &mut Seen::default()).expect("on");
    drop(store);
    fs::write(root.join("history.parquet"), before).expect("written");
    let reader = RunStore::open_readonly(quick(), &root).expect("readable");
    assert!(reader.verify().expect("readable").is_sound());
    assert_eq!(reader.history().expect("readable").len(), 27);
    let (store, opening) = open(quick(), &root).expect("a run");
    assert_eq!((opening.repaired, opening.history_lost), (vec![], None));
    assert_eq!(store.reader().history().expect("whole").len(), 27);
}

#[test]
fn a_damaged_history_loses_the_rows_of_pruned_iterations_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("run");
    let mut store = finished(&root, 9);
    let all = hashes(&store);
    let keep = Keep {
        every: Some(4),
        last: 1,
        also: BTreeSet::new(),
    };
    store.prune(&keep).expect("pruned");
    let whole = store.reader().history().expect("readable");
    assert_eq!(whole.len(), 10);
    drop(store);
    let history = root.join("history.parquet");
    for damage in ["flipped", "removed"] {
        match damage {
            "flipped" => flip(&history, 200),
            _ => fs::remove_file(&history).expect("removed"),
        }
        let reader = RunStore::open_readonly(quick(), &root).expect("readable");
        assert_eq!(reader.latest(), Some(9), "{damage}");
        let report = reader.verify().expect("readable");
        let damaged: Vec<_> = report.damage().map(|d| d.path.clone()).collect();
        assert_eq!(damaged, [history.as_path()], "{damage}");
        drop(reader);
        let (store, opening) = open(quick(), &root).expect("a run");
        assert_eq!(opening.set_aside, [], "{damage}");
        assert_eq!(opening.history_lost.expect("told").path, history);
        // The rows of the remaining iterations are unchanged. The hash chain remains valid over the lost rows.
        let report = store.verify().expect("readable");
        assert!(report.is_sound(), "{damage}");
        assert_eq!(report.pruned, [1, 2, 3, 5, 6, 7]);
        assert_eq!(
            hashes(&store),
            [0, 4, 8, 9].map(|k: u64| (k, all[&k].clone())).into()
        );
        let mended = store.reader().history().expect("readable");
        for k in [0, 4, 8, 9] {
            let row = mended.row::<typed::WearStep>(k).expect("a row");
            assert!(row.is_some());
            assert_eq!(row, whole.row(k).expect("a row"), "{damage}, {k}");
        }
        assert_eq!(mended.row::<typed::WearStep>(5).expect("readable"), None);
    }
}
