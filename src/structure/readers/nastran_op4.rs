//! Nastran OUTPUT4, text and binary: dense columns, and sparse ones as strings of values with a packed header (`65536·(L+1) + row`) or
//! with two numbers (BIGMAT).

use std::path::{Path, PathBuf};

use super::error::ReadProblem;
use super::text::{Digits, number, shown, text_of, whole};
use super::{Named, Parsed, role_of_name, rows_of_few, square};
use crate::structure::matrices::{Role, Triplets};

/// Bytes of the header's record in a binary file of 4-byte words.
const HEADER: u32 = 24;

/// The deck with the list of freedoms that belongs to an external superelement's matrices.
pub(super) fn beside(path: &Path) -> Vec<PathBuf> {
    let is_op4 = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("op4"));
    let extensions: &[&str] = if is_op4 { &["pch", "asm"] } else { &[] };
    extensions.iter().map(|e| path.with_extension(e)).collect()
}

/// What stands before the columns of a matrix.
struct Header {
    name: String,
    columns: u64,
    rows: u64,
    is_big: bool,
    form: i64,
    kind: u32,
}

impl Header {
    fn check(&self, place: &str) -> Result<(), ReadProblem> {
        if !(1..=4).contains(&self.kind) {
            return Err(ReadProblem::malformed(
                place,
                format!("the type {}", self.kind),
                "1 to 4, real or complex",
            ));
        }
        Ok(())
    }

    /// What the matrix is, where it is one of a structure at all: Nastran writes loads, and empty matrices of one row, beside.
    fn role(&self) -> Option<Role> {
        let is_square = self.rows == self.columns && self.rows > 1;
        role_of_name(&self.name).filter(|_| is_square)
    }

    fn words(&self) -> u64 {
        if self.kind.is_multiple_of(2) { 2 } else { 1 }
    }

    /// An empty matrix for the columns, or none where they are only to be passed over.
    fn begin(&self, place: &str) -> Result<Option<Triplets>, ReadProblem> {
        if role_of_name(&self.name).is_some() && self.rows > 1 && self.columns > 1 {
            square(self.rows, self.columns, &format!("{} ({place})", self.name))?;
        }
        if self.role().is_none() {
            return Ok(None);
        }
        if self.kind > 2 {
            return Err(ReadProblem::Unsupported {
                found: format!("the matrix {} of complex numbers ({place})", self.name),
                advice: "stiffness, mass and damping are real: write structural damping into a matrix of its own".into(),
            });
        }
        Ok(Some(Triplets::new(rows_of_few(self.rows, place)?)))
    }

    fn end(&self, matrix: Option<Triplets>, precision: f64, into: &mut Parsed) {
        let Some(mut matrix) = matrix else {
            if self.rows > 1 && self.columns > 0 {
                into.notes.push(format!(
                    "OUTPUT4 {} ({} rows, {} columns) is no stiffness, mass or damping, and is left out",
                    self.name, self.rows, self.columns
                ));
            }
            return;
        };
        matrix.precision = precision;
        if self.form == 6 {
            matrix.find_half();
        }
        into.matrices.push(Named {
            name: format!("OUTPUT4 {}", self.name),
            role: self.role(),
            matrix,
            dofs: None,
            is_open: false,
        });
    }
}

/// Writes values from a row of a column on; all must lie in the matrix.
fn put(
    matrix: &mut Option<Triplets>,
    header: &Header,
    column: u64,
    row: u64,
    values: impl ExactSizeIterator<Item = f64>,
    place: &str,
) -> Result<(), ReadProblem> {
    let Some(matrix) = matrix else {
        return Ok(());
    };
    let count = values.len() as u64;
    let last = row.checked_add(count).map(|end| end.saturating_sub(1));
    if row == 0 || last.is_none_or(|last| last > header.rows) {
        return Err(ReadProblem::malformed(
            place,
            format!("{count} values of {} from row {row} on", header.name),
            format!("rows 1 to {}", header.rows),
        ));
    }
    for (k, value) in values.enumerate().filter(|(_, v)| *v != 0.0) {
        matrix
            .entries
            .push(((row - 1) as u32 + k as u32, (column - 1) as u32, value));
    }
    Ok(())
}

// ---- text ----

/// Columns of the format's own numbers.
const DEFAULT_WIDTH: usize = 16;

