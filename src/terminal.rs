//! All text of the program for its user: results go to stdout, everything else to stderr.
//!
//! Titles, keys, names of files and what files say of themselves come from others. What a terminal would obey is shown in its place.

use std::fmt::Arguments;
use std::io::{self, ErrorKind, IsTerminal, Write};

use fretwear::report::{is_obeyed, visible};
use serde_json::Value;

/// One line on stderr. A command does its work where nobody listens any more, or where the disk of its log is full.
pub fn say(text: &str) {
    let _ = io::stderr().write_all(format!("{}\n", visible(text)).as_bytes());
}

/// True if a person sees what is said.
pub fn is_watched() -> bool {
    io::stderr().is_terminal()
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
        self.put(&visible(&text.to_string()));
    }

    /// One line of JSON.
    pub fn json(&mut self, value: &Value) {
        let mut line = String::new();
        for c in value.to_string().chars() {
            match c {
                // All that JSON lets stand of them is in texts, and below 0x10000.
                c if is_obeyed(c) => line += &format!("\\u{:04x}", c as u32),
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
