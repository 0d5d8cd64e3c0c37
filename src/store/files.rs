//! The file system with the path in every error, and the writes that replace a file in one step.

use super::error::{Damage, DamageKind, StoreError};
use super::file_system::{Entry, EntryKind, FileSystem, LockAttempt, LockGuard, Metadata};
use super::layout::Layout;
use serde::Serialize;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What must stay free beside the bytes to be written: the manifest, the folder entries and the journal of the system.
const SPARE_BYTES: u64 = 1 << 20;

/// Most bytes of a JSON or TOML file of a run: it may hold the text of a long scene.
pub(super) const LONGEST_METADATA: u64 = 64 << 20;

/// Most bytes of a table: some ten columns of numbers on 8192 x 8192 cells, not compressed. Its commit may be a stranger's too, and say
/// of a file without end that it has as many bytes as it has.
pub(super) const LONGEST_TABLE: u64 = 8 << 30;

/// [`FileSystem`] with paths in its errors.
#[derive(Clone)]
pub(super) struct Files(pub Arc<dyn FileSystem>);

impl Files {
    /// Creates a folder so that it is still there after a crash.
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

    /// Writes a file that must not exist, and returns when its content is on the disk.
    pub fn write_new(&self, path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
        self.write_unsynced(path, bytes)?;
        self.sync_file(path)
    }

    /// Writes a file that must not exist. Power loss may cut it.
    pub fn write_unsynced(&self, path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
        self.0
            .write_new(path, bytes)
            .map_err(io_error("write", path))
    }

    pub fn sync_file(&self, path: &Path) -> Result<(), StoreError> {
        self.0.sync_file(path).map_err(io_error("sync", path))
    }

    /// Creates a folder whose loss in a crash would do no harm.
    pub fn make_dir_unsynced(&self, path: &Path) -> Result<(), StoreError> {
        self.0
            .create_dir_all(path)
            .map_err(io_error("create the folder", path))
    }

    /// The content of a file of at most `most` bytes, `None` if there is none.
    fn read_if_there(&self, path: &Path, most: u64) -> Result<Option<Vec<u8>>, StoreError> {
        match self.0.read(path, most) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(io_error("read", path)(error)),
        }
    }

    /// The content of a file of JSON or TOML; one that is not there, or longer than any, is damage.
    pub fn read_metadata(&self, path: &Path) -> Result<Result<Vec<u8>, Damage>, StoreError> {
        self.read_bounded(path, LONGEST_METADATA)
    }

    /// The content of a file of at most `most` bytes; one that is not there, or longer, is damage.
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

    /// The entries of a folder, none if it is not there. A link to a folder is none.
    pub fn list(&self, path: &Path) -> Result<Vec<Entry>, StoreError> {
        match self.look(path)? {
            None => Ok(Vec::new()),
            Some(found) if found.kind == EntryKind::Folder => {
                self.0.list(path).map_err(io_error("list", path))
            }
            Some(found) => Err(StoreError::NotPlain {
                path: path.to_owned(),
                found: found.kind,
                expected: EntryKind::Folder,
            }),
        }
    }

    /// The entries of the folder of a run, which may itself be a link to where its user keeps it.
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

    /// Refuses if fewer bytes are free than are to be written, with some to spare.
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

    /// Takes the lock of a folder by a file in it.
    pub fn lock(&self, path: &Path, folder: &Path) -> Result<Box<dyn LockGuard>, StoreError> {
        match self.0.try_lock(path).map_err(io_error("lock", path))? {
            LockAttempt::Taken(guard) => Ok(guard),
            LockAttempt::Held { pid } => Err(StoreError::Locked {
                path: folder.to_owned(),
                pid,
            }),
        }
    }

    /// Gives a file a new content in one step: a crash leaves the old one or the new one.
    pub fn replace(&self, path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
        self.0
            .replace(&beside(path), path, bytes)
            .map_err(io_error("write", path))?;
        self.sync_dir(path.parent().unwrap_or(Path::new("")))
    }

    /// [`Files::replace`] of what can be had anew: no reader sees half of it, but power loss may cut it.
    pub fn replace_unsynced(&self, path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
        let fresh = beside(path);
        self.remove_file_if_there(&fresh)?;
        self.write_unsynced(&fresh, bytes)?;
        self.rename(&fresh, path)
    }

    /// [`Files::replace`], unless the file has this content already.
    pub fn replace_if_different(&self, path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
        match self.read_metadata(path)? {
            Ok(found) if found == bytes => Ok(()),
            _ => self.replace(path, bytes),
        }
    }

    /// The content of a file if it is as long as it was and has the hash it had.
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

    /// Whether a file is as long as it was and has the hash it had, in the memory of one block.
    pub fn verify(
        &self,
        path: &Path,
        length: u64,
        expected: &str,
    ) -> Result<Result<(), Damage>, StoreError> {
        if let Err(damage) = self.check_length(path, length)? {
            return Ok(Err(damage));
        }
        let found = self.0.hash(path).map_err(io_error("read", path))?;
        Ok(check_hash(path, expected, found.to_hex().to_string()))
    }

    /// Before anything is read: a stranger's file may be of any length, and a device has no end.
    fn check_length(&self, path: &Path, expected: u64) -> Result<Result<(), Damage>, StoreError> {
        let kind = match self.look(path)? {
            None => DamageKind::Missing,
            Some(found) if found.len != expected => DamageKind::Size {
                expected,
                found: found.len,
            },
            Some(_) if expected > LONGEST_TABLE => DamageKind::Unreadable {
                reason: format!("{expected} bytes long; no table has more than {LONGEST_TABLE}"),
            },
            Some(_) => return Ok(Ok(())),
        };
        Ok(Err(Damage {
            path: path.to_owned(),
            kind,
        }))
    }
}

/// Where the new content of a file is written before it takes the place of the old.
fn beside(path: &Path) -> PathBuf {
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

/// The hash of a text or file, 64 hexadecimal digits.
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

/// Readable JSON text of a value, with a newline at its end.
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
