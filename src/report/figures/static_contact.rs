//! Figure of the indentation curve, whose slope is the normal stiffness.

use super::super::ReportError;
use super::super::quantity::{FORCE, LENGTH, STIFFNESS, with_best_unit};
use super::response::{Panel, panel_charts, states};
use super::smooth::smooth_with_points;
use super::{Figure, ReportedRuns};
use crate::tables::TableName;

/// Maximum number of states of wear.
const CURVES: usize = 5;

/// Draws the normal load over the approach.
pub fn figures(study: &ReportedRuns) -> Result<Vec<Figure>, ReportError> {
    const ID: &str = "indentation";
    let states = states(study, TableName::Indentation, CURVES)?;
    let mut charts = panel_charts(
        &states,
        &Panel {
            title: "Normal load over approach",
            x: ("displacement", "approach from height 0", LENGTH),
            y: ("load", "normal load", FORCE),
        },
    );
    charts.iter_mut().for_each(smooth_with_points);
    let drawings: Vec<_> = charts.iter().map(|chart| chart.draw()).collect();
    if drawings.is_empty() {
        return Ok(Vec::new());
    }
    let each: Vec<String> = study
        .runs
        .iter()
        .filter_map(|run| {
            let (load, kn) = (run.column("normal_load")?, run.column("kn")?);
            let name = match study.is_single() {
                true => String::new(),
                false => format!("{}: ", run.label),
            };
            Some(format!(
                "{name}{} at {} for the unworn contact",
                with_best_unit(*kn.first()?, STIFFNESS),
                with_best_unit(*load.first()?, FORCE)
            ))
        })
        .collect();
    let columns = vec!["displacement", "load"];
    // The summary of a run may have no column `kn`.
    let summary_columns = match each.is_empty() {
        true => vec!["normal_load"],
        false => vec!["normal_load", "kn"],
    };
    let slope = match each.is_empty() {
        true => String::new(),
        false => format!(
            "Its slope at the static load is the normal stiffness kn: {}. ",
            each.join("; ")
        ),
    };
    Ok(vec![Figure {
        id: ID,
        title: "Indentation curve".to_owned(),
        drawings,
        states: Vec::new(),
        caption: format!(
            "{slope}Dots are computed points. The lines between them are interpolated."
        ),
        query: study.query("indentation", &columns),
        sources: vec![("indentation", columns), ("summary", summary_columns)],
    }])
}
