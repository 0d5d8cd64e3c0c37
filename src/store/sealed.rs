//! JSON files that end with the hash of all that stands before it, so that no byte of them changes unnoticed.
//!
//! The hash is that of the text as it would end without it. It stands last because a text cannot hold its own hash.

use super::error::{Damage, DamageKind, StoreError};
use super::files::{Files, hash, json};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// What the readable text of every JSON object ends with.
const END: &str = "\n}\n";
/// What stands between the last value of the object and the hash.
const BEFORE_HASH: &str = ",\n  \"seal\": \"";
/// What stands after the hash.
const AFTER_HASH: &str = "\"\n}\n";

/// The readable JSON text of an object that has at least one key, with the hash of it at its end.
pub(super) fn sealed(path: &Path, value: &impl Serialize) -> Result<Vec<u8>, StoreError> {
    let mut text = json(path, value)?;
    let seal = hash(&text);
    text.truncate(text.len() - END.len());
    text.extend_from_slice(BEFORE_HASH.as_bytes());
    text.extend_from_slice(seal.as_bytes());
    text.extend_from_slice(AFTER_HASH.as_bytes());
    Ok(text)
}

/// The object in a JSON file, if it has the hash that it must have; what is there but is not as it was written is damage.
pub(super) fn read_sealed<T: DeserializeOwned>(
    files: &Files,
    path: &Path,
) -> Result<Result<T, Damage>, StoreError> {
    read_to_judge(files, path, |_| true)
}

/// As [`read_sealed`], where what the object says decides whether it must have a hash: another layout may have none.
pub(super) fn read_to_judge<T: DeserializeOwned>(
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
    Ok(opened(&bytes, must_have_hash).map_err(damage))
}

fn opened<T: DeserializeOwned>(
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
        return Err(unreadable("the hash at its end is not there".to_owned()));
    }
    Ok(value)
}
