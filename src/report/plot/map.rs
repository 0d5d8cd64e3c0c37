//! Values of the cells of a rectangle, as colours.

use std::ops::Range;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use plotters::prelude::*;

use super::chart::{Curve, heading, text_style, tick};
use super::{
    AXIS, Drawing, FINE, PlotError, TEXT, TEXT_COLOUR, WIDTH, said, style_colour, text_width,
};

/// How values become colours.
#[derive(Debug, Clone)]
pub enum Scale {
    /// From the first to the second, with the quantity and unit beside the bar.
    Continuous {
        /// Values at the ends of the bar; what is beyond has the colour of the end.
        range: [f64; 2],
        /// Quantity and unit.
        label: String,
    },
    /// Values 0, 1, … are the names, in the colours of the curves' styles.
    Classes(Vec<String>),
}

/// A field over a rectangle.
#[derive(Debug, Clone)]
pub struct Map {
    /// Heading.
    pub title: String,
    /// Cells along x and y.
    pub cells: [usize; 2],
    /// One value a cell, x slowest; NaN where there is nothing to show.
    pub values: Vec<f64>,
    /// Extent along x and y \[mm\].
    pub size: [f64; 2],
    /// The colours.
    pub scale: Scale,
    /// What is drawn over it, in mm.
    pub curves: Vec<Curve>,
}

/// Side of the largest map, in units of the page.
const SIDE: i32 = 320;
const HEAD: i32 = 26;
const LEFT: i32 = 54;
const BOTTOM: i32 = 46;
/// Width of the colour bar.
const BAR: i32 = 16;
/// Colours of a map; the last entry of the palette is for nothing.
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
        let total = (HEAD + height + BOTTOM + 8) * FINE;
        let size = ((WIDTH * FINE) as u32, total as u32);
        let mut svg = String::new();
        let place;
        {
            let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            heading(&area, &self.title)?;
            let (x, y) = (LEFT * FINE, HEAD * FINE);
            place = [x, y, width * FINE, height * FINE];
            self.axes(&area, place)?;
            match &self.scale {
                Scale::Continuous { range, label } => {
                    bar_axis(&area, place, *range, label)?;
                }
                Scale::Classes(names) => {
                    let style = |k: usize| style_colour(CLASS_STYLES[k % CLASS_STYLES.len()]);
                    for (k, name) in names.iter().enumerate() {
                        let (x, y) = (x + place[2] + 16 * FINE, y + k as i32 * 24 * FINE);
                        let corners = [(x, y), (x + 14 * FINE, y + 14 * FINE)];
                        let square = Rectangle::new(corners, style(k).filled());
                        area.draw(&square).map_err(said)?;
                        let at = (x + 20 * FINE, y);
                        let text = Text::new(name.clone(), at, text_style(TEXT));
                        area.draw(&text).map_err(said)?;
                    }
                }
            }
            area.present().map_err(said)?;
        }
        let mut pictures = String::new();
        if let Scale::Continuous { .. } = &self.scale {
            let [x, y, w, h] = place;
            pictures += &picture(&self.picture()?, place);
            let bar = [x + w + 18 * FINE, y, BAR * FINE, h];
            pictures += &picture(&bar_picture()?, bar);
        } else {
            pictures += &self.squares(place);
        }
        // Below the axes and what is drawn over the map.
        let body = match svg.find('>') {
            Some(at) => format!("{}{pictures}{}", &svg[..=at], &svg[at + 1..]),
            None => svg,
        };
        Ok(Drawing::of(&self.title, size, &body))
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
            (x - LEFT * FINE, y),
            (
                (width + LEFT * FINE) as u32,
                (height + BOTTOM * FINE) as u32,
            ),
        );
        let mut chart = ChartBuilder::on(&plot)
            .x_label_area_size(BOTTOM * FINE)
            .y_label_area_size(LEFT * FINE)
            .build_cartesian_2d(0.0..self.size[0], 0.0..self.size[1])
            .map_err(said)?;
        chart
            .configure_mesh()
            .disable_mesh()
            .axis_style(AXIS.stroke_width(FINE as u32))
            .x_labels(5)
            .y_labels(5)
            .x_desc("x / mm")
            .y_desc("y / mm")
            .x_label_formatter(&|value| tick(*value))
            .y_label_formatter(&|value| tick(*value))
            .label_style(text_style(TEXT))
            .draw()
            .map_err(said)?;
        for curve in &self.curves {
            let line = curve
                .points
                .iter()
                .map(|[x, y]| (*x, *y))
                .collect::<Vec<_>>();
            let style = TEXT_COLOUR.stroke_width(FINE as u32);
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
                let style = CLASS_STYLES[value as usize % CLASS_STYLES.len()];
                let (left, right) = (edge(i, nx, width), edge(i + 1, nx, width));
                // The picture's lines go down, the joint's y goes up.
                let (low, high) = (edge(j, ny, height), edge(j + 1, ny, height));
                squares += &format!(
                    "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" class=\"c{style}\"/>",
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
        let Scale::Continuous { range, .. } = self.scale else {
            return Err(said("classes are no picture"));
        };
        let counts = self.cells.map(|cells| cells.min(FINEST));
        let block = |k: usize, d: usize| -> Range<usize> {
            k * self.cells[d] / counts[d]..(k + 1) * self.cells[d] / counts[d]
        };
        let mut pixels = Vec::with_capacity(counts[0] * counts[1]);
        for row in (0..counts[1]).rev() {
            for column in 0..counts[0] {
                let (mut sum, mut count) = (0.0, 0);
                for i in block(column, 0) {
                    for j in block(row, 1) {
                        let value = self.values[i * self.cells[1] + j];
                        if value.is_finite() {
                            (sum, count) = (sum + value, count + 1);
                        }
                    }
                }
                let part = (sum / f64::from(count) - range[0]) / (range[1] - range[0]);
                pixels.push(match count {
                    0 => COLOURS as u8,
                    _ => (part.clamp(0.0, 1.0) * (COLOURS - 1) as f64).round() as u8,
                });
            }
        }
        png([counts[0] as u32, counts[1] as u32], &pixels)
    }
}

