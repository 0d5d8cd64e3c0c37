//! Tests of the cache: the cache returns a whole result or no result, after any failure during writing or reading and after damage.

use super::{StageKey, quick, surface, wear_field};
use crate::support::faulty::{Fault, FaultyFileSystem};
use crate::support::flip;
use fretwear::store::{Cache, FileSystem, StoredResult};
use fretwear::tables::{Provenance, Table, TableName};
use serde_json::json;
use std::fs;
use std::path::Path;
use std::sync::Arc;

const TABLES: [TableName; 2] = [TableName::Surface, TableName::WearField];

fn key(rq: f64) -> StageKey {
    StageKey::new("surface", &TABLES, &json!({ "rq": rq }), &[])
}

fn tables(rq: f64) -> Vec<Table> {
    vec![surface(rq), wear_field(|c| rq * f64::from(c))]
}

fn put(cache: &Cache, rq: f64) -> Result<(), fretwear::store::StoreError> {
    let tables = tables(rq);
    let named: Vec<(TableName, &Table)> = TABLES.into_iter().zip(&tables).collect();
    let provenance = Provenance {
        scene_hash: "of some scene".to_owned(),
        program_version: "0.1.0".to_owned(),
    };
    cache.put(&key(rq), &named, &provenance)
}

/// Number of entries of a cache, without its lock.
fn left(root: &Path) -> usize {
    let entries = fs::read_dir(root).expect("a folder");
    let names = entries.map(|entry| entry.expect("an entry").file_name());
    names.filter(|name| name != "lock").count()
}

/// Tables of a result, or `None` if the caller must compute them.
fn found(cache: &Cache, tables: &[TableName], key: &StageKey) -> Option<Vec<Table>> {
    match cache.get(tables, key).expect("readable") {
        StoredResult::Valid(tables) => Some(tables),
        StoredResult::Stale(_) => None,
    }
}

fn cache(root: &Path) -> Cache {
    Cache::new(quick(), root)
}

#[test]
fn what_is_put_is_found_under_its_key_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let cache = cache(&folder.path().join("below/cache"));
    assert_eq!(found(&cache, &TABLES, &key(1.0)), None);
    put(&cache, 1.0).expect("put");
    put(&cache, 2.0).expect("put");
    for rq in [1.0, 2.0] {
        let read = found(&cache, &TABLES, &key(rq));
        assert_eq!(read, Some(tables(rq)));
    }
    assert_eq!(found(&cache, &TABLES, &key(3.0)), None);
    // A result that lacks one of the requested tables counts as missing.
    let more = [TableName::Surface, TableName::Cycle];
    assert_eq!(found(&cache, &more, &key(1.0)), None);
}

#[test]
fn a_flipped_bit_or_a_lost_file_is_a_miss_and_is_replaced() {
    let folder = tempfile::tempdir().expect("a folder");
    let cache = cache(folder.path());
    put(&cache, 1.0).expect("put");
    let entry = folder.path().join(key(1.0).hash());
    let names: Vec<_> = fs::read_dir(&entry)
        .expect("a folder")
        .map(|e| e.expect("an entry").path())
        .collect();
    assert_eq!(names.len(), 4);
    for path in names {
        for lose in [false, true] {
            if lose {
                fs::remove_file(&path).expect("removed");
            } else {
                flip(&path);
            }
            let read = found(&cache, &TABLES, &key(1.0));
            assert_eq!(read, None, "{}", path.display());
            put(&cache, 1.0).expect("put");
            let read = found(&cache, &TABLES, &key(1.0));
            assert_eq!(read, Some(tables(1.0)));
        }
    }
    // The cache rejects an entry under the name of another key.
    fs::rename(&entry, folder.path().join(key(2.0).hash())).expect("renamed");
    assert_eq!(found(&cache, &TABLES, &key(2.0)), None);
}

/// After a fault at any call, the cache contains the whole result or no result. The next call adds the result and removes all remains.
#[test]
fn a_fault_at_any_call() {
    for fault in [
        Fault::Error,
        Fault::EndTruncating,
        Fault::EndBefore,
        Fault::PowerLoss,
    ] {
        for there in [false, true] {
            let begin = |root: &Path| {
                if there {
                    put(&cache(root), 1.0).expect("put");
                    flip(&root.join(key(1.0).hash()).join("surface.parquet"));
                }
            };
            let folder = tempfile::tempdir().expect("a folder");
            let counted = Arc::new(FaultyFileSystem::sound());
            begin(folder.path());
            put(&Cache::new(counted.clone(), folder.path()), 1.0).expect("put");
            for call in 1..=counted.calls(fault) {
                let at = format!("{fault:?} at call {call}, there: {there}");
                let folder = tempfile::tempdir().expect("a folder");
                begin(folder.path());
                let failing = Arc::new(FaultyFileSystem::failing(call, fault));
                let through: Arc<dyn FileSystem> = failing.clone();
                let result = put(&Cache::new(through, folder.path()), 1.0);
                assert!(result.is_err(), "{at}: the fault caused no error");
                failing.settle();
                let read = found(&cache(folder.path()), &TABLES, &key(1.0));
                assert!(read.is_none() || read == Some(tables(1.0)), "{at}");
                put(&cache(folder.path()), 1.0).unwrap_or_else(|error| panic!("{at}: {error}"));
                let read = found(&cache(folder.path()), &TABLES, &key(1.0));
                assert_eq!(read, Some(tables(1.0)), "{at}");
                assert_eq!(left(folder.path()), 1, "{at}: a file remains");
            }
        }
    }
}

#[test]
fn no_room_is_said_before_anything_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let little = Arc::new(FaultyFileSystem::with_free_space(1000));
    let error = put(&Cache::new(little, folder.path()), 1.0).expect_err("no room");
    assert!(
        matches!(error, fretwear::store::StoreError::NoSpace { .. }),
        "{error}"
    );
    assert_eq!(left(folder.path()), 0, "a draft remains");
}

/// An entry without a seal is computed again, since anybody may have written it by hand.
#[test]
fn an_entry_without_a_seal_is_a_miss_that_says_why() {
    let folder = tempfile::tempdir().expect("a folder");
    let cache = cache(folder.path());
    put(&cache, 1.0).expect("put");
    let path = folder.path().join(key(1.0).hash()).join("surface.json");
    let text = fs::read_to_string(&path).expect("a file");
    let (before, _) = text.rsplit_once(",\n  \"seal\"").expect("a seal");
    fs::write(&path, format!("{before}\n}}\n")).expect("written");
    match cache.get(&TABLES, &key(1.0)).expect("readable") {
        StoredResult::Stale(why) => assert!(why.to_string().contains("surface.json"), "{why}"),
        StoredResult::Valid(_) => panic!("the seal is missing"),
    }
    put(&cache, 1.0).expect("put");
    assert_eq!(found(&cache, &TABLES, &key(1.0)), Some(tables(1.0)));
}
