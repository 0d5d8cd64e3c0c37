//! Headline of a run: a few sentences on the wear, the resonance and the stiffness.

use super::figure_text::upper_bound;
use super::figures::{ReportedRun, ReportedRuns};
use super::quantity::{
    self, ENERGY, FORCE, FREQUENCY, LENGTH, PRESSURE, SHARE, STIFFNESS, Unit, Units, VOLUME,
};
use super::run_tables::numeric_column;
use super::{ReportError, error_bar_of, figure_with_bar, percent};
use crate::milestones::{self, States};
use crate::tables::TableName;

/// Explains the error bars of the headlines, once per page.
pub const ERROR_BAR_NOTE: &str = "± is the run's own error estimate. It covers wear steps, tolerances, harmonics and contact elements, but not the grid \
     and the mesh.";

/// Relative change below which a quantity counts as unchanged.
const STAYED: f64 = 1e-4;
/// Significant digits of a quantity in a headline.
const DIGITS: usize = 3;

/// Returns the headline of a run, or `None` for a run without figures.
///
/// # Errors
/// Returns [`ReportError`] for a table that cannot be read.
pub fn headline(study: &ReportedRuns, run: &ReportedRun) -> Result<Option<String>, ReportError> {
    let vibration = vibration(study, run)?;
    let stiffness = || course(study, run, "kn", "normal stiffness", STIFFNESS, true);
    let worn = run.column("wear_volume").and_then(|v| v.last().copied());
    let sentences: Vec<String> = match (worn, run.cycles.last()) {
        (Some(volume), Some(cycles)) if volume > 0.0 => {
            let lost = with_bar(volume, VOLUME[0], bar(run, "wear_volume"));
            let first = format!(
                "After {} cycles the joint has lost {lost}.",
                grouped_count(*cycles)
            );
            let energy = || {
                course(
                    study,
                    run,
                    "dissipated_energy",
                    "energy dissipated in a cycle",
                    ENERGY,
                    false,
                )
            };
            let falls = run.column("error_normal_load").is_some();
            let load = || course(study, run, "normal_load", "bolt load", FORCE, false);
            let mut rest: Vec<String> = load().filter(|_| falls).into_iter().collect();
            rest.extend(vibration);
            rest.extend(stiffness());
            if rest.len() < 2 {
                rest.extend(energy());
            }
            let rest = (!rest.is_empty()).then(|| format!("Its {}.", sentence_list(&rest)));
            let lost = lost_load(run)?;
            [first].into_iter().chain(rest).chain(lost).collect()
        }
        (volume, cycles) => [
            volume
                .zip(cycles.filter(|cycles| **cycles > 0.0))
                .map(|(_, cycles)| {
                    format!("After {} cycles nothing has worn.", grouped_count(*cycles))
                }),
            unworn_contact(study, run),
            (!vibration.is_empty()).then(|| format!("Its {}.", sentence_list(&vibration))),
        ]
        .into_iter()
        .flatten()
        .collect(),
    };
    Ok((!sentences.is_empty()).then(|| sentences.join(" ")))
}

/// Returns the headlines of all runs. If there are several runs, each headline has the label of its run.
pub fn headlines(study: &ReportedRuns) -> Result<Vec<(Option<String>, String)>, ReportError> {
    let mut headlines = Vec::new();
    for run in &study.runs {
        let name = (!study.is_single()).then(|| run.label.clone());
        headlines.extend(headline(study, run)?.map(|text| (name, text)));
    }
    Ok(headlines)
}

