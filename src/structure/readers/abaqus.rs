//! Abaqus matrices from `*MATRIX OUTPUT` or from substructures. Each line of `*MATRIX OUTPUT` has a node, a direction,
//! a second node, a second direction and a value.

use std::collections::HashMap;

use super::deck::keyword;
use super::error::ReadProblem;
use super::text::{Digits, last_number, number, quoted, real, text_of, whole};
use super::{NamedMatrix, ParsedFile, rows};
use crate::structure::matrices::{Dof, Role, Triplets};

fn fields(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| c == ',' || c.is_whitespace())
        .filter(|w| !w.is_empty())
}

fn is_comment(line: &str) -> bool {
    line.trim().is_empty() || line.starts_with("**")
}

pub(super) fn is_labels(bytes: &[u8]) -> bool {
    const ENOUGH: usize = 4096;
    let text = text_of(&bytes[..bytes.len().min(ENOUGH)]);
    let first = text
        .lines()
        .map(str::trim_start)
        .find(|line| !is_comment(line) && !line.starts_with('*'));
    first.is_some_and(|line| {
        let words: Vec<&str> = fields(line).collect();
        words.len() == 5
            && words[..4].iter().all(|w| w.parse::<i64>().is_ok())
            && real(words[4]).is_some()
    })
}

pub(super) fn parse_labels(bytes: &[u8]) -> Result<ParsedFile, ReadProblem> {
    let text = text_of(bytes);
    let mut entries: Vec<(Dof, Dof, f64)> = Vec::new();
    let mut digits = Digits::default();
    for (k, line) in text.lines().map(str::trim_start).enumerate() {
        if is_comment(line) || line.starts_with('*') {
            continue;
        }
        let place = || format!("line {}", k + 1);
        let mut words = fields(line);
        let mut freedom = || -> Result<Dof, ReadProblem> {
            let expected = "NODE, DIRECTION, NODE, DIRECTION, VALUE";
            Ok(Dof {
                node: whole(words.next().unwrap_or(""), expected, place)?,
                direction: whole(words.next().unwrap_or(""), expected, place)?,
            })
        };
        let (row, column) = (freedom()?, freedom()?);
        let value = last_number(words, &mut digits, "the value", place)?;
        entries.push((row, column, value));
    }
    let mut dofs: Vec<Dof> = entries.iter().flat_map(|e| [e.0, e.1]).collect();
    dofs.sort_unstable();
    dofs.dedup();
    let place: HashMap<Dof, u32> = dofs
        .iter()
        .enumerate()
        .map(|(k, dof)| (*dof, k as u32))
        .collect();
    let mut matrix = Triplets::new(dofs.len());
    matrix.entries = entries
        .iter()
        .map(|e| (place[&e.0], place[&e.1], e.2))
        .collect();
    matrix.precision = digits.precision();
    matrix.detect_triangle();
    let internal = dofs.iter().filter(|dof| dof.node < 0).count();
    let mut notes = Vec::new();
    if internal > 0 {
        notes.push(format!(
            "{internal} freedoms belong to nodes below zero, which the program made itself"
        ));
    }
    Ok(ParsedFile {
        matrices: vec![NamedMatrix {
            name: String::new(),
            role: None,
            matrix,
            dofs: Some(dofs),
            has_unknown_size: false,
        }],
        notes,
        ..ParsedFile::default()
    })
}

/// Returns the value of an option of a keyword line in upper case, with single blanks.
fn option(line: &str, name: &str) -> Option<String> {
    line.split(',').skip(1).find_map(|part| {
        let (key, value) = part.split_once('=')?;
        let value = || {
            value
                .split_whitespace()
                .collect::<Vec<_>>()
                .join(" ")
                .to_ascii_uppercase()
        };
        key.trim().eq_ignore_ascii_case(name).then(value)
    })
}

fn is_matrix(line: &str) -> bool {
    line.starts_with('*') && keyword(line) == "*MATRIX" && option(line, "TYPE").is_some()
}

