//! Bytes to text.

use std::borrow::Cow;

use encoding_rs::{Encoding, UTF_8, WINDOWS_1252};

use super::error::ReadProblem;

/// The text of `bytes` and its encoding: that of the byte order mark, else the declared one, else UTF-8, else Windows-1252,
/// which contains the characters of Latin-1.
///
/// # Errors
/// For bytes that are no text in the encoding that the mark or the declaration names.
pub(super) fn decode<'a>(
    bytes: &'a [u8],
    declared: Option<&'static Encoding>,
) -> Result<(Cow<'a, str>, &'static str), ReadProblem> {
    let (stated, mark) = match Encoding::for_bom(bytes) {
        Some((encoding, length)) => (Some(encoding), length),
        None => (declared, 0),
    };
    let encoding = stated.unwrap_or(UTF_8);
    let bytes = &bytes[mark..];
    match encoding.decode_without_bom_handling_and_without_replacement(bytes) {
        Some(text) => Ok((text, encoding.name())),
        None if stated.is_none() => Ok((
            WINDOWS_1252.decode_without_bom_handling(bytes).0,
            WINDOWS_1252.name(),
        )),
        None => Err(ReadProblem::malformed(
            "the text",
            format!("bytes that are not {}", encoding.name()),
            "text in the encoding that it states: save it as UTF-8",
        )),
    }
}

/// Rejects a text with characters that no text has, such as those of a binary file or of UTF-16 without a byte order mark.
pub(super) fn reject_controls(text: &str, encoding: &str) -> Result<(), ReadProblem> {
    let is_foreign = |c: char| c.is_control() && !matches!(c, '\t' | '\n' | '\r' | '\x0c');
    let Some((at, found)) = text.char_indices().find(|&(_, c)| is_foreign(c)) else {
        return Ok(());
    };
    Err(ReadProblem::malformed(
        &format!("line {}", text[..at].matches('\n').count() + 1),
        format!(
            "the control character {:#04x} in what is read as {encoding}",
            u32::from(found)
        ),
        "plain text: save it as UTF-8, or as UTF-16 with a byte order mark",
    ))
}
