//! Text that others gave, as it may stand where something reads it.

use std::path::Path;

/// The command that continues a run, as a shell takes it.
pub fn continuation(root: &Path) -> String {
    let mut folder = root.display().to_string();
    // It would be read as an option.
    if folder.starts_with('-') {
        folder.insert_str(0, "./");
    }
    match shlex::try_quote(&folder) {
        Ok(word) => format!("fretwear run --run {word}"),
        // No path has a zero byte, which is all that cannot be quoted.
        Err(_) => format!("fretwear run --run {folder}"),
    }
}