pub(super) fn is_substructure(bytes: &[u8]) -> bool {
    text_of(bytes).lines().map(str::trim_start).any(is_matrix)
}

/// Description of the substructure that precedes its matrices.
#[derive(Default)]
struct Element {
    count: Option<usize>,
    nodes: Vec<i64>,
    /// Lists of directions, each with the index of the first node that it applies to, from 0.
    directions: Vec<(usize, Vec<u32>)>,
}

impl Element {
    fn dofs(&self, length: usize) -> Result<(Vec<Dof>, Option<String>), ReadProblem> {
        let count = self.count.unwrap_or(self.nodes.len());
        rows(count as u64, length, "*USER ELEMENT")?;
        if self.directions.is_empty() || count == 0 {
            return Err(ReadProblem::malformed(
                "*USER ELEMENT",
                format!(
                    "{count} nodes and {} lists of directions",
                    self.directions.len()
                ),
                "NODES=N on its line, and below it the directions of the nodes, as 1,2,3",
            ));
        }
        let is_listed = self.nodes.len() == count;
        let note = (!is_listed).then(|| {
            format!(
                "the comment ELEMENT NODES lists {} of {count} nodes: nodes are numbered by their place in the substructure",
                self.nodes.len()
            )
        });
        let mut dofs = Vec::new();
        let mut list: &[u32] = &[];
        let mut next = self.directions.iter().peekable();
        for k in 0..count {
            while let Some((_, directions)) = next.next_if(|entry| entry.0 == k) {
                list = directions;
            }
            let node = if is_listed {
                self.nodes[k]
            } else {
                k as i64 + 1
            };
            dofs.extend(list.iter().map(|&direction| Dof { node, direction }));
            rows(dofs.len() as u64, length, "*USER ELEMENT")?;
        }
        if let Some((place, _)) = next.next() {
            return Err(ReadProblem::malformed(
                "*USER ELEMENT",
                format!(
                    "a list of directions for node {} after that of a later one",
                    place + 1
                ),
                format!("places that rise, at most {count}"),
            ));
        }
        Ok((dofs, note))
    }
}

/// Matrix during reading: row by row up to the diagonal.
struct Triangle {
    name: String,
    line: usize,
    role: Option<Role>,
    matrix: Triplets,
    row: usize,
    column: usize,
}

impl Triangle {
    fn end(self, dofs: &[Dof], digits: &Digits, into: &mut ParsedFile) -> Result<(), ReadProblem> {
        if self.row < dofs.len() {
            return Err(ReadProblem::truncated(
                format!("the {} of line {}", self.name.to_lowercase(), self.line),
                format!("{} numbers of row {}", self.column, self.row + 1),
                format!(
                    "{} rows, a row having as many numbers as its own number",
                    dofs.len()
                ),
            ));
        }
        let Some(role) = self.role else {
            into.notes
                .push(format!("*MATRIX, TYPE={} is left out", self.name));
            return Ok(());
        };
        let mut matrix = self.matrix;
        matrix.precision = digits.precision();
        into.matrices.push(NamedMatrix {
            name: format!("*MATRIX, TYPE={}", self.name),
            role: Some(role),
            matrix,
            dofs: Some(dofs.to_vec()),
            has_unknown_size: false,
        });
        Ok(())
    }
}

