//! The folder of a rehearsal, which is nowhere but in memory.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::store::{Entry, EntryKind, FileSystem, LockAttempt, LockGuard, Metadata};

/// Files by path; a folder has no content.
#[derive(Default)]
pub(super) struct FilesInMemory(Mutex<BTreeMap<PathBuf, Option<Vec<u8>>>>);

struct Unlocked;
impl LockGuard for Unlocked {}

fn error(kind: io::ErrorKind, path: &Path) -> io::Error {
    io::Error::new(kind, path.display().to_string())
}

impl FilesInMemory {
    /// What was there before a rehearsal that was broken off is there still.
    fn files(&self) -> MutexGuard<'_, BTreeMap<PathBuf, Option<Vec<u8>>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn content(&self, path: &Path) -> io::Result<Vec<u8>> {
        let files = self.files();
        let content = files.get(path).and_then(Option::as_ref).cloned();
        content.ok_or_else(|| error(io::ErrorKind::NotFound, path))
    }
}

impl FileSystem for FilesInMemory {
    fn create_dir_all(&self, path: &Path) -> io::Result<()> {
        let mut files = self.files();
        for folder in path.ancestors() {
            files.entry(folder.to_owned()).or_default();
        }
        Ok(())
    }

    fn write_new(&self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        match self.files().insert(path.to_owned(), Some(bytes.to_vec())) {
            None => Ok(()),
            Some(_) => Err(error(io::ErrorKind::AlreadyExists, path)),
        }
    }

    fn sync_file(&self, _path: &Path) -> io::Result<()> {
        Ok(())
    }

    fn read(&self, path: &Path, most: u64) -> io::Result<Vec<u8>> {
        let content = self.content(path)?;
        if content.len() as u64 > most {
            return Err(error(io::ErrorKind::FileTooLarge, path));
        }
        Ok(content)
    }

    fn hash(&self, path: &Path) -> io::Result<blake3::Hash> {
        Ok(blake3::hash(&self.content(path)?))
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        let mut files = self.files();
        let within = |path: &&PathBuf| path.starts_with(from);
        let moved: Vec<PathBuf> = files.keys().filter(within).cloned().collect();
        if moved.is_empty() {
            return Err(error(io::ErrorKind::NotFound, from));
        }
        for path in moved {
            let content = files.remove(&path).flatten();
            let below = path.strip_prefix(from).unwrap_or(Path::new(""));
            let target = match below.as_os_str().is_empty() {
                true => to.to_owned(),
                false => to.join(below),
            };
            files.insert(target, content);
        }
        Ok(())
    }

    fn sync_dir(&self, _path: &Path) -> io::Result<()> {
        Ok(())
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        let removed = self.files().remove(path);
        removed
            .map(drop)
            .ok_or_else(|| error(io::ErrorKind::NotFound, path))
    }

    fn remove_dir_all(&self, path: &Path) -> io::Result<()> {
        self.files().retain(|file, _| !file.starts_with(path));
        Ok(())
    }

    fn list(&self, path: &Path) -> io::Result<Vec<Entry>> {
        let files = self.files();
        if !files.contains_key(path) {
            return Err(error(io::ErrorKind::NotFound, path));
        }
        let inside = files
            .iter()
            .filter(|(file, _)| file.parent() == Some(path))
            .map(|(file, content)| Entry {
                name: file
                    .file_name()
                    .unwrap_or_default()
                    .to_string_lossy()
                    .into_owned(),
                kind: kind(content),
            });
        Ok(inside.collect())
    }

    fn metadata(&self, path: &Path) -> io::Result<Option<Metadata>> {
        Ok(self.files().get(path).map(|content| Metadata {
            len: content.as_ref().map_or(0, Vec::len) as u64,
            kind: kind(content),
        }))
    }

    fn free_space(&self, _path: &Path) -> io::Result<u64> {
        Ok(u64::MAX)
    }

    fn try_lock(&self, _path: &Path) -> io::Result<LockAttempt> {
        Ok(LockAttempt::Taken(Box::new(Unlocked)))
    }
}

fn kind(content: &Option<Vec<u8>>) -> EntryKind {
    match content {
        Some(_) => EntryKind::File,
        None => EntryKind::Folder,
    }
}
