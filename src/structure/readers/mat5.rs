//! MATLAB MAT-files of version 5 (`save -v6`, `-v7`, `scipy.io.savemat`): dense and sparse matrices, compressed or not.

use std::io::Read;

use flate2::read::ZlibDecoder;

use super::error::ReadProblem;
use super::{LONGEST_FILE, Named, Parsed, chosen, entries, role_of_name, rows};
use crate::structure::matrices::Triplets;

/// Text, version and byte order.
const HEADER: usize = 128;
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Classes of arrays.
const SPARSE: u8 = 5;
const NUMERIC: std::ops::RangeInclusive<u8> = 6..=15;

pub(super) fn is(bytes: &[u8]) -> bool {
    bytes.starts_with(b"MATLAB ")
}

pub(super) fn parse(bytes: &[u8]) -> Result<Parsed, ReadProblem> {
    if bytes.starts_with(b"MATLAB 7.3") {
        return Err(ReadProblem::Unsupported {
            found: "a MAT-file of version 7.3".into(),
            advice: "save it with `save('file.mat', 'K', 'M', '-v7')`".into(),
        });
    }
    let order = bytes.get(126..HEADER).ok_or_else(|| {
        ReadProblem::truncated("the header", format!("{} bytes", bytes.len()), "128 bytes")
    })?;
    let little = match order {
        b"IM" => true,
        b"MI" => false,
        _ => {
            return Err(ReadProblem::malformed(
                "bytes 127 and 128",
                format!("\"{}\"", order.escape_ascii()),
                "IM or MI, the byte order",
            ));
        }
    };
    let mut parsed = Parsed::default();
    let mut elements = Elements {
        bytes: &bytes[HEADER..],
        at: 0,
        little,
        start: HEADER,
    };
    while let Some((kind, data, place)) = elements.next()? {
        match kind {
            MATRIX => matrix(data, little, &place, &mut parsed)?,
            COMPRESSED => {
                let mut unpacked = Vec::new();
                ZlibDecoder::new(data)
                    .take(LONGEST_FILE)
                    .read_to_end(&mut unpacked)
                    .map_err(|e| {
                        ReadProblem::malformed(&place, e, "an intact compressed variable")
                    })?;
                let mut inner = Elements {
                    bytes: &unpacked,
                    at: 0,
                    little,
                    start: 0,
                };
                while let Some((kind, data, inside)) = inner.next()? {
                    if kind == MATRIX {
                        matrix(
                            data,
                            little,
                            &format!("{place}, unpacked {inside}"),
                            &mut parsed,
                        )?;
                    }
                }
            }
            _ => {}
        }
    }
    chosen(&mut parsed);
    Ok(parsed)
}

/// Data elements one after another: type, length, data, padding to eight bytes.
struct Elements<'a> {
    bytes: &'a [u8],
    at: usize,
    little: bool,
    /// Where the first stands, for messages.
    start: usize,
}

fn u32_of(bytes: &[u8], at: usize, little: bool) -> Option<u32> {
    let four: [u8; 4] = bytes.get(at..at + 4)?.try_into().ok()?;
    Some(if little {
        u32::from_le_bytes(four)
    } else {
        u32::from_be_bytes(four)
    })
}

type Element<'a> = (u32, &'a [u8], String);

impl<'a> Elements<'a> {
    fn next(&mut self) -> Result<Option<Element<'a>>, ReadProblem> {
        if self.at >= self.bytes.len() {
            return Ok(None);
        }
        let place = format!("byte {}", self.start + self.at);
        let cut = |found: usize, needed: usize| {
            ReadProblem::truncated(
                format!("the element of {place}"),
                format!("{found} bytes"),
                format!("{needed}"),
            )
        };
        let rest = self.bytes.len() - self.at;
        let first = u32_of(self.bytes, self.at, self.little).ok_or_else(|| cut(rest, 8))?;
        let second = self
            .bytes
            .get(self.at + 4..self.at + 8)
            .ok_or_else(|| cut(rest, 8))?;
        if first >> 16 != 0 {
            // Up to four bytes stand where the length would.
            let length = (first >> 16) as usize;
            let data = second.get(..length).ok_or_else(|| {
                ReadProblem::malformed(
                    &place,
                    format!("a small element of {length} bytes"),
                    "at most 4",
                )
            })?;
            self.at += 8;
            return Ok(Some((first & 0xFFFF, data, place)));
        }
        let length = u32_of(second, 0, self.little).unwrap_or(0) as usize;
        let data = self
            .bytes
            .get(self.at + 8..self.at + 8 + length)
            .ok_or_else(|| cut(rest - 8, length))?;
        let padded = if first == COMPRESSED {
            length
        } else {
            length.next_multiple_of(8)
        };
        self.at += 8 + padded;
        Ok(Some((first, data, place)))
    }

    fn expect(&mut self, what: &str, place: &str) -> Result<(u32, &'a [u8]), ReadProblem> {
        let found = self.next()?;
        let (kind, data, _) = found.ok_or_else(|| {
            ReadProblem::truncated(
                format!("the variable of {place}"),
                "a part",
                format!("its {what}"),
            )
        })?;
        Ok((kind, data))
    }
}

