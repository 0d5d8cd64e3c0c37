//! Text in HTML and SVG.

use super::table;
use super::text::visible;

/// What is not there, or not known.
pub const NONE: &str = "–";

/// Text as it stands in HTML and SVG, between tags and in attributes.
pub fn escape(text: &str) -> String {
    visible(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}

/// [`table::table`] as text, with control characters made visible.
pub fn table(heads: &[String], rows: &[Vec<String>], numbers: bool) -> String {
    visible(&table::table(heads, rows, numbers).into_string())
}
