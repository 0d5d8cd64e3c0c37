//! File system that syncs a run once, at its end.

use super::error::StoreError;
use super::file_system::{Entry, EntryKind, FileSystem, LockAttempt, Metadata};
use super::files::io_error;
use std::io;
use std::path::Path;
use std::sync::Arc;

/// A file system without syncing. Other processes can read all written data, even after the writing process is killed.
/// A power cut may truncate files.
pub struct UnsyncedFileSystem(pub Arc<dyn FileSystem>);

impl FileSystem for UnsyncedFileSystem {
    fn create_dir_all(&self, path: &Path) -> io::Result<()> {
        self.0.create_dir_all(path)
    }

    fn write_new(&self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        self.0.write_new(path, bytes)
    }

    fn sync_file(&self, _path: &Path) -> io::Result<()> {
        Ok(())
    }

    fn read(&self, path: &Path, most: u64) -> io::Result<Vec<u8>> {
        self.0.read(path, most)
    }

    fn hash(&self, path: &Path) -> io::Result<blake3::Hash> {
        self.0.hash(path)
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.0.rename(from, to)
    }

    fn sync_dir(&self, _path: &Path) -> io::Result<()> {
        Ok(())
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        self.0.remove_file(path)
    }

    fn remove_dir_all(&self, path: &Path) -> io::Result<()> {
        self.0.remove_dir_all(path)
    }

    fn list(&self, path: &Path) -> io::Result<Vec<Entry>> {
        self.0.list(path)
    }

    fn metadata(&self, path: &Path) -> io::Result<Option<Metadata>> {
        self.0.metadata(path)
    }

    fn free_space(&self, path: &Path) -> io::Result<u64> {
        self.0.free_space(path)
    }

    fn try_lock(&self, path: &Path) -> io::Result<LockAttempt> {
        self.0.try_lock(path)
    }
}

/// Number of parent folders that a start may have created, as `runs` of `runs/NAME`. They are synced too.
const PARENT_FOLDERS: usize = 2;

/// Syncs a run folder with all files and subfolders. The function syncs each file before the folder that contains the
/// file.
///
/// # Errors
/// [`StoreError::Io`]
pub fn sync_all(files: &dyn FileSystem, root: &Path) -> Result<(), StoreError> {
    sync_below(files, root)?;
    for folder in root.ancestors().skip(1).take(PARENT_FOLDERS) {
        let folder = match folder.as_os_str().is_empty() {
            true => Path::new("."),
            false => folder,
        };
        let outcome = files.sync_dir(folder);
        outcome.map_err(io_error("sync the folder", folder))?;
    }
    Ok(())
}

fn sync_below(files: &dyn FileSystem, folder: &Path) -> Result<(), StoreError> {
    for entry in files.list(folder).map_err(io_error("list", folder))? {
        let path = folder.join(&entry.name);
        match entry.kind {
            EntryKind::Folder => sync_below(files, &path)?,
            EntryKind::File => files.sync_file(&path).map_err(io_error("sync", &path))?,
            EntryKind::Link | EntryKind::Other => (),
        }
    }
    let outcome = files.sync_dir(folder);
    outcome.map_err(io_error("sync the folder", folder))
}
