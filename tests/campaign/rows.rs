//! Tests of rows: planned, run, stopped, killed, failed, and run again.

use std::fs;
use std::path::Path;
use std::process::Child;
use std::thread::sleep;
use std::time::{Duration, Instant};

use fretwear::campaign::{CampaignError, CampaignFolder, State};
use fretwear::store::{FileSystem, LockAttempt, RealFileSystem};
use fretwear::tables::{Nullable, nullable_from_parquet};
use serde_json::Value;
use std::sync::Arc;

use super::{GRID, PLAN, bench, planned};
use crate::support::faulty::{Fault, FaultyFileSystem};
use crate::support::{Bench, assert_same, content};

/// Columns of a Parquet file by name.
pub fn columns(bench: &Bench, path: &str) -> std::collections::BTreeMap<String, Nullable> {
    let bytes = fs::read(bench.path(path)).expect("a file");
    let found = nullable_from_parquet(&bytes, "test", 1 << 20).expect("a table");
    found.into_iter().collect()
}

pub fn fails(bench: &Bench, arguments: &[&str], code: i32, parts: &[&str]) {
    let did = bench.fretwear(arguments);
    let said = did.stderr();
    assert_eq!(did.code(), code, "{arguments:?}: {said}");
    for part in parts {
        assert!(said.contains(part), "{arguments:?}: no {part:?} in {said}");
    }
    assert!(!said.contains("panicked"), "{said}");
}

pub fn status(bench: &Bench) -> Value {
    bench
        .done(&["campaign", "status", "--dir", "c", "--json"])
        .json()
}

#[test]
fn a_plan_has_the_keys_as_resolved_and_the_content_of_every_run() {
    let campaign = "[grid]\nsurface.rq = [\"1 um\", \"1500 nm\"]\nfidelity.preset = [\"balanced\", \"fast\"]\nsurface.seed = [5]\n";
    let bench = planned(campaign);
    let found = columns(&bench, "c/campaign.parquet");
    assert_eq!(found["index"], Nullable::I64((0..4).map(Some).collect()));
    let rq: Vec<f64> = match &found["surface.rq"] {
        Nullable::F64(values) => values.iter().map(|v| v.expect("a number")).collect(),
        other => panic!("{other:?}"),
    };
    for (found, expected) in rq.iter().zip([1e-6, 1.5e-6, 1e-6, 1.5e-6]) {
        assert!((found / expected - 1.0).abs() < 1e-12, "{found}");
    }
    assert_eq!(found["surface.seed"], Nullable::I64(vec![Some(5); 4]));
    let words = ["balanced", "balanced", "fast", "fast"].map(|word| Some(word.to_owned()));
    assert_eq!(found["fidelity.preset"], Nullable::Text(words.to_vec()));
    // Rows with different words may have different costs; rows with different roughness have similar costs.
    assert_eq!(
        found["group"],
        Nullable::I64([0, 0, 1, 1].map(Some).to_vec())
    );

    // The content key is the key of the run.
    bench.done(&["campaign", "run", "--dir", "c", "--index", "2", "-q"]);
    let record = fs::read_to_string(bench.path("c/runs/000002/run.json")).expect("a record");
    let record: Value = serde_json::from_str(&record).expect("JSON");
    let Nullable::Text(keys) = &found["content_key"] else {
        panic!("no texts");
    };
    assert_eq!(keys[2], Some(fretwear::json::hash(&record["scene"])));
    assert_eq!(
        keys.iter().collect::<std::collections::BTreeSet<_>>().len(),
        4
    );
}

#[test]
fn a_rehearsal_is_made_once_a_group_of_like_rows() {
    let bench = bench(GRID);
    let found = bench
        .done(&["campaign", "plan", "case.toml", "--dir", "c", "--json"])
        .json();
    assert_eq!(
        (&found["rows"], &found["rows_before"]),
        (&6.into(), &0.into())
    );
    let groups = found["groups"].as_array().expect("groups");
    assert_eq!(groups.len(), 1);
    assert!(groups[0]["expected_seconds"].as_f64().expect("seconds") > 0.0);
    assert!(groups[0]["memory"].as_f64().expect("bytes") > 1e6);
    let seconds = &columns(&bench, "c/campaign.parquet")["expected_seconds"];
    let Nullable::F64(seconds) = seconds else {
        panic!("no numbers");
    };
    assert!(seconds.iter().all(|s| *s == seconds[0] && s.is_some()));
}

