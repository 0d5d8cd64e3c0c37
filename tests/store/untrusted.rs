//! Run folders of strangers. The program must not read, write or remove files outside, and must not use excessive time or memory.

use super::*;
use crate::support::{sealed, unsealed};
use fretwear::store::{DamageKind, EntryKind, RealFileSystem, RunReader};
use std::time::{Duration, Instant};

/// Run, and a folder outside with a file that must not change.
struct Trap {
    folder: tempfile::TempDir,
}

const PRECIOUS: &str = "a month of measurements";

impl Trap {
    fn new() -> Trap {
        let folder = tempfile::tempdir().expect("a folder");
        let trap = Trap { folder };
        drop(finished(&trap.root(), 2));
        fs::create_dir(trap.victim()).expect("a folder");
        fs::write(trap.victim().join("results.csv"), PRECIOUS).expect("written");
        trap
    }

    fn root(&self) -> PathBuf {
        self.folder.path().join("run")
    }

    fn victim(&self) -> PathBuf {
        self.folder.path().join("victim")
    }

    fn assert_untouched(&self, at: &str) {
        let text = fs::read_to_string(self.victim().join("results.csv"));
        assert_eq!(text.expect("still there"), PRECIOUS, "{at}");
        let files = fs::read_dir(self.victim()).expect("a folder").count();
        assert_eq!(files, 1, "{at}: a file was added");
    }
}

/// Opens the run on the file system of the machine, with real locks and links.
fn start(root: &Path) -> Result<(RunStore, Opening), StoreError> {
    open(Arc::new(RealFileSystem), root)
}

fn look(root: &Path) -> Result<RunReader, StoreError> {
    RunReader::open(Arc::new(RealFileSystem), root)
}

#[cfg(unix)]
fn link(target: &Path, at: &Path) {
    if at.is_dir() {
        fs::remove_dir_all(at).expect("removed");
    } else if at.exists() {
        fs::remove_file(at).expect("removed");
    }
    std::os::unix::fs::symlink(target, at).expect("a link");
}

/// Places a link at each path of a file or folder of the store.
#[cfg(unix)]
#[test]
fn no_link_is_followed() {
    let folders = [
        "staging",
        "staging/wear_iteration=3",
        "staging/keys-3",
        "staging/discarded",
        "staging/once",
        "once",
        "iterations",
        "iterations/wear_iteration=1",
        "iterations/wear_iteration=3",
        "damaged",
    ];
    let files = [
        "lock",
        "run.json",
        "run.copy.json",
        "scene.toml",
        "plan.json",
        "copying.json",
        "once/surface.json",
        "once/surface.parquet",
        "iterations/wear_iteration=1/commit.json",
        "iterations/wear_iteration=1/cycle.parquet",
        "iterations/wear_iteration=2/timing.parquet",
    ];
    let targets = |trap: &Trap| [trap.victim(), trap.victim().join("results.csv")];
    for (names, which) in [(&folders[..], 0), (&files[..], 1)] {
        for name in names {
            let trap = Trap::new();
            let at = trap.root().join(name);
            link(&targets(&trap)[which], &at);
            let refused = |error: StoreError| {
                assert!(error.is_damage_or_mismatch(), "{name}: {error}");
                assert!(
                    matches!(&error, StoreError::UnexpectedEntryKind { path, found: EntryKind::Link, .. } if *path == at),
                    "{name}: {error}"
                );
            };
            refused(start(&trap.root()).err().expect("refused"));
            refused(look(&trap.root()).err().expect("refused"));
            let root = trap.folder.path().join("sibling");
            let fs = Arc::new(RealFileSystem);
            refused(
                RunStore::create_sibling(fs, &root, &identity(), &trap.root(), 1)
                    .err()
                    .expect("refused"),
            );
            assert!(!root.exists());
            trap.assert_untouched(name);
        }
    }
}

/// The folder of a run may be a link to another disk.
#[cfg(unix)]
#[test]
fn the_folder_of_a_run_may_be_a_link() {
    let trap = Trap::new();
    let linked = trap.folder.path().join("linked");
    link(&trap.root(), &linked);
    let (store, _) = start(&linked).expect("a run");
    assert_eq!(store.latest(), Some(2));
    assert!(
        look(&linked)
            .expect("a run")
            .verify()
            .expect("readable")
            .is_sound()
    );
}

