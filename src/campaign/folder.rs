//! The folder of a campaign: its table, and what became of its rows.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::error::CampaignError;
use super::table::Campaign;
use crate::store::{
    EntryKind, FileSystem, LockAttempt, LockGuard, LockHolder, RealFileSystem, date,
};

/// Version of the layout.
const FORMAT: u32 = 2;
/// Bytes of `campaign.json` at most: it holds the text of a scene.
const LONGEST_ABOUT: u64 = 64 << 20;
/// Bytes of a table at most.
pub(super) const LONGEST_TABLE: u64 = 4 << 30;
/// Bytes of a reason at most.
const LONGEST_FAILURE: u64 = 1 << 20;
/// Digits of an index in names; a longer one has more.
const DIGITS: usize = 6;

const ABOUT: &str = "campaign.json";
const TABLE: &str = "campaign.parquet";
const WRITTEN: &str = "campaign.toml";
const RUNS: &str = "runs";
const ENDED: &str = "ended";
const FAILED: &str = "failed";
const LOCKS: &str = "locks";
pub(super) const COLLECTED: &str = "collected";

/// What is kept of a run that has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KeepRuns {
    /// The folder of the run too.
    All,
    /// Its history alone: one file a run.
    History,
}

/// A section of a campaign file: its points are rows, or make rows with those of other sections.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Section {
    /// Points, each with every one of the other sections'.
    pub points: usize,
    /// Keys that vary with them.
    pub keys: Vec<String>,
    /// Whether its points are drawn.
    pub is_random: bool,
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
    /// The sections whose points the rows are, the slowest first.
    pub sections: Vec<Section>,
    /// Rows that were planned, and the hash of their content keys: a table of other rows is not this campaign's.
    rows: usize,
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
            format: FORMAT,
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

    /// Whether the first rows of a campaign are those that were planned.
    fn is_of(&self, campaign: &Campaign) -> bool {
        self.rows <= campaign.rows.len() && campaign.content(0..self.rows) == self.content
    }
}

/// What became of a row, by what there is of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Nothing yet.
    Waiting,
    /// A run that has not ended: it goes on elsewhere, or was stopped.
    Begun,
    /// A run that failed.
    Failed,
    /// A run that has ended.
    Done,
}

/// Why a row failed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// When that was.
    pub when: String,
    /// The reason, as it was printed.
    pub message: String,
    /// True if the next start tries it again: what failed was the machine, the disk, or a file that the scene names.
    pub again: bool,
    /// The exit code of its process.
    #[serde(default = "failed")]
    pub code: u8,
}

fn failed() -> u8 {
    1
}

impl Failure {
    /// One of now.
    pub fn now(message: String, again: bool, code: u8) -> Failure {
        Failure {
            when: date::now(),
            message,
            again,
            code,
        }
    }
}

/// The folder of a campaign.
#[derive(Clone)]
pub struct Folder {
    /// Where it is.
    pub root: PathBuf,
    pub(super) files: Arc<dyn FileSystem>,
}

fn io<'a>(
    action: &'static str,
    path: &'a Path,
) -> impl FnOnce(std::io::Error) -> CampaignError + 'a {
    move |source| CampaignError::Io {
        action,
        path: path.to_owned(),
        source,
    }
}

/// The name of a row in the folders.
fn name(index: usize) -> String {
    format!("{index:0DIGITS$}")
}

/// The row of a name.
fn index_of(name: &str, ending: &str) -> Option<usize> {
    let digits = name.strip_suffix(ending)?;
    let is_ours = digits.len() >= DIGITS && digits.bytes().all(|b| b.is_ascii_digit());
    digits.parse().ok().filter(|_| is_ours)
}

impl Folder {
    /// A folder, of which nothing is looked at yet.
    pub fn at(files: Arc<dyn FileSystem>, root: &Path) -> Folder {
        Folder {
            root: root.to_owned(),
            files,
        }
    }

    /// The folder of the run of a row.
    pub fn run(&self, index: usize) -> PathBuf {
        self.root.join(RUNS).join(name(index))
    }

    fn ended(&self, index: usize) -> PathBuf {
        self.root.join(ENDED).join(name(index) + ".parquet")
    }

