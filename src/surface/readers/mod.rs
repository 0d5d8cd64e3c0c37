//! Readers of measured topographies: bytes in, [`Reading`] out.
//!
//! Each format is one module with a function from bytes to a topography, and one row in `FORMATS`. No other
//! code depends on the list of formats.

mod al3d;
mod encoding;
mod error;
mod headers;
mod lattice;
mod npy;
mod parquet;
mod sdf;
mod sur;
mod text;
mod x3p;

use std::path::Path;

pub use error::{ReadError, ReadProblem};
use serde::{Deserialize, Serialize};

use super::topography::Topography;
use crate::files;

/// Largest number of points of a topography. An instrument gives some 10^8 points. A reader then needs at
/// most some 4 GB, which fits into the memory of a usual machine.
const MOST_POINTS: usize = 1 << 27;

/// Largest permitted length of a surface file in bytes. A text file with the largest permitted number of x, y, z rows
/// has about this length.
const LONGEST_FILE: u64 = 4 << 30;

/// User's additions to the content of a file. All lengths are in metres.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ReadOptions {
    /// Length of one unit of height \[m\], for example 1e-6 for micrometres (`surface.unit`). Formats without a unit
    /// need `height_unit`. If the file states a unit, `height_unit` must agree with the unit of the file.
    pub height_unit: Option<f64>,
    /// Length of one unit of the x and y columns of an XYZ table \[m\]; the height unit if absent.
    pub lateral_unit: Option<f64>,
    /// Distance between points along the joint's x and y \[m\] (`surface.spacing`). `spacing` overrides the spacing of
    /// the file.
    pub spacing: Option<[f64; 2]>,
    /// Whether to swap the axes of the map, and of the spacing that the file states (`surface.transpose`).
    pub transpose: bool,
    /// Corrections of the file's statements (`surface.correct`).
    pub correct: Correction,
}

/// Corrections of wrong statements in a file.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Correction {
    /// Length of one unit of height \[m\]. The heights are the numbers of the file times `unit`.
    pub unit: Option<f64>,
    /// Distance between points along the joint's x and y \[m\].
    pub spacing: Option<[f64; 2]>,
}

impl Correction {
    /// Returns true if nothing is corrected.
    pub fn is_empty(&self) -> bool {
        *self == Correction::default()
    }
}

/// Content of a topography file.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Height map.
    pub topography: Topography,
    /// Name of the format of the surface file, such as "X3P".
    pub format: &'static str,
    /// Length of one unit of height that the file states \[m\].
    pub stated_unit: Option<f64>,
    /// Decisions of the reader that the user must know, one sentence each.
    pub remarks: Vec<String>,
}

/// Result of a format's parser: the map, the unit of height that the file states, and the remarks.
type Content = (Topography, Option<f64>, Vec<String>);

/// Format of surface files: name, file extensions, first bytes and parser.
struct Format {
    name: &'static str,
    extensions: &'static [&'static str],
    /// Byte sequences with which a file of the format may begin; empty for a text format.
    magics: &'static [&'static [u8]],
    parse: fn(&[u8], &ReadOptions) -> Result<Content, ReadProblem>,
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
        magics: &[x3p::MAGIC],
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

/// Reads a topography. The extension decides the format. If the extension is unknown, the first bytes decide.
///
/// # Errors
/// Returns a [`ReadError`], which names the file, the invalid content and the expected content.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Reading, ReadError> {
    parse(path, &bytes(path)?, options)
}

/// Reads the bytes of a topography's file, for [`parse`].
///
/// # Errors
/// [`ReadError`] if the path cannot be read, is not a regular file, or is longer than any topography.
pub fn bytes(path: &Path) -> Result<Vec<u8>, ReadError> {
    files::read(path, LONGEST_FILE).map_err(|source| ReadError {
        path: path.to_owned(),
        problem: ReadProblem::Io { source },
    })
}

