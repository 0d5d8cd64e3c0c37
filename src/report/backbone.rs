//! Backbone charts. One chart shows frequency and damping ratio over amplitude. Another chart shows amplitude over
//! force.
//!
//! If the runs vary a key, the charts show frequency, damping ratio and amplitude over the value of the key.

use super::plot::{Axis, Chart, Curve, standalone, style_of_run, style_of_state};
use super::quantity::{FORCE, FREQUENCY, LENGTH, NUMBER, Unit, Units, largest, unit_of};
use super::text::escape_controls;
use crate::tables::typed::Backbone;

/// Ratio of the largest to the smallest value above which an axis is logarithmic.
const DECADE: f64 = 10.0;

/// A branch as a curve, with its rows of the table.
struct Branch {
    name: String,
    style: usize,
    rows: Vec<usize>,
}

/// Returns the backbones of a table as one SVG, with one curve per branch.
///
/// If all states belong to one run, the line styles grade from unworn to worn. If the states belong to several runs,
/// each state has its own line style, from the styles of runs.
pub fn backbone_svg(table: &Backbone) -> String {
    let branches = branches(table);
    if let (Some(keys), Some(values)) = (&table.key, &table.value) {
        return over_key(table, keys.first().map_or("", String::as_str), values);
    }
    let force = Quantity::new("force", &table.force, FORCE);
    let amplitude = Quantity::new("amplitude", &table.amplitude, LENGTH);
    let frequency = Quantity::new("frequency", &table.frequency, FREQUENCY);
    let damping = Quantity::new("damping ratio", &table.damping_ratio, NUMBER);
    let drawings = [
        chart(
            "Frequency of the phase resonance",
            &amplitude,
            &frequency,
            &branches,
            false,
        ),
        chart("Damping ratio", &amplitude, &damping, &branches, true),
        chart(
            "Amplitude at the response point",
            &force,
            &amplitude,
            &branches,
            true,
        ),
    ]
    .map(|chart| chart.draw());
    standalone("Backbone", &drawings)
}

fn over_key(table: &Backbone, key: &str, values: &[f64]) -> String {
    let branches = branches(table);
    let value = Quantity {
        // The key alone determines the unit, so the axis shows SI values.
        unit: unit_of(NUMBER, 1.0),
        ..Quantity::new(&format!("{key}, SI"), values, NUMBER)
    };
    // A logarithmic axis shows a curve over decades. Within one decade, a linear axis shows the shape of the curve
    // better.
    let spans_decades = |column: &[f64]| {
        let least = column.iter().copied().fold(f64::INFINITY, f64::min);
        least > 0.0 && largest(column) > DECADE * least
    };
    let figures = [
        (
            "Frequency of the phase resonance",
            "frequency",
            &table.frequency,
            FREQUENCY,
        ),
        (
            "Damping ratio",
            "damping ratio",
            &table.damping_ratio,
            NUMBER,
        ),
        (
            "Amplitude at the response point",
            "amplitude",
            &table.amplitude,
            LENGTH,
        ),
    ];
    let drawings = figures.map(|(title, name, column, units)| {
        let quantity = Quantity::new(name, column, units);
        chart(title, &value, &quantity, &branches, spans_decades(column)).draw()
    });
    standalone("Backbone", &drawings)
}

fn branches(table: &Backbone) -> Vec<Branch> {
    let mut states: Vec<&str> = Vec::new();
    for state in &table.state {
        if !states.contains(&state.as_str()) {
            states.push(state);
        }
    }
    // The name of a state is RUN@STATE.
    let run = |state: &str| state.rsplit_once('@').map(|(run, _)| run.to_owned());
    let first = run(states.first().unwrap_or(&""));
    let along_wear = states.len() > 1 && first.is_some() && states.iter().all(|s| run(s) == first);
    let mut branches: Vec<Branch> = Vec::new();
    let mut last = None;
    for row in 0..table.state.len() {
        let state = table.state[row].as_str();
        let place = states.iter().position(|s| *s == state).unwrap_or(0);
        let key = (place, table.branch[row]);
        if last != Some(key) {
            // Only the first branch of a state has the name of the state in the legend.
            let is_named = branches
                .iter()
                .any(|b| b.rows.iter().any(|r| table.state[*r] == state));
            branches.push(Branch {
                name: if is_named {
                    String::new()
                } else {
                    escape_controls(state)
                },
                style: match along_wear {
                    true => style_of_state(place, states.len()),
                    false => style_of_run(place),
                },
                rows: Vec::new(),
            });
            last = Some(key);
        }
        branches.last_mut().expect("one was pushed").rows.push(row);
    }
    branches
}

/// A column with the unit that suits its largest value.
struct Quantity<'a> {
    name: String,
    values: &'a [f64],
    unit: Unit,
}

impl<'a> Quantity<'a> {
    fn new(name: &str, values: &'a [f64], units: Units) -> Quantity<'a> {
        let unit = unit_of(units, largest(values));
        Quantity {
            name: name.to_owned(),
            values,
            unit,
        }
    }

    fn axis(&self, log: bool) -> Axis {
        let label = match self.unit.symbol {
            "" => self.name.clone(),
            symbol => format!("{} / {symbol}", self.name),
        };
        Axis {
            label,
            log,
            ..Axis::default()
        }
    }

    fn at(&self, row: usize) -> f64 {
        self.values[row] / self.unit.size
    }
}

fn chart(title: &str, x: &Quantity, y: &Quantity, branches: &[Branch], y_log: bool) -> Chart {
    let curves = branches.iter().map(|branch| {
        let points = branch.rows.iter().map(|row| [x.at(*row), y.at(*row)]);
        Curve::line(&branch.name, branch.style, points.collect())
    });
    Chart {
        title: title.to_owned(),
        x: x.axis(true),
        y: y.axis(y_log),
        curves: curves.collect(),
        ..Chart::default()
    }
}
