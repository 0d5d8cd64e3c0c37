//! Descriptions of the keys of a scene, for users, programs and editors.

use serde::Serialize;
use serde_json::{Map, Value, json};

use super::Preset;
use super::error::suggestion;
use super::keys::{self, AnyKey, Default, HasForm, Key, Value as _, join, parse_set_value};

/// Description of a key.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct KeyDescription {
    /// Dotted name, from the top of a scene.
    #[serde(skip)]
    pub key: &'static str,
    /// The meaning. The first sentence is a summary.
    pub meaning: String,
    /// The expected type of the value.
    #[serde(rename = "type")]
    pub kind: String,
    /// The default value.
    pub default: String,
    /// An example line that gives the key in the section of the key.
    pub example: String,
    /// The words to choose from, for a key with choices.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<Choice>,
    /// The kinds of the section that have the key. The list is empty if all kinds have the key.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub only: Vec<String>,
    /// The alternative keys, of which a scene gives only one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub instead: Vec<String>,
}

/// A word that a key accepts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Choice {
    /// The word.
    pub word: &'static str,
    /// Its meaning.
    pub meaning: &'static str,
}

impl KeyDescription {
    fn of(key: &'static AnyKey) -> KeyDescription {
        let form = key.value.value_form();
        let choice = |(word, meaning)| Choice { word, meaning };
        KeyDescription {
            key: key.name,
            meaning: key.doc(),
            kind: form.words,
            default: key.default.to_string(),
            example: key.line(),
            choices: form.choices.into_iter().map(choice).collect(),
            only: key.kinds.iter().map(|kind| only(key, kind)).collect(),
            instead: instead(key.name),
        }
    }

    /// The first sentence of the meaning.
    pub fn summary(&self) -> &str {
        let is_end = |(at, _): &(usize, &str)| {
            let next = self.meaning[at + 2..].chars().next();
            next.is_some_and(char::is_uppercase)
        };
        let end = self.meaning.match_indices(". ").find(is_end);
        let end = end.map_or(self.meaning.len(), |found| found.0);
        self.meaning[..end].trim_end_matches('.')
    }

    /// The default under a preset, written as after `--set`, if it does not depend on other keys.
    pub fn default_under(&self, preset: Preset) -> Option<&'static str> {
        keys::find(self.key)?.default.of(preset)
    }
}

/// Describes where a key of one kind of its section belongs.
fn only(key: &AnyKey, kind: &str) -> String {
    let section = keys::section_of(key.name);
    let mut forms = keys::FORMS.iter();
    match forms.find(|form| (form.0, form.1) == (section, kind)) {
        Some(form) => form.2.to_owned(),
        None => format!("{section}.kind = \"{kind}\""),
    }
}

/// Lists the alternatives to a key.
fn instead(key: &str) -> Vec<String> {
    let section = keys::section_of(key);
    let mut alternatives: Vec<String> = Vec::new();
    for (_, ways) in keys::ALTERNATIVES.iter().filter(|entry| entry.0 == section) {
        let is_own = |way: &&&[&str]| way.iter().any(|name| join(section, name) == key);
        if ways.iter().any(|way| is_own(&way)) {
            let others = ways.iter().filter(|way| !is_own(way));
            alternatives.extend(others.map(|way| join(section, way[0])));
        }
    }
    alternatives.sort_unstable();
    alternatives.dedup();
    alternatives
}

/// Description of a section.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SectionAbout {
    /// Name of the section; empty for the keys above all sections.
    pub section: String,
    /// Meaning of the section.
    pub meaning: String,
    /// Keys of the section, including the keys of tables in the section.
    pub keys: Vec<KeyDescription>,
}

/// Describes all sections of a scene with their keys.
pub fn sections() -> Vec<SectionAbout> {
    let inner = keys::children("")
        .into_iter()
        .filter(|name| is_section(name));
    [""].into_iter().chain(inner).map(section).collect()
}

fn is_section(name: &str) -> bool {
    !keys::children(name).is_empty()
}

fn section(name: &str) -> SectionAbout {
    let is_in = |key: &&AnyKey| match name {
        "" => !key.name.contains('.') && !is_section(key.name),
        _ => key.name == name || key.name.starts_with(&format!("{name}.")),
    };
    SectionAbout {
        section: name.to_owned(),
        meaning: meaning(name),
        keys: keys::structure_from_files()
            .filter(is_in)
            .map(KeyDescription::of)
            .collect(),
    }
}

