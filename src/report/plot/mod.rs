//! Drawings as SVG: curves and maps.
//!
//! Nothing in a drawing has a colour of its own: strokes and fills are classes, so that the page around it gives them colours for
//! light and dark, and [`Drawing::standalone`] those of paper.

mod chart;
mod map;

use plotters::style::RGBColor;

pub use chart::{Axis, BEFORE_ZERO, Chart, Curve, LONGEST_BAR, Mark};
pub use map::{Map, NOTHING, Scale};

use super::html::escaped;
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

/// Units of a drawing to one of the page: the drawing library places things at whole units.
const FINE: i32 = 4;
/// Width of a drawing, in units of the page.
pub const WIDTH: i32 = 480;
/// Size of its text.
const TEXT: i32 = 14;
/// Mean width of a letter of it, about.
const LETTER: f64 = 0.54;

/// What the drawing library is given in place of a colour: the class that takes its place.
const fn class(group: u8, number: u8) -> RGBColor {
    RGBColor(1, group, number)
}

const TEXT_COLOUR: RGBColor = class(1, 0);
const GRID: RGBColor = class(2, 0);
const AXIS: RGBColor = class(3, 0);

/// The error bars of a style of curve.
fn bar_colour(style: usize) -> RGBColor {
    class(4, (style % STYLES) as u8)
}

/// What is drawn over a map.
const CUT: RGBColor = class(5, 0);

/// The colour of a style of curve.
fn style_colour(style: usize) -> RGBColor {
    class(0, (style % STYLES) as u8)
}

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
    "36 16",
    "8 14",
    "48 14 8 14",
    "22 12",
    "30 10 8 10 8 10",
    "none",
    "36 16",
    "8 14",
    "48 14 8 14",
    "22 12",
    "64 16",
    "30 10 8 10 8 10",
    "6 8",
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
        "{styles}.cut{{stroke:#ffffff;stroke-dasharray:28 14;fill:none}}.empty{{fill:{EMPTY}}}.ink{{fill:{ink}}}.grid{{stroke:{grid}}}.axis{{stroke:{axis};fill:none}}.bar{{opacity:.55}}\n"
    )
}

/// A drawing: what stands between the tags of an SVG.
#[derive(Debug, Clone)]
pub struct Drawing {
    /// What it shows, for who cannot see it.
    pub title: String,
    size: (u32, u32),
    body: String,
    /// Attributes that say which values its places have.
    data: String,
}

/// A drawing that could not be made.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{0}")]
pub struct PlotError(String);

fn said(error: impl std::fmt::Display) -> PlotError {
    PlotError(error.to_string())
}

impl Drawing {
    /// Takes what the drawing library wrote, and puts classes in the place of its colours.
    fn of(title: &str, size: (u32, u32), svg: &str) -> Drawing {
        let begin = svg.find('>').map_or(0, |at| at + 1);
        let end = svg.rfind("</svg>").unwrap_or(svg.len());
        // The drawing library escapes labels, but for what XML does not allow at all.
        let mut body = visible(&svg[begin..end])
            .replace(" opacity=\"1\"", "")
            .replace(" font-family=\"sans-serif\"", "")
            .replace(">\n", ">")
            .replace("\n</text>", "</text>");
        let mut replace = |colour: RGBColor, stroke: &str, fill: &str| {
            let RGBColor(r, g, b) = colour;
            let colour = format!("#{r:02X}{g:02X}{b:02X}");
            for (attribute, class) in [("stroke", stroke), ("fill", fill)] {
                let attribute = format!("{attribute}=\"{colour}\"");
                body = body.replace(&attribute, &format!("class=\"{class}\""));
            }
        };
        for k in 0..STYLES {
            replace(style_colour(k), &format!("s{k}"), &format!("c{k}"));
            replace(bar_colour(k), &format!("bar b{k}"), "bar");
        }
        replace(TEXT_COLOUR, "axis", "ink");
        replace(GRID, "grid", "grid");
        replace(AXIS, "axis", "axis");
        replace(CUT, "cut", "cut");
        Drawing {
            title: title.to_owned(),
            size,
            body,
            data: String::new(),
        }
    }

    /// With an attribute for who points at the drawing.
    fn with_data(mut self, name: &str, value: &str) -> Drawing {
        self.data += &format!(" data-{name}=\"{}\"", escaped(value));
        self
    }

    /// The drawing as a part of a page that has the report's style sheet; `id` is its own in the page.
    pub fn inline(&self, id: &str) -> String {
        let (width, height) = self.size;
        let title = escaped(&self.title);
        format!(
            "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-labelledby=\"{id}\" font-family=\"sans-serif\"{}>\
             <title id=\"{id}\">{title}</title>{}</svg>",
            self.data, self.body
        )
    }
}

/// Drawings beside and below each other as a file of their own, on white; two in a row at most.
pub fn standalone(title: &str, drawings: &[Drawing]) -> String {
    let columns = drawings.len().min(2);
    let (mut top, mut parts) = (0, String::new());
    for row in drawings.chunks(columns.max(1)) {
        let mut left = 0;
        for drawing in row {
            let (width, height) = drawing.size;
            parts += &format!(
                "<svg x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\">{}</svg>\n",
                drawing.body
            );
            left += WIDTH * FINE;
        }
        top += row.iter().map(|d| d.size.1).max().unwrap_or(0) as i32;
    }
    let width = WIDTH * FINE * columns as i32;
    let paper = |name: &str| {
        let style = name.strip_prefix('s').and_then(|k| k.parse().ok());
        let colour = match name {
            "ink" => "#1d2327",
            "grid" => "#dfe3e6",
            _ => style.map_or("#808a91", |k: usize| LIGHT[k % STYLES]),
        };
        colour.to_owned()
    };
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" viewBox=\"0 0 {width} {top}\" font-family=\"sans-serif\">\n\
         <title>{}</title>\n<style>{}</style>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{parts}</svg>\n",
        width / FINE,
        top / FINE,
        escaped(title),
        classes(paper)
    )
}

/// Width of a text in units of the page, about.
fn text_width(text: &str) -> i32 {
    (text.chars().count() as f64 * LETTER * TEXT as f64).ceil() as i32
}
