//! The document of a scene: a file, the files it is based on, and `--set`, merged into one tree that remembers where every key
//! was written.

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

/// A scene has some hundred lines; a file of more bytes than this is none.
const LONGEST_SCENE: u64 = 16 << 20;

/// Names in the key of a `--set`: as many as TOML allows, since what is laid over a tree is gone through name below name.
const DEEPEST_KEY: usize = 80;

/// A number from which on it is told by its power of ten, as other languages do.
const LARGEST_SHOWN: f64 = 1e21;

/// A section or a value, and where it was written.
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

    /// The node at a dotted key below this one.
    pub fn get(&self, key: &str) -> Option<&Node> {
        key.split('.')
            .try_fold(self, |node, name| match &node.content {
                Content::Section(entries) => entries.get(name),
                Content::Value(_) => None,
            })
    }

    /// The tables of a list of tables, as sections where the list is; none for anything else, and for an empty list.
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

    /// A tree with this node below the names given.
    pub fn below(self, names: &[&str]) -> Node {
        let place = Rc::clone(&self.place);
        names.iter().rev().fold(self, |node, name| {
            Node::section(&place, BTreeMap::from([((*name).to_owned(), node)]))
        })
    }

    /// The value as TOML would write it, for messages.
    pub fn shown(&self) -> String {
        match self.to_value() {
            Value::Table(table) if !table.is_empty() => {
                let entries: Vec<String> = table
                    .iter()
                    .map(|(name, value)| format!("{name} = {value}"))
                    .collect();
                format!("{{ {} }}", entries.join(", "))
            }
            // All the digits of such a number hide the rest of a message.
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

    /// The tree without its places; empty for a value.
    pub fn to_table(&self) -> Table {
        match &self.content {
            Content::Section(entries) => entries
                .iter()
                .map(|(name, node)| (name.clone(), node.to_value()))
                .collect(),
            Content::Value(_) => Table::new(),
        }
    }

    /// Lays `over` on top of this tree, and drops what it makes meaningless.
    fn lay(&mut self, over: Node) -> Result<(), SceneError> {
        let key = keys::dynamics::FORCE.name;
        let list = self.get(key).and_then(Node::tables);
        if let (Some(tables), Some(node)) = (list, over.get(key))
            && matches!(node.content, Content::Section(_))
        {
            // A list of one force is that force.
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
                    "{key} is a list of {} tables, which is replaced by a list only; give all of it",
                    tables.len()
                ),
            };
            return Err(SceneError::new(&node.place, problem));
        }
        self.merge(over, true);
        Ok(())
    }

    /// Lays `over` on top of this tree. A section keeps the place where it first appeared. With `drop_rivals`, keys that `over` makes meaningless are dropped: those of the other
    /// kinds when it changes the kind of a section, and the other ways of giving a motion or an update.
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
        for section in keys::with_kinds() {
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
            // The first name of an alternative is the one that stands for it.
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

    /// Makes the paths of files absolute, from `folder`.
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
            // An empty path is reported where the value is read.
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

/// The absolute form of a path; the path itself where there is no working folder to start from.
fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// Reads a scene file and those it is based on, and applies `sets` (`key=value` each).
pub(super) fn read(path: &Path, sets: &[String]) -> Result<Node, SceneError> {
    let text = files::read_text(path, LONGEST_SCENE)
        .map_err(|e| SceneError::new(&file(path), Problem::Read(e)))?;
    read_text(path, &text, sets)
}

/// As [`read`], from the text of the scene that a run keeps at `path`, which is complete: to follow a base of it would show a
/// stranger's choice of files.
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
pub(super) fn written(path: &Path, sets: &[String]) -> Result<String, SceneError> {
    let text = files::read_text(path, LONGEST_SCENE)
        .map_err(|e| SceneError::new(&file(path), Problem::Read(e)))?;
    let mut whole = text.clone();
    let commented = |text: &str| -> String {
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
        whole += &format!("\n# ---- base = {}, as it was written:\n", base.shown());
        whole += &commented(&base_text);
        (path, text) = (base_path, base_text);
    }
    if !sets.is_empty() {
        whole += "\n# ---- changed where it was run:\n";
    }
    for set in sets {
        whole += &commented(&format!("--set {set}"));
    }
    Ok(whole)
}

fn read_text(path: &Path, text: &str, sets: &[String]) -> Result<Node, SceneError> {
    let mut tree = read_layers(path, text, &mut Vec::new())?;
    if sets.is_empty() {
        return Ok(tree);
    }
    let mut settings: Option<Node> = None;
    let mut faults = Faults::default();
    for setting in sets.iter().filter_map(|text| faults.keep(parse_set(text))) {
        match &mut settings {
            Some(earlier) => earlier.merge(setting, false),
            None => settings = Some(setting),
        }
    }
    faults.end()?;
    if let Some(mut settings) = settings {
        settings.resolve_paths(Path::new(""))?;
        tree.lay(settings)?;
    }
    Ok(tree)
}

/// A file of a chain of bases: as it is to be shown, and as the file system knows it, since two spellings may be one file.
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

/// The tree of a file laid on top of that of its base, if it has one. `chain` holds the files that led here.
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
    // What is missing from the document as a whole is missing from the file that was asked for.
    tree.place = Rc::clone(&own.place);
    tree.lay(own)?;
    Ok(tree)
}

/// The file that a `base` names, and its text.
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

/// Letters of a line of a file that are shown.
const SHOWN: usize = 160;

/// A text without the ends of its long lines.
fn clipped(text: &str) -> String {
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
            Problem::Syntax(clipped(error.to_string().trim_end())),
        )
    };
    let table: Table = text.parse().map_err(syntax)?;
    let spans = DeTable::parse(text).map_err(syntax)?;
    let ends: Vec<usize> = text.match_indices('\n').map(|(end, _)| end).collect();
    let place = |line| {
        Rc::new(Place::File {
            path: path.to_owned(),
            line,
        })
    };
    let place_at = |start| place(Some(1 + ends.partition_point(|end| *end < start)));
    let tree = Value::Table(table);
    Ok(build(tree, Some(spans.get_ref()), &place(None), &place_at))
}

/// The tree of a value. With `spans`, the same as its file spells it, each key has the place where it begins there; without,
/// all have the `place` of the value.
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

/// The tree of a value all of which was written at one place.
fn build_at(value: Value, place: &Rc<Place>) -> Node {
    build(value, None, place, &|_| Rc::clone(place))
}

/// A tree with the one key of `key=value`. The value is TOML if it can be read as such, else a string.
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
    let leaf = build_at(keys::meant(value.trim()), &place);
    Ok(leaf.below(&names))
}
