//! Removal of a run.

use std::io::ErrorKind;
use std::path::Path;

use super::error::StoreError;
use super::file_system::{EntryKind, FileSystem, LockAttempt, is_read_failure};
use super::files::{LONGEST_METADATA, io_error};
use super::layout::Layout;
use crate::json::hash;

/// Removes the folder of a run whose scene has the hash `scene_hash`, under the lock of the run. `remove_run` removes a
/// folder without a record, because an interrupted removal leaves a folder without a record. `remove_run` keeps the
/// folder of another run, a link, and a run that another process writes.
///
/// # Errors
/// [`StoreError::Io`].
pub fn remove_run(files: &dyn FileSystem, run: &Path, scene_hash: &str) -> Result<(), StoreError> {
    let metadata = files.metadata(run).map_err(io_error("look at", run))?;
    if metadata.is_none_or(|metadata| metadata.kind != EntryKind::Folder) {
        return Ok(());
    }
    let layout = Layout::at(run);
    let lock = layout.lock();
    let LockAttempt::Taken(_guard) = files.try_lock(&lock).map_err(io_error("lock", &lock))? else {
        return Ok(());
    };
    // Remove `run.json` and `run.copy.json` last, because the two files identify the run in the folder.
    let records = [layout.record_copy(), layout.record()];
    for path in &records {
        let bytes = match files.read(path, LONGEST_METADATA) {
            Err(error) if is_read_failure(&error) => return Err(io_error("read", path)(error)),
            bytes => bytes.unwrap_or_default(),
        };
        let record: Option<serde_json::Value> = serde_json::from_slice(&bytes).ok();
        let scene = record.as_ref().and_then(|record| record.get("scene"));
        if scene.is_some_and(|scene| hash(scene) != scene_hash) {
            return Ok(());
        }
    }
    for entry in files.list(run).map_err(io_error("list", run))? {
        let path = run.join(&entry.name);
        let removed = match entry.kind {
            _ if path == lock || records.contains(&path) => Ok(()),
            EntryKind::Folder => files.remove_dir_all(&path),
            _ => files.remove_file(&path),
        };
        removed.map_err(io_error("remove", &path))?;
    }
    for path in &records {
        match files.remove_file(path) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                return Err(io_error("remove", path)(error));
            }
            _ => (),
        }
    }
    files.remove_dir_all(run).map_err(io_error("remove", run))
}
