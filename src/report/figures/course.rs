//! Figures of the summary over the cycles.

use super::super::headline::state_resonances;
use super::super::plot::{Axis, Chart, Curve, Mark, UNCERTAIN};
use super::super::quantity::{
    self, ENERGY, FORCE, FREQUENCY, LENGTH, NUMBER, PRESSURE, SHARE, STIFFNESS, Units, VOLUME,
    VOLUME_RATE, with_best_unit, with_unit,
};
use super::super::{ReportError, error_bar_of, figure_with_bar, upper_bound};
use super::{Figure, ReportedRun, ReportedRuns, dotted};

/// Column of the summary table, as a curve over the cycles.
struct Course {
    column: &'static str,
    /// Name in a sentence and at an axis.
    name: &'static str,
    units: Units,
}

const fn course(column: &'static str, name: &'static str, units: Units) -> Course {
    Course {
        column,
        name,
        units,
    }
}

/// Figure: id, title, note for the reader, and columns.
type Plan = (&'static str, &'static str, &'static str, &'static [Course]);

const LOAD: &str = "normal_load";

const PLANS: [Plan; 7] = [
    (
        "roughness",
        "Surface roughness over the cycles",
        "Wear takes peaks away and leaves valleys: a Gaussian surface has skewness 0 and kurtosis 3.",
        &[
            course("mean_height", "mean height", LENGTH),
            course("rq", "Rq", LENGTH),
            course("sk", "skewness Sk", NUMBER),
            course("ku", "kurtosis Ku", NUMBER),
        ],
    ),
    (
        "contact-area",
        "Real contact area and largest pressure over the cycles",
        "The contact area counts all cells with pressure. The loaded area counts the cells above a thousandth of the largest pressure. \
         In worn slip zones pressure tends to zero, so the contact area is a fragile figure.",
        &[
            course("contact_area_fraction", "contact area, p > 0", SHARE),
            course("loaded_area_fraction", "loaded area", SHARE),
            course("max_pressure", "largest pressure", PRESSURE),
        ],
    ),
    (
        "stiffness",
        "Contact stiffness over the cycles",
        "",
        &[
            course("kn", "normal stiffness kn", STIFFNESS),
            course("kt", "tangential stiffness kt", STIFFNESS),
        ],
    ),
    (
        "wear-rate",
        "Worn volume and wear rate over the cycles",
        "",
        &[
            course("wear_volume", "worn volume", VOLUME),
            course("wear_rate", "wear rate", VOLUME_RATE),
        ],
    ),
    (
        "depth",
        "Wear depth and bolt load over the cycles",
        "Depths are the sum over both faces.",
        &[
            course("largest_depth", "largest depth", LENGTH),
            course("depth_99", "depth that 1 % of the cells exceed", LENGTH),
            course(LOAD, "bolt load", FORCE),
        ],
    ),
    (
        "dissipation",
        "Dissipated energy over the cycles",
        "",
        &[
            course("dissipated_energy", "energy per cycle", ENERGY),
            course("dissipated_energy_total", "energy so far", ENERGY),
        ],
    ),
    (
        "resonance",
        "Vibration over the cycles",
        "This is the vibration that drives the wear. It uses the contact elements of the last model update.",
        &[
            course("resonance_frequency", "resonance frequency", FREQUENCY),
            course("peak_amplitude", "peak amplitude", LENGTH),
        ],
    ),
];

/// Ratio of the largest to the smallest value above which the ordinate is logarithmic.
const SPREAD: f64 = 30.0;

/// Fraction of the total change of a column. The axis of cycles is logarithmic if the column changes by this fraction
/// within the first fraction [`EARLY`] of the cycles.
const BEGINNING: f64 = 0.1;
/// See [`BEGINNING`].
const EARLY: f64 = 0.05;

/// Draws one figure per entry of [`PLANS`] that a run has data for.
pub fn figures(study: &ReportedRuns) -> Result<Vec<Figure>, ReportError> {
    let figures: Result<Vec<Option<Figure>>, ReportError> =
        PLANS.iter().map(|plan| figure(study, plan)).collect();
    Ok(figures?.into_iter().flatten().collect())
}

