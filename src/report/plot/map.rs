//! Maps: values of the cells of a rectangle as colours.

use std::ops::Range;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

use super::super::text::escape_controls;
use super::axis::{Axis, PlacedAxis};
use super::chart::Curve;
use super::{
    Drawing, EMPTY, HATCHING, TEXT, WIDTH, heading, polyline, rect, text, text_width, two, upwards,
};

/// Colour scale of a map.
#[derive(Debug, Clone)]
pub enum Scale {
    /// Continuous scale with a colour bar.
    Continuous {
        /// Values at the ends of the bar. Values beyond have the colour of the end.
        range: [f64; 2],
        /// True for a logarithmic scale.
        log: bool,
        /// Label of the bar: quantity and unit.
        label: String,
    },
    /// Names of the values 0, 1, …
    Classes(Vec<String>),
}

/// Value of a cell of the joint without data, for example without contact.
pub const NO_DATA: f64 = f64::NEG_INFINITY;

/// Map of a field over a rectangle.
#[derive(Debug, Clone)]
pub struct Map {
    /// Heading.
    pub title: String,
    /// Cells along x and y.
    pub cells: [usize; 2],
    /// One value per cell, x slowest. A cell outside the joint is NaN, a cell without data is [`NO_DATA`].
    pub values: Vec<f64>,
    /// Extent along x and y \[mm\].
    pub size: [f64; 2],
    /// Colour scale.
    pub scale: Scale,
    /// Name of a cell with [`NO_DATA`].
    pub nothing: &'static str,
    /// Curves drawn over the map \[mm\].
    pub curves: Vec<Curve>,
}

/// Side of the largest map, in units of the page.
const SIDE: f64 = 320.0;
const TOP: f64 = 36.0;
const LEFT: f64 = 58.0;
const BOTTOM: f64 = 46.0;
/// Height of the legend of hatching and grey.
const KEY: f64 = 28.0;
/// Side of the squares of the legend.
const SQUARE: f64 = 14.0;
/// Distance of the lines of the hatching, and side of its picture, in pixels.
const HATCH: [usize; 2] = [6, 192];
/// Width of the colour bar, and its distance from the map.
const BAR: [f64; 2] = [16.0, 18.0];
/// Number of colours of the scale. The palette continues with the colours of [`NO_DATA`] and of cells outside the
/// joint.
const COLOURS: usize = 200;
/// Maximum number of cells along a side of the picture. More cells would be invisible.
const FINEST: usize = 256;

impl Map {
    /// Draws the map.
    pub fn draw(&self) -> Drawing {
        self.draw_in(FINEST)
    }

    /// Draws the map with at most `finest` cells along a side of its picture.
    pub fn draw_in(&self, finest: usize) -> Drawing {
        let [width, height] = self.sides();
        let place = [LEFT, TOP, width, height];
        let [right, bottom] = [LEFT + width, TOP + height];
        let axis = |label: &str| Axis {
            label: label.to_owned(),
            ..Axis::default()
        };
        let [along_x, along_y] = ["x / mm", "y / mm"].map(axis);
        let x = PlacedAxis::new(&along_x, [LEFT, right], [0.0, self.size[0]]);
        let y = PlacedAxis::new(&along_y, [bottom, TOP], [0.0, self.size[1]]);
        let keys = self.legend();
        let body = html! {
            (heading(&self.title))
            (x.draw(false, [bottom, TOP]))
            (y.draw(true, [LEFT, right]))
            (text("x / mm", [LEFT + width / 2.0, bottom + BOTTOM - 0.7 * TEXT], "middle"))
            (upwards("y / mm", [0.8 * TEXT, TOP + height / 2.0]))
            // The hatching is visible through cells outside the joint.
            @if self.values.iter().any(|value| value.is_nan()) {
                (picture("hatch", &hatching(HATCH[1]), place))
            }
            @match &self.scale {
                Scale::Continuous { range, log, label } => (self.field(place, *range, *log, label, finest)),
                Scale::Classes(names) => {
                    (self.squares(place))
                    @for (k, name) in names.iter().enumerate() {
                        (legend_entry(CLASSES[k % CLASSES.len()], name, [right + 16.0, TOP + 24.0 * k as f64]))
                    }
                }
            }
            @for curve in &self.curves {
                @let points: Vec<[f64; 2]> = curve.points.iter().map(|[px, py]| [x.position(*px), y.position(*py)]).collect();
                (polyline("cut", 2.0, &points))
            }
            @for (class, name, left) in &keys { (legend_entry(class, name, [*left, bottom + BOTTOM + 5.0])) }
        };
        let key = if keys.is_empty() { 0.0 } else { KEY };
        Drawing {
            title: self.title.clone(),
            height: TOP + height + BOTTOM + key + 8.0,
            body,
        }
    }

