//! Reader of SDF files (ISO 25178-71), text or binary. An SDF file contains a header, the heights and remarks. The
//! heights are in units of `Zscale`, line by line, with x running fastest. The reader ignores the remarks. Lengths in
//! an SDF file are in metres.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use super::error::ReadProblem;
use super::{Content, ReadOptions, from_lines, points, stated_unit};
use crate::surface::topography::Topography;

/// Versions: `a` is text, `b` binary. BCR and NIST are older names of ISO 1.0. ISO 2.0 counts points with 32
/// bits.
pub(super) const MAGICS: &[&[u8]] = &[
    b"aISO-1.0",
    b"bISO-1.0",
    b"aISO-2.0",
    b"bISO-2.0",
    b"aBCR-1.0",
    b"bBCR-1.0",
    b"aNIST-1.0",
];

/// Mark that ends the header and the heights of a text file.
const END: &str = "*";

/// Value of an unmeasured point in a text file, in upper or lower case.
const HOLE: &str = "BAD";

/// Two numbers that binary files of version ISO 1.0 by one instrument maker have after the standard's header.
const LONGER_HEADER: [u8; 8] = [5, 0, 0, 0, 1, 0, 0, 0];

pub(super) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Content, ReadProblem> {
    let unit = stated_unit(options, 1.0)?;
    let (header, heights) = if bytes[0] == b'a' {
        text(bytes)?
    } else {
        binary(bytes)?
    };
    let topography = Topography {
        nx: header.nx,
        ny: header.ny,
        spacing: Some([header.scale[0], header.scale[1]]),
        heights: from_lines(header.nx, header.ny, |index| {
            heights[index] * header.scale[2] * unit
        }),
    };
    Ok((topography, Some(1.0), Vec::new()))
}

struct Header {
    nx: usize,
    ny: usize,
    /// Xscale, Yscale, Zscale \[m\].
    scale: [f64; 3],
    kind: Kind,
}

/// Storage type of a height.
#[derive(Clone, Copy)]
struct Kind {
    name: &'static str,
    width: usize,
    value: fn(&[u8]) -> f64,
    /// Returns true if a stored number marks an unmeasured point. In a signed type, the smallest number marks an
    /// unmeasured point. In an unsigned type, the largest number marks an unmeasured point.
    hole: fn(f64) -> bool,
}

/// Storage types of heights. The header of an SDF file states the index of the storage type in `KINDS`.
const KINDS: [Kind; 8] = [
    Kind {
        name: "unsigned 8 bits",
        width: 1,
        value: |b| f64::from(b[0]),
        // All 256 steps are heights.
        hole: |_| false,
    },
    Kind {
        name: "unsigned 16 bits",
        width: 2,
        value: |b| f64::from(u16::from_le_bytes(part(b))),
        hole: |v| v == f64::from(u16::MAX),
    },
    Kind {
        name: "unsigned 32 bits",
        width: 4,
        value: |b| f64::from(u32::from_le_bytes(part(b))),
        hole: |v| v == f64::from(u32::MAX),
    },
    Kind {
        name: "single precision",
        width: 4,
        value: |b| f64::from(f32::from_le_bytes(part(b))),
        // Some writers use the number of largest magnitude, others C's FLT_MIN; neither is a height.
        hole: |v| v.abs() == f64::from(f32::MAX) || v == f64::from(f32::MIN_POSITIVE),
    },
    Kind {
        name: "8 bits",
        width: 1,
        value: |b| f64::from(i8::from_le_bytes(part(b))),
        hole: |v| v == f64::from(i8::MIN),
    },
    Kind {
        name: "16 bits",
        width: 2,
        value: |b| f64::from(i16::from_le_bytes(part(b))),
        hole: |v| v == f64::from(i16::MIN),
    },
    Kind {
        name: "32 bits",
        width: 4,
        value: |b| f64::from(i32::from_le_bytes(part(b))),
        hole: |v| v == f64::from(i32::MIN),
    },
    Kind {
        name: "double precision",
        width: 8,
        value: |b| f64::from_le_bytes(part(b)),
        hole: |v| v.abs() == f64::MAX || v == f64::MIN_POSITIVE,
    },
];

impl Kind {
    /// Returns the height, or NaN for an unmeasured point.
    fn measured(&self, value: f64) -> f64 {
        if (self.hole)(value) { f64::NAN } else { value }
    }
}

/// Checks the numbers that both forms state. `number` returns a key's value.
fn header(number: impl Fn(&str) -> Result<f64, ReadProblem>) -> Result<Header, ReadProblem> {
    let wrong = |key: &str, found: f64, expected: &str| {
        ReadProblem::malformed(&place(key), found, expected)
    };
    let count = |key: &str| {
        let found = number(key)?;
        if found >= 1.0 && found.fract() == 0.0 && found <= f64::from(u32::MAX) {
            Ok(found as usize)
        } else {
            Err(wrong(key, found, "a whole number, at least 1"))
        }
    };
    let (nx, ny) = (count("NumPoints")?, count("NumProfiles")?);
    let scale = [number("Xscale")?, number("Yscale")?, number("Zscale")?];
    if !(scale[2].is_finite() && scale[2] > 0.0) {
        return Err(wrong("Zscale", scale[2], "a positive number of metres"));
    }
    for (key, what) in [("Compression", "compression"), ("CheckType", "a checksum")] {
        let found = number(key)?;
        if found != 0.0 {
            return Err(ReadProblem::Unsupported {
                found: format!("an SDF file with {what} ({key} = {found})"),
                advice: format!("save it without, {key} = 0, or as X3P"),
            });
        }
    }
    let found = number("DataType")?;
    let kind = (0..KINDS.len())
        .find(|&k| k as f64 == found)
        .ok_or_else(|| wrong("DataType", found, "a whole number from 0 to 7"))?;
    Ok(Header {
        nx,
        ny,
        scale,
        kind: KINDS[kind],
    })
}

