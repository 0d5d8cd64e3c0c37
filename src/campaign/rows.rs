//! Locks and states of the rows in a campaign folder.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::error::CampaignError;
use super::folder::{CampaignFolder, DRAFT, KeepRuns, io_error};
use crate::store::{Layout, LockAttempt, LockGuard, LockHolder, RealFileSystem, date, remove_run};

/// Largest size of the file with the reason of a failure \[B\].
const LONGEST_FAILURE: u64 = 1 << 20;
/// Exit code of a failure that has no code of its own.
const EXIT_FAILURE: u8 = 1;
/// Smallest number of digits of an index in file names.
const DIGITS: usize = 6;

pub(super) const RUNS: &str = "runs";
pub(super) const ENDED: &str = "ended";
pub(super) const FAILED: &str = "failed";
pub(super) const LOCKS: &str = "locks";

/// State of a row, derived from the files that exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Not started.
    Waiting,
    /// Started but not complete: another process computes the row, or its run was stopped.
    Incomplete,
    /// The run failed.
    Failed,
    /// The run is complete.
    Complete,
}

/// Failure of a row.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// Date and time of the failure.
    pub when: String,
    /// Reason of the failure, as the program printed the reason.
    pub message: String,
    /// True if the next start computes the row again. Only failures of the machine, of the disk, or of a file that the
    /// scene names permit a retry.
    pub again: bool,
    /// Exit code of the process.
    pub code: u8,
}

impl Failure {
    /// Creates a failure with the present date and time.
    pub fn now(message: String, again: bool, code: u8) -> Failure {
        Failure {
            when: date::now(),
            message,
            again,
            code,
        }
    }
}

/// Returns the file name of a row, without an extension.
fn name(index: usize) -> String {
    format!("{index:0DIGITS$}")
}

/// Returns the row index of a file name.
fn index_of(name: &str, ending: &str) -> Option<usize> {
    let digits = name.strip_suffix(ending)?;
    let is_ours = digits.len() >= DIGITS && digits.bytes().all(|b| b.is_ascii_digit());
    digits.parse().ok().filter(|_| is_ours)
}

