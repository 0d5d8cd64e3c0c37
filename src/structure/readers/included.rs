//! Decks with the files that they include, as one text.

use std::io;
use std::path::{Path, PathBuf};

use super::deck::{self, keyword, option};
use super::{LONGEST_FILE, ReadError, ReadProblem};
use crate::files;

/// Most files that are open one within the other.
const DEEPEST: usize = 32;

/// The bytes of a file; of a deck with each `*INCLUDE` replaced by its file, which is looked for from the folder of the deck that names it.
/// With them what is told of the count of lines, if there are any.
pub(super) fn read(path: &Path) -> Result<(Vec<u8>, Option<String>), ReadError> {
    let bytes = bytes_of(path)?;
    if !deck::is(&bytes) || !has_include(&bytes) {
        return Ok((bytes, None));
    }
    let mut whole = Whole {
        bytes: Vec::with_capacity(bytes.len()),
        lines: 0,
        told: Vec::new(),
        open: vec![identity(path)?],
    };
    whole.add(path, &bytes)?;
    let told = format!("lines are counted with {}", whole.told.join(", "));
    Ok((whole.bytes, Some(told)))
}

struct Whole {
    bytes: Vec<u8>,
    lines: usize,
    told: Vec<String>,
    /// The files that are being included, from the outermost on.
    open: Vec<PathBuf>,
}

impl Whole {
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
            let wrong = |found: String, expected: &str| ReadError {
                path: path.to_owned(),
                problem: ReadProblem::malformed(format!("line {}", k + 1), found, expected),
            };
            let name = option(&text, "INPUT").map(|name| name.trim().trim_matches('"'));
            let Some(name) = name.filter(|name| !name.is_empty()) else {
                let expected = "*INCLUDE, INPUT= and a file";
                return Err(wrong(super::text::shown(&text), expected));
            };
            let file = path.with_file_name(name);
            let own = identity(&file)?;
            if self.open.contains(&own) {
                let found = format!("{}, which includes this file", file.display());
                return Err(wrong(found, "files that do not include themselves"));
            }
            if self.open.len() == DEEPEST {
                let expected = format!("at most {DEEPEST} files one within the other");
                return Err(wrong(file.display().to_string(), &expected));
            }
            let included = bytes_of(&file)?;
            let first = self.lines + 1;
            self.open.push(own);
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

/// By which a file is known again, whatever it is called.
fn identity(path: &Path) -> Result<PathBuf, ReadError> {
    path.canonicalize().map_err(|source| io_error(path, source))
}

fn io_error(path: &Path, source: io::Error) -> ReadError {
    ReadError {
        path: path.to_owned(),
        problem: ReadProblem::Io { source },
    }
}
