//! Table of the summaries of runs.

use maud::html;
use polars::prelude::DataFrame;

use super::quantity::{self, Units, four_digits};
use super::run_tables::numeric_column;
use super::table::table;
use super::template::Section;
use super::text::NONE;
use super::{
    CharacteristicSizes, ERROR_BARS, ReportError, RunTables, error_bar_of, figure_with_bar,
};
use crate::tables::TableName;

/// Returns the units of a column of the summary, or `None` for a column that keeps its own unit.
fn units_of(column: &str, unit: &str) -> Option<Units> {
    Some(match (column, unit) {
        ("wear_rate", _) => quantity::VOLUME_RATE,
        ("cycles" | "n_cycles", _) => quantity::CYCLES,
        ("contact_area_fraction" | "corrected_area_fraction" | "loaded_area_fraction", _) => {
            quantity::SHARE
        }
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

/// Returns the title of a column. The title keeps the capital letters of symbols in the column name.
fn title_of(column: &str) -> String {
    match column {
        "max_pressure" => "largest pressure".to_owned(),
        "rq" => "Rq".to_owned(),
        "sk" => "Sk".to_owned(),
        "ku" => "Ku".to_owned(),
        "n_cycles" => "cycles of the last step".to_owned(),
        "fft_pairs" => "FFT pairs".to_owned(),
        name => name.replace('_', " "),
    }
}

/// Returns true for a column that describes the computation, not the joint.
fn is_of_computation(column: &str) -> bool {
    column.starts_with("error_") || column.ends_with("_iterations") || column == "fft_pairs"
}

/// Returns the characteristic sizes of the last state of a run.
pub fn sizes(run: &RunTables, frame: &DataFrame) -> CharacteristicSizes {
    let last = |name: &str| numeric_column(frame, name).and_then(|v| v.last().copied());
    CharacteristicSizes::new(run.recipe(), last("normal_load"), last("rq"))
}

/// Builds the section with the summaries of the first and the last iteration, and the error bars of the last one.
pub fn results(runs: &[RunTables]) -> Result<Section, ReportError> {
    let read = |run: &RunTables| {
        run.series(TableName::Summary)
            .map(Option::unwrap_or_default)
    };
    let frames: Result<Vec<_>, _> = runs.iter().map(read).collect();
    let frames = frames?;
    let schema = TableName::Summary.schema();
    let (mut of_joint, mut of_computation) = (Vec::new(), Vec::new());
    let single = runs.len() == 1;
    let cells = if single && runs[0].iterations().len() > 1 {
        2
    } else {
        1
    };
    for column in &schema.columns {
        let name = column.name.as_str();
        if ERROR_BARS.iter().any(|(bar, _)| *bar == name) || name == "updated" {
            continue;
        }
        let ends = runs.iter().zip(&frames).map(|(run, frame)| {
            let values = numeric_column(frame, name)?;
            let bar = error_bar_of(name)
                .and_then(|bar| numeric_column(frame, bar)?.last().copied())
                .unwrap_or(0.0);
            let resolution = sizes(run, frame).resolution(name, &column.unit);
            Some((*values.first()?, *values.last()?, bar, resolution))
        });
        let ends: Vec<Option<(f64, f64, f64, f64)>> = ends.collect();
        // A column belongs to physics outside the scene if its value is zero at the start and at the end of the run.
        let is_absent = |end: &Option<(f64, f64, f64, f64)>| {
            end.is_none_or(|(first, last, _, resolution)| {
                resolution > 0.0 && first == 0.0 && last == 0.0
            })
        };
        if ends.iter().all(is_absent) {
            continue;
        }
        let plain = |value: f64| match column.unit.as_str() {
            "1" => four_digits(value),
            unit => format!("{}\u{a0}{unit}", four_digits(value)),
        };
        let with_unit = |value: f64, most: f64| match units_of(name, &column.unit) {
            Some(units) => quantity::with_unit(value, quantity::unit_of(units, most)),
            None => plain(value),
        };
        // All runs use the unit that suits the largest value.
        let all = ends.iter().flatten();
        let most = all.fold(0.0, |most: f64, (first, last, _, resolution)| {
            most.max(quantity::largest(&[*first, *last, *resolution]))
        });
        let mut row = vec![title_of(name)];
        for end in ends {
            let Some((first, last, bar, resolution)) = end else {
                row.extend(vec![NONE.to_owned(); cells]);
                continue;
            };
            let first = figure_with_bar(first, 0.0, resolution, |value| with_unit(value, most));
            let last = figure_with_bar(last, bar, resolution, |value| with_unit(value, most));
            match (single, cells) {
                (true, 1) => row.push(last),
                (true, _) => row.extend([first, last]),
                // The last value carries the unit of both.
                (false, _) => {
                    let first = first.split('\u{a0}').next().unwrap_or_default();
                    match last.split('\u{a0}').next() == Some(first) {
                        true => row.push(last),
                        false => row.push(format!("{first} → {last}")),
                    }
                }
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
    Ok(Section {
        id: "results",
        title: "All figures in numbers".to_owned(),
        html: html! {
            @if of_joint.iter().any(|row| row[0] == "peak amplitude") {
                p {
                    "Resonance and peak belong to the vibration that drives the wear. It uses the contact elements of the last model update, \
                     not of the last state."
                } "\n"
            }
            (table(&heads("of the joint"), &of_joint, true))
            @if !of_computation.is_empty() {
                (table(&heads("of the computation"), &of_computation, true))
            }
        },
    })
}
