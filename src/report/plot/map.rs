//! Values of the cells of a rectangle, as colours.

use std::ops::Range;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

use super::chart::{Curve, TICK, heading, text_style, tick};
use super::{AXIS, CUT, Drawing, EMPTY, FINE, HATCHING, PlotError, TEXT, WIDTH, said, text_width};

/// How values become colours.
#[derive(Debug, Clone)]
pub enum Scale {
    /// From the first to the second, with the quantity and unit beside the bar.
    Continuous {
        /// Values at the ends of the bar; what is beyond has the colour of the end.
        range: [f64; 2],
        /// True for even steps of the logarithm.
        log: bool,
        /// Quantity and unit.
        label: String,
    },
    /// Values 0, 1, … are the names, in the colours of the curves' styles.
    Classes(Vec<String>),
}

/// The value of a cell of the joint that has none: no contact.
pub const NOTHING: f64 = f64::NEG_INFINITY;

/// A field over a rectangle.
#[derive(Debug, Clone)]
pub struct Map {
    /// Heading.
    pub title: String,
    /// Cells along x and y.
    pub cells: [usize; 2],
    /// One value a cell, x slowest; NaN where a cell is no part of the joint, [`NOTHING`] where there is nothing to show.
    pub values: Vec<f64>,
    /// Extent along x and y \[mm\].
    pub size: [f64; 2],
    /// The colours.
    pub scale: Scale,
    /// What a cell with [`NOTHING`] is called.
    pub nothing: &'static str,
    /// What is drawn over it, in mm.
    pub curves: Vec<Curve>,
}

/// Side of the largest map, in units of the page.
const SIDE: i32 = 320;
const HEAD: i32 = 36;
const LEFT: i32 = 58;
/// Nothing is drawn this near to the edge.
const EDGE: i32 = 4;
const BOTTOM: i32 = 46;
/// Height of the line that says what hatching and grey are.
const KEY: i32 = 28;
/// Side of its squares.
const SQUARE: i32 = 14;
/// Distance of the lines of the hatching, and side of its picture, in dots.
const HATCH: [usize; 2] = [6, 192];
/// Width of the colour bar.
const BAR: i32 = 16;
/// Colours of a map; after them the palette has what is nothing, and what is no part of the joint.
const COLOURS: usize = 200;
/// Cells along a side of the picture at most: more are not seen.
const FINEST: usize = 256;

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

impl Map {
    /// The map as a drawing.
    ///
    /// # Errors
    /// [`PlotError`] if the drawing library fails.
    pub fn draw(&self) -> Result<Drawing, PlotError> {
        let [width, height] = self.pixels();
        let keys = self.keys();
        let key = if keys.is_empty() { 0 } else { KEY };
        let total = (HEAD + height + BOTTOM + key + 8) * FINE;
        let size = ((WIDTH * FINE) as u32, total as u32);
        let mut svg = String::new();
        let (x, y) = (LEFT * FINE, HEAD * FINE);
        let place = [x, y, width * FINE, height * FINE];
        let mut pictures = String::new();
        {
            let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            heading(&area, &self.title)?;
            self.axes(&area, place)?;
            match &self.scale {
                Scale::Continuous { range, log, label } => {
                    let [low, high] = *range;
                    let said = |value: &f64| tick(*value, *range, *log);
                    match log {
                        true => bar_axis(&area, place, (low..high).log_scale(), label, &said)?,
                        false => bar_axis(&area, place, low..high, label, &said)?,
                    }
                }
                Scale::Classes(names) => {
                    for (k, name) in names.iter().enumerate() {
                        let (x, y) = (x + place[2] + 16 * FINE, y + k as i32 * 24 * FINE);
                        pictures += &square([x, y], CLASSES[k % CLASSES.len()]);
                        word(&area, name, [x, y])?;
                    }
                }
            }
            let top = y + place[3] + (BOTTOM + 5) * FINE;
            let mut left = x;
            for (class, name) in keys {
                if class.is_empty() {
                    let side = SQUARE * FINE;
                    pictures += &picture(
                        "hatch",
                        &hatching(SQUARE as usize * 2)?,
                        [left, top, side, side],
                    );
                } else {
                    pictures += &square([left, top], class);
                }
                word(&area, name, [left, top])?;
                left += (SQUARE + 6 + text_width(name) + 22) * FINE;
            }
            area.present().map_err(said)?;
        }
        // Cells that are no part of the joint let it through.
        if self.values.iter().any(|value| value.is_nan()) {
            pictures += &picture("hatch", &hatching(HATCH[1])?, place);
        }
        let mut drawn = match &self.scale {
            Scale::Continuous { .. } => {
                let [x, y, w, h] = place;
                let bar = [x + w + 18 * FINE, y, BAR * FINE, h];
                picture("field", &self.picture()?, place)
                    + &picture("colours", &bar_picture()?, bar)
            }
            Scale::Classes(_) => self.squares(place),
        };
        drawn.insert_str(0, &pictures);
        // Below the axes and what is drawn over the map.
        let body = match svg.find('>') {
            Some(at) => format!("{}{drawn}{}", &svg[..=at], &svg[at + 1..]),
            None => svg,
        };
        let drawing = Drawing::of(&self.title, size, &body);
        Ok(match &self.scale {
            Scale::Classes(_) => drawing,
            Scale::Continuous {
                range: [low, high],
                log,
                label,
            } => {
                let [x, y, w, h] = place;
                let (kind, [wide, high_up]) = (if *log { "log" } else { "lin" }, self.size);
                drawing
                    .with_data("map", &format!("{x} {y} {w} {h} {wide} {high_up}"))
                    .with_data("scale", &format!("{low} {high} {kind} {label}"))
                    .with_data("nothing", self.nothing)
            }
        })
    }

