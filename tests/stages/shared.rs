//! Reduced structures in the cache, shared between runs.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use fretwear::stages::Stage;
use fretwear::store::{Cache, RealFileSystem, StageKey, StoredResult};
use fretwear::tables::{Provenance, Table, TableName, TypedTable, typed};

use super::Start;
use crate::support::{Bench, Did, assert_same, content, flip, verified};

const TABLES: [&str; 6] = [
    "structure",
    "structure_port",
    "structure_mode",
    "structure_residual",
    "structure_outline",
    "structure_outline_mode",
];

/// Runs the resonator for one iteration.
fn begin(bench: &Bench, name: &str, cache: &str, sets: &[&str]) -> Did {
    let mut arguments = vec!["run", "resonator.toml", "--run", name, "--json"];
    let short = ["wear.cycles=1", "output.response_at=[]"];
    arguments.extend(short.iter().chain(sets).flat_map(|set| ["--set", set]));
    let output = bench
        .command(&arguments)
        .env("FRETWEAR_CACHE", cache)
        .output();
    let did = Did(output.expect("the program runs"));
    assert_eq!(did.code(), 0, "{}", did.stderr());
    did
}

fn computed(did: &Did) -> bool {
    did.json()["timing"].get("structure").is_some()
}

fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if !path.ends_with("lock") {
            let bytes = fs::read(&path).expect("a file");
            found.insert(path, bytes);
        }
    }
    found
}

#[test]
fn a_second_run_takes_the_structure_of_the_first() {
    let bench = Bench::new();
    let first = begin(&bench, "a", "cache", &[]);
    assert!(computed(&first) && !first.stderr().contains("note: the reduced"));
    let second = begin(&bench, "b", "cache", &[]);
    assert!(!computed(&second), "{}", second.stdout());
    let said = "note: the reduced structure is read from cache";
    assert!(second.stderr().contains(said), "{}", second.stderr());
    let none = begin(&bench, "c", "", &[]);
    assert!(computed(&none));
    let expected = content(&bench.path("a"));
    for name in ["b", "c"] {
        assert_same(&content(&bench.path(name)), &expected, name);
        verified(&bench.path(name));
    }
    // A restarted run uses the structure in its folder.
    let again = begin(&bench, "b", "cache", &[]);
    assert!(
        !again.stderr().contains("note: the reduced"),
        "{}",
        again.stderr()
    );
    // Only inputs of the reduction create a new entry. Other keys use the same entry.
    let entries = || {
        let entries = fs::read_dir(bench.path("cache")).expect("a folder");
        let paths = entries.map(|entry| entry.expect("an entry").path());
        paths.filter(|path| path.is_dir()).count()
    };
    assert_eq!(entries(), 1);
    begin(
        &bench,
        "d",
        "cache",
        &["dynamics.force.amplitude=\"200 N\""],
    );
    begin(&bench, "e", "cache", &["contact.friction_coefficient=0.5"]);
    assert_eq!(entries(), 1);
    for (name, set) in [
        ("f", "dynamics.modes=9"),
        ("g", "structure.leaf_thickness=\"10.1 mm\""),
        ("h", "material.density=\"7950 kg/m^3\""),
        ("i", "joint.size=[\"40 mm\", \"35.9 mm\"]"),
    ] {
        let before = entries();
        assert!(computed(&begin(&bench, name, "cache", &[set])), "{set}");
        assert_eq!(entries(), before + 1, "{set}");
    }
}

#[test]
fn a_flipped_bit_of_the_cache_is_found_and_repaired() {
    let bench = Bench::new();
    begin(&bench, "a", "cache", &[]);
    let expected = content(&bench.path("a"));
    let sound = files(&bench.path("cache"));
    assert_eq!(sound.len(), 2 * TABLES.len());
    for (run, path) in sound.keys().enumerate() {
        flip(path);
        let name = format!("run-{run}");
        let did = begin(&bench, &name, "cache", &[]);
        assert!(computed(&did), "{}: no damage found", path.display());
        assert_same(&content(&bench.path(&name)), &expected, &name);
        assert!(
            files(&bench.path("cache")) == sound,
            "{} is not repaired",
            path.display()
        );
    }
}

