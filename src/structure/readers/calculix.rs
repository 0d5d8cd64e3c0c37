//! CalculiX matrices (`SOLVER=MATRIXSTORAGE`). The files `.sti` and `.mas` have the lines `row column value` of one
//! triangle. The file `.dof` has a line `node.direction` per row of the matrices. The coordinate format of Abaqus has
//! lines `row column value` for both triangles.

use std::path::{Path, PathBuf};

use super::error::ReadProblem;
use super::text::{Digits, last_number, quoted, real, text_of, whole};
use super::{NamedMatrix, ParsedFile, rows};
use crate::structure::matrices::{Dof, Triplets};

/// Extensions of the files of one analysis.
const EXTENSIONS: [&str; 3] = ["sti", "mas", "dof"];

/// Returns up to three first lines that are neither empty nor comments.
fn first_lines(bytes: &[u8]) -> Vec<String> {
    const ENOUGH: usize = 4096;
    let text = text_of(&bytes[..bytes.len().min(ENOUGH)]);
    let is_cut = bytes.len() > ENOUGH;
    let lines: Vec<&str> = text.lines().collect();
    let complete_lines = if is_cut {
        lines.len().saturating_sub(1)
    } else {
        lines.len()
    };
    let content = lines[..complete_lines]
        .iter()
        .filter(|line| !line.trim().is_empty() && !line.trim_start().starts_with("**"));
    content.take(3).map(|line| (*line).to_owned()).collect()
}

pub(super) fn is_coordinates(bytes: &[u8]) -> bool {
    let lines = first_lines(bytes);
    let is = |line: &String| {
        let words: Vec<&str> = words(line).collect();
        words.len() == 3
            && words[..2].iter().all(|w| w.parse::<u64>().is_ok())
            && real(words[2]).is_some()
    };
    lines.first().is_some_and(is)
}

pub(super) fn is_dof(bytes: &[u8]) -> bool {
    let lines = first_lines(bytes);
    !lines.is_empty() && lines.iter().all(|line| freedom(line).is_some())
}

fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| c == ',' || c.is_whitespace())
        .filter(|w| !w.is_empty())
}

fn freedom(line: &str) -> Option<Dof> {
    let (node, direction) = line.trim().split_once('.')?;
    Some(Dof {
        node: node.parse().ok()?,
        direction: direction.parse().ok()?,
    })
}

/// Returns true if a file belongs to an analysis by its extension.
pub(super) fn is_calculix_file(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_ascii_lowercase());
    extension.is_some_and(|e| EXTENSIONS.iter().any(|own| e == *own))
}

/// Returns the file and the existing other files of the same analysis.
pub(super) fn analysis_files(path: &Path) -> Vec<PathBuf> {
    if !is_calculix_file(path) {
        return vec![path.to_owned()];
    }
    let mut all = vec![path.to_owned()];
    for other in EXTENSIONS {
        let sibling = path.with_extension(other);
        if sibling != path && sibling.is_file() {
            all.push(sibling);
        }
    }
    all
}

pub(super) fn parse_dof(bytes: &[u8]) -> Result<ParsedFile, ReadProblem> {
    let text = text_of(bytes);
    let mut dofs = Vec::new();
    let mut seen = std::collections::HashMap::new();
    for (k, line) in text
        .lines()
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty())
    {
        let place = format!("line {}", k + 1);
        let dof = freedom(line).ok_or_else(|| {
            ReadProblem::malformed(&place, quoted(line), "NODE.DIRECTION, as 12.3")
        })?;
        if let Some(first) = seen.insert(dof, k + 1) {
            return Err(ReadProblem::malformed(
                &place,
                format!("the freedom {dof} again, after line {first}"),
                "each freedom once",
            ));
        }
        dofs.push(dof);
    }
    Ok(ParsedFile {
        dofs: Some(dofs),
        ..ParsedFile::default()
    })
}

pub(super) fn parse_coordinates(bytes: &[u8]) -> Result<ParsedFile, ReadProblem> {
    let text = text_of(bytes);
    let mut matrix = Triplets::new(0);
    let mut digits = Digits::default();
    for (k, line) in text.lines().map(str::trim_start).enumerate() {
        if line.trim().is_empty() || line.starts_with("**") {
            continue;
        }
        let place = || format!("line {}", k + 1);
        let mut words = words(line);
        let mut index = |what: &str| -> Result<u32, ReadProblem> {
            let expected = format!("a {what} of 1 or more, in `row column value`");
            let found: u64 = whole(words.next().unwrap_or(""), &expected, place)?;
            if found == 0 {
                return Err(ReadProblem::malformed(
                    place(),
                    format!("{what} 0"),
                    expected,
                ));
            }
            rows(found, bytes.len(), &place()).map(|found| found as u32 - 1)
        };
        let (i, j) = (index("row")?, index("column")?);
        let value = last_number(words, &mut digits, "`row column value`", place)?;
        matrix.size = matrix.size.max(i.max(j) as usize + 1);
        matrix.entries.push((i, j, value));
    }
    matrix.precision = digits.precision();
    matrix.detect_triangle();
    Ok(ParsedFile {
        matrices: vec![NamedMatrix {
            name: String::new(),
            role: None,
            matrix,
            dofs: None,
            has_unknown_size: true,
        }],
        ..ParsedFile::default()
    })
}
