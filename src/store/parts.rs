//! A part is a partial result of a running stage. The store keeps the parts next to the draft until the tables of the
//! stage are complete.
//!
//! A part is valid only for the same stage key and the same program version. The hash of the part must verify, and all
//! earlier parts must be valid. If the parts are missing, the stage starts anew and computes bit-identical tables.

use std::path::{Path, PathBuf};

use super::error::StoreError;
use super::files::Files;
use super::key::StageKey;

/// File extension of a part.
const ENDING: &str = ".part";
/// Largest size of a partial result in bytes.
const LONGEST: u64 = 1 << 28;
/// Bytes of a hash.
const HASH: usize = 32;

/// Writer of the next part. The writer returns false if writing fails, or if the part would leave too little free space
/// on the disk.
pub type PartWriter = Box<dyn FnMut(&[u8]) -> bool + Send>;

/// True for the file name of a part.
pub(super) fn is_part(name: &str) -> bool {
    name.ends_with(ENDING)
}

fn path_of(folder: &Path, key: &StageKey, index: u64) -> PathBuf {
    folder.join(format!("{}.{index}{ENDING}", key.stage()))
}

/// Computes the hash with which the file of a part begins.
fn seal(key: &StageKey, index: u64, bytes: &[u8]) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    for text in [key.hash(), crate::VERSION] {
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    }
    hasher.update(&index.to_le_bytes());
    hasher.update(bytes);
    hasher.finalize()
}

/// Reads the valid parts of a stage, joined in order, and returns them with a writer of further parts. Removes invalid
/// parts.
pub(super) fn open(
    files: &Files,
    folder: &Path,
    key: &StageKey,
) -> Result<(Vec<u8>, PartWriter), StoreError> {
    let mut content = Vec::new();
    let mut index = 0;
    loop {
        let path = path_of(folder, key, index);
        if !files.is_there(&path)? {
            break;
        }
        let bytes = files.read_bounded(&path, LONGEST)?;
        let part = bytes.ok().and_then(|bytes| {
            let (hash, part) = bytes.split_at_checked(HASH)?;
            (seal(key, index, part).as_bytes() == hash).then(|| part.to_vec())
        });
        let Some(part) = part else {
            break;
        };
        content.extend(part);
        index += 1;
    }
    remove(files, folder, key.stage(), index)?;
    let (files, folder, key) = (files.clone(), folder.to_owned(), key.clone());
    let write_part = move |part: &[u8]| {
        let path = path_of(&folder, &key, index);
        let mut bytes = seal(&key, index, part).as_bytes().to_vec();
        bytes.extend(part);
        index += 1;
        let space = files.require_space(&folder, bytes.len() as u64);
        space
            .and_then(|()| files.write_unsynced(&path, &bytes))
            .is_ok()
    };
    Ok((content, Box::new(write_part)))
}

/// Removes the parts of a stage from index `first` on.
pub(super) fn remove(
    files: &Files,
    folder: &Path,
    stage: &str,
    first: u64,
) -> Result<(), StoreError> {
    for entry in files.list(folder)? {
        let index = entry.name.strip_suffix(ENDING);
        let index = index.and_then(|name| name.strip_prefix(stage)?.strip_prefix('.'));
        let is_before = index
            .and_then(|index| index.parse::<u64>().ok())
            .is_some_and(|index| index < first);
        if index.is_some() && !is_before {
            files.remove_file_if_there(&folder.join(&entry.name))?;
        }
    }
    Ok(())
}
