//! The document of a scene: the merged tree of a file, its base files and the `--set` options. The tree records where
//! every key was written.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

use super::error::{Place, Problem, SceneError};
use super::faults::Faults;
use super::keys::{self, GivenValue, join};
use crate::files;

/// Most bytes of a scene file. Real scenes have about a hundred lines.
const LONGEST_SCENE: u64 = 16 << 20;

/// Most names in the key of a `--set`: as many as TOML allows, because merging trees is recursive.
const DEEPEST_KEY: usize = 80;

/// Messages show numbers from 1e21 on in scientific notation.
const LARGEST_SHOWN: f64 = 1e21;

/// A section or value, and the place where it was written.
#[derive(Debug, Clone)]
pub struct Node {
    pub place: Rc<Place>,
    pub content: Content,
}

#[derive(Debug, Clone)]
pub enum Content {
    Section(BTreeMap<String, Node>),
    Value(Value),
}

impl Node {
    fn section(place: &Rc<Place>, entries: BTreeMap<String, Node>) -> Self {
        Node {
            place: Rc::clone(place),
            content: Content::Section(entries),
        }
    }

    pub fn value(place: &Rc<Place>, value: Value) -> Self {
        Node {
            place: Rc::clone(place),
            content: Content::Value(value),
        }
    }

    /// Returns the node at a dotted key in the tree `self`.
    pub fn get(&self, key: &str) -> Option<&Node> {
        key.split('.')
            .try_fold(self, |node, name| match &node.content {
                Content::Section(entries) => entries.get(name),
                Content::Value(_) => None,
            })
    }

    /// Returns the tables of a list of tables, as sections at the place of the list. Returns `None` for any other value
    /// and for an empty list.
    pub fn tables(&self) -> Option<Vec<Node>> {
        let Content::Value(Value::Array(items)) = &self.content else {
            return None;
        };
        let tables: Option<Vec<Node>> = items
            .iter()
            .map(|item| match item {
                Value::Table(_) => Some(build_at(item.clone(), &self.place)),
                _ => None,
            })
            .collect();
        tables.filter(|tables| !tables.is_empty())
    }

    /// Returns a tree that contains the node `self` below the sections `names`.
    pub fn nested_under(self, names: &[&str]) -> Node {
        let place = Rc::clone(&self.place);
        names.iter().rev().fold(self, |node, name| {
            Node::section(&place, BTreeMap::from([((*name).to_owned(), node)]))
        })
    }

    /// Formats the value as TOML, for messages.
    pub fn shown(&self) -> String {
        match self.to_value() {
            Value::Table(table) if !table.is_empty() => {
                let entries: Vec<String> = table
                    .iter()
                    .map(|(name, value)| format!("{name} = {value}"))
                    .collect();
                format!("{{ {} }}", entries.join(", "))
            }
            // Very large numbers in full would hide the rest of the message.
            Value::Float(number) if number.abs() >= LARGEST_SHOWN => format!("{number:e}"),
            value => value.to_string(),
        }
    }

    fn to_value(&self) -> Value {
        match &self.content {
            Content::Section(_) => Value::Table(self.to_table()),
            Content::Value(value) => value.clone(),
        }
    }

    /// The tree without places; empty for a value.
    pub fn to_table(&self) -> Table {
        match &self.content {
            Content::Section(entries) => entries
                .iter()
                .map(|(name, node)| (name.clone(), node.to_value()))
                .collect(),
            Content::Value(_) => Table::new(),
        }
    }

    /// Overlays the tree `over` on the tree `self`. The function removes the keys of `self` that become meaningless by
    /// the keys of `over`.
    fn overlay(&mut self, over: Node) -> Result<(), SceneError> {
        let key = keys::dynamics::FORCE.name;
        let list = self.get(key).and_then(Node::tables);
        if let (Some(tables), Some(node)) = (list, over.get(key))
            && matches!(node.content, Content::Section(_))
        {
            // A list with a single force counts as that force.
            if let [only] = &tables[..] {
                let (section, name) = key.rsplit_once('.').unwrap_or(("", key));
                if let Some(entries) = self.entry(section) {
                    entries.insert(name.to_owned(), only.clone());
                }
                self.merge(over, true);
                return Ok(());
            }
            let problem = Problem::Conflict {
                key: key.to_owned(),
                value: node.shown(),
                reason: format!(
                    "{key} is a list of {} tables, which only a complete list can replace; give the complete list",
                    tables.len()
                ),
            };
            return Err(SceneError::new(&node.place, problem));
        }
        self.merge(over, true);
        Ok(())
    }

