//! Tests of the protection of the rows of a campaign from each other, from other campaigns, and from a second process.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use fretwear::campaign::{CampaignFolder, State};
use fretwear::store::{LAYOUT, LockAttempt, RealFileSystem, remove_run};

use super::rows::{fails, status};
use super::{GRID, PLAN, bench, planned};
use crate::support::{Bench, every_file};

fn history_alone(campaign: &str) -> Bench {
    let bench = bench(campaign);
    let text = fs::read_to_string(bench.path("case.toml")).expect("a file");
    bench.write("case.toml", format!("keep = \"history\"\n{text}"));
    bench.done(&PLAN);
    bench
}

/// Several processes start all rows at once: the program computes each row once, also while another process removes its folder.
#[test]
fn a_row_is_computed_by_one_alone() {
    const ROWS: usize = 40;
    const STARTS: usize = 6;
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("c");
    let computed: Vec<AtomicUsize> = (0..ROWS).map(|_| AtomicUsize::new(0)).collect();
    let start = || {
        let folder = CampaignFolder::at(Arc::new(RealFileSystem), &root);
        for index in 0..ROWS {
            let LockAttempt::Taken(claim) = folder.lock_row(index).expect("looked at") else {
                continue;
            };
            if folder.state(index).expect("looked at") != State::Complete {
                computed[index].fetch_add(1, Ordering::Relaxed);
                let run = folder.run(index);
                fs::create_dir_all(&run).expect("a folder");
                let part = run.join("part");
                fs::write(&part, b"half").expect("nobody else writes there");
                assert_eq!(fs::read(&part).expect("it is there"), b"half");
                folder.complete(index, b"whole").expect("ended");
                remove_run(&RealFileSystem, &run, "").expect("removed");
            }
            folder.unlock_row(index, claim).expect("released");
        }
    };
    thread::scope(|scope| {
        let starts: Vec<_> = (0..STARTS).map(|_| scope.spawn(start)).collect();
        starts
            .into_iter()
            .for_each(|start| start.join().expect("no panic"));
    });
    for (index, computed) in computed.iter().enumerate() {
        assert_eq!(computed.load(Ordering::Relaxed), 1, "row {index}");
    }
    for rest in ["locks", "runs"] {
        let entries = fs::read_dir(root.join(rest)).expect("a folder");
        assert_eq!(entries.count(), 0, "{rest}");
    }
}

/// Several commands run the same rows repeatedly: every history is complete and equals the history of a single command.
#[test]
fn two_commands_at_the_same_rows_end_in_the_same() {
    let run = ["campaign", "run", "--dir", "c", "-q"];
    let rows = |bench: &Bench| -> Vec<_> {
        let history = |row: usize| {
            let columns = super::rows::columns(bench, &format!("c/ended/{row:06}.parquet"));
            columns
                .into_iter()
                .filter(|(name, _)| !name.starts_with("timing"))
                .collect::<Vec<_>>()
        };
        (0..6).map(history).collect()
    };
    let alone = history_alone(GRID);
    alone.done(&run);
    let both = history_alone(GRID);
    let children = [0; 3].map(|_| both.command(&run).spawn().expect("a process"));
    for mut child in children {
        let code = child.wait().expect("an end").code();
        assert!(matches!(code, Some(0 | 75)), "{code:?}");
    }
    both.done(&run);
    assert_eq!(rows(&both), rows(&alone));
}

#[test]
fn another_way_to_keep_runs_is_another_campaign() {
    let bench = planned(GRID);
    bench.done(&["campaign", "run", "--dir", "c", "--index", "0-1", "-q"]);
    let text = fs::read_to_string(bench.path("case.toml")).expect("a file");
    bench.write("case.toml", format!("keep = \"history\"\n{text}"));
    fails(
        &bench,
        &PLAN,
        4,
        &["keep = \"runs\"", "keep = \"history\"", "another --dir"],
    );
    bench.done(&["campaign", "run", "--dir", "c", "-q"]);
    assert!(bench.path("c/runs/000000/run.json").is_file());
}

