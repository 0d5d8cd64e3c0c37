//! Tests of the run store with runs that are killed, damaged, shared, continued, branched and pruned.

mod cache;
mod damage;
mod date;
mod faults;
mod keys;
mod lifecycle;
mod sibling;
mod untrusted;

use crate::support::faulty::FaultyFileSystem;
use fretwear::store::{
    FileSystem, Keep, Opening, RunIdentity, RunStore, StageKey, StoreError, StoredResult,
};
use fretwear::tables::{Table, TableName, Tables, TypedTable, typed};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// File system without waits for the disk, since the tests write thousands of files.
fn quick() -> Arc<dyn FileSystem> {
    Arc::new(FaultyFileSystem::sound())
}

fn scene(cycles: u64, rq: f64) -> Value {
    json!({
        "title": "a small joint",
        "surface": { "kind": "gaussian", "rq": rq, "seed": 1 },
        "wear": { "coefficient": 2e-15, "cycles": cycles },
        "output": { "keep": "all" },
    })
}

fn identity_of(scene: Value) -> RunIdentity {
    RunIdentity {
        scene_toml: format!("# {scene}\n"),
        scene_written: None,
        plan: json!({ "blocks": ["zz", "xx"] }),
        scene,
        program_version: "0.1.0".to_owned(),
        threads: 1,
        seed: Some(1),
        free_keys: vec!["wear.cycles".to_owned(), "output.*".to_owned()],
        following_keys: Vec::new(),
        inherited_keys: Vec::new(),
    }
}

fn identity() -> RunIdentity {
    identity_of(scene(1000, 5e-6))
}

fn open(fs: Arc<dyn FileSystem>, root: &Path) -> Result<(RunStore, Opening), StoreError> {
    RunStore::create_or_open(fs, root, &identity())
}

const NX: i32 = 7;
const NY: i32 = 4;

/// Field with values that depend on the iteration, the run and the earlier tables.
fn wear_field(depth: impl Fn(i32) -> f64) -> Table {
    let cells = 0..NX * NY;
    Table::builder(TableName::WearField)
        .column("i", cells.clone().map(|c| c / NY).collect::<Vec<i32>>())
        .column("j", cells.clone().map(|c| c % NY).collect::<Vec<i32>>())
        .column("wear_depth", cells.map(depth).collect::<Vec<f64>>())
        .build()
        .expect("a field")
}

fn wear_step(k: u64) -> typed::WearStep {
    typed::WearStep {
        n_cycles: 10 * k as i64,
        volume: 1e-13 * k as f64,
        ..typed::WearStep::default()
    }
}

fn cycle(amplitude: f64) -> Table {
    Table::builder(TableName::Cycle)
        .column("time", vec![0.0, 0.25, 0.5, 0.75])
        .column("displacement_x", vec![amplitude, 0.0, -amplitude, 0.0])
        .column("normal_load", vec![3e4; 4])
        .column("force_x", vec![1.0, 0.5, -1.0, -0.5])
        .build()
        .expect("a cycle")
}

fn timing(seconds: f64) -> Table {
    Table::builder(TableName::Timing)
        .column("stage", vec!["wear".to_owned()])
        .column("seconds", vec![seconds])
        .column("fft_pairs", vec![12.0])
        .column("cpu_seconds", vec![Some(seconds)])
        .build()
        .expect("a timing")
}

fn surface(rq: f64) -> Table {
    let cells = 0..NX * NY;
    Table::builder(TableName::Surface)
        .column("i", cells.clone().map(|c| c / NY).collect::<Vec<i32>>())
        .column("j", cells.clone().map(|c| c % NY).collect::<Vec<i32>>())
        .column(
            "height",
            cells
                .clone()
                .map(|c| rq * f64::from(c).sin())
                .collect::<Vec<f64>>(),
        )
        .column("kept", cells.map(|c| c != 3).collect::<Vec<bool>>())
        .build()
        .expect("a surface")
}

/// Record of a caller up to a failure.
#[derive(Default)]
struct Seen {
    committed: Option<u64>,
    computed: Vec<String>,
}