    /// Merges the tree `over` into the tree `self`. A section keeps the place where it first appeared. With
    /// `drop_rivals`, the function removes the keys of `self` that become meaningless by the keys of `over`. If `over`
    /// changes the kind of a section, the keys of other kinds are meaningless. If `over` gives one of the
    /// [`keys::ALTERNATIVES`] of a section, the other alternatives are meaningless.
    fn merge(&mut self, over: Node, drop_rivals: bool) {
        if drop_rivals {
            self.drop_rivals(&over);
        }
        match (&mut self.content, over.content) {
            (Content::Section(under), Content::Section(entries)) => {
                for (name, node) in entries {
                    match under.get_mut(&name) {
                        Some(existing) => existing.merge(node, false),
                        None => {
                            under.insert(name, node);
                        }
                    }
                }
            }
            (content, replacement) => {
                *content = replacement;
                self.place = over.place;
            }
        }
    }

    fn drop_rivals(&mut self, over: &Node) {
        for section in keys::sections_with_kind() {
            let key = join(section, "kind");
            if let Some(kind) = over.text(&key)
                && self.text(&key) != Some(kind)
                && keys::kinds(section).contains(&kind)
            {
                let own = keys::keys_of_kind(section, kind);
                let others = keys::children(section).into_iter();
                for name in others.filter(|name| *name != "kind" && !own.contains(name)) {
                    self.remove(section, name);
                }
            }
        }
        for (section, name, word, dropped) in keys::DROPPED_BY {
            let key = join(section, name);
            if over.text(&key) == Some(word) && self.text(&key) != Some(word) {
                self.remove(section, dropped);
            }
        }
        for (section, alternatives) in keys::ALTERNATIVES {
            // The first name of an alternative identifies it.
            let Some(chosen) = alternatives
                .iter()
                .find(|names| over.get(&join(section, names[0])).is_some())
            else {
                continue;
            };
            for names in alternatives.iter().filter(|names| *names != chosen) {
                for name in *names {
                    self.remove(section, name);
                }
            }
        }
    }

    pub fn text(&self, key: &str) -> Option<&str> {
        match &self.get(key)?.content {
            Content::Value(Value::String(text)) => Some(text),
            _ => None,
        }
    }

    fn entry(&mut self, section: &str) -> Option<&mut BTreeMap<String, Node>> {
        let mut node = self;
        for name in section.split('.') {
            let Content::Section(entries) = &mut node.content else {
                return None;
            };
            node = entries.get_mut(name)?;
        }
        match &mut node.content {
            Content::Section(inner) => Some(inner),
            Content::Value(_) => None,
        }
    }

    pub fn remove(&mut self, section: &str, name: &str) {
        if let Some(entries) = self.entry(section) {
            entries.remove(name);
        }
    }

    /// Makes the paths of files absolute, starting from `folder`.
    fn resolve_paths(&mut self, folder: &Path) -> Result<(), SceneError> {
        for key in keys::all().filter(|key| key.value.value_form().is_path) {
            let section = keys::section_of(key.name);
            let Some(node) = self
                .entry(section)
                .and_then(|inner| inner.get_mut(key.last()))
            else {
                continue;
            };
            let given = GivenValue {
                key: key.name.to_owned(),
                node,
            };
            if !key.value.names_file(&given) {
                continue;
            }
            let Content::Value(Value::String(text)) = &mut node.content else {
                continue;
            };
            // An empty path is reported when the value is read.
            if text.is_empty() {
                continue;
            }
            let path = absolute(&folder.join(&*text));
            match path.to_str() {
                Some(resolved) => *text = resolved.to_owned(),
                None => {
                    let (key, value) = (key.name.to_owned(), node.shown());
                    let problem = Problem::PathEncoding { key, value, path };
                    return Err(SceneError::new(&node.place, problem));
                }
            }
        }
        Ok(())
    }
}

