//! The folder of a campaign and its plan.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::error::CampaignError;
use super::rows::{ENDED, FAILED, LOCKS, RUNS};
use super::table::Campaign;
use crate::store::{EntryKind, FileSystem, LAYOUT, LockAttempt, LockGuard};

/// Largest size of `campaign.json` \[B\]. The file contains the text of the scene.
const LONGEST_ABOUT: u64 = 64 << 20;
/// Largest size of a table \[B\].
pub(super) const LONGEST_TABLE: u64 = 4 << 30;

const ABOUT: &str = "campaign.json";
const TABLE: &str = "campaign.parquet";
const WRITTEN: &str = "campaign.toml";
pub(super) const COLLECTED: &str = "collected";
/// Suffix of a file that is being written.
pub(super) const DRAFT: &str = ".new";

/// Which files of a completed run are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KeepRuns {
    /// Keeps the folder of each run and the history of the run.
    All,
    /// Keeps only the history of each run, in one file per run.
    History,
}

/// Section of a campaign that varies independently: a key of its grid, its list, or its draws. The rows are all
/// combinations of the points of the sections.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Section {
    /// Number of points.
    pub points: usize,
    /// Keys of the scene that vary in the section.
    pub keys: Vec<String>,
    /// True if the points are drawn at random.
    pub is_random: bool,
}

/// Fields that `campaign.json` has in every layout.
#[derive(Deserialize)]
struct AnyLayout {
    format: u64,
    program_version: String,
}

/// Content of `campaign.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StoredCampaign {
    format: u32,
    /// Version of the program that planned it.
    pub program_version: String,
    /// Title, or else the name of the campaign file.
    pub title: String,
    /// Name of the scene.
    pub scene_name: String,
    /// Text of the scene that all rows modify, without a base and with absolute paths. The scene need not be complete,
    /// because the rows may set its missing keys.
    pub scene: String,
    /// Which files of a completed run are kept.
    pub keep: KeepRuns,
    /// Sections, the slowest first.
    pub sections: Vec<Section>,
    /// Number of planned rows. The number of rows and `content`, the hash of the rows' content keys, identify the table
    /// of the campaign.
    pub(super) rows: usize,
    content: String,
}

impl StoredCampaign {
    /// Creates the description of a campaign that the present version of the program plans.
    pub fn new(
        title: String,
        scene_name: String,
        scene: String,
        keep: KeepRuns,
        sections: Vec<Section>,
    ) -> StoredCampaign {
        StoredCampaign {
            format: LAYOUT,
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            title,
            scene_name,
            scene,
            keep,
            sections,
            rows: 0,
            content: String::new(),
        }
    }

    /// Returns true if the campaign begins with the planned rows, and the sections have as many points as planned.
    fn matches_campaign(&self, campaign: &Campaign) -> bool {
        let mut points = self.sections.iter().map(|section| section.points);
        let points = points.try_fold(1_usize, |all, points| all.checked_mul(points));
        points == Some(self.rows)
            && self.rows <= campaign.rows.len()
            && campaign.content_hash(0..self.rows) == self.content
    }
}

/// The folder of a campaign.
#[derive(Clone)]
pub struct CampaignFolder {
    /// Path of the folder.
    pub root: PathBuf,
    pub(super) files: Arc<dyn FileSystem>,
}

pub(super) fn io_error<'a>(
    action: &'static str,
    path: &'a Path,
) -> impl FnOnce(std::io::Error) -> CampaignError + 'a {
    move |source| CampaignError::Io {
        action,
        path: path.to_owned(),
        source,
    }
}

impl CampaignFolder {
    /// Creates a `CampaignFolder` for the path `root` without access to the disk.
    pub fn at(files: Arc<dyn FileSystem>, root: &Path) -> CampaignFolder {
        CampaignFolder {
            root: root.to_owned(),
            files,
        }
    }

    /// Rejects links in place of the folders whose content the program writes and removes. The campaign folder itself
    /// and the folder of a single run may be links.
    pub(super) fn check_folders(&self) -> Result<(), CampaignError> {
        for name in [RUNS, ENDED, COLLECTED, FAILED, LOCKS] {
            let path = self.root.join(name);
            let found = match self
                .files
                .metadata(&path)
                .map_err(io_error("access", &path))?
            {
                None => continue,
                Some(found) => match found.kind {
                    EntryKind::Folder => continue,
                    EntryKind::Link => "a link",
                    EntryKind::File => "a file",
                    EntryKind::Other => "a pipe, a socket or a device",
                },
            };
            return Err(CampaignError::NotAFolder { path, found });
        }
        Ok(())
    }

