//! Curves over linear or logarithmic axes.

use plotters::coord::Shift;
use plotters::coord::ranged1d::ValueFormatter;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::super::quantity::digits;
use super::{
    AXIS, Drawing, FAINT, FINE, GRID, PlotError, TEXT, TEXT_COLOUR, WIDTH, said, style_colour,
    text_width,
};

/// An axis.
#[derive(Debug, Clone, Default)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// True for a logarithmic one.
    pub log: bool,
    /// Its range, in place of what the curves need.
    pub range: Option<[f64; 2]>,
}

/// What stands at the points of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// Nothing but the line.
    Line,
    /// The line and dots on it.
    Dots,
    /// Rings, without a line.
    Rings,
}

/// Points in the order in which a line joins them, in the units of the axes.
#[derive(Debug, Clone)]
pub struct Curve {
    /// What it is, for the legend; an empty name does not stand there.
    pub name: String,
    /// Which of the styles it has.
    pub style: usize,
    /// How it is drawn.
    pub mark: Mark,
    /// Abscissa and ordinate; points that are not finite are left out.
    pub points: Vec<[f64; 2]>,
    /// Half lengths of the error bars, one a point; none without.
    pub bars: Vec<f64>,
}

impl Curve {
    /// A line.
    pub fn line(name: &str, style: usize, points: Vec<[f64; 2]>) -> Curve {
        Curve {
            name: name.to_owned(),
            style,
            mark: Mark::Line,
            points,
            bars: Vec::new(),
        }
    }
}

/// Curves over two axes.
#[derive(Debug, Clone, Default)]
pub struct Chart {
    /// Heading of the chart.
    pub title: String,
    /// To the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// The curves, the first below the others.
    pub curves: Vec<Curve>,
}

/// Height without heading and legend, in units of the page.
const HEIGHT: i32 = 280;
/// Height of the heading.
const HEAD: i32 = 26;
/// Height of a row of the legend.
const ROW: i32 = 20;
/// Length of the line in the legend.
const SAMPLE: i32 = 30;
/// Room for the numbers of the ordinate and its label.
const LEFT: i32 = 66;
/// Room for those of the abscissa.
const BOTTOM: i32 = 46;
/// Room to the right of the abscissa's last number.
const RIGHT: i32 = 18;
/// Where all values are the same, the axis reaches this part of them to both sides.
const WIDEN: f64 = 0.05;
/// A logarithmic axis shows this many decades at most.
const DECADES: f64 = 9.0;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

impl Chart {
    /// The chart as a drawing.
    ///
    /// # Errors
    /// [`PlotError`] if the drawing library fails.
    pub fn draw(&self) -> Result<Drawing, PlotError> {
        let legend = self.legend();
        let rows = legend.last().map_or(0, |(row, ..)| row + 1);
        let top = HEAD + rows * ROW;
        let size = ((WIDTH * FINE) as u32, ((top + HEIGHT) * FINE) as u32);
        let mut svg = String::new();
        {
            let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            heading(&area, &self.title)?;
            for (row, left, curve) in legend {
                entry(&area, left, HEAD + row * ROW + ROW / 2, curve)?;
            }
            let (_, plot) = area.split_vertically(top * FINE);
            let (x, y) = (self.range(0), self.range(1));
            let ([x0, x1], [y0, y1]) = (x, y);
            match (self.x.log, self.y.log) {
                (false, false) => self.axes(&plot, x0..x1, y0..y1)?,
                (true, false) => self.axes(&plot, (x0..x1).log_scale(), y0..y1)?,
                (false, true) => self.axes(&plot, x0..x1, (y0..y1).log_scale())?,
                (true, true) => {
                    self.axes(&plot, (x0..x1).log_scale(), (y0..y1).log_scale())?;
                }
            }
            area.present().map_err(said)?;
        }
        Ok(Drawing::of(&self.title, size, &svg))
    }

    /// Row, left edge and curve of what the legend names; a single curve needs no name.
    fn legend(&self) -> Vec<(i32, i32, &Curve)> {
        let named = self.curves.iter().filter(|curve| !curve.name.is_empty());
        let named: Vec<&Curve> = named.collect();
        if named.len() < 2 {
            return Vec::new();
        }
        let (mut row, mut left) = (0, LEFT);
        let mut places = Vec::new();
        for curve in named {
            let width = SAMPLE + 6 + text_width(&curve.name);
            if left > LEFT && left + width > WIDTH - RIGHT {
                (row, left) = (row + 1, LEFT);
            }
            places.push((row, left, curve));
            left += width + 16;
        }
        places
    }

    fn axis(&self, direction: usize) -> &Axis {
        [&self.x, &self.y][direction]
    }

    /// True where a point can be drawn.
    fn is_drawn(&self, point: &[f64; 2]) -> bool {
        (0..2).all(|d| point[d].is_finite() && (!self.axis(d).log || point[d] > 0.0))
    }

