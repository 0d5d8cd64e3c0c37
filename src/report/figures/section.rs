//! Figure of the profile and the pressure along a line through the deepest point of wear.
//!
//! The line is the same for all runs. The curves show several states of wear.

use super::super::ReportError;
use super::super::plot::{Axis, BEFORE_ZERO, Chart, Curve, style_of_state};
use super::super::quantity::{self, LENGTH, PRESSURE, Unit, unit_of, with_best_unit, with_unit};
use super::course::axis_label;
use super::surface::{heading, name_of};
use super::{Figure, ReportedRun, ReportedRuns, range_of};
use crate::tables::TableName;

/// Part of the joint's length that a section shows.
const WINDOW: f64 = 0.25;
/// Maximum number of states of wear of a single run. In a report of several runs, each run shows two states: the first
/// state and the last state.
const STATES: usize = 5;
/// One millimetre \[m\].
const MM: f64 = 1e-3;
/// Ratio of the largest to the smallest peak pressure above which the pressure axis is logarithmic.
const DECADE: f64 = 10.0;
/// Lower end of a logarithmic pressure axis, relative to the largest pressure.
const LEAST: f64 = 1e-4;

/// State of wear: name, heights \[m\], pressures \[Pa\].
type State = (String, Vec<f64>, Vec<f64>);

/// Section of a run: profiles and pressures, in the order of wear.
struct Section<'a> {
    run: &'a ReportedRun<'a>,
    /// Abscissae \[mm\].
    x: Vec<f64>,
    states: Vec<State>,
    /// First and last height of the point that the line passes through \[m\].
    ends: [f64; 2],
}

/// Draws the sections of all runs along x through the point `line` \[m\].
///
/// # Errors
/// Returns [`ReportError`] if the program cannot read a table or cannot draw a figure.
pub fn figure(
    study: &ReportedRuns,
    fields: &[(&ReportedRun, Vec<f64>)],
    line: [f64; 2],
) -> Result<Figure, ReportError> {
    const ID: &str = "section";
    let mut sections = Vec::new();
    for (run, depth) in fields {
        sections.extend(section(study, run, depth, line)?);
    }
    let all = |values_of: fn(&State) -> &Vec<f64>| -> Vec<f64> {
        let states = sections.iter().flat_map(|section| &section.states);
        states.flat_map(values_of).copied().collect()
    };
    let (heights, pressures) = (all(|state| &state.1), all(|state| &state.2));
    let units = [
        unit_of(LENGTH, quantity::largest(&heights)),
        unit_of(PRESSURE, quantity::largest(&pressures)),
    ];
    let (mut drawings, mut each) = (Vec::new(), Vec::new());
    let pressure_axis = common_pressure_axis(&sections, &pressures, units[1]);
    for section in &sections {
        let chart = |name: &str, unit: Unit, y: &Axis, values_of: fn(&State) -> &Vec<f64>| {
            let curves = section.states.iter().enumerate().map(|(k, state)| {
                let points = section.x.iter().zip(values_of(state));
                // A logarithmic axis shows smaller values at the position of zero.
                let placed = |value: f64| match y.zero {
                    Some(zero) if value < zero => 0.0,
                    _ => value,
                };
                let points = points
                    .map(|(x, value)| [*x, placed(value / unit.size)])
                    .collect();
                Curve::line(&state.0, style_of_state(k, section.states.len()), points)
            });
            let chart = Chart {
                title: heading(study, section.run, name),
                x: Axis {
                    label: "x / mm".to_owned(),
                    ..Axis::default()
                },
                y: y.clone(),
                curves: curves.collect(),
                ..Chart::default()
            };
            Ok(chart.draw())
        };
        let height_axis = Axis {
            label: axis_label("height", units[0].symbol),
            // All runs have the same range.
            range: range_of(&heights)
                .map(|range| with_margins(range.map(|end| end / units[0].size))),
            ..Axis::default()
        };
        drawings.push(chart("profile", units[0], &height_axis, |state| &state.1)?);
        drawings.push(chart("pressure", units[1], &pressure_axis, |state| {
            &state.2
        })?);
        each.push(format!(
            "{}its height falls from {} to {}",
            name_of(study, section.run),
            with_unit(section.ends[0], units[0]),
            with_unit(section.ends[1], units[0])
        ));
    }
    let columns = vec!["i", "j", "pressure"];
    let between = match study.is_single() && sections.iter().any(|section| section.states.len() > 2)
    {
        true => {
            " The intermediate states are those closest to equal steps in the logarithm of the cycles."
        }
        false => "",
    };
    Ok(Figure {
        id: ID,
        title: "Section through the deepest point".to_owned(),
        drawings,
        states: Vec::new(),
        caption: format!(
            "Profile and pressure along x about the deepest point of wear{}, x {} and y {}: {}.{between}",
            if study.is_single() {
                ""
            } else {
                " of all runs"
            },
            with_best_unit(line[0], LENGTH),
            with_best_unit(line[1], LENGTH),
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

/// Returns the pressure axis, which is the same for all runs. The pressure axis is logarithmic if the peak pressures of
/// the states differ by a decade.
fn common_pressure_axis(sections: &[Section], pressures: &[f64], unit: Unit) -> Axis {
    let label = axis_label("pressure", unit.symbol);
    let states = sections.iter().flat_map(|section| &section.states);
    let peaks: Vec<f64> = states
        .map(|state| quantity::largest(&state.2))
        .filter(|peak| *peak > 0.0)
        .collect();
    let most = quantity::largest(&peaks);
    let least = peaks.iter().copied().fold(f64::INFINITY, f64::min);
    if most < DECADE * least {
        return Axis {
            label,
            range: range_of(pressures).map(|range| with_margins(range.map(|end| end / unit.size))),
            ..Axis::default()
        };
    }
    let zero = 10f64.powf((LEAST * most / unit.size).log10().floor());
    Axis {
        label,
        log: true,
        zero: Some(zero),
        range: Some([BEFORE_ZERO * zero, 2.0 * most / unit.size]),
    }
}

/// Adds margins to a range. A lower end of 0 stays.
fn with_margins([low, high]: [f64; 2]) -> [f64; 2] {
    let air = 0.05 * (high - low).max(f64::MIN_POSITIVE.sqrt());
    [if low == 0.0 { 0.0 } else { low - air }, high + air]
}

fn section<'a>(
    study: &ReportedRuns,
    run: &'a ReportedRun<'a>,
    depth: &[f64],
    line: [f64; 2],
) -> Result<Option<Section<'a>>, ReportError> {
    let (Some((cells, size)), Some(heights)) = (run.grid(), run.heights()?) else {
        return Ok(None);
    };
    let [column, row] = [0, 1].map(|d| {
        let part = line[d] / size[d] * cells[d] as f64;
        (part as usize).min(cells[d] - 1)
    });
    let cell = column * cells[1] + row;
    let half = ((cells[0] as f64 * WINDOW / 2.0).round() as usize).max(8);
    let begin = column
        .saturating_sub(half)
        .min(cells[0].saturating_sub(2 * half));
    let end = (begin + 2 * half + 1).min(cells[0]);
    let along =
        |values: &[f64]| -> Vec<f64> { (begin..end).map(|i| values[i * cells[1] + row]).collect() };
    let most = if study.is_single() { STATES } else { 2 };
    let mut states = Vec::new();
    for k in run.states_along_wear(&[TableName::WearField, TableName::ContactField], most) {
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