    /// Locks the folder against other planners and collectors, until the guard is dropped.
    pub(super) fn lock(&self) -> Result<Box<dyn LockGuard>, CampaignError> {
        let path = self.root.join("lock");
        match self
            .files
            .try_lock(&path)
            .map_err(io_error("lock", &path))?
        {
            LockAttempt::Taken(guard) => Ok(guard),
            LockAttempt::Held { pid } => Err(CampaignError::Locked {
                path: self.root.clone(),
                pid,
            }),
        }
    }

    /// Replaces the content of a file atomically and syncs it to the disk.
    pub(super) fn replace(&self, path: &Path, bytes: &[u8]) -> Result<(), CampaignError> {
        let mut draft = path.as_os_str().to_owned();
        draft.push(DRAFT);
        let draft = PathBuf::from(draft);
        let folder = path.parent().unwrap_or(Path::new(""));
        self.files
            .create_dir_all(folder)
            .map_err(io_error("create the folder", folder))?;
        // Only the process that has the lock of the folder, or of the row, writes the file.
        self.files
            .replace(&draft, path, bytes)
            .map_err(io_error("write", path))?;
        self.files
            .sync_dir(folder)
            .map_err(io_error("sync the folder", folder))
    }

    pub(super) fn read(&self, path: &Path, most: u64) -> Result<Vec<u8>, CampaignError> {
        self.files.read(path, most).map_err(io_error("read", path))
    }

    pub(super) fn list(&self, folder: &str) -> Result<Vec<String>, CampaignError> {
        let path = self.root.join(folder);
        match self.files.list(&path) {
            Ok(entries) => Ok(entries.into_iter().map(|entry| entry.name).collect()),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(Vec::new()),
            Err(error) => Err(io_error("list", &path)(error)),
        }
    }

