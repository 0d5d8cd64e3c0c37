//! Figures of the vibration: forced response, and the joint over a cycle.

use polars::prelude::DataFrame;

use super::super::ReportError;
use super::super::figure_text::rounding_bound;
use super::super::headline::state_resonances;
use super::super::plot::{Axis, Chart, Curve, style_of_state};
use super::super::quantity::{
    self, ANGLE, FORCE, FREQUENCY, LENGTH, Units, unit_of, with_best_unit, with_unit,
};
use super::super::run_tables::numeric_column;
use super::course::axis_label;
use super::{Figure, ReportedRun, ReportedRuns, points};
use crate::tables::TableName;

/// Maximum number of forced responses along wear. More curves would need more styles.
const RESPONSES: usize = 6;

/// Curve to draw: the name of the curve, the number of the line style, and the table rows of the curve.
type Named = (String, usize, DataFrame);

/// Draws the forced responses and the cycle of the joint.
pub fn figures(study: &ReportedRuns) -> Result<Vec<Figure>, ReportError> {
    let all = [
        forced_response(study)?,
        over_wear(study)?,
        joint_cycle(study)?,
    ];
    Ok(all.into_iter().flatten().collect())
}

/// Selects the states with a table, as [`states_with`] does.
pub fn states(
    study: &ReportedRuns,
    table: TableName,
    most: usize,
) -> Result<Vec<(String, Vec<Named>)>, ReportError> {
    states_with(study, table, &[table], most)
}

/// Selects the states to draw: one list per drawing, with the heading of the drawing.
///
/// A single run has one drawing with at most `most` states of wear. The function prefers states with all of `tables`.
/// If no state has all of `tables`, the function selects states with `table`. Several runs have two drawings: one of
/// the unworn states, and one of the last states.
pub fn states_with(
    study: &ReportedRuns,
    table: TableName,
    tables: &[TableName],
    most: usize,
) -> Result<Vec<(String, Vec<Named>)>, ReportError> {
    let read = |run: &ReportedRun, k: u64| {
        run.tables
            .iteration_table(k, table)
            .map(Option::unwrap_or_default)
    };
    if let [run] = &study.runs[..] {
        let mut states = Vec::new();
        let mut iterations = run.states_along_wear(tables, most);
        if iterations.is_empty() {
            iterations = run.states_along_wear(&[table], most);
        }
        for (place, k) in iterations.iter().enumerate() {
            let style = style_of_state(place, iterations.len());
            states.push((run.state(*k), style, read(run, *k)?));
        }
        return Ok(vec![(String::new(), states)]);
    }
    let (mut unworn, mut last) = (Vec::new(), Vec::new());
    for run in &study.runs {
        let with = run.iterations_with(table, 2);
        if let Some(first) = with.first() {
            unworn.push((run.label.clone(), run.style, read(run, *first)?));
        }
        if let [_, k] = with[..] {
            last.push((run.label.clone(), run.style, read(run, k)?));
        }
    }
    Ok(vec![
        ("unworn".to_owned(), unworn),
        ("worn".to_owned(), last),
    ])
}

/// Heading and axes of a drawing of some states.
pub struct Panel {
    /// Heading.
    pub title: &'static str,
    /// Abscissa: column, name, units.
    pub x: (&'static str, &'static str, Units),
    /// Ordinate: column, name, units.
    pub y: (&'static str, &'static str, Units),
}

/// Creates one chart of two columns per list of states. All charts have the same axes. A list of states without the two
/// columns gets no chart.
pub fn panel_charts(states: &[(String, Vec<Named>)], panel: &Panel) -> Vec<Chart> {
    let all = |column: &str| -> Vec<f64> {
        let frames = states.iter().flat_map(|(_, named)| named);
        let columns = frames.filter_map(|(_, _, frame)| numeric_column(frame, column));
        columns.flatten().collect()
    };
    let ((x, x_name, x_units), (y, y_name, y_units)) = (panel.x, panel.y);
    let (all_x, all_y) = (all(x), all(y));
    let units = [
        unit_of(x_units, quantity::largest(&all_x)),
        unit_of(y_units, quantity::largest(&all_y)),
    ];
    let range = |values: &[f64], size: f64, margin: f64| {
        let [low, high] = super::widened(super::range_of(values)?);
        let reach = margin * (high - low);
        let least = if low >= 0.0 && low - reach < 0.0 {
            0.0
        } else {
            low - reach
        };
        Some([least / size, (high + reach) / size])
    };
    let charts = states.iter().filter_map(|(state, named)| {
        let curves: Vec<Curve> = named
            .iter()
            .filter_map(|(name, style, frame)| {
                let points = points(frame, x, y, [units[0].size, units[1].size])?;
                Some(Curve::line(name, *style, points))
            })
            .collect();
        (!curves.is_empty()).then(|| Chart {
            title: match state.as_str() {
                "" => panel.title.to_owned(),
                state => format!("{}, {state}", panel.title),
            },
            x: Axis {
                label: axis_label(x_name, units[0].symbol),
                range: range(&all_x, units[0].size, 0.0),
                ..Axis::default()
            },
            y: Axis {
                label: axis_label(y_name, units[1].symbol),
                range: range(&all_y, units[1].size, 0.05),
                ..Axis::default()
            },
            curves,
            ..Chart::default()
        })
    });
    charts.collect()
}

