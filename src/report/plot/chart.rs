//! Charts: curves over linear or logarithmic axes.

use maud::{Markup, html};

use super::super::text::escape_controls;
use super::axis::{Axis, PlacedAxis};
use super::{
    Drawing, HEAD, STYLES, TEXT, WIDTH, heading, line, polyline, text, text_width, two, upwards,
};

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A line.
    Line,
    /// A line with dots.
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
    /// Returns the width of the line, or `None` without a line.
    fn line(self) -> Option<f64> {
        match self {
            Mark::Line | Mark::Dots => Some(2.0),
            Mark::Thin => Some(1.0),
            Mark::Points | Mark::Hollow | Mark::Rings => None,
        }
    }

    /// Draws a dot, hollow if the value is very uncertain. Returns `None` for a mark without dots.
    fn dot(self, style: usize, hollow: bool, at: [f64; 2]) -> Option<Markup> {
        let (radius, filled) = match self {
            Mark::Line | Mark::Thin => return None,
            Mark::Dots | Mark::Points => (DOT, !hollow),
            Mark::Hollow => (DOT, false),
            Mark::Rings => (RING, false),
        };
        let [x, y] = at.map(two);
        Some(match filled {
            true => html! { circle class={ "c" (style) } cx=(x) cy=(y) r=(radius) {} },
            false => {
                html! { circle class={ "s" (style) } fill="none" stroke-width="2" cx=(x) cy=(y) r=(radius) {} }
            }
        })
    }
}

/// Curve: points in the order of the line, in the units of the axes.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Name in the legend. A curve with an empty name is not in the legend.
    pub name: String,
    /// Number of the line style of the curve.
    pub style: usize,
    /// Mark of the curve.
    pub mark: Mark,
    /// Abscissa and ordinate. Points that are not finite are omitted.
    pub points: Vec<[f64; 2]>,
    /// Half lengths of the error bars, one per point, or empty.
    pub bars: Vec<f64>,
}

impl Curve {
    /// Creates a line without dots and error bars.
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

/// Band: area between two values of the ordinate.
#[derive(Debug, Clone)]
pub struct Band {
    /// Name in the legend.
    pub name: String,
    /// Number of the style of the band.
    pub style: usize,
    /// Abscissa, lower end and upper end.
    pub points: Vec<[f64; 3]>,
}

/// Chart: bands and curves over two axes.
#[derive(Debug, Clone, Default)]
pub struct Chart {
    /// Heading of the chart.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Bands, drawn below the curves, the first one lowest.
    pub bands: Vec<Band>,
    /// Curves, the first one lowest.
    pub curves: Vec<Curve>,
    /// True for a chart of positions: both axes have the same scale. To make the scales equal, the chart widens the
    /// range of one axis.
    pub equal_scale: bool,
}

/// Height without heading and legend, in units of the page.
const HEIGHT: f64 = 280.0;
/// Height of a row of the legend.
const ROW: f64 = 20.0;
/// Length of a line in the legend.
const SAMPLE: f64 = 30.0;
/// Room for the label of the ordinate and its ticks.
const LEFT: f64 = 38.0;
/// Smallest room for the numbers of the ordinate.
const NUMBERS: f64 = 28.0;
/// Room for the numbers and the label of the abscissa.
const BOTTOM: f64 = 46.0;
/// Room above the ordinate.
const TOP: f64 = 6.0;
/// Room to the right of the abscissa's last number.
const RIGHT: f64 = 18.0;
/// Radius of a dot.
const DOT: f64 = 3.0;
/// Radius of a ring.
const RING: f64 = 6.0;
/// Half length of the cap of an error bar.
const CAP: f64 = 3.0;
/// Margin of the plot, so that dots at its edge are completely visible.
const MARGIN: f64 = 8.0;
/// Relative error from which on a value is very uncertain. The point of a very uncertain value is hollow and has no
/// error bar.
pub const UNCERTAIN: f64 = 0.9;
/// Lower end of a logarithmic axis, relative to the value at the position of 0.
pub const BEFORE_ZERO: f64 = 0.9;
/// Margin of a linear axis, relative to its range, or to the value if all values are the same.
const WIDEN: f64 = 0.05;
/// Maximum number of decades of a logarithmic axis.
const DECADES: f64 = 9.0;

/// Entry of the legend: a curve or a band.
struct Entry<'a> {
    name: &'a str,
    style: usize,
    /// `None` for a band.
    mark: Option<Mark>,
}

