//! Nodes of an input deck of Abaqus or CalculiX: positions and sets. `mesh_deck` reads the elements.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use super::error::ReadProblem;
use super::text::{numbers, quoted, text_of, whole};
use super::{ParsedFile, is_global};
use crate::structure::solids::NAMES;

/// Largest number of nodes in all sets, including `GENERATE`. The lists of the longest file have fewer nodes than
/// `MOST_NODES`.
const MOST_NODES: usize = 1 << 26;

pub(super) fn is(bytes: &[u8]) -> bool {
    let text = text_of(bytes);
    let mut keywords = text
        .lines()
        .map(str::trim_start)
        .filter(|line| line.starts_with('*') && !line.starts_with("**"));
    let deck_keywords = ["*NODE", "*NSET", "*HEADING", "*INCLUDE"];
    keywords.any(|line| deck_keywords.contains(&keyword(line).as_str()))
}

/// Returns the keyword of a line of a deck, in upper case.
pub(super) fn keyword(line: &str) -> String {
    let word = line.split(',').next().unwrap_or("").trim();
    match word.strip_prefix('*') {
        // Blanks may follow the asterisk.
        Some(rest) if !rest.starts_with('*') => {
            format!("*{}", rest.trim_start()).to_ascii_uppercase()
        }
        _ => word.to_ascii_uppercase(),
    }
}

/// Returns decks that may belong to a file of matrices: the same name, or the name without an Abaqus suffix
/// (`_STIF1`).
pub(super) fn candidate_decks(path: &Path) -> Vec<PathBuf> {
    let mut decks = vec![path.with_extension("inp")];
    let stem = path
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    if let Some((job, _)) = stem.rsplit_once('_') {
        decks.push(path.with_file_name(format!("{job}.inp")));
    }
    decks.retain(|deck| deck != path);
    decks
}

/// Returns the value of an option of a keyword line. For an option without a value, `option` returns an empty text.
pub(super) fn option<'a>(line: &'a str, name: &str) -> Option<&'a str> {
    line.split(',').skip(1).find_map(|part| {
        let (key, value) = part.split_once('=').unwrap_or((part, ""));
        key.trim().eq_ignore_ascii_case(name).then(|| value.trim())
    })
}

