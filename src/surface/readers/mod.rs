//! Files of measured topographies: bytes in, [`Topography`] out.
//!
//! A format is one module with a function from bytes to a topography, and one row in `FORMATS`; nothing else knows which
//! formats there are.

mod al3d;
mod error;
mod lattice;
mod npy;
mod parquet;
mod sdf;
mod sur;
mod text;
mod x3p;

use std::path::Path;

pub use error::{ReadError, ReadProblem};

use super::topography::Topography;
use crate::files;

/// Most points of a topography. An instrument gives some 10^8; what a reader holds of so many, some 4 GB at its fullest, fits
/// into the memory of a usual machine.
const MOST_POINTS: usize = 1 << 27;

/// Bytes of the longest file: a text of the most points, each a position and a height, is about as long.
const LONGEST_FILE: u64 = 4 << 30;

/// What the user adds to what the file says. All lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ReadOptions {
    /// Length of one unit of height \[m\], 1e-6 for micrometres (`surface.unit`). Needed by formats that do not state a unit;
    /// for one that does it must say the same.
    pub height_unit: Option<f64>,
    /// Length of one unit of the x and y columns of an XYZ table \[m\]; the height unit if absent.
    pub lateral_unit: Option<f64>,
    /// Distance between points along x and y \[m\] (`surface.spacing`), instead of what the file says.
    pub spacing: Option<[f64; 2]>,
}

/// A file format: what it is called, how it is recognised, who reads it.
struct Format {
    name: &'static str,
    extensions: &'static [&'static str],
    /// The first bytes that such a file may have; none for text.
    magics: &'static [&'static [u8]],
    parse: fn(&[u8], &ReadOptions) -> Result<Topography, ReadProblem>,
}

const FORMATS: [Format; 7] = [
    Format {
        name: "NPY",
        extensions: &["npy"],
        magics: &[b"\x93NUMPY"],
        parse: npy::parse,
    },
    Format {
        name: "Parquet",
        extensions: &["parquet"],
        magics: &[b"PAR1"],
        parse: parquet::parse,
    },
    Format {
        name: "X3P",
        extensions: &["x3p"],
        magics: &[b"PK\x03\x04"],
        parse: x3p::parse,
    },
    Format {
        name: "SUR",
        extensions: &["sur"],
        magics: sur::MAGICS,
        parse: sur::parse,
    },
    Format {
        name: "SDF",
        extensions: &["sdf"],
        magics: sdf::MAGICS,
        parse: sdf::parse,
    },
    Format {
        name: "AL3D",
        extensions: &["al3d"],
        magics: &[al3d::MAGIC],
        parse: al3d::parse,
    },
    Format {
        name: "text",
        extensions: &["csv", "xyz", "txt", "dat", "tsv", "asc"],
        magics: &[],
        parse: text::parse,
    },
];

/// Reads a topography. The format follows from the extension, or from the first bytes if the extension is none of ours.
///
/// # Errors
/// [`ReadError`] names the file, what was found, and what would be right.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Topography, ReadError> {
    parse(path, &bytes(path)?, options)
}

/// The bytes of a topography's file, for [`parse`].
///
/// # Errors
/// [`ReadError`] for what cannot be read, is no regular file, or is longer than any topography.
pub fn bytes(path: &Path) -> Result<Vec<u8>, ReadError> {
    files::read(path, LONGEST_FILE).map_err(|source| ReadError {
        path: path.to_owned(),
        problem: ReadProblem::Io { source },
    })
}

