//! Sibling: a run that continues from an iteration of another run.

use super::commit::{Commit, TableEntry};
use super::draft::KeyedEntry;
use super::error::{Damage, DamageKind, StoreError};
use super::file_system::FileSystem;
use super::files::{Files, json};
use super::history;
use super::layout::{COMMIT_FILE, Layout};
use super::open::{self, Opening};
use super::reader::RunReader;
use super::record::{Origin, RunIdentity};
use super::record_file::RecordRead;
use super::run::RunStore;
use super::sealed::{read_sealed, sealed};
use crate::json::{as_read, differences, matches};
use std::path::Path;
use std::sync::Arc;

impl RunStore {
    /// Creates a run that continues from an iteration of another run, possibly with another scene. If the sibling run
    /// exists, the function opens the sibling run. Otherwise the function copies the commits of the source run up to
    /// the iteration. The function does not change the source run.
    ///
    /// # Errors
    /// [`StoreError::NoIteration`] if the source run lacks the iteration; the error lists the iterations of the source
    /// run. [`StoreError::NotInherited`] if the scenes differ in keys that a worn state depends on.
    /// [`StoreError::Damaged`] if the source run is damaged at or before the iteration. [`StoreError::OtherOrigin`] if
    /// the sibling run exists and has another origin. [`StoreError::NoSpace`] if the disk is full. Errors of
    /// [`RunStore::create_or_open`].
    pub fn create_sibling(
        fs: Arc<dyn FileSystem>,
        root: &Path,
        identity: &RunIdentity,
        source: &Path,
        wear_iteration: u64,
    ) -> Result<(RunStore, Opening), StoreError> {
        let run = run_name(source);
        // Open the source run first, because a rejected source run must not leave a new folder behind.
        let source = if has_record(&fs, root)? {
            None
        } else {
            Some(open_source(fs.clone(), identity, source, wear_iteration)?)
        };
        let mut locked = open::lock(fs, root)?;
        if let Some(RecordRead { record, .. }) = &locked.record {
            let has_same_origin = record
                .origin
                .as_ref()
                .is_some_and(|origin| origin.run == run && origin.wear_iteration == wear_iteration);
            if !has_same_origin {
                return Err(StoreError::OtherOrigin {
                    path: root.to_owned(),
                    found: record
                        .origin
                        .as_ref()
                        .map_or("unworn".to_owned(), |origin| {
                            format!("from {}@{}", origin.run, origin.wear_iteration)
                        }),
                    expected: format!("{run}@{wear_iteration}"),
                });
            }
            return RunStore::from_locked(locked, identity);
        }
        let Some(source) = source else {
            return Err(StoreError::Damaged(Damage {
                path: locked.layout.record(),
                kind: DamageKind::Missing,
            }));
        };
        let origin = Origin {
            run,
            wear_iteration,
            commit: sound_commit(&source, wear_iteration)?.hash.clone(),
        };
        let (files, layout) = (&locked.files, &locked.layout);
        // The content is an unfinished copy. The marker is written before the first file of the copy and removed after
        // the record is written.
        files.replace(&layout.copying(), &json(&layout.copying(), &origin)?)?;
        files.remove_dir_if_there(&layout.once())?;
        files.remove_dir_if_there(&layout.iterations())?;
        copy(files, layout, &source, wear_iteration)?;
        let mut inherited_history = source.history()?;
        inherited_history.truncate(wear_iteration as usize + 1);
        history::write(files, layout, &inherited_history)?;
        locked.record = Some(RecordRead {
            record: open::create(files, layout, identity, Some(origin))?,
            damage: None,
        });
        let (store, mut opening) = RunStore::from_locked(locked, identity)?;
        opening.created = true;
        Ok((store, opening))
    }
}

fn has_record(fs: &Arc<dyn FileSystem>, root: &Path) -> Result<bool, StoreError> {
    let layout = Layout::at(root);
    Files(fs.clone()).is_there(&layout.record())
}