pub(super) fn parse(bytes: &[u8]) -> Result<ParsedFile, ReadProblem> {
    enum In {
        Node(Option<String>),
        Set {
            name: String,
            generate: bool,
        },
        /// Lines of elements. The fields are the name of the element set and, for a known type, the number of nodes per
        /// element.
        Elements(Option<String>, Option<usize>),
        ElementSet {
            name: String,
            generate: bool,
        },
        /// Name of a set of nodes with local axes, and true if the local axes are rectangular.
        Transform(String, bool),
        /// Instance of a part, and whether the translation line has been read.
        Instance(String, bool),
        Other,
    }
    let text = text_of(bytes);
    let mut parsed = ParsedFile::default();
    let mut sets: HashMap<String, Vec<i64>> = HashMap::new();
    let mut room = MOST_NODES.min(64 * bytes.len());
    let mut section = In::Other;
    // Nodes of elements, needed only if a set of nodes is defined by a set of elements.
    let mut elements = has_sets_of_elements(&text).then(Elements::default);
    // Name of the current part, and the nodes of each part.
    let (mut part, mut parts) = (None, HashMap::<String, Vec<i64>>::new());
    // Sets with rotated axes, and the line that rotates them.
    let mut rotated_sets: BTreeMap<String, usize> = BTreeMap::new();
    for (k, line) in text.lines().map(str::trim_start).enumerate() {
        if line.trim().is_empty() || line.starts_with("**") {
            continue;
        }
        let place = || format!("line {}", k + 1);
        if line.starts_with('*') {
            let name = |key: &str| {
                option(line, key).map(|name| name.trim_matches('"').to_ascii_uppercase())
            };
            let set = name("NSET");
            let word = keyword(line);
            let is_of_elements = word == "*NSET" && option(line, "ELSET").is_some();
            if is_of_elements {
                let (Some(elements), Some(set), Some(of)) = (&mut elements, &set, name("ELSET"))
                else {
                    return Err(ReadProblem::malformed(
                        place(),
                        quoted(line),
                        "NSET=… and ELSET=…",
                    ));
                };
                match elements.nodes_of(&of) {
                    Some(nodes) => {
                        room = room
                            .checked_sub(nodes.len())
                            .ok_or_else(|| too_many(place()))?;
                        sets.entry(set.clone()).or_default().extend(nodes);
                    }
                    None => parsed.unread.push(format!(
                        "{}, {}, is not followed: no element of {of} is listed before it",
                        place(),
                        quoted(line)
                    )),
                }
            }
            if word == "*INCLUDE" {
                let reason = format!("{}, {}, is not followed", place(), quoted(line));
                parsed.unread.push(reason);
            }
            let moved_option = ["SYSTEM", "INPUT"]
                .iter()
                .find(|name| option(line, name).is_some());
            if word == "*SYSTEM" || word == "*NMAP" || (word == "*NODE" && moved_option.is_some()) {
                return Err(ReadProblem::Unsupported {
                    found: format!("{} of line {}", quoted(line), k + 1),
                    advice:
                        "write the nodes into the deck, in rectangular coordinates of the whole"
                            .to_owned(),
                });
            }
            section = match (word.as_str(), set) {
                ("*NODE", set) => In::Node(set),
                ("*NSET", Some(name)) if !is_of_elements => In::Set {
                    name,
                    generate: option(line, "GENERATE").is_some(),
                },
                ("*ELEMENT", _) if elements.is_some() => {
                    let kind = name("TYPE").unwrap_or_default();
                    let solid = NAMES.iter().find(|name| name.0 == kind);
                    In::Elements(name("ELSET"), solid.map(|name| name.1.nodes()))
                }
                ("*ELSET", _) if elements.is_some() => In::ElementSet {
                    name: name("ELSET").unwrap_or_default(),
                    generate: option(line, "GENERATE").is_some(),
                },
                ("*TRANSFORM", set) => {
                    let set = set.unwrap_or_default();
                    let is_rectangular = name("TYPE").is_none_or(|kind| kind == "R");
                    In::Transform(set, is_rectangular)
                }
                ("*INSTANCE", _) => In::Instance(name("PART").unwrap_or_default(), false),
                _ => In::Other,
            };
            if word == "*PART" {
                part = name("NAME");
            }
            continue;
        }
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        match &mut section {
            In::Node(set) => {
                let node: i64 = whole(fields[0], "the number of a node", place)?;
                let at: [f64; 3] = numbers(&fields[1..], place)?;
                let before = parsed.positions.insert(node, at);
                if let Some(before) = before.filter(|before| *before != at) {
                    return Err(ReadProblem::malformed(
                        place(),
                        format!("node {node} again, at {at:?} and before at {before:?}"),
                        match &part {
                            Some(_) => {
                                "one place of each node: a flat deck without *PART, whose numbers are not those of the matrices"
                            }
                            None => "one place of each node",
                        },
                    ));
                }
                if let Some(part) = &part {
                    parts.entry(part.clone()).or_default().push(node);
                }
                if let Some(name) = set {
                    sets.entry(name.clone()).or_default().push(node);
                }
            }
            In::Set {
                name,
                generate: true,
            } => {
                let nodes = expand_range(&fields, &mut room, &place)?;
                sets.entry(name.clone()).or_default().extend(nodes);
            }
            In::Elements(set, nodes) => {
                let elements = elements.as_mut().expect("elements are read");
                elements.add(&fields, set.as_deref(), *nodes, &place)?;
            }
            In::ElementSet { name, generate } => {
                let labels = match generate {
                    true => expand_range(&fields, &mut room, &place)?.collect(),
                    false => Vec::new(),
                };
                let elements = elements.as_mut().expect("elements are read");
                let fields: &[&str] = if *generate { &[] } else { &fields };
                let added = elements.extend(name, labels, fields);
                room = room.checked_sub(added).ok_or_else(|| too_many(place()))?;
            }
            In::Set { name, .. } => {
                for field in fields.iter().filter(|f| !f.is_empty()) {
                    match field.parse::<i64>() {
                        Ok(node) => sets.entry(name.clone()).or_default().push(node),
                        // The field is the name of another set.
                        Err(_) => {
                            let other = sets.get(&field.trim_matches('"').to_ascii_uppercase());
                            let other = other.cloned().ok_or_else(|| {
                                let expected = "a set whose nodes are listed before";
                                ReadProblem::malformed(place(), quoted(field), expected)
                            })?;
                            room = room
                                .checked_sub(other.len())
                                .ok_or_else(|| too_many(place()))?;
                            sets.entry(name.clone()).or_default().extend(other);
                        }
                    }
                }
            }
            In::Transform(set, is_rectangular) => {
                let [a, b, c, d, e, f] = numbers(&fields, place)?;
                if !*is_rectangular || !is_global([[a, b, c], [d, e, f]], [0, 1]) {
                    rotated_sets.insert(set.clone(), k + 1);
                }
            }
            // The first line is a translation; the second is two points of an axis and the angle of a rotation.
            In::Instance(part, is_turn) => {
                let numbers: [f64; 7] = numbers(&fields, place)?;
                let is_identity = match *is_turn {
                    false => numbers == [0.0; 7],
                    true => numbers[6] == 0.0,
                };
                *is_turn = true;
                if is_identity {
                    continue;
                }
                let reason = format!(
                    "positions in the part {part} are not read, because *INSTANCE moves or turns it ({})",
                    place()
                );
                parsed.unread.push(reason);
                match parts.get_mut(part) {
                    Some(nodes) => nodes.drain(..).for_each(|node| {
                        parsed.positions.remove(&node);
                    }),
                    None => parsed.positions.clear(),
                }
            }
            In::Other => {}
        }
    }
    for (set, line) in rotated_sets {
        let why = format!(
            "displacements along the axes of *TRANSFORM (line {line}), which are not the global ones"
        );
        let Some(nodes) = sets.get(&set) else {
            // The set is unknown, so any node may be in it.
            let all = parsed.positions.keys().copied().collect();
            parsed.local_axes.push((why, all));
            break;
        };
        parsed.local_axes.push((why, nodes.clone()));
    }
    parsed.sets = sets;
    Ok(parsed)
}