    fn range(&self, direction: usize) -> [f64; 2] {
        let axis = self.axis(direction);
        if let Some(range) = axis.range {
            return range;
        }
        let points = self.curves.iter().flat_map(|curve| &curve.points);
        let values = points.filter(|p| self.is_drawn(p)).map(|p| p[direction]);
        let empty = [f64::INFINITY, f64::NEG_INFINITY];
        let [low, high] = values.fold(empty, |[low, high], v| [low.min(v), high.max(v)]);
        if low > high {
            return if axis.log { [0.1, 10.0] } else { [0.0, 1.0] };
        }
        if axis.log {
            let low = low.max(high / 10f64.powf(DECADES));
            return [low / 1.5, high * 1.5];
        }
        let reach = if high > low {
            WIDEN * (high - low)
        } else {
            (WIDEN * high.abs()).max(f64::MIN_POSITIVE.sqrt())
        };
        // What begins at zero stays there.
        let least = if low >= 0.0 && low < reach {
            low.min(0.0)
        } else {
            low - reach
        };
        [least, high + reach]
    }

    fn axes<X, Y>(&self, area: &Area, x: X, y: Y) -> Result<(), PlotError>
    where
        X: plotters::coord::ranged1d::AsRangedCoord<Value = f64>,
        Y: plotters::coord::ranged1d::AsRangedCoord<Value = f64>,
        X::CoordDescType: ValueFormatter<f64>,
        Y::CoordDescType: ValueFormatter<f64>,
    {
        let mut chart = ChartBuilder::on(area)
            .margin_top(6 * FINE)
            .margin_right(RIGHT * FINE)
            .x_label_area_size(BOTTOM * FINE)
            .y_label_area_size(LEFT * FINE)
            .build_cartesian_2d(x, y)
            .map_err(said)?;
        chart
            .configure_mesh()
            .max_light_lines(0)
            .bold_line_style(GRID.stroke_width(FINE as u32))
            .axis_style(AXIS.stroke_width(FINE as u32))
            .x_labels(6)
            .y_labels(6)
            .x_desc(self.x.label.clone())
            .y_desc(self.y.label.clone())
            .x_label_formatter(&|value| tick(*value))
            .y_label_formatter(&|value| tick(*value))
            .label_style(text_style(TEXT))
            .axis_desc_style(text_style(TEXT))
            .draw()
            .map_err(said)?;
        let [low, high] = self.range(1);
        for curve in &self.curves {
            let colour = style_colour(curve.style);
            let drawn = || curve.points.iter().filter(|p| self.is_drawn(p));
            for (point, bar) in curve.points.iter().zip(&curve.bars) {
                if self.is_drawn(point) && bar.is_finite() && *bar > 0.0 {
                    let [x, y] = *point;
                    let ends = [(y - bar).max(low), (y + bar).min(high)];
                    let bar = ends.map(|end| (x, end)).to_vec();
                    let line = PathElement::new(bar, FAINT.stroke_width(2 * FINE as u32));
                    chart.draw_series([line]).map_err(said)?;
                }
            }
            if curve.mark != Mark::Rings {
                let line = drawn().map(|[x, y]| (*x, *y)).collect::<Vec<_>>();
                let line = PathElement::new(line, colour.stroke_width(2 * FINE as u32));
                chart.draw_series([line]).map_err(said)?;
            }
            let dots = drawn().map(|[x, y]| match curve.mark {
                Mark::Line => None,
                Mark::Dots => Some(Circle::new((*x, *y), 3 * FINE, colour.filled())),
                Mark::Rings => Some(Circle::new(
                    (*x, *y),
                    6 * FINE,
                    colour.stroke_width(2 * FINE as u32),
                )),
            });
            chart.draw_series(dots.flatten()).map_err(said)?;
        }
        Ok(())
    }
}

/// One line of the legend.
fn entry(area: &Area, left: i32, middle: i32, curve: &Curve) -> Result<(), PlotError> {
    let colour = style_colour(curve.style);
    let at = |x: i32| (x * FINE, middle * FINE);
    if curve.mark != Mark::Rings {
        let line = PathElement::new(
            vec![at(left), at(left + SAMPLE)],
            colour.stroke_width(2 * FINE as u32),
        );
        area.draw(&line).map_err(said)?;
    }
    let centre = at(left + SAMPLE / 2);
    match curve.mark {
        Mark::Line => (),
        Mark::Dots => area
            .draw(&Circle::new(centre, 3 * FINE, colour.filled()))
            .map_err(said)?,
        Mark::Rings => area
            .draw(&Circle::new(
                centre,
                6 * FINE,
                colour.stroke_width(2 * FINE as u32),
            ))
            .map_err(said)?,
    }
    let style = text_style(TEXT).pos(Pos::new(HPos::Left, VPos::Center));
    let text = Text::new(curve.name.clone(), at(left + SAMPLE + 6), style);
    area.draw(&text).map_err(said)
}

/// The heading of a drawing.
pub(super) fn heading(area: &Area, title: &str) -> Result<(), PlotError> {
    let style = ("sans-serif", f64::from(TEXT * FINE) * 1.24)
        .into_font()
        .style(FontStyle::Bold)
        .color(&TEXT_COLOUR)
        .pos(Pos::new(HPos::Left, VPos::Center));
    let text = Text::new(title.to_owned(), (8 * FINE, HEAD / 2 * FINE), style);
    area.draw(&text).map_err(said)
}

/// Text of a size in units of the page; the library divides by what it takes for the height of a line.
pub(super) fn text_style(size: i32) -> TextStyle<'static> {
    ("sans-serif", f64::from(size * FINE) * 1.24)
        .into_font()
        .color(&TEXT_COLOUR)
}

/// A number at an axis: what the steps of an axis leave of rounding is not shown.
pub(super) fn tick(value: f64) -> String {
    if value.abs() < 1e-12 {
        "0".to_owned()
    } else {
        digits(value, 5)
    }
}