const AMPLITUDE: Panel = Panel {
    title: "Amplitude at the response point",
    x: ("frequency", "frequency", FREQUENCY),
    y: ("amplitude", "amplitude", LENGTH),
};
const PHASE: Panel = Panel {
    title: "Phase lag behind the force",
    x: ("frequency", "frequency", FREQUENCY),
    y: ("phase_lag", "phase lag", ANGLE),
};

/// Describes the largest point of each curve.
fn peaks(states: &[(String, Vec<Named>)]) -> Vec<String> {
    let all = || {
        let each = states.iter();
        each.flat_map(|(state, named)| named.iter().map(move |named| (state, named)))
    };
    let amplitudes = all().filter_map(|(_, (.., frame))| numeric_column(frame, "amplitude"));
    let unit = unit_of(
        LENGTH,
        quantity::largest(&amplitudes.flatten().collect::<Vec<f64>>()),
    );
    let peaks = all().filter_map(|(state, (name, _, frame))| {
        let (amplitude, frequency) = (
            numeric_column(frame, "amplitude")?,
            numeric_column(frame, "frequency")?,
        );
        let largest =
            (0..amplitude.len()).max_by(|a, b| amplitude[*a].total_cmp(&amplitude[*b]))?;
        let comma = if state.is_empty() { "" } else { ", " };
        Some(format!(
            "{name}{comma}{state} {} at {}",
            with_unit(amplitude[largest], unit),
            with_best_unit(frequency[largest], FREQUENCY)
        ))
    });
    peaks.collect()
}

/// Describes the phase resonances, which differ from the largest points of the curves.
fn phase_resonances(study: &ReportedRuns) -> Result<String, ReportError> {
    let unit = study.unit("peak_amplitude", LENGTH);
    let mut each = Vec::new();
    for run in &study.runs {
        let Some(resonances) = state_resonances(run)? else {
            continue;
        };
        let resonances = resonances.map(|resonance| {
            format!(
                "{} at {}",
                with_unit(resonance.amplitude, unit),
                with_best_unit(resonance.frequency, FREQUENCY)
            )
        });
        let name = match study.is_single() {
            true => String::new(),
            false => format!("{}: ", run.label),
        };
        each.push(match &resonances {
            [first, last] if first == last => format!("{name}{first}"),
            [first, last] => format!("{name}{first} before and {last} after"),
        });
    }
    Ok(match each.is_empty() {
        true => String::new(),
        false => format!(
            " The largest point of a curve is at one of its computed frequencies. The resonance, where the motion lags by 90°, is solved \
             for separately: {}.",
            each.join("; ")
        ),
    })
}

/// Explains how to request the responses of intermediate states, if the runs do not have them.
fn intermediate_states_hint(study: &ReportedRuns) -> &'static str {
    let lacks = |run: &ReportedRun| {
        let recipe = run.tables.recipe();
        recipe.wear.is_some() && recipe.output.response_at.is_empty()
    };
    match study.runs.iter().all(lacks) {
        true => {
            " To also draw intermediate states, set their cycles in the scene, for example output.response_at = [100000, 1000000]."
        }
        false => "",
    }
}

/// Draws the responses of intermediate states, if a run has more than its first and its last response.
fn over_wear(study: &ReportedRuns) -> Result<Option<Figure>, ReportError> {
    const ID: &str = "responses-over-wear";
    let mut drawings = Vec::new();
    let mut each = Vec::new();
    for run in &study.runs {
        let iterations = run.states_along_wear(&[TableName::Frf], RESPONSES);
        if iterations.len() <= 2 {
            continue;
        }
        let mut named = Vec::new();
        for (place, k) in iterations.iter().enumerate() {
            let style = style_of_state(place, iterations.len());
            let frame = run
                .tables
                .iteration_table(*k, TableName::Frf)?
                .unwrap_or_default();
            named.push((run.state(*k), style, frame));
        }
        let name = if study.is_single() {
            String::new()
        } else {
            run.label.clone()
        };
        let states = [(name, named)];
        for view in [&AMPLITUDE, &PHASE] {
            for chart in panel_charts(&states, view) {
                drawings.push(chart.draw());
            }
        }
        each.extend(peaks(&states));
    }
    if drawings.is_empty() {
        return Ok(None);
    }
    let columns = vec!["force", "frequency", "amplitude", "phase_lag"];
    Ok(Some(Figure {
        id: ID,
        title: "Forced responses over wear".to_owned(),
        drawings,
        states: Vec::new(),
        caption: format!(
            "Responses of at most {RESPONSES} states, including the cycles of output.response_at. Largest point of each curve: {}.",
            each.join("; ")
        ),
        query: study.query("frf", &columns),
        sources: vec![("frf", columns)],
    }))
}

