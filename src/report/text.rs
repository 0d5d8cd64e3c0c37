//! Text that others gave, as it may stand where something reads it.

use std::path::Path;

/// What is not there, or not known.
pub const NONE: &str = "–";

/// True for a character that a terminal obeys rather than shows: controls, and those that turn the direction of what follows.
pub fn is_control(c: char) -> bool {
    c.is_control() || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Text in which nothing is obeyed, line ends and tabs aside: a title must not clear the screen, nor a name hide a part of itself.
pub fn visible(text: &str) -> String {
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

/// A name as a listing shows it: on one line, with line ends and tabs as `\n` and `\t`.
pub fn one_line_name(text: &str) -> String {
    visible(text).replace('\n', "\\n").replace('\t', "\\t")
}

/// Text on one line of a terminal.
pub fn one_line(text: &str) -> String {
    visible(text).replace('\n', " ")
}

/// Text on one line of Markdown, where it begins no tag, link, picture or code. A cell wants [`cell`] besides.
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

/// A cell of a table in Markdown, which a bar would end.
pub fn cell(markdown: &str) -> String {
    markdown.replace('|', "\\|")
}

/// A folder as a word of a command, quoted for the shell.
pub fn word(root: &Path) -> String {
    let mut folder = root.display().to_string();
    // It would be read as an option.
    if folder.starts_with('-') {
        folder.insert_str(0, "./");
    }
    match shlex::try_quote(&folder) {
        Ok(word) => word.into_owned(),
        // No path has a zero byte, which is all that cannot be quoted.
        Err(_) => folder,
    }
}

/// The command that continues a run, as a shell takes it.
pub fn continuation(root: &Path) -> String {
    format!("fretwear run --run {}", word(root))
}