/// Describes the contact of a joint without wear: area, pressure and stiffness.
fn unworn_contact(study: &ReportedRuns, run: &ReportedRun) -> Option<String> {
    let last = |column: &str| {
        run.column(column)?
            .last()
            .copied()
            .filter(|v| v.is_finite())
    };
    let value_of = |column: &str, units| Some(shown(last(column)?, study.unit(column, units)));
    let area = value_of("contact_area_fraction", SHARE)?;
    let load = quantity::with_unit(last("normal_load")?, study.unit("normal_load", FORCE));
    let most = value_of("max_pressure", PRESSURE)?;
    let mut text =
        format!("Under {load} {area} of the joint is in contact. The largest pressure is {most}.");
    let stiffness = [("kn", "normal"), ("kt", "tangential")]
        .into_iter()
        .filter_map(|(column, name)| {
            Some(format!(
                "{name} stiffness is {}",
                value_of(column, STIFFNESS)?
            ))
        });
    let stiffness: Vec<String> = stiffness.collect();
    if !stiffness.is_empty() {
        text += &format!(" Its {}.", sentence_list(&stiffness));
    }
    Some(text)
}

/// Describes the change of the resonance frequency and of the amplitude at the resonance.
///
/// The resonance and the amplitude come from the forced responses of the first and the last state, if the run computed
/// both responses. If the run lacks one response, both values come from the vibration that drives the wear. The summary
/// of that vibration contains the largest amplitude, not the amplitude at the phase resonance.
fn vibration(study: &ReportedRuns, run: &ReportedRun) -> Result<Vec<String>, ReportError> {
    let state_ends = state_resonances(run)?;
    let state_ends = state_ends.filter(|[.., last]| last.wear_iteration == run.tables.latest());
    let pairs = |column: &str, value: fn(&Resonance) -> f64| match &state_ends {
        Some([first, last]) => Some([value(first), value(last)]),
        None => {
            let values = run.column(column)?;
            Some([*values.first()?, *values.last()?])
        }
    };
    let response = run.tables.recipe().response.as_ref();
    let fixed_frequency = response.and_then(|response| response.at_frequency);
    let amplitude = match (&state_ends, fixed_frequency) {
        (Some(_), _) => "amplitude at resonance".to_owned(),
        (None, Some(fixed_frequency)) => format!(
            "amplitude at {}",
            quantity::with_best_unit(fixed_frequency, FREQUENCY)
        ),
        (None, None) => "largest amplitude".to_owned(),
    };
    let columns = [
        (
            "resonance_frequency",
            "resonance",
            FREQUENCY,
            (|r| r.frequency) as fn(&Resonance) -> f64,
        ),
        ("peak_amplitude", &*amplitude, LENGTH, |r| r.amplitude),
    ];
    let each = columns
        .into_iter()
        .enumerate()
        .filter_map(|(k, (column, name, units, value))| {
            let ends = pairs(column, value).filter(|ends| ends.iter().all(|v| v.is_finite()))?;
            let article = if k == 0 { "" } else { "the " };
            // The truncation error of the harmonics is nearly the same at both ends, so the change has its own error
            // bar.
            let change_bar = run.column("error_resonance_change").filter(|_| k == 0);
            let change_bar = change_bar.and_then(|bars| bars.last().copied());
            Some(change(
                &format!("{article}{name}"),
                ends,
                study.unit(column, units),
                bar(run, column),
                change_bar,
                false,
            ))
        });
    Ok(each.collect())
}

/// Phase resonance of a state of wear, computed with the contact elements of that state.
pub struct Resonance {
    wear_iteration: u64,
    /// Frequency \[Hz\].
    pub frequency: f64,
    /// Amplitude \[m\].
    pub amplitude: f64,
}

