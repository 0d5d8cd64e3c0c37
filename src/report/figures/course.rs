//! Figures of the summary over the cycles.

use super::super::plot::{Axis, Chart, Curve, Mark};
use super::super::quantity::{
    self, ENERGY, FREQUENCY, LENGTH, NUMBER, PRESSURE, SHARE, STIFFNESS, Units, VOLUME,
    VOLUME_RATE, in_unit, unit_of,
};
use super::super::{ReportError, error_bar_of};
use super::{Figure, Of, Study, dotted, drawn};

/// A column of the summary.
struct Course {
    column: &'static str,
    /// What it is called in a sentence, and at an axis.
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

/// Figure, its heading, what the reader should know beside the numbers, and its columns.
type Plan = (&'static str, &'static str, &'static str, &'static [Course]);

const PLANS: [Plan; 6] = [
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
        "Cells with any pressure, and those with more than a thousandth of the largest: in worn slip zones pressure tends to zero, \
         which makes the first a fragile figure.",
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
        "Wear rate and worn volume over the cycles",
        "",
        &[
            course("wear_rate", "wear rate", VOLUME_RATE),
            course("wear_volume", "worn volume", VOLUME),
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
        "Resonance over the cycles",
        "",
        &[
            course("resonance_frequency", "resonance frequency", FREQUENCY),
            course("peak_amplitude", "peak amplitude", LENGTH),
        ],
    ),
];

/// An ordinate of this spread is logarithmic.
const SPREAD: f64 = 30.0;

/// One figure a [`PLANS`] entry, where a run has a course.
pub fn figures(study: &Study) -> Result<Vec<Figure>, ReportError> {
    let figures: Result<Vec<Option<Figure>>, ReportError> =
        PLANS.iter().map(|plan| figure(study, plan)).collect();
    Ok(figures?.into_iter().flatten().collect())
}

fn figure(study: &Study, (id, title, note, courses): &Plan) -> Result<Option<Figure>, ReportError> {
    let wears = |run: &&Of| run.cycles.len() > 1 && run.column("cycles").is_some();
    let runs: Vec<&Of> = study.runs.iter().filter(wears).collect();
    let (mut drawings, mut sentences, mut columns) = (Vec::new(), Vec::new(), vec!["cycles"]);
    for course in *courses {
        let Some(chart) = chart(study, &runs, course) else {
            continue;
        };
        drawings.push(chart.draw().map_err(drawn(id))?);
        sentences.push(sentence(&runs, course));
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
        true => " Bars are the error bars of the run's own estimate.",
        false => "",
    };
    Ok(Some(Figure {
        id,
        title: (*title).to_owned(),
        drawings,
        caption: format!("{} {note}{rings}{bars}", sentences.join(" "))
            .replace("  ", " ")
            .trim()
            .to_owned(),
        query: study.query("summary", &columns),
        sources: vec![("summary", columns)],
    }))
}

fn has(runs: &[&Of], column: &str) -> bool {
    runs.iter().any(|run| run.column(column).is_some())
}

/// The rows at which the contact elements were renewed, the first elements not counted.
fn updates(run: &Of) -> Vec<usize> {
    let flags = run.column("updated").unwrap_or_default();
    let renewed = flags.iter().enumerate().skip(1);
    renewed
        .filter(|(_, flag)| **flag == 1.0)
        .map(|(row, _)| row)
        .collect()
}

fn updates_sentence(runs: &[&Of]) -> String {
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

fn chart(study: &Study, runs: &[&Of], course: &Course) -> Option<Chart> {
    let columns: Vec<(&&Of, Vec<f64>)> = runs
        .iter()
        .filter_map(|run| Some((run, run.column(course.column)?)))
        .collect();
    let all = || columns.iter().flat_map(|(_, values)| values);
    let unit = unit_of(course.units, quantity::largest(all()));
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
        curves.push(Curve {
            bars,
            ..dotted(&run.label, run.style, points)
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
            ..Axis::default()
        },
        y: Axis {
            label: labelled(course.name, unit.symbol),
            log,
            range: None,
        },
        curves,
    })
}

/// Quantity and unit at an axis.
pub fn labelled(name: &str, symbol: &str) -> String {
    match symbol {
        "" => name.to_owned(),
        symbol => format!("{name} / {symbol}"),
    }
}

/// With a capital.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    // Symbols stay as they are.
    match letters.next() {
        Some(first) if text.chars().nth(1).is_some_and(char::is_lowercase) => {
            first.to_uppercase().collect::<String>() + letters.as_str()
        }
        _ => text.to_owned(),
    }
}

fn sentence(runs: &[&Of], course: &Course) -> String {
    let each: Vec<String> = runs
        .iter()
        .filter_map(|run| {
            let values = run.column(course.column)?;
            let (first, last) = (*values.first()?, *values.last()?);
            let unit = unit_of(course.units, quantity::largest(&[first, last]));
            Some(match runs {
                [_] => format!(
                    "{} {} from {} to {}{}.",
                    capitalised(course.name),
                    verb(first, last),
                    quantity::number(first / unit.size),
                    in_unit(last, unit),
                    change(first, last)
                ),
                _ => format!(
                    "{} {} to {}",
                    run.label,
                    quantity::number(first / unit.size),
                    in_unit(last, unit)
                ),
            })
        })
        .collect();
    match runs {
        [_] => each.join(" "),
        _ => format!("{}: {}.", capitalised(course.name), each.join("; ")),
    }
}

fn verb(first: f64, last: f64) -> &'static str {
    if last > first {
        "rises"
    } else if last < first {
        "falls"
    } else {
        "stays"
    }
}

/// The change in percent, where it says something.
fn change(first: f64, last: f64) -> String {
    let change = 100.0 * (last / first - 1.0);
    if !change.is_finite() || change == 0.0 || first.signum() != last.signum() {
        return String::new();
    }
    let sign = if change > 0.0 { "+" } else { "" };
    format!(" ({sign}{}\u{a0}%)", quantity::digits(change, 3))
}
