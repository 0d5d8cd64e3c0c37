//! Errors of reading files of matrices.

use std::path::PathBuf;

/// Error in a file of matrices.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct ReadError {
    /// Path of the file.
    pub path: PathBuf,
    /// Cause of the error.
    pub problem: ReadProblem,
}

/// Cause of an error in a file of matrices.
#[derive(Debug, thiserror::Error)]
pub enum ReadProblem {
    /// The operating system cannot read the file.
    #[error("cannot be read: {source}")]
    Io {
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The content has no known format.
    #[error(
        "its content begins with \"{found}\" and has no known format of matrices; supported formats are {supported}"
    )]
    UnknownFormat {
        /// First characters of the file.
        found: String,
        /// Names of the supported formats.
        supported: String,
    },
    /// The content violates the format.
    #[error("{place}: found {found}; expected {expected}")]
    Malformed {
        /// Place in the file.
        place: String,
        /// Content at this place.
        found: String,
        /// Valid content.
        expected: String,
    },
    /// The file or a part of it is truncated.
    #[error(
        "{part} ends after {found}; expected {expected}: the file is cut off, or its header is wrong"
    )]
    Truncated {
        /// Name of the part.
        part: String,
        /// Amount of data in the file.
        found: String,
        /// Expected amount of data.
        expected: String,
    },
    /// The file announces more rows or entries than the file, or any structure, can have.
    #[error("{found}; {limit}")]
    TooMany {
        /// Description of the number.
        found: String,
        /// Description of the limit.
        limit: String,
    },
    /// A valid variant of the format is not supported.
    #[error("{found} is not supported; {advice}")]
    Unsupported {
        /// Description of the variant.
        found: String,
        /// Advice to the user.
        advice: String,
    },
    /// The error is in a deck that includes other files.
    #[error("{problem} ({told})")]
    Included {
        /// The error, with line numbers of the combined deck.
        problem: Box<ReadProblem>,
        /// Line numbers of the included files in the combined deck.
        told: String,
    },
    /// Files or matrices contradict each other.
    #[error("{found}; {advice}")]
    DoNotFit {
        /// Description of the contradiction.
        found: String,
        /// Advice to the user.
        advice: String,
    },
}

impl ReadProblem {
    /// Adds the line numbers of included files to the error, if there are any.
    pub(super) fn with_line_note(self, told: Option<String>) -> Self {
        match told {
            Some(told) => ReadProblem::Included {
                problem: Box::new(self),
                told,
            },
            None => self,
        }
    }

    /// Returns [`ReadProblem::Malformed`] for content that violates the format.
    pub(super) fn malformed(
        place: impl ToString,
        found: impl ToString,
        expected: impl ToString,
    ) -> Self {
        ReadProblem::Malformed {
            place: place.to_string(),
            found: found.to_string(),
            expected: expected.to_string(),
        }
    }

    /// Returns [`ReadProblem::Truncated`] for a part of a file that ends too early.
    pub(super) fn truncated(
        part: impl ToString,
        found: impl ToString,
        expected: impl ToString,
    ) -> Self {
        ReadProblem::Truncated {
            part: part.to_string(),
            found: found.to_string(),
            expected: expected.to_string(),
        }
    }
}
