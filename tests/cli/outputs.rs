//! Commands print results on stdout, and all other messages on stderr.

use std::collections::BTreeSet;

use fretwear::scene::explain::{json_schema, sections};
use fretwear::tables::{TableLocation, TableName};
use serde_json::Value;

use crate::support::{Bench, SMALL, flip, latest, summary, table};

fn run_in(bench: &Bench, more: &[&str]) -> crate::support::Did {
    let short = [
        "run",
        "small.toml",
        "--run",
        "a",
        "--set",
        "wear.cycles=100_000",
    ];
    bench.done(&[&short[..], more].concat())
}

fn keys(value: &Value) -> BTreeSet<String> {
    value
        .as_object()
        .expect("an object")
        .keys()
        .cloned()
        .collect()
}

#[test]
fn json_is_the_last_summary() {
    let bench = Bench::new();
    let did = run_in(&bench, &["--json"]);
    assert_eq!(did.stdout().lines().count(), 1);
    let root = bench.path("a");
    let row = table(&root, latest(&root), TableName::Summary);
    let mut expected: BTreeSet<String> = row.columns().map(|(s, _)| s.name.clone()).collect();
    let found = did.json();
    for column in &expected {
        let value = found[column].as_f64().expect("a number");
        let stored = summary(&root, latest(&root), column);
        // A number that is read from JSON may differ in the last bit.
        assert!(
            (value - stored).abs() <= f64::EPSILON * stored.abs(),
            "{column}"
        );
    }
    let beside = [
        "wear_iteration",
        "timing",
        "timing_fft_pairs",
        "cost",
        "notices",
        "warnings",
    ];
    expected.extend(beside.map(str::to_owned));
    assert_eq!(keys(&found), expected);
    assert_eq!(found["wear_iteration"], latest(&root));
    let stages = [
        "coarse_trajectory",
        "coarse_trajectory.stiffness",
        "fretting_cycle",
        "static_contact",
        "static_contact.indentation",
        "static_contact.stiffness",
        "summary",
        "surface",
        "unworn",
        "wear",
    ];
    assert_eq!(keys(&found["timing"]), stages.map(str::to_owned).into());
    assert_eq!(keys(&found["timing_fft_pairs"]), keys(&found["timing"]));
    assert!(found["timing"]["wear"].as_f64().expect("a number") > 0.0);
    let cost = &found["cost"];
    for name in ["wear_iterations", "fft_pairs", "disk_bytes", "seconds"] {
        let value = cost[name].as_f64().expect("a number");
        assert!(value > 0.0, "{name}");
    }
    // A finished run prints the same summary.
    assert_eq!(run_in(&bench, &["--json"]).json(), found);

    let status = bench.done(&["status", "a", "--json"]).json();
    expected.remove("timing");
    expected.remove("timing_fft_pairs");
    // The log of the run contains the notices of a start; `status` omits the notices.
    expected.remove("notices");
    expected.extend(super::status::KEYS.map(str::to_owned));
    assert_eq!(keys(&status), expected);
    assert_eq!(status["running"], false);
    assert_eq!(status["damage"], Value::Array(Vec::new()));
}

#[test]
fn json_of_a_run_without_an_iteration() {
    let bench = Bench::new();
    let found = run_in(&bench, &["--json", "--until", "surface"]).json();
    assert_eq!(found["wear_iteration"], Value::Null);
    let status = bench.done(&["status", "a", "--json"]).json();
    assert_eq!(status["wear_iteration"], Value::Null);
    let words = bench.done(&["status", "a"]).stdout();
    assert_eq!(
        words,
        format!(
            "a: nothing committed yet, stopped\n  {:<24} Small\n  {:<24} fretwear run --run a\n",
            "title", "continue"
        )
    );
}

#[test]
fn progress_is_one_line_an_iteration_on_stderr() {
    let bench = Bench::new();
    let did = run_in(&bench, &[]);
    // The test skips the lines of the plausibility checks.
    let is_figure =
        |line: &&str| line.starts_with("plausibility checks") || line.starts_with("    ");
    let said = did.stderr();
    let lines: Vec<&str> = said.lines().filter(|line| !is_figure(line)).collect();
    let last = latest(&bench.path("a"));
    // The last lines contain the cost and the next commands.
    assert_eq!(lines.len() as u64, 5 + last, "{lines:?}");
    assert_eq!(lines[0], "begins a");
    // The run estimates the remaining time after 20 % of the cycles.
    let first = "iteration 0, 0 of 100 000 cycles, worn 0 mm³";
    assert_eq!(lines[1], first);
    let end = &lines[1 + last as usize];
    assert!(
        end.starts_with(&format!(
            "iteration {last}, 100 000 of 100 000 cycles, worn "
        )),
        "{end}"
    );
    assert!(did.stdout().contains("worn volume"), "{}", did.stdout());
    assert!(
        !did.stdout().contains('\u{1b}'),
        "the output to a pipe contains colours"
    );
    assert_eq!(run_in(&bench, &["--quiet"]).stderr(), "");
}

