//! The figures of a report: what a run computed, and nothing for what it did not.

mod course;
mod elements;
mod loops;
mod pressure;
mod response;
mod section;
mod smooth;
mod states;
mod static_contact;
mod structure;
mod study;
mod surface;

use polars::prelude::DataFrame;

pub use study::{ReportedRun, Study};
pub use surface::{titled, with_run_name};

use super::ReportError;
use super::plot::{Curve, Drawing, Mark};
use super::run_tables::numbers;

/// A figure: drawings with what they show, in words and in numbers, and where the numbers come from.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Its name in the page and in files, of letters, digits and hyphens.
    pub id: &'static str,
    /// Heading.
    pub title: String,
    /// The drawings, in the order of reading.
    pub drawings: Vec<Drawing>,
    /// What several states are called, each with as many of the drawings, of which one is seen at a time; none where all are.
    pub states: Vec<String>,
    /// What is seen, with its numbers.
    pub caption: String,
    /// Table and columns that it is drawn from.
    pub sources: Vec<(&'static str, Vec<&'static str>)>,
    /// Reads the same data with Polars.
    pub query: String,
}

/// What matters first: how the joint vibrates, where it is worn, how much, and how stiff it is or where it resonates.
const FIRST: [&str; 3] = ["forced-response", "wear-map", "wear-rate"];
/// The fourth of them, the first that there is.
const FOURTH: [&str; 2] = ["resonance", "stiffness"];
/// How many figures stand apart from the others.
pub const MAIN: usize = 4;

/// All figures that the runs have the physics for: first those that matter first, then the others in the order of the paper.
///
/// # Errors
/// [`ReportError`] for a table that cannot be read and for a figure that cannot be drawn.
pub fn figures(study: &Study) -> Result<Vec<Figure>, ReportError> {
    let mut figures = surface::figures(study)?;
    figures.extend(response::figures(study)?);
    figures.extend(surface::wear_figures(study)?);
    figures.extend(states::figure(study)?);
    figures.extend(course::figures(study)?);
    figures.extend(pressure::figures(study)?);
    figures.extend(loops::figures(study)?);
    figures.extend(structure::figures(study)?);
    figures.extend(elements::figures(study)?);
    figures.extend(static_contact::figures(study)?);
    let there = |id: &&&str| figures.iter().any(|figure| figure.id == **id);
    let first: Vec<&str> = FIRST
        .iter()
        .chain(FOURTH.iter().find(there))
        .copied()
        .collect();
    let place = |figure: &Figure| first.iter().position(|id| *id == figure.id);
    // The sort keeps the order of those that are not among the first.
    figures.sort_by_key(|figure| place(figure).unwrap_or(first.len()));
    Ok(figures)
}

/// The points that two columns make, in the units of the axes; none where a column is missing.
fn points(frame: &DataFrame, x: &str, y: &str, sizes: [f64; 2]) -> Option<Vec<[f64; 2]>> {
    let (x, y) = (numbers(frame, x)?, numbers(frame, y)?);
    let pairs = x.into_iter().zip(y);
    Some(pairs.map(|(x, y)| [x / sizes[0], y / sizes[1]]).collect())
}

/// A line with dots.
fn dotted(name: &str, style: usize, points: Vec<[f64; 2]>) -> Curve {
    Curve {
        mark: Mark::Dots,
        ..Curve::line(name, style, points)
    }
}

/// The range that holds all values, from 0 where it begins near it.
fn range_of<'a>(values: impl IntoIterator<Item = &'a f64>) -> Option<[f64; 2]> {
    let empty = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = values
        .into_iter()
        .filter(|value| value.is_finite())
        .fold(empty, |[low, high], v| [low.min(*v), high.max(*v)]);
    (low <= high).then_some([low, high])
}

/// The range of a map's colours: all values but the outermost, which have the colour of its end.
fn scale_of<'a>(values: impl IntoIterator<Item = &'a f64>) -> Option<[f64; 2]> {
    let finite = values.into_iter().copied().filter(|v| v.is_finite());
    let mut sorted: Vec<f64> = finite.collect();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let at = |part: f64| sorted[(part * last as f64).round() as usize];
    Some([at(OUTERMOST), at(1.0 - OUTERMOST)])
}

/// The upper end of a map's colours of what is zero in most cells: those do not count, so that a few that bear or are worn are seen.
fn top_of<'a>(values: impl IntoIterator<Item = &'a f64>) -> Option<f64> {
    let above = values.into_iter().filter(|value| **value > 0.0);
    scale_of(above).map(|[_, top]| top)
}

/// Part of the values, at either end, beyond the colours of a map.
const OUTERMOST: f64 = 1e-3;

/// A range of some width.
fn widened([low, high]: [f64; 2]) -> [f64; 2] {
    if high > low {
        [low, high]
    } else {
        let reach = (0.05 * high.abs()).max(1e-12);
        [low - reach, high + reach]
    }
}
