//! `run.json` and its copy, and the files that stand beside it, as they are read.

use super::error::{Damage, DamageKind, StoreError};
use super::file_system::FileSystem;
use super::files::{Files, Layout, hash};
use super::record::{RUN_FORMAT, RunRecord, seal_of};
use super::sealed::{Seal, read_to_judge};
use super::survey::survey;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;

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

/// What is wrong with the files of a run that stand beside its tables.
///
/// Of `run.json` and its copy one may be missing: a process that was killed between the two writes them at its next start.
pub(super) fn check_metadata(
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
    for (path, text) in [
        (layout.scene(), &record.scene_toml),
        (layout.written_scene(), &record.scene_written),
    ] {
        damage.extend(check_text(files, path, text.as_ref())?);
    }
    for (path, expected) in [
        (layout.plan(), &record.plan_hash),
        (layout.schemas(), &record.schemas_hash),
    ] {
        damage.extend(check_hash(files, path, expected.clone())?);
    }
    Ok(damage)
}

/// What is wrong with a file that has a text of `run.json`; nothing where that does not keep it.
pub(super) fn check_text(
    files: &Files,
    path: PathBuf,
    kept: Option<&String>,
) -> Result<Option<Damage>, StoreError> {
    check_hash(files, path, kept.map(|text| hash(text.as_bytes())))
}

fn check_hash(
    files: &Files,
    path: PathBuf,
    expected: Option<String>,
) -> Result<Option<Damage>, StoreError> {
    let Some(expected) = expected else {
        return Ok(None);
    };
    let found = match files.read_metadata(&path)? {
        Ok(bytes) => hash(&bytes),
        Err(damage) => return Ok(Some(damage)),
    };
    let kind = DamageKind::Hash {
        expected: expected.clone(),
        found: found.clone(),
    };
    Ok((found != expected).then_some(Damage { path, kind }))
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
    /// Those of [`super::RunReader::open`]; [`StoreError::Damaged`] for a `scene.toml` that is no text.
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