#[test]
fn status_and_verify_say_what_there_is() {
    let bench = Bench::new();
    run_in(&bench, &[]);
    let last = latest(&bench.path("a"));
    let status = bench.done(&["status", "a"]).stdout();
    assert!(
        status.starts_with(&format!("a: iteration {last}, done\n")),
        "{status}"
    );
    assert!(status.contains(" mm³"), "no units: {status}");
    let verify = bench.done(&["verify", "a"]).stdout();
    for k in 0..=last {
        assert!(verify.contains(&format!("iteration {k}: ok\n")), "{verify}");
    }
    assert!(verify.contains("once/surface: ok\n"), "{verify}");
    assert!(
        verify.ends_with(&format!("all {} iterations verify\n", last + 1)),
        "{verify}"
    );

    flip(&bench.path("a/iterations/wear_iteration=1/cycle.parquet"));
    let did = bench.fretwear(&["verify", "a"]);
    assert_eq!(did.code(), 4);
    let said = did.stdout();
    let path = "a/iterations/wear_iteration=1/cycle.parquet: content has hash ";
    assert!(said.contains(&format!("iteration 1: {path}")), "{said}");
    assert!(said.contains("iteration 0: ok\n"), "{said}");
    let did = bench.fretwear(&["status", "a", "--json"]);
    assert_eq!(did.code(), 4);
    assert_eq!(did.json()["wear_iteration"], 0);
    assert!(
        did.json()["damage"][0]
            .as_str()
            .expect("text")
            .contains("cycle.parquet")
    );
}

#[test]
fn schema_explains_every_column() {
    let bench = Bench::new();
    let all = bench.done(&["schema"]).stdout();
    for table in TableName::ALL {
        let schema = table.schema();
        assert!(all.contains(&format!("{table}: {}", schema.description)));
        let one = bench.done(&["schema", table.as_str()]).stdout();
        for column in &schema.columns {
            assert!(one.contains(&column.description), "{table}.{}", column.name);
            assert!(
                one.contains(&format!("[{}] {}", column.unit, column.kind)),
                "{table}.{}",
                column.name
            );
        }
        assert!(one.contains(&schema.written), "{one}");
        // If the word is also the name of a section, the explanation of the section follows the table.
        let own = one.split("    key     ").next().unwrap_or_default();
        assert!(all.contains(own), "{own}");
    }
    let forms = [["schema", "--markdown"], ["schema", "--json"]];
    let [markdown, json] = forms.map(|form| bench.done(&form));
    for table in TableName::ALL {
        let schema = table.schema();
        let object = &json.json()[table.as_str()];
        assert_eq!(object["written"], schema.written.as_str());
        let markdown = markdown.stdout();
        assert!(markdown.contains(&format!("## `{table}`\n")));
        for (column, found) in schema
            .columns
            .iter()
            .zip(object["columns"].as_array().expect("columns"))
        {
            for (key, value) in [
                ("name", &column.name),
                ("unit", &column.unit),
                ("dimension", &column.dimension),
                ("description", &column.description),
                ("type", &column.kind.to_string()),
            ] {
                assert_eq!(&found[key], value.as_str(), "{table}");
            }
            assert_eq!(found["optional"], column.optional);
            let row = format!("| `{}` | {} | {} |", column.name, column.unit, column.kind);
            assert!(markdown.contains(&row), "{row}");
        }
    }
}

/// `schema` explains every key with its type, default and meaning, in all formats.
#[test]
fn schema_explains_every_key_of_a_scene() {
    let bench = Bench::new();
    let forms = ["--json", "--markdown", "--json-schema"];
    let [json, markdown, editor] = forms.map(|form| bench.done(&["schema", "scene", form]));
    let text = bench.done(&["schema", "scene"]).stdout();
    let (json, markdown) = (json.json(), markdown.stdout());
    let keys = sections().into_iter().flat_map(|section| section.keys);
    for key in keys {
        let object = &json[key.key];
        for (name, value) in [
            ("meaning", &key.meaning),
            ("type", &key.kind),
            ("default", &key.default),
            ("example", &key.example),
        ] {
            assert_eq!(&object[name], value.as_str(), "{}", key.key);
        }
        assert!(text.contains(key.summary()), "{}", key.key);
        let line = format!(" {}\n", key.default);
        let mut lines = text.match_indices(&line).map(|(at, _)| &text[..at]);
        let told = |before: &str| before.trim_end_matches([' ', ';']).ends_with(&key.kind);
        assert!(lines.any(told), "{}: {line}", key.key);
        assert!(markdown.contains(&format!("| `{}` | ", key.key)));
    }
    assert_eq!(editor.json(), json_schema());
    let one = bench.done(&["schema", "contact.rotation"]).stdout();
    for part in [
        "contact.rotation\n\nRotations of the bodies about x and y: fixed or free.\n",
        "default     \"fixed\"\n",
        "example     rotation = \"fixed\"\n",
        "only        with a [surface]\n",
        "\"free\"   the bodies tilt",
    ] {
        assert!(one.contains(part), "{part:?} is missing in {one}");
    }
    let section = bench.done(&["schema", "joint.hole"]).stdout();
    assert!(section.contains("\n[joint.hole] A round hole"), "{section}");
    assert!(section.contains("\n    diameter "), "{section}");
    let object = bench.done(&["schema", "contact.kn", "--json"]).json();
    assert_eq!(object["key"], "contact.kn");
}

