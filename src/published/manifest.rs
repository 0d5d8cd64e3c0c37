//! `published.json`: what is published.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::error::PublishError;
use super::files::{Kind, Naming};
use super::objects::{Found, Objects, Version};

/// Its name.
pub(super) const MANIFEST: &str = "published.json";
/// Bytes of it at most: four hundred thousand files.
pub(super) const LONGEST_MANIFEST: u64 = 64 << 20;
/// Bytes of a file at most: what one request can carry.
pub(super) const LONGEST_FILE: u64 = 4 << 30;
/// Version of the layout.
const FORMAT: u32 = 1;
/// Digits of a hash.
const HASH_DIGITS: usize = 64;

/// Content of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Content {
    pub bytes: u64,
    /// blake3, 64 hexadecimal digits.
    pub hash: String,
}

impl Content {
    pub fn of(bytes: &[u8]) -> Content {
        Content {
            bytes: bytes.len() as u64,
            hash: blake3::hash(bytes).to_hex().to_string(),
        }
    }

    /// The name of the object of a file.
    pub fn object(&self, naming: Naming, path: &str) -> String {
        match naming {
            Naming::Path => path.to_owned(),
            Naming::Hash => format!("content/{}", self.hash),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Manifest {
    format: u32,
    pub kind: Kind,
    /// Version of the program that published last.
    program_version: String,
    /// By their paths in the folder.
    pub files: BTreeMap<String, Content>,
}

impl Manifest {
    pub fn new(kind: Kind) -> Manifest {
        Manifest {
            format: FORMAT,
            kind,
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            files: BTreeMap::new(),
        }
    }

    /// What a place says of itself, with its version; none if nothing is published there.
    pub fn read(objects: &dyn Objects) -> Result<Option<(Manifest, Version)>, PublishError> {
        let damaged = |reason: String| PublishError::Damaged {
            place: objects.place(),
            name: MANIFEST.to_owned(),
            reason,
        };
        let (bytes, version) = match objects.read(MANIFEST, LONGEST_MANIFEST)? {
            Found::Nothing => return Ok(None),
            Found::Longer(bytes) => {
                return Err(damaged(format!(
                    "it has {bytes} bytes, and no publication of this program has more than {LONGEST_MANIFEST}"
                )));
            }
            Found::Object(bytes, version) => (bytes, version),
        };
        let manifest: Manifest = serde_json::from_slice(&bytes)
            .map_err(|error| damaged(format!("it is no list of what is published: {error}")))?;
        if manifest.format != FORMAT {
            return Err(damaged(format!(
                "it has the layout {}, and this program knows {FORMAT}; use version {} of it",
                manifest.format,
                manifest.program_version.escape_debug()
            )));
        }
        manifest.check().map_err(damaged)?;
        Ok(Some((manifest, version)))
    }

    /// Nothing that this program would not have written.
    fn check(&self) -> Result<(), String> {
        for (path, content) in &self.files {
            let told = path.escape_debug();
            if self.kind.naming(path).is_none() {
                return Err(format!(
                    "it names \"{told}\", which is no file of a {}; nothing was fetched",
                    self.kind.name()
                ));
            }
            let hex = |b: u8| b.is_ascii_digit() || (b'a'..=b'f').contains(&b);
            if content.hash.len() != HASH_DIGITS || !content.hash.bytes().all(hex) {
                return Err(format!("the hash of \"{told}\" is none"));
            }
            if content.bytes > LONGEST_FILE {
                return Err(format!(
                    "\"{told}\" is to have {} bytes, and no published file has more than {LONGEST_FILE}",
                    content.bytes
                ));
            }
        }
        let defining = self.kind.defining();
        match self.files.contains_key(defining) {
            true => Ok(()),
            false => Err(format!("it names no {defining}")),
        }
    }

    pub fn to_bytes(&self) -> Vec<u8> {
        let text = serde_json::to_vec_pretty(self);
        text.expect("texts and numbers are JSON")
    }

    /// The object of a file, whose path has been checked.
    pub fn object(&self, path: &str, content: &Content) -> String {
        let naming = self.kind.naming(path).unwrap_or(Naming::Hash);
        content.object(naming, path)
    }

    /// The content of a published file.
    pub fn content(
        &self,
        objects: &dyn Objects,
        path: &str,
        content: &Content,
    ) -> Result<Vec<u8>, PublishError> {
        let name = self.object(path, content);
        let reason = match objects.read(&name, content.bytes)? {
            Found::Object(bytes, _) if Content::of(&bytes) == *content => return Ok(bytes),
            Found::Object(..) => "its content is not what was published (its hash is another)",
            Found::Longer(_) => "it is longer than what was published",
            Found::Nothing => "it is gone",
        };
        Err(PublishError::Damaged {
            place: objects.place(),
            name,
            reason: format!(
                "{reason}; publish again from where it came, in another place if it was changed"
            ),
        })
    }
}