#[test]
fn a_row_ends_in_the_bits_of_the_same_scene_run_alone_and_takes_no_time_again() {
    let bench = planned(GRID);
    bench.done(&["campaign", "run", "--dir", "c", "--index", "4", "-q"]);
    bench.done(&[
        "run",
        "small.toml",
        "-q",
        "--run",
        "alone",
        "--set",
        "wear.cycles=200_000",
        "--set",
        "joint.grid=[16, 12]",
        "--set",
        "surface.correlation_length=[\"0.8 mm\", \"0.7 mm\"]",
        "--set",
        "contact.friction_coefficient=0.7",
        "--set",
        "surface.seed=2",
    ]);
    let alone = content(&bench.path("alone"));
    assert_same(&content(&bench.path("c/runs/000004")), &alone, "row 4");
    let log = bench.path("c/runs/000004/log.txt");
    let before = fs::read(&log).expect("a log");
    bench.done(&["campaign", "run", "--dir", "c", "--index", "4", "-q"]);
    assert_eq!(
        fs::read(&log).expect("a log"),
        before,
        "the row started again"
    );
    let found = status(&bench);
    assert_eq!((&found["done"], &found["waiting"]), (&1.into(), &5.into()));

    // A range of rows, and then all rows by two processes; a changed campaign file has no effect on planned rows.
    bench.write("case.toml", "scene = \"gone.toml\"\n");
    bench.write("small.toml", "");
    let range = ["campaign", "run", "--dir", "c", "--index", "3-5", "--json"];
    let found = bench.done(&range).json();
    assert_eq!(
        (&found["done"], &found["done_before"]),
        (&2.into(), &1.into())
    );
    let all = ["campaign", "run", "--dir", "c", "--jobs", "2", "--json"];
    let found = bench.done(&all).json();
    assert_eq!(
        (&found["done"], &found["done_before"]),
        (&3.into(), &3.into())
    );
    assert_eq!(status(&bench)["done"], 6);
}

#[test]
fn one_row_that_fails_stops_no_other_and_its_reason_is_kept() {
    let campaign = "[grid]\nfidelity.normal_tolerance = [1e-6, 1e-17, 1e-5]\n";
    for jobs in [&[][..], &["--jobs", "2"]] {
        let bench = planned(campaign);
        let run = [&["campaign", "run", "--dir", "c", "-q"], jobs].concat();
        fails(&bench, &run, 1, &["row 1 failed", "did not converge"]);
        let found = status(&bench);
        assert_eq!(found["done"], 2);
        let failed = &found["failed"][0];
        assert_eq!(
            (&failed["index"], &failed["tried_again"]),
            (&1.into(), &false.into())
        );
        let reason = failed["reason"].as_str().expect("a reason");
        assert!(reason.contains("1.0e-17"), "{reason}");
        assert_eq!(failed["settings"][0], "fidelity.normal_tolerance=1e-17");
        let words = bench.done(&["campaign", "status", "--dir", "c"]).stdout();
        assert!(words.contains(&format!("row 1: {reason}\n")), "{words}");
        // The program has stored the failure of the row, and runs the row again only on request.
        let one = ["campaign", "run", "--dir", "c", "--index", "1", "-q"];
        fails(&bench, &one, 3, &["failed before", "--retry"]);
        fails(
            &bench,
            &[&one[..], &["--retry"]].concat(),
            3,
            &["did not converge"],
        );
        fails(&bench, &run, 1, &[]);
    }
}

