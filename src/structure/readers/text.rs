//! Lines and numbers of the text formats.

use super::super::matrices::DOUBLE;
use super::error::ReadProblem;

/// The text of a file; what is not UTF-8, in comments of old programs, is shown as a replacement character.
pub(super) fn text_of(bytes: &[u8]) -> std::borrow::Cow<'_, str> {
    String::from_utf8_lossy(bytes)
}

/// What a message shows of a text.
pub(super) fn shown(text: &str) -> String {
    const MOST: usize = 48;
    let mut short: String = text.trim().chars().take(MOST).collect();
    if text.trim().chars().count() > MOST {
        short.push('…');
    }
    format!("\"{}\"", short.escape_debug())
}

/// A real number as Fortran programs write it: exponents with D, or without a letter (`1.0-3`).
pub(super) fn real(text: &str) -> Option<f64> {
    let text = text.trim();
    if let Ok(value) = text.parse::<f64>() {
        // Words that the standard library takes for numbers are none here.
        return (value.is_finite()
            && text
                .bytes()
                .all(|b| !b.is_ascii_alphabetic() || matches!(b, b'e' | b'E')))
        .then_some(value);
    }
    if text.len() > LONGEST_NUMBER || !text.is_ascii() {
        return None;
    }
    let mut fixed = String::with_capacity(text.len() + 1);
    let bytes = text.as_bytes();
    for (k, &b) in bytes.iter().enumerate() {
        match b {
            b'd' | b'D' => fixed.push('e'),
            b'+' | b'-' if k > 0 && (bytes[k - 1].is_ascii_digit() || bytes[k - 1] == b'.') => {
                fixed.push('e');
                fixed.push(char::from(b));
            }
            _ => fixed.push(char::from(b)),
        }
    }
    let plain = fixed
        .bytes()
        .all(|b| b.is_ascii_digit() || matches!(b, b'e' | b'E' | b'+' | b'-' | b'.'));
    fixed.parse::<f64>().ok().filter(|v| plain && v.is_finite())
}

/// No program writes a number with more characters.
const LONGEST_NUMBER: usize = 64;

/// The most digits that numbers of a file have, seen so far.
#[derive(Default)]
pub(super) struct Digits(u32);

impl Digits {
    /// Counts those of a number's mantissa.
    pub(super) fn see(&mut self, text: &str) {
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

    /// Half a unit of the last of them, for numbers that begin with 1.
    pub(super) fn precision(&self) -> f64 {
        match self.0 {
            // Few digits are those of numbers that are meant exactly.
            0..5 | 17.. => DOUBLE,
            digits => (0.5 * 10f64.powi(1 - digits as i32)).max(DOUBLE),
        }
    }
}

/// A number of a text, or what is wrong with it.
pub(super) fn number(text: &str, place: impl Fn() -> String) -> Result<f64, ReadProblem> {
    real(text).ok_or_else(|| ReadProblem::malformed(place(), shown(text), "a finite number"))
}

/// The first numbers of a line; those that are blank or missing are zero.
pub(super) fn numbers<const N: usize>(
    fields: &[&str],
    place: impl Fn() -> String,
) -> Result<[f64; N], ReadProblem> {
    let mut found = [0.0; N];
    for (value, field) in found.iter_mut().zip(fields).filter(|(_, f)| !f.is_empty()) {
        *value = number(field, &place)?;
    }
    Ok(found)
}

/// The number that ends a line, of which nothing else may follow; `line` is what the line holds.
pub(super) fn last_number<'a>(
    mut words: impl Iterator<Item = &'a str>,
    digits: &mut Digits,
    line: &str,
    place: impl Fn() -> String,
) -> Result<f64, ReadProblem> {
    let word = words.next().unwrap_or("");
    let value = number(word, &place)?;
    digits.see(word);
    match words.next() {
        None => Ok(value),
        Some(more) => Err(ReadProblem::malformed(
            place(),
            shown(more),
            format!("the end of the line after {line}"),
        )),
    }
}

/// A whole number of a text, or what is wrong with it.
pub(super) fn whole<T: std::str::FromStr>(
    text: &str,
    expected: &str,
    place: impl Fn() -> String,
) -> Result<T, ReadProblem> {
    text.trim()
        .parse()
        .map_err(|_| ReadProblem::malformed(place(), shown(text), expected))
}