    fn about(&self) -> Result<Option<StoredCampaign>, CampaignError> {
        let path = self.root.join(ABOUT);
        let bytes = match self.files.read(&path, LONGEST_ABOUT) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(io_error("read", &path)(error)),
        };
        // Check the layout first: other layouts may differ in all other fields.
        if let Ok(AnyLayout {
            format,
            program_version,
        }) = serde_json::from_slice(&bytes)
            && format != u64::from(LAYOUT)
        {
            return Err(CampaignError::OtherLayout {
                path: self.root.clone(),
                found: format,
                program_version,
            });
        }
        let about = serde_json::from_slice(&bytes);
        about.map(Some).map_err(|error| CampaignError::Damaged {
            path,
            reason: format!("it cannot be read ({error}); plan the campaign again in this folder"),
        })
    }

    fn table(&self) -> Result<Option<Campaign>, CampaignError> {
        let path = self.root.join(TABLE);
        let bytes = match self.files.read(&path, LONGEST_TABLE) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(io_error("read", &path)(error)),
        };
        match Campaign::of_bytes(&bytes) {
            Ok(campaign) => Ok(Some(campaign)),
            Err(reason) => Err(CampaignError::Damaged {
                path,
                reason: format!("{reason}; remove it and plan the campaign again in this folder"),
            }),
        }
    }

    /// Opens the campaign of the folder.
    ///
    /// # Errors
    /// [`CampaignError::NoCampaign`], [`CampaignError::NotACampaign`], [`CampaignError::NotAFolder`],
    /// [`CampaignError::Damaged`], [`CampaignError::Io`].
    pub fn open(&self) -> Result<(StoredCampaign, Campaign), CampaignError> {
        self.check_folders()?;
        match (self.about()?, self.table()?) {
            (Some(about), Some(campaign)) if about.matches_campaign(&campaign) => Ok((about, campaign)),
            (Some(about), Some(campaign)) => Err(CampaignError::Damaged {
                path: self.root.join(TABLE),
                reason: match campaign.rows.len() < about.rows {
                    true => format!(
                        "it has {} rows instead of {}: planning was interrupted; plan the campaign again in this folder",
                        campaign.rows.len(),
                        about.rows
                    ),
                    false => "its rows differ from the rows planned in this folder; restore the original file, or give another --dir".to_owned(),
                },
            }),
            (None, _) => Err(self.foreign_entry()?.unwrap_or(CampaignError::NoCampaign {
                path: self.root.clone(),
            })),
            (Some(_), None) => Err(CampaignError::Damaged {
                path: self.root.join(TABLE),
                reason: "it is missing or incomplete; restore it, or plan the campaign again in this folder".to_owned(),
            }),
        }
    }

    /// Returns an error for an entry that does not belong to a campaign. Returns `None` if the folder is empty or
    /// missing.
    fn foreign_entry(&self) -> Result<Option<CampaignError>, CampaignError> {
        let campaign_files = [ABOUT, TABLE, WRITTEN, "lock"];
        let is_own = |name: &String| campaign_files.iter().any(|file| name.starts_with(file));
        let entries = self.list("")?;
        Ok(entries.into_iter().find(|name| !is_own(name)).map(|found| {
            let path = self.root.clone();
            CampaignError::NotACampaign { path, found }
        }))
    }

    /// Rejects a folder that is not a campaign and contains other files, before any run is computed.
    ///
    /// # Errors
    /// The errors of [`CampaignFolder::open`].
    pub fn check(&self) -> Result<(), CampaignError> {
        self.check_folders()?;
        match self.about() {
            Ok(Some(_)) => Ok(()),
            Ok(None) => self.foreign_entry()?.map_or(Ok(()), Err),
            // `campaign.json` is damaged, but the table still has the planned rows.
            Err(error @ CampaignError::Damaged { .. }) => {
                self.table()?.map_or(Err(error), |_| Ok(()))
            }
            Err(error) => Err(error),
        }
    }

    /// Stores the plan of a campaign and returns the number of rows that the folder already had. New rows may only
    /// follow the last planned row.
    ///
    /// # Errors
    /// [`CampaignError::NotACampaign`], [`CampaignError::Changed`], [`CampaignError::Locked`], [`CampaignError::Io`].
    pub fn plan(
        &self,
        about: &StoredCampaign,
        written: &str,
        campaign: &Campaign,
    ) -> Result<usize, CampaignError> {
        let root = &self.root;
        self.check()?;
        self.files
            .create_dir_all(root)
            .map_err(io_error("create the folder", root))?;
        let _guard = self.lock()?;
        let (planned, before) = match self.about() {
            Ok(None) => (None, None),
            Ok(planned) => (planned, self.table()?),
            Err(CampaignError::Damaged { .. }) => (None, self.table()?),
            Err(error) => return Err(error),
        };
        let previous_keep = planned.as_ref().map(|planned| planned.keep);
        let previous_keep = match (previous_keep, &before) {
            (None, Some(before)) => self.keep_of_completed_runs(before.rows.len())?,
            (previous_keep, _) => previous_keep,
        };
        let before = before.unwrap_or_default();
        let changed = |index: usize, before: String, now: String| CampaignError::Changed {
            path: root.clone(),
            index: index as u64,
            before,
            now,
        };
        for (index, old) in before.rows.iter().enumerate() {
            let Some(new) = campaign.rows.get(index) else {
                let missing_text = "missing".to_owned();
                return Err(changed(index, old.settings.join(", "), missing_text));
            };
            if old.settings != new.settings {
                return Err(changed(
                    index,
                    old.settings.join(", "),
                    new.settings.join(", "),
                ));
            }
            if old.content_key != new.content_key {
                let row_text = |row: &super::PlannedRun| {
                    format!(
                        "{} with content {}",
                        row.settings.join(", "),
                        row.content_key
                    )
                };
                return Err(changed(index, row_text(old), row_text(new)));
            }
        }
        if let Some(previous_keep) =
            previous_keep.filter(|previous_keep| *previous_keep != about.keep)
        {
            return Err(CampaignError::KeepChanged {
                path: root.clone(),
                before: previous_keep,
                now: about.keep,
            });
        }
        if let Some(planned) = planned {
            // Compare the campaigns even if the table is missing, because results of the old rows may still exist.
            if !planned.matches_campaign(campaign) {
                let before = format!("one of {} rows with other content", planned.rows);
                return Err(changed(0, before, "different".to_owned()));
            }
        }
        let about = StoredCampaign {
            rows: campaign.rows.len(),
            content: campaign.content_hash(0..campaign.rows.len()),
            ..about.clone()
        };
        let bytes = serde_json::to_vec_pretty(&about).map_err(std::io::Error::other);
        let path = root.join(ABOUT);
        self.replace(&path, &bytes.map_err(io_error("write", &path))?)?;
        self.replace(&root.join(WRITTEN), written.as_bytes())?;
        // Write the table last, because a folder becomes a campaign only with the table.
        let path = root.join(TABLE);
        let bytes = campaign.to_bytes().map_err(|source| CampaignError::Table {
            path: path.clone(),
            source: Box::new(source),
        })?;
        self.replace(&path, &bytes)?;
        Ok(before.rows.len())
    }
}
