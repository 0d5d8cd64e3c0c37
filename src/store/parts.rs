//! Parts of a stage that is being computed: what it has found so far, kept beside the draft until its tables are there.
//!
//! A part counts only under the key of its stage, by the program that wrote it, as it was written, and behind all before it. It is no
//! result: without it the stage is computed from its beginning, to the same bits.

use std::path::{Path, PathBuf};

use super::error::StoreError;
use super::files::Files;
use super::key::StageKey;

/// Ending of the name of a part.
const ENDING: &str = ".part";
/// Most bytes of a part.
const LONGEST: u64 = 1 << 28;
/// Bytes of a hash.
const HASH: usize = 32;

/// Takes the next part; false where it cannot be written, or would leave too little space.
pub type Keep = Box<dyn FnMut(&[u8]) -> bool + Send>;

/// Whether a file is a part of some stage.
pub(super) fn is_part(name: &str) -> bool {
    name.ends_with(ENDING)
}

fn path_of(folder: &Path, key: &StageKey, index: u64) -> PathBuf {
    folder.join(format!("{}.{index}{ENDING}", key.stage()))
}

/// The hash that a part begins with.
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

/// The parts of a stage one after the other, and what takes further ones. Those that do not count are removed.
pub(super) fn open(
    files: &Files,
    folder: &Path,
    key: &StageKey,
) -> Result<(Vec<u8>, Keep), StoreError> {
    let mut kept = Vec::new();
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
        kept.extend(part);
        index += 1;
    }
    remove(files, folder, key.stage(), index)?;
    let (files, folder, key) = (files.clone(), folder.to_owned(), key.clone());
    let keep = move |part: &[u8]| {
        let path = path_of(&folder, &key, index);
        let mut bytes = seal(&key, index, part).as_bytes().to_vec();
        bytes.extend(part);
        index += 1;
        let space = files.require_space(&folder, bytes.len() as u64);
        space
            .and_then(|()| files.write_unsynced(&path, &bytes))
            .is_ok()
    };
    Ok((kept, Box::new(keep)))
}

/// Removes the parts of a stage from `first` on.
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
