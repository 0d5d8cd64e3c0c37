//! Drawings as SVG: curves and maps.
//!
//! Strokes and fills are CSS classes without colours. The page defines the colours of strokes and fills for light and
//! dark displays, and [`standalone`] defines the colours for paper.

mod axis;
mod chart;
mod map;

use maud::{Markup, PreEscaped, html};

pub use axis::Axis;
pub use chart::{BEFORE_ZERO, Band, Chart, Curve, Mark, UNCERTAIN};
pub use map::{Map, NO_DATA, Scale};

use super::text::escape_controls;

/// Number of curve styles: states of wear, then runs.
const STYLES: usize = RUNS + 8;
/// Style of the unworn joint, in all drawings.
pub const UNWORN: usize = 0;
/// Style of the last state of wear.
pub const WORN: usize = 1;
/// First style of the intermediate states, in the order of wear.
const BETWEEN: usize = 2;
/// First style of the runs. The styles of runs repeat after the last one.
const RUNS: usize = 6;

/// Returns the style of a run.
pub fn style_of_run(place: usize) -> usize {
    RUNS + place % (STYLES - RUNS)
}

/// Returns the style of a state of wear. The states are in the order of wear, the unworn one first.
pub fn style_of_state(place: usize, states: usize) -> usize {
    let between = RUNS - BETWEEN;
    match place {
        0 => UNWORN,
        place if place + 1 >= states => WORN,
        // The styles BETWEEN to RUNS - 1 are distributed evenly over the states between unworn and worn.
        place => BETWEEN + (place * (between + 1) / (states - 1)).clamp(1, between) - 1,
    }
}

/// Width of a drawing, in units of the page.
pub const WIDTH: f64 = 480.0;
/// Height of the heading, in units of the page.
const HEAD: f64 = 26.0;
/// Font size.
const TEXT: f64 = 14.0;
/// Approximate mean width of a letter, relative to the font size.
const LETTER: f64 = 0.54;

/// Colours of the styles. Unworn and worn are blue and vermilion of Okabe and Ito, with a gradation for the states
/// between. The colours of runs differ from the colours of the states. Dashes distinguish the styles without colour.
const LIGHT: [&str; STYLES] = [
    "#0072b2", "#d55e00", "#4c71a8", "#7a6c98", "#a06682", "#bd625a", "#1d2327", "#008a63",
    "#b0508a", "#9a6b00", "#6b4fbb", "#3d8f9c", "#7a7a00", "#8a4b3c",
];
const DARK: [&str; STYLES] = [
    "#5ab4f0", "#ff8c42", "#86abe0", "#aea3cb", "#cf9caf", "#ea957c", "#ffffff", "#35c998",
    "#e79fca", "#f0b83a", "#b6a3f5", "#7fd3df", "#e0dc5a", "#d8a08f",
];
const DASHES: [&str; STYLES] = [
    "none",
    "9 4",
    "2 3.5",
    "12 3.5 2 3.5",
    "5.5 3",
    "7.5 2.5 2 2.5 2 2.5",
    "none",
    "9 4",
    "2 3.5",
    "12 3.5 2 3.5",
    "5.5 3",
    "16 4",
    "7.5 2.5 2 2.5 2 2.5",
    "1.5 2",
];
/// Colour of cells without contact. The colour of cells without contact is not in the colour scale and differs from the
/// hatching outside the joint.
const EMPTY: &str = "#c3c9ce";
/// Colour of the hatching outside the joint.
const HATCHING: &str = "#808a91";

/// Returns the style sheet of drawings in a page for light and dark displays.
pub fn style_sheet() -> String {
    let colours = |colours: &[&str]| -> String {
        let each = colours.iter().enumerate();
        each.map(|(k, colour)| format!("--s{k}:{colour};"))
            .collect()
    };
    let plain = "--ink:#1d2327;--grid:#dfe3e6;--axis:#808a91;--paper:#ffffff;";
    let night = "--ink:#e4e7ea;--grid:#343b41;--axis:#8b959c;--paper:#15191c;";
    format!(
        ":root{{color-scheme:light dark;{plain}{}}}\n@media (prefers-color-scheme:dark){{:root{{{night}{}}}}}\n\
         @media print{{:root{{{plain}{}}}}}\n{}",
        colours(&LIGHT),
        colours(&DARK),
        colours(&LIGHT),
        classes(|name| format!("var(--{name})"))
    )
}