/// Parses the topography in the bytes of a file. `parse` uses only the extension of the path, to recognise the format.
///
/// # Errors
/// As for [`read`].
pub fn parse(path: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Reading, ReadError> {
    recognise(path, bytes)
        .and_then(|format| finish((format.parse)(bytes, options)?, format.name, options))
        .map_err(|problem| ReadError {
            path: path.to_owned(),
            problem,
        })
}

/// Returns true if a file is a map and not a matrix of a structure. The extension decides; for an NPY file
/// the content decides, because a symmetric square array is a matrix.
pub fn is_height_map(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let extension = extension.to_lowercase();
    let is_named = |format: &Format| format.extensions.contains(&extension.as_str());
    if !FORMATS.iter().any(is_named) {
        return false;
    }
    if extension != "npy" {
        return true;
    }
    let as_numbers = ReadOptions {
        height_unit: Some(1.0),
        ..ReadOptions::default()
    };
    read(path, &as_numbers).is_ok_and(|read| {
        let map = read.topography;
        map.nx != map.ny || map.heights != map.transposed().heights
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
        // A text file needs no magic, but it must not have the magic of another format.
        None if named.magics.is_empty() => Ok(named),
        Some(found) if std::ptr::eq(found, named) => Ok(named),
        found => {
            // Do not advise to rename a zip archive of another kind to X3P.
            if bytes.starts_with(x3p::MAGIC) {
                x3p::check(bytes)?;
            }
            Err(ReadProblem::WrongMagic {
                format: named.name,
                expected: named
                    .magics
                    .iter()
                    .map(|magic| escaped(magic))
                    .collect::<Vec<_>>()
                    .join("\" or \""),
                found: escaped(&bytes[..bytes.len().min(12)]),
                looks_like: found.map(|f| f.name),
            })
        }
    }
}

/// Applies and checks what is common to all formats: the axes, the spacing, and heights that are finite or
/// holes.
fn finish(
    (mut topography, stated_unit, mut remarks): Content,
    format: &'static str,
    options: &ReadOptions,
) -> Result<Reading, ReadProblem> {
    if options.transpose {
        topography = topography.transposed();
    }
    if let Some(spacing) = options.correct.spacing.or(options.spacing) {
        let is_other =
            |[x, y]: [f64; 2]| !(same_length(x, spacing[0]) && same_length(y, spacing[1]));
        if let Some([x, y]) = topography.spacing.filter(|stated| is_other(*stated)) {
            remarks.push(format!(
                "the scene sets the distance of points to {:e} x {:e} m; the file states {x:e} x {y:e} m",
                spacing[0], spacing[1]
            ));
        }
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
    Ok(Reading {
        topography,
        format,
        stated_unit,
        remarks,
    })
}

/// Returns the user's height unit for a format that states no unit.
fn required_unit(options: &ReadOptions, format: &'static str) -> Result<f64, ReadProblem> {
    let user_unit = options.correct.unit.or(options.height_unit);
    user_unit.ok_or(ReadProblem::UnitMissing { format })
}

/// Returns the height unit for a file that states `stated`. The user's unit must not contradict it, unless it
/// is a correction.
fn stated_unit(options: &ReadOptions, stated: f64) -> Result<f64, ReadProblem> {
    match (options.correct.unit, options.height_unit) {
        (Some(correct), _) => Ok(correct),
        (None, Some(given)) if !same_unit(given, stated) => {
            Err(ReadProblem::UnitConflict { given, stated })
        }
        _ => Ok(stated),
    }
}

/// Compares lengths to single precision.
fn same_length(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() <= 1e-6
}

/// Compares units. Units are powers of ten, so that any difference beyond rounding is another unit.
fn same_unit(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() <= 1e-9
}

/// Returns the length of a unit of length \[m\], as instruments spell it.
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

/// Returns the number of points of a map. Rejects more than `MOST_POINTS` points before the reader allocates memory for
/// the map.
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

/// Converts lines of constant y, with x fastest, to our order.
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

fn escaped(bytes: &[u8]) -> String {
    bytes.escape_ascii().to_string()
}