    fn failed(&self, index: usize) -> PathBuf {
        self.root.join(FAILED).join(name(index) + ".json")
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
        // Two processes that end the same row must not write into one draft.
        draft.push(format!(".{}.new", std::process::id()));
        let draft = PathBuf::from(draft);
        let folder = path.parent().unwrap_or(Path::new(""));
        self.files
            .create_dir_all(folder)
            .map_err(io("make the folder", folder))?;
        // Of a process of this number that was killed.
        drop(self.files.remove_file(&draft));
        let written = self
            .files
            .write_new(&draft, bytes)
            .and_then(|()| self.files.sync_file(&draft))
            .and_then(|()| self.files.rename(&draft, path));
        if let Err(source) = written {
            // Half a draft serves nobody; why it was not finished says more than that it cannot be removed.
            drop(self.files.remove_file(&draft));
            return Err(io("write", path)(source));
        }
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

    fn is_there(&self, path: &Path) -> Result<bool, CampaignError> {
        let found = self.files.metadata(path).map_err(io("look at", path))?;
        Ok(found.is_some())
    }

    fn about(&self) -> Result<Option<About>, CampaignError> {
        let path = self.root.join(ABOUT);
        let bytes = match self.files.read(&path, LONGEST_ABOUT) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(io("read", &path)(error)),
        };
        let about: Result<About, _> = serde_json::from_slice(&bytes);
        let damaged = |reason| CampaignError::Damaged { path, reason };
        match about {
            Ok(about) if about.format == FORMAT => Ok(Some(about)),
            Ok(about) => Err(damaged(format!(
                "it has the layout {}, and this program knows {FORMAT}; use the program that planned it, {}",
                about.format, about.program_version
            ))),
            Err(error) => Err(damaged(format!(
                "it cannot be read ({error}); plan the campaign again in this folder"
            ))),
        }
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
    /// [`CampaignError::NoCampaign`], [`CampaignError::NotACampaign`], [`CampaignError::Damaged`], [`CampaignError::Io`].
    pub fn open(&self) -> Result<(About, Campaign), CampaignError> {
        match (self.about()?, self.table()?) {
            (Some(about), Some(campaign)) if about.is_of(&campaign) => Ok((about, campaign)),
            (Some(about), Some(campaign)) => Err(CampaignError::Damaged {
                path: self.root.join(TABLE),
                reason: match campaign.rows.len() < about.rows {
                    true => format!(
                        "it has {} rows, and {} were planned: to plan or to fetch it was interrupted; do it again",
                        campaign.rows.len(),
                        about.rows
                    ),
                    false => "its rows are not those that were planned in this folder; put back what belongs there, or give another --dir".to_owned(),
                },
            }),
            (None, _) => Err(self.other()?.unwrap_or(CampaignError::NoCampaign {
                path: self.root.clone(),
            })),
            // Killed while it was planned.
            (Some(_), None) => Err(CampaignError::NoCampaign {
                path: self.root.clone(),
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
        if self.about()?.is_some() {
            return Ok(());
        }
        self.other()?.map_or(Ok(()), Err)
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
        let planned = self.about()?;
        let before = match planned {
            None => None,
            Some(_) => self.table()?,
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
                let of = |row: &super::Planned| {
                    format!("{} of content {}", row.settings.join(", "), row.content_key)
                };
                return Err(changed(index, of(old), of(new)));
            }
        }
        if let Some(planned) = planned {
            if planned.keep != about.keep {
                return Err(CampaignError::KeepChanged {
                    path: root.clone(),
                    before: planned.keep,
                    now: about.keep,
                });
            }
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

    /// What became of every row, by the names in the folder.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn states(&self, rows: usize) -> Result<Vec<State>, CampaignError> {
        let mut states = vec![State::Waiting; rows];
        let folders = [
            (LOCKS, "", State::Begun),
            (RUNS, "", State::Begun),
            (FAILED, ".json", State::Failed),
            (ENDED, ".parquet", State::Done),
        ];
        for (folder, ending, state) in folders {
            for name in self.list(folder)? {
                if let Some(own) = index_of(&name, ending).and_then(|k| states.get_mut(k)) {
                    *own = state;
                }
            }
        }
        Ok(states)
    }

    /// What became of one row.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn state(&self, index: usize) -> Result<State, CampaignError> {
        let places = [
            (self.ended(index), State::Done),
            (self.failed(index), State::Failed),
            (self.run(index), State::Begun),
            (self.claimed(index), State::Begun),
        ];
        for (path, state) in places {
            if self.is_there(&path)? {
                return Ok(state);
            }
        }
        Ok(State::Waiting)
    }

    fn claimed(&self, index: usize) -> PathBuf {
        self.root.join(LOCKS).join(name(index))
    }

    /// Takes the lock of a row. What became of the row is to be looked at only then: another start may just have ended it.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn claim(&self, index: usize) -> Result<LockAttempt, CampaignError> {
        let locks = self.root.join(LOCKS);
        self.files
            .create_dir_all(&locks)
            .map_err(io("make the folder", &locks))?;
        let lock = self.claimed(index);
        self.files.try_lock(&lock).map_err(io("lock", &lock))
    }

    /// Gives the lock of a row back. Its file goes while it is held, so that whoever waits for it finds that it is gone.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn release(&self, index: usize, claim: Box<dyn LockGuard>) -> Result<(), CampaignError> {
        let lock = self.claimed(index);
        let removed = self.files.remove_file(&lock);
        drop(claim);
        match removed {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(io("remove", &lock)(error)),
            _ => Ok(()),
        }
    }

    /// Who computes a row at the moment; none if nobody does.
    pub fn holder(&self, index: usize) -> Option<LockHolder> {
        // Whoever may not look is told nothing. The run's own is held by who runs it without the campaign.
        let locks = [self.claimed(index), self.run(index).join("lock")];
        let mut holders = locks.iter().map(|lock| RealFileSystem.lock_holder(lock));
        holders.find_map(|holder| holder.ok().flatten())
    }

    /// Why a row failed. What cannot be read says so.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn failure(&self, index: usize) -> Result<Option<Failure>, CampaignError> {
        let path = self.failed(index);
        match self.files.read(&path, LONGEST_FAILURE) {
            Ok(bytes) => Ok(Some(serde_json::from_slice(&bytes).unwrap_or_else(
                |error| {
                    let message = format!("{} cannot be read: {error}", path.display());
                    Failure::now(message, true, failed())
                },
            ))),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(error) => Err(io("read", &path)(error)),
        }
    }

