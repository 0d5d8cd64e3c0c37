//! Curves over linear or logarithmic axes.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::ValueFormatter;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::super::quantity::digits;
use super::{
    AXIS, Drawing, FINE, GRID, PlotError, TEXT, TEXT_COLOUR, WIDTH, bar_colour, said, style_colour,
    text_width,
};

/// An axis.
#[derive(Debug, Clone, Default)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// True for a logarithmic one.
    pub log: bool,
    /// Where 0 stands on a logarithmic one, a power of ten below all values; nowhere without.
    pub zero: Option<f64>,
    /// Its range, in place of what the curves need.
    pub range: Option<[f64; 2]>,
}

impl Axis {
    /// A value as it is drawn.
    fn placed(&self, value: f64) -> f64 {
        match self.zero {
            Some(zero) if self.log && value == 0.0 => zero,
            _ => value,
        }
    }

    /// The number at a place.
    fn number(&self, value: f64, range: [f64; 2]) -> String {
        match self.zero {
            Some(zero) if self.log && (value / zero - 1.0).abs() < 1e-6 => "0".to_owned(),
            _ => tick(value, range, self.log),
        }
    }

    /// For who points at it: where it is in the drawing, its range, its kind, its label.
    fn data(&self, [begin, end]: [i32; 2], [low, high]: [f64; 2]) -> String {
        let kind = match (self.log, self.zero) {
            (true, Some(zero)) => format!("log {zero}"),
            (true, None) => "log 0".to_owned(),
            (false, _) => "lin 0".to_owned(),
        };
        format!("{begin} {end} {low} {high} {kind} {}", self.label)
    }
}

/// What stands at the points of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// Nothing but the line.
    Line,
    /// The line and dots on it.
    Dots,
    /// A thin line.
    Thin,
    /// Dots, without a line.
    Points,
    /// Hollow dots, without a line.
    Hollow,
    /// Rings, without a line.
    Rings,
}

impl Mark {
    /// Width of its line; none without.
    fn line(self) -> Option<u32> {
        match self {
            Mark::Line | Mark::Dots => Some(2 * FINE as u32),
            Mark::Thin => Some(FINE as u32),
            Mark::Points | Mark::Hollow | Mark::Rings => None,
        }
    }
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
    /// True of places: a unit is as long upwards as to the right, and one of the ranges becomes wider for it.
    pub equal_scale: bool,
}