/// Reads the phase resonances of the first and of the last state that has its own response.
///
/// # Errors
/// Returns [`ReportError`] for a table that cannot be read.
pub fn state_resonances(run: &ReportedRun) -> Result<Option<[Resonance; 2]>, ReportError> {
    let states = run.iterations_with(TableName::WornResponse, 2);
    let read = |k: u64| -> Result<Option<Resonance>, ReportError> {
        let frame = run
            .tables
            .iteration_table(k, TableName::WornResponse)?
            .unwrap_or_default();
        let first = |column: &str| numeric_column(&frame, column)?.first().copied();
        let both = first("resonance_frequency").zip(first("resonance_amplitude"));
        Ok(both.map(|(frequency, amplitude)| Resonance {
            wear_iteration: k,
            frequency,
            amplitude,
        }))
    };
    // The table of a joint without a resonance is empty.
    let (Some(first), Some(last)) = (states.first(), states.last()) else {
        return Ok(None);
    };
    if first == last && run.column("cycles").is_some_and(|cycles| cycles.len() > 1) {
        return Ok(None);
    }
    Ok(read(*first)?
        .zip(read(*last)?)
        .map(|(first, last)| [first, last]))
}

/// Describes the change of a column of the summary. Returns `None` if the run does not have the column.
fn course(
    study: &ReportedRuns,
    run: &ReportedRun,
    column: &str,
    name: &str,
    units: Units,
    times: bool,
) -> Option<String> {
    let unit = study.unit(column, units);
    let values = run.column(column)?;
    let ends = [*values.first()?, *values.last()?];
    if ends.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let name = format!("the {name}");
    Some(match zero_below(run, column).filter(|_| ends[1] == 0.0) {
        Some(limit) => below(&name, ends[0], limit, unit),
        None => change(&name, ends, unit, bar(run, column), None, times),
    })
}

/// Returns the absolute error bar of a column. If the figure has dropped to zero, the error bar is an upper bound of
/// the figure.
fn zero_below(run: &ReportedRun, column: &str) -> Option<f64> {
    let limit = run.column(&format!("error_{column}_absolute"))?;
    limit.last().copied().filter(|limit| *limit > 0.0)
}

/// Lost parts of the bolt load that a headline reports, the largest first.
const LOST: [f64; 5] = [0.5, 0.3, 0.2, 0.1, 0.05];

/// Reports after how many cycles the largest of the parts [`LOST`] was lost, with the earliest and latest estimates.
fn lost_load(run: &ReportedRun) -> Result<Option<String>, ReportError> {
    let reader = run.tables.reader();
    let states = States::read(reader).map_err(|source| ReportError::Run {
        run: run.tables.root().to_owned(),
        source,
    })?;
    let Ok(history) = states.history(milestones::Figure::Preload) else {
        return Ok(None);
    };
    let unworn = history.values[0];
    let mut lost = LOST.iter().filter_map(|part| {
        let crossing = history.crossing((1.0 - part) * unworn)?;
        let [earliest, nominal] = [crossing.earliest?, crossing.nominal?].map(three_digits);
        let latest = crossing.latest.map_or_else(
            || format!("beyond {}", grouped_count(history.end())),
            |cycles| format!("{} at the latest", grouped_count(three_digits(cycles))),
        );
        Some(format!(
            "{:.0}\u{a0}% of the bolt load was lost after {} cycles, {} at the earliest and {latest}.",
            100.0 * part,
            grouped_count(nominal),
            grouped_count(earliest),
        ))
    });
    Ok(lost.next())
}

/// Rounds a count to three significant digits.
fn three_digits(count: f64) -> f64 {
    let step = 10f64.powf((count.max(1.0).log10().floor() - 2.0).max(0.0));
    (count / step).round() * step
}

