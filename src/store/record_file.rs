//! Reads the metadata files of a run, such as `run.json`, `run.copy.json` and `scene.toml`.

use super::error::{Damage, DamageKind, StoreError};
use super::file_system::FileSystem;
use super::files::{Files, hash};
use super::layout::Layout;
use super::record::{LAYOUT, RunRecord};
use super::sealed::read_optionally_sealed;
use super::survey::check_folder;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Content of `run.json`, read from the file or from its copy.
pub(super) struct RecordRead {
    pub record: RunRecord,
    /// Damage of `run.json`, if the record was read from the copy.
    pub damage: Option<Damage>,
}

/// Reads the record from `run.json`, or from `run.copy.json` if `run.json` is missing or damaged. Returns `None` if
/// both files are missing.
pub(super) fn read_record(
    files: &Files,
    layout: &Layout,
) -> Result<Option<RecordRead>, StoreError> {
    let damage = match read_one_record(files, layout, &layout.record())? {
        Ok(record) => {
            let damage = None;
            return Ok(Some(RecordRead { record, damage }));
        }
        Err(damage) => damage,
    };
    match read_one_record(files, layout, &layout.record_copy())? {
        Ok(record) => {
            let damage = Some(damage);
            Ok(Some(RecordRead { record, damage }))
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
    // Check the layout number first, because a `run.json` of another layout may lack required fields, such as the hash.
    let layout_number = |value: &Value| value["format"].as_u64();
    let this_layout = Some(u64::from(LAYOUT));
    let value: Value =
        match read_optionally_sealed(files, path, |value| layout_number(value) == this_layout)? {
            Ok(value) => value,
            Err(damage) => return Ok(Err(damage)),
        };
    let damaged = |reason: String| {
        let (path, kind) = (path.to_owned(), DamageKind::Unreadable { reason });
        Damage { path, kind }
    };
    match layout_number(&value) {
        None => Ok(Err(damaged("no `format`".to_owned()))),
        Some(found) if Some(found) != this_layout => Err(StoreError::OtherLayout {
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

/// Returns the damage of the metadata files of a run.
///
/// A missing copy of `run.json` is no damage. If a process was killed before it wrote the copy, the next start of the
/// run writes the copy.
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

/// Returns the damage of a file whose text is stored in `run.json`.
pub(super) fn check_text(
    files: &Files,
    path: PathBuf,
    stored_text: &str,
) -> Result<Option<Damage>, StoreError> {
    check_hash(files, path, &hash(stored_text.as_bytes()))
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

/// Reads the plan of a run and parses it by `read`.
///
/// # Errors
/// [`StoreError::Plan`] if the file of the plan is missing or not valid JSON. [`StoreError::Plan`] if the file changed
/// after the run wrote the file, or if `read` rejects the plan.
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

/// Checks that `read` accepts the plan of a run. Does nothing if there is no run, or if the plan is damaged, because
/// the next start rewrites it.
///
/// # Errors
/// Errors of [`super::RunReader::open`], and [`StoreError::Plan`].
pub fn check_plan<P>(
    fs: Arc<dyn FileSystem>,
    root: &Path,
    read: impl FnOnce(&Value) -> Result<P, String>,
) -> Result<(), StoreError> {
    let files = Files(fs);
    let layout = Layout::at(root);
    check_folder(&files, &layout)?;
    match read_record(&files, &layout)? {
        Some(RecordRead { record, .. })
            if check_hash(&files, layout.plan(), &record.plan_hash)?.is_none() =>
        {
            read_plan(&files, &layout, &record, read).map(|_| ())
        }
        _ => Ok(()),
    }
}

/// Scene of a run, as the user continues it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneOfRun {
    /// Text of `scene.toml`, which may be edited. If the file is missing, the text in `run.json`.
    pub text: String,
    /// True if the text of `scene.toml` differs from the text that the run wrote.
    pub edited: bool,
}

impl SceneOfRun {
    /// Reads only the scene of a run. Returns `None` if neither `scene.toml` nor a run exists.
    ///
    /// # Errors
    /// Errors of [`super::RunReader::open`]; [`StoreError::Damaged`] for a `scene.toml` that is not valid text.
    pub fn read(fs: Arc<dyn FileSystem>, root: &Path) -> Result<Option<SceneOfRun>, StoreError> {
        let files = Files(fs);
        let layout = Layout::at(root);
        check_folder(&files, &layout)?;
        let found = read_record(&files, &layout)?;
        let recorded_text = found.map(|found| found.record.scene_toml);
        match written_scene(&files, &layout)? {
            Ok(text) => {
                let edited = recorded_text.is_some_and(|recorded_text| recorded_text != text);
                Ok(Some(SceneOfRun { text, edited }))
            }
            Err(damage) if damage.kind != DamageKind::Missing => Err(StoreError::Damaged(damage)),
            Err(_) => Ok(recorded_text.map(|text| SceneOfRun {
                text,
                edited: false,
            })),
        }
    }
}

/// Reads the text of `scene.toml`.
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