/// If a word is the name of a table and of a section, `schema` explains both, as text and as JSON.
#[test]
fn a_word_of_both() {
    let bench = Bench::new();
    let said = bench.done(&["schema", "surface"]).stdout();
    assert!(said.contains("surface: The unworn"), "{said}");
    assert!(said.contains("[surface] "), "{said}");
    let object = bench.done(&["schema", "surface", "--json"]).json();
    assert_eq!(object["surface"]["file"], "once/surface.parquet");
    assert_eq!(object["section"], "surface");
    assert!(object["keys"]["surface.rq"].is_object(), "{object}");
}

/// `schema` searches names and texts for any other word, without regard to case.
#[test]
fn a_word_is_searched_for() {
    let bench = Bench::new();
    for word in ["preload", "Preload", "bolt preload"] {
        let said = bench.done(&["schema", word]).stdout();
        assert!(said.contains("    contact.normal_load "), "{said}");
    }
    let said = bench.done(&["schema", "approach of the bodies"]).stdout();
    for part in ["    contact.approach ", "    reference.approach "] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let object = bench.done(&["schema", "preload", "--json"]).json();
    assert!(
        object["keys"]["contact.normal_load"].is_object(),
        "{object}"
    );
    let former = bench.fretwear(&["schema", "dynamics.method"]);
    assert_eq!(former.code(), 2);
    let nothing = bench.fretwear(&["schema", "contact.nomal_load"]);
    assert_eq!(nothing.code(), 2);
    let said = nothing.stderr();
    assert!(said.contains("did you mean contact.normal_load?"), "{said}");
}

/// Runs store every table in the file that its schema gives.
#[test]
fn tables_are_where_their_schemas_say() {
    let bench = Bench::new();
    let fields = "output.cycle_fields=true";
    bench.done(&["run", "small.toml", "--run", "a", "--set", fields]);
    bench.done(&[
        "run",
        "resonator.toml",
        "--run",
        "b",
        "--set",
        "contact.stiffness=sliders",
        "--set",
        "wear.cycles=1",
    ]);
    let mut found = BTreeSet::new();
    for run in ["a", "b"] {
        let object = bench.done(&["schema", "--json"]).json();
        for table in TableName::ALL {
            let file = object[table.as_str()]["file"].as_str().expect("a path");
            if bench.path(run).join(file.replace("=K", "=0")).is_file() {
                found.insert(table);
            }
        }
    }
    let expected = TableName::ALL
        .into_iter()
        .filter(|table| table.schema().place != TableLocation::Beside)
        // Only a structure with a damping matrix and a run with a twin grid have these tables.
        .filter(|table| !matches!(table, TableName::StructureDamping | TableName::GridTwin));
    assert!(expected.eq(found));
    // A run without wear has no tables for wear.
    let end = SMALL.find("[wear]").expect("a section");
    bench.write("once.toml", &SMALL[..end]);
    bench.done(&["run", "once.toml", "--run", "c"]);
    for name in ["wear_field", "wear_step", "model_update", "frf"] {
        let file = format!("c/iterations/wear_iteration=0/{name}.parquet");
        assert!(!bench.path(&file).exists(), "{name}");
    }
}

#[test]
fn a_plan_in_words() {
    let bench = Bench::new();
    let said = bench.done(&["plan", "small.toml"]).stdout();
    for part in [
        "Small\n",
        "cells: 572 of 572",
        "shear: along x and y",
        "expected cost",
        "memory",
        "time",
    ] {
        assert!(said.contains(part), "no {part:?} in {said}");
    }
}

/// A pipe whose reader closes early, such as `head`, does not crash the program.
#[test]
fn a_closed_pipe() {
    let bench = Bench::new();
    let mut child = bench.command(&["schema"]).spawn().expect("started");
    drop(child.stdout.take());
    let mut said = String::new();
    use std::io::Read;
    let mut stderr = child.stderr.take().expect("piped");
    stderr.read_to_string(&mut said).expect("text");
    child.wait().expect("a child");
    assert!(!said.contains("panicked"), "{said}");
}
