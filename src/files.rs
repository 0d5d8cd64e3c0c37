//! Reading of whole files that the user names. The functions read only regular files, and reject files above a limit of
//! length.

use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// Reads the bytes of a file of at most `limit` bytes. Links to files are followed.
///
/// # Errors
/// Returns errors of the operating system, [`ErrorKind::InvalidInput`] for anything but a regular file, and
/// [`ErrorKind::FileTooLarge`] for a longer file.
pub fn read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    // Checks before opening, because opening a pipe waits for its other end.
    check(&fs::metadata(path)?, limit)?;
    let file = File::open(path)?;
    // Checks the open file again, because the name may now belong to another file.
    check(&file.metadata()?, limit)?;
    let mut bytes = Vec::new();
    // Reads at most one byte more than `limit`, because the file may grow during the read.
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    within(bytes.len() as u64, limit)?;
    Ok(bytes)
}

/// Reads the text of a file of at most `limit` bytes.
///
/// # Errors
/// Returns the errors of [`read`], and [`ErrorKind::InvalidData`] for text that is not UTF-8.
pub fn read_text(path: &Path, limit: u64) -> io::Result<String> {
    String::from_utf8(read(path, limit)?).map_err(|e| {
        let place = e.utf8_error().valid_up_to() + 1;
        let reason = format!("byte {place} is not UTF-8 text; save it as UTF-8");
        io::Error::new(ErrorKind::InvalidData, reason)
    })
}

fn check(metadata: &Metadata, limit: u64) -> io::Result<()> {
    if !metadata.is_file() {
        let kind = if metadata.is_dir() {
            "a folder"
        } else {
            "a pipe or a device"
        };
        let reason = format!("it is {kind}, not a regular file");
        return Err(io::Error::new(ErrorKind::InvalidInput, reason));
    }
    within(metadata.len(), limit)
}

fn within(length: u64, limit: u64) -> io::Result<()> {
    if length <= limit {
        return Ok(());
    }
    let reason = format!("it has {length} bytes or more; at most {limit} are read");
    Err(io::Error::new(ErrorKind::FileTooLarge, reason))
}