    /// Draws the values as colours, and the colour bar.
    fn field(
        &self,
        place: [f64; 4],
        range: [f64; 2],
        log: bool,
        label: &str,
        finest: usize,
    ) -> Markup {
        let [x, y, width, height] = place;
        let axis = Axis {
            label: label.to_owned(),
            log,
            ..Axis::default()
        };
        let scale = PlacedAxis::new(&axis, [y + height, y], range);
        let bar = x + width + BAR[1];
        let end = bar + BAR[0];
        let left = bar.min(WIDTH - text_width(label) - 4.0).max(0.0);
        let map = place.map(two).map(|c| c.to_string()).join(" ");
        let map = format!("{map} {} {}", self.size[0], self.size[1]);
        html! {
            g class="map" data-map=(map) data-scale=(escape_controls(&scale.data())) data-nothing=(self.nothing) {
                (picture("field", &self.picture(range, log, finest), place))
                (picture("colours", &colours(), [bar, y, BAR[0], height]))
            }
            (scale.draw(true, [end, bar]))
            (text(label, [left, y + height + BOTTOM - 14.0], "start"))
        }
    }

    /// Returns the class, name and left edge of each entry of the legend.
    fn legend(&self) -> Vec<(&'static str, &str, f64)> {
        let is_nothing = self.values.contains(&NO_DATA);
        let has_hole = self.values.iter().any(|value| value.is_nan());
        let entries = [
            ("empty", self.nothing, is_nothing),
            ("hatch", "hole", has_hole),
        ];
        let mut left = LEFT;
        let mut keys = Vec::new();
        for (class, name, _) in entries.into_iter().filter(|(.., is_used)| *is_used) {
            keys.push((class, name, left));
            left += SQUARE + 6.0 + text_width(name) + 22.0;
        }
        keys
    }

    /// Returns the width and height of the map itself, in units of the page.
    fn sides(&self) -> [f64; 2] {
        let longer = self.size[0].max(self.size[1]);
        self.size
            .map(|side| (SIDE * side / longer).round().max(20.0))
    }

    /// Draws the cells as rectangles, in the colours of the classes.
    fn squares(&self, [x, y, width, height]: [f64; 4]) -> Markup {
        let [nx, ny] = self.cells;
        let [w, h] = [width / nx as f64, height / ny as f64];
        let cells = (0..nx * ny).map(|cell| (cell / ny, cell % ny, self.values[cell]));
        html! {
            g shape-rendering="crispEdges" {
                // y of the joint points up, y of the SVG down.
                @for (i, j, value) in cells.filter(|(.., value)| value.is_finite()) {
                    (rect(CLASSES[value as usize % CLASSES.len()], [x + i as f64 * w, y + height - (j + 1) as f64 * h, w, h]))
                }
            }
        }
    }