fn figure(
    study: &ReportedRuns,
    (id, title, note, courses): &Plan,
) -> Result<Option<Figure>, ReportError> {
    let wears = |run: &&ReportedRun| run.cycles.len() > 1 && run.column("cycles").is_some();
    let runs: Vec<&ReportedRun> = study.runs.iter().filter(wears).collect();
    let (mut drawings, mut sentences, mut columns) = (Vec::new(), Vec::new(), vec!["cycles"]);
    let mut early_names = Vec::new();
    // A constant bolt load is not drawn.
    let is_constant_load = !has(&runs, "error_normal_load");
    let drawn_courses = courses
        .iter()
        .filter(|course| course.column != LOAD || !is_constant_load);
    for course in drawn_courses {
        let runs_in = runs.iter().any(|run| runs_in(run, course.column));
        let zero = runs_in.then(|| place_of_zero(study, &runs)).flatten();
        let Some(chart) = chart(study, &runs, course, zero) else {
            continue;
        };
        early_names.extend(zero.map(|_| course.name));
        drawings.push(chart.draw());
        sentences.push(sentence(study, &runs, course));
        columns.push(course.column);
        columns.extend(error_bar_of(course.column).filter(|name| has(&runs, name)));
    }
    if drawings.is_empty() {
        return Ok(None);
    }
    if has(&runs, "updated") {
        columns.push("updated");
    }
    columns.dedup();
    let updates = updates_sentence(&runs);
    let rings = match id {
        _ if updates.is_empty() => String::new(),
        &"wear-rate" => format!(" {updates}"),
        _ => " Rings mark model updates.".to_owned(),
    };
    let bars = match columns.iter().any(|name| name.starts_with("error_")) {
        true => " Bars show the run's own error estimates.",
        false => "",
    };
    let hollow = courses.iter().any(|course| {
        let errors =
            error_bar_of(course.column).map(|name| runs.iter().filter_map(|run| run.column(name)));
        errors.is_some_and(|mut errors| errors.any(|errors| errors.iter().any(|e| *e >= UNCERTAIN)))
    });
    let hollow = match hollow {
        true => " A hollow point has no bar, because the error is about as large as the value.",
        false => "",
    };
    let axis = match early_names.len() {
        0 => String::new(),
        all if all == drawings.len() => {
            " Much of the change comes early, so the axis of cycles is logarithmic. The unworn joint is at its 0.".to_owned()
        }
        _ => format!(
            " Much of the change of {} comes early, so their axis of cycles is logarithmic. The unworn joint is at its 0.",
            early_names.join(" and ")
        ),
    };
    // The caption states the phase resonances of the last states. A reader can then compare the phase resonances with
    // the peaks of the forced responses.
    let state_resonances = match *id {
        "resonance" => state_resonances_sentence(study, &runs)?,
        _ => String::new(),
    };
    Ok(Some(Figure {
        id,
        title: (*title).to_owned(),
        drawings,
        states: Vec::new(),
        caption: format!(
            "{} {note}{state_resonances}{rings}{bars}{hollow}{axis}",
            sentences.join(" ")
        )
        .replace("  ", " ")
        .trim()
        .to_owned(),
        query: study.query("summary", &columns),
        sources: vec![("summary", columns)],
    }))
}

/// Returns true if a column changes so early that a linear axis of cycles hides the change.
fn runs_in(run: &ReportedRun, column: &str) -> bool {
    let (Some(values), Some(end)) = (run.column(column), run.cycles.last()) else {
        return false;
    };
    let (Some(first), Some(last)) = (values.first(), values.last()) else {
        return false;
    };
    let threshold = BEGINNING * (last - first).abs();
    let course = run.cycles.iter().zip(&values);
    let mut beyond =
        course.filter(|(_, value)| threshold > 0.0 && (*value - first).abs() >= threshold);
    beyond
        .next()
        .is_some_and(|(cycles, _)| *cycles < EARLY * end)
}