    /// Keeps why a row failed.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn fail(&self, index: usize, failure: &Failure) -> Result<(), CampaignError> {
        self.replace(&self.failed(index), json!(failure).to_string().as_bytes())
    }

    /// Takes away why a row failed, which is tried again.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn forget(&self, index: usize) -> Result<(), CampaignError> {
        let failed = self.failed(index);
        match self.files.remove_file(&failed) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(io("remove", &failed)(error)),
            _ => Ok(()),
        }
    }

    /// Keeps the history of a run that has ended, and removes its folder if that is all that is kept.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn end(&self, index: usize, history: &[u8], keep: KeepRuns) -> Result<(), CampaignError> {
        self.replace(&self.ended(index), history)?;
        self.tidy(index, keep)
    }

    /// Removes what a row that has ended does not keep, where an earlier start was killed in between; not while another process holds the
    /// row, nor in a folder that may only be read.
    pub fn tidy_ended(&self, index: usize, keep: KeepRuns) {
        let run = match keep {
            KeepRuns::All => None,
            KeepRuns::History => Some(self.run(index)),
        };
        let left = [Some(self.failed(index)), run, Some(self.claimed(index))];
        let is_left = |path: PathBuf| matches!(self.files.metadata(&path), Ok(Some(_)));
        if left.into_iter().flatten().any(is_left)
            && let Ok(LockAttempt::Taken(claim)) = self.claim(index)
        {
            // What stays does no harm: the row has ended.
            drop(self.tidy(index, keep));
            drop(self.release(index, claim));
        }
    }

    /// Removes what a row that has ended does not keep.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn tidy(&self, index: usize, keep: KeepRuns) -> Result<(), CampaignError> {
        self.forget(index)?;
        let run = self.run(index);
        let found = self.files.metadata(&run).map_err(io("look at", &run))?;
        match found {
            Some(found) if keep == KeepRuns::History && found.kind == EntryKind::Folder => {
                self.files.remove_dir_all(&run).map_err(io("remove", &run))
            }
            _ => Ok(()),
        }
    }

    /// The rows that have ended, in the order of their indices, with the files of their histories.
    pub(super) fn all_ended(&self) -> Result<Vec<(usize, PathBuf)>, CampaignError> {
        let names = self.list(ENDED)?;
        let indices = names.iter().filter_map(|name| index_of(name, ".parquet"));
        Ok(indices.map(|index| (index, self.ended(index))).collect())
    }

    /// The rows that failed, each with the reason.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn failures(&self, states: &[State]) -> Result<Vec<(usize, Failure)>, CampaignError> {
        let mut failures = Vec::new();
        for (index, _) in states
            .iter()
            .enumerate()
            .filter(|(_, s)| **s == State::Failed)
        {
            failures.extend(self.failure(index)?.map(|failure| (index, failure)));
        }
        Ok(failures)
    }
}

/// The rows that `N` or `A-B` names.
///
/// # Errors
/// A sentence.
pub fn indices(text: &str) -> Result<[usize; 2], String> {
    let wrong = || format!("\"{text}\" is no index and no range; write N or A-B, as in 17 or 0-99");
    let number = |text: &str| text.trim().parse::<usize>().map_err(|_| wrong());
    match text.split_once('-') {
        None => number(text).map(|index| [index, index]),
        Some((first, last)) => {
            let range = [number(first)?, number(last)?];
            match range[0] <= range[1] {
                true => Ok(range),
                false => Err(format!("the range \"{text}\" ends before it begins")),
            }
        }
    }
}
