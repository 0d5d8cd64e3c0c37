//! [`FileSystem`] with the path in every error, and writes that replace a file in one step.

use super::error::{Damage, DamageKind, StoreError};
use super::file_system::{Entry, EntryKind, FileSystem, LockAttempt, LockGuard, Metadata};
use super::layout::Layout;
use serde::Serialize;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Number of bytes that must stay free after a write. The manifest, the folder entries and the journal of the file
/// system need the free bytes.
const SPARE_BYTES: u64 = 1 << 20;

/// Most bytes of a JSON or TOML file of a run. A JSON file of a run may contain the text of a long scene.
pub(super) const LONGEST_METADATA: u64 = 64 << 20;

/// Most bytes of a table: about ten columns of numbers on 8192 x 8192 cells, uncompressed. A stranger's commit could
/// otherwise announce a file of any length.
pub(super) const LONGEST_TABLE: u64 = 8 << 30;

/// Wraps a [`FileSystem`] and adds the path of the file to each error.
#[derive(Clone)]
pub(super) struct Files(pub Arc<dyn FileSystem>);

impl Files {
    /// Creates a folder that survives a crash.
    pub fn make_dir(&self, path: &Path) -> Result<(), StoreError> {
        let mut missing = Vec::new();
        let mut level = Some(path);
        while let Some(folder) = level.filter(|folder| !folder.as_os_str().is_empty()) {
            if self.is_there(folder)? {
                break;
            }
            missing.push(folder);
            level = folder.parent();
        }
        if missing.is_empty() {
            return Ok(());
        }
        self.0
            .create_dir_all(path)
            .map_err(io_error("create the folder", path))?;
        for folder in missing {
            if let Some(parent) = folder.parent() {
                self.sync_dir(parent)?;
            }
        }
        Ok(())
    }

    /// Writes a file that must not exist yet, and syncs it.
    pub fn write_new(&self, path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
        self.write_unsynced(path, bytes)?;
        self.sync_file(path)
    }

    /// Writes a file that must not exist yet. The function does not sync the file, so a power cut may truncate the
    /// file.
    pub fn write_unsynced(&self, path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
        self.0
            .write_new(path, bytes)
            .map_err(io_error("write", path))
    }

    pub fn sync_file(&self, path: &Path) -> Result<(), StoreError> {
        self.0.sync_file(path).map_err(io_error("sync", path))
    }

    /// Creates a folder that may be lost in a crash without harm.
    pub fn make_dir_unsynced(&self, path: &Path) -> Result<(), StoreError> {
        self.0
            .create_dir_all(path)
            .map_err(io_error("create the folder", path))
    }

