//! Escaping of foreign text for terminals, Markdown and shells.

use std::path::Path;

/// Cell of a value that is absent or unknown.
pub const NONE: &str = "–";

/// Returns true if a character can control a terminal. Control characters and marks that change the direction of text
/// can control a terminal.
pub fn is_control(c: char) -> bool {
    c.is_control() || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Escapes control characters, except for line ends and tabs. A title must not clear the screen, and a name must not
/// hide a part of itself.
pub fn escape_controls(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\n' | '\t' => shown.push(c),
            c if is_control(c) => shown.extend(c.escape_unicode()),
            c => shown.push(c),
        }
    }
    shown
}

/// Returns a name on one line, with line ends and tabs as `\n` and `\t`.
pub fn one_line_name(text: &str) -> String {
    escape_controls(text)
        .replace('\n', "\\n")
        .replace('\t', "\\t")
}

/// Returns text on one line for a terminal.
pub fn one_line(text: &str) -> String {
    escape_controls(text).replace('\n', " ")
}

/// Returns `text` as one line of Markdown, and escapes tags, links, images and code. The caller applies [`cell`] to the
/// result for a cell of a table.
pub fn markdown(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for c in one_line(text).chars() {
        match c {
            '\\' | '`' | '<' | '[' => plain.extend(['\\', c]),
            c => plain.push(c),
        }
    }
    plain
}

/// Escapes the bars of a cell of a Markdown table.
pub fn cell(markdown: &str) -> String {
    markdown.replace('|', "\\|")
}

/// Returns a folder as one word of a command, quoted for the shell.
pub fn shell_word(root: &Path) -> String {
    let mut folder = root.display().to_string();
    // The shell command would read a folder that begins with `-` as an option.
    if folder.starts_with('-') {
        folder.insert_str(0, "./");
    }
    match shlex::try_quote(&folder) {
        Ok(word) => word.into_owned(),
        // The quoting fails only on a zero byte, and no path contains a zero byte.
        Err(_) => folder,
    }
}

/// Returns the shell command that continues a run.
pub fn continue_command(root: &Path) -> String {
    format!("fretwear run --run {}", shell_word(root))
}