/// Returns the CSS classes of drawings. The function `colour` returns the CSS colour of a class name.
fn classes(colour: impl Fn(&str) -> String) -> String {
    let styles: String = (0..STYLES)
        .map(|k| {
            let (colour, dash) = (colour(&format!("s{k}")), DASHES[k]);
            format!(
                ".s{k}{{stroke:{colour};stroke-dasharray:{dash};stroke-linejoin:round}}.c{k}{{fill:{colour}}}.b{k}{{stroke:{colour}}}\
                 circle.s{k}{{stroke-dasharray:none}}\n"
            )
        })
        .collect();
    let [ink, grid, axis] = ["ink", "grid", "axis"].map(colour);
    format!(
        "{styles}.cut{{stroke:#ffffff;stroke-dasharray:7 3.5;fill:none}}.empty{{fill:{EMPTY}}}.ink{{fill:{ink}}}.grid{{stroke:{grid}}}.axis{{stroke:{axis};fill:none}}.bar{{opacity:.55}}.band{{fill-opacity:.28}}\n"
    )
}

/// Drawing: the content of an SVG element.
#[derive(Debug, Clone)]
pub struct Drawing {
    /// Description for readers who cannot see the drawing.
    pub title: String,
    height: f64,
    body: Markup,
}

impl Drawing {
    /// Returns the drawing as a part of a page that has the report's style sheet. `id` must be unique in the page.
    pub fn inline(&self, id: &str) -> Markup {
        html! {
            svg viewBox={ "0 0 " (WIDTH) " " (two(self.height)) } role="img" aria-labelledby=(id) font-family="sans-serif" {
                title id=(id) { (escape_controls(&self.title)) }
                (self.body)
            }
        }
    }
}

/// Returns drawings as one SVG file on white, at most two per row.
pub fn standalone(title: &str, drawings: &[Drawing]) -> String {
    let columns = drawings.len().clamp(1, 2);
    let (mut top, mut parts) = (0.0, Vec::new());
    for row in drawings.chunks(columns) {
        for (column, drawing) in row.iter().enumerate() {
            let left = column as f64 * WIDTH;
            parts.push(html! {
                svg x=(left) y=(two(top)) width=(WIDTH) height=(two(drawing.height)) { (drawing.body) }
            });
        }
        top += row.iter().map(|d| d.height).fold(0.0, f64::max);
    }
    let (width, height) = (WIDTH * columns as f64, two(top));
    let paper = |name: &str| {
        let style = name.strip_prefix('s').and_then(|k| k.parse().ok());
        let colour = match name {
            "ink" => "#1d2327",
            "grid" => "#dfe3e6",
            _ => style.map_or("#808a91", |k: usize| LIGHT[k % STYLES]),
        };
        colour.to_owned()
    };
    let file = html! {
        svg xmlns="http://www.w3.org/2000/svg" width=(width) height=(height) viewBox={ "0 0 " (width) " " (height) } font-family="sans-serif" {
            title { (escape_controls(title)) }
            style { (PreEscaped(classes(paper))) }
            rect width="100%" height="100%" fill="#ffffff" {}
            @for part in &parts { (part) }
        }
    };
    file.into_string()
}

/// Estimates the width of a text, in units of the page.
fn text_width(text: &str) -> f64 {
    (text.chars().count() as f64 * LETTER * TEXT).ceil()
}

/// Rounds a coordinate to two decimals. Smaller differences are invisible.
fn two(value: f64) -> f64 {
    (100.0 * value).round() / 100.0
}

fn line(class: &str, width: f64, from: [f64; 2], to: [f64; 2]) -> Markup {
    let ([x1, y1], [x2, y2]) = (from.map(two), to.map(two));
    html! { line class=(class) stroke-width=(width) x1=(x1) y1=(y1) x2=(x2) y2=(y2) {} }
}

/// Draws a line through points.
fn polyline(class: &str, width: f64, points: &[[f64; 2]]) -> Markup {
    let each = points
        .iter()
        .map(|[x, y]| format!("{},{}", two(*x), two(*y)));
    let points = each.collect::<Vec<_>>().join(" ");
    html! { polyline class=(class) fill="none" stroke-width=(width) points=(points) {} }
}

fn rect(class: &str, place: [f64; 4]) -> Markup {
    let [x, y, width, height] = place.map(two);
    html! { rect class=(class) x=(x) y=(y) width=(width) height=(height) {} }
}

/// Draws a text. The vertical middle of the text and its `anchor` (`start`, `middle` or `end`) are at the position
/// `at`.
fn text(text: &str, at: [f64; 2], anchor: &str) -> Markup {
    let [x, y] = at.map(two);
    html! { text class="ink" x=(x) y=(y) dy=".35em" font-size=(TEXT) text-anchor=(anchor) { (escape_controls(text)) } }
}

/// Draws the heading of a drawing.
fn heading(text: &str) -> Markup {
    html! { text class="ink" x="8" y=(HEAD / 2.0) dy=".35em" font-size=(TEXT) font-weight="bold" { (escape_controls(text)) } }
}

/// Draws a text that runs upwards, centred at a position.
fn upwards(text: &str, at: [f64; 2]) -> Markup {
    let [x, y] = at.map(two);
    html! {
        text class="ink" x=(x) y=(y) dy=".35em" font-size=(TEXT) text-anchor="middle" transform={ "rotate(-90 " (x) " " (y) ")" } {
            (escape_controls(text))
        }
    }
}
