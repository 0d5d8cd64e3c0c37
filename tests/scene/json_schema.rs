//! Tests of the JSON Schema of scenes, which editors use for completion and checks.

use std::fs;
use std::path::{Path, PathBuf};

use fretwear::scene::explain::{json_schema, sections};
use regex::Regex;
use serde_json::{Value, json};

use super::{CASE, OSCILLATOR, ROUGH, SPRINGS, replaced};

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

#[test]
fn the_file_is_what_the_program_writes() {
    let path = folder("schemas/scene.schema.json");
    let text = fs::read_to_string(&path).expect("the schema");
    assert!(
        text == format!("{:#}\n", json_schema()),
        "update the file: fretwear schema scene --json-schema > schemas/scene.schema.json"
    );
}

/// Faults of a value by a schema. The function supports the keywords in the schema of scenes and fails for any other keyword.
fn faults(schema: &Value, value: &Value, at: &str) -> Vec<String> {
    let mut found = Vec::new();
    match schema {
        Value::Bool(true) => return found,
        Value::Bool(false) => return vec![format!("{at} must not be there")],
        _ => {}
    }
    let keywords = schema.as_object().expect("a schema");
    let list = |rule: &Value| {
        rule.as_array()
            .cloned()
            .unwrap_or_else(|| vec![rule.clone()])
    };
    let number = |rule: &Value| rule.as_f64().expect("a number");
    let holds = |schema: &Value| faults(schema, value, at).is_empty();
    for (keyword, rule) in keywords {
        let (items, text) = (value.as_array(), value.as_str());
        let size = items.map_or(0, Vec::len) as f64;
        let holds = match keyword.as_str() {
            "$schema" | "title" | "description" | "default" | "examples" | "x-taplo" | "then" => {
                true
            }
            "type" => list(rule)
                .iter()
                .any(|kind| is_of(value, kind.as_str().expect("a type"))),
            "enum" => list(rule).contains(value),
            "const" => rule == value,
            "pattern" => {
                let pattern = Regex::new(rule.as_str().expect("a pattern")).expect("a pattern");
                text.is_none_or(|text| pattern.is_match(text))
            }
            "minimum" => value.as_f64().is_none_or(|x| x >= number(rule)),
            "maximum" => value.as_f64().is_none_or(|x| x <= number(rule)),
            "exclusiveMinimum" => value.as_f64().is_none_or(|x| x > number(rule)),
            "exclusiveMaximum" => value.as_f64().is_none_or(|x| x < number(rule)),
            "multipleOf" => value.as_f64().is_none_or(|x| x % number(rule) == 0.0),
            "minItems" => items.is_none() || size >= number(rule),
            "maxItems" => items.is_none() || size <= number(rule),
            "uniqueItems" => items.is_none_or(|items| {
                items
                    .iter()
                    .enumerate()
                    .all(|(k, item)| !items[..k].contains(item))
            }),
            "anyOf" => list(rule).iter().any(holds),
            "items" => {
                for item in items.into_iter().flatten() {
                    found.extend(faults(rule, item, at));
                }
                true
            }
            "allOf" => {
                for part in list(rule) {
                    found.extend(faults(&part, value, at));
                }
                true
            }
            "if" => {
                if holds(rule) {
                    found.extend(faults(&keywords["then"], value, at));
                }
                true
            }
            "required" => value.as_object().is_none_or(|object| {
                list(rule)
                    .iter()
                    .all(|name| object.contains_key(name.as_str().expect("a name")))
            }),
            "properties" => {
                for (name, inner) in value.as_object().into_iter().flatten() {
                    if let Some(schema) = rule.get(name) {
                        found.extend(faults(schema, inner, &format!("{at}.{name}")));
                    }
                }
                true
            }
            "additionalProperties" => {
                assert_eq!(rule, &json!(false));
                let known = &keywords["properties"];
                value
                    .as_object()
                    .is_none_or(|object| object.keys().all(|name| known.get(name).is_some()))
            }
            "propertyNames" => value.as_object().is_none_or(|object| {
                object
                    .keys()
                    .all(|name| faults(rule, &json!(name), at).is_empty())
            }),
            other => panic!("unsupported keyword {other}"),
        };
        if !holds {
            found.push(format!("{at}: {value} against {keyword}"));
        }
    }
    found
}

fn is_of(value: &Value, kind: &str) -> bool {
    match kind {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "boolean" => value.is_boolean(),
        "integer" => value.as_f64().is_some_and(|x| x.fract() == 0.0),
        other => panic!("{other} is not a type"),
    }
}

fn faults_of(text: &str) -> Vec<String> {
    let scene: toml::Table = text.parse().expect("TOML");
    faults(&json_schema(), &json!(scene), "scene")
}

#[test]
fn every_shipped_scene_is_valid_by_itself() {
    let mut count = 0;
    for entry in fs::read_dir(folder("pipelines")).expect("the pipelines") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|end| end == "toml") {
            let text = fs::read_to_string(&path).expect("a scene");
            assert_eq!(faults_of(&text), [""; 0], "{}", path.display());
            count += 1;
        }
    }
    assert!(count >= 16, "{count} scenes");
    for text in [CASE, ROUGH, SPRINGS, OSCILLATOR] {
        assert_eq!(faults_of(text), [""; 0], "{text}");
    }
}