/// The topography in the bytes of a file; of its path only the extension counts.
///
/// # Errors
/// As [`read`].
pub fn parse(path: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Topography, ReadError> {
    recognise(path, bytes)
        .and_then(|format| (format.parse)(bytes, options))
        .and_then(|topography| finish(topography, options))
        .map_err(|problem| ReadError {
            path: path.to_owned(),
            problem,
        })
}

fn recognise(path: &Path, bytes: &[u8]) -> Result<&'static Format, ReadProblem> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    let by_magic = FORMATS
        .iter()
        .find(|f| f.magics.iter().any(|magic| bytes.starts_with(magic)));
    let by_name = FORMATS
        .iter()
        .find(|f| f.extensions.contains(&extension.as_str()));
    let Some(named) = by_name else {
        return by_magic.ok_or_else(|| ReadProblem::UnknownFormat {
            extension,
            supported: supported(),
        });
    };
    match by_magic {
        // A text file needs no magic, but it must not carry that of another format.
        None if named.magics.is_empty() => Ok(named),
        Some(found) if std::ptr::eq(found, named) => Ok(named),
        found => Err(ReadProblem::WrongMagic {
            format: named.name,
            expected: named
                .magics
                .iter()
                .map(|magic| shown(magic))
                .collect::<Vec<_>>()
                .join("\" or \""),
            found: shown(&bytes[..bytes.len().min(12)]),
            looks_like: found.map(|f| f.name),
        }),
    }
}

/// What holds for every format: a size, heights that are numbers or holes, a sane spacing.
fn finish(mut topography: Topography, options: &ReadOptions) -> Result<Topography, ReadProblem> {
    if let Some(spacing) = options.spacing {
        topography.spacing = Some(spacing);
    }
    if let Some([dx, dy]) = topography.spacing
        && !(dx.is_finite() && dx > 0.0 && dy.is_finite() && dy > 0.0)
    {
        return Err(ReadProblem::Spacing { dx, dy });
    }
    let ny = topography.ny;
    if let Some(index) = topography.heights.iter().position(|h| h.is_infinite()) {
        return Err(ReadProblem::Infinite {
            i: index / ny,
            j: index % ny,
            value: topography.heights[index],
        });
    }
    if topography.holes() == topography.heights.len() {
        return Err(ReadProblem::NothingMeasured {
            nx: topography.nx,
            ny,
        });
    }
    Ok(topography)
}

/// The height unit of a format that states none.
fn required_unit(options: &ReadOptions, format: &'static str) -> Result<f64, ReadProblem> {
    options
        .height_unit
        .ok_or(ReadProblem::UnitMissing { format })
}

/// The height unit of a file that states `stated`: what the user adds may not contradict it.
fn stated_unit(options: &ReadOptions, stated: f64) -> Result<f64, ReadProblem> {
    // Units are powers of ten: anything but rounding is another unit.
    const SAME: f64 = 1e-9;
    match options.height_unit {
        Some(given) if (given / stated - 1.0).abs() > SAME => {
            Err(ReadProblem::UnitConflict { given, stated })
        }
        _ => Ok(stated),
    }
}

/// The length of a unit of length \[m\], as instruments spell it.
fn length_unit(text: &str) -> Option<f64> {
    Some(match text.trim() {
        "m" => 1.0,
        "mm" => 1e-3,
        "um" | "µm" | "μm" | "micron" | "microns" => 1e-6,
        "nm" => 1e-9,
        "pm" => 1e-12,
        _ => return None,
    })
}

/// The number of points, before anything of that size is allocated.
fn points(nx: usize, ny: usize) -> Result<usize, ReadProblem> {
    nx.checked_mul(ny)
        .filter(|&points| points <= MOST_POINTS)
        .ok_or_else(|| too_many(format!("{nx} x {ny} points")))
}

fn too_many(found: String) -> ReadProblem {
    ReadProblem::TooMany {
        found,
        limit: MOST_POINTS,
    }
}

/// Lines of constant y, x fastest, turned into our order.
fn from_lines(nx: usize, ny: usize, height: impl Fn(usize) -> f64) -> Vec<f64> {
    (0..nx * ny)
        .map(|index| height((index % ny) * nx + index / ny))
        .collect()
}

fn supported() -> String {
    let names = FORMATS.iter().map(|format| {
        let dotted: Vec<_> = format.extensions.iter().map(|e| format!(".{e}")).collect();
        format!("{} ({})", format.name, dotted.join(" "))
    });
    names.collect::<Vec<_>>().join(", ")
}

fn shown(bytes: &[u8]) -> String {
    bytes.escape_ascii().to_string()
}
