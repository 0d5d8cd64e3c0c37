//! Why a file of matrices could not be read.

use std::path::PathBuf;

/// A file of matrices that could not be read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct ReadError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub problem: ReadProblem,
}

/// What is wrong with a file of matrices.
#[derive(Debug, thiserror::Error)]
pub enum ReadProblem {
    /// The operating system refuses.
    #[error("cannot be read: {source}")]
    Io {
        /// Its reason.
        source: std::io::Error,
    },
    /// The content is that of no known format.
    #[error(
        "its content, which begins with \"{found}\", is that of no format of matrices; read are {supported}"
    )]
    UnknownFormat {
        /// The first characters.
        found: String,
        /// The formats there are.
        supported: String,
    },
    /// Something else than the format prescribes.
    #[error("{place}: found {found}; expected {expected}")]
    Malformed {
        /// Where in the file.
        place: String,
        /// What is there.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// The file ends too early.
    #[error(
        "{part} ends after {found}; expected {expected}: the file is cut off, or its header is wrong"
    )]
    Truncated {
        /// Which part of the file.
        part: String,
        /// What there is.
        found: String,
        /// What there should be.
        expected: String,
    },
    /// More rows or entries than a file of this length, or any structure, has.
    #[error("{found}; {limit}")]
    TooMany {
        /// What is announced.
        found: String,
        /// What would be the most.
        limit: String,
    },
    /// A legal variant of the format that is not read.
    #[error("{found} is not supported; {advice}")]
    Unsupported {
        /// The variant.
        found: String,
        /// What the user can do.
        advice: String,
    },
    /// Something is wrong in a deck that includes other files.
    #[error("{problem} ({told})")]
    Included {
        /// What is wrong.
        problem: Box<ReadProblem>,
        /// Which lines are those of which file.
        told: String,
    },
    /// Files that do not belong together.
    #[error("{found}; {advice}")]
    DoNotFit {
        /// What contradicts what.
        found: String,
        /// What the user can do.
        advice: String,
    },
}

impl ReadProblem {
    /// The same, with what is `told` of the count of lines.
    pub(super) fn counted(self, told: Option<String>) -> Self {
        match told {
            Some(told) => ReadProblem::Included {
                problem: Box::new(self),
                told,
            },
            None => self,
        }
    }

    /// Something else than the format prescribes.
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

    /// A part that ends too early.
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
