//! Input decks joined with the files that they include.

use std::io;
use std::path::{Path, PathBuf};

use super::deck::{self, keyword, option};
use super::{LONGEST_FILE, ReadError, ReadProblem};
use crate::files;

/// Largest depth of nested includes.
const DEEPEST: usize = 32;

/// Reads a file. In a deck, replaces each `*INCLUDE` by the content of its file and joins continued keyword lines.
///
/// The reader first searches an included file in the folder of the outermost deck, like Abaqus and CalculiX. The reader
/// then searches in the folder of the file with the `*INCLUDE`. If the deck includes files, `read_with_includes`
/// returns a description of the line numbers of the included files.
pub(super) fn read_with_includes(path: &Path) -> Result<(Vec<u8>, Option<String>), ReadError> {
    let bytes = bytes_of(path)?;
    if !deck::is(&bytes) {
        return Ok((bytes, None));
    }
    if !has_include(&bytes) {
        return Ok((join_option_lines(bytes), None));
    }
    let mut whole = JoinedDeck {
        bytes: Vec::with_capacity(bytes.len()),
        lines: 0,
        told: Vec::new(),
        open: vec![identity(path)?],
    };
    whole.add(path, &bytes)?;
    let line_note = format!("line numbers include {}", whole.told.join(", "));
    Ok((join_option_lines(whole.bytes), Some(line_note)))
}

/// Moves option lines onto the preceding keyword line if the keyword line ends with a comma. An empty line replaces
/// each moved option line, so that the line numbers stay the same. Lines that are not options, such as names of sets,
/// are data.
fn join_option_lines(bytes: Vec<u8>) -> Vec<u8> {
    let is_open = |line: &[u8]| {
        let line = line.trim_ascii();
        line.starts_with(b"*") && !line.starts_with(b"**") && line.ends_with(b",")
    };
    if !bytes.split(|b| *b == b'\n').any(is_open) {
        return bytes;
    }
    let mut whole = Vec::with_capacity(bytes.len());
    // Number of lines moved onto the keyword line and not yet replaced.
    let mut moved_lines = 0;
    let mut open = false;
    for line in bytes.split_inclusive(|b| *b == b'\n') {
        let text = line.trim_ascii();
        if open && is_option(text) {
            whole.truncate(whole.trim_ascii_end().len());
            whole.extend(b" ");
            whole.extend(text);
            whole.push(b'\n');
            moved_lines += 1;
            open = text.ends_with(b",");
            continue;
        }
        whole.extend(std::iter::repeat_n(b'\n', std::mem::take(&mut moved_lines)));
        whole.extend(line);
        open = is_open(line);
    }
    whole.extend(std::iter::repeat_n(b'\n', moved_lines));
    whole
}

/// Returns true for a line of options: `KEY=VALUE`, or a word that is an option by itself.
fn is_option(line: &[u8]) -> bool {
    const WORDS: [&[u8]; 3] = [b"GENERATE", b"INTERNAL", b"UNSORTED"];
    let first = line.split(|b| *b == b',').next().unwrap_or_default();
    let first = first.trim_ascii();
    first.contains(&b'=') || WORDS.iter().any(|word| first.eq_ignore_ascii_case(word))
}

struct JoinedDeck {
    bytes: Vec<u8>,
    lines: usize,
    told: Vec<String>,
    /// Files that are being included, from the outermost on.
    open: Vec<PathBuf>,
}

impl JoinedDeck {
    fn add(&mut self, path: &Path, bytes: &[u8]) -> Result<(), ReadError> {
        for (k, line) in bytes.split_inclusive(|b| *b == b'\n').enumerate() {
            let text = String::from_utf8_lossy(line);
            if !is_include(&text) {
                let length = self.bytes.len() + line.len();
                if length as u64 > LONGEST_FILE {
                    let reason =
                        format!("with what it includes it has more than {LONGEST_FILE} bytes");
                    return Err(io_error(path, io::Error::other(reason)));
                }
                self.bytes.extend(line);
                self.lines += 1;
                continue;
            }
            let malformed = |found: String, expected: &str| ReadError {
                path: path.to_owned(),
                problem: ReadProblem::malformed(format!("line {}", k + 1), found, expected),
            };
            let name = option(&text, "INPUT").map(|name| name.trim().trim_matches('"'));
            let Some(name) = name.filter(|name| !name.is_empty()) else {
                let expected = "*INCLUDE, INPUT= and a file";
                return Err(malformed(super::text::quoted(&text), expected));
            };
            let near_including = path.with_file_name(name);
            let outermost = self.open.first().map_or(path, PathBuf::as_path);
            let file = outermost.with_file_name(name);
            let is_other = near_including.is_file()
                && file.is_file()
                && identity(&near_including)? != identity(&file)?;
            if is_other {
                let found = format!(
                    "{name}, which matches both {} and {}",
                    file.display(),
                    near_including.display()
                );
                let expected = "a name that is one file: Abaqus and CalculiX search it in the folder where they run";
                return Err(malformed(found, expected));
            }
            let file = if file.is_file() { file } else { near_including };
            if !file.is_file() {
                let found = format!(
                    "{name}, which is no file in {}",
                    outermost.parent().unwrap_or(outermost).display()
                );
                return Err(malformed(
                    found,
                    "the file that *INCLUDE names, from the folder of the deck",
                ));
            }
            let file_identity = identity(&file)?;
            if self.open.contains(&file_identity) {
                let found = format!("{}, which includes this file", file.display());
                return Err(malformed(found, "files that do not include themselves"));
            }
            if self.open.len() == DEEPEST {
                let expected = format!("at most {DEEPEST} files one within the other");
                return Err(malformed(file.display().to_string(), &expected));
            }
            let included = bytes_of(&file)?;
            let first = self.lines + 1;
            self.open.push(file_identity);
            self.add(&file, &included)?;
            self.open.pop();
            if !self.bytes.ends_with(b"\n") {
                self.bytes.push(b'\n');
            }
            self.told
                .push(format!("{name} as lines {first} to {}", self.lines));
        }
        Ok(())
    }
}

fn has_include(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    text.lines().any(is_include)
}

fn is_include(line: &str) -> bool {
    keyword(line) == "*INCLUDE"
}

fn bytes_of(path: &Path) -> Result<Vec<u8>, ReadError> {
    files::read(path, LONGEST_FILE).map_err(|source| io_error(path, source))
}

/// Returns the canonical path, which identifies a file under any name.
fn identity(path: &Path) -> Result<PathBuf, ReadError> {
    path.canonicalize().map_err(|source| io_error(path, source))
}

fn io_error(path: &Path, source: io::Error) -> ReadError {
    ReadError {
        path: path.to_owned(),
        problem: ReadProblem::Io { source },
    }
}
