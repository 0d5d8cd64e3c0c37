//! Tests of `fretwear reproduce` with the paper's scenes, which `--set` reduces: output files, and restarts of an interrupted study.

use std::fs;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

use fretwear::store::{FileSystem, LockAttempt, RealFileSystem};
use fretwear::tables::{Table, TableName, from_parquet};

use crate::support::{Bench, Did, RESONATOR, content, verified};

/// The paper's resonator with a coarse mesh, a coarse surface and a short life. The test takes seconds instead of minutes.
const SMALL: [&str; 21] = [
    "joint.grid=[27, 27]",
    "joint.elements=[9, 9]",
    "joint.hole.diameter=22.98 mm",
    "surface.correlation_length=[\"5 mm\", \"5 mm\"]",
    "structure.half_depth_cells=2",
    "structure.block_cells=3",
    "structure.stub_cells=1",
    "structure.gap_cells=1",
    "structure.leaf_cells=1",
    "structure.window_cells=3",
    "structure.wall_cells=2",
    "structure.inner_cells=2",
    "structure.rim_cells=1",
    "structure.head_cells=1",
    "dynamics.modes=10",
    "output.response_at=[]",
    "dynamics.frequency=[\"850 Hz\", \"1150 Hz\"]",
    "dynamics.points=3",
    "dynamics.force.amplitude=300 N",
    "fidelity.aft_samples=32",
    "wear.cycles=100_000",
];

const NAMES: [&str; 16] = [
    "rq05",
    "rq1",
    "rq5",
    "rq10",
    "plastic",
    "update05",
    "update10",
    "update20",
    "explicit",
    "harmonics5",
    "harmonics7",
    "tangent",
    "sphere",
    "sphere600",
    "sphere500",
    "sphere450",
];

fn reproduce(bench: &Bench, folder: &str, more: &[&str]) -> Did {
    let mut arguments = vec!["reproduce", "--dir", folder];
    for set in SMALL {
        arguments.extend(["--set", set]);
    }
    arguments.extend(more);
    bench.fretwear(&arguments)
}

fn claims(folder: &Path) -> Table {
    let bytes = fs::read(folder.join("claims.parquet")).expect("a table");
    from_parquet(&bytes, TableName::Claims.schema()).expect("the table")
}

/// All rows except the rows for wall time.
fn rows(table: &Table) -> Vec<String> {
    let column = |name| table.text(name).expect("texts");
    let (verdicts, runs, measured) = (column("verdict"), column("runs"), column("measured"));
    let claims = table.i32("claim").expect("numbers");
    (0..table.rows())
        .filter(|&k| claims[k] != 6)
        .map(|k| format!("{} {} {} {}", claims[k], runs[k], verdicts[k], measured[k]))
        .collect()
}

/// The complete study without scene files: an uninterrupted and an interrupted study give bit-identical runs and the same claims.
#[test]
#[ignore = "long: a minute"]
fn the_papers_study_goes_on_where_it_was_stopped() {
    let bench = Bench::new().sharing();
    let did = reproduce(&bench, "direct", &[]);
    assert_eq!(did.code(), 0, "{}", did.stderr());
    assert!(
        did.stderr().contains("scene 16 of 16: sphere450"),
        "{}",
        did.stderr()
    );
    let direct = bench.path("direct");
    assert_eq!(
        did.stdout(),
        fs::read_to_string(direct.join("claims.md")).expect("text")
    );
    let page = fs::read_to_string(direct.join("report.html")).expect("a page");
    for (figure, other) in fretwear::study::claims::FIGURES {
        // The command draws this figure only if a scene stores intermediate states.
        if figure == "responses-over-wear" {
            continue;
        }
        let own = format!("<figure id=\"fig-{figure}\">");
        let (_, rest) = page
            .split_once(&own)
            .unwrap_or_else(|| panic!("no {figure}"));
        let (caption, _) = rest.split_once("</figure>").expect("an end");
        assert!(
            caption.contains(&format!("<p>Compare with {other} of [A]. ")),
            "{figure}"
        );
    }
    let table = claims(&direct);
    let found = table.i32("claim").expect("numbers");
    assert!((1..=47).all(|claim| found.contains(&claim)));
    // The study contains four roughnesses, an elastic and a plastic joint, three update criteria and spheres, with the paper's settings.
    let all = rows(&table).join("\n");
    for part in [
        "17 rq05 rq1 rq5 rq10 ",
        "40 rq5 plastic ",
        "31 update05 update10 update20 ",
        // These claims need 10⁷ cycles, and the short runs end earlier.
        "32  not applicable needs finished runs to 10⁷ cycles",
        "33  not applicable needs two finished runs",
        "27 rq5 harmonics5 harmonics7 ",
        "39 sphere sphere600 sphere500 sphere450 ",
    ] {
        assert!(all.contains(part), "{part} in {all}");
    }
    let settings = table.text("setting").expect("texts");
    assert!(
        settings
            .iter()
            .all(|setting| setting == "total, by_load; never updated")
    );
    // Other keys do not change the spheres of the paper's figure, and the claim is confirmed for the spheres.
    let plateau = |row: &&String| row.starts_with("39 ") && row.contains(" holds ");
    assert!(rows(&table).iter().any(|row| plateau(&row)), "{all}");

    let (mut starts, mut seconds) = (0, 0.001);
    loop {
        starts += 1;
        let wall = format!("{seconds} s");
        let did = reproduce(&bench, "stopped", &["--jobs", "1", "--max-wall", &wall]);
        if did.code() == 0 {
            break;
        }
        assert_eq!(did.code(), 75, "{}", did.stderr());
        // The study stops between scenes or iterations. On a busy machine, the study may also stop within or before a stage.
        let said = did.stderr();
        let between = said.contains("of 16 scenes; run the same command again to continue");
        let hard = said.contains("continue with: the same command")
            || said.contains("repeat the command to begin it");
        assert!(between || hard, "{said}");
        // The test doubles the time limit until the stage finishes.
        seconds = if hard {
            1.0f64.max(2.0 * seconds)
        } else {
            0.001
        };
        assert_eq!(did.stdout(), "");
        assert!(!bench.path("stopped/claims.md").exists());
        assert!(starts < 200, "the study made no progress");
    }
    assert!(starts > 16, "the study ended after {starts} starts");
    for name in NAMES {
        verified(&direct.join(name));
        let run = |folder: &str| content(&bench.path(folder).join(name));
        assert!(run("direct").chain == run("stopped").chain, "{name}");
    }
    assert_eq!(rows(&claims(&bench.path("stopped"))), rows(&table));

    // A repeated command computes nothing and prints the same text.
    let before = content(&direct.join("rq5"));
    let again = reproduce(&bench, "direct", &["--quiet"]);
    assert_eq!((again.code(), again.stderr().as_str()), (0, ""));
    assert_eq!(again.stdout(), did.stdout());
    assert!(before == content(&direct.join("rq5")));
    let json = reproduce(&bench, "direct", &["--json"]).json();
    assert_eq!(
        json["findings"].as_array().map(Vec::len),
        Some(table.rows())
    );
    assert_eq!(json["claims"][46]["number"], 47);
    assert!(json["numbers"][0]["paper"] == 231.0);
}

