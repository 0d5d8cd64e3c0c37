//! Figure of the hysteresis loops of the joint.

use super::super::figure_text::rounding_bound;
use super::super::quantity::{ENERGY, FORCE, LENGTH, largest, unit_of, with_unit};
use super::super::run_tables::numeric_column;
use super::super::{ReportError, figure_with_bar};
use super::response::{Panel, panel_charts, states_with};
use super::smooth::smooth_with_points;
use super::{Figure, ReportedRuns};
use crate::tables::TableName;

/// Maximum number of states of wear.
const LOOPS: usize = 5;

/// Draws the loops of the rough contact and of the contact elements.
pub fn figures(study: &ReportedRuns) -> Result<Vec<Figure>, ReportError> {
    const ID: &str = "hysteresis-loops";
    let fine = Panel {
        title: "Rough contact, cell by cell",
        x: ("displacement", "displacement along x", LENGTH),
        y: ("load", "tangential load", FORCE),
    };
    let elements = Panel {
        title: "Contact elements of the structure",
        x: ("displacement_x", "displacement along x", LENGTH),
        y: ("force_x", "tangential load", FORCE),
    };
    let (mut drawings, mut sources, mut areas) = (Vec::new(), Vec::new(), Vec::new());
    let tables = [TableName::Hysteresis, TableName::JointCycle];
    for (table, view) in tables.into_iter().zip([&fine, &elements]) {
        // The panel of the fine contact and the panel of the contact elements show the same states if possible.
        let states = states_with(study, table, &tables, LOOPS)?;
        let charts = panel_charts(&states, view);
        if charts.is_empty() {
            continue;
        }
        for mut chart in charts {
            for curve in &mut chart.curves {
                // A cycle is periodic, so the curve is closed.
                curve.points.extend(curve.points.first().copied());
            }
            // The cycle of the contact elements has many instants, so it needs no interpolation.
            if table == TableName::Hysteresis {
                smooth_with_points(&mut chart);
            }
            drawings.push(chart.draw());
        }
        let each = states
            .iter()
            .flat_map(|(state, named)| named.iter().map(move |named| (state, named)))
            .filter_map(|(state, (name, _, frame))| {
                let (x, y) = (
                    numeric_column(frame, view.x.0)?,
                    numeric_column(frame, view.y.0)?,
                );
                let comma = if state.is_empty() { "" } else { ", " };
                let least = rounding_bound(largest(&x) * largest(&y));
                Some((
                    format!("{name}{comma}{state}"),
                    enclosed_area(&x, &y),
                    least,
                ))
            });
        areas.push((view.title, each.collect::<Vec<_>>()));
        sources.push((table.as_str(), vec![view.x.0, view.y.0]));
    }
    let Some((table, columns)) = sources.first() else {
        return Ok(Vec::new());
    };
    let marks = match *table == TableName::Hysteresis.as_str() {
        true => {
            " Dots of the rough contact are computed points, on two branches between the reversals. The lines between them are \
             interpolated. The energies are areas of polygons through the dots, a little less than the cycle dissipates."
        }
        false => "",
    };
    let all: Vec<f64> = areas
        .iter()
        .flat_map(|(_, each)| each)
        .map(|entry| entry.1)
        .collect();
    let unit = unit_of(ENERGY, largest(&all));
    let areas = areas.iter().map(|(title, each)| {
        let each = each.iter().map(|(name, area, least)| {
            let area = figure_with_bar(*area, 0.0, *least, |energy| with_unit(energy, unit));
            format!("{name} {area}")
        });
        format!("{title}: {}", each.collect::<Vec<String>>().join("; "))
    });
    let areas: Vec<String> = areas.collect();
    Ok(vec![Figure {
        id: ID,
        title: "Hysteresis loops".to_owned(),
        drawings,
        states: Vec::new(),
        caption: format!("Energy enclosed by the loops: {}.{marks}", areas.join(". ")),
        query: study.query(table, columns),
        sources,
    }])
}

/// Returns the area that a closed polygon encloses.
fn enclosed_area(x: &[f64], y: &[f64]) -> f64 {
    let next = |k: usize| (k + 1) % x.len();
    let twice: f64 = (0..x.len())
        .map(|k| x[k] * y[next(k)] - x[next(k)] * y[k])
        .sum();
    twice.abs() / 2.0
}
