//! Decks with the files that they include, as one text.

use std::io;
use std::path::{Path, PathBuf};

use super::deck::{self, keyword, option};
use super::{LONGEST_FILE, ReadError, ReadProblem};
use crate::files;

/// Most files that are open one within the other.
const DEEPEST: usize = 32;

/// The bytes of a file; of a deck with each `*INCLUDE` replaced by its file, which is looked for from the folder of the outermost deck, where Abaqus and CalculiX
/// run, and then from that of the file that names it; and with the lines joined over which a keyword and its options go on after a comma.
/// With them what is told of the count of lines, if there are any.
pub(super) fn read(path: &Path) -> Result<(Vec<u8>, Option<String>), ReadError> {
    let bytes = bytes_of(path)?;
    if !deck::is(&bytes) {
        return Ok((bytes, None));
    }
    if !has_include(&bytes) {
        return Ok((joined(bytes), None));
    }
    let mut whole = Whole {
        bytes: Vec::with_capacity(bytes.len()),
        lines: 0,
        told: Vec::new(),
        open: vec![identity(path)?],
    };
    whole.add(path, &bytes)?;
    let told = format!("lines are counted with {}", whole.told.join(", "));
    Ok((joined(whole.bytes), Some(told)))
}

/// With the options below a keyword's line that ends with a comma moved onto it; empty lines take their places. Other lines below it are data, as the names of
/// sets are.
fn joined(bytes: Vec<u8>) -> Vec<u8> {
    let is_open = |line: &[u8]| {
        let line = line.trim_ascii();
        line.starts_with(b"*") && !line.starts_with(b"**") && line.ends_with(b",")
    };
    if !bytes.split(|b| *b == b'\n').any(is_open) {
        return bytes;
    }
    let mut whole = Vec::with_capacity(bytes.len());
    // Lines that the keyword's line has taken, still to be made up for.
    let mut taken = 0;
    let mut open = false;
    for line in bytes.split_inclusive(|b| *b == b'\n') {
        let text = line.trim_ascii();
        if open && is_option(text) {
            whole.truncate(whole.trim_ascii_end().len());
            whole.extend(b" ");
            whole.extend(text);
            whole.push(b'\n');
            taken += 1;
            open = text.ends_with(b",");
            continue;
        }
        whole.extend(std::iter::repeat_n(b'\n', std::mem::take(&mut taken)));
        whole.extend(line);
        open = is_open(line);
    }
    whole.extend(std::iter::repeat_n(b'\n', taken));
    whole
}

/// Whether a line is one of options: `KEY=VALUE`, or one of the words that are options by themselves.
fn is_option(line: &[u8]) -> bool {
    const WORDS: [&[u8]; 3] = [b"GENERATE", b"INTERNAL", b"UNSORTED"];
    let first = line.split(|b| *b == b',').next().unwrap_or_default();
    let first = first.trim_ascii();
    first.contains(&b'=') || WORDS.iter().any(|word| first.eq_ignore_ascii_case(word))
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
            let here = path.with_file_name(name);
            let outermost = self.open.first().map_or(path, PathBuf::as_path);
            let file = outermost.with_file_name(name);
            let is_other = here.is_file() && file.is_file() && identity(&here)? != identity(&file)?;
            if is_other {
                let found = format!(
                    "{name}, which {} and {} are",
                    file.display(),
                    here.display()
                );
                let expected = "a name that is one file: Abaqus and CalculiX take it from the folder that they run in";
                return Err(wrong(found, expected));
            }
            let file = if file.is_file() { file } else { here };
            if !file.is_file() {
                let found = format!(
                    "{name}, which is no file in {}",
                    outermost.parent().unwrap_or(outermost).display()
                );
                return Err(wrong(
                    found,
                    "the file that *INCLUDE names, from the folder of the deck",
                ));
            }
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
