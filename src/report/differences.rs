//! In what the scenes of several runs differ.

use std::collections::{BTreeMap, BTreeSet};

use maud::html;
use serde_json::Value;

use super::RunTables;
use super::table::table;
use super::template::Section;
use super::text::NONE;
use crate::json::{differences, flatten, made};
use crate::scene::{FOLLOWING_KEYS, is_relevant};

/// The keys whose values are not the same in all runs, with the value of each run; `None` for a single run.
pub fn section(runs: &[RunTables], labels: &[&str]) -> Option<Section> {
    let (first, others) = match runs {
        [] | [_] => return None,
        [first, others @ ..] => (first, others),
    };
    let following = FOLLOWING_KEYS.map(str::to_owned);
    let keys: BTreeSet<String> = others
        .iter()
        .flat_map(|run| {
            made(
                differences(&first.record().scene, &run.record().scene),
                &following,
            )
        })
        .map(|change| change.key)
        .collect();
    let told: Vec<Told> = runs.iter().map(Told::of).collect();
    let rows = keys.into_iter().filter_map(|key| row(key, &told));
    let rows: Vec<Vec<String>> = rows.collect();
    let heads: Vec<&str> = std::iter::once("key")
        .chain(labels.iter().copied())
        .collect();
    Some(Section {
        id: "differences",
        title: "What differs between the runs".to_owned(),
        html: html! {
            @if rows.is_empty() {
                p { "The scenes of all runs are the same." } "\n"
            } @else {
                p { "Keys of the scenes whose values are not the same in all runs. A number without a unit is in SI." } "\n"
                (table(&heads, &rows, false))
            }
        },
    })
}

/// The values of a run's scene.
struct Told {
    /// The scene as it is hashed.
    canonical: Value,
    /// Its values, resolved, by dotted key.
    scene: BTreeMap<String, Value>,
    /// Those of the kept scene as they are written there, with units, in its order.
    written: Vec<(String, String)>,
}

impl Told {
    fn of(run: &RunTables) -> Self {
        Told {
            canonical: run.record().scene.clone(),
            scene: flatten(&run.record().scene),
            written: written(run.scene_toml()),
        }
    }

    /// The value of a key as it is written, of a table its entries in one line.
    fn as_written(&self, key: &str) -> Option<String> {
        let entries = self.written.iter().filter_map(|(name, text)| {
            let below = name.strip_prefix(key)?;
            match below.strip_prefix('.') {
                Some(below) => Some(format!("{below} {text}")),
                None => below.is_empty().then(|| text.clone()),
            }
        });
        // The law says what the coefficient means.
        let law = match key {
            "wear.coefficient" => self.as_written("wear.law"),
            _ => None,
        };
        let law = law.map(|law| format!("law {law}"));
        let entries: Vec<String> = entries.chain(law).collect();
        (!entries.is_empty()).then(|| entries.join(", "))
    }

    /// The value of a key that is not written, as a default.
    fn by_default(&self, key: &str) -> Option<String> {
        let value = self.scene.get(key).filter(|value| !value.is_null())?;
        if !is_relevant(&self.canonical, key) {
            return None;
        }
        Some(
            value
                .as_str()
                .map_or_else(|| value.to_string(), str::to_owned),
        )
    }
}

/// A key with its value in each run; `None` where no user made a difference: all have written the same, or it is the default of what
/// another run has none of.
fn row(key: String, told: &[Told]) -> Option<Vec<String>> {
    let written: Vec<Option<String>> = told.iter().map(|run| run.as_written(&key)).collect();
    let each: Vec<Option<String>> = told
        .iter()
        .zip(&written)
        .map(|(run, text)| text.clone().or_else(|| run.by_default(&key)))
        .collect();
    let is_same = written[0].is_some() && written.iter().all(|text| *text == written[0]);
    let is_of_one = written.iter().all(Option::is_none) && each.contains(&None);
    if is_same || is_of_one {
        return None;
    }
    let each = each
        .into_iter()
        .map(|text| text.unwrap_or_else(|| NONE.to_owned()));
    Some(std::iter::once(key).chain(each).collect())
}

/// The values of a kept scene as they are written there, with units, by dotted key: one a line, as the program keeps it. Of a line
/// that is written otherwise there is none; of a list of tables the entries of all.
fn written(scene: &str) -> Vec<(String, String)> {
    let mut section = String::new();
    let mut values = Vec::new();
    for line in scene.lines().map(str::trim) {
        if line.starts_with('[') && line.ends_with(']') {
            section = format!("{}.", line.trim_matches(['[', ']']));
        } else if let Some((key, value)) = line.split_once(" = ") {
            values.push((format!("{section}{key}"), value.replace('"', "")));
        }
    }
    values
}