/// Opens the source run, if the scene can continue from that iteration.
fn open_source(
    fs: Arc<dyn FileSystem>,
    identity: &RunIdentity,
    source: &Path,
    wear_iteration: u64,
) -> Result<RunReader, StoreError> {
    let source = RunReader::open(fs, source)?;
    let mut keys = differences(&source.record.scene, &as_read(&identity.scene));
    keys.retain(|change| matches(&change.key, &identity.inherited_keys));
    if !keys.is_empty() {
        return Err(StoreError::NotInherited {
            path: source.path().to_owned(),
            keys,
        });
    }
    sound_commit(&source, wear_iteration)?;
    Ok(source)
}

/// Returns the folder name of a run. For a path without a folder name, such as `..`, the function returns the path
/// unchanged.
fn run_name(path: &Path) -> String {
    path.file_name()
        .map_or(path.to_string_lossy(), |name| name.to_string_lossy())
        .into_owned()
}

/// Returns the commit of an iteration, or the damage that makes it unusable.
fn sound_commit(source: &RunReader, wear_iteration: u64) -> Result<&Commit, StoreError> {
    source.commit_of(wear_iteration).map_err(|error| {
        let has_report = source
            .reports
            .iter()
            .any(|report| report.wear_iteration == wear_iteration);
        let damage = source
            .reports
            .iter()
            .flat_map(|report| &report.damage)
            .next();
        match damage {
            Some(damage) if has_report => StoreError::Damaged(damage.clone()),
            _ => error,
        }
    })
}

/// Copies `once/` and the iterations up to `wear_iteration`, verifying each file.
fn copy(
    files: &Files,
    layout: &Layout,
    source: &RunReader,
    wear_iteration: u64,
) -> Result<(), StoreError> {
    let commits: Vec<&Commit> = source
        .commits
        .range(..=wear_iteration)
        .map(|(_, commit)| commit)
        .collect();
    let bytes = commits
        .iter()
        .flat_map(|commit| commit.tables.values().chain(commit.unchained.values()))
        .map(|entry| entry.bytes)
        .sum();
    files.require_space(&layout.root, bytes)?;
    files.make_dir(&layout.once())?;
    files.make_dir(&layout.iterations())?;

    for report in super::chain::check_once(files, &source.layout)? {
        // A damaged table is computed again.
        if report.damage.is_none() {
            let key_file = format!("{}.json", report.table);
            let (from, to) = (source.layout.once(), layout.once());
            let keyed: KeyedEntry =
                read_sealed(files, &from.join(&key_file))?.map_err(StoreError::Damaged)?;
            copy_table(files, &from, &to, &keyed.entry)?;
            let key_path = to.join(&key_file);
            files.write_new(&key_path, &sealed(&key_path, &keyed)?)?;
        }
    }
    files.sync_dir(&layout.once())?;

    for commit in commits {
        let from = source.layout.iteration(commit.wear_iteration);
        let to = layout.iteration(commit.wear_iteration);
        files.make_dir(&to)?;
        for entry in commit.tables.values() {
            copy_table(files, &from, &to, entry)?;
        }
        // Copy the commit unchanged, but omit damaged tables outside the chain of commits. No result depends on tables
        // outside the chain, and the hash of the commit does not include tables outside the chain.
        let mut commit = commit.clone();
        for (name, entry) in std::mem::take(&mut commit.unchained) {
            match copy_table(files, &from, &to, &entry) {
                Ok(()) => drop(commit.unchained.insert(name, entry)),
                Err(StoreError::Damaged(_)) => {}
                Err(error) => return Err(error),
            }
        }
        let manifest = to.join(COMMIT_FILE);
        files.write_new(&manifest, &sealed(&manifest, &commit)?)?;
        files.sync_dir(&to)?;
    }
    files.sync_dir(&layout.iterations())
}

fn copy_table(files: &Files, from: &Path, to: &Path, entry: &TableEntry) -> Result<(), StoreError> {
    let bytes = files
        .read_verified(&from.join(&entry.file), entry.bytes, &entry.blake3)?
        .map_err(StoreError::Damaged)?;
    files.write_new(&to.join(&entry.file), &bytes)
}