/// Returns the meaning of a section. For a section that is itself a key, returns the meaning of the key.
fn meaning(section: &str) -> String {
    match (keys::about_section(section), keys::find(section)) {
        (None, Some(key)) => key.doc(),
        (about, _) => about.unwrap_or_default().to_owned(),
    }
}

/// Description of a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum About {
    /// The name is a key.
    Key(KeyDescription),
    /// The name is a section, or a key whose value may be a table.
    Section(SectionAbout),
}

/// Error for a name that is neither a key nor a section.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{name}: there is no such key{}", hint(.name, .nearest, .known))]
pub struct UnknownKey {
    /// The name.
    pub name: String,
    /// The most similar key.
    pub nearest: Option<String>,
    /// The known keys of the section that contains the unknown name.
    pub known: Vec<String>,
    /// True if former versions had the key.
    pub is_former: bool,
}

/// Suggests a replacement for an unknown key.
fn hint(name: &str, nearest: &Option<String>, known: &[String]) -> String {
    match keys::replacement_of_former(name) {
        Some(instead) => format!(" any more: {instead}"),
        None => suggestion(nearest, known),
    }
}

/// Describes a key or a section by its name.
///
/// # Errors
/// [`UnknownKey`] with the most similar key.
pub fn explain(name: &str) -> Result<About, UnknownKey> {
    if is_section(name) {
        return Ok(About::Section(section(name)));
    }
    match keys::structure_from_files().find(|key| key.name == name) {
        Some(key) => Ok(About::Key(KeyDescription::of(key))),
        None => Err(UnknownKey {
            name: name.to_owned(),
            nearest: keys::nearest_key(name),
            is_former: keys::replacement_of_former(name).is_some(),
            known: keys::children(keys::section_of(name))
                .into_iter()
                .map(str::to_owned)
                .collect(),
        }),
    }
}

/// Returns a JSON Schema for scene files. An editor checks each file alone. The schema requires no key, because the
/// `base` of a file may give a missing key.
pub fn json_schema() -> Value {
    let mut schema = table("");
    let base = &keys::joint::file::BASE;
    schema["properties"][base.name] = with_words(base, base.value.form().schema);
    schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    schema["title"] = json!("A scene of fretwear");
    schema
}

fn table(section: &str) -> Value {
    let properties: Map<String, Value> = keys::children(section)
        .into_iter()
        .map(|name| (name.to_owned(), property(&join(section, name))))
        .collect();
    let mut schema = json!({
        "type": "object",
        "description": meaning(section),
        "properties": properties,
        "additionalProperties": false,
    });
    let kinds = keys::kinds(section);
    if !kinds.is_empty() {
        let of_kind = |kind: &&str| {
            let mut names = keys::keys_of_kind(section, kind);
            names.push("kind");
            json!({
                "if": { "properties": { "kind": { "const": kind } }, "required": ["kind"] },
                "then": { "propertyNames": { "enum": names } },
            })
        };
        schema["allOf"] = kinds.iter().map(of_kind).collect();
    }
    schema
}

fn property(name: &str) -> Value {
    let Some(key) = keys::find(name) else {
        return table(name);
    };
    let mut own = key.value.value_form().schema;
    if !is_section(name) {
        return with_words(key, own);
    }
    if own["type"] == "array" {
        own["items"] = table(name);
    }
    with_words(key, json!({ "anyOf": [own, table(name)] }))
}

/// Adds the descriptions that an editor shows to a schema.
fn with_words(key: &Key<impl HasForm + ?Sized>, mut schema: Value) -> Value {
    let form = key.value.value_form();
    let json_of = |text| json!(parse_set_value(text));
    let mut description = key.doc();
    if form.choices.is_empty() {
        description += &format!(" Type: {}.", form.words);
    } else {
        let meanings: Vec<&str> = form.choices.iter().map(|choice| choice.1).collect();
        schema["x-taplo"] = json!({ "docs": { "enumValues": meanings } });
    }
    match key.default {
        Default::Is(value) => schema["default"] = json_of(value),
        _ => description += &format!(" Default: {}.", key.default),
    }
    schema["description"] = json!(description);
    schema["examples"] = json!([json_of(form.example)]);
    schema
}
