//! Check of a run folder before it is read or changed: no entry may lead outside.
//!
//! A run folder may come from a stranger, or contain links that the user made. Cleaning, writing or even reading
//! through a link would reach files outside the run.

use super::error::StoreError;
use super::file_system::{Entry, EntryKind};
use super::files::Files;
use super::layout::{FILES, FOLDERS, Layout, iteration_of};
use std::io::ErrorKind;
use std::path::Path;

/// Rejects a run folder with a link or a special file where the store would read or write.
pub(super) fn check_folder(files: &Files, layout: &Layout) -> Result<(), StoreError> {
    for entry in files.list_root(layout)? {
        let name = entry.name.as_str();
        if FILES.contains(&name) {
            require(&layout.root, &entry, EntryKind::File)?;
        } else if FOLDERS.contains(&name) {
            require(&layout.root, &entry, EntryKind::Folder)?;
        }
    }
    require_plain(files, &layout.once())?;
    let iterations = layout.iterations();
    for entry in list(files, &iterations)? {
        if iteration_of(&entry.name).is_some() {
            require(&iterations, &entry, EntryKind::Folder)?;
            require_plain(files, &iterations.join(&entry.name))?;
        }
    }
    let staging = layout.staging();
    for entry in list(files, &staging)? {
        reject_special(&staging, &entry)?;
        if entry.kind == EntryKind::Folder {
            require_plain(files, &staging.join(&entry.name))?;
        }
    }
    Ok(())
}

/// Rejects a folder that contains anything but files and folders.
fn require_plain(files: &Files, folder: &Path) -> Result<(), StoreError> {
    let entries = list(files, folder)?;
    entries
        .iter()
        .try_for_each(|entry| reject_special(folder, entry))
}

fn reject_special(folder: &Path, entry: &Entry) -> Result<(), StoreError> {
    match entry.kind {
        EntryKind::File | EntryKind::Folder => Ok(()),
        EntryKind::Link | EntryKind::Other => require(folder, entry, EntryKind::File),
    }
}

fn require(folder: &Path, entry: &Entry, expected: EntryKind) -> Result<(), StoreError> {
    if entry.kind == expected {
        return Ok(());
    }
    Err(StoreError::UnexpectedEntryKind {
        path: folder.join(&entry.name),
        found: entry.kind,
        expected,
    })
}

/// Lists a folder. The list is empty if the folder does not exist or a writer removes the folder meanwhile.
fn list(files: &Files, folder: &Path) -> Result<Vec<Entry>, StoreError> {
    match files.list(folder) {
        Err(StoreError::Io { source, .. }) if source.kind() == ErrorKind::NotFound => {
            Ok(Vec::new())
        }
        result => result,
    }
}