/// Returns the abscissa of the unworn joint on a logarithmic axis: a power of ten below all other cycles.
fn place_of_zero(study: &ReportedRuns, runs: &[&ReportedRun]) -> Option<f64> {
    let worn = runs
        .iter()
        .flat_map(|run| &run.cycles)
        .filter(|cycles| **cycles > 0.0);
    let first = worn.fold(f64::INFINITY, |least, cycles| least.min(*cycles)) / study.cycles().size;
    first
        .is_finite()
        .then(|| 10f64.powf((first / 2.0).log10().floor()))
}

/// Returns a sentence with the phase resonance of each run at its last state. The contact elements of the last state
/// determine the resonance.
fn state_resonances_sentence(
    study: &ReportedRuns,
    runs: &[&ReportedRun],
) -> Result<String, ReportError> {
    let mut each = Vec::new();
    let unit = study.unit("peak_amplitude", LENGTH);
    for run in runs {
        let Some([_, last_state]) = state_resonances(run)? else {
            continue;
        };
        let amplitude = with_unit(last_state.amplitude, unit);
        let frequency = with_best_unit(last_state.frequency, FREQUENCY);
        let name = match runs {
            [_] => String::new(),
            _ => format!("{} ", run.label),
        };
        each.push(format!("{name}{amplitude} at {frequency}"));
    }
    Ok(match each.is_empty() {
        true => String::new(),
        false => format!(
            " With the contact elements of its last state, the worn joint resonates with {}.",
            each.join("; ")
        ),
    })
}

fn has(runs: &[&ReportedRun], column: &str) -> bool {
    runs.iter().any(|run| run.column(column).is_some())
}

/// Returns the rows of the model updates. The first contact elements do not count as an update.
fn updates(run: &ReportedRun) -> Vec<usize> {
    let flags = run.column("updated").unwrap_or_default();
    let renewed = flags.iter().enumerate().skip(1);
    renewed
        .filter(|(_, flag)| **flag == 1.0)
        .map(|(row, _)| row)
        .collect()
}

fn updates_sentence(runs: &[&ReportedRun]) -> String {
    let counts: Vec<usize> = runs.iter().map(|run| updates(run).len()).collect();
    match counts[..] {
        _ if counts.iter().all(|count| *count == 0) => String::new(),
        [1] => "The ring marks the model update.".to_owned(),
        [count] => format!("Rings mark the {count} model updates."),
        _ => {
            let each = runs.iter().zip(&counts);
            let each: Vec<String> = each
                .map(|(run, count)| format!("{} {count}", run.label))
                .collect();
            format!("Rings mark model updates ({}).", each.join(", "))
        }
    }
}

fn chart(
    study: &ReportedRuns,
    runs: &[&ReportedRun],
    course: &Course,
    zero: Option<f64>,
) -> Option<Chart> {
    let columns = runs.iter().filter_map(|run| {
        let (mut values, resolution) = (run.column(course.column)?, run.resolution(course.column));
        let rounding_errors = values.iter_mut().filter(|value| value.abs() < resolution);
        rounding_errors.for_each(|value| *value = 0.0);
        Some((run, values))
    });
    let columns: Vec<(&&ReportedRun, Vec<f64>)> = columns.collect();
    let all = || columns.iter().flat_map(|(_, values)| values);
    let unit = study.unit(course.column, course.units);
    let cycles = study.cycles();
    let finite = || all().copied().filter(|value| value.is_finite());
    let least = finite().fold(f64::INFINITY, f64::min);
    if !least.is_finite() {
        return None;
    }
    let log = least > 0.0 && finite().fold(0.0, f64::max) > SPREAD * least;
    let mut curves = Vec::new();
    for (run, values) in &columns {
        let errors = error_bar_of(course.column).and_then(|name| run.column(name));
        let point = |row: usize| [run.cycles[row] / cycles.size, values[row] / unit.size];
        let points: Vec<[f64; 2]> = (0..values.len()).map(point).collect();
        let bars = errors.map_or(Vec::new(), |errors| {
            let each = points.iter().zip(errors);
            each.map(|(point, error)| error * point[1].abs()).collect()
        });
        let name = if study.is_single() {
            "iteration"
        } else {
            &run.label
        };
        curves.push(Curve {
            bars,
            ..dotted(name, run.style, points)
        });
        let rings: Vec<[f64; 2]> = updates(run).into_iter().map(point).collect();
        if !rings.is_empty() {
            let name = if study.is_single() {
                "model update"
            } else {
                ""
            };
            curves.push(Curve {
                mark: Mark::Rings,
                ..Curve::line(name, run.style, rings)
            });
        }
    }
    Some(Chart {
        title: capitalised(course.name),
        x: Axis {
            label: cycles.symbol.to_owned(),
            log: zero.is_some(),
            zero,
            range: None,
        },
        y: Axis {
            label: axis_label(course.name, unit.symbol),
            log,
            ..Axis::default()
        },
        curves,
        ..Chart::default()
    })
}