    /// Encodes the field as a PNG picture. If the field has more cells than `finest`, a pixel is the mean over a block.
    fn picture(&self, range: [f64; 2], log: bool, finest: usize) -> Vec<u8> {
        let counts = self.cells.map(|cells| cells.min(finest));
        let block = |k: usize, d: usize| -> Range<usize> {
            k * self.cells[d] / counts[d]..(k + 1) * self.cells[d] / counts[d]
        };
        let mut pixels = Vec::with_capacity(counts[0] * counts[1]);
        for row in (0..counts[1]).rev() {
            for column in 0..counts[0] {
                let (mut sum, mut count, mut empty) = (0.0, 0, 0);
                for i in block(column, 0) {
                    for j in block(row, 1) {
                        let value = self.values[i * self.cells[1] + j];
                        if value.is_finite() {
                            (sum, count) = (sum + value, count + 1);
                        } else if value == NO_DATA {
                            empty += 1;
                        }
                    }
                }
                let scaled = |value: f64| if log { value.max(range[0]).ln() } else { value };
                let [low, high] = range.map(scaled);
                let part = (scaled(sum / f64::from(count)) - low) / (high - low);
                pixels.push(match count {
                    0 if empty > 0 => COLOURS as u8,
                    0 => COLOURS as u8 + 1,
                    _ => (part.clamp(0.0, 1.0) * (COLOURS - 1) as f64).round() as u8,
                });
            }
        }
        png([counts[0] as u32, counts[1] as u32], &pixels, EMPTY)
    }
}

/// CSS class of each state of a contact element, in the order stick, partial slip, slip, open.
const CLASSES: [&str; 4] = ["c7", "c9", "c8", "empty"];

/// Draws an entry of a legend: a square and its name.
fn legend_entry(class: &str, name: &str, [x, y]: [f64; 2]) -> Markup {
    let place = [x, y, SQUARE, SQUARE];
    html! {
        @if class == "hatch" { (picture(class, &hatching(SQUARE as usize * 2), place)) } @else { (rect(class, place)) }
        (text(name, [x + SQUARE + 6.0, y + SQUARE / 2.0], "start"))
    }
}

/// Encodes slanted lines on a transparent square as a PNG picture. `side` is in pixels.
fn hatching(side: usize) -> Vec<u8> {
    let line = |k: usize| (k % side + k / side) % HATCH[0] < 2;
    let colour = |k: usize| COLOURS as u8 + u8::from(!line(k));
    let pixels: Vec<u8> = (0..side * side).map(colour).collect();
    png([side as u32; 2], &pixels, HATCHING)
}

/// Encodes the colour bar as a PNG picture, the largest value on top.
fn colours() -> Vec<u8> {
    let pixels: Vec<u8> = (0..COLOURS as u8).rev().collect();
    png([1, COLOURS as u32], &pixels, EMPTY)
}

/// Encodes a PNG picture. The palette contains the colours of Viridis, then a grey, then a transparent colour. Viridis
/// is perceptually uniform and legible without colour.
fn png(size: [u32; 2], pixels: &[u8], grey: &str) -> Vec<u8> {
    let channel = |k: usize| u8::from_str_radix(&grey[1 + 2 * k..3 + 2 * k], 16).unwrap_or(128);
    let grey: [u8; 3] = std::array::from_fn(channel);
    let viridis = |k: usize| colorous::VIRIDIS.eval_rational(k, COLOURS).as_array();
    let palette = (0..COLOURS).flat_map(viridis).chain(grey).chain([0; 3]);
    let mut opacity = vec![255; COLOURS + 1];
    opacity.push(0);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette.collect::<Vec<u8>>());
    encoder.set_trns(opacity);
    encoder.set_compression(png::Compression::High);
    encoder.set_filter(png::Filter::NoFilter);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(pixels)?;
        writer.finish()
    });
    written.expect("a picture of this size, in memory");
    bytes
}

fn picture(class: &str, png: &[u8], place: [f64; 4]) -> Markup {
    // Cells have sharp edges. The lines of the hatching are slanted.
    let rendering = if class == "hatch" {
        "auto"
    } else {
        "pixelated"
    };
    let [x, y, width, height] = place.map(two);
    html! {
        image class=(class) x=(x) y=(y) width=(width) height=(height) preserveAspectRatio="none"
            style={ "image-rendering:" (rendering) } href={ "data:image/png;base64," (STANDARD.encode(png)) } {}
    }
}
