//! JSON files that end with a hash of all preceding text. The hash reveals every changed byte of the file.
//!
//! The hash covers the text as it would be without the hash entry. The entry comes last, because a text cannot contain
//! its own hash.

use super::error::{Damage, DamageKind, StoreError};
use super::files::{Files, hash, json};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// End of the text of every JSON object.
const END: &str = "\n}\n";
/// Text between the last value of the object and the hash.
const BEFORE_HASH: &str = ",\n  \"seal\": \"";
/// Text after the hash.
const AFTER_HASH: &str = "\"\n}\n";

/// Serializes an object with at least one key to indented JSON text, and appends its hash.
pub(super) fn sealed(path: &Path, value: &impl Serialize) -> Result<Vec<u8>, StoreError> {
    let mut text = json(path, value)?;
    let seal = hash(&text);
    text.truncate(text.len() - END.len());
    text.extend_from_slice(BEFORE_HASH.as_bytes());
    text.extend_from_slice(seal.as_bytes());
    text.extend_from_slice(AFTER_HASH.as_bytes());
    Ok(text)
}

/// Reads an object from a JSON file with a valid hash. A changed file is damage.
pub(super) fn read_sealed<T: DeserializeOwned>(
    files: &Files,
    path: &Path,
) -> Result<Result<T, Damage>, StoreError> {
    read_optionally_sealed(files, path, |_| true)
}

/// As [`read_sealed`], but `must_have_hash` decides from the content whether a hash is required. A file of another
/// layout may have no hash.
pub(super) fn read_optionally_sealed<T: DeserializeOwned>(
    files: &Files,
    path: &Path,
    must_have_hash: impl FnOnce(&T) -> bool,
) -> Result<Result<T, Damage>, StoreError> {
    let damage = |kind| Damage {
        path: path.to_owned(),
        kind,
    };
    let bytes = match files.read_metadata(path)? {
        Ok(bytes) => bytes,
        Err(damage) => return Ok(Err(damage)),
    };
    Ok(decode(&bytes, must_have_hash).map_err(damage))
}

fn decode<T: DeserializeOwned>(
    bytes: &[u8],
    must_have_hash: impl FnOnce(&T) -> bool,
) -> Result<T, DamageKind> {
    let unreadable = |reason: String| DamageKind::Unreadable { reason };
    let text = str::from_utf8(bytes).map_err(|error| unreadable(error.to_string()))?;
    let parts = text
        .strip_suffix(AFTER_HASH)
        .and_then(|text| text.rsplit_once(BEFORE_HASH));
    if let Some((body, expected)) = parts {
        let found = hash(format!("{body}{END}").as_bytes());
        if found != expected {
            return Err(DamageKind::Hash {
                expected: expected.to_owned(),
                found,
            });
        }
    }
    let value = serde_json::from_str(text).map_err(|error| unreadable(error.to_string()))?;
    if parts.is_none() && must_have_hash(&value) {
        return Err(unreadable("the hash at its end is missing".to_owned()));
    }
    Ok(value)
}
