//! Figures of a joint with error bars. The commands `run`, `status` and `compare` print the figures.

use fretwear::report::quantity::{self, Unit, Units};
use fretwear::report::{figure_with_bar, upper_bound};
use fretwear::stages::{JointState, RunEnds};
use fretwear::tables::typed::Summary;
use serde_json::{Value, json};

use crate::progress::grouped;
use crate::terminal::Results;

/// Number of significant digits of a figure.
pub const DIGITS: usize = 4;

/// Title, units, value and relative error bar of a figure of a joint.
pub struct Figure {
    pub title: &'static str,
    pub units: Units,
    value_of: fn(&JointState) -> Option<f64>,
    bar: fn(&Summary) -> Option<f64>,
}

const fn figure(
    (title, units): (&'static str, Units),
    of: fn(&JointState) -> Option<f64>,
    bar: fn(&Summary) -> Option<f64>,
) -> Figure {
    Figure {
        title,
        units,
        value_of: of,
        bar,
    }
}

const FRICTION: &str = "friction of a cycle";

/// All figures, in print order. Resonance and amplitude belong to the response with the state's own contact elements,
/// as in a report. If a state has no response with its own contact elements, resonance and amplitude belong to the
/// vibration that drives the wear.
#[rustfmt::skip]
pub const FIGURES: [Figure; 19] = [
    figure(("resonance", quantity::FREQUENCY), JointState::resonance, |s| s.error_resonance_frequency),
    figure(("amplitude at resonance", quantity::LENGTH), |s| s.response.as_ref()?.resonance_amplitude, |s| s.error_peak_amplitude),
    figure(("amplitude at dynamics.at", quantity::LENGTH), JointState::forced_amplitude, |s| s.error_peak_amplitude),
    figure(("largest amplitude", quantity::LENGTH), JointState::driving_amplitude, |s| s.error_peak_amplitude),
    figure(("worn volume", quantity::VOLUME), |s| s.summary.wear_volume, |s| s.error_wear_volume),
    figure(("largest depth", quantity::LENGTH), |s| s.summary.largest_depth, |s| s.error_largest_depth),
    figure(("depth of 1 %", quantity::LENGTH), |s| s.summary.depth_99, |s| s.error_depth_99),
    figure(("wear rate", quantity::VOLUME_RATE), |s| s.summary.wear_rate, |s| s.error_dissipated_energy),
    figure((FRICTION, quantity::ENERGY), |s| s.summary.dissipated_energy, |s| s.error_dissipated_energy),
    // Skip a constant load, which is an input of the scene.
    figure(("bolt load", quantity::FORCE), |s| s.summary.error_normal_load.and(s.summary.normal_load), |s| s.error_normal_load),
    figure(("stiffness kn", quantity::STIFFNESS), |s| s.summary.kn, |s| s.error_kn),
    figure(("stiffness kt", quantity::STIFFNESS), |s| s.summary.kt, |s| s.error_kt),
    figure(("contact area", quantity::SHARE), |s| s.summary.contact_area_fraction, |_| None),
    figure(("corrected area", quantity::SHARE), |s| s.summary.corrected_area_fraction, |s| s.error_corrected_area),
    figure(("loaded area", quantity::SHARE), |s| s.summary.loaded_area_fraction, |s| s.error_loaded_area),
    figure(("largest pressure", quantity::PRESSURE), |s| s.summary.max_pressure, |s| s.error_max_pressure),
    figure(("Rq", quantity::LENGTH), |s| s.summary.rq, |_| None),
    figure(("Sk", quantity::NUMBER), |s| s.summary.sk, |_| None),
    figure(("Ku", quantity::NUMBER), |s| s.summary.ku, |_| None),
];

impl Figure {
    /// Returns the value in a state, if the state has the figure.
    pub fn value(&self, state: &JointState) -> Option<f64> {
        (self.value_of)(state).filter(|value| value.is_finite())
    }

    /// Returns the relative error bar in a state, 0 without a bar.
    fn bar(&self, state: &JointState) -> f64 {
        (self.bar)(&state.summary).unwrap_or(0.0)
    }

    /// Returns the upper bound of a figure whose value has fallen to zero in a state.
    fn limit(&self, state: &JointState) -> Option<f64> {
        let limit = match self.title {
            FRICTION => state.summary.error_dissipated_energy_absolute,
            _ => None,
        };
        limit.filter(|limit| *limit > 0.0 && self.value(state) == Some(0.0))
    }

    /// Returns a readable unit for the values, or upper bounds, in some states.
    pub fn unit<'a>(&self, states: impl IntoIterator<Item = &'a JointState>) -> Unit {
        let size = |state: &JointState| {
            let value = self.value(state)?;
            let limit = self.limit(state);
            Some(
                limit
                    .or_else(|| upper_bound(value, self.bar(state), 0.0))
                    .unwrap_or(value),
            )
        };
        let sizes: Vec<f64> = states.into_iter().filter_map(size).collect();
        quantity::unit_of(self.units, quantity::largest(&sizes))
    }

    /// Formats the figure's value with the error bar, or the upper bound of the value. `number` formats each number.
    /// Returns `None` if the state lacks the figure.
    pub fn text(&self, state: &JointState, number: impl Fn(f64) -> String) -> Option<String> {
        let value = self.value(state)?;
        Some(match self.limit(state) {
            Some(limit) => format!("below {}", number(limit)),
            None => figure_with_bar(value, self.bar(state), 0.0, number),
        })
    }
}