impl Chart {
    /// Draws the chart.
    pub fn draw(&self) -> Drawing {
        let left = self.left();
        let legend = self.legend(left);
        let rows = legend.last().map_or(0.0, |(row, ..)| row + 1.0);
        let top = HEAD + rows * ROW + TOP;
        let (width, height) = (WIDTH - RIGHT - left, HEIGHT - TOP - BOTTOM);
        let ranges = self.ranges();
        let x = PlacedAxis::new(&self.x, [left, left + width], ranges[0]);
        let y = PlacedAxis::new(&self.y, [top + height, top], ranges[1]);
        let (right, bottom) = (left + width, top + height);
        let [m, wide, high] = [MARGIN, width + 2.0 * MARGIN, height + 2.0 * MARGIN];
        let window = [left - m, top - m, wide, high].map(two);
        let [at_x, at_y, w, h] = window;
        let body = html! {
            (heading(&self.title))
            @for (row, left, entry) in &legend { (entry.draw(*left, HEAD + row * ROW + ROW / 2.0)) }
            (x.draw(false, [bottom, top]))
            (y.draw(true, [left, right]))
            (line("axis", 1.0, [left, bottom], [right, bottom]))
            (line("axis", 1.0, [left, top], [left, bottom]))
            (text(&self.x.label, [left + width / 2.0, bottom + BOTTOM - 0.7 * TEXT], "middle"))
            (upwards(&self.y.label, [0.8 * TEXT, top + height / 2.0]))
            svg class="plot" x=(at_x) y=(at_y) width=(w) height=(h) viewBox={ (at_x) " " (at_y) " " (w) " " (h) }
                data-x=(escape_controls(&x.data())) data-y=(escape_controls(&y.data())) {
                // The invisible rectangle catches the pointer in empty parts of the plot.
                rect x=(at_x) y=(at_y) width=(w) height=(h) fill="none" pointer-events="all" {}
                @for band in &self.bands { (area(band, &x, &y)) }
                @for curve in &self.curves { (self.curve(curve, &x, &y)) }
            }
        };
        Drawing {
            title: self.title.clone(),
            height: top + height + BOTTOM,
            body,
        }
    }

    /// Returns the row, left edge and content of each entry of the legend. A single curve has no legend.
    fn legend(&self, edge: f64) -> Vec<(f64, f64, Entry<'_>)> {
        let bands = self.bands.iter().map(|band| Entry {
            name: &band.name,
            style: band.style,
            mark: None,
        });
        let curves = self.curves.iter().map(|curve| Entry {
            name: &curve.name,
            style: curve.style,
            mark: Some(curve.mark),
        });
        let entries: Vec<Entry> = bands.chain(curves).filter(|e| !e.name.is_empty()).collect();
        if entries.len() < 2 {
            return Vec::new();
        }
        let (mut row, mut left) = (0.0, edge);
        let mut places = Vec::new();
        for entry in entries {
            let width = SAMPLE + 6.0 + text_width(entry.name);
            if left > edge && left + width > WIDTH - RIGHT {
                (row, left) = (row + 1.0, edge);
            }
            places.push((row, left, entry));
            left += width + 16.0;
        }
        places
    }

    /// Returns the position of the ordinate. The numbers of the ordinate determine the room to its left.
    fn left(&self) -> f64 {
        LEFT + self.y.widest(self.range(1)).max(NUMBERS)
    }

    fn axis(&self, direction: usize) -> &Axis {
        [&self.x, &self.y][direction]
    }

