//! Runs and campaigns in object storage: whole or not there, never overwritten, and not believed.

mod hostile;
mod memory;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::thread;

use fretwear::published::{Fetched, Kind, PublishError, Published};
use fretwear::store::{FileSystem, RealFileSystem};

use crate::campaign::{GRID, planned};
use crate::support::{Bench, copy, latest, verified};
use memory::Memory;

const MANIFEST: &str = "published.json";

fn disk() -> Arc<dyn FileSystem> {
    Arc::new(RealFileSystem)
}

fn publish(memory: &Memory, root: &Path) -> Result<Published, PublishError> {
    fretwear::published::publish(memory, &disk(), root)
}

fn fetch(memory: &Memory, root: &Path) -> Result<Fetched, PublishError> {
    fretwear::published::fetch(memory, &disk(), root)
}

/// The files below a folder, locks left out.
fn files(root: &Path) -> BTreeMap<String, Vec<u8>> {
    fn walk(root: &Path, folder: &Path, into: &mut BTreeMap<String, Vec<u8>>) {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                walk(root, &path, into);
            } else if !path.ends_with("lock") {
                let name = path.strip_prefix(root).expect("below").to_string_lossy();
                into.insert(name.into_owned(), fs::read(&path).expect("a file"));
            }
        }
    }
    let mut found = BTreeMap::new();
    walk(root, root, &mut found);
    found
}

fn assert_equal(found: &BTreeMap<String, Vec<u8>>, expected: &BTreeMap<String, Vec<u8>>) {
    let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(found), names(expected));
    let differ = |name: &&String| found[*name] != expected[*name];
    assert_eq!(
        expected.keys().filter(differ).collect::<Vec<_>>(),
        Vec::<&String>::new()
    );
}

/// A campaign of six rows in `c`, of which these have ended and are collected.
fn campaign(rows: &str) -> Bench {
    let bench = planned(GRID);
    more(&bench, rows);
    bench
}

/// A campaign of six rows in `c` that keeps histories alone, few files, and of which `rows` have ended and are collected.
fn histories(rows: &str) -> Bench {
    let bench = crate::campaign::bench(GRID);
    let text = fs::read_to_string(bench.path("case.toml")).expect("a file");
    bench.write("case.toml", format!("keep = \"history\"\n{text}"));
    bench.done(&[
        "campaign",
        "plan",
        "case.toml",
        "--dir",
        "c",
        "--no-rehearsal",
    ]);
    more(&bench, rows);
    bench
}

fn more(bench: &Bench, rows: &str) {
    bench.done(&["campaign", "run", "--dir", "c", "--index", rows, "-q"]);
    bench.done(&["campaign", "collect", "--dir", "c"]);
}

#[test]
fn a_campaign_comes_back_to_the_same_bytes_and_grows() {
    let bench = campaign("0-2");
    let (memory, c) = (Memory::default(), bench.path("c"));
    let first = publish(&memory, &c).expect("published");
    assert!(first.changed && first.kind == Kind::Campaign);
    assert!(first.uploaded > 0 && first.uploaded <= first.files);
    let d = bench.path("d");
    let fetched = fetch(&memory, &d).expect("fetched");
    assert_eq!((fetched.kind, fetched.files), (Kind::Campaign, first.files));
    assert_equal(&files(&d), &files(&c));
    assert!(files(&d).contains_key("collected/shard-00000.parquet"));
    let shard = &memory.all()["collected/shard-00000.parquet"];
    assert_eq!(shard, &files(&c)["collected/shard-00000.parquet"]);

    let again = publish(&memory, &c).expect("published before");
    assert_eq!((again.uploaded, again.bytes, again.changed), (0, 0, false));
    assert_eq!(fetch(&memory, &d).expect("fetched before").files, 0);

    let before = memory.all();
    more(&bench, "3-4");
    assert!(publish(&memory, &c).expect("published").changed);
    let after = memory.all();
    for (name, bytes) in before.iter().filter(|(name, _)| *name != MANIFEST) {
        assert!(&after[name] == bytes, "{name} was overwritten");
    }
    fetch(&memory, &d).expect("what is new");
    assert_equal(&files(&d), &files(&c));
    let rows = bench
        .done(&["campaign", "status", "--dir", "d", "--json"])
        .json();
    assert_eq!((&rows["done"], &rows["collected"]), (&5.into(), &5.into()));
}

