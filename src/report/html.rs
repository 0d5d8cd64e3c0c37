//! Text for HTML and SVG.

use super::table;
use super::text::visible;

/// Cell of a value that is absent or unknown.
pub const NONE: &str = "–";

/// Escapes text for HTML and SVG, both between tags and in attributes.
pub fn escape(text: &str) -> String {
    visible(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}

/// Returns [`table::table`] as text, with visible control characters.
pub fn table(heads: &[String], rows: &[Vec<String>], numbers: bool) -> String {
    visible(&table::table(heads, rows, numbers).into_string())
}
