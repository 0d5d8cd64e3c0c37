//! All text output of the program: results go to stdout, and everything else goes to stderr.
//!
//! Titles, keys, file names and texts in files can contain control characters. fretwear prints control characters as
//! visible text, so that the terminal does not execute the control characters.
//!
//! A run appends the messages about the run to `log.txt`, each line with the time. The program never reads the log, and
//! a log that cannot be written changes nothing.

use std::fmt::Arguments;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::path::Path;
#[cfg(feature = "polars")]
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};

use fretwear::store::{Layout, date};

use fretwear::report::{escape_controls, is_control};
use serde_json::Value;

/// Writes one line to stderr and to the log. `say` ignores errors of writing. A command must finish its work even if
/// stderr is closed or the disk is full.
pub fn say(text: &str) {
    let _ = io::stderr().write_all(format!("{}\n", escape_controls(text)).as_bytes());
    note(text);
}

/// Log of the run that is computed.
struct Log {
    file: Option<File>,
    /// Messages from before the run was opened.
    before: String,
}

/// Limit on the length of the messages that wait for a run \[B\].
const LARGEST_BUFFER: usize = 1 << 16;

static LOG: Mutex<Log> = Mutex::new(Log {
    file: None,
    before: String::new(),
});

/// Writes a line to the log only.
pub fn note(text: &str) {
    let mut log = LOG.lock().unwrap_or_else(PoisonError::into_inner);
    let now = date::now();
    let lines = escape_controls(text);
    let lines = lines.lines().filter(|line| !line.trim().is_empty());
    let lines: String = lines.map(|line| format!("{now}  {line}\n")).collect();
    let Log { file, before } = &mut *log;
    match file {
        Some(file) => drop(file.write_all(lines.as_bytes())),
        None if before.len() < LARGEST_BUFFER => *before += &lines,
        None => (),
    }
}

/// Opens the log in the folder of the run and appends all messages from now on. Earlier content of the log remains.
pub fn log_into(run: &Path) {
    let mut log = LOG.lock().unwrap_or_else(PoisonError::into_inner);
    log.file = open_log(&Layout::at(run).log()).ok();
    let before = std::mem::take(&mut log.before);
    if let Some(file) = &mut log.file {
        let _ = file.write_all(before.as_bytes());
    }
}

/// Opens a log for appending. Rejects anything but a regular file, since the run may come from a stranger.
fn open_log(path: &Path) -> io::Result<File> {
    match fs::symlink_metadata(path) {
        Ok(metadata) if !metadata.is_file() => return Err(ErrorKind::InvalidInput.into()),
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

/// Returns true if stderr is a terminal.
pub fn is_watched() -> bool {
    io::stderr().is_terminal()
}

/// Returns the number of characters per line of the results: from `COLUMNS`, otherwise from the terminal; `None` if
/// neither is known.
pub fn width() -> Option<usize> {
    let columns = std::env::var("COLUMNS").ok();
    let columns = columns.and_then(|text| text.trim().parse().ok());
    columns.or_else(terminal_width).filter(|width| *width > 0)
}

#[cfg(unix)]
fn terminal_width() -> Option<usize> {
    // Fails if stdout is a file or a pipe.
    let size = rustix::termios::tcgetwinsize(io::stdout()).ok()?;
    Some(size.ws_col.into())
}

#[cfg(not(unix))]
fn terminal_width() -> Option<usize> {
    None
}

/// Wraps a text into lines of at most `width` characters between words. A word that is longer than `width` fills a line
/// alone.
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

/// Returns true if the program can ask the user a question.
pub fn is_asking() -> bool {
    is_watched() && io::stdin().is_terminal()
}

/// Results that a command prints. Writing never fails immediately, so that the exit code first reports the result of
/// the work. [`Results::end`] returns the first error.
#[derive(Default)]
pub struct Results {
    failed: Option<io::Error>,
}

impl Results {
    /// Writes formatted text. The macros `write!` and `writeln!` call `write_fmt`.
    pub fn write_fmt(&mut self, text: Arguments) {
        let text = text.to_string();
        note(&text);
        self.put(&escape_controls(&text));
    }

    /// Prints a name and a text next to it, wrapped at the width of the terminal.
    pub fn item(&mut self, name: &str, text: &str) {
        self.aligned(&format!("  {name:<24} "), text);
    }

    /// Prints a text after a `beginning`, wrapped at the width of the terminal. Further lines are aligned with the
    /// text in the first line.
    pub fn aligned(&mut self, beginning: &str, text: &str) {
        const LEAST: usize = 24;
        let indent = beginning.chars().count();
        let room = width().map_or(usize::MAX, |width| width.saturating_sub(indent).max(LEAST));
        for (k, line) in wrapped(text, room).iter().enumerate() {
            let before = if k == 0 { beginning } else { "" };
            writeln!(self, "{}", format!("{before:<indent$}{line}").trim_end());
        }
    }

    /// Prints one line of JSON.
    pub fn json(&mut self, value: &Value) {
        let mut line = String::new();
        for c in value.to_string().chars() {
            match c {
                // JSON allows control characters only in strings, and all of them are below 0x10000.
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

    /// Returns the first error of printing. A closed pipe (`| head`) is not an error.
    pub fn end(self) -> io::Result<()> {
        let flushed = match self.failed {
            None => io::stdout().flush(),
            Some(error) => Err(error),
        };
        match flushed {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
            result => result,
        }
    }
}

/// Disconnects a program from the terminal: it reads nothing, and its output is discarded.
#[cfg(feature = "polars")]
pub fn without_output(program: &mut Command) -> &mut Command {
    program
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
}