/// Runs the loop of a caller up to an iteration: tables of the run, then draft, tables, commit and, on request, pruning.
///
/// The tables of an iteration depend on the earlier tables. A wrong restart therefore changes the content.
fn run(
    store: &mut RunStore,
    rq: f64,
    last: u64,
    prune: bool,
    seen: &mut Seen,
) -> Result<(), StoreError> {
    let surface_key = StageKey::new("surface", &[TableName::Surface], &json!({ "rq": rq }), &[]);
    if let StoredResult::Stale(_) = store.once(TableName::Surface, &surface_key)? {
        seen.computed.push("surface".to_owned());
        store.put_once(TableName::Surface, &surface_key, &surface(rq))?;
    }
    let StoredResult::Valid(heights) = store.once(TableName::Surface, &surface_key)? else {
        panic!("the stored surface is missing");
    };
    let heights = heights.f64("height").expect("a column").to_vec();
    while store.next() <= last {
        let k = store.next();
        let (depth, state) = match k.checked_sub(1) {
            None => (vec![0.0; heights.len()], surface_key.clone()),
            Some(before) => (
                store
                    .read(before, TableName::WearField)?
                    .f64("wear_depth")
                    .expect("a column")
                    .to_vec(),
                StageKey::of_commit(store.reader().commit_of(before)?),
            ),
        };
        let mut draft = store.draft(k)?;
        let cycle_key = StageKey::new(
            "cycle",
            &[TableName::Cycle],
            &json!({ "amplitude": 3e-6 }),
            &[&state],
        );
        let one = |table: Table, name| Tables::from([(name, table)]);
        let amplitude = match draft.get(&cycle_key)? {
            StoredResult::Valid(kept) => kept[&TableName::Cycle]
                .f64("displacement_x")
                .expect("a column")[0],
            StoredResult::Stale(_) => {
                seen.computed.push(format!("cycle {k}"));
                let amplitude = 3e-6 + k as f64 * 1e-9;
                let tables = one(cycle(amplitude), TableName::Cycle);
                draft.put(&cycle_key, &tables, &[])?;
                amplitude
            }
        };
        let of_wear = [TableName::WearField, TableName::WearStep];
        let wear_key = StageKey::new("wear", &of_wear, &json!({}), &[&cycle_key]);
        if let StoredResult::Stale(_) = draft.get(&wear_key)? {
            seen.computed.push(format!("wear {k}"));
            let worn = wear_field(|c| {
                let c = c as usize;
                if k == 0 {
                    0.0
                } else {
                    depth[c] + amplitude * heights[c].abs()
                }
            });
            let mut tables = one(worn, TableName::WearField);
            tables.insert(TableName::WearStep, wear_step(k).to_table().expect("a row"));
            draft.put(&wear_key, &tables, &[])?;
        }
        let timing_key = StageKey::new("timing", &[TableName::Timing], &json!({}), &[&wear_key]);
        let timing = timing(0.1 * seen.computed.len() as f64);
        draft.put(&timing_key, &one(timing, TableName::Timing), &[])?;
        store.commit(draft)?;
        seen.committed = Some(k);
        if prune {
            store.prune(&Keep {
                every: Some(3),
                last: 2,
                also: BTreeSet::new(),
            })?;
        }
    }
    Ok(())
}

/// Creates a finished run in its own folder.
fn finished(root: &Path, last: u64) -> RunStore {
    let (mut store, _) = open(quick(), root).expect("a new run");
    run(&mut store, 5e-6, last, false, &mut Seen::default()).expect("a run");
    store
}

/// Hashes of all stored commits.
fn hashes(store: &RunStore) -> BTreeMap<u64, String> {
    store
        .reader()
        .iterations()
        .map(|k| (k, store.reader().commit_of(k).expect("listed").hash.clone()))
        .collect()
}

/// All files below a folder with their content, except timings and the commit files that name them.
fn content(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    fn walk(folder: &Path, into: &mut BTreeMap<PathBuf, Vec<u8>>) {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                walk(&path, into);
            } else if !path.ends_with("timing.parquet") && !path.ends_with("commit.json") {
                into.insert(path.clone(), fs::read(&path).expect("a file"));
            }
        }
    }
    let mut files = BTreeMap::new();
    walk(folder, &mut files);
    files
        .into_iter()
        .map(|(path, bytes)| (path.strip_prefix(folder).expect("below").to_owned(), bytes))
        .collect()
}

/// Changes one byte of a file.
fn flip(path: &Path, at: usize) {
    let mut bytes = fs::read(path).expect("a file");
    let at = at % bytes.len();
    bytes[at] ^= 0x10;
    fs::write(path, bytes).expect("written");
}