#[test]
fn a_campaign_that_became_longer_is_published_and_fetched_longer() {
    let bench = campaign("0");
    let (memory, c, d) = (Memory::default(), bench.path("c"), bench.path("d"));
    publish(&memory, &c).expect("published");
    fetch(&memory, &d).expect("fetched");
    let text = fs::read_to_string(bench.path("case.toml")).expect("a file");
    bench.write("case.toml", text.replace("[0.5, 0.7]", "[0.5, 0.7, 0.8]"));
    let plan = [
        "campaign",
        "plan",
        "case.toml",
        "--dir",
        "c",
        "--no-rehearsal",
    ];
    bench.done(&plan);
    publish(&memory, &c).expect("published longer");
    let behind = publish(&memory, &d).expect_err("d has six rows of nine");
    assert!(matches!(behind, PublishError::Behind { .. }), "{behind}");
    fetch(&memory, &d).expect("fetched longer");
    assert_equal(&files(&d), &files(&c));
    // A folder that is longer than what is published keeps its own.
    bench.write(
        "case.toml",
        text.replace("[0.5, 0.7]", "[0.5, 0.7, 0.8, 0.9]"),
    );
    bench.done(&plan);
    let own = files(&c);
    fetch(&memory, &c).expect("nothing to fetch");
    assert_equal(&files(&c), &own);
}

/// Wherever a publication ends, nothing of it is visible, and the next uploads what is missing and no more.
#[test]
fn a_publication_that_ends_anywhere_leaves_what_was_published_before() {
    let bench = histories("0-1");
    let c = bench.path("c");
    let whole = Memory::default();
    publish(&whole, &c).expect("published");
    let objects = whole.all();
    let first = files(&c);
    more(&bench, "2");
    let second = files(&c);
    let earlier = bench.path("earlier");
    fetch(&whole, &earlier).expect("fetched");
    let mut ended = 0;
    for writes in 0..objects.len() + 3 {
        let memory = Memory::default();
        memory.dies_after_writes(writes);
        let did = publish(&memory, &earlier);
        memory.lives();
        let before = memory.all();
        let d = bench.path(&format!("d{writes}"));
        if did.is_err() {
            ended += 1;
            let nothing = fetch(&memory, &d).expect_err("nothing is visible");
            assert!(
                matches!(nothing, PublishError::NothingPublished { .. }),
                "{nothing}"
            );
            assert!(!d.exists());
        }
        let next = publish(&memory, &earlier).expect("completed");
        let there = |name: &&String| *name != MANIFEST && *name != "conditions";
        let missing = objects.keys().filter(there).count() - before.keys().filter(there).count();
        assert_eq!(next.uploaded, missing, "after {writes}");
        assert_equal(&memory.all(), &objects);
        fetch(&memory, &d).expect("fetched");
        assert_equal(&files(&d), &first);
    }
    assert!(ended > objects.len());

    // The same of what is added.
    let mut ended = 0;
    for writes in 2.. {
        let memory = Memory::default();
        objects
            .iter()
            .for_each(|(name, bytes)| memory.set(name, bytes.clone()));
        memory.dies_after_writes(writes);
        let did = publish(&memory, &c);
        memory.lives();
        let d = bench.path(&format!("e{writes}"));
        fetch(&memory, &d).expect("fetched");
        match did {
            Err(_) => assert_equal(&files(&d), &first),
            Ok(_) => {
                assert_equal(&files(&d), &second);
                break;
            }
        }
        ended += 1;
    }
    assert!(ended > 0);
}

#[test]
fn a_fetch_that_ends_anywhere_is_no_campaign_yet_and_goes_on() {
    let bench = histories("0-1");
    let (memory, c) = (Memory::default(), bench.path("c"));
    publish(&memory, &c).expect("published");
    let all = memory.all().len();
    for reads in 0..all {
        let d = bench.path(&format!("d{reads}"));
        memory.dies_after_reads(reads);
        let did = fetch(&memory, &d);
        memory.lives();
        if did.is_err() {
            assert!(!d.join("campaign.parquet").exists(), "after {reads}");
        }
        fetch(&memory, &d).expect("fetched");
        assert_equal(&files(&d), &files(&c));
    }
}

