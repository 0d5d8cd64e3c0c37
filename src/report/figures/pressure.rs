//! Figures of the contact pressure: maps and a histogram.

use super::super::ReportError;
use super::super::plot::{Axis, Chart, Curve, NO_DATA, Scale, UNWORN, WORN};
use super::super::quantity::{self, PRESSURE, SHARE, unit_of, with_best_unit};
use super::course::axis_label;
use super::surface::{heading, map, with_run_name};
use super::{Figure, ReportedRun, ReportedRuns, colour_top, range_of};
use crate::tables::TableName;

/// Number of classes of the histogram, ten per decade.
const CLASSES: usize = 40;
/// Decades of pressure that the histogram shows.
const DECADES: f64 = 4.0;
/// Lower end of the colours of a map, relative to the largest pressure. Cells below do not count as loaded.
pub const LOADED: f64 = 1e-3;

/// Maximum number of maps of a single run. Each of several runs has maps of its first and its last state.
const STATES: usize = 4;

/// Pressure of a state: the run, the iteration, and one value per cell.
type State<'a> = (&'a ReportedRun<'a>, u64, Vec<f64>);

/// Draws the maps and the histogram.
pub fn figures(study: &ReportedRuns) -> Result<Vec<Figure>, ReportError> {
    let mut states: Vec<State> = Vec::new();
    let most = if study.is_single() { STATES } else { 2 };
    for run in &study.runs {
        for k in run.states_along_wear(&[TableName::ContactField], most) {
            let field = run.field(k, TableName::ContactField, "pressure")?;
            states.extend(field.map(|field| (run, k, field)));
        }
    }
    if !states
        .iter()
        .any(|(_, _, field)| field.iter().any(|p| *p > 0.0))
    {
        return Ok(Vec::new());
    }
    let maps = maps(study, &states)?;
    let is_end = |run: &ReportedRun, k: u64| run.ends().contains(&k);
    states.retain(|(run, k, _)| is_end(run, *k));
    Ok(vec![maps, histogram(study, &states)?])
}

fn cap(run: &ReportedRun) -> Option<f64> {
    run.tables.recipe().contact()?.conditions.pressure_cap
}

/// Counts the cells at the pressure cap, within rounding errors.
fn at_cap(field: &[f64], cap: f64) -> usize {
    field.iter().filter(|p| **p >= cap * (1.0 - 1e-9)).count()
}

fn maps(study: &ReportedRuns, states: &[State]) -> Result<Figure, ReportError> {
    const ID: &str = "pressure";
    let (mut drawings, mut each) = (Vec::new(), Vec::new());
    // All maps have the same colours.
    let top = colour_top(states.iter().flat_map(|(_, _, field)| field)).unwrap_or(0.0);
    for (run, k, field) in states {
        let contact: Vec<f64> = field
            .iter()
            .map(|p| if *p == 0.0 { NO_DATA } else { *p })
            .collect();
        let title = heading(study, run, &format!("pressure, {}", run.state(*k)));
        let range = [LOADED * top, top];
        if let Some(mut map) = map(run, title, &contact, range, PRESSURE, "pressure")? {
            if let Scale::Continuous { log, .. } = &mut map.scale {
                *log = true;
            }
            drawings.push(map.draw());
        }
        let [_, most] = range_of(field).unwrap_or_default();
        let capped = cap(run).map_or(String::new(), |cap| {
            let cells = at_cap(field, cap);
            format!(
                ", {cells} cells at the cap of {}",
                with_best_unit(cap, PRESSURE)
            )
        });
        each.push(format!(
            "{} {}{capped}",
            with_run_name(study, run, &run.state(*k)),
            with_best_unit(most, PRESSURE)
        ));
    }
    let columns = vec!["i", "j", "pressure"];
    Ok(Figure {
        id: ID,
        title: "Contact pressure".to_owned(),
        drawings,
        states: Vec::new(),
        caption: format!(
            "Grey cells are not in contact. Pressures below a thousandth of the largest have one colour. Largest pressure: {}.",
            each.join("; ")
        ),
        query: study.query_last("contact_field", &columns),
        sources: vec![("contact_field", columns)],
    })
}

fn histogram(study: &ReportedRuns, states: &[State]) -> Result<Figure, ReportError> {
    const ID: &str = "pressure-histogram";
    let most = states.iter().map(|(_, _, field)| quantity::largest(field));
    let most = most.fold(0.0, f64::max);
    let unit = unit_of(PRESSURE, most);
    let edge = |class: usize| most * 10f64.powf(DECADES * (class as f64 / CLASSES as f64 - 1.0));
    let mut curves: [Vec<Curve>; 2] = [Vec::new(), Vec::new()];
    for (run, k, field) in states {
        let cells = field.iter().filter(|p| **p > 0.0).count().max(1);
        let mut counts = [0usize; CLASSES];
        for pressure in field.iter().filter(|p| **p >= edge(0)) {
            let class = CLASSES as f64 * ((pressure / most).log10() / DECADES + 1.0);
            counts[(class as usize).min(CLASSES - 1)] += 1;
        }
        let steps = counts.iter().enumerate().flat_map(|(class, count)| {
            let share = *count as f64 / cells as f64 / SHARE[0].size;
            [class, class + 1].map(|class| [edge(class) / unit.size, share])
        });
        let steps: Vec<[f64; 2]> = steps.collect();
        let worn = usize::from(run.cycles_at(*k) > 0.0);
        let curve = match study.is_single() {
            true => Curve::line(&run.state(*k), [UNWORN, WORN][worn], steps),
            false => Curve::line(&run.label, run.style, steps),
        };
        curves[if study.is_single() { 0 } else { worn }].push(curve);
    }
    let titles = match study.is_single() {
        true => ["Pressure of the cells in contact", ""],
        false => ["Cells in contact, unworn", "Cells in contact, worn"],
    };
    let all = curves.iter().flatten().flat_map(|curve| &curve.points);
    let top = all.fold(0.0f64, |most, point| most.max(point[1]));
    let mut drawings = Vec::new();
    for (title, curves) in titles.into_iter().zip(curves) {
        if curves.is_empty() {
            continue;
        }
        let chart = Chart {
            title: title.to_owned(),
            x: Axis {
                label: axis_label("pressure", unit.symbol),
                log: true,
                zero: None,
                range: Some([edge(0) / unit.size, 1.2 * most / unit.size]),
            },
            y: Axis {
                label: axis_label("share of contact", SHARE[0].symbol),
                range: Some([0.0, 1.1 * top]),
                ..Axis::default()
            },
            curves,
            ..Chart::default()
        };
        drawings.push(chart.draw());
    }
    let each: Vec<String> = states
        .iter()
        .map(|(run, k, field)| {
            let cells = field.iter().filter(|p| p.is_finite()).count().max(1);
            let contact = field.iter().filter(|p| **p > 0.0).count();
            format!(
                "{} {} of the cells",
                with_run_name(study, run, &run.state(*k)),
                with_best_unit(contact as f64 / cells as f64, SHARE)
            )
        })
        .collect();
    let columns = vec!["pressure"];
    Ok(Figure {
        id: ID,
        title: "Distribution of pressure".to_owned(),
        drawings,
        states: Vec::new(),
        caption: format!(
            "Distribution of the cells in contact over {CLASSES} logarithmic classes of pressure, up to {}. In contact: {}.",
            with_best_unit(most, PRESSURE),
            each.join("; ")
        ),
        query: study.query_last("contact_field", &columns),
        sources: vec![("contact_field", columns)],
    })
}
