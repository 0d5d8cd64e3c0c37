//! A run as a reader sees it.

use super::canonical::hash;
use super::chain::{self, Chain, CommitReport, VerifyReport};
use super::commit::Commit;
use super::draft::{KeyedEntry, read_entry};
use super::error::{Damage, DamageKind, StoreError};
use super::file_system::{FileSystem, LockHolder, RealFileSystem};
use super::files::{Files, Layout};
use super::record::{RUN_FORMAT, RunRecord, seal_of};
use super::sealed::{Seal, read_sealed, read_to_judge};
use super::survey::survey;
use crate::tables::{Table, TableName, TypedTable, provenance_of};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A run open for reading. Needs no lock: what is committed does not change.
pub struct RunReader {
    pub(super) files: Files,
    pub(super) layout: Layout,
    pub(super) record: RunRecord,
    pub(super) commits: BTreeMap<u64, Commit>,
    pub(super) reports: Vec<CommitReport>,
}

impl RunReader {
    /// Opens a run and verifies its iterations. Those after the first that is damaged do not count.
    ///
    /// # Errors
    /// [`StoreError::NoRun`], [`StoreError::NotPlain`] for a folder with links in it, [`StoreError::Damaged`] for a `run.json` that
    /// neither reads nor has a copy that does, [`StoreError::Format`], [`StoreError::Io`].
    pub fn open(fs: Arc<dyn FileSystem>, root: &Path) -> Result<RunReader, StoreError> {
        let files = Files(fs);
        let layout = Layout {
            root: root.to_owned(),
        };
        survey(&files, &layout)?;
        let (record, chain) = walk_beside_a_writer(&files, &layout)?;
        Ok(RunReader {
            files,
            layout,
            record,
            commits: chain.sound,
            reports: chain.reports,
        })
    }

    /// The folder of the run.
    pub fn path(&self) -> &Path {
        &self.layout.root
    }

    /// The content of `run.json`.
    pub fn record(&self) -> &RunRecord {
        &self.record
    }

