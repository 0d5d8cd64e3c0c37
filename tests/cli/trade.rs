//! Tests of `fretwear trade`: variants, output files, and restarts of an interrupted study.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use fretwear::tables::{Table, TableName, from_parquet};
use serde_json::Value;

use crate::support::{Bench, RESONATOR, SMALL, content, verified};

/// Scene without keys for accuracy, and with few wear iterations.
fn bench() -> Bench {
    let bench = Bench::new();
    let scene = SMALL
        .replace("tolerance = 1e-3", "")
        .replace("600_000", "200_000");
    bench.write("tiny.toml", scene);
    bench
}

const KNOBS: [&str; 4] = ["--knob", "preset", "--knob", "cycle"];

fn trade_table(folder: &Path) -> Table {
    let bytes = fs::read(folder.join("trade.parquet")).expect("a table");
    from_parquet(&bytes, TableName::Trade.schema()).expect("the table")
}

/// Errors of a row by column name.
fn errors(table: &Table, row: usize) -> BTreeMap<String, Option<f64>> {
    table
        .columns()
        .filter(|(schema, _)| schema.name.starts_with("error_"))
        .map(|(schema, _)| {
            let values = table.maybe_f64(&schema.name).expect("errors");
            (schema.name.clone(), values[row])
        })
        .collect()
}

fn row_of(table: &Table, variant: &str) -> usize {
    let names = table.text("variant").expect("names");
    names
        .iter()
        .position(|name| name == variant)
        .unwrap_or_else(|| panic!("no {variant}"))
}

/// All files below a folder, except locks, logs and drafts, which depend on the last start.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.ends_with("staging") {
            continue;
        } else if path.is_dir() {
            found.extend(files(&path));
        } else if !path.ends_with("lock") && !path.ends_with("log.txt") {
            found.insert(path.clone(), fs::read(&path).expect("a file"));
        }
    }
    found
}

#[test]
fn runs_every_variant_and_compares_it_with_the_reference() {
    let bench = bench();
    let did = bench.done(&[&["trade", "tiny.toml", "--knob", "grid"], &KNOBS[..]].concat());
    let folder = bench.path("trade/tiny");
    let table = trade_table(&folder);
    let expected = [
        "balanced",
        "reference",
        "fast",
        "cycle-superposition",
        "cycle-stepped",
        "grid-52-44",
        "balanced_again",
    ];
    assert_eq!(table.text("variant").expect("names"), expected);
    assert!(table.bool("done").expect("flags").iter().all(|done| *done));
    for (row, variant) in expected.iter().enumerate() {
        verified(&folder.join(variant));
        for (name, error) in errors(&table, row) {
            let error = error.unwrap_or_else(|| panic!("no {name} of {variant}"));
            if *variant == "reference" {
                assert_eq!(error, 0.0, "{name}");
            }
        }
        assert!(table.f64("seconds").expect("times")[row] > 0.0);
        let cpu = table.maybe_f64("cpu_seconds").expect("times")[row];
        assert!(!cfg!(unix) || cpu.is_some_and(|cpu| cpu > 0.0), "{cpu:?}");
        assert_eq!(table.text("motion").expect("kinds")[row], "line");
        assert!(table.f64("fft_pairs").expect("pairs")[row] > 0.0);
        assert!(table.i64("memory").expect("memory")[row] > 0);
        assert!(table.i64("iterations").expect("iterations")[row] > 0);
    }
    // The table has no columns for quantities that the scene does not compute.
    assert!(!table.has("resonance_frequency") && !table.has("error_peak_amplitude"));
    // The `superposition` variant changes the wear volume, and the `stepped` variant needs more than 3 times the FFT pairs.
    let volume = |variant| errors(&table, row_of(&table, variant))["error_wear_volume"];
    assert!(volume("cycle-superposition").expect("an error").abs() > 1e-3);
    let pairs = table.f64("fft_pairs").expect("pairs");
    assert!(pairs[row_of(&table, "cycle-stepped")] > 3.0 * pairs[row_of(&table, "balanced")]);

    // Equal presets give equal results at equal cost. A finer grid increases the cost more than the number of FFT pairs.
    let relative = table.maybe_f64("relative_cost").expect("costs");
    assert_eq!(relative[row_of(&table, "balanced_again")], Some(1.0));
    assert!(errors(&table, 0) == errors(&table, 6));
    let finer = row_of(&table, "grid-52-44");
    let by_pairs = pairs[finer] / pairs[row_of(&table, "balanced")];
    assert!(relative[finer].expect("a cost") > 4.0 * by_pairs);

    let said = did.stdout();
    let text = fs::read_to_string(folder.join("trade.md")).expect("text");
    // The two texts may differ in the escapes of Markdown and in the widths of the columns.
    let bare = |text: &str| text.replace(['\\', ' ', '-'], "");
    assert_eq!(bare(&said), bare(&text));
    for part in [
        "| FFT pairs | by their work | CPU seconds |",
        "|   5 | cycle = stepped ",
        " 1 %: pass |",
        "grid [26, 22], against [52, 44]: ",
        "load_steps",
    ] {
        assert!(
            said.contains(part) == (part != "load_steps"),
            "{part:?} in {said}"
        );
    }
    let html = fs::read_to_string(folder.join("trade.html")).expect("text");
    assert!(html.contains("<svg ") && html.contains(">cycle = stepped</td>"));
    for outside in ["src=", "href=", "@import", "<script"] {
        assert!(
            !html.contains(outside),
            "{outside}: trade.html refers to another file"
        );
    }
    assert!(
        did.stderr().contains("variant 7 of 7: balanced_again"),
        "{}",
        did.stderr()
    );
}

