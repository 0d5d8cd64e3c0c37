//! Figures of a report. A report has no figure of physics that the runs do not include.

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

pub use study::{ReportedRun, ReportedRuns};
pub use surface::{heading, with_run_name};

use super::ReportError;
use super::plot::{Curve, Drawing, Mark};
use super::run_tables::numeric_column;

/// Figure of a report: drawings with a caption and the source of the data.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Id in the page and in file names: letters, digits and hyphens.
    pub id: &'static str,
    /// Heading.
    pub title: String,
    /// The drawings, in the order of reading.
    pub drawings: Vec<Drawing>,
    /// Names of the states of wear, if a slider selects one state at a time. Each state has an equal number of
    /// drawings. Empty if all drawings are visible.
    pub states: Vec<String>,
    /// Caption, with the numbers of the figure.
    pub caption: String,
    /// Tables and columns with the data of the drawings.
    pub sources: Vec<(&'static str, Vec<&'static str>)>,
    /// Python expression that reads the same data with Polars.
    pub query: String,
}

/// First three main figures of the report, in order: the forced response, the wear map and the wear rate.
const FIRST: [&str; 3] = ["forced-response", "wear-map", "wear-rate"];
/// Candidates for the fourth main figure. The report shows the first candidate that exists.
const FOURTH: [&str; 2] = ["resonance", "stiffness"];
/// Number of main figures.
pub const MAIN: usize = 4;

/// Draws all figures for the physics of the runs. The main figures come first. The other figures follow in the order of
/// the paper.
///
/// # Errors
/// Returns [`ReportError`] if the program cannot read a table or cannot draw a figure.
pub fn figures(study: &ReportedRuns) -> Result<Vec<Figure>, ReportError> {
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
    let exists = |id: &&&str| figures.iter().any(|figure| figure.id == **id);
    let first: Vec<&str> = FIRST
        .iter()
        .chain(FOURTH.iter().find(exists))
        .copied()
        .collect();
    let place = |figure: &Figure| first.iter().position(|id| *id == figure.id);
    // The sort is stable, so the figures that are not main figures keep their order.
    figures.sort_by_key(|figure| place(figure).unwrap_or(first.len()));
    Ok(figures)
}

/// Returns the points of two columns in the units of the axes. Returns `None` if a column is missing.
fn points(frame: &DataFrame, x: &str, y: &str, sizes: [f64; 2]) -> Option<Vec<[f64; 2]>> {
    let (x, y) = (numeric_column(frame, x)?, numeric_column(frame, y)?);
    let pairs = x.into_iter().zip(y);
    Some(pairs.map(|(x, y)| [x / sizes[0], y / sizes[1]]).collect())
}

/// Creates a line with dots.
fn dotted(name: &str, style: usize, points: Vec<[f64; 2]>) -> Curve {
    Curve {
        mark: Mark::Dots,
        ..Curve::line(name, style, points)
    }
}

/// Returns the range of the finite values.
fn range_of<'a>(values: impl IntoIterator<Item = &'a f64>) -> Option<[f64; 2]> {
    let empty = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = values
        .into_iter()
        .filter(|value| value.is_finite())
        .fold(empty, |[low, high], v| [low.min(*v), high.max(*v)]);
    (low <= high).then_some([low, high])
}

/// Returns the range of values that the colours of a map cover. A few extreme values lie outside the range. The map
/// draws such values in the colour of the nearest end of the range.
fn colour_range<'a>(values: impl IntoIterator<Item = &'a f64>) -> Option<[f64; 2]> {
    let finite = values.into_iter().copied().filter(|v| v.is_finite());
    let mut sorted: Vec<f64> = finite.collect();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let at = |part: f64| sorted[(part * last as f64).round() as usize];
    Some([at(OUTERMOST), at(1.0 - OUTERMOST)])
}

/// Returns the upper end of the colours for a field that is zero in most cells. The upper end depends only on the
/// positive values, so that a few loaded or worn cells stay visible.
fn colour_top<'a>(values: impl IntoIterator<Item = &'a f64>) -> Option<f64> {
    let positive = values.into_iter().filter(|value| **value > 0.0);
    colour_range(positive).map(|[_, top]| top)
}

/// Part of the values, at each end, that lies beyond the colours of a map.
const OUTERMOST: f64 = 1e-3;

/// Widens an empty range.
fn widened([low, high]: [f64; 2]) -> [f64; 2] {
    if high > low {
        [low, high]
    } else {
        let reach = (0.05 * high.abs()).max(1e-12);
        [low - reach, high + reach]
    }
}
