//! Digital Surf's SUR: a header of 512 bytes, a comment, a private zone, then integers, line by line, x fastest.

use super::error::ReadProblem;
use super::{ReadOptions, from_lines, length_unit, points, stated_unit};
use crate::surface::topography::Topography;

pub(super) const MAGICS: &[&[u8]] = &[b"DIGITAL SURF", COMPRESSED];

/// The first bytes of the variant whose points are packed.
const COMPRESSED: &[u8] = b"DSCOMPRESSED";

const HEADER: usize = 512;

/// The kind of object that is a map of heights; others are profiles, images, series and spectra.
const SURFACE: i16 = 2;

pub(super) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Topography, ReadProblem> {
    if bytes.starts_with(COMPRESSED) {
        return Err(ReadProblem::Unsupported {
            found: "a compressed SUR file".into(),
            advice: "save it without compression, or as X3P".into(),
        });
    }
    let header = Header(
        bytes
            .get(..HEADER)
            .ok_or_else(|| size(bytes, HEADER, "the header"))?,
    );
    let kind = header.i16(18);
    if kind != SURFACE {
        return Err(ReadProblem::Unsupported {
            found: format!("a SUR file whose object is of type {kind}"),
            advice: "only a surface, type 2, is a height map: export the topography layer".into(),
        });
    }
    let nx = header.count(108, "points of a line")?;
    let ny = header.count(112, "lines")?;
    let bits = header.i16(98);
    let width: usize = match bits {
        16 => 2,
        32 => 4,
        _ => {
            return Err(ReadProblem::malformed(
                "bits of a point (byte 98)",
                bits,
                "16 or 32",
            ));
        }
    };
    let comment = header.length(334, "length of the comment")?;
    let private = header.length(336, "length of the private zone")?;
    let start = HEADER + comment + private;
    let end = nx
        .checked_mul(ny)
        .and_then(|n| n.checked_mul(width))
        .and_then(|n| n.checked_add(start))
        .unwrap_or(usize::MAX);
    let reason = format!("{nx} x {ny} points of {bits} bits from byte {start} on");
    let data = bytes
        .get(start..end)
        .ok_or_else(|| size(bytes, end, &reason))?;
    points(nx, ny)?;

    let unit = |at: usize, axis: &str| {
        let text = header.text(at);
        length_unit(&text).ok_or_else(|| {
            ReadProblem::malformed(
                &format!("unit of {axis} (byte {at})"),
                format!("\"{text}\""),
                "m, mm, µm, um or nm",
            )
        })
    };
    let spacing = [
        f64::from(header.f32(120)) * unit(180, "x")?,
        f64::from(header.f32(124)) * unit(196, "y")?,
    ];
    let height_unit = stated_unit(options, unit(212, "z")?)?;
    let step = f64::from(header.f32(128));
    if !(step.is_finite() && step > 0.0) {
        return Err(ReadProblem::malformed(
            "height of one step (byte 128)",
            step,
            "a positive number",
        ));
    }
    let offset = f64::from(header.f32(474));
    // If the flag is set, a point that was not measured is two below the lowest point that was.
    let hole = (header.i16(86) == 1).then(|| i64::from(header.i32(100)) - 2);
    let point = |index: usize| {
        let raw = match width {
            2 => i64::from(i16::from_le_bytes([data[2 * index], data[2 * index + 1]])),
            _ => {
                let at = 4 * index;
                i64::from(i32::from_le_bytes([
                    data[at],
                    data[at + 1],
                    data[at + 2],
                    data[at + 3],
                ]))
            }
        };
        if hole == Some(raw) {
            f64::NAN
        } else {
            (raw as f64 * step + offset) * height_unit
        }
    };
    Ok(Topography {
        nx,
        ny,
        spacing: Some(spacing),
        heights: from_lines(nx, ny, point),
    })
}

/// The 512 bytes before everything else; positions are bytes from the start of the file.
struct Header<'a>(&'a [u8]);

impl Header<'_> {
    fn bytes<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut found = [0; N];
        found.copy_from_slice(&self.0[at..at + N]);
        found
    }

    fn i16(&self, at: usize) -> i16 {
        i16::from_le_bytes(self.bytes(at))
    }

    fn i32(&self, at: usize) -> i32 {
        i32::from_le_bytes(self.bytes(at))
    }

    fn f32(&self, at: usize) -> f32 {
        f32::from_le_bytes(self.bytes(at))
    }

    /// A text of 16 bytes in the Western code page, in which 0xB5 is µ.
    fn text(&self, at: usize) -> String {
        let bytes = self.bytes::<16>(at);
        let text: String = bytes
            .iter()
            .take_while(|&&b| b != 0)
            .map(|&b| char::from(b))
            .collect();
        text.trim().to_owned()
    }

    fn count(&self, at: usize, what: &str) -> Result<usize, ReadProblem> {
        let found = self.i32(at);
        match usize::try_from(found) {
            Ok(n) if n > 0 => Ok(n),
            _ => Err(ReadProblem::malformed(
                &format!("{what} (byte {at})"),
                found,
                "at least 1",
            )),
        }
    }

    fn length(&self, at: usize, what: &str) -> Result<usize, ReadProblem> {
        let found = self.i16(at);
        usize::try_from(found).map_err(|_| {
            ReadProblem::malformed(&format!("{what} (byte {at})"), found, "at least 0")
        })
    }
}

fn size(bytes: &[u8], expected: usize, reason: &str) -> ReadProblem {
    ReadProblem::Size {
        part: "the file".into(),
        found: bytes.len() as u64,
        expected: expected as u64,
        reason: reason.to_owned(),
    }
}