/// Waits until a condition is true.
fn awaited(child: &mut Child, what: &dyn Fn() -> bool) {
    const LONGEST: Duration = Duration::from_secs(60);
    let begin = Instant::now();
    while !what() {
        assert!(begin.elapsed() < LONGEST, "the condition is still false");
        if let Some(status) = child.try_wait().expect("a process") {
            panic!("it ended before, with {status}");
        }
        sleep(Duration::from_millis(2));
    }
}

/// Campaign with runs of one or two seconds and many iterations.
const LONG: &str = "[grid]\njoint.size = [[\"4 mm\", \"3 mm\"]]\nsurface.seed = [3, 4]\n";

fn long() -> Bench {
    let bench = Bench::new();
    let campaign = format!(
        "scene = \"small.toml\"\n[set]\njoint.grid = [60, 50]\nwear.tolerance = 1e-4\n{LONG}"
    );
    bench.write("case.toml", campaign);
    bench.done(&PLAN);
    bench
}

#[cfg(unix)]
#[test]
fn a_row_that_is_killed_or_stopped_goes_on_to_the_same_bits() {
    let bench = long();
    bench.done(&["campaign", "run", "--dir", "c", "--index", "0", "-q"]);
    let whole = content(&bench.path("c/runs/000000"));
    fs::rename(bench.path("c"), bench.path("whole")).expect("moved");
    bench.done(&PLAN);
    let root = bench.path("c/runs/000000");
    let run = ["campaign", "run", "--dir", "c", "--index", "0", "-q"];

    let second = root.join("iterations/wear_iteration=1");
    let mut child = bench.command(&run).spawn().expect("started");
    awaited(&mut child, &|| second.exists());
    // A second command for the same row ends with the exit code for "try again".
    assert_eq!(status(&bench)["running"][0], 0);
    let other = bench.fretwear(&["campaign", "run", "--dir", "c", "--index", "0", "--json"]);
    assert_eq!(
        (other.code(), &other.json()["in_use"][0]),
        (75, &Value::from(0))
    );
    child.kill().expect("killed");
    child.wait().expect("ended");
    assert_eq!(status(&bench)["stopped"][0], 0);

    let stopped =
        bench.fretwear(&[&run[..], &["--max-wall", "1 ms", "--resumable-exit", "9"]].concat());
    assert_eq!(stopped.code(), 9, "{}", stopped.stderr());
    bench.done(&run);
    assert_same(&content(&root), &whole, "killed and stopped");
}

#[cfg(unix)]
#[test]
fn a_signal_to_many_processes_stops_them_all_and_the_same_command_goes_on() {
    let bench = long();
    let run = ["campaign", "run", "--dir", "c", "--jobs", "2", "-q"];
    let mut child = bench.command(&run).spawn().expect("started");
    let begun = |k: u64| bench.path(&format!("c/runs/00000{k}/once")).exists();
    awaited(&mut child, &|| begun(0) && begun(1));
    let id = child.id().to_string();
    let signal = std::process::Command::new("kill")
        .args(["-TERM", &id])
        .status();
    assert!(signal.expect("kill").success());
    assert_eq!(child.wait().expect("ended").code(), Some(75));
    let found = status(&bench);
    assert_eq!(
        (&found["done"], found["running"].as_array().map(Vec::len)),
        (&0.into(), Some(0))
    );
    bench.done(&run);
    assert_eq!(status(&bench)["done"], 2);
}

/// Changes the record of a run as if another processor had started the run.
fn moved_from_another_processor(run: &Path) {
    for file in ["run.json", "run.copy.json"] {
        let path = run.join(file);
        let text = fs::read_to_string(&path).expect("a record");
        let (text, _) = text.rsplit_once(",\n  \"seal\": ").expect("a seal");
        let here = format!("\"architecture\": \"{}\"", std::env::consts::ARCH);
        assert!(text.contains(&here), "{text}");
        let text = text.replace(&here, "\"architecture\": \"m68k\"");
        let seal = blake3::hash(format!("{text}\n}}\n").as_bytes()).to_hex();
        fs::write(&path, format!("{text},\n  \"seal\": \"{seal}\"\n}}\n")).expect("written");
    }
}