    /// Returns the point at whose position a point is drawn.
    fn drawn_point(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.x.drawn_value(x), self.y.drawn_value(y)]
    }

    /// Returns true if a point can be drawn.
    fn is_drawn(&self, point: &[f64; 2]) -> bool {
        (0..2).all(|d| point[d].is_finite() && (!self.axis(d).log || point[d] > 0.0))
    }

    /// Returns the ranges of both axes.
    fn ranges(&self) -> [[f64; 2]; 2] {
        let needed = [0, 1].map(|direction| self.range(direction));
        if !self.equal_scale {
            return needed;
        }
        let room = [WIDTH - RIGHT - self.left(), HEIGHT - TOP - BOTTOM];
        // The coarser of the two scales fits both ranges.
        let unit = (0..2)
            .map(|d| (needed[d][1] - needed[d][0]) / room[d])
            .fold(0.0, f64::max);
        [0, 1].map(|d| {
            let middle = 0.5 * (needed[d][0] + needed[d][1]);
            let reach = 0.5 * unit * room[d];
            [middle - reach, middle + reach]
        })
    }

    /// Returns the values that an axis must include, with the ends of error bars.
    fn values(&self, direction: usize) -> impl Iterator<Item = f64> {
        let band_points = self.bands.iter().flat_map(|band| &band.points);
        let band_points = band_points.flat_map(|[x, low, high]| [[*x, *low], [*x, *high]]);
        let band_points = band_points.map(|point| (point, 0.0));
        let curve_points = self.curves.iter().flat_map(|curve| {
            let bars = curve.bars.iter().copied().chain(std::iter::repeat(0.0));
            curve.points.iter().copied().zip(bars)
        });
        let placed = band_points
            .chain(curve_points)
            .map(|(point, bar)| (self.drawn_point(point), bar));
        let drawable = placed.filter(|(point, _)| self.is_drawn(point));
        drawable.flat_map(move |(point, bar)| {
            let is_shown = direction == 1 && is_shown(bar, point[1]);
            let bar = if is_shown { bar } else { 0.0 };
            [point[direction] - bar, point[direction] + bar]
        })
    }

    fn range(&self, direction: usize) -> [f64; 2] {
        let axis = self.axis(direction);
        if let Some(range) = axis.range {
            return range;
        }
        let empty = [f64::INFINITY, f64::NEG_INFINITY];
        let values = self.values(direction);
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
        // A range that begins near zero begins at zero.
        let least = if low >= 0.0 && low < reach {
            low.min(0.0)
        } else {
            low - reach
        };
        [least, high + reach]
    }

    /// Draws a curve, and the error bars and dots of the curve's points.
    fn curve(&self, curve: &Curve, x: &PlacedAxis, y: &PlacedAxis) -> Markup {
        let style = curve.style % STYLES;
        let bars = curve.bars.iter().copied().chain(std::iter::repeat(0.0));
        let placed = curve
            .points
            .iter()
            .map(|point| self.drawn_point(*point))
            .zip(bars);
        let drawable: Vec<([f64; 2], f64)> = placed.filter(|(p, _)| self.is_drawn(p)).collect();
        let at = |[px, py]: [f64; 2]| [x.position(px), y.position(py)];
        let bar_of = |[px, py]: [f64; 2], bar: f64| {
            let ends = [py - bar, py + bar].map(|end| at([px, end]));
            // On a logarithmic axis, an error bar that reaches zero or below extends beyond the plot. The chart omits
            // an error bar that is shorter than the dot of the point.
            let ends = ends.map(|[x, y]| [x, if y.is_finite() { y } else { 1e4 }]);
            let is_visible = is_shown(bar, py) && (ends[0][1] - ends[1][1]).abs() > 2.0 * DOT;
            is_visible.then(|| {
                let [[cx, low], [_, high]] = ends.map(|end| end.map(two));
                format!(
                    "M{cx} {low}V{high}M{0} {low}H{1}M{0} {high}H{1}",
                    cx - CAP,
                    cx + CAP
                )
            })
        };
        let bars: String = drawable
            .iter()
            .filter_map(|(point, bar)| bar_of(*point, *bar))
            .collect();
        let dots = drawable.iter().filter_map(|(point, bar)| {
            let hollow = *bar > 0.0 && !is_shown(*bar, point[1]);
            curve.mark.dot(style, hollow, at(*point))
        });
        let points: Vec<[f64; 2]> = drawable.iter().map(|(point, _)| at(*point)).collect();
        html! {
            g data-name=(escape_controls(&curve.name)) {
                @if !bars.is_empty() { path class={ "bar b" (style) } fill="none" stroke-width="1.5" d=(bars) {} }
                @if let Some(width) = curve.mark.line() { (polyline(&format!("s{style}"), width, &points)) }
                @for dot in dots { (dot) }
            }
        }
    }
}

/// Draws a band.
fn area(band: &Band, x: &PlacedAxis, y: &PlacedAxis) -> Markup {
    let above = band
        .points
        .iter()
        .map(|[px, _, high]| [x.position(*px), y.position(*high)]);
    let below = band
        .points
        .iter()
        .rev()
        .map(|[px, low, _]| [x.position(*px), y.position(*low)]);
    let points = above
        .chain(below)
        .filter(|p| p.iter().all(|c| c.is_finite()));
    let points = points.map(|[x, y]| format!("{},{}", two(x), two(y)));
    let points = points.collect::<Vec<_>>().join(" ");
    html! {
        g data-name=(escape_controls(&band.name)) {
            polygon class={ "band c" (band.style % STYLES) } points=(points) {}
        }
    }
}

/// Returns true if the error bar of a value is drawn.
fn is_shown(bar: f64, value: f64) -> bool {
    bar > 0.0 && bar < UNCERTAIN * value.abs()
}

impl Entry<'_> {
    fn draw(&self, left: f64, middle: f64) -> Markup {
        let style = self.style % STYLES;
        let ends = [[left, middle], [left + SAMPLE, middle]];
        html! {
            g class="key" data-name=(escape_controls(self.name)) {
                @match self.mark {
                    None => {
                        rect class={ "band c" (style) } x=(two(left)) y=(middle - 6.0) width=(SAMPLE) height="12" {}
                    }
                    Some(mark) => {
                        @if let Some(width) = mark.line() { (polyline(&format!("s{style}"), width, &ends)) }
                        @if let Some(dot) = mark.dot(style, false, [left + SAMPLE / 2.0, middle]) { (dot) }
                    }
                }
                (text(self.name, [left + SAMPLE + 6.0, middle], "start"))
            }
        }
    }
}
