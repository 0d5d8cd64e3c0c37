//! All text of the program for its user: results go to stdout, everything else to stderr.
//!
//! Titles, keys, names of files and what files say of themselves come from others. What a terminal would obey is shown in its place.
//!
//! A run keeps what was said of it in `log.txt`, each line with its time: nothing reads that, and a log that cannot be written changes
//! nothing.

use std::fmt::Arguments;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::path::Path;
#[cfg(feature = "polars")]
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};

use fretwear::store::{Layout, date};

use fretwear::report::{is_control, visible};
use serde_json::Value;

/// One line on stderr, and in the log. A command does its work where nobody listens any more, or where the disk of its log is full.
pub fn say(text: &str) {
    let _ = io::stderr().write_all(format!("{}\n", visible(text)).as_bytes());
    note(text);
}

/// The log of the run that is computed.
struct Log {
    file: Option<File>,
    /// What was said before there was a run to keep it.
    before: String,
}

/// More than this is not kept until a run is there.
const MOST_BEFORE: usize = 1 << 16;

static LOG: Mutex<Log> = Mutex::new(Log {
    file: None,
    before: String::new(),
});

/// A line in the log alone.
pub fn note(text: &str) {
    let mut log = LOG.lock().unwrap_or_else(PoisonError::into_inner);
    let now = date::now();
    let lines = visible(text);
    let lines = lines.lines().filter(|line| !line.trim().is_empty());
    let lines: String = lines.map(|line| format!("{now}  {line}\n")).collect();
    let Log { file, before } = &mut *log;
    match file {
        Some(file) => drop(file.write_all(lines.as_bytes())),
        None if before.len() < MOST_BEFORE => *before += &lines,
        None => (),
    }
}

/// What is said from now on stands in the log of the run in this folder too, below what earlier starts have left there.
pub fn log_into(run: &Path) {
    let mut log = LOG.lock().unwrap_or_else(PoisonError::into_inner);
    log.file = opened(&Layout::at(run).log()).ok();
    let before = std::mem::take(&mut log.before);
    if let Some(file) = &mut log.file {
        let _ = file.write_all(before.as_bytes());
    }
}

/// The file at its end. Where a run comes from a stranger it may be anything: what is no file of its own is left alone.
fn opened(path: &Path) -> io::Result<File> {
    match fs::symlink_metadata(path) {
        Ok(found) if !found.is_file() => return Err(ErrorKind::InvalidInput.into()),
        _ => (),
    }
    let mut options = OpenOptions::new();
    options.append(true).create(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(
        &mut options,
        libc::O_NOFOLLOW | libc::O_NONBLOCK,
    );
    options.open(path)
}

/// True if a person sees what is said.
pub fn is_watched() -> bool {
    io::stderr().is_terminal()
}

/// Characters that a line of the results may have: as many as `COLUMNS` says, else as the terminal shows; none where there is neither.
pub fn width() -> Option<usize> {
    let given = std::env::var("COLUMNS").ok();
    let given = given.and_then(|text| text.trim().parse().ok());
    given.or_else(terminal_width).filter(|width| *width > 0)
}

#[cfg(unix)]
fn terminal_width() -> Option<usize> {
    // Fails where results go into a file or a pipe.
    let size = rustix::termios::tcgetwinsize(io::stdout()).ok()?;
    Some(size.ws_col.into())
}

#[cfg(not(unix))]
fn terminal_width() -> Option<usize> {
    None
}

/// Text in lines of at most `width` characters, broken between words. A longer word has a line of its own.
pub fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// True if a person can be asked.
pub fn is_asking() -> bool {
    is_watched() && io::stdin().is_terminal()
}

/// What a command prints as its result. Writing does not fail, so that the exit code says what became of the work before it says
/// that nobody could be told: [`Results::end`] knows.
#[derive(Default)]
pub struct Results {
    failed: Option<io::Error>,
}

impl Results {
    /// What `write!` and `writeln!` call.
    pub fn write_fmt(&mut self, text: Arguments) {
        let text = text.to_string();
        note(&text);
        self.put(&visible(&text));
    }

    /// A name and a text beside it, in lines as wide as the terminal.
    pub fn item(&mut self, name: &str, text: &str) {
        self.beside(&format!("  {name:<24} "), text);
    }

    /// A text after what it begins with, its further lines below its first, in lines as wide as the terminal.
    pub fn beside(&mut self, beginning: &str, text: &str) {
        const LEAST: usize = 24;
        let indent = beginning.chars().count();
        let room = width().map_or(usize::MAX, |width| width.saturating_sub(indent).max(LEAST));
        for (k, line) in wrapped(text, room).iter().enumerate() {
            let before = if k == 0 { beginning } else { "" };
            writeln!(self, "{}", format!("{before:<indent$}{line}").trim_end());
        }
    }

    /// One line of JSON.
    pub fn json(&mut self, value: &Value) {
        let mut line = String::new();
        for c in value.to_string().chars() {
            match c {
                // All that JSON lets stand of them is in texts, and below 0x10000.
                c if is_control(c) => line += &format!("\\u{:04x}", c as u32),
                c => line.push(c),
            }
        }
        self.put(&(line + "\n"));
    }

    fn put(&mut self, text: &str) {
        if self.failed.is_none() {
            self.failed = io::stdout().write_all(text.as_bytes()).err();
        }
    }

    /// Why something could not be printed. A reader that has seen enough (`| head`) is no reason.
    pub fn end(self) -> io::Result<()> {
        let flushed = match self.failed {
            None => io::stdout().flush(),
            Some(error) => Err(error),
        };
        match flushed {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
            other => other,
        }
    }
}

/// A program that is started without the terminal: it reads nothing, and what it says is heard by nobody.
#[cfg(feature = "polars")]
pub fn silenced(program: &mut Command) -> &mut Command {
    program
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
}
