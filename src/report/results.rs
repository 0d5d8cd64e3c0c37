//! The results of runs as a table.

use super::html::{NONE, Section, table};
use super::quantity::{self, Units, number};
use super::run_tables::numbers;
use super::{ERROR_BARS, ReportError, RunTables, error_bar_of, percent};
use crate::tables::TableName;

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

/// The summary of the first and the last iteration, with the error bars of the last.
pub fn results(runs: &[RunTables]) -> Result<Section, ReportError> {
    let read = |run: &RunTables| {
        run.series(TableName::Summary)
            .map(Option::unwrap_or_default)
    };
    let frames: Result<Vec<_>, _> = runs.iter().map(read).collect();
    let frames = frames?;
    let schema = TableName::Summary.schema();
    let mut rows = Vec::new();
    for column in &schema.columns {
        let name = column.name.as_str();
        if ERROR_BARS.iter().any(|(bar, _)| *bar == name) || name == "updated" {
            continue;
        }
        let ends: Vec<Option<(f64, f64, f64)>> = frames
            .iter()
            .map(|frame| {
                let values = numbers(frame, name)?;
                let bar = error_bar_of(name)
                    .and_then(|bar| numbers(frame, bar)?.last().copied())
                    .unwrap_or(0.0);
                Some((*values.first()?, *values.last()?, bar))
            })
            .collect();
        if ends.iter().all(Option::is_none) {
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
                Some((first, last, bar)) => (values(first, last), bar),
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
        rows.push(row);
    }
    let heads: Vec<String> = match runs {
        [run] => {
            let mut ends = vec![run.iterations()[0], run.latest()];
            ends.dedup();
            let ends = ends.iter().map(|k| format!("iteration {k}"));
            std::iter::once("summary".to_owned()).chain(ends).collect()
        }
        runs => std::iter::once("summary, first and last iteration".to_owned())
            .chain(runs.iter().map(|run| run.name().to_owned()))
            .collect(),
    };
    Ok(Section {
        id: "results",
        title: "Results".to_owned(),
        html: table(&heads, &rows, true),
    })
}
