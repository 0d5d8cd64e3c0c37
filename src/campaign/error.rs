//! Errors of campaigns.

use std::io;
use std::path::PathBuf;

use super::folder::KeepRuns;
use crate::store::LAYOUT;
use crate::tables::TableError;

/// Error of planning, running or reading a campaign.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// The file system reported an error.
    #[error("cannot {action} {}: {source}{}", path.display(), advice(source))]
    Io {
        /// Action that failed, as a verb.
        action: &'static str,
        /// Path of the file or folder.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// The campaign file is not TOML.
    #[error("{}: is not valid TOML: {reason}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Message of the parser.
        reason: String,
    },
    /// A key in the campaign file has a wrong value.
    #[error("{}: {key} = {value}: {instead}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Key in the campaign file.
        key: String,
        /// Value of the key.
        value: String,
        /// Advice: the expected value.
        instead: String,
    },
    /// The campaign file lacks something.
    #[error("{}: {what}", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
        /// Message: the missing part, and the expected text.
        what: String,
    },
    /// A link or a file is in the place of a folder of the campaign.
    #[error(
        "{} is {found}, not a folder: rows could be written or removed outside the campaign; link the whole campaign folder, or use --scratch",
        path.display()
    )]
    NotAFolder {
        /// Path of the file or folder.
        path: PathBuf,
        /// The kind of the entry, with its article.
        found: &'static str,
    },
    /// The folder is not a campaign: it lacks `campaign.json` and contains other files.
    #[error(
        "{} is not a campaign: it has no campaign.json but holds `{found}`; give another --dir",
        path.display()
    )]
    NotACampaign {
        /// The folder.
        path: PathBuf,
        /// An entry that does not belong to a campaign.
        found: String,
    },
    /// The folder has no campaign.
    #[error("there is no campaign in {}; create one with `fretwear campaign plan CAMPAIGN.toml --dir DIR`", path.display())]
    NoCampaign {
        /// The folder.
        path: PathBuf,
    },
    /// The folder already stores a campaign with other rows than the new plan.
    #[error(
        "{} holds another campaign: row {index} was planned as {before} and is now {now}; give another --dir (only rows after the last may be added)",
        path.display()
    )]
    Changed {
        /// The folder.
        path: PathBuf,
        /// The first row that differs.
        index: u64,
        /// Earlier plan.
        before: String,
        /// Present plan.
        now: String,
    },
    /// The existing campaign folder and the campaign file have different values of `keep`.
    #[error(
        "{} keeps {}, but the campaign file now says {}: existing tables would be removed or are missing; give another --dir",
        path.display(), keep_description(*before), keep_description(*now)
    )]
    KeepChanged {
        /// The folder.
        path: PathBuf,
        /// Earlier plan.
        before: KeepRuns,
        /// Present plan.
        now: KeepRuns,
    },
    /// The folder has another layout.
    #[error(
        "the campaign {} has layout {found} of fretwear {program_version}; this program reads only layout {LAYOUT}: use the program that planned it, or plan the campaign in another folder",
        path.display()
    )]
    OtherLayout {
        /// The folder.
        path: PathBuf,
        /// Number of the campaign's layout.
        found: u64,
        /// Version of the program that planned the campaign.
        program_version: String,
    },
    /// A file of a campaign is damaged.
    #[error("{}: {reason}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Message: the damage, and advice.
        reason: String,
    },
    /// The campaign has no row with the index that `--index` gives.
    #[error("--index {asked}: {} has the rows 0 to {last}", path.display())]
    NoRow {
        /// The folder.
        path: PathBuf,
        /// The argument of `--index`.
        asked: String,
        /// The last row.
        last: u64,
    },
    /// Another process is planning or collecting.
    #[error("{} is being planned or collected by {}; wait for it or stop it", path.display(), process(*pid))]
    Locked {
        /// The folder.
        path: PathBuf,
        /// The process, if known.
        pid: Option<u32>,
    },
    /// No run has been collected, so there is nothing to report.
    #[error("{}: no run has been collected; collect the completed runs with `fretwear campaign collect --dir {}`", path.display(), path.display())]
    NothingCollected {
        /// The folder.
        path: PathBuf,
    },
    /// A table cannot be created.
    #[error("cannot create {}: {source}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// Error of the table.
        source: Box<TableError>,
    },
}

fn keep_description(keep: KeepRuns) -> &'static str {
    match keep {
        KeepRuns::All => "whole runs (keep = \"runs\")",
        KeepRuns::History => "only histories (keep = \"history\")",
    }
}

/// Returns "try again" for errors that may disappear by themselves.
fn advice(source: &io::Error) -> &'static str {
    #[cfg(unix)]
    if let Some(number) = source.raw_os_error()
        && [
            libc::EMFILE,
            libc::ENFILE,
            libc::EINTR,
            libc::ENOMEM,
            libc::ESTALE,
            libc::EIO,
        ]
        .contains(&number)
    {
        return "; try again";
    }
    ""
}

fn process(pid: Option<u32>) -> String {
    pid.map_or("another process".to_owned(), |pid| format!("process {pid}"))
}

impl CampaignError {
    /// Returns true for errors in the campaign file or in the arguments.
    pub fn is_usage(&self) -> bool {
        matches!(
            self,
            CampaignError::Syntax { .. }
                | CampaignError::Value { .. }
                | CampaignError::Missing { .. }
                | CampaignError::NoCampaign { .. }
                | CampaignError::NoRow { .. }
                | CampaignError::NothingCollected { .. }
        )
    }

    /// Returns true if the folder is damaged, or does not contain the planned campaign.
    pub fn is_damage_or_mismatch(&self) -> bool {
        matches!(
            self,
            CampaignError::NotACampaign { .. }
                | CampaignError::Changed { .. }
                | CampaignError::KeepChanged { .. }
                | CampaignError::OtherLayout { .. }
                | CampaignError::NotAFolder { .. }
                | CampaignError::Damaged { .. }
        )
    }
}