#[test]
fn the_same_command_again_computes_nothing() {
    let bench = bench();
    let command = [&["trade", "tiny.toml", "--dir", "a", "--json"], &KNOBS[..]].concat();
    let first = bench.done(&command);
    let before = files(&bench.path("a"));
    let second = bench.done(&command);
    assert_eq!(first.stdout(), second.stdout());
    assert!(
        before == files(&bench.path("a")),
        "a repeated command changed a file"
    );
    let object = first.json();
    assert_eq!(object["rows"].as_array().map(Vec::len), Some(6));
    assert_eq!(object["rows"][1]["variant"], "reference");
    assert_eq!(object["rows"][1]["error_wear_field"], 0.0);
    let promises = object["findings"]["promises"].as_array().expect("promises");
    assert_eq!(promises.len(), 6, "{promises:?}");
    for kept in promises {
        let within = kept["error"].as_f64().expect("a number").abs()
            <= kept["promise"].as_f64().expect("a number");
        assert_eq!(kept["passed"], within, "{kept}");
    }
    // `trade` adds no variant `as_written` if the scene sets only a preset.
    let preset = ["--set", "fidelity.preset=fast"];
    let did = bench.done(&[&command[..], &preset[..]].concat());
    let left = did.json()["left_out"].to_string();
    assert!(left.contains("it is the same as fast"), "{left}");
    assert!(!bench.path("a/as_written").exists());
}

/// An interrupted study gives the same results as an uninterrupted study, except for the times.
#[test]
fn goes_on_where_it_was_stopped() {
    let bench = bench();
    let command = |folder| [&["trade", "tiny.toml", "--dir", folder], &KNOBS[..]].concat();
    bench.done(&command("direct"));
    let mut starts = 0;
    loop {
        starts += 1;
        let did = bench.fretwear(&[&command("stopped")[..], &["--max-wall", "1 ms"]].concat());
        if did.code() == 0 {
            break;
        }
        assert_eq!(did.code(), 75, "{}", did.stderr());
        assert!(
            did.stderr()
                .contains("run the same command again to continue"),
            "{}",
            did.stderr()
        );
        assert_eq!(did.stdout(), "");
        assert!(starts < 100, "a start made no progress: {starts} starts");
    }
    assert!(starts > 5, "the study ended after {starts} starts");
    let [direct, stopped] = ["direct", "stopped"].map(|folder| trade_table(&bench.path(folder)));
    for (schema, column) in direct.columns() {
        if !["seconds", "cpu_seconds"].contains(&schema.name.as_str()) {
            let again = stopped.column(&schema.name).expect("the same columns");
            assert_eq!(again, column, "{}", schema.name);
        }
    }
    for variant in direct.text("variant").expect("names") {
        let run = |folder| content(&bench.path(folder).join(variant));
        assert!(run("direct").chain == run("stopped").chain, "{variant}");
    }
}

