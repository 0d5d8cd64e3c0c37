//! The file system with the path in every error, the paths of a run, and the writes that replace a file in one step.

use super::canonical::hash;
use super::error::{Damage, DamageKind, StoreError};
use super::file_system::{Entry, FileSystem, LockAttempt, LockGuard};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What must stay free beside the bytes to be written: the manifest, the folder entries and the journal of the system.
const SPARE_BYTES: u64 = 1 << 20;

const ITERATION_PREFIX: &str = "wear_iteration=";

/// The paths of a run.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    pub root: PathBuf,
}

impl Layout {
    pub fn scene(&self) -> PathBuf {
        self.root.join("scene.toml")
    }
    pub fn plan(&self) -> PathBuf {
        self.root.join("plan.json")
    }
    pub fn record(&self) -> PathBuf {
        self.root.join("run.json")
    }
    /// There while the beginning of a sibling is being copied.
    pub fn copying(&self) -> PathBuf {
        self.root.join("copying.json")
    }
    pub fn lock(&self) -> PathBuf {
        self.root.join("lock")
    }
    pub fn once(&self) -> PathBuf {
        self.root.join("once")
    }
    pub fn iterations(&self) -> PathBuf {
        self.root.join("iterations")
    }
    pub fn iteration(&self, wear_iteration: u64) -> PathBuf {
        self.iterations().join(iteration_name(wear_iteration))
    }
    pub fn commit(&self, wear_iteration: u64) -> PathBuf {
        self.iteration(wear_iteration).join(COMMIT_FILE)
    }
    pub fn staging(&self) -> PathBuf {
        self.root.join("staging")
    }
    pub fn draft(&self, wear_iteration: u64) -> PathBuf {
        self.staging().join(iteration_name(wear_iteration))
    }
    /// The keys of a draft's tables, beside the draft so that its folder can be renamed as it is.
    pub fn draft_keys(&self, wear_iteration: u64) -> PathBuf {
        self.staging().join(format!("keys-{wear_iteration}"))
    }
    pub fn staged_once(&self) -> PathBuf {
        self.staging().join("once")
    }
    pub fn discarded(&self) -> PathBuf {
        self.staging().join("discarded")
    }
    pub fn damaged(&self) -> PathBuf {
        self.root.join("damaged")
    }
}

/// Name of the manifest in an iteration's folder.
pub(super) const COMMIT_FILE: &str = "commit.json";

/// The folder name of an iteration, as readers of partitioned tables want it: not padded.
pub(super) fn iteration_name(wear_iteration: u64) -> String {
    format!("{ITERATION_PREFIX}{wear_iteration}")
}

/// The iteration of a folder name.
pub(super) fn iteration_of(name: &str) -> Option<u64> {
    let number = name.strip_prefix(ITERATION_PREFIX)?.parse().ok()?;
    (iteration_name(number) == name).then_some(number)
}

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

    pub fn read(&self, path: &Path) -> Result<Vec<u8>, StoreError> {
        self.0.read(path).map_err(io_error("read", path))
    }

    /// The content of a file, `None` if there is none.
    pub fn read_if_there(&self, path: &Path) -> Result<Option<Vec<u8>>, StoreError> {
        match self.0.read(path) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
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

    /// The entries of a folder, none if it is not there.
    pub fn list(&self, path: &Path) -> Result<Vec<Entry>, StoreError> {
        if !self.is_there(path)? {
            return Ok(Vec::new());
        }
        self.0.list(path).map_err(io_error("list", path))
    }

    pub fn is_there(&self, path: &Path) -> Result<bool, StoreError> {
        self.0
            .metadata(path)
            .map(|found| found.is_some())
            .map_err(io_error("look at", path))
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

    pub fn lock(&self, layout: &Layout) -> Result<Box<dyn LockGuard>, StoreError> {
        let path = layout.lock();
        match self.0.try_lock(&path).map_err(io_error("lock", &path))? {
            LockAttempt::Taken(guard) => Ok(guard),
            LockAttempt::Held { pid } => Err(StoreError::Locked {
                path: layout.root.clone(),
                pid,
            }),
        }
    }

    /// Gives a file a new content in one step: a crash leaves the old one or the new one.
    pub fn replace(&self, path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
        let mut name = path.as_os_str().to_owned();
        name.push(".new");
        let fresh = PathBuf::from(name);
        self.remove_file_if_there(&fresh)?;
        self.write_new(&fresh, bytes)?;
        self.rename(&fresh, path)?;
        self.sync_dir(path.parent().unwrap_or(Path::new("")))
    }

    /// [`Files::replace`], unless the file has this content already.
    pub fn replace_if_different(&self, path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
        if self.read_if_there(path)?.as_deref() == Some(bytes) {
            return Ok(());
        }
        self.replace(path, bytes)
    }

    /// The value in a JSON file; what is there but cannot be understood is damage.
    pub fn read_json<T: DeserializeOwned>(
        &self,
        path: &Path,
    ) -> Result<Result<T, Damage>, StoreError> {
        let damage = |kind| Damage {
            path: path.to_owned(),
            kind,
        };
        Ok(match self.read_if_there(path)? {
            None => Err(damage(DamageKind::Missing)),
            Some(bytes) => serde_json::from_slice(&bytes).map_err(|error| {
                damage(DamageKind::Unreadable {
                    reason: error.to_string(),
                })
            }),
        })
    }

    /// The content of a file if it is as long as it was and has the hash it had.
    pub fn read_verified(
        &self,
        path: &Path,
        length: u64,
        expected: &str,
    ) -> Result<Result<Vec<u8>, Damage>, StoreError> {
        let damage = |kind| {
            Ok(Err(Damage {
                path: path.to_owned(),
                kind,
            }))
        };
        let Some(bytes) = self.read_if_there(path)? else {
            return damage(DamageKind::Missing);
        };
        if bytes.len() as u64 != length {
            return damage(DamageKind::Size {
                expected: length,
                found: bytes.len() as u64,
            });
        }
        let found = hash(&bytes);
        if found != expected {
            return damage(DamageKind::Hash {
                expected: expected.to_owned(),
                found,
            });
        }
        Ok(Ok(bytes))
    }
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

fn io_error(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> StoreError {
    let path = path.to_owned();
    move |source| StoreError::Io {
        action,
        path,
        source,
    }
}
