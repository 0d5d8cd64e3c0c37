//! Reader of SUR files by Digital Surf. A SUR file contains a header of 512 bytes, a comment, a private zone and the
//! heights. The heights are integers, line by line, with x running fastest. The integers can be compressed. A
//! compressed file stores the number of streams, the unpacked and packed length of each stream, and the streams in
//! order.

use std::borrow::Cow;
use std::io::Read;

use flate2::read::ZlibDecoder;

use super::error::ReadProblem;
use super::{Content, ReadOptions, from_lines, length_unit, points, stated_unit};
use crate::surface::topography::Topography;

pub(super) const MAGICS: &[&[u8]] = &[b"DIGITAL SURF", COMPRESSED];

/// First bytes of the variant with compressed points.
const COMPRESSED: &[u8] = b"DSCOMPRESSED";

const HEADER: usize = 512;

/// Type of an object that is a height map. Other types are profiles, images, series and spectra.
const SURFACE: i16 = 2;
/// Type of a height map that is followed by three images of its colours and one of its intensity.
const SURFACE_WITH_IMAGES: i16 = 16;
/// Type of a profile, which Gwyddion writes for a map, and Gwyddion's name of the object.
const PROFILE: i16 = 1;
const GWYDDION: &[u8] = b"SCRATCH";

pub(super) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Content, ReadProblem> {
    let header = Header(
        bytes
            .get(..HEADER)
            .ok_or_else(|| size(bytes, HEADER, "the header"))?,
    );
    let mut remarks = Vec::new();
    match header.i16(18) {
        SURFACE => {}
        PROFILE if header.0[20..].starts_with(GWYDDION) => {}
        SURFACE_WITH_IMAGES => {
            remarks.push("the images of colours and intensity in the file are not read".into());
        }
        kind => {
            return Err(ReadProblem::Unsupported {
                found: format!("a SUR file whose object is of type {kind}"),
                advice:
                    "only a surface, type 2 or 16, is a height map: export the topography layer"
                        .into(),
            });
        }
    }
    let objects = header.i16(14);
    if objects > 1 {
        remarks.push(format!("the first of {objects} objects is read"));
    }
    if header.i16(290) != 0 {
        remarks.push(
            "the header says that the surface was inverted; heights are read as stored".into(),
        );
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
    let length = nx.saturating_mul(ny).saturating_mul(width);
    let reason = format!("{nx} x {ny} points of {bits} bits from byte {start} on");
    let data = if bytes.starts_with(COMPRESSED) {
        points(nx, ny)?;
        Cow::Owned(unpack(bytes, start, length, &reason)?)
    } else {
        let end = start.saturating_add(length);
        let data = bytes.get(start..end);
        Cow::Borrowed(data.ok_or_else(|| size(bytes, end, &reason))?)
    };
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
    let stated = unit(212, "z")?;
    let height_unit = stated_unit(options, stated)?;
    let step = f64::from(header.f32(128));
    if !(step.is_finite() && step > 0.0) {
        return Err(ReadProblem::malformed(
            "height of one step (byte 128)",
            step,
            "a positive number",
        ));
    }
    let offset = f64::from(header.f32(474));
    // If the flag is set, the value of an unmeasured point is two below the lowest measured point.
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
    let topography = Topography {
        nx,
        ny,
        spacing: Some(spacing),
        heights: from_lines(nx, ny, point),
    };
    Ok((topography, Some(stated), remarks))
}

/// Unpacks the `length` bytes of points that are stored compressed from byte `start` of the file on.
fn unpack(bytes: &[u8], start: usize, length: usize, reason: &str) -> Result<Vec<u8>, ReadProblem> {
    let number = |at: usize| {
        let field = bytes.get(at..at + 4);
        let field = field.ok_or_else(|| size(bytes, at + 4, "the lengths of the streams"))?;
        Ok(u32::from_le_bytes([field[0], field[1], field[2], field[3]]) as usize)
    };
    let streams = number(start)?;
    let mut at = start + 4 + 8 * streams;
    let mut data = Vec::new();
    for stream in 0..streams {
        let lengths = start + 4 + 8 * stream;
        let (unpacked, packed) = (number(lengths)?, number(lengths + 4)?);
        let part = format!("stream {}", stream + 1);
        let packed_bytes = bytes.get(at..at + packed);
        let packed_bytes = packed_bytes.ok_or_else(|| size(bytes, at + packed, &part))?;
        at += packed;
        let before = data.len();
        // One byte more detects a longer stream, and makes the library compare the checksum at the end of any
        // other.
        let limit = unpacked.min(length - before) as u64 + 1;
        ZlibDecoder::new(packed_bytes)
            .take(limit)
            .read_to_end(&mut data)
            .map_err(|e| ReadProblem::malformed(&part, e, "intact data"))?;
        let unpacked_length = data.len() - before;
        if unpacked_length != unpacked || data.len() > length {
            return Err(ReadProblem::Size {
                part,
                found: unpacked_length as u64,
                expected: unpacked as u64,
                reason: reason.to_owned(),
            });
        }
    }
    if data.len() != length {
        return Err(ReadProblem::Size {
            part: "the unpacked data".into(),
            found: data.len() as u64,
            expected: length as u64,
            reason: reason.to_owned(),
        });
    }
    Ok(data)
}

/// Header of 512 bytes. Positions are bytes from the start of the file.
struct Header<'a>(&'a [u8]);

impl Header<'_> {
    fn bytes<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut field = [0; N];
        field.copy_from_slice(&self.0[at..at + N]);
        field
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

    /// Returns a text of 16 bytes in UTF-8 or the Western code page, in which 0xB5 is µ. In the code page of
    /// DOS, 0xE6 is µ.
    fn text(&self, at: usize) -> String {
        let bytes = &self.0[at..at + 16];
        let bytes = bytes.split(|&b| b == 0).next().unwrap_or_default();
        let text = match std::str::from_utf8(bytes) {
            Ok(text) => text.to_owned(),
            Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
        };
        text.trim().replace('æ', "µ")
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