/// With three modes, a mode within the range of frequencies is missing. The row of this variant contains the error message.
#[test]
fn a_variant_that_fails_is_a_row() {
    let bench = Bench::new();
    let end = RESONATOR.find("[wear]").expect("a section");
    let scene = RESONATOR[..end].replace("1100 Hz", "1050 Hz");
    bench.write("still.toml", scene);
    let sets = ["--set", "joint.grid=[27, 18]"];
    let did = bench.done(&[&["trade", "still.toml", "--knob", "modes"], &sets[..]].concat());
    let table = trade_table(&bench.path("trade/still"));
    let failed = row_of(&table, "modes-3");
    assert_eq!(
        table.bool("done").expect("flags"),
        [true, true, false, true, true, true]
    );
    let message = &table.text("message").expect("texts")[failed];
    assert!(message.contains("raise dynamics.modes"), "{message}");
    assert!(errors(&table, failed).values().all(Option::is_none));
    assert!(did.stdout().contains(message), "{}", did.stdout());
    // A second command repeats the failed variant and writes the same row.
    let again = bench.done(
        &[
            &["trade", "still.toml", "--knob", "modes", "--json"],
            &sets[..],
        ]
        .concat(),
    );
    assert_eq!(again.json()["rows"][failed]["kn"], Value::Null);
    assert_eq!(trade_table(&bench.path("trade/still")), table);
}

#[test]
fn refuses_what_it_cannot_do() {
    let bench = bench();
    let unknown = bench.fretwear(&["trade", "tiny.toml", "--knob", "gird"]);
    assert_eq!(unknown.code(), 2);
    assert!(
        unknown.stderr().contains("\"gird\" is no knob") && unknown.stderr().contains(", grid")
    );
    // `trade` does not change a folder that contains the runs of another scene.
    let of_scene = |set| ["trade", "tiny.toml", "--knob", "load_steps", "--set", set];
    bench.done(&of_scene("surface.seed=3"));
    let before = files(&bench.path("trade/tiny"));
    let other = bench.fretwear(&of_scene("surface.seed=4"));
    assert_eq!(other.code(), 4);
    assert!(
        other.stderr().contains("surface.seed"),
        "{}",
        other.stderr()
    );
    assert!(
        before == files(&bench.path("trade/tiny")),
        "a rejected command changed a file"
    );
}

/// Three scenes with two kinds of motion; one folder contains two of the scenes.
fn scenes() -> Bench {
    let bench = bench();
    let scene = fs::read_to_string(bench.path("tiny.toml")).expect("the scene");
    let round = "amplitude = [\"1 um\", \"0.5 um\"]\nphase = [\"0 deg\", \"90 deg\"]";
    let orbit = scene.replace("amplitude = \"1 um\"", round);
    assert!(orbit.contains(round), "{orbit}");
    for folder in ["set", "other", "empty"] {
        fs::create_dir(bench.path(folder)).expect("a folder");
    }
    bench.write("set/line.toml", scene.replace("seed = ", "seed = 1"));
    bench.write("set/orbit.toml", orbit);
    bench
}