fn numbers(kind: u32, data: &[u8], little: bool, place: &str) -> Result<Vec<f64>, ReadProblem> {
    macro_rules! read {
        ($t:ty) => {{
            let width = size_of::<$t>();
            let one = |chunk: &[u8]| {
                let bytes = chunk.try_into().expect("a chunk of that width");
                if little {
                    <$t>::from_le_bytes(bytes)
                } else {
                    <$t>::from_be_bytes(bytes)
                }
            };
            data.chunks_exact(width)
                .map(|chunk| one(chunk) as f64)
                .collect()
        }};
    }
    Ok(match kind {
        1 => read!(i8),
        2 => read!(u8),
        3 => read!(i16),
        4 => read!(u16),
        5 => read!(i32),
        6 => read!(u32),
        7 => read!(f32),
        9 => read!(f64),
        12 => read!(i64),
        13 => read!(u64),
        _ => {
            return Err(ReadProblem::malformed(
                place,
                format!("numbers of type {kind}"),
                "a numeric type",
            ));
        }
    })
}

fn matrix(bytes: &[u8], little: bool, place: &str, parsed: &mut Parsed) -> Result<(), ReadProblem> {
    if bytes.is_empty() {
        return Ok(());
    }
    let mut parts = Elements {
        bytes,
        at: 0,
        little,
        start: 0,
    };
    let (_, flags) = parts.expect("flags", place)?;
    let flag = u32_of(flags, 0, little).ok_or_else(|| {
        ReadProblem::truncated(format!("the flags of {place}"), flags.len(), "8 bytes")
    })?;
    let (class, is_complex) = ((flag & 0xFF) as u8, flag & 0x0800 != 0);
    let (kind, shape) = parts.expect("shape", place)?;
    let shape = numbers(kind, shape, little, place)?;
    let (_, name) = parts.expect("name", place)?;
    let name = String::from_utf8_lossy(name)
        .trim_matches('\0')
        .escape_debug()
        .to_string();
    let place = format!("the variable {name} ({place})");
    let role = role_of_name(&name);
    let is_square =
        matches!(shape.as_slice(), &[m, n] if m == n && m >= 1.0 && m < f64::from(u32::MAX));
    if !is_square || !(class == SPARSE || NUMERIC.contains(&class)) {
        // A letter alone may name anything.
        if role.is_some() && name.len() > 1 {
            return Err(ReadProblem::malformed(
                place,
                format!("an array of class {class} and shape {shape:?}"),
                "a square matrix of numbers",
            ));
        }
        parsed.notes.push(format!(
            "{name} is no square matrix of numbers, and is left out (of a struct save the fields as variables of their own)"
        ));
        return Ok(());
    }
    if is_complex {
        return Err(ReadProblem::Unsupported {
            found: format!("complex numbers in {place}"),
            advice: "stiffness, mass and damping are real: save `real(K)`".into(),
        });
    }
    let mut matrix;
    if class == SPARSE {
        let (kind, data) = parts.expect("rows", &place)?;
        let indices = numbers(kind, data, little, &place)?;
        let (kind, data) = parts.expect("starts of columns", &place)?;
        let starts = numbers(kind, data, little, &place)?;
        let (kind, data) = parts.expect("values", &place)?;
        let values = numbers(kind, data, little, &place)?;
        if starts.len() as f64 != shape[0] + 1.0 {
            return Err(ReadProblem::malformed(
                &place,
                format!("{} starts of columns", starts.len()),
                shape[0] + 1.0,
            ));
        }
        let size = rows(shape[0] as u64, starts.len(), &place)?;
        let stored = starts[size];
        let fits = stored >= 0.0 && stored <= indices.len().min(values.len()) as f64;
        if starts[0] != 0.0 || !fits || starts.windows(2).any(|w| w[0] > w[1]) {
            return Err(ReadProblem::malformed(
                &place,
                format!("columns that end at {stored}"),
                format!(
                    "starts that rise from 0 to at most {}",
                    indices.len().min(values.len())
                ),
            ));
        }
        entries(stored as u64, bytes.len(), &place)?;
        matrix = Triplets::new(size);
        for column in 0..size {
            for k in starts[column] as usize..starts[column + 1] as usize {
                let row = indices[k];
                if !(row >= 0.0 && row < size as f64) {
                    return Err(ReadProblem::malformed(
                        &place,
                        format!("row {row} (from 0)"),
                        format!("rows below {size}"),
                    ));
                }
                matrix.entries.push((row as u32, column as u32, values[k]));
            }
        }
    } else {
        let (kind, data) = parts.expect("values", &place)?;
        let values = numbers(kind, data, little, &place)?;
        let size = rows(shape[0] as u64, values.len(), &place)?;
        if values.len() != size.saturating_mul(size) {
            return Err(ReadProblem::truncated(
                &place,
                format!("{} numbers", values.len()),
                format!("{size} rows and columns"),
            ));
        }
        matrix = Triplets::new(size);
        for (k, &value) in values.iter().enumerate().filter(|(_, v)| **v != 0.0) {
            matrix
                .entries
                .push(((k % size) as u32, (k / size) as u32, value));
        }
    }
    if class == 7 {
        matrix.precision = f64::from(f32::EPSILON) / 2.0;
    }
    parsed.matrices.push(Named {
        name,
        role,
        matrix,
        dofs: None,
        is_open: false,
    });
    Ok(())
}