/// A study with the user's scenes reports a failed scene and evaluates the other scenes.
#[test]
fn scenes_of_a_folder() {
    let bench = Bench::new().sharing();
    fs::create_dir(bench.path("scenes")).expect("a folder");
    bench.write("scenes/smooth.toml", RESONATOR);
    bench.write(
        "scenes/still.toml",
        RESONATOR.replace("[\"900 Hz\", \"1100 Hz\"]", "[\"10 Hz\", \"20 Hz\"]"),
    );
    bench.write("scenes/notes.txt", "no scene");
    let did = bench.fretwear(&["reproduce", "--scenes", "scenes", "--dir", "a"]);
    assert_ne!(did.code(), 0);
    assert!(did.stderr().contains("still failed: "), "{}", did.stderr());
    assert!(did.stderr().contains("scene 2 of 2"), "{}", did.stderr());
    let judged = rows(&claims(&bench.path("a"))).join("\n");
    assert!(
        judged.contains("smooth") && !judged.contains("still"),
        "{judged}"
    );
    let empty = bench.fretwear(&["reproduce", "--scenes", "a/smooth/once", "--dir", "b"]);
    assert_eq!(empty.code(), 2);
    assert!(
        empty
            .stderr()
            .contains("no scene (*.toml) in a/smooth/once"),
        "{}",
        empty.stderr()
    );
}

/// Another process computes a run of the study, as in a campaign.
#[test]
fn a_run_of_another_process_stops_a_study_that_can_go_on() {
    let bench = Bench::new().sharing();
    fs::create_dir(bench.path("scenes")).expect("a folder");
    bench.write("scenes/smooth.toml", RESONATOR);
    fs::create_dir_all(bench.path("a/smooth")).expect("folders");
    let lock = RealFileSystem.try_lock(&bench.path("a/smooth/lock"));
    let lock = lock.expect("a lock");
    assert!(matches!(lock, LockAttempt::Taken(_)));
    for jobs in ["1", "2"] {
        let study = [
            "reproduce",
            "--scenes",
            "scenes",
            "--dir",
            "a",
            "--jobs",
            jobs,
        ];
        let did = bench.fretwear(&study);
        let said = did.stderr();
        assert_eq!(did.code(), 75, "{said}");
        for part in [
            "a/smooth is being written by process ",
            "stopped after 0 of 1 scenes; run the same command again to continue\n",
        ] {
            assert!(said.contains(part), "{said}");
        }
    }
    drop(lock);
    bench.done(&[
        "reproduce",
        "--scenes",
        "scenes",
        "--dir",
        "a",
        "--jobs",
        "2",
    ]);
}

/// The processes of a study end with the study, and release their runs.
#[cfg(target_os = "linux")]
#[test]
fn the_processes_of_a_study_end_with_it() {
    let bench = Bench::new();
    fs::create_dir(bench.path("scenes")).expect("a folder");
    // The runs consist of short iterations and would take hours.
    let long = crate::support::SMALL
        .replace("600_000", "60_000_000_000")
        .replace("1e-3", "1e-5");
    for name in ["one", "two"] {
        bench.write(&format!("scenes/{name}.toml"), &long);
    }
    let study = [
        "reproduce",
        "--scenes",
        "scenes",
        "--dir",
        "a",
        "--jobs",
        "2",
    ];
    let mut child = bench.command(&study).spawn().expect("started");
    let locks = ["one", "two"].map(|name| bench.path("a").join(name).join("lock"));
    let held = || {
        let holders = locks
            .each_ref()
            .map(|lock| RealFileSystem.lock_holder(lock));
        holders.map(|holder| holder.expect("readable").is_some())
    };
    awaited(&|| held() == [true; 2]);
    // `kill` ends the study by SIGKILL, as `kill -9` does.
    child.kill().expect("killed");
    child.wait().expect("ended");
    awaited(&|| held() == [false; 2]);
}

/// Waits until a condition is true.
fn awaited(what: &dyn Fn() -> bool) {
    const LONGEST: Duration = Duration::from_secs(30);
    let begin = Instant::now();
    while !what() {
        assert!(
            begin.elapsed() < LONGEST,
            "the condition did not become true within 30 s"
        );
        sleep(Duration::from_millis(5));
    }
}
