//! Axes of charts and maps: positions of values, ticks and their numbers.

use maud::{Markup, html};

use super::super::quantity::significant_digits;
use super::{TEXT, line, text, text_width, two};

/// Axis of a chart.
#[derive(Debug, Clone, Default)]
pub struct Axis {
    /// Label: quantity and unit.
    pub label: String,
    /// True for a logarithmic axis.
    pub log: bool,
    /// Value at whose position a logarithmic axis shows 0: a power of ten below all values. `None` if the axis does not
    /// show 0.
    pub zero: Option<f64>,
    /// Fixed range. `None` for the range of the curves.
    pub range: Option<[f64; 2]>,
}

/// Maximum number of ticks.
const MOST: f64 = 6.0;
/// Length of a tick.
const TICK: f64 = 5.0;

impl Axis {
    /// Returns the value at whose position a value is drawn.
    pub fn drawn_value(&self, value: f64) -> f64 {
        match self.zero {
            Some(zero) if self.log && value == 0.0 => zero,
            _ => value,
        }
    }

    /// Formats the number at a tick.
    fn number(&self, value: f64, range: [f64; 2]) -> String {
        match self.zero {
            Some(zero) if self.log && (value / zero - 1.0).abs() < 1e-6 => "0".to_owned(),
            _ => tick(value, range, self.log),
        }
    }

    /// Returns the width of the widest number at the ends, in units of the page.
    pub fn widest(&self, range: [f64; 2]) -> f64 {
        let widths = range.map(|end| text_width(&tick(end, range, self.log)));
        widths[0].max(widths[1])
    }
}

/// Axis in a drawing.
pub struct PlacedAxis<'a> {
    axis: &'a Axis,
    /// Positions of its ends.
    ends: [f64; 2],
    /// Values at its ends.
    pub range: [f64; 2],
}

impl<'a> PlacedAxis<'a> {
    pub fn new(axis: &'a Axis, ends: [f64; 2], range: [f64; 2]) -> Self {
        PlacedAxis { axis, ends, range }
    }

    /// Returns the position of a value.
    pub fn position(&self, value: f64) -> f64 {
        let [low, high] = self.range;
        let part = match self.axis.log {
            true => (value / low).ln() / (high / low).ln(),
            false => (value - low) / (high - low),
        };
        self.ends[0] + part * (self.ends[1] - self.ends[0])
    }

    /// Returns the data attribute of the axis for the script of the page. The attribute lists the positions and the
    /// values of both ends, the kind of the axis, the position of 0, and the label.
    pub fn data(&self) -> String {
        let ([begin, end], [low, high]) = (self.ends.map(two), self.range);
        let kind = match self.axis.log {
            true => format!("log {}", self.axis.zero.unwrap_or(0.0)),
            false => "lin 0".to_owned(),
        };
        format!("{begin} {end} {low} {high} {kind} {}", self.axis.label)
    }

    /// Returns the values of the ticks, as many as have room.
    fn ticks(&self, is_upright: bool) -> Vec<f64> {
        let room = (self.ends[1] - self.ends[0]).abs();
        let each = match is_upright {
            true => 2.4 * TEXT,
            false => 16.0 + self.axis.widest(self.range),
        };
        ticks(self.range, self.axis.log, MOST.min(room / each).max(1.0))
    }

    /// Draws the ticks of the axis, the numbers at the ticks and the grid lines. `across` contains the positions of
    /// both ends of the perpendicular axis. The ordinate is upright.
    pub fn draw(&self, is_upright: bool, across: [f64; 2]) -> Markup {
        let [near, far] = across;
        let tick_end = near - (far - near).signum() * TICK;
        let number_edge = tick_end - (far - near).signum() * 3.0;
        let anchor = if far > near { "end" } else { "start" };
        html! {
            g data-ticks=(if is_upright { "y" } else { "x" }) {
                @for value in self.ticks(is_upright) {
                    @let (at, number) = (self.position(value), self.axis.number(value, self.range));
                    @if is_upright {
                        (line("grid", 1.0, [near, at], [far, at]))
                        (line("axis", 1.0, [tick_end, at], [near, at]))
                        (text(&number, [number_edge, at], anchor))
                    } @else {
                        (line("grid", 1.0, [at, near], [at, far]))
                        (line("axis", 1.0, [at, near], [at, near + TICK]))
                        (text(&number, [at, near + TICK + 0.8 * TEXT], "middle"))
                    }
                }
            }
        }
    }
}

/// Returns about `most` round values within a range.
pub fn ticks([low, high]: [f64; 2], log: bool, most: f64) -> Vec<f64> {
    let decades = (high / low).log10();
    if log && decades >= 1.0 {
        let (first, last) = (low.log10().ceil() as i32, high.log10().floor() as i32);
        let powers = f64::from(last - first + 1);
        let parts: &[f64] = match powers * 3.0 <= most {
            true => &[1.0, 2.0, 5.0],
            false => &[1.0],
        };
        let step = (powers / most).ceil().max(1.0) as usize;
        let each = (first - 1..=last).rev().step_by(step);
        let mut values: Vec<f64> = each
            .flat_map(|power| parts.iter().map(move |part| part * 10f64.powi(power)))
            .filter(|value| (low..=high).contains(value))
            .collect();
        values.sort_by(f64::total_cmp);
        return values;
    }
    let raw = (high - low) / most;
    let power = 10f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|part| part * power);
    let step = step.into_iter().find(|step| *step >= raw * (1.0 - 1e-9));
    let step = step.unwrap_or(10.0 * power);
    let (first, last) = ((low / step - 1e-9).ceil(), (high / step + 1e-9).floor());
    let count = if (last - first).is_finite() {
        (last - first).max(-1.0) as usize + 1
    } else {
        0
    };
    (0..count).map(|k| (first + k as f64) * step).collect()
}

/// Formats the number at a tick. The number has the digits that distinguish it from the neighbouring ticks, without
/// rounding errors.
pub fn tick(value: f64, [low, high]: [f64; 2], log: bool) -> String {
    let span = high - low;
    if log || value.abs() >= 1e6 || span < 1e-6 {
        return significant_digits(value, 6);
    }
    // The step between two ticks is at least a twelfth of the axis.
    let decimals = (12.0 / span).log10().ceil().max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    let rounded: f64 = text.parse().unwrap_or(value);
    significant_digits(rounded, 12)
}
