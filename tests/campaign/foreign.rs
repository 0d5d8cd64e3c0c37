//! Tests of folders and files from other sources in a campaign: links, runs of other scenes, unreadable and forged files, and leftovers.

use std::fs;
use std::io;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use fretwear::campaign::{CampaignError, CampaignFolder};
use fretwear::store::{Entry, FileSystem, LockAttempt, Metadata, RealFileSystem, remove_run};
use fretwear::tables::{
    ColumnSchema, ColumnType, Nullable, metadata_entry, nullable_from_parquet, nullable_to_parquet,
};
use serde_json::Value;

use super::rows::fails;
use super::{GRID, PLAN, bench, planned};
use crate::support::Bench;
use crate::support::faulty::{Fault, FaultyFileSystem};

const RUN: [&str; 5] = ["campaign", "run", "--dir", "c", "-q"];

/// Campaign of six rows that keeps only histories.
fn keeping_history() -> Bench {
    let bench = bench(GRID);
    let text = fs::read_to_string(bench.path("case.toml")).expect("a file");
    bench.write("case.toml", format!("keep = \"history\"\n{text}"));
    bench.done(&PLAN);
    bench
}

/// All files below a folder, with their bytes.
fn files_below(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        match path.is_dir() {
            true => found.extend(files_below(&path)),
            false => found.push((path.clone(), fs::read(&path).expect("a file"))),
        }
    }
    found.sort();
    found
}

