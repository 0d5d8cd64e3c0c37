//! Profile and pressure along a line through the deepest point of wear, as they change with the cycles.

use super::super::ReportError;
use super::super::plot::{Axis, Chart, Curve, style_of_state};
use super::super::quantity::{self, LENGTH, PRESSURE, Unit, shown, unit_of};
use super::course::labelled;
use super::surface::{deepest, name_of, titled};
use super::{Figure, Of, Study, drawn, range_of};
use crate::tables::TableName;

/// Part of the joint's length that a section shows.
const WINDOW: f64 = 0.25;
/// States of wear of a single run; of several runs the first and the last each.
const STATES: usize = 5;
/// One millimetre \[m\].
const MM: f64 = 1e-3;

/// Name of a state of wear, heights \[m\], pressures \[Pa\].
type State = (String, Vec<f64>, Vec<f64>);

/// Profiles and pressures of a run along its line, in the order of wear.
struct Section<'a> {
    run: &'a Of<'a>,
    /// Abscissae \[mm\].
    x: Vec<f64>,
    states: Vec<State>,
    /// Heights of the deepest point before and after.
    ends: [f64; 2],
}

/// The sections of all runs through the deepest points of their worn depth.
///
/// # Errors
/// [`ReportError`] for a table that cannot be read and for a figure that cannot be drawn.
pub fn figure(study: &Study, fields: &[(&Of, Vec<f64>)]) -> Result<Figure, ReportError> {
    const ID: &str = "section";
    let mut sections = Vec::new();
    for (run, depth) in fields {
        sections.extend(section(study, run, depth)?);
    }
    let all = |of: fn(&State) -> &Vec<f64>| -> Vec<f64> {
        let states = sections.iter().flat_map(|section| &section.states);
        states.flat_map(of).copied().collect()
    };
    let (heights, pressures) = (all(|state| &state.1), all(|state| &state.2));
    let units = [
        unit_of(LENGTH, quantity::largest(&heights)),
        unit_of(PRESSURE, quantity::largest(&pressures)),
    ];
    let (mut drawings, mut each) = (Vec::new(), Vec::new());
    for section in &sections {
        let chart = |name: &str, unit: Unit, all: &[f64], of: fn(&State) -> &Vec<f64>| {
            let curves = section.states.iter().enumerate().map(|(k, state)| {
                let points = section.x.iter().zip(of(state));
                let points = points.map(|(x, value)| [*x, value / unit.size]).collect();
                Curve::line(&state.0, style_of_state(k, section.states.len()), points)
            });
            Chart {
                title: titled(study, section.run, name),
                x: Axis {
                    label: "x / mm".to_owned(),
                    ..Axis::default()
                },
                y: Axis {
                    label: labelled(if name == "profile" { "height" } else { name }, unit.symbol),
                    // The same for all runs.
                    range: range_of(all).map(|range| roomy(range.map(|end| end / unit.size))),
                    ..Axis::default()
                },
                curves: curves.collect(),
            }
        };
        drawings.push(
            chart("profile", units[0], &heights, |state| &state.1)
                .draw()
                .map_err(drawn(ID))?,
        );
        drawings.push(
            chart("pressure", units[1], &pressures, |state| &state.2)
                .draw()
                .map_err(drawn(ID))?,
        );
        each.push(format!(
            "{}the height there falls from {} to {}",
            name_of(study, section.run),
            shown(section.ends[0], LENGTH),
            shown(section.ends[1], LENGTH)
        ));
    }
    let columns = vec!["i", "j", "pressure"];
    let between = match study.is_single() && sections.iter().any(|section| section.states.len() > 2)
    {
        true => {
            " States between the first and the last are those nearest to even steps of the logarithm of the cycles."
        }
        false => "",
    };
    Ok(Figure {
        id: ID,
        title: "Section through the deepest point".to_owned(),
        drawings,
        caption: format!(
            "Profile and pressure along x about the deepest point of wear: {}.{between}",
            each.join("; ")
        ),
        query: study.query_last("contact_field", &columns),
        sources: vec![
            ("surface", vec!["height"]),
            ("wear_field", vec!["wear_depth"]),
            ("contact_field", columns),
        ],
    })
}

/// A range with air to both sides; what begins at 0 stays there.
fn roomy([low, high]: [f64; 2]) -> [f64; 2] {
    let air = 0.05 * (high - low).max(f64::MIN_POSITIVE.sqrt());
    [if low == 0.0 { 0.0 } else { low - air }, high + air]
}

fn section<'a>(
    study: &Study,
    run: &'a Of<'a>,
    depth: &[f64],
) -> Result<Option<Section<'a>>, ReportError> {
    let (Some((cells, size)), Some(heights)) = (run.grid(), run.heights()?) else {
        return Ok(None);
    };
    let cell = deepest(depth);
    let (column, row) = (cell / cells[1], cell % cells[1]);
    let half = ((cells[0] as f64 * WINDOW / 2.0).round() as usize).max(8);
    let begin = column
        .saturating_sub(half)
        .min(cells[0].saturating_sub(2 * half));
    let end = (begin + 2 * half + 1).min(cells[0]);
    let along =
        |values: &[f64]| -> Vec<f64> { (begin..end).map(|i| values[i * cells[1] + row]).collect() };
    let most = if study.is_single() { STATES } else { 2 };
    let mut states = Vec::new();
    for k in run.along_wear(&[TableName::WearField, TableName::ContactField], most) {
        let fields = (
            run.field(k, TableName::WearField, "wear_depth")?,
            run.field(k, TableName::ContactField, "pressure")?,
        );
        if let (Some(worn), Some(pressure)) = fields {
            let worn: Vec<f64> = heights.iter().zip(&worn).map(|(h, d)| h - d).collect();
            states.push((run.state(k), along(&worn), along(&pressure)));
        }
    }
    Ok(Some(Section {
        run,
        x: (begin..end)
            .map(|i| (i as f64 + 0.5) * size[0] / cells[0] as f64 / MM)
            .collect(),
        states,
        ends: [heights[cell], heights[cell] - depth[cell]],
    }))
}
