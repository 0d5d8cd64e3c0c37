//! Template of all tables.

use maud::{Markup, Render, html};

/// Returns a table. If `numbers` is true, the cells from the second one of a row on are numbers. A table that is wider
/// than the screen scrolls by itself.
pub fn table(heads: &[impl Render], rows: &[Vec<impl Render>], numbers: bool) -> Markup {
    let class = |column: usize| (numbers && column > 0).then_some("n");
    html! {
        div.wide { table {
            thead { tr { @for (k, head) in heads.iter().enumerate() { th class=[class(k)] { (head) } } } } "\n"
            tbody {
                @for row in rows {
                    tr { @for (k, cell) in row.iter().enumerate() { td class=[class(k)] { (cell) } } } "\n"
                }
            }
        } } "\n"
    }
}