#[test]
fn a_flipped_bit_of_the_own_structure_is_found_and_repaired() {
    let bench = Bench::new();
    begin(&bench, "a", "cache", &[]);
    let root = bench.path("a");
    let expected = content(&root);
    for name in TABLES {
        for (cache, taken) in [("cache", true), ("", false)] {
            flip(&root.join(format!("once/{name}.parquet")));
            assert_eq!(bench.fretwear(&["verify", "a"]).code(), 4);
            let did = begin(&bench, "a", cache, &[]);
            assert_eq!(
                did.stderr().contains("note: the reduced"),
                taken,
                "{}",
                did.stderr()
            );
            assert_same(&content(&root), &expected, name);
            verified(&root);
        }
    }
}

#[test]
fn a_cache_that_cannot_be_used_is_no_failure() {
    let bench = Bench::new();
    let expected = {
        begin(&bench, "expected", "", &[]);
        content(&bench.path("expected"))
    };
    // A file has the path of the folder, or of the entry.
    let did = begin(&bench, "a", "resonator.toml/cache", &[]);
    let unread = "note: the cache of structures, resonator.toml/cache, cannot be read: ";
    assert!(did.stderr().contains(unread), "{}", did.stderr());
    assert_same(&content(&bench.path("a")), &expected, "a");
    begin(&bench, "b", "cache", &[]);
    for entry in fs::read_dir(bench.path("cache")).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            fs::remove_dir_all(&path).expect("removed");
            fs::write(&path, "in the way").expect("written");
        }
    }
    let did = begin(&bench, "c", "cache", &[]);
    assert!(computed(&did));
    assert_same(&content(&bench.path("c")), &expected, "c");
}

/// Several runs add the same entry at once. One entry remains, and no run reads an incomplete entry.
#[test]
fn several_runs_at_once() {
    let bench = Bench::new();
    let names = ["a", "b", "c", "d"];
    let children = names.map(|name| {
        let mut command = bench.command(&["run", "resonator.toml", "--until", "structure"]);
        command.args(["--run", name]).env("FRETWEAR_CACHE", "cache");
        command.spawn().expect("started")
    });
    for child in children {
        let did = Did(child.wait_with_output().expect("a child"));
        assert_eq!(did.code(), 0, "{}", did.stderr());
    }
    let last = begin(&bench, "last", "cache", &[]);
    assert!(!computed(&last), "{}", last.stderr());
    for name in names {
        for table in TABLES {
            let file = format!("once/{table}.parquet");
            let read = |run: &str| fs::read(bench.path(run).join(&file)).expect("a file");
            assert!(read(name) == read("last"), "{file} of {name}");
        }
    }
}

#[test]
fn where_the_cache_is() {
    let bench = Bench::new();
    let run = |name: &str, cache: Option<&str>, user: &str, home: &str| {
        let short = ["--until", "structure", "--run", name];
        let mut command = bench.command(&[&["run", "resonator.toml"][..], &short].concat());
        command
            .env_remove("FRETWEAR_CACHE")
            .env("XDG_CACHE_HOME", bench.path(user))
            .env("HOME", bench.path(home));
        if user.is_empty() {
            command.env("XDG_CACHE_HOME", "");
        }
        if let Some(cache) = cache {
            command.env("FRETWEAR_CACHE", cache);
        }
        assert!(command.output().expect("the program runs").status.success());
    };
    run("a", Some(""), "user", "home");
    assert!(!bench.path("user").exists() && !bench.path("home").exists());
    run("b", None, "user", "home");
    assert!(bench.path("user/fretwear").is_dir() && !bench.path("home").exists());
    run("c", None, "", "home");
    assert!(bench.path("home/.cache/fretwear").is_dir());
    run("d", Some("own"), "other", "home");
    assert!(bench.path("own").is_dir() && !bench.path("other").exists());
}

#[test]
fn within_a_process_too() {
    let bench = Bench::new();
    let cache = bench.path("cache");
    let scene = bench.scene("resonator.toml", &[]);
    let until = |name: &str| {
        let root = bench.path(name);
        let start = Start::new(scene.clone(), &root).sharing(cache.clone());
        let (_, seen) = start.until(Stage::Structure).done();
        (seen.stages.take(), seen.notices.take())
    };
    assert_eq!(until("a").0, [(Stage::Structure, 0)]);
    let (stages, notices) = until("b");
    assert_eq!(stages, []);
    assert!(
        notices
            .iter()
            .any(|n| n.starts_with("the reduced structure is read from")),
        "{notices:?}"
    );
}

