//! `run.json` and its copy, and the files that stand beside it, as they are read.

use super::error::{Damage, DamageKind, StoreError};
use super::file_system::FileSystem;
use super::files::{Files, hash};
use super::layout::Layout;
use super::record::{LAYOUT, RunRecord};
use super::sealed::read_to_judge;
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

/// What `run.json` says, `None` if neither it nor its copy is there.
pub(super) fn read_record(
    files: &Files,
    layout: &Layout,
) -> Result<Option<FoundRecord>, StoreError> {
    let damage = match read_one_record(files, layout, &layout.record())? {
        Ok(record) => {
            let damage = None;
            return Ok(Some(FoundRecord { record, damage }));
        }
        Err(damage) => damage,
    };
    match read_one_record(files, layout, &layout.record_copy())? {
        Ok(record) => {
            let damage = Some(damage);
            Ok(Some(FoundRecord { record, damage }))
        }
        Err(copy) => {
            let kinds = [&damage.kind, &copy.kind];
            match kinds.iter().all(|kind| **kind == DamageKind::Missing) {
                true => Ok(None),
                false => Err(StoreError::Damaged(damage)),
            }
        }
    }
}

fn read_one_record(
    files: &Files,
    layout: &Layout,
    path: &Path,
) -> Result<Result<RunRecord, Damage>, StoreError> {
    // Another layout may lack what this one needs, its hash too: the number is looked at first.
    let number = |value: &Value| value["format"].as_u64();
    let ours = Some(u64::from(LAYOUT));
    let value: Value = match read_to_judge(files, path, |value| number(value) == ours)? {
        Ok(value) => value,
        Err(damage) => return Ok(Err(damage)),
    };
    let damaged = |reason: String| {
        let (path, kind) = (path.to_owned(), DamageKind::Unreadable { reason });
        Damage { path, kind }
    };
    match number(&value) {
        None => Ok(Err(damaged("no `format`".to_owned()))),
        Some(found) if Some(found) != ours => Err(StoreError::OtherLayout {
            path: layout.root.clone(),
            found,
            program: value["program_version"]
                .as_str()
                .map(|version| match value["program_commit"].as_str() {
                    Some(commit) => format!("{version} (commit {commit})"),
                    None => version.to_owned(),
                }),
        }),
        Some(_) => {
            let record = serde_json::from_value(value);
            Ok(record.map_err(|error| damaged(error.to_string())))
        }
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
        if let Err(found) = read_one_record(files, layout, &path)?
            && (found.kind != DamageKind::Missing || path == layout.record())
        {
            damage.push(found);
        }
    }
    damage.extend(check_text(files, layout.scene(), &record.scene_toml)?);
    if let Some(text) = &record.scene_written {
        damage.extend(check_text(files, layout.written_scene(), text)?);
    }
    damage.extend(check_hash(files, layout.plan(), &record.plan_hash)?);
    damage.extend(check_hash(files, layout.schemas(), &record.schemas_hash)?);
    Ok(damage)
}

/// What is wrong with a file that has a text of `run.json`.
pub(super) fn check_text(
    files: &Files,
    path: PathBuf,
    kept: &str,
) -> Result<Option<Damage>, StoreError> {
    check_hash(files, path, &hash(kept.as_bytes()))
}

fn check_hash(files: &Files, path: PathBuf, expected: &str) -> Result<Option<Damage>, StoreError> {
    let found = match files.read_metadata(&path)? {
        Ok(bytes) => hash(&bytes),
        Err(damage) => return Ok(Some(damage)),
    };
    let kind = DamageKind::Hash {
        expected: expected.to_owned(),
        found: found.clone(),
    };
    Ok((found != expected).then_some(Damage { path, kind }))
}

/// What `read` makes of the plan of a run.
///
/// # Errors
/// [`StoreError::Plan`] for a file that is missing, is no JSON, is not as the run wrote it, or of which `read` says why it is no plan.
pub(super) fn read_plan<P>(
    files: &Files,
    layout: &Layout,
    record: &RunRecord,
    read: impl FnOnce(&Value) -> Result<P, String>,
) -> Result<P, StoreError> {
    let path = layout.plan();
    let value = match files.read_metadata(&path)? {
        Ok(bytes) => serde_json::from_slice(&bytes).map_err(|error| error.to_string()),
        Err(damage) => Err(damage.kind.to_string()),
    };
    let plan = match value.and_then(|value| read(&value)) {
        Ok(plan) => match check_hash(files, path.clone(), &record.plan_hash)? {
            None => Ok(plan),
            Some(damage) => Err(damage.kind.to_string()),
        },
        Err(reason) => Err(reason),
    };
    plan.map_err(|reason| StoreError::Plan {
        path,
        reason,
        program_version: record.circumstances().0.to_owned(),
    })
}

/// Checks that `read` makes something of the plan of a run, if there is a run and the plan is the one it wrote: a start writes a
/// damaged one again.
///
/// # Errors
/// Those of [`super::RunReader::open`], and [`StoreError::Plan`].
pub fn check_plan<P>(
    fs: Arc<dyn FileSystem>,
    root: &Path,
    read: impl FnOnce(&Value) -> Result<P, String>,
) -> Result<(), StoreError> {
    let files = Files(fs);
    let layout = Layout::at(root);
    survey(&files, &layout)?;
    match read_record(&files, &layout)? {
        Some(FoundRecord { record, .. })
            if check_hash(&files, layout.plan(), &record.plan_hash)?.is_none() =>
        {
            read_plan(&files, &layout, &record, read).map(|_| ())
        }
        _ => Ok(()),
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
    /// Those of [`super::RunReader::open`]; [`StoreError::Damaged`] for a `scene.toml` that is no text.
    pub fn read(fs: Arc<dyn FileSystem>, root: &Path) -> Result<Option<SceneOfRun>, StoreError> {
        let files = Files(fs);
        let layout = Layout::at(root);
        survey(&files, &layout)?;
        let found = read_record(&files, &layout)?;
        let kept = found.map(|found| found.record.scene_toml);
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
