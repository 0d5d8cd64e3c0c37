//! What can be wrong with publishing and fetching.

use std::io;
use std::path::PathBuf;

use super::files::Kind;
use super::objects::ObjectError;
use crate::campaign::CampaignError;

/// A folder that cannot be published, or a publication that cannot be fetched.
#[derive(Debug, thiserror::Error)]
pub enum PublishError {
    /// The file system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// What was asked of it.
        action: &'static str,
        /// Where.
        path: PathBuf,
        /// Its answer.
        source: io::Error,
    },
    /// The storage failed.
    #[error(transparent)]
    Objects(#[from] ObjectError),
    /// A place that is none.
    #[error(
        "\"{place}\" is no place in object storage; write s3://BUCKET/PREFIX, as in s3://fretting/friction"
    )]
    NoPlace {
        /// As given.
        place: String,
    },
    /// A folder of something else.
    #[error("{} is neither a run (run.json) nor a planned campaign (campaign.parquet)", path.display())]
    NothingToPublish {
        /// The folder.
        path: PathBuf,
    },
    /// A run without an iteration.
    #[error("the run {} has no committed iteration yet; `fretwear run` goes on with it", path.display())]
    NotBegun {
        /// Its folder.
        path: PathBuf,
    },
    /// Another process writes to the folder.
    #[error("{} is in use by {}; wait for it or stop it", path.display(), pid.map_or("another process".to_owned(), |pid| format!("process {pid}")))]
    Locked {
        /// The folder.
        path: PathBuf,
        /// The process, if known.
        pid: Option<u32>,
    },
    /// A campaign that cannot be read.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// A storage that would overwrite.
    #[error(
        "{place}: this storage does not heed conditions ({condition}), so that publishing could overwrite what others publish; nothing was published"
    )]
    NoConditions {
        /// The place.
        place: String,
        /// The header that it passes over.
        condition: &'static str,
    },
    /// Something else is published there.
    #[error("{place} holds {found}: {what}; give another prefix")]
    Other {
        /// The place.
        place: String,
        /// What it holds.
        found: String,
        /// Where it differs.
        what: String,
    },
    /// What is published has more than the folder.
    #[error("what is published at {place} goes further: {theirs}, and {} {ours}; fetch it first", path.display())]
    Behind {
        /// The place.
        place: String,
        /// How far it goes.
        theirs: String,
        /// The folder.
        path: PathBuf,
        /// How far that goes.
        ours: String,
    },
    /// A file that was written meanwhile.
    #[error("{} was changed while it was published; publish again", path.display())]
    Changed {
        /// The file.
        path: PathBuf,
    },
    /// Too much for one publication.
    #[error("{}: {reason}", path.display())]
    TooMuch {
        /// The folder or file.
        path: PathBuf,
        /// What is too much, and what to do.
        reason: String,
    },
    /// Others publish all the time.
    #[error(
        "{place}: others have published there {times} times meanwhile; publish again, which goes on where this ended"
    )]
    Contended {
        /// The place.
        place: String,
        /// How often.
        times: usize,
    },
    /// A place without a publication.
    #[error("nothing is published at {place}: there is no published.json")]
    NothingPublished {
        /// The place.
        place: String,
    },
    /// A publication that is not as this program writes it.
    #[error("{place}/{name}: {reason}")]
    Damaged {
        /// The place.
        place: String,
        /// The object.
        name: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A folder that has something else.
    #[error("{} holds {what}; give another --to", path.display())]
    Occupied {
        /// The folder.
        path: PathBuf,
        /// What it holds.
        what: String,
    },
    /// A disk without room.
    #[error("{} has {free} bytes free, and {bytes} are to be fetched", path.display())]
    NoSpace {
        /// The folder.
        path: PathBuf,
        /// Bytes to be fetched.
        bytes: u64,
        /// Bytes that are free.
        free: u64,
    },
}

impl PublishError {
    /// True for what its user asked.
    pub fn is_usage(&self) -> bool {
        match self {
            PublishError::Campaign(error) => error.is_usage(),
            PublishError::NoPlace { .. }
            | PublishError::NothingToPublish { .. }
            | PublishError::NotBegun { .. }
            | PublishError::NothingPublished { .. } => true,
            _ => false,
        }
    }

    /// True for a folder or a place that is not what it should be.
    pub fn is_damage_or_mismatch(&self) -> bool {
        match self {
            PublishError::Campaign(error) => error.is_damage_or_mismatch(),
            PublishError::Other { .. }
            | PublishError::Behind { .. }
            | PublishError::Damaged { .. }
            | PublishError::Occupied { .. } => true,
            _ => false,
        }
    }

    pub(super) fn io(
        action: &'static str,
        path: &std::path::Path,
    ) -> impl FnOnce(io::Error) -> PublishError {
        let path = path.to_owned();
        move |source| PublishError::Io {
            action,
            path,
            source,
        }
    }

    pub(super) fn of_another_kind(place: String, found: Kind, own: Kind) -> PublishError {
        PublishError::Other {
            place,
            found: format!("a {}", found.name()),
            what: format!("this is a {}", own.name()),
        }
    }
}