/// Height without heading and legend, in units of the page.
const HEIGHT: i32 = 280;
/// Height of the heading.
const HEAD: i32 = 26;
/// Height of a row of the legend.
const ROW: i32 = 20;
/// Length of the line in the legend.
const SAMPLE: i32 = 30;
/// Room for the label of the ordinate and the marks at its numbers.
const LEFT: i32 = 38;
/// Least room for the numbers.
const NUMBERS: i32 = 28;
/// Room for those of the abscissa.
const BOTTOM: i32 = 46;
/// Nothing is drawn this near to the edge.
const EDGE: i32 = 4;
/// Length of the lines that lead from an axis to its numbers.
pub(super) const TICK: i32 = 5;
/// Room above the ordinate.
const TOP: i32 = 6;
/// Room to the right of the abscissa's last number.
const RIGHT: i32 = 18;
/// Radius of a dot, and of a ring.
const DOT: i32 = 3;
/// See [`DOT`].
const RING: i32 = 6;
/// Half length of the end of an error bar.
const CAP: i32 = 3;
/// A bar of this part of its value or more says that next to nothing is known: its point is hollow, and the bar left out.
pub const LONGEST_BAR: f64 = 0.9;
/// A logarithmic axis begins this part of the place of 0 below it.
pub const BEFORE_ZERO: f64 = 0.9;
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
        let legend = self.legend(self.left());
        let rows = legend.last().map_or(0, |(row, ..)| row + 1);
        let top = HEAD + rows * ROW;
        let size = ((WIDTH * FINE) as u32, ((top + HEIGHT) * FINE) as u32);
        let mut svg = String::new();
        let place;
        {
            let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            heading(&area, &self.title)?;
            for (row, left, curve) in legend {
                entry(&area, left, HEAD + row * ROW + ROW / 2, curve)?;
            }
            let (_, plot) = area.split_vertically(top * FINE);
            let [[x0, x1], [y0, y1]] = self.ranges();
            place = match (self.x.log, self.y.log) {
                (false, false) => self.axes(&plot, x0..x1, y0..y1)?,
                (true, false) => self.axes(&plot, (x0..x1).log_scale(), y0..y1)?,
                (false, true) => self.axes(&plot, x0..x1, (y0..y1).log_scale())?,
                (true, true) => self.axes(&plot, (x0..x1).log_scale(), (y0..y1).log_scale())?,
            };
            area.present().map_err(said)?;
        }
        let [x, y] = place;
        // Of the ordinate the lower end comes first.
        let ranges = self.ranges();
        let x = self.x.data([x.start, x.end], ranges[0]);
        let y = self.y.data([y.end, y.start], ranges[1]);
        let named = self.curves.iter().filter(|curve| !curve.name.is_empty());
        let names: Vec<String> = named
            .map(|curve| format!("s{} {}", curve.style, curve.name))
            .collect();
        Ok(Drawing::of(&self.title, size, &svg)
            .with_data("x", &x)
            .with_data("y", &y)
            .with_data("names", &names.join("\n")))
    }

    /// Row, left edge and curve of what the legend names; a single curve needs no name.
    fn legend(&self, edge: i32) -> Vec<(i32, i32, &Curve)> {
        let named = self.curves.iter().filter(|curve| !curve.name.is_empty());
        let named: Vec<&Curve> = named.collect();
        if named.len() < 2 {
            return Vec::new();
        }
        let (mut row, mut left) = (0, edge);
        let mut places = Vec::new();
        for curve in named {
            let width = SAMPLE + 6 + text_width(&curve.name);
            if left > edge && left + width > WIDTH - RIGHT {
                (row, left) = (row + 1, edge);
            }
            places.push((row, left, curve));
            left += width + 16;
        }
        places
    }

    /// Where the ordinate is: its numbers take the room they need.
    fn left(&self) -> i32 {
        let range = self.range(1);
        let numbers = range.map(|end| text_width(&tick(end, range, self.y.log)));
        LEFT + numbers[0].max(numbers[1]).max(NUMBERS)
    }

    fn axis(&self, direction: usize) -> &Axis {
        [&self.x, &self.y][direction]
    }

    /// A point as it is drawn.
    fn placed(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.x.placed(x), self.y.placed(y)]
    }

    /// True where a point can be drawn.
    fn is_drawn(&self, point: &[f64; 2]) -> bool {
        (0..2).all(|d| point[d].is_finite() && (!self.axis(d).log || point[d] > 0.0))
    }

    /// The ranges of both axes.
    fn ranges(&self) -> [[f64; 2]; 2] {
        let own = [0, 1].map(|direction| self.range(direction));
        if !self.equal_scale {
            return own;
        }
        let room = [WIDTH - RIGHT - self.left(), HEIGHT - TOP - BOTTOM].map(f64::from);
        // Of the larger scale in units of the page both have as much as they need.
        let unit = (0..2)
            .map(|d| (own[d][1] - own[d][0]) / room[d])
            .fold(0.0, f64::max);
        [0, 1].map(|d| {
            let middle = 0.5 * (own[d][0] + own[d][1]);
            let reach = 0.5 * unit * room[d];
            [middle - reach, middle + reach]
        })
    }

    fn range(&self, direction: usize) -> [f64; 2] {
        let axis = self.axis(direction);
        if let Some(range) = axis.range {
            return range;
        }
        let values = self.curves.iter().flat_map(|curve| {
            let points = curve.points.iter().map(|point| self.placed(*point));
            let points = points.enumerate().filter(|(_, point)| self.is_drawn(point));
            points.flat_map(move |(k, point)| {
                let bar = curve.bars.get(k).copied().unwrap_or(0.0);
                let bar = if direction == 1 && is_shown(bar, point[1]) {
                    bar
                } else {
                    0.0
                };
                [point[direction] - bar, point[direction] + bar]
            })
        });
        let empty = [f64::INFINITY, f64::NEG_INFINITY];
        let [low, high] = values.fold(empty, |[low, high], v| [low.min(v), high.max(v)]);
        if low > high {
            return if axis.log { [0.1, 10.0] } else { [0.0, 1.0] };
        }
        if axis.log {
            let low = low.max(high / 10f64.powf(DECADES));
            let least = match axis.zero {
                Some(zero) => BEFORE_ZERO * zero,
                None => low / 1.5,
            };
            return [least, high * if axis.zero.is_some() { 1.15 } else { 1.5 }];
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

    /// Draws axes and curves, and says where between the edges of the drawing they are.
    fn axes<X, Y>(&self, area: &Area, x: X, y: Y) -> Result<[Range<i32>; 2], PlotError>
    where
        X: plotters::coord::ranged1d::AsRangedCoord<Value = f64>,
        Y: plotters::coord::ranged1d::AsRangedCoord<Value = f64>,
        X::CoordDescType: ValueFormatter<f64>,
        Y::CoordDescType: ValueFormatter<f64>,
    {
        let ranges = self.ranges();
        let mut chart = ChartBuilder::on(area)
            .margin_top(TOP * FINE)
            .margin_right(RIGHT * FINE)
            .margin_left(EDGE * FINE)
            .margin_bottom(EDGE * FINE)
            .x_label_area_size((BOTTOM - EDGE) * FINE)
            .y_label_area_size((self.left() - EDGE) * FINE)
            .build_cartesian_2d(x, y)
            .map_err(said)?;
        chart
            .configure_mesh()
            .max_light_lines(0)
            .set_all_tick_mark_size(TICK * FINE)
            .bold_line_style(GRID.stroke_width(FINE as u32))
            .axis_style(AXIS.stroke_width(FINE as u32))
            .x_labels(6)
            .y_labels(6)
            .x_desc(self.x.label.clone())
            .y_desc(self.y.label.clone())
            .x_label_formatter(&|value| self.x.number(*value, ranges[0]))
            .y_label_formatter(&|value| self.y.number(*value, ranges[1]))
            .label_style(text_style(TEXT))
            .axis_desc_style(text_style(TEXT))
            .draw()
            .map_err(said)?;
        let [low, high] = ranges[1];
        for curve in &self.curves {
            let colour = style_colour(curve.style);
            let placed: Vec<[f64; 2]> = curve.points.iter().map(|p| self.placed(*p)).collect();
            let drawn = || placed.iter().enumerate().filter(|(_, p)| self.is_drawn(p));
            let bar_at = |k: usize| curve.bars.get(k).copied().unwrap_or(0.0);
            for (k, [x, y]) in drawn() {
                let (x, y, bar) = (*x, *y, bar_at(k));
                let part = match self.y.log {
                    true => bar / y / (high / low).ln(),
                    false => bar / (high - low),
                };
                // A bar within its dot is no more than that.
                let seen = part * f64::from(HEIGHT) > f64::from(DOT);
                if is_shown(bar, y) && seen {
                    let bar = [y - bar, y + bar].map(|end| (x, end));
                    let style = bar_colour(curve.style).stroke_width(3 * FINE as u32 / 2);
                    let line = PathElement::new(bar.to_vec(), style);
                    chart.draw_series([line]).map_err(said)?;
                    let cap = |at| {
                        EmptyElement::at(at)
                            + PathElement::new(vec![(-CAP * FINE, 0), (CAP * FINE, 0)], style)
                    };
                    chart.draw_series(bar.map(cap)).map_err(said)?;
                }
            }
            let thick = colour.stroke_width(2 * FINE as u32);
            if let Some(width) = curve.mark.line() {
                let thick = colour.stroke_width(width);
                let line = drawn().map(|(_, [x, y])| (*x, *y)).collect::<Vec<_>>();
                chart
                    .draw_series([PathElement::new(line, thick)])
                    .map_err(said)?;
            }
            let dots = drawn().map(|(k, [x, y])| {
                let hollow = bar_at(k) > 0.0 && !is_shown(bar_at(k), *y);
                match curve.mark {
                    Mark::Line | Mark::Thin => None,
                    Mark::Dots | Mark::Points if !hollow => {
                        Some(Circle::new((*x, *y), DOT * FINE, colour.filled()))
                    }
                    Mark::Dots | Mark::Points | Mark::Hollow => {
                        Some(Circle::new((*x, *y), DOT * FINE, thick))
                    }
                    Mark::Rings => Some(Circle::new((*x, *y), RING * FINE, thick)),
                }
            });
            chart.draw_series(dots.flatten()).map_err(said)?;
        }
        let (x, y) = chart.plotting_area().get_pixel_range();
        Ok([x, y])
    }
}

/// True for an error bar that is drawn, of a value.
fn is_shown(bar: f64, value: f64) -> bool {
    bar > 0.0 && bar < LONGEST_BAR * value.abs()
}

/// One line of the legend.
fn entry(area: &Area, left: i32, middle: i32, curve: &Curve) -> Result<(), PlotError> {
    let colour = style_colour(curve.style);
    let at = |x: i32| (x * FINE, middle * FINE);
    if let Some(width) = curve.mark.line() {
        let line = PathElement::new(
            vec![at(left), at(left + SAMPLE)],
            colour.stroke_width(width),
        );
        area.draw(&line).map_err(said)?;
    }
    let centre = at(left + SAMPLE / 2);
    match curve.mark {
        Mark::Line | Mark::Thin => (),
        Mark::Hollow => area
            .draw(&Circle::new(
                centre,
                DOT * FINE,
                colour.stroke_width(2 * FINE as u32),
            ))
            .map_err(said)?,
        Mark::Dots | Mark::Points => area
            .draw(&Circle::new(centre, DOT * FINE, colour.filled()))
            .map_err(said)?,
        Mark::Rings => area
            .draw(&Circle::new(
                centre,
                RING * FINE,
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

/// A number at an axis: with the digits that tell it from the next, and none that rounding left.
pub(super) fn tick(value: f64, [low, high]: [f64; 2], log: bool) -> String {
    let span = high - low;
    if log || value.abs() >= 1e6 || span < 1e-6 {
        return digits(value, 6);
    }
    // A step is a twelfth of the axis at least.
    let decimals = (12.0 / span).log10().ceil().max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    let rounded: f64 = text.parse().unwrap_or(value);
    digits(rounded, 12)
}
