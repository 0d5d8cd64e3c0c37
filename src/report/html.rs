//! Pieces of a page.

use super::text::visible;

/// What is not there, or not known.
pub const NONE: &str = "–";

/// A part of a page.
#[derive(Debug, Clone)]
pub struct Section {
    /// Its anchor.
    pub id: &'static str,
    /// Heading.
    pub title: String,
    /// What stands below the heading, as HTML.
    pub html: String,
}

/// Text as it stands in HTML and SVG, between tags and in attributes.
pub fn escaped(text: &str) -> String {
    visible(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}

/// A table of texts: heads, and rows whose cells are numbers from the second on, if `numbers`.
pub fn table(heads: &[String], rows: &[Vec<String>], numbers: bool) -> String {
    let texts = |row: &Vec<String>| row.iter().map(|text| escaped(text)).collect();
    let rows: Vec<Vec<String>> = rows.iter().map(texts).collect();
    table_of_markup(heads, &rows, numbers)
}

/// A table of texts as heads, and of rows whose cells are HTML already and numbers from the second on, if `numbers`. A table that is wider
/// than the screen scrolls by itself.
pub fn table_of_markup(heads: &[String], rows: &[Vec<String>], numbers: bool) -> String {
    let line = |tag: &str, cells: &[String]| {
        let each = cells.iter().enumerate();
        let cells: String = each
            .map(|(column, cell)| match numbers && column > 0 {
                true => format!("<{tag} class=\"n\">{cell}</{tag}>"),
                false => format!("<{tag}>{cell}</{tag}>"),
            })
            .collect();
        format!("<tr>{cells}</tr>\n")
    };
    let heads: Vec<String> = heads.iter().map(|head| escaped(head)).collect();
    let body: String = rows.iter().map(|row| line("td", row)).collect();
    format!(
        "<div class=\"wide\"><table>\n<thead>{}</thead>\n<tbody>\n{body}</tbody>\n</table></div>\n",
        line("th", &heads)
    )
}