fn place(key: &str) -> String {
    format!("the header's {key}")
}

fn text(bytes: &[u8]) -> Result<(Header, Vec<f64>), ReadProblem> {
    // Remarks may use any code page; numbers are ASCII.
    let text = String::from_utf8_lossy(bytes);
    let mut lines = text.lines().zip(1..).skip(1);
    let mut pairs: HashMap<&str, &str> = HashMap::new();
    let mut ended = false;
    for (line, number) in lines.by_ref() {
        let line = line.trim();
        if line == END {
            ended = true;
            break;
        }
        if line.is_empty() {
            continue;
        }
        let fail = |found: String, expected: &str| {
            Err(ReadProblem::malformed(
                &format!("line {number}"),
                found,
                expected,
            ))
        };
        let Some((key, value)) = line.split_once('=') else {
            return fail(
                format!("\"{}\"", start_of(line)),
                "key = value, or * where the header ends",
            );
        };
        let key = key.trim();
        match pairs.entry(key) {
            Entry::Vacant(entry) => entry.insert(value.trim()),
            Entry::Occupied(_) => {
                return fail(format!("a second {}", start_of(key)), "each key once");
            }
        };
    }
    if !ended {
        return Err(ReadProblem::malformed(
            "the header",
            "the end of the file",
            "a line with * where the heights begin",
        ));
    }
    let header = header(|key| {
        match pairs.get(key) {
            Some(value) => value.parse().map_err(|_| {
                ReadProblem::malformed(
                    &place(key),
                    format!("\"{}\"", start_of(value)),
                    "a number with a decimal point",
                )
            }),
            // Without the key there is no compression and no checksum.
            None if matches!(key, "Compression" | "CheckType") => Ok(0.0),
            None => Err(ReadProblem::malformed(
                "the header",
                "nothing",
                &format!("the key {key}"),
            )),
        }
    })?;
    let expected = points(header.nx, header.ny)?;
    let mut heights = Vec::new();
    'heights: for (line, number) in lines {
        for word in line.split_whitespace() {
            if word.starts_with(END) {
                break 'heights;
            }
            let height = if word.eq_ignore_ascii_case(HOLE) {
                f64::NAN
            } else {
                word.parse().map(|v| header.kind.measured(v)).map_err(|_| {
                    ReadProblem::malformed(
                        &format!("line {number}"),
                        format!("\"{}\"", start_of(word)),
                        "a number with a decimal point, or BAD for a hole",
                    )
                })?
            };
            heights.push(height);
        }
    }
    if heights.len() != expected {
        return Err(ReadProblem::malformed(
            "the heights",
            format!("{} values", heights.len()),
            &format!(
                "{expected}, as NumPoints = {} and NumProfiles = {} say",
                header.nx, header.ny
            ),
        ));
    }
    Ok((header, heights))
}

/// Returns the beginning of a text, long enough to recognise it.
fn start_of(text: &str) -> String {
    text.chars().take(40).collect()
}

fn binary(bytes: &[u8]) -> Result<(Header, Vec<f64>), ReadProblem> {
    // The version, the maker and two dates are text. After the dates, the header has the counts, four scales and three
    // types.
    let counts = 8 + 10 + 12 + 12;
    let wide = &bytes[1..8] == b"ISO-2.0";
    let scales = counts + if wide { 8 } else { 4 };
    let mut start = scales + 4 * 8 + 3;
    let size = |expected: usize, reason: String| ReadProblem::Size {
        part: "the file".into(),
        found: bytes.len() as u64,
        expected: expected as u64,
        reason,
    };
    if bytes.len() < start {
        return Err(size(start, "the header".into()));
    }
    let count = |at: usize| {
        if wide {
            f64::from(u32::from_le_bytes(part(&bytes[counts + 4 * at..])))
        } else {
            f64::from(u16::from_le_bytes(part(&bytes[counts + 2 * at..])))
        }
    };
    let scale = |at: usize| f64::from_le_bytes(part(&bytes[scales + 8 * at..]));
    let flag = |at: usize| f64::from(bytes[scales + 32 + at]);
    let header = header(|key| {
        Ok(match key {
            "NumPoints" => count(0),
            "NumProfiles" => count(1),
            "Xscale" => scale(0),
            "Yscale" => scale(1),
            "Zscale" => scale(2),
            "Compression" => flag(0),
            "DataType" => flag(1),
            _ => flag(2),
        })
    })?;
    let Kind { name, width, .. } = header.kind;
    let length = header.nx.saturating_mul(header.ny).saturating_mul(width);
    let longer = start
        .saturating_add(length)
        .saturating_add(LONGER_HEADER.len());
    if &bytes[1..8] == b"ISO-1.0"
        && bytes.len() == longer
        && bytes[start..].starts_with(&LONGER_HEADER)
    {
        start += LONGER_HEADER.len();
    }
    let end = start.saturating_add(length);
    let data = bytes.get(start..end).ok_or_else(|| {
        let reason = format!(
            "{} x {} points of {name} from byte {start} on",
            header.nx, header.ny
        );
        size(end, reason)
    })?;
    points(header.nx, header.ny)?;
    let heights = data
        .chunks_exact(width)
        .map(|raw| header.kind.measured((header.kind.value)(raw)))
        .collect();
    Ok((header, heights))
}

/// Returns the first `N` bytes.
fn part<const N: usize>(bytes: &[u8]) -> [u8; N] {
    std::array::from_fn(|k| bytes[k])
}
