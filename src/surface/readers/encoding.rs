//! Decoding of bytes to text.

use std::borrow::Cow;

use encoding_rs::{Encoding, UTF_8, WINDOWS_1252};

use super::error::ReadProblem;

/// Decodes `bytes` and returns the text with the name of its encoding. The byte order mark decides, then the declared
/// encoding. A text without a byte order mark or a declared encoding is decoded as UTF-8. If the bytes are invalid
/// UTF-8, `decode` uses Windows-1252. Windows-1252 contains all characters of Latin-1.
///
/// # Errors
/// If the bytes are invalid in the encoding that the mark or the declaration names.
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

/// Rejects a text with control characters, which occur in binary files and in UTF-16 without a byte order
/// mark.
pub(super) fn reject_controls(text: &str, encoding: &str) -> Result<(), ReadProblem> {
    let is_foreign = |c: char| c.is_control() && !matches!(c, '\t' | '\n' | '\r' | '\x0c');
    let Some((at, character)) = text.char_indices().find(|&(_, c)| is_foreign(c)) else {
        return Ok(());
    };
    Err(ReadProblem::malformed(
        &format!("line {}", text[..at].matches('\n').count() + 1),
        format!(
            "the control character {:#04x} in what is read as {encoding}",
            u32::from(character)
        ),
        "plain text: save it as UTF-8, or as UTF-16 with a byte order mark",
    ))
}
