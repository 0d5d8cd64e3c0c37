//! Curves over linear or logarithmic axes.

use maud::{Markup, html};

use super::super::text::visible;
use super::axis::{Axis, PlacedAxis};
use super::{
    Drawing, HEAD, STYLES, TEXT, WIDTH, heading, line, polyline, text, text_width, two, upwards,
};

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
    fn line(self) -> Option<f64> {
        match self {
            Mark::Line | Mark::Dots => Some(2.0),
            Mark::Thin => Some(1.0),
            Mark::Points | Mark::Hollow | Mark::Rings => None,
        }
    }

    /// A dot of a style; hollow where next to nothing is known. None of lines alone.
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

/// What lies between two values of the ordinate.
#[derive(Debug, Clone)]
pub struct Band {
    /// What it is, for the legend.
    pub name: String,
    /// Which of the styles it has.
    pub style: usize,
    /// Abscissa, and the lower and the upper end.
    pub points: Vec<[f64; 3]>,
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
    /// Areas below the curves, the first below the others.
    pub bands: Vec<Band>,
    /// The curves, the first below the others.
    pub curves: Vec<Curve>,
    /// True of places: a unit is as long upwards as to the right, and one of the ranges becomes wider for it.
    pub equal_scale: bool,
}

/// Height without heading and legend, in units of the page.
const HEIGHT: f64 = 280.0;
/// Height of a row of the legend.
const ROW: f64 = 20.0;
/// Length of the line in the legend.
const SAMPLE: f64 = 30.0;
/// Room for the label of the ordinate and the marks at its numbers.
const LEFT: f64 = 38.0;
/// Least room for the numbers.
const NUMBERS: f64 = 28.0;
/// Room for those of the abscissa, and its label.
const BOTTOM: f64 = 46.0;
/// Room above the ordinate.
const TOP: f64 = 6.0;
/// Room to the right of the abscissa's last number.
const RIGHT: f64 = 18.0;
/// Radius of a dot, and of a ring.
const DOT: f64 = 3.0;
/// See [`DOT`].
const RING: f64 = 6.0;
/// Half length of the end of an error bar.
const CAP: f64 = 3.0;
/// Dots at the edge of the plot are seen whole.
const MARGIN: f64 = 8.0;
/// A bar of this part of its value or more says that next to nothing is known: its point is hollow, and the bar left out.
pub const LONGEST_BAR: f64 = 0.9;
/// A logarithmic axis begins this part of the place of 0 below it.
pub const BEFORE_ZERO: f64 = 0.9;
/// Where all values are the same, the axis reaches this part of them to both sides.
const WIDEN: f64 = 0.05;
/// A logarithmic axis shows this many decades at most.
const DECADES: f64 = 9.0;

/// What the legend names: a curve, or a band.
struct Entry<'a> {
    name: &'a str,
    style: usize,
    /// None of a band.
    mark: Option<Mark>,
}

impl Chart {
    /// The chart as a drawing.
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
                data-x=(visible(&x.data())) data-y=(visible(&y.data())) {
                // What somebody points at where nothing is drawn.
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

    /// Row, left edge and what stands there of the legend; a single curve needs no name.
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
        let named: Vec<Entry> = bands.chain(curves).filter(|e| !e.name.is_empty()).collect();
        if named.len() < 2 {
            return Vec::new();
        }
        let (mut row, mut left) = (0.0, edge);
        let mut places = Vec::new();
        for entry in named {
            let width = SAMPLE + 6.0 + text_width(entry.name);
            if left > edge && left + width > WIDTH - RIGHT {
                (row, left) = (row + 1.0, edge);
            }
            places.push((row, left, entry));
            left += width + 16.0;
        }
        places
    }