#[test]
fn several_scenes_are_held_against_their_references() {
    let bench = scenes();
    let command = ["trade", "tiny.toml", "set"];
    let did = bench.done(&command);
    let folder = bench.path("trade");
    let table = trade_table(&folder);
    let names = ["tiny", "line", "orbit"].map(|name| [name; 3]).concat();
    assert_eq!(table.text("scene").expect("names"), names);
    let presets = ["fast", "balanced", "reference"];
    assert_eq!(table.text("variant").expect("names"), [presets; 3].concat());
    let kinds = ["line", "line", "orbit"].map(|kind| [kind; 3]).concat();
    assert_eq!(table.text("motion").expect("kinds"), kinds);
    assert!(table.bool("done").expect("flags").iter().all(|done| *done));
    for row in 0..9 {
        verified(&folder.join(names[row]).join(presets[row % 3]));
        for figure in [
            "wear_volume",
            "loaded_area_fraction",
            "kn",
            "kt",
            "dissipated_energy",
        ] {
            let bar = table.maybe_f64(&format!("bar_{figure}")).expect("bars")[row];
            assert!(
                bar.is_some_and(|bar| bar > 0.0),
                "{figure} of {row}: {bar:?}"
            );
        }
    }
    let said = did.stdout();
    let text = fs::read_to_string(folder.join("trade.md")).expect("text");
    assert_eq!(said, text);
    for part in [
        "| balanced, orbit ",
        "| fast, all ",
        "scenes: the presets over 3 scenes",
    ] {
        assert!(said.contains(part), "{part:?} in {said}");
    }
    assert!(
        did.stderr().contains("run 9 of 9: orbit, reference"),
        "{}",
        did.stderr()
    );
    // A study of several scenes and a study of one scene share their runs.
    let before = files(&folder.join("tiny/reference"));
    bench.done(&["trade", "tiny.toml", "--knob", "load_steps"]);
    assert!(
        before == files(&folder.join("tiny/reference")),
        "the study of one scene changed a file"
    );
    // A repeated command gives the same table.
    let object = bench.done(&[&command[..], &["--json"]].concat()).json();
    assert_eq!(trade_table(&folder), table);
    assert_eq!(object["rows"].as_array().map(Vec::len), Some(9));
    let all = &object["tallies"][0];
    assert_eq!(
        (&all["motion"], &all["scenes"]),
        (&Value::from("all"), &Value::from(3))
    );
}

#[test]
fn several_scenes_go_on_where_they_were_stopped() {
    let bench = scenes();
    // Each start needs to finish at least one stage within the time limit; fewer cells shorten a stage by a factor of 10.
    for scene in ["line", "orbit"] {
        let path = format!("set/{scene}.toml");
        let fine = fs::read_to_string(bench.path(&path)).expect("the scene");
        let coarse = fine.replace("grid = [26, 22]", "grid = [14, 11]");
        assert_ne!(fine, coarse);
        bench.write(&path, coarse);
    }
    let stopped = ["trade", "set", "--dir", "s", "--max-wall", "1 ms"];
    let mut starts = 0;
    while bench.fretwear(&stopped).code() == 75 {
        starts += 1;
        assert!(starts < 100, "a start made no progress: {starts} starts");
    }
    assert!(starts > 5, "the study ended after {starts} starts");
    let did = bench.done(&["trade", "set", "--dir", "direct"]);
    let [direct, stopped] = ["direct", "s"].map(|folder| trade_table(&bench.path(folder)));
    for (schema, column) in direct.columns() {
        if !["seconds", "cpu_seconds"].contains(&schema.name.as_str()) {
            let again = stopped.column(&schema.name).expect("the same columns");
            assert_eq!(again, column, "{}", schema.name);
        }
    }
    let texts = ["direct", "s"].map(|folder| {
        let text = fs::read_to_string(bench.path(folder).join("trade.md"));
        text.expect("text")
    });
    assert_eq!(did.stdout(), texts[0]);
    let begins = |text: &String| text.starts_with("set: the presets over 2 scenes");
    assert!(texts.iter().all(begins), "{texts:?}");
}

#[test]
fn several_scenes_are_refused_before_anything_is_computed() {
    let bench = scenes();
    bench.write("other/line.toml", "");
    bench.write("empty/notes.txt", "");
    let twice = ["trade", "set", "set/line.toml"];
    for (command, said) in [
        (&twice[..], "have the same name line"),
        (
            &["trade", "set", "--knob", "grid"],
            "--knob needs a single scene, but 2 are given",
        ),
        (&["trade", "set", "--paper"], "--paper needs a single scene"),
        (&["trade", "empty"], "there is no scene (*.toml) in empty"),
        (&["trade", "tiny.toml", "other"], "line.toml"),
    ] {
        let did = bench.fretwear(command);
        assert_eq!(did.code(), 2, "{command:?}: {}", did.stderr());
        assert!(did.stderr().contains(said), "{said:?} in {}", did.stderr());
        assert!(
            !bench.path("trade").exists(),
            "{command:?} computed something"
        );
    }
}