/// Two machines compute rows of the same campaign, and publish at once.
#[test]
fn of_two_publishers_at_once_both_are_published() {
    let bench = planned(GRID);
    copy(&bench.path("c"), &bench.path("b"));
    bench.done(&["campaign", "run", "--dir", "c", "--index", "0-2", "-q"]);
    bench.done(&["campaign", "run", "--dir", "b", "--index", "3-5", "-q"]);
    bench.done(&["campaign", "collect", "--dir", "c"]);
    for round in 0..10 {
        let memory = Memory::default();
        thread::scope(|scope| {
            for name in ["b", "c", "b", "c"] {
                let (memory, root) = (&memory, bench.path(name));
                scope.spawn(move || {
                    // The same folder is published by one at a time.
                    while let Err(error) = publish(memory, &root) {
                        assert!(matches!(error, PublishError::Locked { .. }), "{error}");
                    }
                });
            }
        });
        let d = bench.path(&format!("d{round}"));
        fetch(&memory, &d).expect("fetched");
        let mut both = files(&bench.path("b"));
        both.extend(files(&bench.path("c")));
        assert_equal(&files(&d), &both);
    }
}

#[test]
fn what_is_something_else_is_refused_and_stays() {
    let bench = campaign("0");
    let (memory, c) = (Memory::default(), bench.path("c"));
    publish(&memory, &c).expect("published");
    let before = memory.all();
    let refused = |root: &Path, says: &str| {
        let error = publish(&memory, root).expect_err("another");
        assert!(error.is_damage_or_mismatch(), "{error}");
        let error = error.to_string();
        assert!(
            error.contains("s3://memory/joint") && error.contains(says),
            "{error}"
        );
        assert!(memory.all() == before);
    };
    // Another campaign; the same with another run of a row; a run.
    let text = fs::read_to_string(bench.path("case.toml")).expect("a file");
    bench.write("other.toml", text.replace("[0.5, 0.7]", "[0.5, 0.6]"));
    bench.done(&[
        "campaign",
        "plan",
        "other.toml",
        "--dir",
        "o",
        "--no-rehearsal",
    ]);
    refused(&bench.path("o"), "its row 3 is another");
    let own = files(&c);
    bench.write("case.toml", &text);
    bench.done(&[
        "campaign",
        "plan",
        "case.toml",
        "--dir",
        "p",
        "--no-rehearsal",
    ]);
    bench.done(&["campaign", "run", "--dir", "p", "--index", "0", "-q"]);
    // A run tells its seconds, which differ.
    refused(&bench.path("p"), "is another");
    refused(
        &bench.path("c/runs/000000"),
        "holds a campaign: this is a run",
    );

    // Into folders of something else.
    for (folder, says) in [
        ("o", "its row 3 is another"),
        ("p", "is published"),
        ("c/runs/000000", "no part of a campaign"),
    ] {
        let root = bench.path(folder);
        let kept = files(&root);
        let error = fetch(&memory, &root).expect_err("another").to_string();
        assert!(error.contains(says), "{error}");
        assert_equal(&files(&root), &kept);
    }
    assert_equal(&files(&c), &own);

    // An object that another program has put there.
    let other = Memory::default();
    other.set("collected/shard-00000.parquet", b"something".to_vec());
    let error = publish(&other, &c).expect_err("another");
    assert!(matches!(error, PublishError::Other { .. }), "{error}");
    assert_eq!(other.all()["collected/shard-00000.parquet"], b"something");
    assert!(!other.all().contains_key(MANIFEST));
}

#[test]
fn a_storage_that_would_overwrite_is_refused() {
    let bench = campaign("0");
    let mut memory = Memory::default();
    memory.heeds = false;
    let error = publish(&memory, &bench.path("c")).expect_err("no conditions");
    assert!(
        matches!(error, PublishError::NoConditions { .. }),
        "{error}"
    );
    assert_eq!(memory.all().into_keys().collect::<Vec<_>>(), ["conditions"]);
}

