//! Files that the program names itself, in a folder that may be anybody's.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Gives a file a new content in one step. A link under its name is replaced, and what it leads to stays as it is.
///
/// # Errors
/// Those of the system. What was there before is then still there.
pub(crate) fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut draft = path.as_os_str().to_owned();
    draft.push(".new");
    let draft = PathBuf::from(draft);
    match fs::remove_file(&draft) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
        _ => (),
    }
    let written = File::create_new(&draft)
        .and_then(|mut file| file.write_all(bytes))
        .and_then(|()| fs::rename(&draft, path));
    if written.is_err() {
        // Half a draft serves nobody. That it cannot be removed would say less than why it was not finished.
        drop(fs::remove_file(&draft));
    }
    written
}
