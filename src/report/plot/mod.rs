//! Drawings as SVG: curves and maps.
//!
//! Nothing in a drawing has a colour of its own: strokes and fills are classes, so that the page around it gives them colours for
//! light and dark, and [`Drawing::standalone`] those of paper.

mod axis;
mod chart;
mod map;

use maud::{Markup, PreEscaped, html};

pub use axis::Axis;
pub use chart::{BEFORE_ZERO, Band, Chart, Curve, LONGEST_BAR, Mark};
pub use map::{Map, NOTHING, Scale};

use super::text::visible;

/// Styles of curves: states of wear, then runs.
const STYLES: usize = RUNS + 8;
/// The style of the unworn joint, in every drawing.
pub const UNWORN: usize = 0;
/// The style of the joint as it is worn in the end.
pub const WORN: usize = 1;
/// The styles of states between them begin here, in the order of wear.
const BETWEEN: usize = 2;
/// Those of runs begin here; after the last they begin again.
const RUNS: usize = 6;

/// The style of a run among several, or of the only one where no state of wear is meant.
pub fn style_of_run(place: usize) -> usize {
    RUNS + place % (STYLES - RUNS)
}

/// The style of a state of wear among some in the order of wear, of which the first is the unworn one.
pub fn style_of_state(place: usize, states: usize) -> usize {
    let between = RUNS - BETWEEN;
    match place {
        0 => UNWORN,
        place if place + 1 >= states => WORN,
        // Evenly between the two, whether there are many or one.
        place => BETWEEN + (place * (between + 1) / (states - 1)).clamp(1, between) - 1,
    }
}

/// Width of a drawing, in units of the page.
pub const WIDTH: f64 = 480.0;
/// Height of the heading.
const HEAD: f64 = 26.0;
/// Size of its text.
const TEXT: f64 = 14.0;
/// Mean width of a letter of it, about.
const LETTER: f64 = 0.54;

/// Blue and vermilion of Okabe and Ito for unworn and worn, steps from one to the other between them, and for runs colours that
/// are neither; darker or lighter where the background wants it, with dashes for who cannot tell them apart.
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
/// Cells without contact: of no colour of the scale, and not the hatching of what is no part of the joint.
const EMPTY: &str = "#c3c9ce";
/// The lines of that hatching.
const HATCHING: &str = "#808a91";

/// The style sheet of drawings in a page that is light or dark.
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

/// The classes of drawings, with what gives a name its colour.
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

/// A drawing: what stands between the tags of an SVG.
#[derive(Debug, Clone)]
pub struct Drawing {
    /// What it shows, for who cannot see it.
    pub title: String,
    height: f64,
    body: Markup,
}

impl Drawing {
    /// The drawing as a part of a page that has the report's style sheet; `id` is its own in the page.
    pub fn inline(&self, id: &str) -> Markup {
        html! {
            svg viewBox={ "0 0 " (WIDTH) " " (two(self.height)) } role="img" aria-labelledby=(id) font-family="sans-serif" {
                title id=(id) { (visible(&self.title)) }
                (self.body)
            }
        }
    }
}

/// Drawings beside and below each other as a file of their own, on white; two in a row at most.
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
            title { (visible(title)) }
            style { (PreEscaped(classes(paper))) }
            rect width="100%" height="100%" fill="#ffffff" {}
            @for part in &parts { (part) }
        }
    };
    file.into_string()
}

/// Width of a text in units of the page, about.
fn text_width(text: &str) -> f64 {
    (text.chars().count() as f64 * LETTER * TEXT).ceil()
}

/// A coordinate: a hundredth of a unit is not seen.
fn two(value: f64) -> f64 {
    (100.0 * value).round() / 100.0
}

fn line(class: &str, width: f64, from: [f64; 2], to: [f64; 2]) -> Markup {
    let ([x1, y1], [x2, y2]) = (from.map(two), to.map(two));
    html! { line class=(class) stroke-width=(width) x1=(x1) y1=(y1) x2=(x2) y2=(y2) {} }
}

/// A line through points.
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

/// A text whose middle line is at a height: `start`, `middle` or `end` of it is at the place.
fn text(text: &str, at: [f64; 2], anchor: &str) -> Markup {
    let [x, y] = at.map(two);
    html! { text class="ink" x=(x) y=(y) dy=".35em" font-size=(TEXT) text-anchor=(anchor) { (visible(text)) } }
}

/// The heading of a drawing.
fn heading(text: &str) -> Markup {
    html! { text class="ink" x="8" y=(HEAD / 2.0) dy=".35em" font-size=(TEXT) font-weight="bold" { (visible(text)) } }
}

/// A text that runs upwards, with its middle at a place.
fn upwards(text: &str, at: [f64; 2]) -> Markup {
    let [x, y] = at.map(two);
    html! {
        text class="ink" x=(x) y=(y) dy=".35em" font-size=(TEXT) text-anchor="middle" transform={ "rotate(-90 " (x) " " (y) ")" } {
            (visible(text))
        }
    }
}
