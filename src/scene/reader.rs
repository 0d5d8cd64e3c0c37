//! Access to the tree of a scene by its declared keys. Records the values that were read.

use std::path::PathBuf;

use serde_json::Value as Json;
use toml::Value as Toml;

use super::Preset;
use super::document::{Content, Node};
use super::error::{Problem, SceneError};
use super::faults::Faults;
use super::keys::{
    self, Choice, EvenInteger, GivenValue, Key, ListOrPath, Point, Tables, Value, join,
    parse_set_value,
};
use super::record::Record;

type Result<T> = std::result::Result<T, SceneError>;

/// Name of a key or section.
pub(super) trait Named {
    fn name(&self) -> &str;
}

impl Named for &str {
    fn name(&self) -> &str {
        self
    }
}

impl<V: ?Sized> Named for &Key<V> {
    fn name(&self) -> &str {
        self.name
    }
}

/// Reads the values of a tree, records them by their keys, and reports their faults.
pub(super) struct Reader<'a> {
    pub root: &'a Node,
    /// The values that were read.
    pub record: Record,
    /// Name of a list and number of a table in the list, for error messages. `None` if the tree contains the whole
    /// list.
    item: Option<(&'static str, usize)>,
}

impl<'a> Reader<'a> {
    pub fn new(root: &'a Node) -> Self {
        Reader {
            root,
            record: Record::default(),
            item: None,
        }
    }

    /// Creates a reader for one table of a list. The tree contains that table in place of the list.
    pub fn of_item(root: &'a Node, list: &'static str, at: usize) -> Self {
        Reader {
            item: Some((list, at)),
            ..Reader::new(root)
        }
    }

    /// Returns the name of a key in error messages.
    fn display_name(&self, key: &str) -> String {
        match self
            .item
            .map(|(list, at)| (list, at, key.strip_prefix(list)))
        {
            Some((list, at, Some(rest))) => format!("{list}[{at}]{rest}"),
            _ => key.to_owned(),
        }
    }