    /// What was decided from the scene, the content of `plan.json`; `None` if it is not there or cannot be read.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn plan(&self) -> Result<Option<Value>, StoreError> {
        let path = self.layout.plan();
        let bytes = self.files.read_metadata(&path)?.ok();
        Ok(bytes.and_then(|bytes| serde_json::from_slice(&bytes).ok()))
    }

    /// The scene that the run was last started with, as the text of a scene file: what `run.json` keeps of it, else `scene.toml`.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] if neither has it, [`StoreError::Io`].
    pub fn scene_toml(&self) -> Result<String, StoreError> {
        match &self.record.scene_toml {
            Some(text) => Ok(text.clone()),
            None => written_scene(&self.files, &self.layout)?.map_err(StoreError::Damaged),
        }
    }

    /// Who writes the run at the moment; `None` if nobody does.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn holder(&self) -> Result<Option<LockHolder>, StoreError> {
        let path = self.layout.lock();
        RealFileSystem
            .lock_holder(&path)
            .map_err(|source| StoreError::Io {
                action: "look at",
                path,
                source,
            })
    }

    /// The highest iteration whose whole chain verifies.
    pub fn latest(&self) -> Option<u64> {
        self.commits.keys().next_back().copied()
    }

    /// The iterations that verify, ascending; pruned ones are not among them.
    pub fn iterations(&self) -> impl Iterator<Item = u64> {
        self.commits.keys().copied()
    }

    /// The manifest of an iteration.
    ///
    /// # Errors
    /// [`StoreError::NoIteration`], with those there are.
    pub fn commit_of(&self, wear_iteration: u64) -> Result<&Commit, StoreError> {
        self.commits
            .get(&wear_iteration)
            .ok_or_else(|| StoreError::NoIteration {
                path: self.layout.root.clone(),
                wear_iteration,
                remaining: self.iterations().collect(),
            })
    }

    /// A table of an iteration, verified.
    ///
    /// # Errors
    /// [`StoreError::NoIteration`], [`StoreError::NoTable`], [`StoreError::Damaged`], [`StoreError::Table`],
    /// [`StoreError::Io`].
    pub fn read(&self, wear_iteration: u64, table: TableName) -> Result<Table, StoreError> {
        let commit = self.commit_of(wear_iteration)?;
        let folder = self.layout.iteration(wear_iteration);
        let entry = commit
            .table(table.as_str())
            .ok_or_else(|| StoreError::NoTable {
                path: folder.clone(),
                table: table.as_str().to_owned(),
                known: commit.names(),
            })?;
        read_entry(&self.files, &folder, table, entry)?.map_err(StoreError::Damaged)
    }

    /// A table of an iteration as its type. Errors as for [`RunReader::read`].
    pub fn typed<T: TypedTable>(&self, wear_iteration: u64) -> Result<T, StoreError> {
        let table = self.read(wear_iteration, T::TABLE)?;
        T::of(&table).map_err(|source| StoreError::Table {
            path: self.layout.iteration(wear_iteration),
            source: Box::new(source),
        })
    }

    /// Hash of the scene that an iteration was computed from: another than that of the run for what a sibling inherited.
    ///
    /// # Errors
    /// As for [`RunReader::read`].
    pub fn scene_hash_of(&self, wear_iteration: u64) -> Result<String, StoreError> {
        let (commit, folder) = (
            self.commit_of(wear_iteration)?,
            self.layout.iteration(wear_iteration),
        );
        let table = TableName::Summary;
        let entry = commit
            .table(table.as_str())
            .ok_or_else(|| StoreError::NoTable {
                path: folder.clone(),
                table: table.as_str().to_owned(),
                known: commit.names(),
            })?;
        let path = folder.join(table.file_name());
        let bytes = self
            .files
            .read_verified(&path, entry.bytes, &entry.blake3)?
            .map_err(StoreError::Damaged)?;
        provenance_of(&bytes, table.schema())
            .map(|provenance| provenance.scene_hash)
            .map_err(|source| StoreError::Table {
                path,
                source: Box::new(source),
            })
    }

    /// The tables that are drafted of an iteration, in no order that means anything; nothing of them is verified.
    ///
    /// # Errors
    /// [`StoreError::Io`], but for a draft that is committed meanwhile.
    pub fn drafted(&self, wear_iteration: u64) -> Result<Vec<TableName>, StoreError> {
        // A table whose key is not written yet counts for nothing.
        match self.files.list(&self.layout.draft_keys(wear_iteration)) {
            Ok(entries) => Ok(entries
                .iter()
                .filter_map(|entry| TableName::from_name(entry.name.strip_suffix(".json")?))
                .collect()),
            Err(StoreError::Io { source, .. }) if source.kind() == ErrorKind::NotFound => {
                Ok(Vec::new())
            }
            Err(error) => Err(error),
        }
    }

    /// A table of `once/`, verified, whatever it was computed from; `None` if it is not there.
    ///
    /// # Errors
    /// [`StoreError::Damaged`], [`StoreError::Table`], [`StoreError::Io`].
    pub fn read_once(&self, table: TableName) -> Result<Option<Table>, StoreError> {
        let folder = self.layout.once();
        let key_path = folder.join(format!("{table}.json"));
        if !self.files.is_there(&key_path)? {
            return Ok(None);
        }
        let keyed: KeyedEntry = read_sealed(&self.files, &key_path, self.record.seal())?
            .map_err(StoreError::Damaged)?;
        read_entry(&self.files, &folder, table, &keyed.entry)?
            .map(Some)
            .map_err(StoreError::Damaged)
    }

    /// What opening the run found of each iteration.
    pub fn reports(&self) -> &[CommitReport] {
        &self.reports
    }

    /// Verifies every file of the run as it is now.
    ///
    /// # Errors
    /// [`StoreError::Io`] if something that is there cannot be read.
    pub fn verify(&self) -> Result<VerifyReport, StoreError> {
        let (record, chain) = walk_beside_a_writer(&self.files, &self.layout)?;
        Ok(VerifyReport {
            metadata: check_metadata(&self.files, &self.layout, &record)?,
            once: chain::check_once(&self.files, &self.layout, &record)?,
            commits: chain.reports,
            pruned: record.pruned.keys().copied().collect(),
        })
    }
}

/// The scene of a run as its user goes on with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneOfRun {
    /// The text of `scene.toml`, which may be edited; what `run.json` keeps of it where that file is gone.
    pub text: String,
    /// True if it is not what the run wrote.
    pub edited: bool,
}

impl SceneOfRun {
    /// Reads it, and nothing else of the run; `None` where there is neither `scene.toml` nor a run.
    ///
    /// # Errors
    /// Those of [`RunReader::open`]; [`StoreError::Damaged`] for a `scene.toml` that is no text.
    pub fn read(fs: Arc<dyn FileSystem>, root: &Path) -> Result<Option<SceneOfRun>, StoreError> {
        let files = Files(fs);
        let layout = Layout {
            root: root.to_owned(),
        };
        survey(&files, &layout)?;
        let found = read_record(&files, &layout)?;
        let kept = found.and_then(|found| found.record.scene_toml);
        match written_scene(&files, &layout)? {
            Ok(text) => {
                let edited = kept.is_some_and(|kept| kept != text);
                Ok(Some(SceneOfRun { text, edited }))
            }
            Err(damage) if damage.kind != DamageKind::Missing => Err(StoreError::Damaged(damage)),
            Err(_) => Ok(kept.map(|text| SceneOfRun {
                text,
                edited: false,
            })),
        }
    }
}

/// The text of `scene.toml`.
pub(super) fn written_scene(
    files: &Files,
    layout: &Layout,
) -> Result<Result<String, Damage>, StoreError> {
    let path = layout.scene();
    let bytes = match files.read_metadata(&path)? {
        Ok(bytes) => bytes,
        Err(damage) => return Ok(Err(damage)),
    };
    Ok(String::from_utf8(bytes).map_err(|error| {
        let reason = error.to_string();
        let kind = DamageKind::Unreadable { reason };
        Damage { path, kind }
    }))
}

