//! Cost against error, both logarithmic, as SVG.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::super::text::visible;
use super::{Row, Trade, TradeError};
use crate::scene::variants::{BALANCED, FAST, KnobKind, promise};

/// Size of the drawing, in its own units.
const SIZE: (u32, u32) = (960, 600);

/// One colour a knob, in their order; after the last it begins again.
const COLOURS: [RGBColor; 10] = [
    RGBColor(31, 119, 180),
    RGBColor(214, 39, 40),
    RGBColor(44, 160, 44),
    RGBColor(255, 127, 14),
    RGBColor(148, 103, 189),
    RGBColor(140, 86, 75),
    RGBColor(227, 119, 194),
    RGBColor(23, 190, 207),
    RGBColor(188, 189, 34),
    RGBColor(70, 70, 70),
];

/// Width of what the colours stand for, to the right of the chart.
const LEGEND: i32 = 180;

/// Errors of zero have no logarithm: they stand this far below the least that has one.
const BELOW: f64 = 10.0;

/// Width of a letter of a name, about, and height of its line.
const LETTER: i32 = 6;

/// See [`LETTER`].
const LINE: i32 = 12;

/// The least error drawn where all are zero.
const LEAST: f64 = 1e-6;

/// A time below the resolution of the clock.
const SHORTEST: f64 = 1e-6;

/// What of a row is drawn.
struct Point<'a> {
    row: &'a Row,
    seconds: f64,
    error: f64,
    /// True for an error of zero, drawn hollow at the lower edge.
    exact: bool,
}

/// The chart of a trade: one point a variant, seconds to the right, the worst of the promised errors upwards, with the Pareto
/// front as a line and the presets' promises as levels.
///
/// # Errors
/// [`TradeError::Chart`]
pub fn chart(trade: &Trade) -> Result<String, TradeError> {
    let mut svg = String::new();
    let drawn = {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        draw(&area, trade, &points(trade)).and_then(|()| area.present().map_err(said))
    };
    // The drawing library escapes labels, but for what XML does not allow at all.
    drawn.map(|()| visible(&svg))
}

fn said(error: impl std::fmt::Display) -> TradeError {
    TradeError::Chart {
        reason: error.to_string(),
    }
}

fn points(trade: &Trade) -> Vec<Point<'_>> {
    let known = |row: &&Row| row.variant.kind != KnobKind::Model;
    let rows: Vec<(&Row, f64)> = trade
        .rows
        .iter()
        .filter(known)
        .filter_map(|row| Some((row, row.worst?)))
        .collect();
    let least = rows
        .iter()
        .map(|(_, worst)| *worst)
        .filter(|error| *error > 0.0)
        .fold(f64::INFINITY, f64::min);
    let floor = if least.is_finite() {
        least / BELOW
    } else {
        LEAST
    };
    let mut points: Vec<Point> = rows
        .into_iter()
        .map(|(row, worst)| Point {
            row,
            seconds: row.seconds.max(SHORTEST),
            error: worst.max(floor),
            exact: worst == 0.0,
        })
        .collect();
    points.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    points
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