/// The store rejects manifests with other file names than those of the tables. The forged manifests have valid hashes.
#[test]
fn no_name_leads_out_of_a_run() {
    let outside = [
        "../../../victim/results.csv",
        "/dev/zero",
        "cycle.parquet/.",
        "",
    ];
    for name in outside {
        for (list, table) in [("unchained", "timing"), ("tables", "cycle")] {
            let trap = Trap::new();
            let path = trap.root().join("iterations/wear_iteration=2/commit.json");
            let mut commit = unsealed(&path);
            commit[list][table]["file"] = json!(name);
            reseal_chain(&mut commit);
            fs::write(&path, sealed(&commit)).expect("written");
            let reader = look(&trap.root()).expect("readable");
            assert_eq!(reader.latest(), Some(1), "{name}");
            let report = reader.verify().expect("readable");
            let damage = &report.commits[2].damage[0];
            assert_eq!(damage.path, path, "{name}");

            let sibling = trap.folder.path().join("sibling");
            let (fs, source) = (Arc::new(RealFileSystem), trap.root());
            let error = RunStore::create_sibling(fs, &sibling, &identity(), &source, 2)
                .err()
                .expect("refused");
            assert!(matches!(error, StoreError::Damaged(_)), "{error}");
            trap.assert_untouched(name);
        }
        let trap = Trap::new();
        let path = trap.root().join("once/surface.json");
        let mut keyed = unsealed(&path);
        keyed["entry"]["file"] = json!(name);
        fs::write(&path, sealed(&keyed)).expect("written");
        let report = look(&trap.root()).expect("readable").verify();
        assert!(report.expect("readable").once[0].damage.is_some());
        let (mut store, _) = start(&trap.root()).expect("a run");
        let mut seen = Seen::default();
        run(&mut store, 5e-6, 2, false, &mut seen).expect("a run");
        assert_eq!(seen.computed, ["surface"], "computed again");
        trap.assert_untouched(name);
    }
    let trap = Trap::new();
    let path = trap.root().join("iterations/wear_iteration=2/commit.json");
    let mut commit = unsealed(&path);
    commit["tables"]["../victim"] = commit["tables"]["cycle"].clone();
    reseal_chain(&mut commit);
    fs::write(&path, sealed(&commit)).expect("written");
    assert_eq!(look(&trap.root()).expect("readable").latest(), Some(1));
}

/// Replaces the hash of a forged commit by a valid hash.
fn reseal_chain(commit: &mut Value) {
    let counted = json!({
        "wear_iteration": commit["wear_iteration"],
        "parent": commit["parent"],
        "tables": commit["tables"],
    });
    let text = in_order(counted).to_string();
    commit["hash"] = json!(blake3::hash(text.as_bytes()).to_hex().as_str());
}

/// Value with sorted keys in each object.
fn in_order(value: Value) -> Value {
    match value {
        Value::Object(object) => {
            let by_key: BTreeMap<String, Value> =
                object.into_iter().map(|(k, v)| (k, in_order(v))).collect();
            Value::Object(by_key.into_iter().collect())
        }
        Value::Array(items) => items.into_iter().map(in_order).collect(),
        other => other,
    }
}

/// The store compares lengths before it reads a file. A file without an end is never read completely.
#[cfg(unix)]
#[test]
fn what_is_no_file_is_not_read() {
    let trap = Trap::new();
    for name in ["run.json", "once/surface.json", "lock"] {
        let path = trap.root().join(name);
        let sound = fs::read(&path).expect("a file");
        fs::remove_file(&path).expect("removed");
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.expect("mkfifo").success());
        let error = start(&trap.root()).err().expect("a pipe");
        assert!(
            matches!(
                &error,
                StoreError::UnexpectedEntryKind {
                    found: EntryKind::Other,
                    ..
                }
            ),
            "{error}"
        );
        fs::remove_file(&path).expect("removed");
        fs::write(&path, sound).expect("written");
    }
    // The file is longer than any table and occupies no block on the disk.
    let path = trap
        .root()
        .join("iterations/wear_iteration=2/cycle.parquet");
    let file = fs::File::options().write(true).open(&path).expect("a file");
    file.set_len(1 << 40).expect("a sparse file");
    let reader = look(&trap.root()).expect("readable");
    let report = reader.verify().expect("readable");
    assert!(matches!(
        report.commits[2].damage[0].kind,
        DamageKind::Size { .. }
    ));
    // The forged commit contains the same length.
    let commit = trap.root().join("iterations/wear_iteration=2/commit.json");
    let mut forged = unsealed(&commit);
    forged["tables"]["cycle"]["bytes"] = json!(1_u64 << 40);
    reseal_chain(&mut forged);
    fs::write(&commit, sealed(&forged)).expect("written");
    let report = look(&trap.root()).expect("readable").verify();
    let damage = &report.expect("readable").commits[2].damage[0];
    assert!(
        damage.to_string().contains("but a table has at most"),
        "{damage}"
    );
    let record = trap.root().join("run.json");
    let file = fs::File::options()
        .write(true)
        .open(&record)
        .expect("a file");
    file.set_len(1 << 40).expect("a sparse file");
    let report = look(&trap.root()).expect("its copy").verify();
    let damage = report.expect("readable").metadata.remove(0);
    assert!(damage.to_string().contains("longer than"), "{damage}");
    let (_, opening) = start(&trap.root()).expect("mended");
    assert_eq!(opening.repaired.len(), 1);
}