/// A run that continues on another processor may have different bits: rows report this as runs do.
#[test]
fn rows_show_the_notices_of_their_starts() {
    let bench = planned(GRID);
    let rows = ["campaign", "run", "--dir", "c"];
    let begun = |index: usize| {
        let index_of = index.to_string();
        let one = ["--index", &index_of, "-q", "--max-wall", "1 us"];
        assert_eq!(bench.fretwear(&[&rows[..], &one].concat()).code(), 75);
        moved_from_another_processor(&bench.path(&format!("c/runs/00000{index}")));
    };
    let changed = "note: the processor changed from m68k (";
    begun(0);
    let said = bench.done(&[&rows[..], &["--index", "0-1"]].concat());
    let said = said.stderr();
    assert!(said.contains(&format!("row 0: {changed}")), "{said}");
    assert!(!said.contains("row 1: note: "), "{said}");
    let log = fs::read_to_string(bench.path("c/runs/000000/log.txt")).expect("a log");
    assert!(log.contains(changed), "{log}");
    begun(2);
    let said = bench.done(&[&rows[..], &["--index", "2-3", "-q"]].concat());
    assert_eq!(said.stderr(), "");
    begun(4);
    begun(5);
    let said = bench.done(&[&rows[..], &["--jobs", "2"]].concat()).stderr();
    for row in [4, 5] {
        let notice = format!("row {row}: {changed}");
        assert_eq!(said.matches(&notice).count(), 1, "{said}");
    }
}

#[test]
fn of_runs_whose_history_is_kept_there_is_one_file_each() {
    let bench = bench(GRID);
    let text = fs::read_to_string(bench.path("case.toml")).expect("a file");
    bench.write("case.toml", format!("keep = \"history\"\n{text}"));
    bench.done(&PLAN);
    bench.done(&["campaign", "run", "--dir", "c", "-q"]);
    let names = |folder: &str| {
        let entries = fs::read_dir(bench.path(folder)).expect("a folder");
        let names = entries.map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .into_string()
                .expect("text")
        });
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    };
    assert_eq!(names("c/runs"), Vec::<String>::new());
    let expected: Vec<String> = (0..6).map(|k| format!("00000{k}.parquet")).collect();
    assert_eq!(names("c/ended"), expected);
    assert_eq!(status(&bench)["done"], 6);
    // A row with a scratch folder has the same history, and the program removes its files there.
    let history = || {
        fretwear::store::History::of_bytes(
            &fs::read(bench.path("c/ended/000002.parquet")).expect("a file"),
        )
        .expect("a history")
    };
    let before = history();
    fs::remove_file(bench.path("c/ended/000002.parquet")).expect("removed");
    bench.done(&[
        "campaign",
        "run",
        "--dir",
        "c",
        "--index",
        "2",
        "-q",
        "--scratch",
        "scratch",
    ]);
    let summary = |history: &fretwear::store::History| {
        let columns = history.columns_of(fretwear::tables::TableName::Summary);
        columns
            .map(|(column, values)| (column.name.clone(), values.clone()))
            .collect::<Vec<_>>()
    };
    assert_eq!(summary(&history()), summary(&before));
    assert_eq!(
        (names("c/runs"), names("scratch")),
        (Vec::new(), Vec::new())
    );
    // An earlier start may have been killed before it removed the run.
    fs::create_dir_all(bench.path("c/runs/000003/once")).expect("a folder");
    bench.done(&["campaign", "run", "--dir", "c", "--index", "3", "-q"]);
    assert_eq!(names("c/runs"), Vec::<String>::new());
}