impl CampaignFolder {
    /// Returns the run folder of a row.
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
        let metadata = self
            .files
            .metadata(path)
            .map_err(io_error("access", path))?;
        Ok(metadata.is_some())
    }

    /// Returns the state of every row, derived from the file names in the folder.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn states(&self, rows: usize) -> Result<Vec<State>, CampaignError> {
        let mut states = vec![State::Waiting; rows];
        let folders = [
            (LOCKS, "", State::Incomplete),
            (RUNS, "", State::Incomplete),
            (FAILED, ".json", State::Failed),
            (ENDED, ".parquet", State::Complete),
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

    /// Returns which files of completed runs are kept. Returns `None` if no run is complete.
    pub(super) fn keep_of_completed_runs(
        &self,
        rows: usize,
    ) -> Result<Option<KeepRuns>, CampaignError> {
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

    /// Returns the state of one row.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn state(&self, index: usize) -> Result<State, CampaignError> {
        let places = [
            (self.ended(index), State::Complete),
            (self.failed(index), State::Failed),
            (self.run(index), State::Incomplete),
            (self.row_lock(index), State::Incomplete),
        ];
        for (path, state) in places {
            if self.is_there(&path)? {
                return Ok(state);
            }
        }
        Ok(State::Waiting)
    }

    fn row_lock(&self, index: usize) -> PathBuf {
        self.root.join(LOCKS).join(name(index))
    }

    /// Tries to take the lock of a row. Take the lock first, then read the state of the row. Another process can
    /// complete the row before this process takes the lock.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn lock_row(&self, index: usize) -> Result<LockAttempt, CampaignError> {
        let locks = self.root.join(LOCKS);
        self.files
            .create_dir_all(&locks)
            .map_err(io_error("make the folder", &locks))?;
        let lock = self.row_lock(index);
        self.files.try_lock(&lock).map_err(io_error("lock", &lock))
    }

    /// Releases the lock of a row. The lock file is removed first, so a process that waits for the lock finds the file
    /// missing.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn unlock_row(&self, index: usize, claim: Box<dyn LockGuard>) -> Result<(), CampaignError> {
        let lock = self.row_lock(index);
        let removed = self.files.remove_file(&lock);
        drop(claim);
        match removed {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                Err(io_error("remove", &lock)(error))
            }
            _ => Ok(()),
        }
    }

    /// Returns the process that computes a row, if there is one.
    pub fn holder(&self, index: usize) -> Option<LockHolder> {
        // Without permission to read a lock, report no holder. A run that was started without the campaign has its own
        // lock.
        let locks = [self.row_lock(index), Layout::at(&self.run(index)).lock()];
        let mut holders = locks.iter().map(|lock| RealFileSystem.lock_holder(lock));
        holders.find_map(|holder| holder.ok().flatten())
    }

    /// Reads the failure of a row. If the file of the failure is unreadable, the returned failure describes the read
    /// error.
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
            Err(error) => Err(io_error("read", &path)(error)),
        }
    }

    /// Stores the failure of a row.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn store_failure(&self, index: usize, failure: &Failure) -> Result<(), CampaignError> {
        self.replace(&self.failed(index), json!(failure).to_string().as_bytes())
    }

    /// Removes the failure of a row, which is then tried again.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn remove_failure(&self, index: usize) -> Result<(), CampaignError> {
        let failed = self.failed(index);
        match self.files.remove_file(&failed) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                Err(io_error("remove", &failed)(error))
            }
            _ => Ok(()),
        }
    }

    /// Stores the history of a completed run and removes an earlier failure.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn complete(&self, index: usize, history: &[u8]) -> Result<(), CampaignError> {
        self.replace(&self.ended(index), history)?;
        self.remove_failure(index)
    }

    /// Removes files of a completed row that a killed process did not remove: drafts, a failure and the lock. If `run`
    /// is `Some`, the function removes the run folder `run`. Nothing is removed while another process has the lock of
    /// the row.
    pub fn tidy_ended(&self, index: usize, content_key: &str, run: Option<&Path>) {
        let drafts = [self.ended(index), self.failed(index)].map(|path| {
            let mut draft = path.into_os_string();
            draft.push(DRAFT);
            PathBuf::from(draft)
        });
        let own = [self.failed(index), self.row_lock(index)];
        let leftovers = drafts.iter().chain(&own).map(PathBuf::as_path).chain(run);
        let exists = |path: &Path| matches!(self.files.metadata(path), Ok(Some(_)));
        if leftovers.into_iter().any(exists)
            && let Ok(LockAttempt::Taken(claim)) = self.lock_row(index)
        {
            // Ignore errors: a leftover file does no harm to a completed row.
            for draft in &drafts {
                drop(self.files.remove_file(draft));
            }
            drop(self.remove_failure(index));
            if let Some(run) = run {
                drop(remove_run(self.files.as_ref(), run, content_key));
            }
            drop(self.unlock_row(index, claim));
        }
    }

    /// Returns the completed rows, sorted by index, with their history files.
    pub(super) fn all_ended(&self) -> Result<Vec<(usize, PathBuf)>, CampaignError> {
        let names = self.list(ENDED)?;
        let indices = names.iter().filter_map(|name| index_of(name, ".parquet"));
        Ok(indices.map(|index| (index, self.ended(index))).collect())
    }

    /// Returns the index and the failure of each failed row.
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

/// Parses `N` or `A-B` into the first and last row index.
///
/// # Errors
/// A sentence that says what would be right.
pub fn indices(text: &str) -> Result<[usize; 2], String> {
    let syntax_error =
        || format!("\"{text}\" is neither an index nor a range; write N or A-B, as in 17 or 0-99");
    let number = |text: &str| text.trim().parse::<usize>().map_err(|_| syntax_error());
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
