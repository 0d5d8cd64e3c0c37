//! Files that the user names, read whole: regular ones only, and none longer than any of its kind.

use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// The bytes of a file of at most `limit` bytes. A link to a file is one.
///
/// # Errors
/// Those of the operating system; [`ErrorKind::InvalidInput`] for what is no regular file, [`ErrorKind::FileTooLarge`] for what
/// is longer.
pub fn read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    // Before it is opened: opening a pipe waits for its other end.
    check(&fs::metadata(path)?, limit)?;
    let file = File::open(path)?;
    // Again, of what is open: the name may stand for something else by now.
    check(&file.metadata()?, limit)?;
    let mut bytes = Vec::new();
    // It may grow while it is read.
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    within(bytes.len() as u64, limit)?;
    Ok(bytes)
}

/// The text of a file of at most `limit` bytes.
///
/// # Errors
/// As [`read`]; [`ErrorKind::InvalidData`] for what is not UTF-8.
pub fn read_text(path: &Path, limit: u64) -> io::Result<String> {
    String::from_utf8(read(path, limit)?).map_err(|e| {
        let place = e.utf8_error().valid_up_to() + 1;
        let reason = format!("byte {place} is not UTF-8 text; save it as UTF-8");
        io::Error::new(ErrorKind::InvalidData, reason)
    })
}

fn check(found: &Metadata, limit: u64) -> io::Result<()> {
    if !found.is_file() {
        let what = if found.is_dir() {
            "a folder"
        } else {
            "a pipe or a device"
        };
        let reason = format!("it is {what}, not a regular file");
        return Err(io::Error::new(ErrorKind::InvalidInput, reason));
    }
    within(found.len(), limit)
}

fn within(length: u64, limit: u64) -> io::Result<()> {
    if length <= limit {
        return Ok(());
    }
    let reason = format!("it has {length} bytes or more; at most {limit} are read");
    Err(io::Error::new(ErrorKind::FileTooLarge, reason))
}