#[test]
fn what_is_planned_again_may_only_become_longer() {
    let draws = "[random]\nn = 3\nseed = 1\ncontact.friction_coefficient = { distribution = \"uniform\", low = 0.5, high = 0.7 }\n";
    let bench = planned(draws);
    let plan = [&PLAN[..], &["--json"]].concat();
    let again = bench.done(&plan).json();
    assert_eq!(
        (&again["rows"], &again["rows_before"]),
        (&3.into(), &3.into())
    );
    let text = fs::read_to_string(bench.path("case.toml")).expect("a file");
    bench.done(&["campaign", "run", "--dir", "c", "--index", "1", "-q"]);
    bench.write("case.toml", text.replace("n = 3", "n = 5"));
    assert_eq!(bench.done(&plan).json()["rows"], 5);
    assert_eq!(status(&bench)["done"], 1);
    for (changed, parts) in [
        (
            text.clone(),
            [
                "row 3 was planned as contact.friction_coefficient=",
                "missing",
            ],
        ),
        (
            text.replace("seed = 1", "seed = 2"),
            [
                "row 0 was planned as contact.friction_coefficient=",
                "another --dir",
            ],
        ),
        (
            text.replace("200_000", "300_000"),
            ["row 0 was", "with content"],
        ),
    ] {
        bench.write("case.toml", changed);
        fails(&bench, &plan, 4, &parts);
    }
    // The plan has not changed.
    assert_eq!(status(&bench)["rows"], 5);
}

#[test]
fn faults_of_rows_folders_and_indices() {
    // A mistyped key: the error suggests the correct key.
    let typo = bench("[grid]\nsurface.seeed = [1, 2]\n");
    let parts = ["row 0 (surface.seeed=1)", "1 other rows", "surface.seed"];
    fails(&typo, &PLAN, 2, &parts);
    assert!(!typo.path("c").exists(), "a folder for nothing");
    // A draw outside the valid range, after a valid row.
    let negative = "[list]\ncontact.friction_coefficient = [0.3, -0.1]\n";
    let parts = [
        "row 1 (contact.friction_coefficient=-0.1)",
        "contact.friction_coefficient",
    ];
    fails(&bench(negative), &PLAN, 2, &parts);
    // The program runs two rows of the same content, and reports the repetition.
    let twice = bench("[list]\nsurface.rq = [\"1 um\", \"1000 nm\", \"2 um\"]\n");
    let did = twice.done(&PLAN);
    assert!(
        did.stderr().contains("row 1 repeats row 0"),
        "{}",
        did.stderr()
    );

    let bench = planned(GRID);
    for (index, code, parts) in [
        ("6", 2, ["--index 6", "rows 0 to 5"]),
        ("4-9", 2, ["--index 4-9", "rows 0 to 5"]),
        ("5-4", 2, ["5-4", "ends before it begins"]),
        ("-1", 2, ["-1", ""]),
        ("x", 2, ["\"x\" is neither an index", "17 or 0-99"]),
    ] {
        let index = format!("--index={index}");
        fails(
            &bench,
            &["campaign", "run", "--dir", "c", &index],
            code,
            &parts,
        );
    }
    let scratch = ["campaign", "run", "--dir", "c", "--scratch", "s"];
    fails(&bench, &scratch, 2, &["--scratch", "keep = \"history\""]);
    bench.write("letter.txt", "hello");
    let other = PLAN.map(|word| if word == "c" { "." } else { word });
    fails(&bench, &other, 4, &["is not a campaign", "another --dir"]);
    for command in ["run", "status", "collect"] {
        let arguments = ["campaign", command, "--dir", "none"];
        fails(&bench, &arguments, 2, &["there is no campaign in none"]);
        let arguments = ["campaign", command, "--dir", "."];
        fails(&bench, &arguments, 4, &[". is not a campaign"]);
    }
    fs::write(bench.path("c/campaign.parquet"), "half").expect("written");
    fails(
        &bench,
        &["campaign", "status", "--dir", "c"],
        4,
        &["campaign.parquet", "plan the campaign again"],
    );
}