fn header_of(line: &str) -> Option<(Header, usize)> {
    let field = |k: usize| line.get(8 * k..8 * k + 8).map(str::trim);
    let whole = |k: usize| field(k)?.parse::<i64>().ok();
    let (columns, rows, form, kind) = (whole(0)?, whole(1)?, whole(2)?, whole(3)?);
    let end = line.len().min(40);
    let name = line.get(32..end)?.trim();
    if columns < 0 || !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        return None;
    }
    // As in 1P,3E22.15: three numbers of 22 characters.
    let format = line.get(40..).unwrap_or("").to_ascii_uppercase();
    let width = format.rsplit(['E', 'D']).next().and_then(|tail| {
        let digits = tail.split('.').next()?;
        digits.trim().parse::<usize>().ok()
    });
    let header = Header {
        name: name.to_owned(),
        columns: columns.unsigned_abs(),
        rows: rows.unsigned_abs(),
        is_big: rows < 0,
        form,
        kind: u32::try_from(kind).ok()?,
    };
    let width = width.filter(|width| (8..=40).contains(width));
    Some((header, width.unwrap_or(DEFAULT_WIDTH)))
}

pub(super) fn is_text(bytes: &[u8]) -> bool {
    const ENOUGH: usize = 1024;
    let text = text_of(&bytes[..bytes.len().min(ENOUGH)]);
    let first = text.lines().find(|line| !line.trim().is_empty());
    first.is_some_and(|line| {
        header_of(line).is_some_and(|(header, _)| (1..=4).contains(&header.kind))
    })
}

/// Values have a point, the numbers between them have none; the header of a matrix has one in its format.
fn is_values(line: &str) -> bool {
    line.contains('.') && header_of(line).is_none()
}

struct Lines<'a> {
    rest: std::iter::Peekable<std::iter::Enumerate<std::str::Lines<'a>>>,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Option<(usize, &'a str)> {
        self.skip();
        self.rest.next().map(|(k, line)| (k + 1, line))
    }

    fn skip(&mut self) {
        while self
            .rest
            .next_if(|(_, line)| line.trim().is_empty())
            .is_some()
        {}
    }

    /// The numbers of the lines that follow, of a fixed width each: they may touch.
    fn values(&mut self, width: usize, digits: &mut Digits) -> Result<Vec<f64>, ReadProblem> {
        let mut values = Vec::new();
        self.skip();
        while let Some((k, line)) = self.rest.next_if(|(_, line)| is_values(line)) {
            let line = line.trim_end();
            let place = || format!("line {}", k + 1);
            let mut at = 0;
            while at < line.len() {
                let field = line.get(at..(at + width).min(line.len()));
                let field = field.ok_or_else(|| {
                    ReadProblem::malformed(
                        place(),
                        shown(line),
                        format!("numbers of {width} characters"),
                    )
                })?;
                values.push(number(field, place)?);
                digits.see(field);
                at += width;
            }
            self.skip();
        }
        Ok(values)
    }

    /// The whole numbers of the next line.
    fn wholes(&mut self, part: &str) -> Result<(usize, Vec<u64>), ReadProblem> {
        let (k, line) = self.next().ok_or_else(|| {
            ReadProblem::truncated("the file", part, "the columns that its header announces")
        })?;
        let place = || format!("line {k}");
        let numbers = line.split_whitespace().map(|word| {
            whole(
                word,
                "whole numbers: column, row and words, or the head of a string",
                place,
            )
        });
        Ok((k, numbers.collect::<Result<_, _>>()?))
    }

    /// How many whole numbers the next line has; none for values.
    fn ahead(&mut self) -> usize {
        self.skip();
        match self.rest.peek() {
            Some((_, line)) if !is_values(line) && header_of(line).is_none() => {
                line.split_whitespace().count()
            }
            _ => 0,
        }
    }
}