/// Describes the first and the last value of a quantity.
///
/// The text marks a change that is smaller than the error bar of the change. If the error bar of the change is unknown,
/// the text uses the error bar of the last value.
fn change(
    name: &str,
    [first, last]: [f64; 2],
    unit: Unit,
    bar: Option<f64>,
    change_bar: Option<f64>,
    times: bool,
) -> String {
    if let Some(limit) = upper_bound(last, bar.unwrap_or(0.0), 0.0) {
        return below(name, first, limit, unit);
    }
    let bar_text = bar.map_or(String::new(), |bar| format!(" ± {}", percent(bar)));
    let [before, now] = [first, last].map(|value| unit.rounded(value, DIGITS));
    if before == now || (last - first).abs() <= STAYED * last.abs() {
        return format!("{name} stayed at {now}\u{a0}{}{bar_text}", unit.symbol);
    }
    let verb = if last > first { "rose" } else { "fell" };
    let ratio = last / first;
    let factor = match times && ratio.is_finite() && ratio > 1.005 {
        true => format!(
            ", {} times what it was",
            quantity::NUMBER[0].rounded(ratio, DIGITS)
        ),
        false => String::new(),
    };
    let doubtful = match change_bar.or(bar.map(|bar| bar * last.abs())) {
        Some(bar) if (last - first).abs() <= bar => ", a change within its error bar",
        _ => "",
    };
    format!(
        "{name} {verb} from {before} to {now}\u{a0}{}{bar_text}{factor}{doubtful}",
        unit.symbol
    )
}

/// Describes the first value of a quantity and the upper bound of its last value, if only a bound is known.
fn below(name: &str, first: f64, most: f64, unit: Unit) -> String {
    let [before, now] = [first, most].map(|value| unit.rounded(value, DIGITS));
    match first > most {
        true => format!(
            "{name} fell from {before} to below {now}\u{a0}{}",
            unit.symbol
        ),
        false => format!(
            "{name} was {before} and is below {now}\u{a0}{}",
            unit.symbol
        ),
    }
}

/// Returns the error bar of a column at the last iteration, if it is positive.
fn bar(run: &ReportedRun, column: &str) -> Option<f64> {
    let bar = run.column(error_bar_of(column)?)?.last().copied()?;
    (bar.is_finite() && bar > 0.0).then_some(bar)
}

fn shown(value: f64, unit: Unit) -> String {
    format!("{}\u{a0}{}", unit.rounded(value, DIGITS), unit.symbol)
}

fn with_bar(value: f64, unit: Unit, bar: Option<f64>) -> String {
    figure_with_bar(value, bar.unwrap_or(0.0), 0.0, |value| shown(value, unit))
}

/// Formats a count in groups of three digits.
fn grouped_count(count: f64) -> String {
    let digits = format!("{count:.0}");
    let mut grouped = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k) % 3 == 0 {
            grouped.push('\u{202f}');
        }
        grouped.push(digit);
    }
    grouped
}

/// Joins the parts of a sentence.
fn sentence_list(things: &[String]) -> String {
    match things {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{}; {last}", first.join("; ")),
    }
    .trim_start_matches("the ")
    .to_owned()
}

#[cfg(test)]
mod tests {
    use super::{VOLUME, change, with_bar};
    use crate::report::quantity::{ENERGY, unit_of};

    #[test]
    fn what_may_be_off_by_all_of_itself_is_known_by_what_it_is_below() {
        let mj = unit_of(ENERGY, 1e-3);
        let text = |bar| {
            change(
                "the energy",
                [18.6e-3, 0.407e-3],
                mj,
                Some(bar),
                None,
                false,
            )
        };
        assert_eq!(
            text(1.49),
            "the energy fell from 18.6 to below 1.01\u{a0}mJ"
        );
        assert_eq!(
            text(0.5),
            "the energy fell from 18.6 to 0.407\u{a0}mJ ± 50 %"
        );
        let small = change("the energy", [0.5e-3, 0.4e-3], mj, Some(2.0), None, false);
        assert!(
            small.contains(" was ") && small.contains(" is below "),
            "{small}"
        );
        assert_eq!(with_bar(2e-9, VOLUME[0], Some(1.5)), "below 5.00\u{a0}mm³");
    }

    #[test]
    fn what_prints_alike_has_stayed() {
        let text = |last| change("the energy", [28.80, last], ENERGY[2], None, None, true);
        assert_eq!(text(28.83), "the energy stayed at 28.8\u{a0}J");
        assert_eq!(text(28.9), "the energy rose from 28.8 to 28.9\u{a0}J");
    }
}