fn draw(area: &Area, trade: &Trade, points: &[Point]) -> Result<(), TradeError> {
    area.fill(&WHITE).map_err(said)?;
    let (area, legend) = area.split_horizontally(SIZE.0 as i32 - LEGEND);
    let promises = [BALANCED, FAST].map(|name| (name, promise(name).unwrap_or(LEAST)));
    let range = |values: &mut dyn Iterator<Item = f64>, margin: [f64; 2]| {
        let (low, high) = values.fold((f64::INFINITY, 0.0f64), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        // Without points there is still a chart to look at.
        let (low, high) = if low.is_finite() {
            (low, high)
        } else {
            (0.1, 10.0)
        };
        low / margin[0]..high * margin[1]
    };
    // Room for the names to the right of the points.
    let seconds = range(&mut points.iter().map(|point| point.seconds), [1.5, 2.5]);
    let errors = points.iter().map(|point| point.error);
    let errors = range(&mut errors.chain(promises.map(|p| p.1)), [2.0, 2.0]);
    let mut chart = ChartBuilder::on(&area)
        .margin(16)
        .caption(
            format!("{}: worst promised error against cost", trade.name),
            ("sans-serif", 18),
        )
        .x_label_area_size(44)
        .y_label_area_size(72)
        .build_cartesian_2d(seconds.clone().log_scale(), errors.log_scale())
        .map_err(said)?;
    chart
        .configure_mesh()
        .max_light_lines(1)
        .bold_line_style(RGBColor(220, 220, 220))
        .x_desc("seconds")
        .y_desc("error against reference")
        .x_label_formatter(&|seconds| short(*seconds))
        .y_label_formatter(&|error| format!("{} %", short(error * 100.0)))
        .label_style(("sans-serif", 13))
        .draw()
        .map_err(said)?;
    let grey = RGBColor(120, 120, 120);
    for (name, promise) in promises {
        let level = [(seconds.start, promise), (seconds.end, promise)];
        chart
            .draw_series(LineSeries::new(level, grey.stroke_width(1)))
            .map_err(said)?;
        let text = format!("promise of {name}");
        let right = Pos::new(HPos::Right, VPos::Bottom);
        let style = ("sans-serif", 12).into_font().color(&grey).pos(right);
        let label = EmptyElement::at((seconds.end, promise)) + Text::new(text, (-4, -2), style);
        chart.draw_series([label]).map_err(said)?;
    }
    let front = points.iter().filter(|point| point.row.pareto);
    let line = front.map(|point| (point.seconds, point.error));
    chart
        .draw_series(LineSeries::new(line, BLACK.stroke_width(1)))
        .map_err(said)?;
    let mut knobs: Vec<&str> = Vec::new();
    for row in &trade.rows {
        if !knobs.contains(&row.variant.knob) {
            knobs.push(row.variant.knob);
        }
    }
    for (k, knob) in knobs.into_iter().enumerate() {
        let colour = COLOURS[k % COLOURS.len()];
        let mark = |at: (i32, i32), exact: bool| {
            let style = if exact {
                colour.stroke_width(2)
            } else {
                colour.filled()
            };
            // Once the colours are through, the next knobs are squares.
            let radius = 5;
            let square = k >= COLOURS.len();
            let corners = [
                (at.0 - radius, at.1 - radius),
                (at.0 + radius, at.1 + radius),
            ];
            let square = square.then(|| Rectangle::new(corners, style).into_dyn());
            square.unwrap_or_else(|| Circle::new(at, radius, style).into_dyn())
        };
        for point in points.iter().filter(|point| point.row.variant.knob == knob) {
            let at = chart.backend_coord(&(point.seconds, point.error));
            area.draw(&mark(area_at(&area, at), point.exact))
                .map_err(said)?;
        }
        let at = (12, 60 + 22 * k as i32);
        legend.draw(&mark(at, false)).map_err(said)?;
        let text = Text::new(knob, (at.0 + 14, at.1 - 7), ("sans-serif", 13));
        legend.draw(&text).map_err(said)?;
    }
    let named = points
        .iter()
        .filter(|point| point.row.pareto || point.row.variant.kind == KnobKind::Preset);
    let mut taken: Vec<Place> = Vec::new();
    for point in named {
        let name = &point.row.variant.name;
        let at = chart.backend_coord(&(point.seconds, point.error));
        // Above the front first, where nothing else is.
        let corners = [
            (8i32, -4i32, HPos::Left, VPos::Bottom),
            (8, 4, HPos::Left, VPos::Top),
            (-8, 4, HPos::Right, VPos::Top),
            (-8, -4, HPos::Right, VPos::Bottom),
        ];
        let places = corners.map(|(dx, dy, ..)| {
            let (width, height) = (dx.signum() * LETTER * name.len() as i32, dy.signum() * LINE);
            let (x, y) = (at.0 + dx, at.1 + dy);
            [
                x.min(x + width),
                y.min(y + height),
                x.max(x + width),
                y.max(y + height),
            ]
        });
        let free = |place: &Place| !taken.iter().any(|other| overlap(place, other));
        let k = places.iter().position(free).unwrap_or(0);
        taken.push(places[k]);
        let (dx, dy, horizontal, vertical) = corners[k];
        let style = ("sans-serif", 12).into_font().color(&BLACK);
        let style = style.pos(Pos::new(horizontal, vertical));
        let (x, y) = area_at(&area, at);
        let text = Text::new(name.clone(), (x + dx, y + dy), style);
        area.draw(&text).map_err(said)?;
    }
    Ok(())
}

/// Left, top, right and bottom of a name.
type Place = [i32; 4];

fn overlap(a: &Place, b: &Place) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// A place of the whole drawing in the coordinates of a part of it.
fn area_at(area: &Area, (x, y): (i32, i32)) -> (i32, i32) {
    let (left, top) = area.get_base_pixel();
    (x - left, y - top)
}

/// Three significant digits at most, without zeros at the end.
fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    if (1e-3..1e5).contains(&rounded) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}
