//! The summaries of runs as a table.

use polars::prelude::DataFrame;

use super::html::{NONE, Section, table};
use super::quantity::{self, Units, number};
use super::run_tables::numbers;
use super::{ERROR_BARS, ReportError, RunTables, error_bar_of, percent};
use crate::tables::TableName;

/// What is smaller than this part of what the joint has is what rounding left.
const FLOOR: f64 = 1e-9;

/// The units in which a column of the summary is shown; none for one whose own unit reads as it is.
fn units_of(column: &str, unit: &str) -> Option<Units> {
    Some(match (column, unit) {
        ("wear_rate", _) => quantity::VOLUME_RATE,
        ("cycles" | "n_cycles", _) => quantity::CYCLES,
        ("contact_area_fraction" | "loaded_area_fraction", _) => quantity::SHARE,
        (_, "m") => quantity::LENGTH,
        (_, "Pa") => quantity::PRESSURE,
        (_, "N") => quantity::FORCE,
        (_, "N/m") => quantity::STIFFNESS,
        (_, "J") => quantity::ENERGY,
        (_, "m^3") => quantity::VOLUME,
        (_, "m^2") => quantity::AREA,
        (_, "Hz") => quantity::FREQUENCY,
        _ => return None,
    })
}

/// The name of a column as it stands in a table: symbols keep their letters.
fn in_words(column: &str) -> String {
    match column {
        "rq" => "Rq".to_owned(),
        "sk" => "Sk".to_owned(),
        "ku" => "Ku".to_owned(),
        "n_cycles" => "cycles of the last step".to_owned(),
        "fft_pairs" => "FFT pairs".to_owned(),
        name => name.replace('_', " "),
    }
}

/// True for what tells of the computation and not of the joint.
fn is_of_computation(column: &str) -> bool {
    column.starts_with("error_") || column.ends_with("_iterations") || column == "fft_pairs"
}

/// Below this a column of a run is what rounding left of zero \[its unit\]; 0 for what is never so small by rounding.
fn floor(run: &RunTables, frame: &DataFrame, column: &str, unit: &str) -> f64 {
    let last = |name: &str| numbers(frame, name).and_then(|v| v.last().copied());
    let size = run
        .recipe()
        .surface()
        .map_or(1.0, |surface| surface.size[0].max(surface.size[1]));
    let rq = last("rq").unwrap_or(0.0);
    FLOOR
        * match (column, unit) {
            (_, "N m") => last("normal_load").unwrap_or(0.0).abs() * size,
            (_, "rad") => rq / size,
            ("mean_height", _) => rq,
            ("sk", _) => 1.0,
            _ => 0.0,
        }
}

/// The summary of the first and the last iteration, with the error bars of the last.
pub fn results(runs: &[RunTables]) -> Result<Section, ReportError> {
    let read = |run: &RunTables| {
        run.series(TableName::Summary)
            .map(Option::unwrap_or_default)
    };
    let frames: Result<Vec<_>, _> = runs.iter().map(read).collect();
    let frames = frames?;
    let schema = TableName::Summary.schema();
    let (mut of_joint, mut of_computation) = (Vec::new(), Vec::new());
    for column in &schema.columns {
        let name = column.name.as_str();
        if ERROR_BARS.iter().any(|(bar, _)| *bar == name) || name == "updated" {
            continue;
        }
        let ends = runs.iter().zip(&frames).map(|(run, frame)| {
            let values = numbers(frame, name)?;
            let bar = error_bar_of(name)
                .and_then(|bar| numbers(frame, bar)?.last().copied())
                .unwrap_or(0.0);
            let floor = floor(run, frame, name, &column.unit);
            let seen = |value: f64| if value.abs() < floor { 0.0 } else { value };
            Some((seen(*values.first()?), seen(*values.last()?), bar, floor))
        });
        let ends: Vec<Option<(f64, f64, f64, f64)>> = ends.collect();
        // What rounding leaves of nothing is nothing.
        let is_nothing = |end: &Option<(f64, f64, f64, f64)>| {
            end.is_none_or(|(first, last, _, floor)| floor > 0.0 && first == 0.0 && last == 0.0)
        };
        if ends.iter().all(is_nothing) {
            continue;
        }
        let plain = |value: f64| match column.unit.as_str() {
            "1" => number(value),
            unit => format!("{}\u{a0}{unit}", number(value)),
        };
        let values = |first: f64, last: f64| {
            let most = quantity::largest(&[first, last]);
            match units_of(name, &column.unit) {
                Some(units) => {
                    let unit = quantity::unit_of(units, most);
                    [first, last].map(|value| quantity::in_unit(value, unit))
                }
                None => [first, last].map(plain),
            }
        };
        let mut row = vec![in_words(name)];
        for end in ends {
            let ([first, last], bar) = match end {
                Some((first, last, bar, _)) => (values(first, last), bar),
                None => ([NONE; 2].map(str::to_owned), 0.0),
            };
            let bar = match bar > 0.0 {
                true => format!(" ± {}", percent(bar)),
                false => String::new(),
            };
            if frames.len() == 1 {
                row.extend((runs[0].iterations().len() > 1).then_some(first));
                row.push(format!("{last}{bar}"));
            } else {
                // Both have the unit of the last.
                let first = first.split('\u{a0}').next().unwrap_or_default();
                row.push(format!("{first} → {last}{bar}"));
            }
        }
        match is_of_computation(name) {
            true => of_computation.push(row),
            false => of_joint.push(row),
        }
    }
    let heads = |first: &str| -> Vec<String> {
        let first = std::iter::once(first.to_owned());
        match runs {
            [run] => {
                let mut ends = vec![run.iterations()[0], run.latest()];
                ends.dedup();
                let ends = ends.iter().map(|k| format!("iteration {k}"));
                first.chain(ends).collect()
            }
            runs => first
                .chain(runs.iter().map(|run| run.name().to_owned()))
                .collect(),
        }
    };
    let mut html = table(&heads("of the joint"), &of_joint, true);
    if of_joint.iter().any(|row| row[0] == "peak amplitude") {
        html = format!(
            "<p>Resonance and peak are those of the vibration that drives the wear: its contact elements are of the last model update, \
             not of the last state.</p>\n{html}"
        );
    }
    if !of_computation.is_empty() {
        html += &table(&heads("of the computation"), &of_computation, true);
    }
    Ok(Section {
        id: "results",
        title: "All figures in numbers".to_owned(),
        html,
    })
}