    pub fn node(&self, key: impl Named) -> Option<&'a Node> {
        self.root.get(key.name())
    }

    pub fn has(&self, key: impl Named) -> bool {
        self.node(key).is_some()
    }

    /// Returns the given value of a key, or the whole tree if the key is not given.
    fn given(&self, key: impl Named) -> GivenValue<'a> {
        GivenValue {
            key: self.display_name(key.name()),
            node: self.root.get(key.name()).unwrap_or(self.root),
        }
    }

    /// Returns the value of a key if it is given, without recording it.
    pub fn peek<V: Value>(&self, key: &Key<V>) -> Result<Option<V::Read>> {
        self.has(key)
            .then(|| key.value.read(&self.given(key)))
            .transpose()
    }

    /// Records the value of a key, and returns it.
    pub fn note<V: Value>(&self, key: &Key<V>, value: V::Read) -> V::Read {
        self.record.note(key.name, key.value.recorded(&value));
        value
    }

    /// Returns and records the value of a key, if it is given.
    pub fn get<V: Value>(&self, key: &Key<V>) -> Result<Option<V::Read>> {
        Ok(self.peek(key)?.map(|value| self.note(key, value)))
    }

    /// Returns the value of a key, else `chosen`, else `None`. All three are recorded.
    pub fn optional<V: Value>(
        &self,
        key: &Key<V>,
        chosen: Option<V::Read>,
    ) -> Result<Option<V::Read>> {
        let value = self.get(key)?;
        let value = value.or_else(|| chosen.map(|value| self.note(key, value)));
        if value.is_none() {
            self.record.note(key.name, Json::Null);
        }
        Ok(value)
    }

    /// Returns and records the value of a required key.
    pub fn required<V: Value>(&self, key: &Key<V>) -> Result<V::Read> {
        Ok(self.note(key, self.required_unrecorded(key)?))
    }

    /// Returns the value of a required key without recording it.
    pub fn required_unrecorded<V: Value>(&self, key: &Key<V>) -> Result<V::Read> {
        self.peek(key)?.ok_or_else(|| self.missing(key, ""))
    }

    /// Returns and records the value of a key, or its default.
    pub fn value<V: Value>(&self, key: &Key<V>) -> Result<V::Read> {
        self.value_or(key, None, Preset::Balanced)
    }

    /// Returns and records the value of a key, else `chosen`, else its default under a preset.
    pub fn value_or<V: Value>(
        &self,
        key: &Key<V>,
        chosen: Option<V::Read>,
        preset: Preset,
    ) -> Result<V::Read> {
        let value = match self.peek(key)?.or(chosen) {
            Some(value) => value,
            None => self.default(key, preset)?,
        };
        Ok(self.note(key, value))
    }

    /// Returns the default of a key under a preset, if it has one, whether or not the key is given. Does not record it.
    pub fn default_of<V: Value>(&self, key: &Key<V>, preset: Preset) -> Result<Option<V::Read>> {
        let Some(text) = key.default.of(preset) else {
            return Ok(None);
        };
        let node = Node::value(&self.root.place, parse_set_value(text));
        let given = GivenValue {
            key: self.display_name(key.name),
            node: &node,
        };
        key.value.read(&given).map(Some)
    }

    /// Returns the default of a key under a preset, whether or not the key is given. Does not record it. A missing
    /// default is an error.
    pub fn default<V: Value>(&self, key: &Key<V>, preset: Preset) -> Result<V::Read> {
        self.default_of(key, preset)?
            .ok_or_else(|| self.missing(key, ""))
    }

    /// Returns the numbers of a key whose value is a list of numbers or a path. Returns `None` if the scene does not
    /// give the key. Does not record the numbers.
    pub fn list(&self, key: &Key<ListOrPath<3>>) -> Result<Option<[f64; 3]>> {
        self.has(key)
            .then(|| key.value.0.read(&self.given(key)))
            .transpose()
    }

    /// Returns the path of a key whose value is a path or a list of numbers. Returns `None` if the scene does not give
    /// the key.
    pub fn path(&self, key: &Key<ListOrPath<3>>) -> Result<Option<PathBuf>> {
        self.has(key)
            .then(|| key.value.1.read(&self.given(key)))
            .transpose()
    }

    /// Returns the tables of a key whose value is a list of tables or a single table. The inner `Option` is `None` for
    /// a single table. The outer `Option` is `None` if the scene does not give the key.
    pub fn tables(&self, key: &Key<Tables>) -> Result<Option<Option<Vec<Node>>>> {
        self.has(key)
            .then(|| key.value.list(&self.given(key)))
            .transpose()
    }

    /// Returns one of the `allowed` points, or any point if `allowed` is empty, if the key is given. Does not record
    /// it.
    pub fn point(&self, key: &Key<Point>, allowed: &[&'static str]) -> Result<Option<String>> {
        self.has(key)
            .then(|| key.value.among(&self.given(key), allowed))
            .transpose()
    }

    /// Returns an even number of at least `least`, if the key is given. `reason` explains the bound in the error
    /// message. Does not record it.
    pub fn even_from(
        &self,
        key: &Key<EvenInteger>,
        least: u64,
        reason: &str,
    ) -> Result<Option<usize>> {
        self.has(key)
            .then(|| key.value.read_from(&self.given(key), least, reason))
            .transpose()
    }

    /// Creates the error for a missing required key. `or` names an alternative.
    pub fn missing<V: Value>(&self, key: &Key<V>, or: &str) -> SceneError {
        self.missing_line(key, key.line() + or)
    }

    /// Creates the error for a missing required key, with an example line.
    pub fn missing_line(&self, key: impl Named, example: impl Into<String>) -> SceneError {
        let key = self.display_name(key.name());
        let problem = Problem::Missing {
            section: keys::section_of(&key).to_owned(),
            example: example.into(),
            key,
        };
        SceneError::new(&self.root.place, problem)
    }

    /// Creates the error for a missing required section, with example lines.
    pub fn missing_section(
        &self,
        section: &'static str,
        purpose: &'static str,
        lines: &str,
    ) -> SceneError {
        let problem = Problem::MissingSection {
            section,
            purpose,
            example: format!("[{section}]\n{lines}"),
        };
        SceneError::new(&self.root.place, problem)
    }

    /// Creates the error for a section that contradicts another one.
    pub fn misplaced(&self, section: &'static str, reason: impl Into<String>) -> SceneError {
        let reason = reason.into();
        self.given(section)
            .fault(|_| Problem::Misplaced { section, reason })
    }

    /// Creates the error for a key that contradicts another one.
    pub fn conflict(&self, key: impl Named, reason: impl Into<String>) -> SceneError {
        let given = self.given(key);
        let (value, reason) = (given.node.shown(), reason.into());
        given.fault(|key| Problem::Conflict { key, value, reason })
    }

    /// Creates the error for a value outside its range.
    pub fn out_of_range(&self, key: impl Named, expected: impl Into<String>) -> SceneError {
        self.given(key).out_of_range(expected)
    }

    /// Returns the kind of a section, and rejects keys of its other kinds. The kind must be given.
    pub fn kind(&self, key: &Key<Choice<&'static str>>) -> Result<&'static str> {
        let kind = self.required_unrecorded(key)?;
        let section = keys::section_of(key.name);
        let own = keys::keys_of_kind(section, kind);
        let mut faults = Faults::default();
        for name in keys::children(section) {
            let other_key = join(section, name);
            if name != key.last() && !own.contains(&name) && self.has(other_key.as_str()) {
                let given = self.given(other_key.as_str());
                faults.value_or_record::<()>(Err(given.fault(|other_key| Problem::OtherKind {
                    key: other_key,
                    value: given.node.shown(),
                    kind_key: key.name.to_owned(),
                    kind: kind.to_owned(),
                    keys: own.iter().map(|name| (*name).to_owned()).collect(),
                })));
            }
        }
        faults.into_result()?;
        Ok(kind)
    }

    /// Rejects the keys that only one form of a section has.
    pub fn refuse_form(&self, section: &str, form: &str, reason: &str) -> Result<()> {
        let mut faults = Faults::default();
        for name in keys::keys_of_kind(section, form) {
            let key = join(section, name);
            if self.has(key.as_str()) {
                faults.value_or_record::<()>(Err(self.conflict(key.as_str(), reason)));
            }
        }
        faults.into_result()
    }

    /// Rejects a value of a key if `words` contains the value. The program does not support the values in `words` yet.
    pub fn refuse_words(
        &self,
        key: impl Named,
        words: &[&str],
        instead: &'static str,
    ) -> Result<()> {
        let given = self.given(key.name());
        match given.value().and_then(Toml::as_str) {
            Some(word) if words.contains(&word) => Err(given.fault(|key| Problem::Unavailable {
                key: format!("{key} = {}", given.node.shown()),
                instead,
            })),
            _ => Ok(()),
        }
    }

    /// Rejects unknown keys and values that are invalid on their own, without regard to other keys.
    pub fn check_keys(&self) -> Result<()> {
        self.check_section("", self.root)
    }

    /// Rejects unknown keys within a section, and values that are invalid on their own.
    pub fn check_section(&self, section: &str, node: &Node) -> Result<()> {
        let Content::Section(entries) = &node.content else {
            let names = keys::children(section).join(", ");
            let expected = format!("a section, [{section}], with keys: {names}");
            let key = section.to_owned();
            return Err(GivenValue { key, node }.wrong_type(expected));
        };
        let mut faults = Faults::default();
        for (name, entry) in entries {
            if faults.is_full() {
                break;
            }
            let key = join(section, name);
            // TOML splits a dotted key into sections unless it is quoted.
            if name.contains('.') {
                let problem = Problem::UnknownKey {
                    nearest: keys::find(&key).map(|_| key),
                    value: entry.shown(),
                    siblings: owned(keys::children(section)),
                    key: format!("{name:?}"),
                };
                faults.value_or_record(Err::<(), _>(SceneError::new(&entry.place, problem)));
                continue;
            }
            let declared = keys::find(&key);
            let has_keys = !keys::children(&key).is_empty();
            let is_section = matches!(entry.content, Content::Section(_));
            faults.value_or_record(match declared {
                _ if has_keys && (is_section || declared.is_none()) => {
                    self.check_section(&key, entry)
                }
                Some(_) => keys::check(&GivenValue {
                    key: self.display_name(&key),
                    node: entry,
                }),
                None => Err(SceneError::new(&entry.place, unknown(section, key, entry))),
            });
        }
        faults.into_result()
    }
}

fn owned(names: Vec<&str>) -> Vec<String> {
    names.into_iter().map(str::to_owned).collect()
}

/// Creates the fault for an unknown key.
fn unknown(section: &str, key: String, entry: &Node) -> Problem {
    let value = entry.shown();
    match keys::replacement_of_former(&key) {
        Some(instead) => Problem::FormerKey {
            key,
            value,
            instead,
        },
        None => Problem::UnknownKey {
            nearest: keys::nearest_key(&key),
            value,
            siblings: owned(keys::children(section)),
            key,
        },
    }
}