/// Returns the absolute form of a path, or the path itself if there is no working folder.
fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// Reads a scene file and the base files of the scene file, and applies `sets` (`key=value` each).
pub(super) fn read(path: &Path, sets: &[String]) -> Result<Node, SceneError> {
    let text = files::read_text(path, LONGEST_SCENE)
        .map_err(|e| SceneError::new(&file(path), Problem::Read(e)))?;
    read_text(path, &text, sets)
}

/// As [`read`], for the text of the scene that a run stores at `path`. The text is complete. The function rejects a
/// `base` in the stored text, because a stranger may have chosen the file that `base` names.
pub(super) fn read_kept(path: &Path, text: &str, sets: &[String]) -> Result<Node, SceneError> {
    let tree = parse_file(path, text)?;
    if let Content::Section(entries) = &tree.content
        && let Some(base) = entries.get("base")
    {
        return Err(SceneError::new(&base.place, Problem::KeptBase));
    }
    read_text(path, text, sets)
}

/// See [`super::source_text`].
pub(super) fn source_text(path: &Path, sets: &[String]) -> Result<String, SceneError> {
    let text = files::read_text(path, LONGEST_SCENE)
        .map_err(|e| SceneError::new(&file(path), Problem::Read(e)))?;
    let mut full_text = text.clone();
    let as_comment = |text: &str| -> String {
        let lines = text.lines();
        lines
            .map(|line| format!("# {line}").trim_end().to_owned() + "\n")
            .collect()
    };
    let (mut path, mut text, mut chain) = (path.to_owned(), text, Vec::new());
    while let Some(base) = parse_file(&path, &text)?.get("base") {
        chain.push(Link::new(&path));
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let (base_path, base_text) = open_base(base, &folder, &chain)?;
        full_text += &format!("\n# ---- base = {}, as it was written:\n", base.shown());
        full_text += &as_comment(&base_text);
        (path, text) = (base_path, base_text);
    }
    if !sets.is_empty() {
        full_text += "\n# ---- changed where it was run:\n";
    }
    for set in sets {
        full_text += &as_comment(&format!("--set {set}"));
    }
    Ok(full_text)
}

fn read_text(path: &Path, text: &str, sets: &[String]) -> Result<Node, SceneError> {
    let mut tree = read_layers(path, text, &mut Vec::new())?;
    if sets.is_empty() {
        return Ok(tree);
    }
    let mut settings: Option<Node> = None;
    let mut faults = Faults::default();
    for setting in sets
        .iter()
        .filter_map(|text| faults.value_or_record(parse_set(text)))
    {
        match &mut settings {
            Some(earlier) => earlier.merge(setting, false),
            None => settings = Some(setting),
        }
    }
    faults.into_result()?;
    if let Some(mut settings) = settings {
        settings.resolve_paths(Path::new(""))?;
        tree.overlay(settings)?;
    }
    Ok(tree)
}

/// A file in a chain of bases, with a path for display and a canonical path. The program compares canonical paths,
/// because two different paths can name the same file.
struct Link {
    path: PathBuf,
    identity: PathBuf,
}

impl Link {
    fn new(path: &Path) -> Self {
        Link {
            path: path.to_owned(),
            identity: fs::canonicalize(path).unwrap_or_else(|_| absolute(path)),
        }
    }
}

/// Reads a scene file, and overlays the scene file on the base that the file names, if any. The argument `chain`
/// contains the scene files whose bases led to `path`.
fn read_layers(path: &Path, text: &str, chain: &mut Vec<Link>) -> Result<Node, SceneError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut own = parse_file(path, text)?;
    own.resolve_paths(folder)?;
    let base = match &mut own.content {
        Content::Section(entries) => entries.remove("base"),
        Content::Value(_) => None,
    };
    let Some(base) = base else { return Ok(own) };
    chain.push(Link::new(path));
    let (base_path, base_text) = open_base(&base, folder, chain)?;
    let mut tree = read_layers(&base_path, &base_text, chain)?;
    // A key that is missing from the whole document is reported for the requested file.
    tree.place = Rc::clone(&own.place);
    tree.overlay(own)?;
    Ok(tree)
}