    /// Class and name of what the colours do not tell: hatching has no class.
    fn keys(&self) -> Vec<(&'static str, &str)> {
        let mut keys = Vec::new();
        if self.values.contains(&NOTHING) {
            keys.push(("empty", self.nothing));
        }
        if self.values.iter().any(|value| value.is_nan()) {
            keys.push(("", "hole"));
        }
        keys
    }

    /// Width and height of the map itself, in units of the page.
    fn pixels(&self) -> [i32; 2] {
        let longer = self.size[0].max(self.size[1]);
        self.size
            .map(|side| ((f64::from(SIDE) * side / longer).round() as i32).max(20))
    }

    fn axes(&self, area: &Area, place: [i32; 4]) -> Result<(), PlotError> {
        let [x, y, width, height] = place;
        let plot = area.clone().shrink(
            (x - (LEFT - EDGE) * FINE, y),
            (
                (width + (LEFT - EDGE) * FINE) as u32,
                (height + BOTTOM * FINE) as u32,
            ),
        );
        let mut chart = ChartBuilder::on(&plot)
            .x_label_area_size(BOTTOM * FINE)
            .y_label_area_size((LEFT - EDGE) * FINE)
            .build_cartesian_2d(0.0..self.size[0], 0.0..self.size[1])
            .map_err(said)?;
        chart
            .configure_mesh()
            .disable_mesh()
            .set_all_tick_mark_size(TICK * FINE)
            .axis_style(AXIS.stroke_width(FINE as u32))
            .x_labels(5)
            .y_labels(5)
            .x_desc("x / mm")
            .y_desc("y / mm")
            .x_label_formatter(&|value| tick(*value, [0.0, self.size[0]], false))
            .y_label_formatter(&|value| tick(*value, [0.0, self.size[1]], false))
            .label_style(text_style(TEXT))
            .draw()
            .map_err(said)?;
        for curve in &self.curves {
            let line = curve
                .points
                .iter()
                .map(|[x, y]| (*x, *y))
                .collect::<Vec<_>>();
            let style = CUT.stroke_width(2 * FINE as u32);
            chart
                .draw_series([PathElement::new(line, style)])
                .map_err(said)?;
        }
        Ok(())
    }

    /// The cells as rectangles, in the colours of the classes.
    fn squares(&self, [x, y, width, height]: [i32; 4]) -> String {
        let [nx, ny] = self.cells;
        let edge = |cell: usize, cells: usize, length: i32| cell as i32 * length / cells as i32;
        let mut squares = String::new();
        for i in 0..nx {
            for j in 0..ny {
                let value = self.values[i * ny + j];
                if !value.is_finite() {
                    continue;
                }
                let class = CLASSES[value as usize % CLASSES.len()];
                let (left, right) = (edge(i, nx, width), edge(i + 1, nx, width));
                // The picture's lines go down, the joint's y goes up.
                let (low, high) = (edge(j, ny, height), edge(j + 1, ny, height));
                squares += &format!(
                    "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" class=\"{class}\" shape-rendering=\"crispEdges\"/>",
                    x + left,
                    y + height - high,
                    right - left,
                    high - low
                );
            }
        }
        squares
    }