/// Formats a value and the unit of the value.
pub fn format_with_unit(value: f64, unit: Unit) -> String {
    let number = unit.rounded(value, DIGITS);
    format!("{number} {}", unit.symbol).trim_end().to_owned()
}

/// Describes the worn volume \[m³\] of a state with its relative error bar.
pub fn worn_volume_text(volume: f64, bar: Option<f64>) -> String {
    let unit = quantity::unit_of(quantity::VOLUME, volume);
    let number = |volume| format_with_unit(volume, unit);
    format!(
        "worn {}",
        figure_with_bar(volume, bar.unwrap_or(0.0), 0.0, number)
    )
}

/// Row of a table of figures: title, text for the unworn joint, and text for the worn joint. The text for the worn
/// joint includes the error bar.
struct FigureRow(String, String, String);

/// Returns the figures that the states have, in print order. Without an unworn state, the present state is the unworn
/// one, and its text is the last.
fn figure_rows(ends: &RunEnds) -> Vec<FigureRow> {
    let RunEnds { unworn, now } = ends;
    let states = || unworn.iter().chain([now]);
    let row = |figure: &Figure| {
        let unit = figure.unit(states());
        let after = figure.text(now, |value| format_with_unit(value, unit))?;
        let before = unworn.as_ref().and_then(|state| figure.value(state));
        let before = before.map_or_else(String::new, |value| format_with_unit(value, unit));
        Some(FigureRow(figure.title.to_owned(), before, after))
    };
    FIGURES.iter().filter_map(row).collect()
}

/// Returns the figures as JSON: an array of objects with `figure`, `unworn` and `worn_volume_text`, which is null for an unworn joint.
pub fn figures_json(ends: &RunEnds) -> Value {
    let object = |FigureRow(title, before, after): FigureRow| match ends.unworn {
        Some(_) => json!({"figure": title, "unworn": before, "worn": after}),
        None => json!({"figure": title, "unworn": after, "worn": null}),
    };
    figure_rows(ends).into_iter().map(object).collect()
}

/// Prints the figures of the unworn joint and of the present joint, with the error bars of the present joint.
pub fn write_figures(out: &mut Results, ends: &RunEnds) {
    let RunEnds { unworn, now } = ends;
    let mut lines = Vec::new();
    if let Some(cycles) = now.summary.cycles {
        let after = format!("after {} cycles", grouped(cycles.unsigned_abs()));
        lines.push(match unworn {
            Some(_) => FigureRow(String::new(), "unworn".to_owned(), after),
            None => FigureRow(String::new(), String::new(), "unworn".to_owned()),
        });
    }
    lines.extend(figure_rows(ends));
    let widest = lines.iter().map(|row| row.1.chars().count());
    let widest = widest.max().unwrap_or(0);
    for FigureRow(title, before, after) in &lines {
        match unworn {
            Some(_) => writeln!(out, "  {title:<24} {before:>widest$}   {after}"),
            None => writeln!(out, "  {title:<24} {after}"),
        }
    }
    if let (Some(_), Some(_)) = (unworn, &now.response) {
        let Summary {
            resonance_frequency,
            peak_amplitude,
            ..
        } = now.summary;
        let in_words = |value: f64, units| format_with_unit(value, quantity::unit_of(units, value));
        let driving = [
            resonance_frequency.map(|value| in_words(value, quantity::FREQUENCY)),
            peak_amplitude.map(|value| match resonance_frequency {
                Some(_) => format!("{} at most", in_words(value, quantity::LENGTH)),
                None => in_words(value, quantity::LENGTH),
            }),
            Some("with the contact elements of the last update".to_owned()),
        ];
        let driving: Vec<String> = driving.into_iter().flatten().collect();
        out.item("wear-driving vibration", &driving.join(", "));
    }
}