/// Of the styles those that stand for classes.
const CLASS_STYLES: [usize; 3] = [0, 4, 1];

/// The numbers beside the colour bar.
fn bar_axis(
    area: &Area,
    [x, y, width, height]: [i32; 4],
    range: [f64; 2],
    label: &str,
) -> Result<(), PlotError> {
    let left = x + width + 18 * FINE;
    let room = WIDTH * FINE - left;
    let part = area.clone().shrink((left, y), (room as u32, height as u32));
    let [low, high] = range;
    let mut chart = ChartBuilder::on(&part)
        .right_y_label_area_size(room - BAR * FINE)
        .build_cartesian_2d(0.0..1.0, low..high)
        .map_err(said)?;
    chart
        .configure_mesh()
        .disable_mesh()
        .disable_x_axis()
        .axis_style(AXIS.stroke_width(FINE as u32))
        .y_labels(6)
        .y_label_formatter(&|value| tick(*value))
        .label_style(text_style(TEXT))
        .draw()
        .map_err(said)?;
    let width = text_width(label) * FINE;
    let right = (WIDTH * FINE - width - 4 * FINE).max(0);
    let text = Text::new(
        label.to_owned(),
        (right.min(left), (y + height) + 20 * FINE),
        text_style(TEXT),
    );
    area.draw(&text).map_err(said)
}

fn bar_picture() -> Result<Vec<u8>, PlotError> {
    let pixels: Vec<u8> = (0..COLOURS).rev().map(|k| k as u8).collect();
    png([1, COLOURS as u32], &pixels)
}

/// Viridis, of even steps to the eye and legible without colour; the last entry is transparent.
fn png(size: [u32; 2], pixels: &[u8]) -> Result<Vec<u8>, PlotError> {
    let palette: Vec<u8> = (0..COLOURS)
        .flat_map(|k| {
            let part = k as f64 / (COLOURS - 1) as f64;
            let RGBColor(r, g, b) = ViridisRGB.get_color(part);
            [r, g, b]
        })
        .chain([0, 0, 0])
        .collect();
    let mut opacity = vec![255; COLOURS];
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

fn picture(png: &[u8], [x, y, width, height]: [i32; 4]) -> String {
    format!(
        "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" preserveAspectRatio=\"none\" \
         style=\"image-rendering:pixelated\" href=\"data:image/png;base64,{}\"/>",
        STANDARD.encode(png)
    )
}