/// Results belong to the planned rows only.
#[test]
fn results_are_those_of_the_plan() {
    let bench = planned(GRID);
    bench.done(&["campaign", "run", "--dir", "c", "-q"]);
    let text = fs::read_to_string(bench.path("case.toml")).expect("a file");
    let table = bench.path("c/campaign.parquet");
    let planned_table = fs::read(&table).expect("a table");
    // Without its table, the folder still identifies the planned campaign.
    fs::remove_file(&table).expect("removed");
    bench.write("case.toml", text.replace("[0.5, 0.7]", "[0.5, 0.8]"));
    fails(&bench, &PLAN, 4, &["another campaign", "another --dir"]);
    bench.write("case.toml", &text);
    bench.done(&PLAN);
    assert_eq!(fs::read(&table).expect("a table"), planned_table);

    // The program neither reads a campaign of another layout nor plans over it.
    let about = bench.path("c/campaign.json");
    let whole = fs::read(&about).expect("a file");
    for other in [LAYOUT - 1, LAYOUT + 1] {
        let text = format!("{{\"format\": {other}, \"program_version\": \"9.9.9\", \"else\": 1}}");
        fs::write(&about, text).expect("written");
        let before = every_file(&bench.path("c"));
        let said = format!(
            "the campaign c has layout {other} of fretwear 9.9.9; this program reads only layout {LAYOUT}: use the program that planned it, or plan the campaign in another folder"
        );
        let said = [said.as_str()];
        for command in ["run", "status", "collect"] {
            fails(&bench, &["campaign", command, "--dir", "c"], 4, &said);
        }
        fails(&bench, &PLAN, 4, &said);
        assert_eq!(every_file(&bench.path("c")), before);
    }
    fs::write(&about, &whole).expect("put back");

    // If `campaign.json` is damaged, the table and the setting of `keep` still protect the results.
    fs::write(&about, &whole[..100]).expect("cut short");
    let told = ["campaign", "status", "--dir", "c"];
    fails(
        &bench,
        &told,
        4,
        &["campaign.json", "plan the campaign again"],
    );
    bench.write("case.toml", format!("keep = \"history\"\n{text}"));
    fails(&bench, &PLAN, 4, &["another --dir"]);
    bench.write("case.toml", &text);
    bench.done(&PLAN);
    assert_eq!(fs::read(&about).expect("a file"), whole);

    // Numbers of points of a section that differ from the number of rows: zero, too many, and more than fits into memory.
    let told = String::from_utf8(whole.clone()).expect("text");
    assert!(told.contains("\"points\": 2"), "{told}");
    for points in ["0", "3", "9000000000000000000"] {
        let other = format!("\"points\": {points}");
        bench.write("c/campaign.json", told.replace("\"points\": 2", &other));
        let report = ["campaign", "collect", "--dir", "c"];
        fails(&bench, &report, 4, &["differ from the rows planned"]);
    }
    bench.write("c/campaign.json", &whole);

    // The table belongs to another campaign.
    let other = planned(&GRID.replace("[0.5, 0.7]", "[0.5, 0.8]"));
    fs::copy(other.path("c/campaign.parquet"), &table).expect("copied");
    for command in [
        &["campaign", "status", "--dir", "c"][..],
        &["campaign", "run", "--dir", "c", "-q"],
        &["campaign", "collect", "--dir", "c"],
    ] {
        fails(
            &bench,
            command,
            4,
            &["campaign.parquet", "differ from the rows planned"],
        );
    }
    fs::write(&table, planned_table).expect("put back");

    // Two histories are exchanged, one is a link, and one is empty: the program collects the others.
    let ended = |row: usize| bench.path(&format!("c/ended/{row:06}.parquet"));
    let sound: Vec<Vec<u8>> = (0..6)
        .map(|row| fs::read(ended(row)).expect("a history"))
        .collect();
    fs::write(ended(0), &sound[1]).expect("written");
    fs::write(ended(1), &sound[0]).expect("written");
    fs::remove_file(ended(2)).expect("removed");
    std::os::unix::fs::symlink(ended(3), ended(2)).expect("a link");
    fs::write(ended(4), b"").expect("written");
    let collect = ["campaign", "collect", "--dir", "c"];
    fails(
        &bench,
        &collect,
        4,
        &[
            "000000.parquet: it is the history of another row",
            "000002.parquet",
            "000004.parquet",
        ],
    );
    assert_eq!(status(&bench)["collected"], 2);
    fs::remove_file(ended(2)).expect("removed");
    for row in [0, 1, 2, 4] {
        fs::write(ended(row), &sound[row]).expect("written");
    }
    bench.done(&collect);
    assert_eq!(status(&bench)["collected"], 6);

    // The shard belongs to another campaign.
    other.done(&["campaign", "run", "--dir", "c", "-q"]);
    other.done(&collect);
    let foreign = fs::read(other.path("c/collected/shard-00000.parquet")).expect("a shard");
    bench.write("c/collected/shard-00009.parquet", "");
    fs::write(bench.path("c/collected/shard-00009.parquet"), foreign).expect("written");
    fails(
        &bench,
        &collect,
        4,
        &["shard-00009.parquet", "another campaign"],
    );
}

