//! Folders given together (as from `runs/*`): opens the runs, and reports why other folders are skipped.

use std::fmt;
use std::path::{Path, PathBuf};

use super::ReportError;
use crate::store::StoreError;

/// Skipped folder or file, which is not a readable run.
#[derive(Debug)]
pub struct SkippedFolder {
    path: PathBuf,
    error: ReportError,
}

impl SkippedFolder {
    /// Returns the path as the user gave it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns true if the skipped folder is a run that is damaged or has another format. Returns false if the skipped
    /// folder is not a run.
    pub fn is_damage_or_mismatch(&self) -> bool {
        self.error.is_damage_or_mismatch()
    }

    /// Returns the reason without the path.
    pub fn reason(&self) -> String {
        match &self.error {
            error if is_no_folder(error) => "it is not a folder".to_owned(),
            ReportError::Run {
                source: StoreError::NoRun { .. },
                ..
            } => "it has no run.json".to_owned(),
            ReportError::Empty { damage, .. } => match damage.first() {
                Some(damage) => format!("none of its iterations verifies: {damage}"),
                None => "it has no iteration yet".to_owned(),
            },
            error => error.to_string(),
        }
    }
}

/// Text of the notice about the folder.
impl fmt::Display for SkippedFolder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is skipped: {}", self.path.display(), self.reason())
    }
}

fn is_no_folder(error: &ReportError) -> bool {
    matches!(
        error,
        ReportError::Run {
            source: StoreError::FileInsteadOfFolder { .. },
            ..
        }
    )
}

/// Opens each of several runs, and skips folders that are not runs.
///
/// If `runs` has a single path, the function never skips the path, because the user asked for the path. A path at which
/// nothing exists is misspelt, because `runs/*` yields existing paths. The function does not skip a misspelt path.
///
/// # Errors
/// Returns the error of `open` for a single path, for a misspelt path, or if the system denies reading a run. Returns
/// [`ReportError::NoReadableRun`] if the function skips all paths.
pub fn open_each<T>(
    runs: &[PathBuf],
    mut open: impl FnMut(&Path) -> Result<T, ReportError>,
) -> Result<(Vec<T>, Vec<SkippedFolder>), ReportError> {
    let mut opened = Vec::new();
    let mut passed_over = Vec::new();
    for path in runs {
        match open(path) {
            Ok(run) => opened.push(run),
            Err(error) => {
                let is_skippable =
                    is_no_folder(&error) || error.is_no_run() || error.is_damage_or_mismatch();
                if runs.len() == 1 || !is_skippable || path.symlink_metadata().is_err() {
                    return Err(error);
                }
                passed_over.push(SkippedFolder {
                    path: path.clone(),
                    error,
                });
            }
        }
    }
    if opened.is_empty() && !passed_over.is_empty() {
        return Err(ReportError::NoReadableRun { passed_over });
    }
    Ok((opened, passed_over))
}
