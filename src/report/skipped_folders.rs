//! Folders given together, as by `runs/*`: those that are runs, and why the others are not.

use std::fmt;
use std::path::{Path, PathBuf};

use super::ReportError;
use crate::store::StoreError;

/// A folder, or file, among several that is no run that can be read.
#[derive(Debug)]
pub struct SkippedFolder {
    path: PathBuf,
    error: ReportError,
}

impl SkippedFolder {
    /// What was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// True for a run that is damaged or of another format, rather than something else than a run.
    pub fn is_damage_or_mismatch(&self) -> bool {
        self.error.is_damage_or_mismatch()
    }

    /// Why it cannot be read, without its name.
    pub fn reason(&self) -> String {
        match &self.error {
            error if is_no_folder(error) => "it is no folder".to_owned(),
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

/// As a notice says it.
impl fmt::Display for SkippedFolder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} is passed over: {}",
            self.path.display(),
            self.reason()
        )
    }
}

fn is_no_folder(error: &ReportError) -> bool {
    matches!(
        error,
        ReportError::Run {
            source: StoreError::NoFolder { .. },
            ..
        }
    )
}

/// Opens each of the runs and passes over what is none. A path given alone is what was asked for, and one that nothing has
/// is misspelt, which `runs/*` never is: these are errors.
///
/// # Errors
/// What `open` says of such a path, or of a run that the system does not let be read; [`ReportError::NoneLeft`] if all are passed
/// over.
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
                let foreign =
                    is_no_folder(&error) || error.is_no_run() || error.is_damage_or_mismatch();
                if runs.len() == 1 || !foreign || path.symlink_metadata().is_err() {
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
        return Err(ReportError::NoneLeft { passed_over });
    }
    Ok((opened, passed_over))
}
