//! The folder of a campaign: what is planned in it.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::error::CampaignError;
use super::rows::{ENDED, FAILED, LOCKS, RUNS};
use super::table::Campaign;
use crate::store::{EntryKind, FileSystem, LAYOUT, LockAttempt, LockGuard};

/// Bytes of `campaign.json` at most: it holds the text of a scene.
const LONGEST_ABOUT: u64 = 64 << 20;
/// Bytes of a table at most.
pub(super) const LONGEST_TABLE: u64 = 4 << 30;

const ABOUT: &str = "campaign.json";
const TABLE: &str = "campaign.parquet";
const WRITTEN: &str = "campaign.toml";
pub(super) const COLLECTED: &str = "collected";
/// Behind the name of a file that is being written.
pub(super) const DRAFT: &str = ".new";

/// What is kept of a run that has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KeepRuns {
    /// The folder of the run too.
    All,
    /// Its history alone: one file a run.
    History,
}

/// What varies by itself in a campaign: a key of its grid, its list, its draws. Rows are its points, each with every one of the others'.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Section {
    /// Points, each with every one of the other sections'.
    pub points: usize,
    /// Keys that vary with them.
    pub keys: Vec<String>,
    /// Whether its points are drawn.
    pub is_random: bool,
}

/// What every layout of `campaign.json` says.
#[derive(Deserialize)]
struct AnyLayout {
    format: u64,
    program_version: String,
}

/// What `campaign.json` says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct About {
    format: u32,
    /// Version of the program that planned it.
    pub program_version: String,
    /// What its user calls it; else the name of the file.
    pub title: String,
    /// Name of the scene.
    pub scene_name: String,
    /// The scene that all rows change, as a text without a base and with absolute paths. It need not be complete.
    pub scene: String,
    /// What is kept of a run that has ended.
    pub keep: KeepRuns,
    /// What varies by itself, the slowest first.
    pub sections: Vec<Section>,
    /// Rows that were planned, and the hash of their content keys: a table of other rows is not this campaign's.
    pub(super) rows: usize,
    content: String,
}

impl About {
    /// Of a campaign that is planned now.
    pub fn new(
        title: String,
        scene_name: String,
        scene: String,
        keep: KeepRuns,
        sections: Vec<Section>,
    ) -> About {
        About {
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

    /// Whether the first rows of a campaign are those that were planned, and the points of the sections as many.
    fn is_of(&self, campaign: &Campaign) -> bool {
        let mut points = self.sections.iter().map(|section| section.points);
        let points = points.try_fold(1_usize, |all, points| all.checked_mul(points));
        points == Some(self.rows)
            && self.rows <= campaign.rows.len()
            && campaign.content(0..self.rows) == self.content
    }
}

/// The folder of a campaign.
#[derive(Clone)]
pub struct Folder {
    /// Where it is.
    pub root: PathBuf,
    pub(super) files: Arc<dyn FileSystem>,
}

pub(super) fn io<'a>(
    action: &'static str,
    path: &'a Path,
) -> impl FnOnce(std::io::Error) -> CampaignError + 'a {
    move |source| CampaignError::Io {
        action,
        path: path.to_owned(),
        source,
    }
}

impl Folder {
    /// A folder, of which nothing is looked at yet.
    pub fn at(files: Arc<dyn FileSystem>, root: &Path) -> Folder {
        Folder {
            root: root.to_owned(),
            files,
        }
    }

