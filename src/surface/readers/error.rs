//! Why a topography file could not be read.

use std::path::PathBuf;

/// A topography file that could not be read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct ReadError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub problem: ReadProblem,
}

/// What is wrong with a topography file.
#[derive(Debug, thiserror::Error)]
pub enum ReadProblem {
    /// The operating system refuses.
    #[error("cannot be read: {source}")]
    Io {
        /// Its reason.
        source: std::io::Error,
    },
    /// Neither extension nor first bytes are those of a known format.
    #[error(
        "the extension \"{extension}\" is not that of a topography format; known are {supported}"
    )]
    UnknownFormat {
        /// The extension found, in lower case.
        extension: String,
        /// The formats there are.
        supported: String,
    },
    /// The first bytes contradict the extension.
    #[error("is named as {format}, which starts with \"{expected}\", but starts with \"{found}\"{}",
        looks_like.map(|f| format!(": this looks like {f}, rename it")).unwrap_or_default())]
    WrongMagic {
        /// The format of the extension.
        format: &'static str,
        /// Its first bytes.
        expected: String,
        /// The first bytes found.
        found: String,
        /// The format they belong to, if known.
        looks_like: Option<&'static str>,
    },
    /// The file ends too early, or a part of it has another size than its description says.
    #[error("{part} has {found} bytes; {expected} are needed for {reason}")]
    Size {
        /// Which part of the file.
        part: String,
        /// Bytes there are.
        found: u64,
        /// Bytes there should be.
        expected: u64,
        /// What asks for them.
        reason: String,
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
    /// A legal variant of the format that is not read.
    #[error("{found} is not supported; {advice}")]
    Unsupported {
        /// The variant.
        found: String,
        /// What the user can do.
        advice: String,
    },
    /// The format states no unit and the user gave none.
    #[error(
        "a {format} file does not say in which unit its heights are; give surface.unit, e.g. unit = \"um\""
    )]
    UnitMissing {
        /// The format.
        format: &'static str,
    },
    /// The user's unit contradicts the file's.
    #[error(
        "the file states its heights in units of {stated:e} m, surface.unit says {given:e} m; remove surface.unit, or give surface.correct.unit if the file is wrong"
    )]
    UnitConflict {
        /// The user's unit \[m\].
        given: f64,
        /// The file's unit \[m\].
        stated: f64,
    },
    /// A spacing that is no distance.
    #[error(
        "the spacing of the points is {dx:e} x {dy:e} m; both must be positive and finite (surface.spacing overrides the file)"
    )]
    Spacing {
        /// Along x \[m\].
        dx: f64,
        /// Along y \[m\].
        dy: f64,
    },
    /// An infinite height. A point that was not measured is NaN.
    #[error(
        "the height of point ({i}, {j}) is {value}; heights are finite, or NaN where nothing was measured"
    )]
    Infinite {
        /// Point along x.
        i: usize,
        /// Point along y.
        j: usize,
        /// The value.
        value: f64,
    },
    /// Only holes.
    #[error("none of the {nx} x {ny} points has a height")]
    NothingMeasured {
        /// Points along x.
        nx: usize,
        /// Points along y.
        ny: usize,
    },
    /// More points than any topography has.
    #[error("{found}; at most {limit} points are read: crop the map, or export it more coarsely")]
    TooMany {
        /// What there is, or would be.
        found: String,
        /// Most points.
        limit: usize,
    },
    /// Points of a table that are not those of a regular grid.
    #[error("row {row}: {found}; expected the points of one regular grid, each at most once")]
    NotRegular {
        /// Row of the table, from 1.
        row: usize,
        /// What contradicts a regular grid.
        found: String,
    },
}

impl ReadError {
    /// True where nothing is wrong but that nobody has said the unit of the heights.
    pub fn is_unit_missing(&self) -> bool {
        matches!(self.problem, ReadProblem::UnitMissing { .. })
    }
}

impl ReadProblem {
    /// Something else than the format prescribes.
    pub(super) fn malformed(place: &str, found: impl ToString, expected: &str) -> Self {
        ReadProblem::Malformed {
            place: place.to_owned(),
            found: found.to_string(),
            expected: expected.to_owned(),
        }
    }
}