/// Returns the label of an axis: quantity and unit.
pub fn axis_label(name: &str, symbol: &str) -> String {
    match symbol {
        "" => name.to_owned(),
        symbol => format!("{name} / {symbol}"),
    }
}

/// Capitalises the first letter of a text.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    // Symbols keep their letters.
    match letters.next() {
        Some(first) if text.chars().nth(1).is_some_and(char::is_lowercase) => {
            first.to_uppercase().collect::<String>() + letters.as_str()
        }
        _ => text.to_owned(),
    }
}

fn sentence(study: &ReportedRuns, runs: &[&ReportedRun], course: &Course) -> String {
    let unit = study.unit(course.column, course.units);
    let each: Vec<String> = runs
        .iter()
        .filter_map(|run| {
            let values = run.column(course.column)?;
            let (name, ends) = (
                capitalised(course.name),
                [*values.first()?, *values.last()?],
            );
            let resolution = run.resolution(course.column);
            let [before, after] =
                ends.map(|v| figure_with_bar(v, 0.0, resolution, |v| with_unit(v, unit)));
            let stays = before == after || ends.iter().all(|v| v.abs() < resolution);
            let plain = figure_with_bar(ends[0], 0.0, resolution, |v| {
                quantity::four_digits(v / unit.size)
            });
            Some(match (runs, stays) {
                ([_], true) if after.starts_with("below") => format!("{name} stays {after}."),
                ([_], true) => format!("{name} stays at {after}."),
                ([_], false) => {
                    let are_known = ends
                        .iter()
                        .all(|v| upper_bound(*v, 0.0, resolution).is_none());
                    let change = if are_known {
                        change(ends)
                    } else {
                        String::new()
                    };
                    format!("{name} {} from {plain} to {after}{change}.", verb(ends))
                }
                (_, true) => format!("{} {after}", run.label),
                (_, false) => format!("{} {plain} to {after}", run.label),
            })
        })
        .collect();
    match runs {
        [_] => each.join(" "),
        _ => format!("{}: {}.", capitalised(course.name), each.join("; ")),
    }
}

fn verb([first, last]: [f64; 2]) -> &'static str {
    if last > first { "rises" } else { "falls" }
}

/// Formats the relative change from the first to the last value in percent. Returns an empty text if the value did not
/// change, changed its sign, or grew by a factor of ten.
fn change([first, last]: [f64; 2]) -> String {
    let change = 100.0 * (last / first - 1.0);
    // Beyond a factor of ten the two values say more than the change.
    let is_informative = change.abs() < 900.0 && change != 0.0 && first.signum() == last.signum();
    if !is_informative {
        return String::new();
    }
    let sign = if change > 0.0 { "+" } else { "" };
    format!(
        " ({sign}{}\u{a0}%)",
        quantity::significant_digits(change, 3)
    )
}