/// What is wrong with the files of a run that stand beside its tables.
///
/// Of `run.json` and its copy one may be missing: a process that was killed between the two writes them at its next start.
fn check_metadata(
    files: &Files,
    layout: &Layout,
    record: &RunRecord,
) -> Result<Vec<Damage>, StoreError> {
    let mut damage = Vec::new();
    for path in [layout.record(), layout.record_copy()] {
        if let Err(RecordFault::Damaged(found)) = read_one_record(files, &path)?
            && (found.kind != DamageKind::Missing || path == layout.record())
        {
            damage.push(found);
        }
    }
    let scene_hash = record.scene_toml.as_ref().map(|text| hash(text.as_bytes()));
    let expected = [
        (layout.scene(), scene_hash),
        (layout.plan(), record.plan_hash.clone()),
    ];
    for (path, expected) in expected {
        let Some(expected) = expected else { continue };
        let found = match files.read_metadata(&path)? {
            Ok(bytes) => hash(&bytes),
            Err(found) => {
                damage.push(found);
                continue;
            }
        };
        if found != expected {
            let kind = DamageKind::Hash { expected, found };
            damage.push(Damage { path, kind });
        }
    }
    Ok(damage)
}

/// Times that a run is looked at while its writer prunes.
const LOOKS: usize = 8;

/// Verifies the iterations. What a writer prunes meanwhile looks like damage to whoever read `run.json` before.
fn walk_beside_a_writer(files: &Files, layout: &Layout) -> Result<(RunRecord, Chain), StoreError> {
    let read = || {
        let found = read_record(files, layout)?.ok_or_else(|| StoreError::NoRun {
            path: layout.root.clone(),
        })?;
        Ok::<RunRecord, StoreError>(found.record)
    };
    let mut record = read()?;
    let mut looks = 1;
    loop {
        let chain = chain::walk(files, layout, &record)?;
        let sound = chain.reports.iter().all(|report| report.damage.is_empty());
        if sound || looks == LOOKS {
            return Ok((record, chain));
        }
        let now = read()?;
        if now.pruned == record.pruned {
            return Ok((record, chain));
        }
        record = now;
        looks += 1;
    }
}

/// What `run.json` says, from itself or from its copy.
pub(super) struct FoundRecord {
    pub record: RunRecord,
    /// What is wrong with `run.json` where the copy stands in for it.
    pub damage: Option<Damage>,
}

/// Why a file does not say what a run is.
enum RecordFault {
    Damaged(Damage),
    Format { path: PathBuf, found: u32 },
}

/// What `run.json` says, `None` if neither it nor its copy is there.
pub(super) fn read_record(
    files: &Files,
    layout: &Layout,
) -> Result<Option<FoundRecord>, StoreError> {
    let fault = match read_one_record(files, &layout.record())? {
        Ok(record) => {
            let damage = None;
            return Ok(Some(FoundRecord { record, damage }));
        }
        Err(fault) => fault,
    };
    match (read_one_record(files, &layout.record_copy())?, fault) {
        (Ok(record), RecordFault::Damaged(damage)) => {
            let damage = Some(damage);
            Ok(Some(FoundRecord { record, damage }))
        }
        (
            Err(RecordFault::Damaged(copy)),
            RecordFault::Damaged(Damage {
                kind: DamageKind::Missing,
                ..
            }),
        ) if copy.kind == DamageKind::Missing => Ok(None),
        (_, RecordFault::Damaged(damage)) => Err(StoreError::Damaged(damage)),
        (_, RecordFault::Format { path, found }) => Err(StoreError::Format {
            path,
            found,
            expected: RUN_FORMAT,
        }),
    }
}

fn read_one_record(
    files: &Files,
    path: &Path,
) -> Result<Result<RunRecord, RecordFault>, StoreError> {
    let damaged = |reason: String| {
        let (path, kind) = (path.to_owned(), DamageKind::Unreadable { reason });
        Ok(Err(RecordFault::Damaged(Damage { path, kind })))
    };
    // Another version may lack what this one needs, its hash too: the version is looked at first.
    let format_of = |value: &Value| value["format"].as_u64().and_then(|f| u32::try_from(f).ok());
    let readable = |format: u32| (1..=RUN_FORMAT).contains(&format);
    let value = read_to_judge(files, path, |value| match format_of(value) {
        Some(format) if readable(format) => seal_of(format),
        _ => Seal::IfThere,
    })?;
    let value: Value = match value {
        Ok(value) => value,
        Err(damage) => return Ok(Err(RecordFault::Damaged(damage))),
    };
    match format_of(&value) {
        None => return damaged("no `format`".to_owned()),
        Some(found) if !readable(found) => {
            let path = path.to_owned();
            return Ok(Err(RecordFault::Format { path, found }));
        }
        Some(_) => (),
    }
    match serde_json::from_value(value) {
        Ok(record) => Ok(Ok(record)),
        Err(error) => damaged(error.to_string()),
    }
}
