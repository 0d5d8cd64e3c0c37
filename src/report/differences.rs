//! Differences between the scenes of several runs.

use std::collections::{BTreeMap, BTreeSet};

use maud::html;
use serde_json::Value;

use super::RunTables;
use super::table::table;
use super::template::Section;
use super::text::NONE;
use crate::json::{differences, flatten, user_changes};
use crate::scene::{FOLLOWING_KEYS, is_relevant};

/// Lists the keys whose values differ between the runs, with the value of each run. Returns `None` for a single run.
pub fn section(runs: &[RunTables], labels: &[&str]) -> Option<Section> {
    let (first, others) = match runs {
        [] | [_] => return None,
        [first, others @ ..] => (first, others),
    };
    let following = FOLLOWING_KEYS.map(str::to_owned);
    let keys: BTreeSet<String> = others
        .iter()
        .flat_map(|run| {
            user_changes(
                differences(&first.record().scene, &run.record().scene),
                &following,
            )
        })
        .map(|change| change.key)
        .collect();
    let scenes: Vec<SceneValues> = runs.iter().map(SceneValues::new).collect();
    let rows = keys.into_iter().filter_map(|key| row(key, &scenes));
    let rows: Vec<Vec<String>> = rows.collect();
    let heads: Vec<&str> = std::iter::once("key")
        .chain(labels.iter().copied())
        .collect();
    Some(Section {
        id: "differences",
        title: "Differences between the runs".to_owned(),
        html: html! {
            @if rows.is_empty() {
                p { "The scenes of all runs are the same." } "\n"
            } @else {
                p { "Keys of the scenes whose values differ between the runs. A number without a unit is in SI." } "\n"
                (table(&heads, &rows, false))
            }
        },
    })
}

/// Values of the scene of a run.
struct SceneValues {
    /// The canonical scene, which the scene hash is computed from.
    canonical: Value,
    /// Resolved values by dotted key.
    scene: BTreeMap<String, Value>,
    /// Values of the stored scene.toml as text with units, by dotted key, in the order of the file.
    written: Vec<(String, String)>,
}

impl SceneValues {
    fn new(run: &RunTables) -> Self {
        SceneValues {
            canonical: run.record().scene.clone(),
            scene: flatten(&run.record().scene),
            written: scene_entries(run.scene_toml()),
        }
    }

    /// Returns the text of a key in scene.toml. The entries of a table are joined in one line.
    fn scene_text(&self, key: &str) -> Option<String> {
        let entries = self.written.iter().filter_map(|(name, text)| {
            let below = name.strip_prefix(key)?;
            match below.strip_prefix('.') {
                Some(below) => Some(format!("{below} {text}")),
                None => below.is_empty().then(|| text.clone()),
            }
        });
        // The wear law determines the meaning of the coefficient.
        let law = match key {
            "wear.coefficient" => self.scene_text("wear.law"),
            _ => None,
        };
        let law = law.map(|law| format!("law {law}"));
        let entries: Vec<String> = entries.chain(law).collect();
        (!entries.is_empty()).then(|| entries.join(", "))
    }

    /// Returns the resolved value of a key that scene.toml does not contain, if the key is relevant to the scene.
    fn default_text(&self, key: &str) -> Option<String> {
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

/// Returns the key `key` and the value of the key in each run.
///
/// Returns `None` if all scenes contain the same text for the key. The function returns `None` as well if no scene
/// contains the key and a run has no value for the key.
fn row(key: String, scenes: &[SceneValues]) -> Option<Vec<String>> {
    let written: Vec<Option<String>> = scenes.iter().map(|run| run.scene_text(&key)).collect();
    let each: Vec<Option<String>> = scenes
        .iter()
        .zip(&written)
        .map(|(run, text)| text.clone().or_else(|| run.default_text(&key)))
        .collect();
    let is_same_text = written[0].is_some() && written.iter().all(|text| *text == written[0]);
    let is_default_of_some = written.iter().all(Option::is_none) && each.contains(&None);
    if is_same_text || is_default_of_some {
        return None;
    }
    let each = each
        .into_iter()
        .map(|text| text.unwrap_or_else(|| NONE.to_owned()));
    Some(std::iter::once(key).chain(each).collect())
}

/// Returns the values of a stored scene.toml as text with units, by dotted key.
///
/// The program stores one `key = value` per line. Other lines are skipped. A list of tables yields the entries of all
/// its tables.
fn scene_entries(scene: &str) -> Vec<(String, String)> {
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
