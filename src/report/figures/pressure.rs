//! Contact pressure: where it is, and how much of the joint carries how much.

use super::super::ReportError;
use super::super::plot::{Axis, Chart, Curve};
use super::super::quantity::{self, PRESSURE, SHARE, shown, unit_of};
use super::course::labelled;
use super::surface::{map, titled};
use super::{Figure, Of, Study, drawn, range_of};
use crate::tables::TableName;

/// Classes of the histogram.
const CLASSES: usize = 40;
/// Share of the cells in contact that the colours of the map tell apart; peaks beyond have the last colour.
const TOLD: f64 = 0.99;

/// Pressure of a state: the run, the state, one value a cell.
type State<'a> = (&'a Of<'a>, u64, Vec<f64>);

/// The maps and the histogram.
pub fn figures(study: &Study) -> Result<Vec<Figure>, ReportError> {
    let mut states: Vec<State> = Vec::new();
    for run in &study.runs {
        for k in run.ends() {
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
    Ok(vec![maps(study, &states)?, histogram(study, &states)?])
}

fn cap(run: &Of) -> Option<f64> {
    run.tables.scene().contact.as_ref()?.pressure_cap
}

/// Cells at the cap, to rounding.
fn at_cap(field: &[f64], cap: f64) -> usize {
    field.iter().filter(|p| **p >= cap * (1.0 - 1e-9)).count()
}

fn maps(study: &Study, states: &[State]) -> Result<Figure, ReportError> {
    const ID: &str = "pressure";
    let (mut drawings, mut each) = (Vec::new(), Vec::new());
    for (run, k, field) in states {
        // One scale for the states of a run: that of the unworn one, whose peaks are the highest.
        let own = states
            .iter()
            .filter(|(other, ..)| std::ptr::eq(*other, *run));
        let told = own.map(|(_, _, field)| quantile(field)).fold(0.0, f64::max);
        let top = cap(run).unwrap_or(told);
        let contact: Vec<f64> = field
            .iter()
            .map(|p| if *p > 0.0 { *p } else { f64::NAN })
            .collect();
        let title = titled(study, run, &format!("pressure, {}", run.state(*k)));
        if let Some(map) = map(run, title, &contact, [0.0, top], PRESSURE, "pressure")? {
            drawings.push(map.draw().map_err(drawn(ID))?);
        }
        let [_, most] = range_of(field).unwrap_or_default();
        let capped = cap(run).map_or(String::new(), |cap| {
            let cells = at_cap(field, cap);
            format!(", {cells} cells at the cap of {}", shown(cap, PRESSURE))
        });
        each.push(format!(
            "{} largest {}{capped}",
            titled(study, run, &run.state(*k)),
            shown(most, PRESSURE)
        ));
    }
    let columns = vec!["i", "j", "pressure"];
    Ok(Figure {
        id: ID,
        title: "Contact pressure".to_owned(),
        drawings,
        caption: format!(
            "Cells without pressure are left blank; the hundredth of the cells in contact with the highest pressure has the last \
             colour, without a cap. {}.",
            each.join("; ")
        ),
        query: study.query_last("contact_field", &columns),
        sources: vec![("contact_field", columns)],
    })
}

/// The pressure that [`TOLD`] of the cells in contact do not exceed.
fn quantile(field: &[f64]) -> f64 {
    let mut contact: Vec<f64> = field.iter().copied().filter(|p| *p > 0.0).collect();
    contact.sort_by(f64::total_cmp);
    let at = (TOLD * contact.len() as f64) as usize;
    contact
        .get(at.min(contact.len().saturating_sub(1)))
        .copied()
        .unwrap_or(0.0)
}

fn histogram(study: &Study, states: &[State]) -> Result<Figure, ReportError> {
    const ID: &str = "pressure-histogram";
    let most = states.iter().map(|(_, _, field)| quantity::largest(field));
    let most = most.fold(0.0, f64::max);
    let unit = unit_of(PRESSURE, most);
    let width = most / CLASSES as f64;
    let mut curves: [Vec<Curve>; 2] = [Vec::new(), Vec::new()];
    for (run, k, field) in states {
        let cells = field.iter().filter(|p| p.is_finite()).count().max(1);
        let mut counts = [0usize; CLASSES];
        for pressure in field.iter().filter(|p| **p > 0.0) {
            counts[((pressure / width) as usize).min(CLASSES - 1)] += 1;
        }
        let steps = counts.iter().enumerate().flat_map(|(class, count)| {
            let share = *count as f64 / cells as f64 / 0.01;
            [class, class + 1].map(|edge| [edge as f64 * width / unit.size, share])
        });
        // An empty class has no logarithm and breaks nothing: the line goes on at the next.
        let steps: Vec<[f64; 2]> = steps.collect();
        let worn = usize::from(run.cycles_at(*k) > 0.0);
        let curve = match study.is_single() {
            true => Curve::line(&run.state(*k), worn, steps),
            false => Curve::line(&run.label, run.style, steps),
        };
        curves[if study.is_single() { 0 } else { worn }].push(curve);
    }
    let titles = match study.is_single() {
        true => ["Pressure of the cells in contact", ""],
        false => ["Cells in contact, unworn", "Cells in contact, worn"],
    };
    let least = |curves: &[Vec<Curve>]| {
        let points = curves.iter().flatten().flat_map(|curve| &curve.points);
        let shares = points.map(|point| point[1]).filter(|share| *share > 0.0);
        shares.fold([f64::INFINITY, 0.0f64], |[low, high], s| {
            [low.min(s), high.max(s)]
        })
    };
    let [low, high] = least(&curves);
    let mut drawings = Vec::new();
    for (title, curves) in titles.into_iter().zip(curves) {
        if curves.is_empty() {
            continue;
        }
        let chart = Chart {
            title: title.to_owned(),
            x: Axis {
                label: labelled("pressure", unit.symbol),
                log: false,
                range: Some([0.0, 1.02 * most / unit.size]),
            },
            y: Axis {
                label: labelled("share of the cells", SHARE[0].symbol),
                log: true,
                range: Some([low / 1.5, high * 1.5]),
            },
            curves,
        };
        drawings.push(chart.draw().map_err(drawn(ID))?);
    }
    let each: Vec<String> = states
        .iter()
        .map(|(run, k, field)| {
            let cells = field.iter().filter(|p| p.is_finite()).count().max(1);
            let contact = field.iter().filter(|p| **p > 0.0).count();
            format!(
                "{} {} of the cells",
                titled(study, run, &run.state(*k)),
                shown(contact as f64 / cells as f64, SHARE)
            )
        })
        .collect();
    let columns = vec!["pressure"];
    Ok(Figure {
        id: ID,
        title: "Distribution of pressure".to_owned(),
        drawings,
        caption: format!(
            "Share of the joint's cells by pressure, in {CLASSES} equal classes up to {}. In contact: {}.",
            shown(most, PRESSURE),
            each.join("; ")
        ),
        query: study.query_last("contact_field", &columns),
        sources: vec![("contact_field", columns)],
    })
}
