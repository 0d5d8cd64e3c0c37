//! Tests of `fretwear status` for interrupted runs, for runs that were killed within an iteration, and for finished runs.

use fretwear::tables::TableName;
use serde_json::{Value, json};

use crate::support::{Bench, Did, OSCILLATOR, SLIDER, latest, summary, table};

/// Keys of `status --json` that the summary table does not contain.
pub const KEYS: [&str; 17] = [
    "figures",
    "state",
    "has_lost_preload",
    "running",
    "process",
    "stage",
    "drafted",
    "cycles_goal",
    "cycles_left",
    "wear_volume_goal",
    "part_done",
    "last_update",
    "cycles_per_second",
    "seconds_left",
    "continue",
    "failure",
    "damage",
];

fn status(bench: &Bench, run: &str) -> Value {
    bench.done(&["status", run, "--json"]).json()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

/// Runs one iteration.
fn step(bench: &Bench, scene: &str, run: &str) -> Did {
    bench.fretwear(&["run", scene, "--run", run, "--max-wall", "1 ms"])
}

#[test]
fn a_stopped_run_says_how_far_it_is_and_how_to_go_on() {
    let bench = Bench::new();
    for _ in 0..3 {
        assert_eq!(step(&bench, "small.toml", "a").code(), 75);
    }
    let root = bench.path("a");
    let (k, found) = (latest(&root), status(&bench, "a"));
    let cycles = summary(&root, k, "cycles");
    assert!(k >= 2 && cycles > 0.0, "{found}");
    assert_eq!(
        (&found["state"], &found["running"]),
        (&"stopped".into(), &false.into())
    );
    assert_eq!(
        (&found["stage"], &found["drafted"]),
        (&"wear".into(), &Value::Array(Vec::new()))
    );
    assert_eq!(number(&found["cycles_goal"]), 600_000.0);
    assert_eq!(number(&found["cycles_left"]), 600_000.0 - cycles);
    assert_eq!(found["wear_volume_goal"], Value::Null);
    assert!((number(&found["part_done"]) - cycles / 600_000.0).abs() < 1e-12);
    // The pace is the mean of the last three jumps, over the time of their stages.
    let rate = number(&found["cycles_per_second"]);
    assert!(rate > 0.0);
    // `status` estimates the remaining time after 20 % of the cycles.
    let left = &found["seconds_left"];
    assert_eq!(left.is_null(), number(&found["part_done"]) < 0.2, "{found}");
    assert_eq!(found["continue"], "fretwear run --run a");
    let words = bench.done(&["status", "a"]).stdout();
    for part in [
        &format!("a: iteration {k}, stopped\n  {:<24} Small\n", "title"),
        " of 600 000 cycles, worn ",
        " cycles/s recently, ",
        " cycles to go",
        &format!("  {:<24} fretwear run --run a\n", "continue"),
    ] {
        assert!(words.contains(part), "{part:?} in {words}");
    }

    // `status` counts the finished stages of a killed iteration, and reports the next stage.
    bench.done(&["run", "--run", "a", "--until", "static_contact"]);
    let found = status(&bench, "a");
    assert_eq!(found["stage"], "fretting_cycle");
    assert_eq!(found["drafted"], json!(["wear", "static_contact"]));
    let words = bench.done(&["status", "a"]).stdout();
    let within = format!(
        "stopped within iteration {}, before fretting_cycle\n",
        k + 1
    );
    assert!(words.contains(&within), "{words}");

    bench.done(&["run", "--run", "a"]);
    let found = status(&bench, "a");
    assert_eq!(found["state"], "done");
    assert_eq!(
        (number(&found["part_done"]), number(&found["cycles_left"])),
        (1.0, 0.0)
    );
    assert!(
        found["continue"].is_null() && found["stage"].is_null(),
        "{found}"
    );
    // With more cycles in the scene, the finished run becomes an interrupted run.
    assert_eq!(
        bench
            .fretwear(&[
                "run",
                "--run",
                "a",
                "--set",
                "wear.cycles=9e9",
                "--max-wall",
                "1 ms"
            ])
            .code(),
        75
    );
    let found = status(&bench, "a");
    assert_eq!(
        (&found["state"], number(&found["cycles_goal"])),
        (&"stopped".into(), 9e9)
    );
}

#[test]
fn the_last_update_is_told() {
    let bench = Bench::new();
    bench.done(&["run", "resonator.toml", "--run", "a"]);
    let root = bench.path("a");
    let update = &status(&bench, "a")["last_update"];
    let k = update["wear_iteration"].as_u64().expect("an iteration");
    assert!(0 < k && k <= latest(&root), "{update}");
    assert_eq!(number(&update["cycles"]), summary(&root, k, "cycles"));
    assert!(number(&update["updates"]) >= 1.0);
    let words = bench.done(&["status", "a"]).stdout();
    assert!(
        words.contains(&format!("  {:<24} iteration {k}, at ", "last update")),
        "{words}"
    );
    // A run with prescribed motion has no contact elements and thus no update.
    step(&bench, "small.toml", "b");
    assert_eq!(status(&bench, "b")["last_update"], Value::Null);
}

/// The result of `run` contains the same quantities under the same names as the top of the report.
#[test]
fn the_end_of_a_run_has_the_resonance_of_the_worn_joint() {
    let bench = Bench::new();
    let words = bench
        .done(&["run", "resonator.toml", "--run", "a"])
        .stdout();
    let root = bench.path("a");
    let last = latest(&root);
    let row = |name: &str| {
        let mut lines = words.lines().map(str::trim_start);
        let line = lines.find(|line| line.starts_with(name));
        line.unwrap_or_else(|| panic!("no {name} in {words}"))
            .to_owned()
    };
    let of = |k: u64, column: &str| {
        table(&root, k, TableName::WornResponse)
            .f64(column)
            .unwrap()[0]
    };
    let (frequency, amplitude) = (row("resonance "), row("amplitude at resonance "));
    for k in [0, last] {
        let hertz = format!("{:.1} Hz", of(k, "resonance_frequency"));
        assert!(frequency.contains(&hertz), "{frequency} lacks {hertz}");
        let micrometres = of(k, "resonance_amplitude") * 1e6;
        let decimals = (3.0 - micrometres.log10().floor()) as usize;
        let text = format!("{micrometres:.decimals$} µm");
        assert!(amplitude.contains(&text), "{amplitude} lacks {text}");
    }
    let driving = row("wear-driving vibration");
    let hertz = format!(" {:.1} Hz, ", summary(&root, last, "resonance_frequency"));
    assert!(driving.contains(&hertz), "{driving} lacks {hertz}");
    assert!(driving.contains(" µm at most"), "{driving}");
}

/// `run` and `status` print the same figures in the same lines, without column names of tables.
#[test]
fn status_prints_the_figures_and_what_to_do_next() {
    let bench = Bench::new();
    let end = bench
        .done(&["run", "resonator.toml", "--run", "a"])
        .stdout();
    let status = bench.done(&["status", "a"]).stdout();
    for name in [
        "resonance ",
        "amplitude at resonance ",
        "stiffness kn ",
        "largest pressure ",
    ] {
        let of = |text: &str| {
            let mut lines = text.lines().map(str::to_owned);
            lines.find(|line| line.starts_with(&format!("  {name}")))
        };
        let line = of(&status).unwrap_or_else(|| panic!("no {name} in {status}"));
        assert_eq!(of(&end), Some(line.clone()));
        assert!(line.contains(" ± ") && line.ends_with(" %"), "{line}");
    }
    for column in ["error_", "n_cycles", "kn  ", "fft_pairs", "N/m "] {
        let lines = status.lines().map(str::trim_start);
        let found: Vec<&str> = lines.filter(|line| line.starts_with(column)).collect();
        assert!(found.is_empty(), "{found:?}");
    }
    for (name, text) in [
        ("title", "Small resonator"),
        ("look at it", "fretwear report a"),
        ("all figures", "fretwear status a --json"),
    ] {
        let line = format!("\n  {name:<24} {text}\n");
        assert!(status.contains(&line), "{line} in {status}");
    }
    assert!(!status.contains("\n  progress"), "{status}");
    assert!(!status.contains("\n  continue"), "{status}");

    bench.write("mass.toml", format!("{OSCILLATOR}{SLIDER}"));
    bench.done(&["run", "mass.toml", "--run", "b"]);
    for run in ["a", "b"] {
        for width in [80, 120] {
            let mut command = bench.command(&["status", run]);
            let did = command.env("COLUMNS", width.to_string()).output();
            let status = Did(did.expect("the program runs")).stdout();
            let longest = status.lines().map(|line| line.chars().count()).max();
            assert!(longest <= Some(width), "{longest:?} of {width}: {status}");
        }
    }
    let status = bench.done(&["status", "b"]).stdout();
    let resonance = status.lines().find(|line| line.starts_with("  resonance "));
    assert!(
        resonance.is_some_and(|line| line.contains(" Hz ± ")),
        "{status}"
    );
}

/// `status` reports the error of a failed run until the run continues.
#[test]
fn a_failed_run_says_why() {
    let bench = Bench::new();
    let run = ["run", "resonator.toml", "--run", "a"];
    let without = ["--set", "dynamics.frequency=[\"300 Hz\", \"310 Hz\"]"];
    let did = bench.fretwear(&[&run[..], &without[..]].concat());
    assert_eq!(did.code(), 3, "{}", did.stderr());
    let found = status(&bench, "a");
    let message = found["failure"].as_str().expect("a message");
    assert!(
        message.contains("no phase resonance between 300"),
        "{message}"
    );
    assert!(did.stderr().contains(message), "{}", did.stderr());
    assert_eq!(found["state"], "stopped");
    let words = bench.done(&["status", "a"]).stdout();
    assert!(
        words.contains(&format!("  {:<24} {message}\n", "failed")),
        "{words}"
    );
    let line = bench.done(&["status", "."]).stdout();
    let begin: String = message.chars().take(40).collect();
    assert!(line.contains(&format!("failed: {begin}")), "{line}");
    assert_eq!(line.lines().count(), 1, "{line}");
    let listed = bench.done(&["status", ".", "--json"]).json();
    assert_eq!(listed["failure"], message);
    // `status` ignores an edited error message.
    let file = bench.path("a/failure.json");
    let kept = std::fs::read_to_string(&file).expect("a file");
    std::fs::write(&file, kept.replace("no phase", "a phase")).expect("written");
    assert_eq!(status(&bench, "a")["failure"], Value::Null);
    std::fs::write(&file, kept).expect("written");

    bench.done(&[&run[..], &["--max-wall", "1 ms", "--until", "unworn"]].concat());
    assert_eq!(status(&bench, "a")["failure"], Value::Null);
    assert!(!file.exists());
}

/// For a run that ends at a wear volume, the progress is the fraction of this volume.
#[test]
fn a_run_to_a_volume() {
    let bench = Bench::new();
    let sets = [
        "--set",
        "wear.cycles=9e9",
        "--set",
        "wear.volume=\"1 mm^3\"",
    ];
    let start = ["run", "small.toml", "--run", "a", "--max-wall", "1 ms"];
    for _ in 0..2 {
        bench.fretwear(&[&start[..], &sets[..]].concat());
    }
    let found = status(&bench, "a");
    assert!((number(&found["wear_volume_goal"]) / 1e-9 - 1.0).abs() < 1e-12);
    let volume = summary(&bench.path("a"), latest(&bench.path("a")), "wear_volume");
    let part = number(&found["part_done"]);
    assert!((part / (volume / 1e-9) - 1.0).abs() < 1e-9, "{found}");
}