#[test]
fn every_example_and_every_default_is_valid() {
    for key in sections().into_iter().flat_map(|section| section.keys) {
        let section = key.key.rsplit_once('.').map_or("", |split| split.0);
        let head = if section.is_empty() {
            String::new()
        } else {
            format!("[{section}]\n")
        };
        let text = format!("{head}{}\n", key.example);
        assert_eq!(faults_of(&text), [""; 0], "{text}");
    }
}

#[test]
fn what_a_scene_may_say_in_other_words_is_valid() {
    for (from, to) in [
        ("grid = [64, 40]", "grid = [64.0, 4e1]"),
        ("poisson_ratio = 0.3", "poisson_ratio = \"30 %\""),
        ("friction_coefficient = 0.6", "friction_coefficient = 1"),
        (
            "correlation_length = [\"0.5 mm\", \"0.4 mm\"]",
            "correlation_length = \"0.5 mm\"",
        ),
        ("rq = \"5 um\"", "rq = \"5µm\""),
        ("rq = \"5 um\"", "rq = \" +.5e1 um \""),
        ("cycles = 10_000_000", "cycles = 1e7"),
        ("amplitude = [\"5 um\", \"0 um\"]", "rotation = \"-90 °\""),
        ("keep = \"all\"", "keep = { every = 2 }"),
        ("title = \"Case\"", "base = \"other.toml\""),
    ] {
        assert_eq!(faults_of(&replaced(CASE, from, to)), [""; 0], "{to}");
    }
    let list = "force = [{ amplitude = \"1 N\" }, { amplitude = \"2 N\", harmonic = 2 }]";
    let text = replaced(OSCILLATOR, "force = { amplitude = \"100 N\" }", list);
    assert_eq!(faults_of(&text), [""; 0]);
    // A scene may omit the keys that its base contains.
    for text in [
        "",
        "base = \"other.toml\"\n[surface]\nrq = \"1 um\"\n",
        "update = \"never\"\n",
    ] {
        assert_eq!(faults_of(text), [""; 0], "{text}");
    }
}

#[test]
fn wrong_scenes_are_not_valid() {
    let wrong: &[(&str, &str, &str)] = &[
        // Unknown keys
        (CASE, "title =", "titel ="),
        (CASE, "rq =", "rg ="),
        (CASE, "hole = { diameter", "hole = { radius"),
        (CASE, "[output]", "[outputs]"),
        (CASE, "keep = \"all\"", "keep = { each = 2 }"),
        (
            OSCILLATOR,
            "{ amplitude = \"100 N\" }",
            "{ amplitud = \"100 N\" }",
        ),
        (
            OSCILLATOR,
            "{ amplitude = \"100 N\" }",
            "[{ amplitud = \"100 N\" }]",
        ),
        // Wrong types
        (CASE, "title = \"Case\"", "title = 5"),
        (CASE, "rq = \"5 um\"", "rq = 5"),
        (CASE, "rq = \"5 um\"", "rq = \"5\""),
        (CASE, "size = [\"40 mm\", \"30 mm\"]", "size = \"40 mm\""),
        (
            CASE,
            "[\"40 mm\", \"30 mm\"]",
            "[\"40 mm\", \"30 mm\", \"1 mm\"]",
        ),
        (CASE, "grid = [64, 40]", "grid = [64, 40.5]"),
        (CASE, "seed = 3", "seed = \"three\""),
        (CASE, "hole = { diameter = \"11 mm\" }", "hole = \"11 mm\""),
        (CASE, "keep = \"all\"", "cycle_fields = \"yes\""),
        (
            ROUGH,
            "[update]\nstiffness_change = 0.10",
            "[[update]]\nstiffness_change = 0.10",
        ),
        // Values out of range
        (CASE, "grid = [64, 40]", "grid = [64, 0]"),
        (CASE, "poisson_ratio = 0.3", "poisson_ratio = 0.6"),
        (
            CASE,
            "friction_coefficient = 0.6",
            "friction_coefficient = -0.1",
        ),
        (
            ROUGH,
            "[update]",
            "[fidelity]\nsteps_per_cycle = 33\n[update]",
        ),
        (ROUGH, "frequency", "harmonics = [0, 1, 1]\nfrequency"),
        // Unknown words
        (CASE, "kind = \"gaussian\"", "kind = \"gausian\""),
        (CASE, "keep = \"all\"", "keep = \"al\""),
        (
            CASE,
            "friction_coefficient = 0.6",
            "boundary = \"Periodic\"",
        ),
        (ROUGH, "direction = \"x\"", "direction = \"X\""),
        // Keys of another kind
        (CASE, "seed = 3", "radius = \"3 mm\""),
        (CASE, "kind = \"gaussian\"", "kind = \"flat\""),
        (
            ROUGH,
            "kind = \"resonator\"",
            "kind = \"resonator\"\nmass = \"1 kg\"",
        ),
        (OSCILLATOR, "mass = \"1 kg\"", "depth = \"60 mm\""),
    ];
    for (case, from, to) in wrong {
        let text = replaced(case, from, to);
        assert!(!faults_of(&text).is_empty(), "{from} => {to}");
    }
}