pub(super) fn parse_text(bytes: &[u8]) -> Result<Parsed, ReadProblem> {
    let text = text_of(bytes);
    let mut lines = Lines {
        rest: text.lines().enumerate().peekable(),
    };
    let mut parsed = Parsed::default();
    while let Some((k, line)) = lines.next() {
        let place = format!("line {k}");
        let (header, width) = header_of(line).ok_or_else(|| {
            ReadProblem::malformed(
                &place,
                shown(line),
                "columns, rows, form and type of a matrix, 8 characters each, and its name",
            )
        })?;
        header.check(&place)?;
        let mut matrix = header.begin(&place)?;
        let mut digits = Digits::default();
        let part = || format!("a part of the matrix {}", header.name);
        loop {
            let (k, head) = lines.wholes(&part())?;
            let place = format!("line {k}");
            let &[column, row, words] = head.as_slice() else {
                return Err(ReadProblem::malformed(
                    &place,
                    format!("{} whole numbers", head.len()),
                    "column, row and words",
                ));
            };
            if column == 0 || column > header.columns + 1 {
                return Err(ReadProblem::malformed(
                    &place,
                    format!("column {column}"),
                    format!("1 to {}", header.columns + 1),
                ));
            }
            if column > header.columns {
                lines.values(width, &mut Digits::default())?;
                break;
            }
            if row > 0 {
                let values = lines.values(width, &mut digits)?;
                check_count(values.len(), words, &header, column, &place)?;
                put(
                    &mut matrix,
                    &header,
                    column,
                    row,
                    values.into_iter(),
                    &place,
                )?;
                continue;
            }
            let head = if header.is_big { 2 } else { 1 };
            while lines.ahead() == head {
                let (k, string) = lines.wholes(&part())?;
                let place = format!("line {k}");
                let (length, row) =
                    string_head(&string).ok_or_else(|| malformed_string(&place, &string))?;
                let values = lines.values(width, &mut digits)?;
                check_count(values.len(), length, &header, column, &place)?;
                put(
                    &mut matrix,
                    &header,
                    column,
                    row,
                    values.into_iter(),
                    &place,
                )?;
            }
        }
        header.end(matrix, digits.precision(), &mut parsed);
    }
    Ok(parsed)
}

/// Words and first row of a string, of its head: one packed number, or two.
fn string_head(head: &[u64]) -> Option<(u64, u64)> {
    match *head {
        [packed] => Some(((packed >> 16).checked_sub(1)?, packed & 0xFFFF)),
        [length, row] => Some((length.checked_sub(1)?, row)),
        _ => None,
    }
}

fn malformed_string(place: &str, head: &[u64]) -> ReadProblem {
    ReadProblem::malformed(
        place,
        format!("the head of a string {head:?}"),
        "65536·(words + 1) + row, or words + 1 and row",
    )
}

/// Texts count values, or words of which a number in double precision has two: programs differ.
fn check_count(
    found: usize,
    announced: u64,
    header: &Header,
    column: u64,
    place: &str,
) -> Result<(), ReadProblem> {
    let found = found as u64;
    if found == announced || (header.words() == 2 && 2 * found == announced) {
        return Ok(());
    }
    Err(ReadProblem::truncated(
        format!("column {column} of {} ({place})", header.name),
        format!("{found} numbers"),
        format!("{announced}"),
    ))
}

// ---- binary ----

fn is_little(bytes: &[u8]) -> Option<bool> {
    let first: [u8; 4] = bytes.get(..4)?.try_into().ok()?;
    match (u32::from_le_bytes(first), u32::from_be_bytes(first)) {
        (HEADER | 48, _) => Some(true),
        (_, HEADER | 48) => Some(false),
        _ => None,
    }
}

pub(super) fn is_binary(bytes: &[u8]) -> bool {
    is_little(bytes).is_some()
}

struct Binary<'a> {
    bytes: &'a [u8],
    at: usize,
    little: bool,
}

impl<'a> Binary<'a> {
    fn u32_of(&self, four: &[u8]) -> u32 {
        let four = [four[0], four[1], four[2], four[3]];
        if self.little {
            u32::from_le_bytes(four)
        } else {
            u32::from_be_bytes(four)
        }
    }

    /// The next record of Fortran: its length before and after it.
    fn record(&mut self) -> Result<Option<&'a [u8]>, ReadProblem> {
        if self.at == self.bytes.len() {
            return Ok(None);
        }
        let place = format!("byte {}", self.at);
        let rest = &self.bytes[self.at..];
        let length = rest.get(..4).map(|four| self.u32_of(four) as usize);
        let whole = length.and_then(|length| {
            Some((
                rest.get(4..4 + length)?,
                self.u32_of(rest.get(4 + length..8 + length)?),
            ))
        });
        let Some((record, after)) = whole else {
            return Err(ReadProblem::truncated(
                format!("the record of {place}"),
                format!("{} bytes", rest.len().saturating_sub(4)),
                length.map_or("a length".to_owned(), |l| {
                    format!("{l} bytes and their number again")
                }),
            ));
        };
        if after as usize != record.len() {
            return Err(ReadProblem::malformed(
                place,
                format!("a record of {} bytes that ends with {after}", record.len()),
                "the same number",
            ));
        }
        self.at += record.len() + 8;
        Ok(Some(record))
    }

    fn word(&self, record: &[u8], k: usize) -> u32 {
        self.u32_of(&record[4 * k..4 * k + 4])
    }

    /// The real numbers in some bytes.
    fn reals<'b>(
        &self,
        bytes: &'b [u8],
        words: u64,
    ) -> impl ExactSizeIterator<Item = f64> + use<'b> {
        let little = self.little;
        bytes
            .chunks_exact(4 * words as usize)
            .map(move |chunk| match *chunk {
                [a, b, c, d] => f64::from(if little {
                    f32::from_le_bytes([a, b, c, d])
                } else {
                    f32::from_be_bytes([a, b, c, d])
                }),
                [a, b, c, d, e, f, g, h] => {
                    let all = [a, b, c, d, e, f, g, h];
                    if little {
                        f64::from_le_bytes(all)
                    } else {
                        f64::from_be_bytes(all)
                    }
                }
                _ => f64::NAN,
            })
    }
}

