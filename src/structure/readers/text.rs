//! Parsing of lines and numbers in text formats.

use super::super::matrices::DOUBLE_PRECISION;
use super::error::ReadProblem;

/// Returns the text of a file. Bytes that are not UTF-8, as in old comments, become replacement characters.
pub(super) fn text_of(bytes: &[u8]) -> std::borrow::Cow<'_, str> {
    String::from_utf8_lossy(bytes)
}

/// Returns a short, quoted form of a text for a message.
pub(super) fn quoted(text: &str) -> String {
    const MOST: usize = 48;
    let mut short: String = text.trim().chars().take(MOST).collect();
    if text.trim().chars().count() > MOST {
        short.push('…');
    }
    format!("\"{}\"", short.escape_debug())
}

/// Parses a real number as Fortran writes it: the exponent has D, E or no letter (`1.0-3`).
pub(super) fn real(text: &str) -> Option<f64> {
    let text = text.trim();
    if let Ok(value) = text.parse::<f64>() {
        // The standard library accepts words such as `inf` as numbers. `real` rejects words such as `inf`.
        return (value.is_finite()
            && text
                .bytes()
                .all(|b| !b.is_ascii_alphabetic() || matches!(b, b'e' | b'E')))
        .then_some(value);
    }
    if text.len() > LONGEST_NUMBER || !text.is_ascii() {
        return None;
    }
    let mut normalized = String::with_capacity(text.len() + 1);
    let bytes = text.as_bytes();
    for (k, &b) in bytes.iter().enumerate() {
        match b {
            b'd' | b'D' => normalized.push('e'),
            b'+' | b'-' if k > 0 && (bytes[k - 1].is_ascii_digit() || bytes[k - 1] == b'.') => {
                normalized.push('e');
                normalized.push(char::from(b));
            }
            _ => normalized.push(char::from(b)),
        }
    }
    let is_numeric = normalized
        .bytes()
        .all(|b| b.is_ascii_digit() || matches!(b, b'e' | b'E' | b'+' | b'-' | b'.'));
    normalized
        .parse::<f64>()
        .ok()
        .filter(|v| is_numeric && v.is_finite())
}

/// Largest number of characters of a number. No program writes more.
const LONGEST_NUMBER: usize = 64;

/// Largest number of significant digits found in a file.
#[derive(Default)]
pub(super) struct Digits(u32);

impl Digits {
    /// Counts the digits of a number's mantissa.
    pub(super) fn count_digits(&mut self, text: &str) {
        let mut digits = 0;
        let mut zeros = true;
        for b in text.trim().bytes() {
            match b {
                b'0' if zeros => {}
                b'0'..=b'9' => {
                    zeros = false;
                    digits += 1;
                }
                b'.' | b' ' => {}
                b'+' | b'-' if digits == 0 && zeros => {}
                _ => break,
            }
        }
        self.0 = self.0.max(digits);
    }

    /// Returns the relative precision: half a unit of the last digit of a number that begins with 1.
    pub(super) fn precision(&self) -> f64 {
        match self.0 {
            // Numbers with few digits are usually exact.
            0..5 | 17.. => DOUBLE_PRECISION,
            digits => (0.5 * 10f64.powi(1 - digits as i32)).max(DOUBLE_PRECISION),
        }
    }
}

/// Parses a number, or returns an error with the text.
pub(super) fn number(text: &str, place: impl Fn() -> String) -> Result<f64, ReadProblem> {
    real(text).ok_or_else(|| ReadProblem::malformed(place(), quoted(text), "a finite number"))
}

/// Parses the first numbers of a line. Blank or missing numbers are zero.
pub(super) fn numbers<const N: usize>(
    fields: &[&str],
    place: impl Fn() -> String,
) -> Result<[f64; N], ReadProblem> {
    let mut values = [0.0; N];
    for (value, field) in values.iter_mut().zip(fields).filter(|(_, f)| !f.is_empty()) {
        *value = number(field, &place)?;
    }
    Ok(values)
}

/// Parses the last number of a line, and rejects further words. `line` describes the content of the line.
pub(super) fn last_number<'a>(
    mut words: impl Iterator<Item = &'a str>,
    digits: &mut Digits,
    line: &str,
    place: impl Fn() -> String,
) -> Result<f64, ReadProblem> {
    let word = words.next().unwrap_or("");
    let value = number(word, &place)?;
    digits.count_digits(word);
    match words.next() {
        None => Ok(value),
        Some(more) => Err(ReadProblem::malformed(
            place(),
            quoted(more),
            format!("the end of the line after {line}"),
        )),
    }
}

/// Parses a whole number, or returns an error with the text.
pub(super) fn whole<T: std::str::FromStr>(
    text: &str,
    expected: &str,
    place: impl Fn() -> String,
) -> Result<T, ReadProblem> {
    text.trim()
        .parse()
        .map_err(|_| ReadProblem::malformed(place(), quoted(text), expected))
}