#[test]
fn a_file_of_the_scene_that_changes_after_the_plan_is_no_longer_the_row() {
    let history = |amplitude: f64| {
        let row = |k: u32| {
            let t = f64::from(k) / 12.0;
            let displacement = amplitude * (std::f64::consts::TAU * t).cos();
            format!("{t}, {displacement}, 0, 200\n")
        };
        let rows: String = (0..=12).map(row).collect();
        format!("time, displacement_x, displacement_y, normal_load\n{rows}")
    };
    let bench = Bench::new();
    bench.write("moves.csv", history(1e-6));
    let scene = fs::read_to_string(bench.path("small.toml")).expect("a scene");
    bench.write(
        "small.toml",
        scene.replace("amplitude = \"1 um\"", "history = \"moves.csv\""),
    );
    bench.write("case.toml", format!("scene = \"small.toml\"\n{GRID}"));
    let plan = bench.fretwear(&PLAN);
    assert_eq!(plan.code(), 0, "{}", plan.stderr());
    bench.write("moves.csv", history(2e-6));
    let run = ["campaign", "run", "--dir", "c", "--index", "0", "-q"];
    fails(
        &bench,
        &run,
        4,
        &["row 0 differs from its plan", "restore the file"],
    );
    // The row also fails without the file; with the original file, it runs again without `--retry`.
    fs::remove_file(bench.path("moves.csv")).expect("removed");
    fails(&bench, &run, 2, &["moves.csv"]);
    bench.write("moves.csv", history(1e-6));
    bench.done(&run);
}

/// The disk is full when a row ends: the history is complete or absent, and the row counts as done only if the history is complete.
#[test]
fn what_ends_is_there_whole_or_not_at_all() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("c");
    let history = b"the bytes of a history";
    let end = |files: Arc<FaultyFileSystem>| CampaignFolder::at(files, &root).complete(7, history);
    let sound = Arc::new(FaultyFileSystem::sound());
    end(sound.clone()).expect("ended");
    let calls = sound.calls(Fault::Error);
    assert!(calls >= 5, "{calls} calls");
    for call in 1..=calls {
        fs::remove_dir_all(&root).expect("removed");
        let failed = end(Arc::new(FaultyFileSystem::failing(call, Fault::Error)));
        let real = CampaignFolder::at(Arc::new(RealFileSystem), &root);
        let path = root.join("ended/000007.parquet");
        match real.state(7).expect("looked at") {
            State::Complete => assert_eq!(fs::read(&path).expect("a file"), history),
            state => {
                assert_eq!(state, State::Waiting);
                let error = failed.expect_err("a fault");
                assert!(matches!(error, CampaignError::Io { .. }), "{error}");
            }
        }
        // The next start completes the row.
        real.complete(7, history).expect("ended");
        assert_eq!(real.state(7).expect("looked at"), State::Complete);
    }
}

/// Only one process plans or collects at a time.
#[test]
fn a_folder_that_is_planned_is_not_collected() {
    let bench = planned(GRID);
    let lock = RealFileSystem
        .try_lock(&bench.path("c/lock"))
        .expect("a lock");
    let LockAttempt::Taken(guard) = lock else {
        panic!("the folder is locked");
    };
    fails(
        &bench,
        &["campaign", "collect", "--dir", "c"],
        1,
        &["being planned or collected"],
    );
    drop(guard);
    bench.done(&["campaign", "collect", "--dir", "c"]);
}

/// The program divides Archard's coefficient by the friction coefficient of each row.
#[test]
fn rows_by_archards_law_have_their_own_friction() {
    let bench = planned(
        "wear.law = \"archard\"\nwear.coefficient = \"3e-15 1/Pa\"\n[grid]\ncontact.friction_coefficient = [0.5, 0.75]\n",
    );
    bench.done(&["campaign", "run", "--dir", "c", "-q"]);
    for (row, expected) in [("000000", 6e-15), ("000001", 4e-15)] {
        let record = fs::read_to_string(bench.path(&format!("c/runs/{row}/run.json")));
        let record: Value = serde_json::from_str(&record.expect("a record")).expect("JSON");
        let found = record["scene"]["wear"]["coefficient"]
            .as_f64()
            .expect("a number");
        assert!((found / expected - 1.0).abs() < 1e-15, "{row}: {found}");
        assert!(record["scene"]["wear"].get("law").is_none(), "{record}");
    }
}
