//! A stage sees only the parts of the recipe that it declares, and its key contains exactly these parts.

use fretwear::recipe::{Part, Recipe};
use fretwear::scene::{Plan, Scene, load};
use fretwear::stages::{STAGES, graph, is_in, stages_of};
use fretwear::tables::TableName;
use serde_json::{Value, json};
use std::path::Path;

use crate::support::{Bench, OSCILLATOR, SLIDER};

fn recipe(scene: &Scene) -> Recipe {
    Plan::of(scene).expect("a plan").inputs.recipe
}

fn shipped(name: &str) -> Recipe {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("pipelines")
        .join(name);
    recipe(&load(&path, &[]).expect("a scene"))
}

/// Paths of all numbers, flags and texts of a value, except reasons.
fn leaves(value: &Value, at: &str, into: &mut Vec<String>) {
    match value {
        Value::Object(object) => {
            for (name, value) in object.iter().filter(|(name, _)| *name != "why") {
                leaves(value, &format!("{at}/{name}"), into);
            }
        }
        Value::Array(items) => {
            for (k, value) in items.iter().enumerate() {
                leaves(value, &format!("{at}/{k}"), into);
            }
        }
        Value::Null => (),
        _ => into.push(at.to_owned()),
    }
}

/// Another value of the same type.
fn changed(value: &Value) -> Value {
    match value {
        Value::Bool(flag) => json!(!flag),
        Value::Number(number) if number.is_f64() => {
            json!(1.5 * number.as_f64().expect("a number") + 0.125)
        }
        Value::Number(number) => json!(number.as_u64().expect("a count") + 1),
        Value::String(text) => json!(format!("{text} else")),
        other => other.clone(),
    }
}

/// Parts of a recipe that contain a path.
fn parts_of(path: &str) -> Vec<Part> {
    let of_joint = |name| path.starts_with(&format!("/joints/0/{name}"));
    match path {
        _ if path.starts_with("/structure") => vec![Part::Structure],
        _ if of_joint("surface") => vec![Part::Surface],
        _ if of_joint("contact") => vec![Part::Contact],
        _ if of_joint("cycle") => vec![Part::Cycle],
        _ if of_joint("elements") => vec![Part::Elements],
        _ if path.starts_with("/response") => vec![Part::Response],
        "/wear/cycles" | "/wear/volume" => vec![Part::Wear],
        _ if path.starts_with("/wear") => vec![Part::Wear, Part::WearLaw],
        _ if path.starts_with("/output/response_at") => vec![Part::ResponseAt],
        _ => Vec::new(),
    }
}

/// Changes each field of a recipe in turn. Exactly the stages that declare its part see the change, and exactly their keys change.
#[test]
fn a_changed_field_changes_the_keys_of_the_stages_that_read_it() {
    let bench = Bench::new();
    bench.write("slider.toml", format!("{OSCILLATOR}{SLIDER}"));
    let asked = ["output.response_at=[60_000]", "wear.volume=\"1 mm^3\""];
    let recipes = [
        recipe(&bench.scene("small.toml", &[])),
        recipe(&bench.scene("resonator.toml", &asked)),
        recipe(&bench.scene("slider.toml", &[])),
        shipped("measured_surface.toml"),
        shipped("hertz_fretting.toml"),
        shipped("lap_joint_plastic.toml"),
    ];
    let mut count = 0;
    for recipe in &recipes {
        let whole = serde_json::to_value(recipe).expect("a value");
        // The recipe does not contain the path of a surface file.
        let recipe = &serde_json::from_value::<Recipe>(whole.clone()).expect("a recipe");
        let mut paths = Vec::new();
        leaves(&whole, "", &mut paths);
        for path in paths {
            let mut other = whole.clone();
            let value = other.pointer_mut(&path).expect("a leaf");
            *value = changed(value);
            // The changed word may be invalid.
            let Ok(other) = serde_json::from_value::<Recipe>(other) else {
                continue;
            };
            count += 1;
            let parts = parts_of(&path);
            for stage in stages_of(recipe) {
                let reads = parts.iter().any(|part| stage.recipe.contains(part));
                let at = format!("{path} and {}", stage.stage);
                let sees = recipe.only(stage.recipe) != other.only(stage.recipe);
                assert_eq!(sees, reads, "{at}: its part of the recipe");
                let keys = [recipe, &other].map(|of| of.parameters(stage.recipe));
                assert_eq!(keys[0] != keys[1], reads, "{at}: its key");
            }
        }
    }
    assert!(count > 350, "{count} fields");
}

/// Each table that a stage reads is written by an earlier stage of the iteration, or by any stage for the previous iteration.
#[test]
fn what_is_read_is_written() {
    for (at, stage) in STAGES.iter().enumerate() {
        for table in stage.reads {
            let before = STAGES[..at].iter();
            let written = before
                .flat_map(|s| s.writes)
                .any(|written| written == table);
            assert!(
                written,
                "{} reads {table}, which no stage writes",
                stage.stage
            );
        }
        for table in stage.before {
            let written = STAGES
                .iter()
                .flat_map(|s| s.writes)
                .any(|written| written == table);
            assert!(
                written,
                "{} reads {table}, which no stage writes",
                stage.stage
            );
        }
    }
    // A stage writes each table of a run.
    let beside = [
        TableName::Timing,
        TableName::Backbone,
        TableName::Trade,
        TableName::Claims,
        TableName::CampaignFigure,
        TableName::CampaignBand,
        TableName::CampaignSensitivity,
    ];
    for table in TableName::ALL.into_iter().filter(|t| !beside.contains(t)) {
        let written = STAGES.iter().any(|stage| stage.writes.contains(&table));
        assert!(written, "no stage writes {table}");
    }
}

#[test]
fn the_graph_has_all_stages_and_tables_of_a_scene() {
    let bench = Bench::new();
    bench.write("oscillator.toml", OSCILLATOR);
    for file in ["small.toml", "resonator.toml", "oscillator.toml"] {
        let recipe = recipe(&bench.scene(file, &[]));
        let did = bench.done(&["plan", file, "--graph"]);
        let text = did.stdout();
        assert_eq!(text, graph(&recipe));
        assert!(text.starts_with("flowchart TB\n"));
        for stage in STAGES {
            let node = format!("    {0}[\"<b>{0}</b>", stage.stage);
            assert_eq!(text.contains(&node), stage.is_in(&recipe), "{file}: {node}");
            for table in stage.reads {
                if stage.is_in(&recipe) && is_in(&recipe, *table) {
                    assert!(text.contains(table.as_str()), "{file}: {table}");
                }
            }
        }
    }
}