/// Returns the numbers from a first to a last by a step.
pub(super) fn expand_range(
    fields: &[&str],
    room: &mut usize,
    place: &dyn Fn() -> String,
) -> Result<impl Iterator<Item = i64> + use<>, ReadProblem> {
    let read = |k: usize, default: i64| match fields.get(k) {
        None | Some(&"") => Ok(default),
        Some(field) => whole::<i64>(field, "first, last and step", place),
    };
    let (first, last, step) = (read(0, 0)?, read(1, 0)?, read(2, 1)?);
    let count = match step > 0 && last >= first {
        true => (last.abs_diff(first) / step.unsigned_abs()) as usize + 1,
        false => 0,
    };
    if count == 0 || count > *room {
        return Err(ReadProblem::malformed(
            place(),
            quoted(&fields.join(", ")),
            "first, last and step of a set",
        ));
    }
    *room -= count;
    Ok((0..count as i64).map(move |k| first + k * step))
}

fn too_many(place: String) -> ReadProblem {
    ReadProblem::malformed(
        place,
        "too many nodes",
        format!("at most {MOST_NODES} in all sets"),
    )
}

/// Returns true if the deck defines a set of nodes by a set of elements.
fn has_sets_of_elements(text: &str) -> bool {
    let mut keywords = text
        .lines()
        .filter(|line| line.trim_start().starts_with('*'));
    keywords.any(|line| keyword(line) == "*NSET" && option(line, "ELSET").is_some())
}

/// Elements of a deck, as far as sets of nodes need them: their nodes and sets.
#[derive(Default)]
struct Elements {
    nodes: HashMap<i64, Vec<i64>>,
    sets: HashMap<String, Vec<i64>>,
    /// Numbers of an element whose nodes continue on the next line.
    open: Vec<i64>,
}

impl Elements {
    /// Reads a line of data. If the number of nodes of the element is known, the element ends after this number of
    /// nodes. If the number is unknown, the element continues after a line with a comma at the end.
    fn add(
        &mut self,
        fields: &[&str],
        set: Option<&str>,
        nodes: Option<usize>,
        place: &dyn Fn() -> String,
    ) -> Result<(), ReadProblem> {
        for field in fields.iter().filter(|f| !f.is_empty()) {
            let expected = "the numbers of an element and its nodes";
            self.open.push(whole(field, expected, place)?);
        }
        let continues = match nodes {
            Some(nodes) => self.open.len() <= nodes,
            None => fields.last().is_some_and(|field| field.is_empty()),
        };
        if continues || self.open.is_empty() {
            return Ok(());
        }
        let nodes = self.open.split_off(1);
        let label = self.open[0];
        self.open.clear();
        if let Some(set) = set {
            self.sets.entry(set.to_owned()).or_default().push(label);
        }
        self.nodes.insert(label, nodes);
        Ok(())
    }

    /// Adds `labels`, and the elements or sets in `fields`, to a set. Returns the number of added labels.
    fn extend(&mut self, set: &str, mut labels: Vec<i64>, fields: &[&str]) -> usize {
        for field in fields.iter().filter(|f| !f.is_empty()) {
            match field.parse::<i64>() {
                Ok(label) => labels.push(label),
                Err(_) => {
                    let other = self.sets.get(&field.trim_matches('"').to_ascii_uppercase());
                    labels.extend(other.into_iter().flatten());
                }
            }
        }
        let count = labels.len();
        self.sets.entry(set.to_owned()).or_default().extend(labels);
        count
    }

    /// Returns the nodes of the elements of a set in ascending order, each once. `None` if the set has no known
    /// element.
    fn nodes_of(&self, set: &str) -> Option<Vec<i64>> {
        let labels = self.sets.get(set)?.iter();
        let nodes = labels.filter_map(|label| self.nodes.get(label)).flatten();
        let nodes: std::collections::BTreeSet<i64> = nodes.copied().collect();
        (!nodes.is_empty()).then(|| nodes.into_iter().collect())
    }
}
