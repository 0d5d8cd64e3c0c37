//! Errors of reading a topography file.

use std::path::PathBuf;

/// A topography file that could not be read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct ReadError {
    /// Path of the file.
    pub path: PathBuf,
    /// Reason.
    pub problem: ReadProblem,
}

/// Reason why a topography file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadProblem {
    /// The operating system reports an error.
    #[error("cannot be read: {source}")]
    Io {
        /// Reason given by the system.
        source: std::io::Error,
    },
    /// Neither the extension nor the first bytes of the file belong to a known format.
    #[error(
        "the extension \"{extension}\" is not that of a topography format; known are {supported}"
    )]
    UnknownFormat {
        /// Extension found, in lower case.
        extension: String,
        /// Supported formats.
        supported: String,
    },
    /// The first bytes contradict the extension.
    #[error("is named as {format}, which starts with \"{expected}\", but starts with \"{found}\"{}",
        looks_like.map(|f| format!(": this looks like {f}, rename it")).unwrap_or_default())]
    WrongMagic {
        /// Format of the extension.
        format: &'static str,
        /// First bytes of that format.
        expected: String,
        /// First bytes found.
        found: String,
        /// Format to which the first bytes of the file belong, if known.
        looks_like: Option<&'static str>,
    },
    /// The file ends too early, or a part of the file has another size than the file states.
    #[error("{part} has {found} bytes; {expected} are needed for {reason}")]
    Size {
        /// Part of the file.
        part: String,
        /// Bytes found.
        found: u64,
        /// Bytes needed.
        expected: u64,
        /// Content that needs them.
        reason: String,
    },
    /// The content violates the format.
    #[error("{place}: found {found}; expected {expected}")]
    Malformed {
        /// Place in the file.
        place: String,
        /// Content found.
        found: String,
        /// Valid content.
        expected: String,
    },
    /// The file uses a variant of the format that is not supported.
    #[error("{found} is not supported; {advice}")]
    Unsupported {
        /// Variant.
        found: String,
        /// Advice to the user.
        advice: String,
    },
    /// The file format states no unit of the heights, and the user gave no unit.
    #[error(
        "a {format} file does not say in which unit its heights are; give surface.unit, e.g. unit = \"um\""
    )]
    UnitMissing {
        /// Name of the format.
        format: &'static str,
    },
    /// The user's unit contradicts the file's.
    #[error(
        "the file states its heights in units of {stated:e} m, surface.unit says {given:e} m; remove surface.unit, or give surface.correct.unit if the file is wrong"
    )]
    UnitConflict {
        /// User's unit \[m\].
        given: f64,
        /// File's unit \[m\].
        stated: f64,
    },
    /// A spacing is not a positive distance.
    #[error(
        "the spacing of the points is {dx:e} x {dy:e} m; both must be positive and finite (surface.spacing overrides the file)"
    )]
    Spacing {
        /// Spacing along x \[m\].
        dx: f64,
        /// Spacing along y \[m\].
        dy: f64,
    },
    /// A height is infinite. An unmeasured point must be NaN.
    #[error(
        "the height of point ({i}, {j}) is {value}; heights are finite, or NaN where nothing was measured"
    )]
    Infinite {
        /// Point along x.
        i: usize,
        /// Point along y.
        j: usize,
        /// Value found.
        value: f64,
    },
    /// All points are holes.
    #[error("none of the {nx} x {ny} points has a height")]
    NothingMeasured {
        /// Points along x.
        nx: usize,
        /// Points along y.
        ny: usize,
    },
    /// The file has more points than any topography.
    #[error("{found}; at most {limit} points are read: crop the map, or export it more coarsely")]
    TooMany {
        /// Number or description of the points found.
        found: String,
        /// Largest number of points.
        limit: usize,
    },
    /// The points of a table do not form a regular grid.
    #[error("row {row}: {found}; expected the points of one regular grid, each at most once")]
    NotRegular {
        /// Row of the table, from 1.
        row: usize,
        /// Contradiction to a regular grid.
        found: String,
    },
}

impl ReadError {
    /// Returns true if the only problem is the missing unit of the heights.
    pub fn is_unit_missing(&self) -> bool {
        matches!(self.problem, ReadProblem::UnitMissing { .. })
    }
}

impl ReadProblem {
    /// Creates the error for content that violates the format.
    pub(super) fn malformed(place: &str, found: impl ToString, expected: &str) -> Self {
        ReadProblem::Malformed {
            place: place.to_owned(),
            found: found.to_string(),
            expected: expected.to_owned(),
        }
    }
}
