//! What can be wrong with a campaign.

use std::io;
use std::path::PathBuf;

use super::folder::KeepRuns;
use crate::store::LAYOUT;
use crate::tables::TableError;

/// A campaign that cannot be planned, run or read.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// The file system refused.
    #[error("cannot {action} {}: {source}{}", path.display(), advice(source))]
    Io {
        /// What was asked of it.
        action: &'static str,
        /// Where.
        path: PathBuf,
        /// Its answer.
        source: io::Error,
    },
    /// The campaign file is not TOML.
    #[error("{}: is not valid TOML: {reason}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// What the parser says.
        reason: String,
    },
    /// Something in the campaign file.
    #[error("{}: {key} = {value}: {instead}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// The key in it.
        key: String,
        /// Its value.
        value: String,
        /// What would be right.
        instead: String,
    },
    /// Something that the campaign file lacks.
    #[error("{}: {what}", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
        /// What, and what would be right.
        what: String,
    },
    /// A link, or a file, where a campaign has one of its folders.
    #[error(
        "{} is not a folder but {found}: rows could be written or removed outside of the campaign; link the whole campaign folder, or use --scratch",
        path.display()
    )]
    NotAFolder {
        /// Where.
        path: PathBuf,
        /// The kind of the entry, with its article.
        found: &'static str,
    },
    /// A folder that holds something else.
    #[error(
        "{} is not a campaign: it has no campaign.json but holds `{found}`; give another --dir",
        path.display()
    )]
    NotACampaign {
        /// The folder.
        path: PathBuf,
        /// An entry of it.
        found: String,
    },
    /// A folder without a campaign.
    #[error("there is no campaign in {}; `fretwear campaign plan CAMPAIGN.toml --dir DIR` makes one", path.display())]
    NoCampaign {
        /// The folder.
        path: PathBuf,
    },
    /// A folder that holds another campaign.
    #[error(
        "{} holds another campaign: row {index} was {before}, and is {now}; give another --dir (rows may be added behind the last)",
        path.display()
    )]
    Changed {
        /// The folder.
        path: PathBuf,
        /// The first row that differs.
        index: u64,
        /// As planned before.
        before: String,
        /// As it would be now.
        now: String,
    },
    /// A folder whose runs are kept in another way.
    #[error(
        "{} keeps {}, and would keep {}: existing tables would be removed or are missing; give another --dir",
        path.display(), kept(*before), kept(*now)
    )]
    KeepChanged {
        /// The folder.
        path: PathBuf,
        /// As planned before.
        before: KeepRuns,
        /// As it would be now.
        now: KeepRuns,
    },
    /// A folder of another layout.
    #[error(
        "the campaign {} has layout {found} of fretwear {program_version}; this program reads only layout {LAYOUT}: use the program that planned it, or plan the campaign in another folder",
        path.display()
    )]
    OtherLayout {
        /// The folder.
        path: PathBuf,
        /// Number of its layout.
        found: u64,
        /// Version of the program that planned it.
        program_version: String,
    },
    /// A file of a campaign that is not as it was written.
    #[error("{}: {reason}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what to do.
        reason: String,
    },
    /// A row that there is not.
    #[error("--index {asked}: {} has the rows 0 to {last}", path.display())]
    NoRow {
        /// The folder.
        path: PathBuf,
        /// As asked.
        asked: String,
        /// The last row.
        last: u64,
    },
    /// Another process plans or collects.
    #[error("{} is being planned or collected by {}; wait for it or stop it", path.display(), process(*pid))]
    Locked {
        /// The folder.
        path: PathBuf,
        /// The process, if known.
        pid: Option<u32>,
    },
    /// Nothing to report.
    #[error("{}: no run has been collected; `fretwear campaign collect --dir {}` collects those that have ended", path.display(), path.display())]
    NothingCollected {
        /// The folder.
        path: PathBuf,
    },
    /// A table that cannot be made.
    #[error("cannot make {}: {source}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<TableError>,
    },
}

fn kept(keep: KeepRuns) -> &'static str {
    match keep {
        KeepRuns::All => "whole runs (keep = \"runs\")",
        KeepRuns::History => "histories alone (keep = \"history\")",
    }
}

/// Advice where the same call may succeed later.
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
    /// True for what its user wrote or asked.
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

    /// True for a folder that is not what it should be.
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
