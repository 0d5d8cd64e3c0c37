//! Output at the end of a run, as text or as JSON.

use std::path::Path;

use fretwear::recipe::{Check, Recipe};
use fretwear::report::{CharacteristicSizes, ERROR_BARS, error_bar_of, figure_with_bar};
use fretwear::scene::Plan;
use fretwear::stages::{Ending, Outcome, no_resonance_message};
use fretwear::tables::{Column, Table};
use serde_json::{Map, Value, json};

use super::cost;
use super::figures::write_figures;
use crate::terminal::Results;

/// Form of the output at the end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// The figures of the joint.
    Short,
    /// The figures and the summary.
    Verbose,
    /// One JSON object: the summary.
    Json,
}

/// Returns the notice that a summary has a response peak but no phase resonance.
fn no_phase_resonance(summary: &Map<String, Value>, plan: &Plan) -> Option<String> {
    let has_value = |key: &str| summary.get(key).is_some_and(|value| !value.is_null());
    let response = plan.inputs.recipe.response.as_ref()?;
    let range = response
        .frequency
        .filter(|_| response.at_frequency.is_none())?;
    let is_absent = has_value("peak_frequency") && !has_value("resonance_frequency");
    is_absent.then(|| no_resonance_message(range))
}

/// Prints the results of a run.
///
/// As JSON, the object includes the `warnings` of the scene and the `notices` of the latest start of the run. If an
/// earlier start of the run has found no phase resonance, the object includes the notice of the missing phase
/// resonance.
pub fn print_outcome(
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
            object.insert("cost".to_owned(), cost::cost_json(&outcome.spent));
        }
        return out.json(&Value::Object(object));
    }
    if let Ending::Until(stage) = outcome.ending {
        writeln!(
            out,
            "ended after {stage}, as requested; run the same command without --until to continue"
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

/// Prints the plausibility checks of the last state, and their remarks.
pub fn write_checks(out: &mut Results, checks: &[Check]) {
    for check in checks {
        out.item(check.what, &check.value);
    }
    for remark in checks.iter().filter_map(|check| check.remark.as_ref()) {
        out.aligned("note: ", remark);
    }
}

/// Prints one line per column of the summary. Each line has the name, the value and the unit of the column. A line with
/// an error has an error bar or an upper bound.
fn write_summary(out: &mut Results, recipe: &Recipe, summary: &Table) {
    let last = |name: &str| summary.f64(name).ok().map(|values| values[0]);
    let sizes = CharacteristicSizes::new(recipe, last("normal_load"), last("rq"));
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

/// Formats a number with six significant digits.
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

/// Returns the only row of a table, in SI units.
pub fn row(table: &Table) -> Map<String, Value> {
    rows(table).swap_remove(0)
}

/// Returns one object per row, in SI units.
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