#[test]
fn a_run_is_published_as_far_as_it_is_and_verifies_where_it_is_fetched() {
    let bench = Bench::new();
    let memory = Memory::default();
    let error = publish(&memory, &bench.path("r")).expect_err("no folder");
    assert!(error.is_usage(), "{error}");
    let run = |set: &str| {
        bench.done(&["run", "small.toml", "--run", "r", "-q", "--set", set]);
    };
    run("wear.cycles=100_000");
    let (r, d) = (bench.path("r"), bench.path("d"));
    publish(&memory, &r).expect("published");
    fetch(&memory, &d).expect("fetched");
    assert_equal(&files(&d), &files(&r));
    let early = latest(&d);

    run("wear.cycles=300_000");
    assert!(latest(&r) > early);
    publish(&memory, &r).expect("published further");
    let behind = publish(&memory, &d).expect_err("d is an earlier state");
    assert!(matches!(behind, PublishError::Behind { .. }), "{behind}");
    let occupied = fetch(&memory, &d).expect_err("d is another state");
    assert!(
        matches!(occupied, PublishError::Occupied { .. }),
        "{occupied}"
    );
    let e = bench.path("e");
    fetch(&memory, &e).expect("fetched");
    assert_equal(&files(&e), &files(&r));
    assert!(verified(&e).is_sound());

    bench.done(&[
        "run",
        "small.toml",
        "--run",
        "other",
        "-q",
        "--set",
        "surface.seed=9",
    ]);
    let other = publish(&memory, &bench.path("other")).expect_err("another run");
    assert!(matches!(other, PublishError::Other { .. }), "{other}");
}

#[test]
fn a_folder_that_is_being_computed_is_not_published() {
    let bench = campaign("0");
    let _held = disk().try_lock(&bench.path("c/lock")).expect("a lock");
    let error = publish(&Memory::default(), &bench.path("c")).expect_err("locked");
    assert!(matches!(error, PublishError::Locked { .. }), "{error}");
}

#[cfg(not(feature = "object_store"))]
#[test]
fn a_program_without_object_storage_says_how_it_is_built() {
    let bench = Bench::new();
    for arguments in [
        ["publish", "c", "--to", "s3://b/p"],
        ["fetch", "s3://b/p", "--to", "c"],
    ] {
        let did = bench.fretwear(&arguments);
        assert_eq!(did.code(), 2);
        assert!(
            did.stderr().contains("--features object_store"),
            "{}",
            did.stderr()
        );
    }
}

/// What is published and fetched through the library that speaks to S3, over its storage in memory.
#[cfg(feature = "object_store")]
mod bucket {
    use fretwear::published::{Bucket, Found, Objects, Put, Version, fetch, publish};
    use object_store::{memory::InMemory, path::Path};

    use super::*;

    fn bucket(prefix: &str) -> Bucket {
        let prefix = Path::from(prefix);
        Bucket::over(Arc::new(InMemory::new()), "s3://memory/a", prefix).expect("a bucket")
    }

    #[test]
    fn conditions_are_heeded() {
        for prefix in ["", "a/b"] {
            let bucket = bucket(prefix);
            let name = "iterations/wear_iteration=3/summary.parquet";
            assert_eq!(bucket.read(name, 9).expect("read"), Found::Nothing);
            assert_eq!(
                bucket.create(name, b"one".to_vec()).expect("put"),
                Put::Done
            );
            assert_eq!(
                bucket.create(name, b"two".to_vec()).expect("put"),
                Put::Refused
            );
            assert_eq!(bucket.read(name, 2).expect("read"), Found::Longer(3));
            let Found::Object(bytes, version) = bucket.read(name, 3).expect("read") else {
                panic!("it is there");
            };
            assert_eq!(bytes, b"one");
            let old = Version("0".repeat(4) + &version.0);
            let replace = |bytes: &[u8], version| bucket.replace(name, bytes.to_vec(), version);
            assert_eq!(replace(b"three", &old).expect("put"), Put::Refused);
            assert_eq!(replace(b"three", &version).expect("put"), Put::Done);
            assert_eq!(replace(b"four", &version).expect("put"), Put::Refused);
            let names: Vec<String> = bucket.list().expect("listed").into_iter().collect();
            assert_eq!(names, [name]);
        }
    }

    #[test]
    fn a_campaign_comes_back_to_the_same_bytes() {
        let bench = campaign("0-1");
        let (bucket, c, d) = (bucket("some/where"), bench.path("c"), bench.path("d"));
        publish(&bucket, &disk(), &c).expect("published");
        fetch(&bucket, &disk(), &d).expect("fetched");
        assert_equal(&files(&d), &files(&c));
    }

    #[test]
    fn places_are_read_strictly() {
        for place in [
            "",
            "friction",
            "s3:/a/b",
            "s3://",
            "s3:///a",
            "http://a/b",
            "s3://a b/c",
            "s3://a/b/../c",
            "s3://a//b",
        ] {
            let Err(error) = Bucket::at(place) else {
                panic!("{place}");
            };
            assert!(error.is_usage(), "{place}: {error}");
        }
    }
}