pub(super) fn parse_binary(bytes: &[u8]) -> Result<Parsed, ReadProblem> {
    let little = is_little(bytes).unwrap_or(true);
    let mut file = Binary {
        bytes,
        at: 0,
        little,
    };
    let mut parsed = Parsed::default();
    loop {
        let place = format!("byte {}", file.at);
        let Some(record) = file.record()? else {
            break;
        };
        if record.len() == 48 {
            return Err(ReadProblem::Unsupported {
                found: "an OUTPUT4 file of 8-byte words".into(),
                advice: "write it with 4-byte words, or as text (FORM=FORMATTED)".into(),
            });
        }
        if record.len() != HEADER as usize {
            return Err(ReadProblem::malformed(
                &place,
                format!("a record of {} bytes", record.len()),
                "the 24 bytes of a matrix's header",
            ));
        }
        let signed = |k: usize| i64::from(file.word(record, k) as i32);
        let header = Header {
            name: String::from_utf8_lossy(&record[16..])
                .trim_matches([' ', '\0'])
                .escape_debug()
                .to_string(),
            columns: signed(0).unsigned_abs(),
            rows: signed(1).unsigned_abs(),
            is_big: signed(1) < 0,
            form: signed(2),
            kind: file.word(record, 3),
        };
        header.check(&place)?;
        let mut matrix = header.begin(&place)?;
        loop {
            let place = format!("byte {}", file.at);
            let Some(record) = file.record()? else {
                return Err(ReadProblem::truncated(
                    format!("the matrix {}", header.name),
                    "a part of its columns",
                    format!("{} columns and the record after them", header.columns),
                ));
            };
            if record.len() < 12 {
                return Err(ReadProblem::malformed(
                    &place,
                    format!("a record of {} bytes", record.len()),
                    "column, row and words of a column",
                ));
            }
            let [column, row, words] = [0, 1, 2].map(|k| u64::from(file.word(record, k)));
            if column == 0 || column > header.columns + 1 {
                return Err(ReadProblem::malformed(
                    &place,
                    format!("column {column}"),
                    format!("1 to {}", header.columns + 1),
                ));
            }
            if column > header.columns {
                break;
            }
            let data = &record[12..];
            if (data.len() as u64) < 4 * words {
                return Err(ReadProblem::truncated(
                    format!("column {column} of {} ({place})", header.name),
                    format!("{} bytes", data.len()),
                    format!("{words} words of 4 bytes"),
                ));
            }
            let data = &data[..4 * words as usize];
            if row > 0 {
                put(
                    &mut matrix,
                    &header,
                    column,
                    row,
                    file.reals(data, header.words()),
                    &place,
                )?;
                continue;
            }
            let count = if header.is_big { 2 } else { 1 };
            let mut at = 0;
            while at + 4 * count <= data.len() {
                let head: Vec<u64> = (0..count)
                    .map(|k| u64::from(file.u32_of(&data[at + 4 * k..])))
                    .collect();
                at += 4 * count;
                let (length, row) =
                    string_head(&head).ok_or_else(|| malformed_string(&place, &head))?;
                let end = usize::try_from(length)
                    .ok()
                    .and_then(|l| l.checked_mul(4))
                    .and_then(|l| l.checked_add(at));
                let Some(string) = end.and_then(|end| data.get(at..end)) else {
                    return Err(malformed_string(&place, &head));
                };
                put(
                    &mut matrix,
                    &header,
                    column,
                    row,
                    file.reals(string, header.words()),
                    &place,
                )?;
                at += string.len();
            }
        }
        let precision = if header.words() == 2 {
            Triplets::new(0).precision
        } else {
            f64::from(f32::EPSILON) / 2.0
        };
        header.end(matrix, precision, &mut parsed);
    }
    Ok(parsed)
}
