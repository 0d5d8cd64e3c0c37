//! What people, programs and editors are told of the keys of a scene.

use serde::Serialize;
use serde_json::{Map, Value, json};

use super::Preset;
use super::error::suggestion;
use super::keys::{self, AnyKey, Default, HasForm, Key, Value as _, join, meant};

/// A key of a scene.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct KeyAbout {
    /// Dotted, from the top of a scene.
    #[serde(skip)]
    pub key: &'static str,
    /// What it means. The first sentence alone says it in short.
    pub meaning: String,
    /// What its value must be.
    #[serde(rename = "type")]
    pub kind: String,
    /// What it is where a scene does not give it.
    pub default: String,
    /// A line of its section that would do.
    pub example: String,
    /// The words to choose from.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<Choice>,
    /// Where it belongs, if not to all of its section.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub only: Vec<String>,
    /// The keys that take its place: a scene has one of them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub instead: Vec<String>,
}

/// A word that a key may be.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Choice {
    /// The word.
    pub word: &'static str,
    /// What it means.
    pub meaning: &'static str,
}

impl KeyAbout {
    fn of(key: &'static AnyKey) -> KeyAbout {
        let form = key.value.value_form();
        let choice = |(word, meaning)| Choice { word, meaning };
        KeyAbout {
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

    /// The first sentence of its meaning.
    pub fn summary(&self) -> &str {
        let is_end = |(at, _): &(usize, &str)| {
            let next = self.meaning[at + 2..].chars().next();
            next.is_some_and(char::is_uppercase)
        };
        let end = self.meaning.match_indices(". ").find(is_end);
        let end = end.map_or(self.meaning.len(), |found| found.0);
        self.meaning[..end].trim_end_matches('.')
    }

    /// Its default under a preset, as after `--set`, where that does not depend on other keys.
    pub fn default_under(&self, preset: Preset) -> Option<&'static str> {
        keys::find(self.key)?.default.of(preset)
    }
}

/// Where a key of one kind of its section belongs.
fn only(key: &AnyKey, kind: &str) -> String {
    let section = keys::section_of(key.name);
    let mut forms = keys::FORMS.iter();
    match forms.find(|form| (form.0, form.1) == (section, kind)) {
        Some(form) => form.2.to_owned(),
        None => format!("{section}.kind = \"{kind}\""),
    }
}

/// The keys in whose place a key stands.
fn instead(key: &str) -> Vec<String> {
    let section = keys::section_of(key);
    let mut found: Vec<String> = Vec::new();
    for (_, ways) in keys::ALTERNATIVES.iter().filter(|entry| entry.0 == section) {
        let is_own = |way: &&&[&str]| way.iter().any(|name| join(section, name) == key);
        if ways.iter().any(|way| is_own(&way)) {
            let others = ways.iter().filter(|way| !is_own(way));
            found.extend(others.map(|way| join(section, way[0])));
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// A section of a scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SectionAbout {
    /// Its name; empty for what stands above all sections.
    pub section: String,
    /// What it says.
    pub meaning: String,
    /// Its keys, and those of the tables in it.
    pub keys: Vec<KeyAbout>,
}

/// The sections of a scene with all their keys.
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
        keys: keys::of_files().filter(is_in).map(KeyAbout::of).collect(),
    }
}

/// What a section says, also one that is a key.
fn meaning(section: &str) -> String {
    match (keys::about_section(section), keys::find(section)) {
        (None, Some(key)) => key.doc(),
        (about, _) => about.unwrap_or_default().to_owned(),
    }
}

/// What there is to say on a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum About {
    /// It is a key.
    Key(KeyAbout),
    /// It is a section, or a key that may be a table.
    Section(SectionAbout),
}

/// A name that no key and no section has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{name}: there is no such key{}", hint(.name, .nearest, .known))]
pub struct UnknownKey {
    /// The name.
    pub name: String,
    /// The key most like it.
    pub nearest: Option<String>,
    /// Those of its section.
    pub known: Vec<String>,
    /// Whether earlier scenes had the key.
    pub is_former: bool,
}

/// What a key that is none may have been.
fn hint(name: &str, nearest: &Option<String>, known: &[String]) -> String {
    match keys::replacement_of_former(name) {
        Some(instead) => format!(" any more: {instead}"),
        None => suggestion(nearest, known),
    }
}

/// What a key or a section is.
///
/// # Errors
/// [`UnknownKey`] with the nearest that there is.
pub fn explain(name: &str) -> Result<About, UnknownKey> {
    if is_section(name) {
        return Ok(About::Section(section(name)));
    }
    match keys::of_files().find(|key| key.name == name) {
        Some(key) => Ok(About::Key(KeyAbout::of(key))),
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

/// A JSON Schema of scene files, each by itself: what its `base` gives need not be there.
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

/// A schema with what an editor shows.
fn with_words(key: &Key<impl HasForm + ?Sized>, mut schema: Value) -> Value {
    let form = key.value.value_form();
    let json_of = |text| json!(meant(text));
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