    /// The field as a picture, means over blocks where it has more cells than are seen.
    fn picture(&self) -> Result<Vec<u8>, PlotError> {
        let Scale::Continuous { range, log, .. } = self.scale else {
            return Err(said("classes are no picture"));
        };
        let counts = self.cells.map(|cells| cells.min(FINEST));
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
                        } else if value == NOTHING {
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

/// Classes of the states of a contact element: sticks, slips partly, slips, is open.
const CLASSES: [&str; 4] = ["c7", "c9", "c8", "empty"];

/// A square of a legend.
fn square([x, y]: [i32; 2], class: &str) -> String {
    let side = SQUARE * FINE;
    format!("<rect x=\"{x}\" y=\"{y}\" width=\"{side}\" height=\"{side}\" class=\"{class}\"/>")
}

/// What stands beside it.
fn word(area: &Area, name: &str, [x, y]: [i32; 2]) -> Result<(), PlotError> {
    let at = (x + (SQUARE + 6) * FINE, y);
    area.draw(&Text::new(name.to_owned(), at, text_style(TEXT)))
        .map_err(said)
}

/// Slanted lines on nothing, in a square of so many dots a side.
fn hatching(side: usize) -> Result<Vec<u8>, PlotError> {
    let line = |k: usize| (k % side + k / side) % HATCH[0] < 2;
    let pixels: Vec<u8> = (0..side * side)
        .map(|k| {
            if line(k) {
                COLOURS as u8
            } else {
                COLOURS as u8 + 1
            }
        })
        .collect();
    png([side as u32; 2], &pixels, HATCHING)
}

/// The numbers beside the colour bar.
fn bar_axis<Y>(
    area: &Area,
    [x, y, width, height]: [i32; 4],
    range: Y,
    label: &str,
    tick: &dyn Fn(&f64) -> String,
) -> Result<(), PlotError>
where
    Y: AsRangedCoord<Value = f64>,
    Y::CoordDescType: ValueFormatter<f64>,
{
    let left = x + width + 18 * FINE;
    let room = WIDTH * FINE - left;
    let part = area.clone().shrink((left, y), (room as u32, height as u32));
    let mut chart = ChartBuilder::on(&part)
        .right_y_label_area_size(room - BAR * FINE)
        .build_cartesian_2d(0.0..1.0, range)
        .map_err(said)?;
    chart
        .configure_mesh()
        .disable_mesh()
        .disable_x_axis()
        .set_all_tick_mark_size(TICK * FINE)
        .axis_style(AXIS.stroke_width(FINE as u32))
        .y_labels(6)
        .y_label_formatter(&tick)
        .label_style(text_style(TEXT))
        .draw()
        .map_err(said)?;
    let width = text_width(label) * FINE;
    let right = (WIDTH * FINE - width - 4 * FINE).max(0);
    let text = Text::new(
        label.to_owned(),
        (right.min(left), y + height + (BOTTOM - 20) * FINE),
        text_style(TEXT),
    );
    area.draw(&text).map_err(said)
}

fn bar_picture() -> Result<Vec<u8>, PlotError> {
    let pixels: Vec<u8> = (0..COLOURS).rev().map(|k| k as u8).collect();
    png([1, COLOURS as u32], &pixels, EMPTY)
}

/// Viridis, of even steps to the eye and legible without colour; then a grey, and nothing.
fn png(size: [u32; 2], pixels: &[u8], grey: &str) -> Result<Vec<u8>, PlotError> {
    let channel = |k: usize| u8::from_str_radix(&grey[1 + 2 * k..3 + 2 * k], 16).unwrap_or(128);
    let grey: [u8; 3] = std::array::from_fn(channel);
    let palette: Vec<u8> = (0..COLOURS)
        .flat_map(|k| {
            let part = k as f64 / (COLOURS - 1) as f64;
            let RGBColor(r, g, b) = ViridisRGB.get_color(part);
            [r, g, b]
        })
        .chain(grey)
        .chain([0, 0, 0])
        .collect();
    let mut opacity = vec![255; COLOURS + 1];
    opacity.push(0);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette);
    encoder.set_trns(opacity);
    encoder.set_compression(png::Compression::High);
    encoder.set_filter(png::Filter::NoFilter);
    let mut writer = encoder.write_header().map_err(said)?;
    writer.write_image_data(pixels).map_err(said)?;
    writer.finish().map_err(said)?;
    Ok(bytes)
}

fn picture(class: &str, png: &[u8], [x, y, width, height]: [i32; 4]) -> String {
    // Cells have edges; the lines of the hatching are slanted.
    let rendering = match class {
        "hatch" => "auto",
        _ => "pixelated",
    };
    format!(
        "<image class=\"{class}\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" preserveAspectRatio=\"none\" \
         style=\"image-rendering:{rendering}\" href=\"data:image/png;base64,{}\"/>",
        STANDARD.encode(png)
    )
}