pub(super) fn parse_substructure(bytes: &[u8]) -> Result<ParsedFile, ReadProblem> {
    enum In {
        NodesComment,
        Element,
        Matrix(Triangle),
        Other,
    }
    let text = text_of(bytes);
    let mut parsed = ParsedFile::default();
    let mut element = Element::default();
    let mut dofs: Vec<Dof> = Vec::new();
    let mut digits = Digits::default();
    let mut section = In::Other;
    let mut elements = 0;
    for (k, line) in text.lines().map(str::trim_start).enumerate() {
        let place = || format!("line {}", k + 1);
        if line.starts_with("**") {
            // The comment ELEMENT NODES may be between the data lines of *USER ELEMENT.
            let comment = line.trim_start_matches('*').trim();
            if comment.eq_ignore_ascii_case("ELEMENT NODES") {
                section = In::NodesComment;
                element.nodes.clear();
            } else if matches!(section, In::NodesComment) {
                let nodes: Result<Vec<i64>, _> = fields(comment).map(str::parse).collect();
                element.nodes.extend(nodes.unwrap_or_default());
            }
            continue;
        }
        if line.starts_with('*') {
            if let In::Matrix(triangle) = std::mem::replace(&mut section, In::Other) {
                triangle.end(&dofs, &digits, &mut parsed)?;
            }
            if keyword(line) == "*USER ELEMENT" {
                elements += 1;
                if elements > 1 {
                    return Err(ReadProblem::malformed(
                        place(),
                        "a second *USER ELEMENT",
                        "one substructure a file",
                    ));
                }
                let count = option(line, "NODES")
                    .map(|n| whole(&n, "a count of nodes", place))
                    .transpose()?;
                element = Element {
                    count,
                    ..Element::default()
                };
                section = In::Element;
            } else if is_matrix(line) {
                if dofs.is_empty() {
                    let (found, note) = element.dofs(bytes.len())?;
                    dofs = found;
                    parsed.notes.extend(note);
                }
                let name = option(line, "TYPE").unwrap_or_default();
                let role = match name.as_str() {
                    "STIFFNESS" => Some(Role::Stiffness),
                    "MASS" => Some(Role::Mass),
                    "VISCOUS DAMPING" | "VISCOUSDAMPING" | "DAMPING" => Some(Role::Damping),
                    _ => None,
                };
                let mut matrix = Triplets::new(dofs.len());
                matrix.is_triangle = true;
                section = In::Matrix(Triangle {
                    name,
                    line: k + 1,
                    role,
                    matrix,
                    row: 0,
                    column: 0,
                });
            }
            continue;
        }
        match &mut section {
            In::Element | In::NodesComment => {
                let expected = "directions of the nodes, as 1,2,3, or from the second line on a place and directions";
                let numbers: Vec<u32> = fields(line)
                    .map(|word| whole(word, expected, place))
                    .collect::<Result<_, _>>()?;
                if numbers.is_empty() {
                    continue;
                }
                let from = match (element.directions.last(), numbers[0]) {
                    (None, _) => 0,
                    (Some(_), 0) => {
                        return Err(ReadProblem::malformed(
                            place(),
                            "place 0",
                            "a place of 1 or more",
                        ));
                    }
                    (Some(_), place) => place as usize - 1,
                };
                let directions = if element.directions.is_empty() {
                    numbers
                } else {
                    numbers[1..].to_vec()
                };
                element.directions.push((from, directions));
            }
            In::Matrix(triangle) => {
                for word in fields(line) {
                    if triangle.row >= dofs.len() {
                        return Err(ReadProblem::malformed(
                            place(),
                            quoted(word),
                            format!(
                                "the end of the {}: it has {} rows",
                                triangle.name.to_lowercase(),
                                dofs.len()
                            ),
                        ));
                    }
                    let row = triangle.row + 1;
                    let value = number(word, || {
                        format!(
                            "line {} (row {row} of the {})",
                            k + 1,
                            triangle.name.to_lowercase()
                        )
                    })?;
                    digits.count_digits(word);
                    if value != 0.0 {
                        triangle.matrix.entries.push((
                            triangle.row as u32,
                            triangle.column as u32,
                            value,
                        ));
                    }
                    triangle.column += 1;
                    if triangle.column > triangle.row {
                        triangle.row += 1;
                        triangle.column = 0;
                    }
                }
            }
            In::Other => {}
        }
    }
    if let In::Matrix(triangle) = section {
        triangle.end(&dofs, &digits, &mut parsed)?;
    }
    Ok(parsed)
}