/// The tables have valid hashes, but they belong to different structures or lack a point of the scene.
#[test]
fn tables_that_do_not_fit_to_each_other_are_computed_again() {
    let bench = Bench::new();
    begin(&bench, "whole", "cache", &[]);
    let expected = content(&bench.path("whole"));
    let entries = fs::read_dir(bench.path("cache")).expect("a folder");
    let mut entries = entries.map(|entry| entry.expect("an entry").path());
    let entry = entries.find(|path| path.is_dir()).expect("an entry");
    let keyed = fs::read(entry.join("structure.json")).expect("a file");
    let keyed: serde_json::Value = serde_json::from_slice(&keyed).expect("JSON");
    let key: StageKey = serde_json::from_value(keyed["key"].clone()).expect("a key");
    let cache = Cache::new(Arc::new(RealFileSystem), &bench.path("cache"));
    let names = TABLES.map(|name| TableName::from_name(name).expect("a table"));
    let StoredResult::Valid(whole) = cache.get(&names, &key).expect("readable") else {
        panic!("the result is missing");
    };
    let provenance = Provenance {
        scene_hash: String::new(),
        program_version: String::new(),
    };
    let port = typed::StructurePort::of(&whole[1]).expect("ports");
    let mode = typed::StructureMode::of(&whole[2]).expect("modes");
    let residual = typed::StructureResidual::of(&whole[3]).expect("a residual");
    let count = port.port.len();
    let mut forged: Vec<(usize, Table)> = Vec::new();
    let mut add = |k: usize, table: Result<Table, _>| forged.push((k, table.expect("a table")));
    let renamed = port.point.iter().map(|point| match point.as_str() {
        "far_wall" => "elsewhere".to_owned(),
        point => point.to_owned(),
    });
    add(
        1,
        typed::StructurePort {
            point: renamed.collect(),
            ..port.clone()
        }
        .to_table(),
    );
    let mut other = port.clone();
    other.point[count - 1] = "x".to_owned();
    add(1, other.to_table());
    let mut other = port.clone();
    other.element[0] = 3;
    add(1, other.to_table());
    let mut other = mode.clone();
    other.frequency[count + 1] += 1.0;
    add(2, other.to_table());
    let mut other = residual.clone();
    other.row[4] = i32::MAX;
    add(3, other.to_table());
    for (place, table) in forged {
        let mut tables = whole.clone();
        tables[place] = table;
        let named: Vec<_> = names.into_iter().zip(&tables).collect();
        cache.put(&key, &named, &provenance).expect("put");
        let files = ["parquet", "json"].map(|ending| format!("{}.{ending}", TABLES[place]));
        for file in &files {
            fs::copy(entry.join(file), bench.path(file)).expect("copied");
        }
        let run = bench.path("a");
        let did = begin(&bench, "a", "cache", &[]);
        assert!(computed(&did), "{}", did.stdout());
        let said = did.stderr();
        assert!(
            said.contains("in cache is computed again and replaced"),
            "{said}"
        );
        assert_same(&content(&run), &expected, "computed again");
        assert!(!computed(&begin(&bench, "b", "cache", &[])));
        // The same tables in the folder of a run are damage.
        for file in &files {
            fs::copy(bench.path(file), run.join("once").join(file)).expect("copied");
        }
        let renamed = bench.fretwear(&["verify", "a"]).code();
        if place != 1 || !said.contains("no point far_wall") {
            assert_eq!(renamed, 4);
            let export = bench.fretwear(&["export", "a", "--reduced", "r"]);
            assert_eq!(export.code(), 4, "{}", export.stderr());
        }
        begin(&bench, "a", "", &["wear.cycles=2"]);
        verified(&run);
        for folder in ["a", "b"] {
            fs::remove_dir_all(bench.path(folder)).expect("removed");
        }
    }
}

#[test]
fn a_cache_that_cannot_be_written_is_reported_once_by_name() {
    let bench = Bench::new();
    bench.write("cache", "a file");
    let did = begin(&bench, "a", "cache", &[]);
    let lines: Vec<String> = did.stderr().lines().map(str::to_owned).collect();
    let of_cache = lines.iter().filter(|line| line.contains("cache"));
    assert_eq!(of_cache.count(), 1, "{lines:?}");
}
