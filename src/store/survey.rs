//! A look at a run folder before anything of it is believed or touched: nothing in it may lead elsewhere.
//!
//! A run folder may have been copied from a stranger, or be partly links of its own user. To clean, write or even read through a
//! link would reach files that are not the run's.

use super::error::StoreError;
use super::file_system::{Entry, EntryKind};
use super::files::Files;
use super::layout::{FILES, FOLDERS, Layout, iteration_of};
use std::io::ErrorKind;
use std::path::Path;

/// Refuses a run folder in which a link, or what is neither file nor folder, stands where the store would read or write.
pub(super) fn survey(files: &Files, layout: &Layout) -> Result<(), StoreError> {
    for entry in files.list_root(layout)? {
        let name = entry.name.as_str();
        if FILES.contains(&name) {
            require(&layout.root, &entry, EntryKind::File)?;
        } else if FOLDERS.contains(&name) {
            require(&layout.root, &entry, EntryKind::Folder)?;
        }
    }
    plain(files, &layout.once())?;
    let iterations = layout.iterations();
    for entry in list(files, &iterations)? {
        if iteration_of(&entry.name).is_some() {
            require(&iterations, &entry, EntryKind::Folder)?;
            plain(files, &iterations.join(&entry.name))?;
        }
    }
    let staging = layout.staging();
    for entry in list(files, &staging)? {
        refuse(&staging, &entry)?;
        if entry.kind == EntryKind::Folder {
            plain(files, &staging.join(&entry.name))?;
        }
    }
    Ok(())
}

/// Refuses a folder that holds anything but files and folders.
fn plain(files: &Files, folder: &Path) -> Result<(), StoreError> {
    let entries = list(files, folder)?;
    entries.iter().try_for_each(|entry| refuse(folder, entry))
}

fn refuse(folder: &Path, entry: &Entry) -> Result<(), StoreError> {
    match entry.kind {
        EntryKind::File | EntryKind::Folder => Ok(()),
        EntryKind::Link | EntryKind::Other => require(folder, entry, EntryKind::File),
    }
}

fn require(folder: &Path, entry: &Entry, expected: EntryKind) -> Result<(), StoreError> {
    if entry.kind == expected {
        return Ok(());
    }
    Err(StoreError::NotPlain {
        path: folder.join(&entry.name),
        found: entry.kind,
        expected,
    })
}

/// The entries of a folder; none of one that is not there, or that a writer removes meanwhile.
fn list(files: &Files, folder: &Path) -> Result<Vec<Entry>, StoreError> {
    match files.list(folder) {
        Err(StoreError::Io { source, .. }) if source.kind() == ErrorKind::NotFound => {
            Ok(Vec::new())
        }
        other => other,
    }
}