/// A row that failed because of its settings fails again without computation, with the same exit code.
#[test]
fn a_repeated_failure_has_the_code_of_the_first() {
    let bench = planned("[grid]\nfidelity.normal_tolerance = [1e-17, 1e-5]\n");
    let run = ["campaign", "run", "--dir", "c", "--index", "0", "-q"];
    fails(&bench, &run, 3, &[]);
    fails(&bench, &run, 3, &["failed before", "--retry"]);
}

/// Leftovers of a process that was killed just after the end of its row, and a path that is not a lock: the other rows continue.
#[test]
fn what_was_left_behind_is_cleared() {
    let bench = history_alone(GRID);
    bench.done(&["campaign", "run", "--dir", "c", "--index", "0", "-q"]);
    for folder in ["runs/000000/once", "locks"] {
        fs::create_dir_all(bench.path("c").join(folder)).expect("a folder");
    }
    bench.write("c/locks/000000", "17");
    bench.write("c/ended/000000.parquet.new", "half");
    bench.write("c/locks/000001", "no number");
    fails(&bench, &["campaign", "run", "--dir", "c", "-q"], 1, &[]);
    let found = status(&bench);
    assert_eq!(
        (&found["done"], &found["failed"][0]["index"]),
        (&5.into(), &1.into())
    );
    fs::remove_file(bench.path("c/locks/000001")).expect("removed");
    bench.done(&["campaign", "run", "--dir", "c", "--jobs", "2", "-q"]);
    for (folder, left) in [("runs", 0), ("locks", 0), ("ended", 6)] {
        let entries = fs::read_dir(bench.path("c").join(folder)).expect("a folder");
        assert_eq!(entries.count(), left, "{folder}");
    }
}

/// Script of a job array: a missing campaign or program is an error, and a task beyond the last row is a success.
#[test]
fn a_task_that_did_nothing_says_so() {
    let bench = planned(GRID);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/slurm/array.sbatch");
    let task = |program: &str, dir: &str, task: &str| {
        let mut command = Command::new("bash");
        command
            .arg(&script)
            .args([dir, "4"])
            .current_dir(bench.path(""));
        command
            .env("SLURM_ARRAY_TASK_ID", task)
            .env("FRETWEAR", program);
        command.output().expect("bash").status.code()
    };
    let program = env!("CARGO_BIN_EXE_fretwear");
    assert_eq!(task(program, "nowhere", "0"), Some(2));
    assert_eq!(task("no-such-program", "c", "0"), Some(127));
    assert_eq!(task(program, "c", "2"), Some(0));
    assert_eq!(status(&bench)["done"], 0);
    assert_eq!(task(program, "c", "1"), Some(0));
    assert_eq!(status(&bench)["done"], 2);
}