fn forced_response(study: &ReportedRuns) -> Result<Option<Figure>, ReportError> {
    const ID: &str = "forced-response";
    let states = states(study, TableName::Frf, 2)?;
    let charts = [&AMPLITUDE, &PHASE]
        .into_iter()
        .flat_map(|view| panel_charts(&states, view));
    let drawings: Vec<_> = charts.map(|chart| chart.draw()).collect();
    if drawings.is_empty() {
        return Ok(None);
    }
    let peaks = peaks(&states);
    let force = states
        .iter()
        .flat_map(|(_, named)| named)
        .find_map(|(_, _, frame)| numeric_column(frame, "force")?.first().copied());
    let force = force.map_or(String::new(), |force| {
        format!(
            " to a force of {} (half range)",
            with_best_unit(force, FORCE)
        )
    });
    let columns = vec!["force", "frequency", "amplitude", "phase_lag"];
    Ok(Some(Figure {
        id: ID,
        title: "Forced response".to_owned(),
        drawings,
        states: Vec::new(),
        caption: format!(
            "First harmonic at the response point{force}. Largest point of each curve: {}.{}{}",
            peaks.join("; "),
            phase_resonances(study)?,
            intermediate_states_hint(study)
        ),
        query: study.query("frf", &columns),
        sources: vec![("frf", columns)],
    }))
}

/// Smallest number of instants of a drawn cycle. A cycle with only the two reversals does not show how a quantity
/// varies in time.
const LEAST_TIMES: usize = 8;

fn joint_cycle(study: &ReportedRuns) -> Result<Option<Figure>, ReportError> {
    const ID: &str = "joint-cycle";
    let resolved_states = |table: TableName| -> Result<_, ReportError> {
        let mut states = states(study, table, 2)?;
        for (_, named) in &mut states {
            named.retain(|(_, _, frame)| frame.height() >= LEAST_TIMES);
        }
        states.retain(|(_, named)| !named.is_empty());
        Ok(states)
    };
    let (table, states) = match resolved_states(TableName::JointCycle)? {
        states if states.is_empty() => ("cycle", resolved_states(TableName::Cycle)?),
        states => ("joint_cycle", states),
    };
    let time = ("time", "time / period", quantity::NUMBER);
    let panels = [
        Panel {
            title: "Relative displacement along x",
            x: time,
            y: ("displacement_x", "displacement", LENGTH),
        },
        Panel {
            title: "Normal load",
            x: time,
            y: ("normal_load", "normal load", FORCE),
        },
    ];
    let charts = panels.iter().flat_map(|view| panel_charts(&states, view));
    let closed_charts = charts.map(|mut chart| {
        chart.x.range = Some([0.0, 1.0]);
        for Curve { points, .. } in &mut chart.curves {
            // The curve is periodic, so the first value is repeated at the end of the curve.
            if let (Some(first), Some(last)) = (points.first().copied(), points.last())
                && last[0] < 1.0
            {
                points.push([1.0, first[1]]);
            }
        }
        chart.draw()
    });
    let drawings: Vec<_> = closed_charts.collect();
    if drawings.is_empty() {
        return Ok(None);
    }
    let units = [("displacement_x", LENGTH), ("normal_load", FORCE)].map(|(column, units)| {
        let frames = states.iter().flat_map(|(_, named)| named);
        let columns = frames.filter_map(|(.., frame)| numeric_column(frame, column));
        unit_of(
            units,
            quantity::largest(&columns.flatten().collect::<Vec<f64>>()),
        )
    });
    let each: Vec<String> = states
        .iter()
        .flat_map(|(state, named)| named.iter().map(move |named| (state, named)))
        .filter_map(|(state, (name, _, frame))| {
            let half = |column: &str| {
                let [low, high] = super::range_of(&numeric_column(frame, column)?)?;
                let (half, mean) = ((high - low) / 2.0, (high + low) / 2.0);
                // A value within the rounding errors is zero.
                let without_rounding =
                    |value: f64, scale: f64| match value.abs() > rounding_bound(scale) {
                        true => value,
                        false => 0.0,
                    };
                Some((without_rounding(half, mean), without_rounding(mean, half)))
            };
            let about = |half: f64, unit| match half {
                0.0 => "constant".to_owned(),
                half => format!("±{}", with_unit(half, unit)),
            };
            let (displacement, load) = (half("displacement_x")?, half("normal_load")?);
            let comma = if state.is_empty() { "" } else { ", " };
            Some(format!(
                "{name}{comma}{state} {} about {}, load {} {}",
                about(displacement.0, units[0]),
                with_unit(displacement.1, units[0]),
                with_unit(load.1, units[1]),
                about(load.0, units[1])
            ))
        })
        .collect();
    let columns = vec!["time", "displacement_x", "normal_load"];
    Ok(Some(Figure {
        id: ID,
        title: "The joint over one vibration cycle".to_owned(),
        drawings,
        states: Vec::new(),
        caption: format!(
            "Half range about the mean over the cycle: {}.",
            each.join("; ")
        ),
        query: study.query(table, &columns),
        sources: vec![(
            if table == "cycle" {
                "cycle"
            } else {
                "joint_cycle"
            },
            columns,
        )],
    }))
}
