//! The summary of a run as a person and as a program reads it.

use std::path::Path;

use fretwear::recipe::{Check, Recipe};
use fretwear::report::{ERROR_BARS, Sizes, error_bar_of, figure_with_bar};
use fretwear::scene::Plan;
use fretwear::stages::{Ending, Outcome, no_resonance_message};
use fretwear::tables::{Column, Table};
use serde_json::{Map, Value, json};

use super::cost;
use super::figures::write_figures;
use crate::terminal::Results;

/// How the end of a run is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// The figures of the joint.
    Short,
    /// The summary too.
    Verbose,
    /// One JSON object: the summary.
    Json,
}

/// What is said of a summary whose resonance is none but a peak.
fn no_phase_resonance(summary: &Map<String, Value>, plan: &Plan) -> Option<String> {
    let is_there = |key: &str| summary.get(key).is_some_and(|value| !value.is_null());
    let response = plan.inputs.recipe.response.as_ref()?;
    let range = response
        .frequency
        .filter(|_| response.at_frequency.is_none())?;
    let is_absent = is_there("peak_frequency") && !is_there("resonance_frequency");
    is_absent.then(|| no_resonance_message(range))
}

/// Prints what a run left.
///
/// As JSON with the `warnings` of the scene, the `notices` of this start, and that there is no phase resonance whichever start found it so.
pub fn outcome(
    outcome: &Outcome,
    plan: &Plan,
    root: &Path,
    form: Form,
    notices: &[String],
    out: &mut Results,
) {
    if form == Form::Json {
        let mut object = outcome.summary.as_ref().map(row).unwrap_or_default();
        object.insert("wear_iteration".to_owned(), json!(outcome.wear_iteration));
        object.insert("timing".to_owned(), json!(outcome.spent.seconds));
        object.insert(
            "timing_fft_pairs".to_owned(),
            json!(outcome.spent.fft_pairs),
        );
        let absent = no_phase_resonance(&object, plan);
        let absent = absent.filter(|absent| !notices.contains(absent));
        let notices: Vec<&String> = notices.iter().chain(&absent).collect();
        object.insert("warnings".to_owned(), json!(plan.warnings));
        object.insert("notices".to_owned(), json!(notices));
        if outcome.wear_iteration.is_some() {
            object.insert("cost".to_owned(), cost::spent(&outcome.spent));
        }
        return out.json(&Value::Object(object));
    }
    if let Ending::Until(stage) = outcome.ending {
        writeln!(
            out,
            "ended after {stage}, as asked; run the same command without --until to continue"
        );
    }
    let Some(summary) = &outcome.summary else {
        return;
    };
    writeln!(out);
    if let Some(title) = &plan.inputs.recipe.title {
        writeln!(out, "{title}");
    }
    if let Some(wear_iteration) = outcome.wear_iteration {
        writeln!(out, "iteration {wear_iteration} of {}", root.display());
    }
    if let Some(ends) = &outcome.ends {
        write_figures(out, ends);
    }
    if form == Form::Verbose {
        writeln!(out);
        write_summary(out, &plan.inputs.recipe, summary);
    }
    let total: f64 = outcome.spent.total_seconds();
    let stages: Vec<String> = outcome
        .spent
        .seconds
        .iter()
        .map(|(stage, s)| format!("{stage} {s:.2} s"))
        .collect();
    out.item(
        "computed in",
        &format!("{total:.2} s: {}", stages.join(", ")),
    );
}

/// What an engineer would look at in the last state, and what is to be remarked of it.
pub fn write_judged(out: &mut Results, checks: &[Check]) {
    for check in checks {
        out.item(check.what, &check.value);
    }
    for remark in checks.iter().filter_map(|check| check.remark.as_ref()) {
        out.beside("note: ", remark);
    }
}

/// One line a column: name, value, unit, and its error bar, or what it is below.
fn write_summary(out: &mut Results, recipe: &Recipe, summary: &Table) {
    let last = |name: &str| summary.f64(name).ok().map(|values| values[0]);
    let sizes = Sizes::of(recipe, last("normal_load"), last("rq"));
    for (schema, column) in summary.columns() {
        if ERROR_BARS.iter().any(|(bar, _)| *bar == schema.name) {
            continue;
        }
        let unit = if schema.unit == "1" { "" } else { &schema.unit };
        let number = |value: f64| format!("{} {unit}", readable(value)).trim_end().to_owned();
        let bar = error_bar_of(&schema.name).and_then(last).unwrap_or(0.0);
        let resolution = sizes.resolution(&schema.name, &schema.unit);
        let figure = |value: f64| figure_with_bar(value, bar, resolution, number);
        let text = match column {
            Column::F64(values) => figure(values[0]),
            Column::MaybeF64(values) => values[0].map_or_else(String::new, figure),
            Column::I64(values) => values[0].to_string(),
            Column::I32(values) => values[0].to_string(),
            Column::Bool(values) => values[0].to_string(),
            Column::Text(values) => values[0].clone(),
        };
        let line = format!("  {:<24} {text}", schema.name);
        writeln!(out, "{}", line.trim_end());
    }
}

/// Six significant digits, as a person reads them.
fn readable(value: f64) -> String {
    const DIGITS: i32 = 6;
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e5).contains(&size) {
        let decimals = (DIGITS - 1 - size.log10().floor() as i32).max(0);
        format!("{value:.*}", decimals as usize)
    } else {
        format!("{value:.5e}")
    }
}

/// The row of a table of one row, in SI units.
pub fn row(table: &Table) -> Map<String, Value> {
    rows(table).swap_remove(0)
}

/// One object a row, in SI units.
pub fn rows(table: &Table) -> Vec<Map<String, Value>> {
    let value = |column: &Column, row: usize| match column {
        Column::F64(values) => json!(values[row]),
        Column::MaybeF64(values) => json!(values[row]),
        Column::I64(values) => json!(values[row]),
        Column::I32(values) => json!(values[row]),
        Column::Bool(values) => json!(values[row]),
        Column::Text(values) => json!(values[row]),
    };
    let object = |row: usize| {
        let columns = table.columns();
        columns
            .map(|(schema, column)| (schema.name.clone(), value(column, row)))
            .collect()
    };
    (0..table.rows()).map(object).collect()
}
