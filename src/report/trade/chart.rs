//! Cost against error: of the variants of a scene, and of the presets over scenes.

use super::page::{called, percent};
use super::scatter::{Mark, Scatter, Shape};
use super::{Cost, Row, Trade};
use crate::recipe::MotionKind;
use crate::scene::variants::{BALANCED, FAST, KnobKind, promise};

/// Errors below this are not told apart: a hundred-thousandth of a percent.
const FLOOR: f64 = 1e-7;

/// Colours after which the next groups are squares.
const COLOURS: usize = 10;

/// What goes upwards.
const ERROR: &str = "largest deviation from reference among the promised figures";

/// Of what is no solution with a known error.
const UNKNOWN: &str = "reference, error unknown";

fn levels() -> Vec<(f64, String)> {
    let promised = |name| {
        let promise = promise(name)?;
        Some((promise, format!("promise of {name}: {}", percent(promise))))
    };
    [FAST, BALANCED].into_iter().filter_map(promised).collect()
}

/// What a hollow mark at the lower edge stands for, if there is one.
fn below(marks: &[Mark]) -> Option<(usize, Shape, bool, String)> {
    let is_below = |mark: &Mark| mark.shape != Shape::Edge && mark.at[1] < FLOOR;
    let text = format!("hollow: below {}", percent(FLOOR));
    (marks.iter().any(is_below)).then_some((COLOURS - 1, Shape::Disc, true, text))
}

/// The chart of a scene: one point a variant, what it costs to the right, the worst of the promised errors upwards, with the Pareto
/// front as a line and the presets' promises as levels. The reference has no error, and stands at the edge.
pub fn chart(trade: &Trade) -> String {
    let is_shown = |row: &&Row| row.is_compared() && row.worst.is_some();
    let shown = || trade.rows.iter().filter(is_shown);
    let mut knobs: Vec<&str> = Vec::new();
    for row in shown() {
        if !knobs.contains(&row.variant.knob) {
            knobs.push(row.variant.knob);
        }
    }
    let look = |knob: &str| {
        let k = knobs.iter().position(|k| *k == knob).unwrap_or(0);
        let shape = if k < COLOURS {
            Shape::Disc
        } else {
            Shape::Square
        };
        (k % COLOURS, shape)
    };
    let noise = match trade.by {
        Cost::FftPairs => 0.0,
        Cost::Seconds => trade.noise.unwrap_or(0.0),
    };
    let mut rows: Vec<&Row> = shown().collect();
    // Presets are named first, then the front.
    let rank = |row: &Row| (row.variant.kind != KnobKind::Preset, !row.pareto);
    rows.sort_by(|a, b| rank(a).cmp(&rank(b)).then(a.cost.total_cmp(&b.cost)));
    let mark = |row: &&Row| {
        let (colour, shape) = look(row.variant.knob);
        let is_named = row.pareto || row.variant.kind == KnobKind::Preset;
        Mark {
            at: [row.cost, row.worst.unwrap_or(0.0)],
            colour,
            shape,
            noise,
            name: is_named.then(|| called(row)),
            is_named_anyhow: row.variant.kind == KnobKind::Preset,
        }
    };
    let marks = rows.iter().map(mark);
    let reference = trade.reference().map(|row| Mark {
        at: [row.cost, 0.0],
        colour: COLOURS - 1,
        shape: Shape::Edge,
        noise,
        name: Some(UNKNOWN.to_owned()),
        is_named_anyhow: true,
    });
    let marks: Vec<Mark> = reference.into_iter().chain(marks).collect();
    let mut line: Vec<[f64; 2]> = rows
        .iter()
        .filter(|row| row.pareto)
        .map(|row| [row.cost, row.worst.unwrap_or(0.0).max(FLOOR)])
        .collect();
    line.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let of_knob = |knob: &&str| {
        let (colour, shape) = look(knob);
        (colour, shape, false, (*knob).to_owned())
    };
    let reference = (COLOURS - 1, Shape::Edge, false, UNKNOWN.to_owned());
    let legend = knobs.iter().map(of_knob).chain([reference]);
    Scatter {
        title: format!("{}: error against cost", trade.name),
        axes: [cost_axis(trade), ERROR.to_owned()],
        levels: levels(),
        legend: legend.chain(below(&marks)).collect(),
        marks,
        line,
        floor: FLOOR,
    }
    .svg()
}

fn cost_axis(trade: &Trade) -> String {
    let clock = if trade.has_cpu() { "CPU" } else { "wall" };
    match (trade.by, trade.noise) {
        (Cost::FftPairs, _) if trade.rows.iter().any(|row| row.cost != row.fft_pairs) => {
            "FFT pairs, on other grids by their work".to_owned()
        }
        (Cost::FftPairs, _) => "FFT pairs".to_owned(),
        (Cost::Seconds, Some(noise)) => format!("{clock} seconds, noise ±{}", percent(noise)),
        (Cost::Seconds, None) => format!("{clock} seconds, of unknown noise"),
    }
}

/// The chart of several scenes: one point a scene and preset, its FFT pairs to the right, the worst of the promised errors upwards, in
/// the colour of the scene's motion. The references stand at the lower edge. Who breaks a promise is named.
pub fn chart_of_scenes(name: &str, trades: &[Trade]) -> String {
    let kinds = |trade: &Trade| {
        let mut all = MotionKind::ALL.iter();
        all.position(|kind| *kind == trade.motion).unwrap_or(0)
    };
    let (mut marks, mut references) = (Vec::new(), Vec::new());
    for trade in trades.iter().filter(|trade| trade.reference().is_some()) {
        for row in &trade.rows {
            if row.failure.is_some() || row.fft_pairs <= 0.0 {
                continue;
            }
            let mut mark = Mark {
                at: [row.fft_pairs, 0.0],
                colour: kinds(trade),
                shape: Shape::Edge,
                noise: 0.0,
                name: None,
                is_named_anyhow: true,
            };
            match (row.is_compared(), row.worst, promise(&row.variant.name)) {
                (true, Some(worst), Some(promise)) => {
                    mark.at[1] = worst;
                    mark.shape = shape_of(&row.variant.name);
                    mark.name = (worst > promise).then(|| trade.name.clone());
                    marks.push(mark);
                }
                (false, ..) => references.push(mark),
                _ => (),
            }
        }
    }
    let shown = |kind: &&MotionKind| trades.iter().any(|trade| trade.motion == **kind);
    let motions = MotionKind::ALL.iter().enumerate();
    let motions = motions.filter(|(_, kind)| shown(kind));
    let motions = motions.map(|(k, kind)| (k, Shape::Disc, false, kind.word().to_owned()));
    let grey = COLOURS - 1;
    let shapes = [FAST, BALANCED].map(|name| (grey, shape_of(name), false, name.to_owned()));
    let reference = (grey, Shape::Edge, false, UNKNOWN.to_owned());
    let legend = motions
        .chain(shapes)
        .chain([reference])
        .chain(below(&marks))
        .collect();
    references.extend(marks);
    Scatter {
        title: format!("{name}: error of the presets against cost"),
        axes: ["FFT pairs of a run".to_owned(), ERROR.to_owned()],
        levels: levels(),
        legend,
        marks: references,
        line: Vec::new(),
        floor: FLOOR,
    }
    .svg()
}

fn shape_of(preset: &str) -> Shape {
    match preset {
        FAST => Shape::Square,
        _ => Shape::Disc,
    }
}
