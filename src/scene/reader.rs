//! Access to the tree of a scene by its declared keys, and the record of what was read.

use std::path::PathBuf;

use serde_json::Value as Json;
use toml::Value as Toml;

use super::Preset;
use super::document::{Content, Node};
use super::error::{Problem, SceneError};
use super::faults::Faults;
use super::keys::{
    self, Choice, EvenInteger, GivenValue, Key, ListOrPath, Point, Tables, Value, join, meant,
};
use super::record::Record;

type Result<T> = std::result::Result<T, SceneError>;

/// A key, or a section, by its dotted name.
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

/// Reads the values of a tree, notes them by their keys, and says what is wrong with them.
pub(super) struct Reader<'a> {
    pub root: &'a Node,
    /// The values that it has handed out.
    pub record: Record,
    /// A list of tables of which the tree has one, and its number: errors say so.
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

    /// A reader of one of the tables of a list: the tree has it where the list would be.
    pub fn of_item(root: &'a Node, list: &'static str, at: usize) -> Self {
        Reader {
            item: Some((list, at)),
            ..Reader::new(root)
        }
    }

    /// How errors call a key.
    fn called(&self, key: &str) -> String {
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

    /// A key as it is given; as the whole tree where it is not.
    fn given(&self, key: impl Named) -> GivenValue<'a> {
        GivenValue {
            key: self.called(key.name()),
            node: self.root.get(key.name()).unwrap_or(self.root),
        }
    }

    /// The value of a key, if it is given. It is not noted.
    pub fn look<V: Value>(&self, key: &Key<V>) -> Result<Option<V::Read>> {
        self.has(key)
            .then(|| key.value.read(&self.given(key)))
            .transpose()
    }

    /// Notes the value of a key, and returns it.
    pub fn note<V: Value>(&self, key: &Key<V>, value: V::Read) -> V::Read {
        self.record.note(key.name, key.value.noted(&value));
        value
    }

    /// The value of a key, if it is given.
    pub fn get<V: Value>(&self, key: &Key<V>) -> Result<Option<V::Read>> {
        Ok(self.look(key)?.map(|value| self.note(key, value)))
    }

    /// The value of a key, else the one chosen for it, else none, which is noted too.
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

    /// The value of a key that must be given.
    pub fn required<V: Value>(&self, key: &Key<V>) -> Result<V::Read> {
        Ok(self.note(key, self.needed(key)?))
    }

    /// The value of a key that must be given. It is not noted.
    pub fn needed<V: Value>(&self, key: &Key<V>) -> Result<V::Read> {
        self.look(key)?.ok_or_else(|| self.missing(key, ""))
    }

    /// The value of a key, or its default.
    pub fn value<V: Value>(&self, key: &Key<V>) -> Result<V::Read> {
        self.value_or(key, None, Preset::Balanced)
    }

    /// The value of a key, else the one chosen for it, else its default under a preset.
    pub fn value_or<V: Value>(
        &self,
        key: &Key<V>,
        chosen: Option<V::Read>,
        preset: Preset,
    ) -> Result<V::Read> {
        let value = match self.look(key)?.or(chosen) {
            Some(value) => value,
            None => self.default(key, preset)?,
        };
        Ok(self.note(key, value))
    }

    /// The default of a key under a preset, if it has one, whatever is given. It is not noted.
    pub fn default_of<V: Value>(&self, key: &Key<V>, preset: Preset) -> Result<Option<V::Read>> {
        let Some(text) = key.default.of(preset) else {
            return Ok(None);
        };
        let node = Node::value(&self.root.place, meant(text));
        let given = GivenValue {
            key: self.called(key.name),
            node: &node,
        };
        key.value.read(&given).map(Some)
    }

    /// The default that a key has under each preset, whatever is given. It is not noted.
    pub fn default<V: Value>(&self, key: &Key<V>, preset: Preset) -> Result<V::Read> {
        self.default_of(key, preset)?
            .ok_or_else(|| self.missing(key, ""))
    }

    /// The numbers of a key that may be the path of a file too, if it is given. They are not noted.
    pub fn list(&self, key: &Key<ListOrPath<3>>) -> Result<Option<[f64; 3]>> {
        self.has(key)
            .then(|| key.value.0.read(&self.given(key)))
            .transpose()
    }

    /// The path of a key that may be numbers too, if it is given.
    pub fn path(&self, key: &Key<ListOrPath<3>>) -> Result<Option<PathBuf>> {
        self.has(key)
            .then(|| key.value.1.read(&self.given(key)))
            .transpose()
    }

    /// The tables of a key that may be one table too, if it is a list; none within where it is one, none at all where it is not given.
    pub fn tables(&self, key: &Key<Tables>) -> Result<Option<Option<Vec<Node>>>> {
        self.has(key)
            .then(|| key.value.list(&self.given(key)))
            .transpose()
    }

    /// One of those points that are allowed, of any where none are listed, if it is given. It is not noted.
    pub fn point(&self, key: &Key<Point>, allowed: &[&'static str]) -> Result<Option<String>> {
        self.has(key)
            .then(|| key.value.among(&self.given(key), allowed))
            .transpose()
    }

    /// An even number of at least so many for a reason, if it is given. It is not noted.
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

    /// The error of a key that must be given and is not, with what may stand in its place.
    pub fn missing<V: Value>(&self, key: &Key<V>, or: &str) -> SceneError {
        self.missing_line(key, key.line() + or)
    }

    /// The error of a key that must be given and is not, with a line that would do.
    pub fn missing_line(&self, key: impl Named, example: impl Into<String>) -> SceneError {
        let key = self.called(key.name());
        let problem = Problem::Missing {
            section: keys::section_of(&key).to_owned(),
            example: example.into(),
            key,
        };
        SceneError::new(&self.root.place, problem)
    }

    /// The error of a required section that is absent; it might have these lines.
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

    /// The error of a section that contradicts another one.
    pub fn misplaced(&self, section: &'static str, reason: impl Into<String>) -> SceneError {
        let reason = reason.into();
        self.given(section)
            .fault(|_| Problem::Misplaced { section, reason })
    }

    /// The error of a key that contradicts another one.
    pub fn conflict(&self, key: impl Named, reason: impl Into<String>) -> SceneError {
        let given = self.given(key);
        let (value, reason) = (given.node.shown(), reason.into());
        given.fault(|key| Problem::Conflict { key, value, reason })
    }

    /// The error of a key whose value is out of its range.
    pub fn out_of_range(&self, key: impl Named, expected: impl Into<String>) -> SceneError {
        self.given(key).out_of_range(expected)
    }

    /// The kind of a section, once it is there. Keys of another kind are refused.
    pub fn kind(&self, key: &Key<Choice<&'static str>>) -> Result<&'static str> {
        let kind = self.needed(key)?;
        let section = keys::section_of(key.name);
        let own = keys::keys_of_kind(section, kind);
        let mut faults = Faults::default();
        for name in keys::children(section) {
            let other = join(section, name);
            if name != key.last() && !own.contains(&name) && self.has(other.as_str()) {
                let given = self.given(other.as_str());
                faults.keep::<()>(Err(given.fault(|other| Problem::OtherKind {
                    key: other,
                    value: given.node.shown(),
                    kind_key: key.name.to_owned(),
                    kind: kind.to_owned(),
                    keys: own.iter().map(|name| (*name).to_owned()).collect(),
                })));
            }
        }
        faults.end()?;
        Ok(kind)
    }

    /// Refuses the keys that a form of a section has and others have not.
    pub fn refuse_form(&self, section: &str, form: &str, reason: &str) -> Result<()> {
        let mut faults = Faults::default();
        for name in keys::keys_of_kind(section, form) {
            let key = join(section, name);
            if self.has(key.as_str()) {
                faults.keep::<()>(Err(self.conflict(key.as_str(), reason)));
            }
        }
        faults.end()
    }

    /// Refuses words that the whole program knows and this version does not.
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

    /// Refuses every key that no scene has, and every value that its key cannot have, whatever stands beside it.
    pub fn check_keys(&self) -> Result<()> {
        self.check_section("", self.root)
    }

    /// Refuses every key within a section that no scene has, and every value that its key cannot have.
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
            let declared = keys::find(&key);
            let has_keys = !keys::children(&key).is_empty();
            let is_section = matches!(entry.content, Content::Section(_));
            faults.keep(match declared {
                _ if has_keys && (is_section || declared.is_none()) => {
                    self.check_section(&key, entry)
                }
                Some(_) => keys::check(&GivenValue {
                    key: self.called(&key),
                    node: entry,
                }),
                None => Err(SceneError::new(&entry.place, unknown(section, key, entry))),
            });
        }
        faults.end()
    }
}

/// What is wrong with a key that no scene has.
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
            siblings: keys::children(section)
                .into_iter()
                .map(str::to_owned)
                .collect(),
            key,
        },
    }
}