    /// Where the ordinate is: its numbers take the room they need.
    fn left(&self) -> f64 {
        LEFT + self.y.widest(self.range(1)).max(NUMBERS)
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
        let room = [WIDTH - RIGHT - self.left(), HEIGHT - TOP - BOTTOM];
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

    /// The values that an axis has to show, with what error bars reach.
    fn values(&self, direction: usize) -> impl Iterator<Item = f64> {
        let of_bands = self.bands.iter().flat_map(|band| &band.points);
        let of_bands = of_bands.flat_map(|[x, low, high]| [[*x, *low], [*x, *high]]);
        let of_bands = of_bands.map(|point| (point, 0.0));
        let of_curves = self.curves.iter().flat_map(|curve| {
            let bars = curve.bars.iter().copied().chain(std::iter::repeat(0.0));
            curve.points.iter().copied().zip(bars)
        });
        let placed = of_bands
            .chain(of_curves)
            .map(|(point, bar)| (self.placed(point), bar));
        let drawn = placed.filter(|(point, _)| self.is_drawn(point));
        drawn.flat_map(move |(point, bar)| {
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
        // What begins at zero stays there.
        let least = if low >= 0.0 && low < reach {
            low.min(0.0)
        } else {
            low - reach
        };
        [least, high + reach]
    }

    /// A curve with its error bars and dots.
    fn curve(&self, curve: &Curve, x: &PlacedAxis, y: &PlacedAxis) -> Markup {
        let style = curve.style % STYLES;
        let bars = curve.bars.iter().copied().chain(std::iter::repeat(0.0));
        let placed = curve
            .points
            .iter()
            .map(|point| self.placed(*point))
            .zip(bars);
        let drawn: Vec<([f64; 2], f64)> = placed.filter(|(p, _)| self.is_drawn(p)).collect();
        let at = |[px, py]: [f64; 2]| [x.at(px), y.at(py)];
        let bar_of = |[px, py]: [f64; 2], bar: f64| {
            let ends = [py - bar, py + bar].map(|end| at([px, end]));
            // What a logarithmic axis has not reaches below it; a bar within its dot is no more than that.
            let ends = ends.map(|[x, y]| [x, if y.is_finite() { y } else { 1e4 }]);
            let is_seen = is_shown(bar, py) && (ends[0][1] - ends[1][1]).abs() > 2.0 * DOT;
            is_seen.then(|| {
                let [[cx, low], [_, high]] = ends.map(|end| end.map(two));
                format!(
                    "M{cx} {low}V{high}M{0} {low}H{1}M{0} {high}H{1}",
                    cx - CAP,
                    cx + CAP
                )
            })
        };
        let bars: String = drawn
            .iter()
            .filter_map(|(point, bar)| bar_of(*point, *bar))
            .collect();
        let dots = drawn.iter().filter_map(|(point, bar)| {
            let hollow = *bar > 0.0 && !is_shown(*bar, point[1]);
            curve.mark.dot(style, hollow, at(*point))
        });
        let points: Vec<[f64; 2]> = drawn.iter().map(|(point, _)| at(*point)).collect();
        html! {
            g data-name=(visible(&curve.name)) {
                @if !bars.is_empty() { path class={ "bar b" (style) } fill="none" stroke-width="1.5" d=(bars) {} }
                @if let Some(width) = curve.mark.line() { (polyline(&format!("s{style}"), width, &points)) }
                @for dot in dots { (dot) }
            }
        }
    }
}

/// A band: the area between its ends.
fn area(band: &Band, x: &PlacedAxis, y: &PlacedAxis) -> Markup {
    let above = band
        .points
        .iter()
        .map(|[px, _, high]| [x.at(*px), y.at(*high)]);
    let below = band
        .points
        .iter()
        .rev()
        .map(|[px, low, _]| [x.at(*px), y.at(*low)]);
    let points = above
        .chain(below)
        .filter(|p| p.iter().all(|c| c.is_finite()));
    let points = points.map(|[x, y]| format!("{},{}", two(x), two(y)));
    let points = points.collect::<Vec<_>>().join(" ");
    html! {
        g data-name=(visible(&band.name)) {
            polygon class={ "band c" (band.style % STYLES) } points=(points) {}
        }
    }
}

/// True for an error bar that is drawn, of a value.
fn is_shown(bar: f64, value: f64) -> bool {
    bar > 0.0 && bar < LONGEST_BAR * value.abs()
}

impl Entry<'_> {
    fn draw(&self, left: f64, middle: f64) -> Markup {
        let style = self.style % STYLES;
        let ends = [[left, middle], [left + SAMPLE, middle]];
        html! {
            g class="key" data-name=(visible(self.name)) {
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