    /// Rejects links in place of the folders whose content the program writes and removes. The campaign folder itself and the folder of a
    /// single run may be links.
    pub(super) fn check_folders(&self) -> Result<(), CampaignError> {
        for name in [RUNS, ENDED, COLLECTED, FAILED, LOCKS] {
            let path = self.root.join(name);
            let found = match self.files.metadata(&path).map_err(io("look at", &path))? {
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

    /// Nobody else plans or collects as long as the guard is held.
    pub(super) fn lock(&self) -> Result<Box<dyn LockGuard>, CampaignError> {
        let path = self.root.join("lock");
        match self.files.try_lock(&path).map_err(io("lock", &path))? {
            LockAttempt::Taken(guard) => Ok(guard),
            LockAttempt::Held { pid } => Err(CampaignError::Locked {
                path: self.root.clone(),
                pid,
            }),
        }
    }

    /// Gives a file its content in one step, on the disk when this returns.
    pub(super) fn replace(&self, path: &Path, bytes: &[u8]) -> Result<(), CampaignError> {
        let mut draft = path.as_os_str().to_owned();
        draft.push(DRAFT);
        let draft = PathBuf::from(draft);
        let folder = path.parent().unwrap_or(Path::new(""));
        self.files
            .create_dir_all(folder)
            .map_err(io("make the folder", folder))?;
        // Only one process writes it: the one that has the lock of the folder, or of the row.
        self.files
            .replace(&draft, path, bytes)
            .map_err(io("write", path))?;
        self.files
            .sync_dir(folder)
            .map_err(io("sync the folder", folder))
    }

    pub(super) fn read(&self, path: &Path, most: u64) -> Result<Vec<u8>, CampaignError> {
        self.files.read(path, most).map_err(io("read", path))
    }

    pub(super) fn list(&self, folder: &str) -> Result<Vec<String>, CampaignError> {
        let path = self.root.join(folder);
        match self.files.list(&path) {
            Ok(entries) => Ok(entries.into_iter().map(|entry| entry.name).collect()),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(Vec::new()),
            Err(error) => Err(io("list", &path)(error)),
        }
    }

    fn about(&self) -> Result<Option<About>, CampaignError> {
        let path = self.root.join(ABOUT);
        let bytes = match self.files.read(&path, LONGEST_ABOUT) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(io("read", &path)(error)),
        };
        // Before all else, which other layouts have otherwise.
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
            Err(error) => return Err(io("read", &path)(error)),
        };
        match Campaign::of_bytes(&bytes) {
            Ok(campaign) => Ok(Some(campaign)),
            Err(reason) => Err(CampaignError::Damaged {
                path,
                reason: format!("{reason}; remove it and plan the campaign again in this folder"),
            }),
        }
    }

    /// What the folder holds.
    ///
    /// # Errors
    /// [`CampaignError::NoCampaign`], [`CampaignError::NotACampaign`], [`CampaignError::NotAFolder`], [`CampaignError::Damaged`],
    /// [`CampaignError::Io`].
    pub fn open(&self) -> Result<(About, Campaign), CampaignError> {
        self.check_folders()?;
        match (self.about()?, self.table()?) {
            (Some(about), Some(campaign)) if about.is_of(&campaign) => Ok((about, campaign)),
            (Some(about), Some(campaign)) => Err(CampaignError::Damaged {
                path: self.root.join(TABLE),
                reason: match campaign.rows.len() < about.rows {
                    true => format!(
                        "it has {} rows, and {} were planned: planning was interrupted; plan the campaign again in this folder",
                        campaign.rows.len(),
                        about.rows
                    ),
                    false => "its rows are not those that were planned in this folder; put back what belongs there, or give another --dir".to_owned(),
                },
            }),
            (None, _) => Err(self.other()?.unwrap_or(CampaignError::NoCampaign {
                path: self.root.clone(),
            })),
            (Some(_), None) => Err(CampaignError::Damaged {
                path: self.root.join(TABLE),
                reason: "it is not there, or was never finished; put it back, or plan the campaign again in this folder".to_owned(),
            }),
        }
    }

    /// What is in the folder that no campaign has there; none if it is empty, or not there.
    fn other(&self) -> Result<Option<CampaignError>, CampaignError> {
        let own = [ABOUT, TABLE, WRITTEN, "lock"];
        let is_own = |name: &String| own.iter().any(|own| name.starts_with(own));
        let entries = self.list("")?;
        Ok(entries.into_iter().find(|name| !is_own(name)).map(|found| {
            let path = self.root.clone();
            CampaignError::NotACampaign { path, found }
        }))
    }

    /// Refuses a folder that holds something else, before anything is computed.
    ///
    /// # Errors
    /// As for [`Folder::open`].
    pub fn check(&self) -> Result<(), CampaignError> {
        self.check_folders()?;
        match self.about() {
            Ok(Some(_)) => Ok(()),
            Ok(None) => self.other()?.map_or(Ok(()), Err),
            // The table still says what was planned.
            Err(error @ CampaignError::Damaged { .. }) => {
                self.table()?.map_or(Err(error), |_| Ok(()))
            }
            Err(error) => Err(error),
        }
    }

    /// Keeps a campaign as it is planned; how many of its rows there were before. A folder that has one may get more rows behind the last.
    ///
    /// # Errors
    /// [`CampaignError::NotACampaign`], [`CampaignError::Changed`], [`CampaignError::Locked`], [`CampaignError::Io`].
    pub fn plan(
        &self,
        about: &About,
        written: &str,
        campaign: &Campaign,
    ) -> Result<usize, CampaignError> {
        let root = &self.root;
        self.check()?;
        self.files
            .create_dir_all(root)
            .map_err(io("make the folder", root))?;
        let _guard = self.lock()?;
        let (planned, before) = match self.about() {
            Ok(None) => (None, None),
            Ok(planned) => (planned, self.table()?),
            Err(CampaignError::Damaged { .. }) => (None, self.table()?),
            Err(error) => return Err(error),
        };
        let kept = planned.as_ref().map(|planned| planned.keep);
        let kept = match (kept, &before) {
            (None, Some(before)) => self.kept(before.rows.len())?,
            (kept, _) => kept,
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
                let rest = "not there".to_owned();
                return Err(changed(index, old.settings.join(", "), rest));
            };
            if old.settings != new.settings {
                return Err(changed(
                    index,
                    old.settings.join(", "),
                    new.settings.join(", "),
                ));
            }
            if old.content_key != new.content_key {
                let of = |row: &super::PlannedRun| {
                    format!("{} of content {}", row.settings.join(", "), row.content_key)
                };
                return Err(changed(index, of(old), of(new)));
            }
        }
        if let Some(kept) = kept.filter(|kept| *kept != about.keep) {
            return Err(CampaignError::KeepChanged {
                path: root.clone(),
                before: kept,
                now: about.keep,
            });
        }
        if let Some(planned) = planned {
            // Also where the table is gone, since what rows have ended in is still there.
            if !planned.is_of(campaign) {
                let before = format!("one of {} others", planned.rows);
                return Err(changed(0, before, "of another content".to_owned()));
            }
        }
        let about = About {
            rows: campaign.rows.len(),
            content: campaign.content(0..campaign.rows.len()),
            ..about.clone()
        };
        let bytes = serde_json::to_vec_pretty(&about).map_err(std::io::Error::other);
        let path = root.join(ABOUT);
        self.replace(&path, &bytes.map_err(io("write", &path))?)?;
        self.replace(&root.join(WRITTEN), written.as_bytes())?;
        // Last: a folder without it is no campaign yet.
        let path = root.join(TABLE);
        let bytes = campaign.to_bytes().map_err(|source| CampaignError::Table {
            path: path.clone(),
            source: Box::new(source),
        })?;
        self.replace(&path, &bytes)?;
        Ok(before.rows.len())
    }
}
