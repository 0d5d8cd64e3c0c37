//! In what the scenes of several runs differ.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::RunTables;
use super::html::{NONE, Section, table};
use crate::json::{differences, flatten, made};
use crate::scene::FOLLOWING_KEYS;

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
    let values: Vec<(BTreeMap<String, Value>, BTreeMap<String, String>)> = runs
        .iter()
        .map(|run| (flatten(&run.record().scene), written(run.scene_toml())))
        .collect();
    let rows: Vec<Vec<String>> = keys
        .into_iter()
        .map(|key| {
            let each = values.iter().map(|(scene, written)| {
                let value = scene.get(&key).filter(|value| !value.is_null());
                let text = written.get(&key).cloned();
                value.map_or(NONE.to_owned(), |value| {
                    text.unwrap_or_else(|| plain(value))
                })
            });
            let each: Vec<String> = each.collect();
            std::iter::once(key).chain(each).collect()
        })
        .collect();
    let html = match rows.is_empty() {
        true => "<p>The scenes of all runs are the same.</p>\n".to_owned(),
        false => {
            let heads = std::iter::once("key").chain(labels.iter().copied());
            let heads: Vec<String> = heads.map(str::to_owned).collect();
            let note = "<p>Keys of the scenes whose values are not the same in all runs. A number without a unit is in SI.</p>\n";
            format!("{note}{}", table(&heads, &rows, false))
        }
    };
    Some(Section {
        id: "differences",
        title: "What differs between the runs".to_owned(),
        html,
    })
}

/// A value that the kept scene does not have, as that of a default.
fn plain(value: &Value) -> String {
    value
        .as_str()
        .map_or_else(|| value.to_string(), str::to_owned)
}

/// The values of a kept scene as they are written there, with units, by dotted key: one a line, as the program keeps it. Of a line
/// that is written otherwise there is none.
fn written(scene: &str) -> BTreeMap<String, String> {
    let mut section = String::new();
    let mut values = BTreeMap::new();
    for line in scene.lines().map(str::trim) {
        if let Some(name) = line
            .strip_prefix('[')
            .and_then(|rest| rest.strip_suffix(']'))
        {
            section = match name.is_empty() || name.starts_with('[') {
                true => String::new(),
                false => format!("{name}."),
            };
        } else if let Some((key, value)) = line.split_once(" = ") {
            values.insert(format!("{section}{key}"), value.replace('"', ""));
        }
    }
    values
}
