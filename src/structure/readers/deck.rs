//! What an input deck of Abaqus or CalculiX says of the nodes: their positions and sets. Its mesh is read in `mesh_deck`.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use super::error::ReadProblem;
use super::text::{numbers, shown, text_of, whole};
use super::{Parsed, is_global};

/// A set of nodes has at most so many, `GENERATE` included: more than a file of the longest length lists.
const MOST_NODES: usize = 1 << 26;

pub(super) fn is(bytes: &[u8]) -> bool {
    let text = text_of(bytes);
    let mut keywords = text
        .lines()
        .map(str::trim_start)
        .filter(|line| line.starts_with('*') && !line.starts_with("**"));
    let known = ["*NODE", "*NSET", "*HEADING", "*INCLUDE"];
    keywords.any(|line| known.contains(&keyword(line).as_str()))
}

/// The keyword of a line of a deck, in capitals.
pub(super) fn keyword(line: &str) -> String {
    line.split(',')
        .next()
        .unwrap_or("")
        .trim()
        .to_ascii_uppercase()
}

/// The decks that may belong to a file of matrices: the same name, without what Abaqus appends (`_STIF1`).
pub(super) fn beside(path: &Path) -> Vec<PathBuf> {
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

/// The value of an option of a keyword's line; empty where it has none.
pub(super) fn option<'a>(line: &'a str, name: &str) -> Option<&'a str> {
    line.split(',').skip(1).find_map(|part| {
        let (key, value) = part.split_once('=').unwrap_or((part, ""));
        key.trim().eq_ignore_ascii_case(name).then(|| value.trim())
    })
}

pub(super) fn parse(bytes: &[u8]) -> Result<Parsed, ReadProblem> {
    enum In {
        Node(Option<String>),
        Set {
            name: String,
            generate: bool,
        },
        /// A set, and whether its axes are rectangular.
        Transform(String, bool),
        /// A part, and whether its translation has been read.
        Instance(String, bool),
        Other,
    }
    let text = text_of(bytes);
    let mut parsed = Parsed::default();
    let mut sets: HashMap<String, Vec<i64>> = HashMap::new();
    let mut room = MOST_NODES.min(64 * bytes.len());
    let mut section = In::Other;
    // The part that is read, and the nodes of each.
    let (mut part, mut parts) = (None, HashMap::<String, Vec<i64>>::new());
    // Lines that turn the axes of a set.
    let mut turned: BTreeMap<String, usize> = BTreeMap::new();
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
            if is_of_elements || word == "*INCLUDE" {
                let told = format!("{}, {}, is not followed", place(), shown(line));
                parsed.unread.push(told);
            }
            let moved = ["SYSTEM", "INPUT"]
                .iter()
                .find(|name| option(line, name).is_some());
            if word == "*SYSTEM" || word == "*NMAP" || (word == "*NODE" && moved.is_some()) {
                return Err(ReadProblem::Unsupported {
                    found: format!("{} of line {}", shown(line), k + 1),
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
                let read = |k: usize, default: i64| match fields.get(k) {
                    None | Some(&"") => Ok(default),
                    Some(field) => whole::<i64>(field, "first, last and step", place),
                };
                let (first, last, step) = (read(0, 0)?, read(1, 0)?, read(2, 1)?);
                let count = if step > 0 && last >= first {
                    (last.abs_diff(first) / step.unsigned_abs()) as usize + 1
                } else {
                    0
                };
                if count == 0 || count > room {
                    return Err(ReadProblem::malformed(
                        place(),
                        shown(line),
                        "first, last and step of a set of nodes",
                    ));
                }
                room -= count;
                let nodes = (0..count as i64).map(|k| first + k * step);
                sets.entry(name.clone()).or_default().extend(nodes);
            }
            In::Set { name, .. } => {
                for field in fields.iter().filter(|f| !f.is_empty()) {
                    match field.parse::<i64>() {
                        Ok(node) => sets.entry(name.clone()).or_default().push(node),
                        // A set within the set.
                        Err(_) => {
                            let other = sets.get(&field.trim_matches('"').to_ascii_uppercase());
                            let other = other.cloned().ok_or_else(|| {
                                let expected = "a set whose nodes are listed before";
                                ReadProblem::malformed(place(), shown(field), expected)
                            })?;
                            room = room.checked_sub(other.len()).ok_or_else(|| {
                                ReadProblem::malformed(
                                    place(),
                                    "too many nodes",
                                    format!("at most {MOST_NODES} in all sets"),
                                )
                            })?;
                            sets.entry(name.clone()).or_default().extend(other);
                        }
                    }
                }
            }
            In::Transform(set, is_rectangular) => {
                let [a, b, c, d, e, f] = numbers(&fields, place)?;
                if !*is_rectangular || !is_global([[a, b, c], [d, e, f]], [0, 1]) {
                    turned.insert(set.clone(), k + 1);
                }
            }
            // A translation, then two points of an axis and the angle about it.
            In::Instance(part, is_turn) => {
                let numbers: [f64; 7] = numbers(&fields, place)?;
                let is_same = match *is_turn {
                    false => numbers == [0.0; 7],
                    true => numbers[6] == 0.0,
                };
                *is_turn = true;
                if is_same {
                    continue;
                }
                let told = format!(
                    "positions in the part {part} are not read, because *INSTANCE moves or turns it ({})",
                    place()
                );
                parsed.unread.push(told);
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
    for (set, line) in turned {
        let why = format!(
            "displacements along the axes of *TRANSFORM (line {line}), which are not the global ones"
        );
        let Some(nodes) = sets.get(&set) else {
            // It may have any node.
            let all = parsed.positions.keys().copied().collect();
            parsed.local_axes.push((why, all));
            break;
        };
        parsed.local_axes.push((why, nodes.clone()));
    }
    parsed.sets = sets;
    Ok(parsed)
}
