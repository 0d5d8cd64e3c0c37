//! What an input deck of Abaqus or CalculiX says of the nodes: their positions and sets. Its mesh is read in `mesh_deck`.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::Parsed;
use super::error::ReadProblem;
use super::text::{number, shown, text_of, whole};

/// A set of nodes has at most so many, `GENERATE` included: more than a file of the longest length lists.
const MOST_NODES: usize = 1 << 26;

pub(super) fn is(bytes: &[u8]) -> bool {
    let text = text_of(bytes);
    let mut keywords = text
        .lines()
        .filter(|line| line.starts_with('*') && !line.starts_with("**"));
    keywords.any(|line| matches!(keyword(line).as_str(), "*NODE" | "*NSET" | "*HEADING"))
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
        Set { name: String, generate: bool },
        Other,
    }
    let text = text_of(bytes);
    let mut parsed = Parsed::default();
    let mut sets: HashMap<String, Vec<i64>> = HashMap::new();
    let mut room = MOST_NODES.min(64 * bytes.len());
    let mut section = In::Other;
    for (k, line) in text.lines().enumerate() {
        if line.trim().is_empty() || line.starts_with("**") {
            continue;
        }
        let place = || format!("line {}", k + 1);
        if line.starts_with('*') {
            let set = option(line, "NSET").map(|name| name.trim_matches('"').to_ascii_uppercase());
            let word = keyword(line);
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
                ("*NSET", Some(name)) => In::Set {
                    name,
                    generate: option(line, "GENERATE").is_some(),
                },
                _ => In::Other,
            };
            continue;
        }
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        match &section {
            In::Node(set) => {
                let node: i64 = whole(fields[0], "the number of a node", place)?;
                let mut at = [0.0; 3];
                for (axis, field) in at
                    .iter_mut()
                    .zip(&fields[1..])
                    .filter(|(_, f)| !f.is_empty())
                {
                    *axis = number(field, place)?;
                }
                let before = parsed.positions.insert(node, at);
                if let Some(before) = before.filter(|before| *before != at) {
                    return Err(ReadProblem::malformed(
                        place(),
                        format!("node {node} again, at {at:?} and before at {before:?}"),
                        "one place of each node",
                    ));
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
                            let other = sets
                                .get(&field.trim_matches('"').to_ascii_uppercase())
                                .cloned()
                                .unwrap_or_default();
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
            In::Other => {}
        }
    }
    parsed.sets = sets;
    Ok(parsed)
}