/// A valid lock contains the number of a process. The program does not overwrite any other file.
#[test]
fn a_file_that_is_no_lock_is_left_alone() {
    let trap = Trap::new();
    let lock = trap.root().join("lock");
    fs::write(&lock, "a letter that somebody keeps under this name").expect("written");
    let error = start(&trap.root()).err().expect("no lock");
    assert!(error.to_string().contains("no lock of a run"), "{error}");
    let text = fs::read_to_string(&lock).expect("a file");
    assert!(text.starts_with("a letter"));
    // The program does not change short texts, or numbers in a file with a second name.
    let precious = trap.victim().join("results.csv");
    for number in ["a number\n", "1914"] {
        fs::write(&precious, number).expect("written");
        fs::remove_file(&lock).expect("removed");
        fs::hard_link(&precious, &lock).expect("a link");
        assert_eq!(start(&trap.root()).is_ok(), number == "1914");
        assert_eq!(fs::read_to_string(&precious).expect("a file"), number);
    }
}

/// The lock is not synced. After a loss of power, the lock may have its length but contain zeros.
#[test]
fn zeros_and_digits_are_a_lock() {
    for (content, is_lock) in [
        (&b"\0\0\0\0\0"[..], true),
        (b"12\0\0\0", true),
        (&[0; 20], true),
        (&[0; 21], false),
        (b"12\0x", false),
    ] {
        let trap = Trap::new();
        let lock = trap.root().join("lock");
        fs::write(&lock, content).expect("written");
        assert_eq!(start(&trap.root()).is_ok(), is_lock, "{content:?}");
        let now = fs::read(&lock).expect("a file");
        assert_eq!(now == content, !is_lock, "{content:?}");
    }
}

/// The tables have valid hashes, but cells outside the grid of the scene.
#[test]
fn cells_outside_of_the_grid_are_damage() {
    let mut scene = scene(1000, 5e-6);
    scene["joint"] = json!({ "grid": [NX, NY] });
    for (cell, is_sound) in [
        ([NX - 1, 0], true),
        ([NX, 0], false),
        ([0, NY], false),
        ([-1, 2], false),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let identity = identity_of(scene.clone());
        let (mut store, _) =
            RunStore::create_or_open(quick(), folder.path(), &identity).expect("a run");
        let field = Table::builder(TableName::WearField)
            .column("i", vec![cell[0]])
            .column("j", vec![cell[1]])
            .column("wear_depth", vec![1e-9])
            .build()
            .expect("a field");
        let key = StageKey::new("wear", &[TableName::WearField], &json!({}), &[]);
        store
            .put_once(TableName::Surface, &key, &surface_of(cell))
            .expect("put");
        let mut draft = store.draft(0).expect("a draft");
        draft
            .put(&key, &Tables::from([(TableName::WearField, field)]), &[])
            .expect("put");
        let again = draft.get(&key).expect("readable");
        assert_eq!(
            matches!(again, StoredResult::Valid(_)),
            is_sound,
            "{cell:?}"
        );
        store.commit(draft).expect("committed");
        let kept = store.once(TableName::Surface, &key).expect("readable");
        assert_eq!(matches!(kept, StoredResult::Valid(_)), is_sound, "{cell:?}");
        let read = store.read(0, TableName::WearField);
        assert_eq!(read.is_ok(), is_sound, "{cell:?}");
        if let Err(error) = read {
            assert!(error.is_damage_or_mismatch(), "{error}");
            assert!(
                error.to_string().contains("joint.grid allows 0 to"),
                "{error}"
            );
        }
        assert_eq!(
            store.verify().expect("readable").is_sound(),
            is_sound,
            "{cell:?}"
        );
    }
}

fn surface_of([i, j]: [i32; 2]) -> Table {
    Table::builder(TableName::Surface)
        .column("i", vec![i])
        .column("j", vec![j])
        .column("height", vec![0.0])
        .column("kept", vec![true])
        .build()
        .expect("a surface")
}

/// The store counts the folders of iterations and ignores the size of their numbers.
#[test]
fn a_stray_folder_of_any_number_costs_nothing() {
    for number in ["99999999999", "18446744073709551615", "9223372036854775808"] {
        let trap = Trap::new();
        let stray = trap
            .root()
            .join(format!("iterations/wear_iteration={number}"));
        fs::create_dir(&stray).expect("a folder");
        let begin = Instant::now();
        let reader = look(&trap.root()).expect("readable");
        assert_eq!(reader.latest(), Some(2));
        assert_eq!(reader.verify().expect("readable").commits.len(), 5);
        let (mut store, opening) = start(&trap.root()).expect("a run");
        assert_eq!(opening.set_aside.len(), 1);
        assert!(!stray.exists());
        run(&mut store, 5e-6, 3, false, &mut Seen::default()).expect("goes on");
        assert!(begin.elapsed() < Duration::from_secs(20), "{number}");
    }
}