fn content_key(bench: &Bench, row: usize) -> String {
    match &super::rows::columns(bench, "c/campaign.parquet")["content_key"] {
        Nullable::Text(keys) => keys[row].clone().expect("a key"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn folders_that_are_links_are_rejected_before_anything_is_touched() {
    let bench = keeping_history();
    bench.done(&[
        "campaign",
        "plan",
        "case.toml",
        "--dir",
        "mine",
        "--no-rehearsal",
    ]);
    bench.done(&["campaign", "run", "--dir", "mine", "-q"]);
    // A run that the other campaign keeps.
    bench.done(&["run", "small.toml", "--run", "mine/runs/000000", "-q"]);
    for name in ["runs", "ended", "collected", "failed", "locks"] {
        fs::create_dir_all(bench.path("mine").join(name)).expect("a folder");
        let before = files_below(&bench.path("mine"));
        symlink(bench.path("mine").join(name), bench.path("c").join(name)).expect("a link");
        for command in ["run", "status", "collect", "report"] {
            let said = [
                name,
                "a link",
                "link the whole campaign folder, or use --scratch",
            ];
            fails(&bench, &["campaign", command, "--dir", "c"], 4, &said);
        }
        fails(&bench, &PLAN, 4, &[name, "a link"]);
        fs::remove_file(bench.path("c").join(name)).expect("removed");
        assert!(files_below(&bench.path("mine")) == before, "{name}");
    }
}

#[test]
fn the_campaign_folder_and_the_folder_of_a_single_run_may_be_links() {
    let bench = keeping_history();
    fs::rename(bench.path("c"), bench.path("disk")).expect("moved");
    symlink(bench.path("disk"), bench.path("c")).expect("a link");
    fs::create_dir_all(bench.path("elsewhere")).expect("a folder");
    fs::create_dir_all(bench.path("c/runs")).expect("a folder");
    symlink(bench.path("elsewhere"), bench.path("c/runs/000001")).expect("a link");
    bench.done(&RUN);
    bench.done(&["campaign", "collect", "--dir", "c"]);
    // The program removes nothing through a link.
    assert!(bench.path("elsewhere/run.json").exists());
    let left = fs::read_dir(bench.path("c/runs")).expect("a folder");
    let left: Vec<_> = left
        .map(|entry| entry.expect("an entry").file_name())
        .collect();
    assert_eq!(left, ["000001"]);
}

#[test]
fn the_run_of_another_scene_in_the_place_of_a_row_is_kept() {
    let bench = keeping_history();
    bench.done(&RUN);
    bench.done(&["run", "small.toml", "--run", "other", "-q"]);
    let run = bench.path("c/runs/000002");
    for lost in [None, Some("run.json"), Some("run.copy.json")] {
        fs::rename(bench.path("other"), &run).expect("moved");
        if let Some(lost) = lost {
            fs::rename(run.join(lost), bench.path("lost")).expect("moved");
        }
        let before = files_below(&run.join("iterations"));
        bench.done(&RUN);
        assert!(files_below(&run.join("iterations")) == before, "{lost:?}");
        if let Some(lost) = lost {
            fs::rename(bench.path("lost"), run.join(lost)).expect("moved");
        }
        fs::rename(&run, bench.path("other")).expect("moved");
    }
    // Without both records, the program cannot identify the run. It removes the run, because this campaign keeps no runs in this folder.
    fs::rename(bench.path("other"), &run).expect("moved");
    for name in ["run.json", "run.copy.json"] {
        fs::remove_file(run.join(name)).expect("removed");
    }
    bench.done(&RUN);
    assert!(!run.exists());
}

/// The run of a row is killed at each call that removes something. Until the run is removed, one of its records identifies it.
#[test]
fn a_removal_that_is_killed_is_completed() {
    let bench = planned("[grid]\nsurface.seed = [4]\n");
    bench.done(&RUN);
    let key = content_key(&bench, 0);
    let whole = bench.path("c/runs/000000");
    let copied = |to: &Path| {
        let copy = std::process::Command::new("cp")
            .arg("-r")
            .args([&whole, to])
            .status();
        assert!(copy.expect("cp runs").success());
    };
    let run = bench.path("copy");
    copied(&run);
    let sound = FaultyFileSystem::sound();
    remove_run(&sound, &run, &key).expect("removed");
    assert!(!run.exists());
    let calls = sound.calls(Fault::EndBefore);
    assert!(calls > 8, "{calls}");
    for call in 1..=calls {
        copied(&run);
        let killed = FaultyFileSystem::failing(call, Fault::EndBefore);
        remove_run(&killed, &run, &key).expect_err("killed");
        let names = fs::read_dir(&run).expect("still there");
        let names: Vec<_> = names.map(|e| e.expect("an entry").file_name()).collect();
        let is_record = |name: &std::ffi::OsString| name == "run.json" || name == "run.copy.json";
        let alone = names.iter().all(|name| name == "lock");
        assert!(alone || names.iter().any(is_record), "{call}: {names:?}");
        remove_run(&RealFileSystem, &run, &key).expect("removed");
        assert!(!run.exists(), "{call}");
    }
    // The program does not remove a run while another process has its lock.
    let LockAttempt::Taken(guard) = RealFileSystem
        .try_lock(&whole.join("lock"))
        .expect("a lock")
    else {
        panic!("the run is locked");
    };
    remove_run(&RealFileSystem, &whole, &key).expect("looked at");
    assert!(whole.join("run.json").exists());
    drop(guard);
}

/// File system on which one file is unreadable.
struct Unreadable {
    name: &'static str,
    errno: i32,
}

impl FileSystem for Unreadable {
    fn create_dir_all(&self, path: &Path) -> io::Result<()> {
        RealFileSystem.create_dir_all(path)
    }
    fn write_new(&self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        RealFileSystem.write_new(path, bytes)
    }
    fn sync_file(&self, path: &Path) -> io::Result<()> {
        RealFileSystem.sync_file(path)
    }
    fn read(&self, path: &Path, most: u64) -> io::Result<Vec<u8>> {
        match path.ends_with(self.name) {
            true => Err(io::Error::from_raw_os_error(self.errno)),
            false => RealFileSystem.read(path, most),
        }
    }
    fn hash(&self, path: &Path) -> io::Result<blake3::Hash> {
        RealFileSystem.hash(path)
    }
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        RealFileSystem.rename(from, to)
    }
    fn sync_dir(&self, path: &Path) -> io::Result<()> {
        RealFileSystem.sync_dir(path)
    }
    fn remove_file(&self, path: &Path) -> io::Result<()> {
        RealFileSystem.remove_file(path)
    }
    fn remove_dir_all(&self, path: &Path) -> io::Result<()> {
        RealFileSystem.remove_dir_all(path)
    }
    fn list(&self, path: &Path) -> io::Result<Vec<Entry>> {
        RealFileSystem.list(path)
    }
    fn metadata(&self, path: &Path) -> io::Result<Option<Metadata>> {
        RealFileSystem.metadata(path)
    }
    fn free_space(&self, path: &Path) -> io::Result<u64> {
        RealFileSystem.free_space(path)
    }
    fn try_lock(&self, path: &Path) -> io::Result<LockAttempt> {
        RealFileSystem.try_lock(path)
    }
}

/// A system error gives no information about the content of a file, so the message does not advise the user to remove the file.
#[test]
fn a_read_error_is_not_damage() {
    let bench = planned(GRID);
    bench.done(&RUN);
    let again = [
        libc::EMFILE,
        libc::ENFILE,
        libc::EINTR,
        libc::ENOMEM,
        libc::ESTALE,
        libc::EIO,
    ];
    let check = |error: &CampaignError, name: &str, errno: i32| {
        let said = error.to_string();
        assert!(said.starts_with("cannot read "), "{said}");
        assert!(said.contains(name), "{said}");
        assert!(
            !said.contains("remove") && !said.contains("move away"),
            "{said}"
        );
        assert_eq!(said.contains("try again"), again.contains(&errno), "{said}");
        assert!(
            !error.is_damage_or_mismatch() && !error.is_usage(),
            "{said}"
        );
    };
    for (k, errno) in again.into_iter().chain([libc::EACCES]).enumerate() {
        let name = "000001.parquet";
        let folder = CampaignFolder::at(Arc::new(Unreadable { name, errno }), &bench.path("c"));
        let (_, campaign) = folder.open().expect("a campaign");
        let collected = folder.collect(&campaign).expect("the others are collected");
        assert_eq!(collected.runs, if k == 0 { 5 } else { 0 });
        assert!(collected.damaged.is_empty());
        check(&collected.unread[0], name, errno);

        let name = "shard-00000.parquet";
        let folder = CampaignFolder::at(Arc::new(Unreadable { name, errno }), &bench.path("c"));
        check(
            &folder.collected(&campaign).expect_err("unreadable"),
            name,
            errno,
        );
        check(
            &folder.collect(&campaign).expect_err("unreadable"),
            name,
            errno,
        );
    }
    // A readable file that is not a history counts as damaged, and so does a link.
    let path = bench.path("c/ended/000001.parquet");
    fs::rename(&path, bench.path("kept")).expect("moved");
    symlink(bench.path("kept"), &path).expect("a link");
    let collect = ["campaign", "collect", "--dir", "c"];
    fails(
        &bench,
        &collect,
        4,
        &["000001.parquet", "it is a link", "remove it"],
    );
}

/// Rewrites a table of a campaign with another column.
fn forge(bench: &Bench, name: &str, change: impl Fn(&str, Nullable) -> Nullable) {
    let bytes = fs::read(bench.path(name)).expect("a file");
    let entry = metadata_entry(&bytes, "campaign")
        .expect("an entry")
        .expect("an entry");
    let found = nullable_from_parquet(&bytes, "campaign", 1 << 20).expect("a table");
    let changed: Vec<(ColumnSchema, Nullable)> = found
        .into_iter()
        .map(|(name, values)| {
            let kind = match &values {
                Nullable::I64(_) => ColumnType::I64,
                Nullable::F64(_) => ColumnType::F64,
                Nullable::Text(_) => ColumnType::Text,
                other => panic!("{other:?}"),
            };
            let values = change(&name, values);
            (ColumnSchema::plain(&name, kind, "1"), values)
        })
        .collect();
    let described: Vec<_> = changed
        .iter()
        .map(|(column, values)| (column, values))
        .collect();
    let bytes = nullable_to_parquet("campaign", &described, entry).expect("a table");
    fs::write(bench.path(name), bytes).expect("written");
}

#[test]
fn a_table_without_rows_or_with_a_key_that_is_no_number_is_damaged() {
    let commands = ["run", "status", "collect", "report"];
    let bench = planned(GRID);
    let whole = fs::read(bench.path("c/campaign.parquet")).expect("a file");
    forge(&bench, "c/campaign.parquet", |_, mut values| {
        values.resize(0);
        values
    });
    for command in commands {
        let said = ["campaign.parquet", "it has no row"];
        fails(&bench, &["campaign", command, "--dir", "c"], 4, &said);
    }
    fs::write(bench.path("c/campaign.parquet"), whole).expect("written");
    forge(&bench, "c/campaign.parquet", |name, values| match values {
        Nullable::F64(mut values) if name == "contact.friction_coefficient" => {
            values[1] = Some(f64::NAN);
            Nullable::F64(values)
        }
        values => values,
    });
    for command in commands {
        let said = [
            "campaign.parquet",
            "contact.friction_coefficient of row 1 is NaN",
        ];
        fails(&bench, &["campaign", command, "--dir", "c"], 4, &said);
    }
}

/// A shard that lists the same range a million times would delay every command by hours.
#[test]
fn ranges_of_a_shard_ascend_and_do_not_overlap() {
    let bench = planned(GRID);
    bench.done(&RUN);
    bench.done(&["campaign", "collect", "--dir", "c"]);
    let shard = "c/collected/shard-00000.parquet";
    let whole = fs::read(bench.path(shard)).expect("a file");
    for ranges in [
        vec![[0, 5]; 1_000_000],
        vec![[3, 5], [0, 2]],
        vec![[0, 3], [3, 5]],
    ] {
        let entry = metadata_entry(&whole, "collected")
            .expect("an entry")
            .expect("an entry");
        let mut entry: Value = serde_json::from_str(&entry).expect("JSON");
        entry["runs"] = serde_json::json!(ranges);
        let column = ColumnSchema::plain("index", ColumnType::I64, "1");
        let values = Nullable::I64(vec![Some(0)]);
        let described = [(&column, &values)];
        let bytes = nullable_to_parquet("collected", &described, entry.to_string());
        fs::write(bench.path(shard), bytes.expect("a table")).expect("written");
        for command in ["status", "collect", "report"] {
            let said = ["shard-00000.parquet", "its ranges of rows overlap"];
            fails(&bench, &["campaign", command, "--dir", "c"], 4, &said);
        }
    }
}

#[test]
fn what_a_killed_start_left_in_scratch_is_removed_by_a_start_with_the_same_scratch() {
    let bench = keeping_history();
    bench.done(&["campaign", "run", "--dir", "c", "-q", "--scratch", "s"]);
    let key: String = content_key(&bench, 2).chars().take(16).collect();
    let left = bench.path("s").join(format!("000002-{key}"));
    assert!(!left.exists());
    // Run of the row as a killed start has it, and run of a row of another campaign.
    let sets = ["wear.cycles=200_000", "joint.grid=[16, 12]"];
    let correlation = "surface.correlation_length=[\"0.8 mm\", \"0.7 mm\"]";
    let mut begun: Vec<&str> = vec!["run", "small.toml", "-q", "--run", "left"];
    let own = ["contact.friction_coefficient=0.5", "surface.seed=3"];
    for set in sets.iter().chain(&[correlation]).chain(&own) {
        begun.extend(["--set", set]);
    }
    bench.done(&begun);
    fs::rename(bench.path("left"), &left).expect("moved");
    let other = bench.path("s/000002-0123456789abcdef");
    bench.done(&[
        "run",
        "small.toml",
        "-q",
        "--run",
        "s/000002-0123456789abcdef",
    ]);
    fs::create_dir_all(bench.path("c/failed")).expect("a folder");
    bench.write("c/failed/000002.json.new", "{");
    bench.done(&RUN);
    assert!(left.exists(), "the start did not name the scratch folder");
    assert!(!bench.path("c/failed/000002.json.new").exists());
    for jobs in [&[][..], &["--jobs", "2"]] {
        let mut with: Vec<&str> = [&RUN[..], &["--scratch", "s"]].concat();
        with.extend(jobs);
        let LockAttempt::Taken(guard) = RealFileSystem.try_lock(&left.join("lock")).expect("ours")
        else {
            panic!("the run is locked");
        };
        bench.done(&with);
        assert!(left.exists(), "the start removed a locked run");
        drop(guard);
    }
    bench.done(&[&RUN[..], &["--scratch", "s"]].concat());
    assert!(!left.exists());
    assert!(
        other.exists(),
        "the start removed the run of another campaign"
    );
}

/// Two starts of the same rows without effective locks: a completed row has the history of one of the starts.
#[cfg(target_os = "linux")]
#[test]
fn without_locks_a_row_is_done_only_with_a_whole_history() {
    use std::process::Command;
    const ROUNDS: usize = 4;
    let bench = keeping_history();
    bench.write("none.c", "int flock(int fd, int op) { return 0; }\n");
    let library = bench.path("none.so");
    let made = Command::new("cc")
        .args(["-shared", "-fPIC", "-o"])
        .args([&library, &bench.path("none.c")])
        .status();
    assert!(made.expect("cc runs").success());
    let columns = |folder: &str| -> Vec<_> {
        let history = |row: usize| {
            let found = super::rows::columns(&bench, &format!("{folder}/ended/{row:06}.parquet"));
            // The sizes of the files depend on the times.
            let found = found
                .into_iter()
                .filter(|(name, _)| !name.starts_with("timing") && name != "bytes");
            found.collect::<Vec<_>>()
        };
        (0..6).map(history).collect()
    };
    bench.done(&RUN);
    let expected = columns("c");
    for round in 0..ROUNDS {
        let folder = format!("d{round}");
        bench.done(&[
            "campaign",
            "plan",
            "case.toml",
            "--dir",
            &folder,
            "--no-rehearsal",
        ]);
        let run = ["campaign", "run", "--dir", &folder, "-q"];
        let start = || {
            let mut command = bench.command(&run);
            command.env("LD_PRELOAD", &library).spawn().expect("starts")
        };
        let both = [start(), start()].map(|child| child.wait_with_output().expect("ends"));
        for did in both {
            let said = String::from_utf8_lossy(&did.stderr);
            assert!(!said.contains("panicked"), "{said}");
        }
        // The next start completes the remaining rows and retries a failure of the disk.
        bench.done(&run);
        assert_eq!(columns(&folder), expected, "round {round}");
    }
}