/// Returns the file that a `base` names, and its text.
fn open_base(base: &Node, folder: &Path, chain: &[Link]) -> Result<(PathBuf, String), SceneError> {
    let wrong = |problem| SceneError::new(&base.place, problem);
    let Content::Value(Value::String(written)) = &base.content else {
        return Err(wrong(Problem::Type {
            key: "base".to_owned(),
            value: base.shown(),
            expected: "the path of a scene file, such as \"other.toml\"".to_owned(),
        }));
    };
    let path = folder.join(written);
    let text = files::read_text(&path, LONGEST_SCENE).map_err(|source| {
        wrong(Problem::Base {
            base: written.clone(),
            path: path.clone(),
            source,
        })
    })?;
    let link = Link::new(&path);
    if let Some(start) = chain
        .iter()
        .position(|earlier| earlier.identity == link.identity)
    {
        let circle = chain[start..].iter().chain([&link]);
        return Err(wrong(Problem::BaseCycle {
            chain: circle.map(|l| l.path.display().to_string()).collect(),
        }));
    }
    Ok((path, text))
}

fn file(path: &Path) -> Place {
    Place::File {
        path: path.to_owned(),
        line: None,
    }
}

/// Most characters shown of a line of a file.
const SHOWN: usize = 160;

/// Truncates the long lines of a text.
fn truncate_lines(text: &str) -> String {
    let lines = text
        .lines()
        .map(|line| match line.char_indices().nth(SHOWN) {
            Some((end, _)) => format!("{}…", &line[..end]),
            None => line.to_owned(),
        });
    lines.collect::<Vec<String>>().join("\n")
}

fn parse_file(path: &Path, text: &str) -> Result<Node, SceneError> {
    let syntax = |error: toml::de::Error| {
        SceneError::new(
            &file(path),
            Problem::Syntax(truncate_lines(error.to_string().trim_end())),
        )
    };
    let table: Table = text.parse().map_err(syntax)?;
    let spans = DeTable::parse(text).map_err(syntax)?;
    let ends: Vec<usize> = text.match_indices('\n').map(|(end, _)| end).collect();
    let place_of_line = |line| {
        Rc::new(Place::File {
            path: path.to_owned(),
            line,
        })
    };
    let place_at = |start| place_of_line(Some(1 + ends.partition_point(|end| *end < start)));
    let tree = Value::Table(table);
    Ok(build(
        tree,
        Some(spans.get_ref()),
        &place_of_line(None),
        &place_at,
    ))
}

/// Builds the tree of a value. With `spans`, the same table with positions, each key gets the place where it begins.
/// Without `spans`, all keys get the `place` of the value.
fn build(
    value: Value,
    spans: Option<&DeTable<'_>>,
    place: &Rc<Place>,
    place_at: &impl Fn(usize) -> Rc<Place>,
) -> Node {
    match value {
        Value::Table(table) => {
            let entries = table
                .into_iter()
                .map(|(name, inner)| {
                    let spelt = spans.and_then(|spans| spans.get_key_value(name.as_str()));
                    let below = spelt.and_then(|(_, value)| match value.get_ref() {
                        DeValue::Table(below) => Some(below),
                        _ => None,
                    });
                    let place = match spelt {
                        Some((key, _)) => place_at(key.span().start),
                        None => Rc::clone(place),
                    };
                    (name, build(inner, below, &place, place_at))
                })
                .collect();
            Node::section(place, entries)
        }
        value => Node::value(place, value),
    }
}

/// Builds the tree of a value that was written at a single place.
fn build_at(value: Value, place: &Rc<Place>) -> Node {
    build(value, None, place, &|_| Rc::clone(place))
}

/// Parses `key=value` into a tree with that key. The value is parsed as TOML if possible, else taken as a string.
fn parse_set(text: &str) -> Result<Node, SceneError> {
    let place = Rc::new(Place::Set(text.to_owned()));
    let malformed = || SceneError::new(&place, Problem::SetSyntax);
    let (key, value) = text.split_once('=').ok_or_else(malformed)?;
    let names: Vec<&str> = key.split('.').map(str::trim).collect();
    let is_bare = |name: &&str| {
        !name.is_empty()
            && name
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-'))
    };
    if !names.iter().all(is_bare) {
        return Err(malformed());
    }
    if names.len() > DEEPEST_KEY {
        let problem = Problem::SetDepth {
            names: names.len(),
            limit: DEEPEST_KEY,
        };
        return Err(SceneError::new(&place, problem));
    }
    if names == ["base"] {
        return Err(SceneError::new(&place, Problem::SetBase));
    }
    let leaf = build_at(keys::parse_set_value(value.trim()), &place);
    Ok(leaf.nested_under(&names))
}
