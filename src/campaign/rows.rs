//! The rows of a campaign in its folder: which process has one, and what became of it.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::error::CampaignError;
use super::folder::{DRAFT, Folder, KeepRuns, io};
use crate::store::{Layout, LockAttempt, LockGuard, LockHolder, RealFileSystem, date, remove_run};

/// Bytes of a reason at most.
const LONGEST_FAILURE: u64 = 1 << 20;
/// Exit code of a process that failed for no reason that has a code of its own.
const EXIT_FAILURE: u8 = 1;
/// Digits of an index in names; a longer one has more.
const DIGITS: usize = 6;

pub(super) const RUNS: &str = "runs";
pub(super) const ENDED: &str = "ended";
pub(super) const FAILED: &str = "failed";
pub(super) const LOCKS: &str = "locks";

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
    pub code: u8,
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

    fn is_there(&self, path: &Path) -> Result<bool, CampaignError> {
        let found = self.files.metadata(path).map_err(io("look at", path))?;
        Ok(found.is_some())
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

    /// What is kept of runs that have ended, as far as the folder shows it.
    pub(super) fn kept(&self, rows: usize) -> Result<Option<KeepRuns>, CampaignError> {
        for index in 0..rows {
            if self.is_there(&self.ended(index))? {
                let is_whole = self.is_there(&Layout::at(&self.run(index)).record())?;
                return Ok(Some(match is_whole {
                    true => KeepRuns::All,
                    false => KeepRuns::History,
                }));
            }
        }
        Ok(None)
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
        let locks = [self.claimed(index), Layout::at(&self.run(index)).lock()];
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
                    Failure::now(message, true, EXIT_FAILURE)
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

    /// Keeps the history of a run that has ended.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn end(&self, index: usize, history: &[u8]) -> Result<(), CampaignError> {
        self.replace(&self.ended(index), history)?;
        self.forget(index)
    }

    /// Removes what a row that has ended does not keep, where an earlier start was killed in between: drafts, the reason of a failure, and
    /// `run`, the folder of its run, if there is one that is not kept. Nothing is removed while another process holds the row.
    pub fn tidy_ended(&self, index: usize, content_key: &str, run: Option<&Path>) {
        let drafts = [self.ended(index), self.failed(index)].map(|path| {
            let mut draft = path.into_os_string();
            draft.push(DRAFT);
            PathBuf::from(draft)
        });
        let own = [self.failed(index), self.claimed(index)];
        let left = drafts.iter().chain(&own).map(PathBuf::as_path).chain(run);
        let is_left = |path: &Path| matches!(self.files.metadata(path), Ok(Some(_)));
        if left.into_iter().any(is_left)
            && let Ok(LockAttempt::Taken(claim)) = self.claim(index)
        {
            // A file that stays does no harm: the row has ended.
            for draft in &drafts {
                drop(self.files.remove_file(draft));
            }
            drop(self.forget(index));
            if let Some(run) = run {
                drop(remove_run(self.files.as_ref(), run, content_key));
            }
            drop(self.release(index, claim));
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