    /// Reads a file of at most `most` bytes. Returns `None` if the file does not exist.
    fn read_if_there(&self, path: &Path, most: u64) -> Result<Option<Vec<u8>>, StoreError> {
        match self.0.read(path, most) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(io_error("read", path)(error)),
        }
    }

    /// Reads a JSON or TOML file. A missing file, or a file longer than `LONGEST_METADATA`, counts as damage.
    pub fn read_metadata(&self, path: &Path) -> Result<Result<Vec<u8>, Damage>, StoreError> {
        self.read_bounded(path, LONGEST_METADATA)
    }

    /// Reads a file of at most `most` bytes. A missing or longer file is damage.
    pub fn read_bounded(
        &self,
        path: &Path,
        most: u64,
    ) -> Result<Result<Vec<u8>, Damage>, StoreError> {
        match self.0.read(path, most) {
            Ok(bytes) => Ok(Ok(bytes)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Err(missing(path))),
            Err(error) if error.kind() == io::ErrorKind::FileTooLarge => Ok(Err(Damage {
                path: path.to_owned(),
                kind: DamageKind::Unreadable {
                    reason: error.to_string(),
                },
            })),
            Err(error) => Err(io_error("read", path)(error)),
        }
    }

    pub fn rename(&self, from: &Path, to: &Path) -> Result<(), StoreError> {
        self.0.rename(from, to).map_err(io_error("rename", from))
    }

    pub fn sync_dir(&self, path: &Path) -> Result<(), StoreError> {
        // A relative path of one name has the empty parent, which is the working folder.
        let path = if path.as_os_str().is_empty() {
            Path::new(".")
        } else {
            path
        };
        self.0
            .sync_dir(path)
            .map_err(io_error("sync the folder", path))
    }

    pub fn remove_file_if_there(&self, path: &Path) -> Result<(), StoreError> {
        if self.is_there(path)? {
            self.0.remove_file(path).map_err(io_error("remove", path))?;
        }
        Ok(())
    }

    pub fn remove_dir_if_there(&self, path: &Path) -> Result<(), StoreError> {
        if self.is_there(path)? {
            self.0
                .remove_dir_all(path)
                .map_err(io_error("remove the folder", path))?;
        }
        Ok(())
    }

    /// Lists the entries of a folder. A missing folder has no entries. Rejects a link to a folder.
    pub fn list(&self, path: &Path) -> Result<Vec<Entry>, StoreError> {
        match self.look(path)? {
            None => Ok(Vec::new()),
            Some(metadata) if metadata.kind == EntryKind::Folder => {
                self.0.list(path).map_err(io_error("list", path))
            }
            Some(metadata) => Err(StoreError::UnexpectedEntryKind {
                path: path.to_owned(),
                found: metadata.kind,
                expected: EntryKind::Folder,
            }),
        }
    }

    /// Lists the entries of the folder of a run. The user may have made that folder a link.
    pub fn list_root(&self, layout: &Layout) -> Result<Vec<Entry>, StoreError> {
        let root = &layout.root;
        if !self.is_there(root)? {
            return Ok(Vec::new());
        }
        self.0.list(root).map_err(io_error("list", root))
    }

    fn look(&self, path: &Path) -> Result<Option<Metadata>, StoreError> {
        self.0.metadata(path).map_err(io_error("look at", path))
    }

    pub fn is_there(&self, path: &Path) -> Result<bool, StoreError> {
        Ok(self.look(path)?.is_some())
    }

    /// Checks that the disk has space for the bytes and a reserve.
    pub fn require_space(&self, path: &Path, bytes: u64) -> Result<(), StoreError> {
        let free = self
            .0
            .free_space(path)
            .map_err(io_error("ask for the free space of", path))?;
        let needed = bytes + SPARE_BYTES;
        if free < needed {
            return Err(StoreError::NoSpace {
                path: path.to_owned(),
                free,
                needed,
            });
        }
        Ok(())
    }

    /// Locks a folder by means of a file in it.
    pub fn lock(&self, path: &Path, folder: &Path) -> Result<Box<dyn LockGuard>, StoreError> {
        match self.0.try_lock(path).map_err(io_error("lock", path))? {
            LockAttempt::Taken(guard) => Ok(guard),
            LockAttempt::Held { pid } => Err(StoreError::Locked {
                path: folder.to_owned(),
                pid,
            }),
        }
    }

    /// Replaces the content of a file in one step: after a crash the file has the old or the new content.
    pub fn replace(&self, path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
        self.0
            .replace(&new_file_of(path), path, bytes)
            .map_err(io_error("write", path))?;
        self.sync_dir(path.parent().unwrap_or(Path::new("")))
    }

    /// As [`Files::replace`], for content that can be recomputed. No reader sees a partial file, but a power cut may
    /// truncate it.
    pub fn replace_unsynced(&self, path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
        let new_path = new_file_of(path);
        self.remove_file_if_there(&new_path)?;
        self.write_unsynced(&new_path, bytes)?;
        self.rename(&new_path, path)
    }

    /// Replaces the content of a file like [`Files::replace`]. Does nothing if the file already has the content
    /// `bytes`.
    pub fn replace_if_different(&self, path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
        match self.read_metadata(path)? {
            Ok(current) if current == bytes => Ok(()),
            _ => self.replace(path, bytes),
        }
    }

    /// Reads a file and checks the length and the hash of the file. Returns damage if the length or the hash differs
    /// from the expected value.
    pub fn read_verified(
        &self,
        path: &Path,
        length: u64,
        expected: &str,
    ) -> Result<Result<Vec<u8>, Damage>, StoreError> {
        if let Err(damage) = self.check_length(path, length)? {
            return Ok(Err(damage));
        }
        let Some(bytes) = self.read_if_there(path, length)? else {
            return Ok(Err(missing(path)));
        };
        Ok(check_hash(path, expected, hash(&bytes)).map(|()| bytes))
    }

    /// Checks the length and hash of a file block by block.
    pub fn verify(
        &self,
        path: &Path,
        length: u64,
        expected: &str,
    ) -> Result<Result<(), Damage>, StoreError> {
        if let Err(damage) = self.check_length(path, length)? {
            return Ok(Err(damage));
        }
        let computed = self.0.hash(path).map_err(io_error("read", path))?;
        Ok(check_hash(path, expected, computed.to_hex().to_string()))
    }

    /// Checks the length before anything is read: a stranger's file may be of any length, and a device has no end.
    fn check_length(&self, path: &Path, expected: u64) -> Result<Result<(), Damage>, StoreError> {
        let kind = match self.look(path)? {
            None => DamageKind::Missing,
            Some(metadata) if metadata.len != expected => DamageKind::Size {
                expected,
                found: metadata.len,
            },
            Some(_) if expected > LONGEST_TABLE => DamageKind::Unreadable {
                reason: format!("{expected} bytes long, but a table has at most {LONGEST_TABLE}"),
            },
            Some(_) => return Ok(Ok(())),
        };
        Ok(Err(Damage {
            path: path.to_owned(),
            kind,
        }))
    }
}

/// Returns the path of the new content before it replaces the old file.
fn new_file_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".new");
    PathBuf::from(name)
}

fn missing(path: &Path) -> Damage {
    Damage {
        path: path.to_owned(),
        kind: DamageKind::Missing,
    }
}

/// Returns the hash of a text or file, 64 hexadecimal digits.
pub(super) fn hash(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

fn check_hash(path: &Path, expected: &str, found: String) -> Result<(), Damage> {
    if found == expected {
        return Ok(());
    }
    Err(Damage {
        path: path.to_owned(),
        kind: DamageKind::Hash {
            expected: expected.to_owned(),
            found,
        },
    })
}

/// Serializes a value to indented JSON text with a newline at its end.
pub(super) fn json(path: &Path, value: &impl Serialize) -> Result<Vec<u8>, StoreError> {
    let mut text = serde_json::to_vec_pretty(value).map_err(|source| StoreError::Json {
        path: path.to_owned(),
        source,
    })?;
    text.push(b'\n');
    Ok(text)
}

pub(super) fn io_error(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> StoreError {
    let path = path.to_owned();
    move |source| StoreError::Io {
        action,
        path,
        source,
    }
}
