//! The rough surface, what is worn of it, and a section through the deepest point.

use super::super::ReportError;
use super::super::plot::{Axis, Chart, Curve, Map, Scale};
use super::super::quantity::{self, LENGTH, PRESSURE, shown, unit_of};
use super::course::labelled;
use super::{Figure, Of, Study, drawn, range_of, widened};
use crate::tables::TableName;

/// Part of the joint's length that a section shows.
const WINDOW: f64 = 0.25;
/// One millimetre \[m\].
const MM: f64 = 1e-3;

/// The rough surface, unworn and worn.
pub fn figures(study: &Study) -> Result<Vec<Figure>, ReportError> {
    const ID: &str = "surface";
    let mut fields = Vec::new();
    for run in &study.runs {
        let Some(heights) = run.heights()? else {
            continue;
        };
        let worn = worn(run, &heights)?;
        fields.push((run, "unworn", heights));
        fields.extend(worn.map(|worn| (run, "worn", worn)));
    }
    let Some(range) = range_of(fields.iter().flat_map(|(_, _, heights)| heights)) else {
        return Ok(Vec::new());
    };
    let (mut drawings, mut each) = (Vec::new(), Vec::new());
    for (run, state, heights) in &fields {
        // Runs of different roughness each in their own colours, the states of one in the same.
        let own = fields
            .iter()
            .filter(|(other, ..)| std::ptr::eq(*other, *run));
        let own = range_of(own.flat_map(|(_, _, heights)| heights)).unwrap_or(range);
        let title = titled(study, run, &format!("Height, {state}"));
        drawings.extend(map(run, title, heights, own, LENGTH, "height")?.map(|map| map.draw()));
        let [low, high] = range_of(heights).unwrap_or(own);
        each.push(format!(
            "{} {} to {}",
            titled(study, run, state),
            shown(low, LENGTH),
            shown(high, LENGTH)
        ));
    }
    let drawings: Result<Vec<_>, _> = drawings.into_iter().collect();
    Ok(vec![Figure {
        id: ID,
        title: "The rough surface".to_owned(),
        drawings: drawings.map_err(drawn(ID))?,
        caption: format!(
            "Composite height of the joint's cells, positive towards the other body: {}.",
            each.join("; ")
        ),
        query: format!(
            "pl.read_parquet(\"{}/once/surface.parquet\")",
            study.folder()
        ),
        sources: vec![
            ("surface", vec!["i", "j", "height", "kept"]),
            ("wear_field", vec!["i", "j", "wear_depth"]),
        ],
    }])
}

/// Heights of the last state; `None` without wear.
fn worn(run: &Of, heights: &[f64]) -> Result<Option<Vec<f64>>, ReportError> {
    let depth = run.field(run.tables.latest(), TableName::WearField, "wear_depth")?;
    let below = |depth: Vec<f64>| heights.iter().zip(depth).map(|(h, d)| h - d).collect();
    Ok(depth.map(below))
}

/// With the name of the run in front where there are several.
pub fn titled(study: &Study, run: &Of, text: &str) -> String {
    if study.is_single() {
        super::course::capitalised(text)
    } else {
        format!("{}: {text}", run.label)
    }
}

/// The map of a field in the unit that suits its range; `None` where the run has no grid.
pub fn map(
    run: &Of,
    title: String,
    values: &[f64],
    range: [f64; 2],
    units: quantity::Units,
    name: &str,
) -> Result<Option<Map>, ReportError> {
    let Some((cells, size)) = run.grid() else {
        return Ok(None);
    };
    let range = widened(range);
    let unit = unit_of(units, quantity::largest(&range));
    Ok(Some(Map {
        title,
        cells,
        values: values.iter().map(|value| value / unit.size).collect(),
        size: size.map(|side| side / MM),
        scale: Scale::Continuous {
            range: range.map(|end| end / unit.size),
            label: labelled(name, unit.symbol),
        },
        curves: Vec::new(),
    }))
}

/// The worn depth, and the section through its deepest point.
pub fn wear_figures(study: &Study) -> Result<Vec<Figure>, ReportError> {
    let mut fields = Vec::new();
    for run in &study.runs {
        let depth = run.field(run.tables.latest(), TableName::WearField, "wear_depth")?;
        fields.extend(depth.map(|depth| (run, depth)));
    }
    let worn = fields
        .iter()
        .any(|(_, depth)| depth.iter().any(|d| *d > 0.0));
    if !worn {
        return Ok(Vec::new());
    }
    Ok(vec![wear_map(study, &fields)?, section(study, &fields)?])
}

/// The cell with the largest value.
fn deepest(depth: &[f64]) -> usize {
    let key = |k: &usize| if depth[*k].is_nan() { -1.0 } else { depth[*k] };
    (0..depth.len())
        .max_by(|a, b| key(a).total_cmp(&key(b)))
        .unwrap_or(0)
}

fn wear_map(study: &Study, fields: &[(&Of, Vec<f64>)]) -> Result<Figure, ReportError> {
    const ID: &str = "wear-map";
    let (mut drawings, mut each) = (Vec::new(), Vec::new());
    for (run, depth) in fields {
        let (Some((cells, size)), Some([_, most])) = (run.grid(), range_of(depth)) else {
            continue;
        };
        let cell = deepest(depth);
        let place = [cell / cells[1], cell % cells[1]];
        let at: [f64; 2] =
            std::array::from_fn(|d| (place[d] as f64 + 0.5) * size[d] / cells[d] as f64);
        let title = titled(study, run, "worn depth");
        let Some(mut map) = map(run, title, depth, [0.0, most], LENGTH, "worn depth")? else {
            continue;
        };
        let y = at[1] / MM;
        map.curves
            .push(Curve::line("", 0, vec![[0.0, y], [size[0] / MM, y]]));
        drawings.push(map.draw().map_err(drawn(ID))?);
        let count = depth.iter().filter(|d| d.is_finite()).count();
        let worn = depth.iter().filter(|d| **d > 0.0).count();
        each.push(format!(
            "{}{} at x {} and y {}, {} of the cells worn",
            name_of(study, run),
            shown(most, LENGTH),
            shown(at[0], LENGTH),
            shown(at[1], LENGTH),
            shown(worn as f64 / count.max(1) as f64, quantity::SHARE)
        ));
    }
    let columns = vec!["i", "j", "wear_depth"];
    Ok(Figure {
        id: ID,
        title: "Worn depth".to_owned(),
        drawings,
        caption: format!(
            "Depth worn away in all. Deepest point: {}. The line is the section of the next figure.",
            each.join("; ")
        ),
        query: study.query_last("wear_field", &columns),
        sources: vec![("wear_field", columns)],
    })
}

fn name_of(study: &Study, run: &Of) -> String {
    match study.is_single() {
        true => String::new(),
        false => format!("{} ", run.label),
    }
}

fn section(study: &Study, fields: &[(&Of, Vec<f64>)]) -> Result<Figure, ReportError> {
    const ID: &str = "section";
    let (mut drawings, mut each) = (Vec::new(), Vec::new());
    for (run, depth) in fields {
        let (Some((cells, size)), Some(heights)) = (run.grid(), run.heights()?) else {
            continue;
        };
        let cell = deepest(depth);
        let (column, row) = (cell / cells[1], cell % cells[1]);
        let half = ((cells[0] as f64 * WINDOW / 2.0).round() as usize).max(8);
        let begin = column
            .saturating_sub(half)
            .min(cells[0].saturating_sub(2 * half));
        let end = (begin + 2 * half + 1).min(cells[0]);
        let along = |values: &[f64], size_of: f64| -> Vec<[f64; 2]> {
            let point = |i: usize| {
                let x = (i as f64 + 0.5) * size[0] / cells[0] as f64;
                [x / MM, values[i * cells[1] + row] / size_of]
            };
            (begin..end).map(point).collect()
        };
        let x = Axis {
            label: "x / mm".to_owned(),
            ..Axis::default()
        };
        let after: Vec<f64> = heights.iter().zip(depth).map(|(h, d)| h - d).collect();
        let within = |values: &[f64]| -> Vec<f64> {
            along(values, 1.0)
                .into_iter()
                .map(|[_, value]| value)
                .collect()
        };
        let unit = unit_of(LENGTH, quantity::largest(&within(&heights)));
        let profile = Chart {
            title: titled(study, run, "profile"),
            x: x.clone(),
            y: Axis {
                label: labelled("height", unit.symbol),
                ..Axis::default()
            },
            curves: vec![
                Curve::line("unworn", 0, along(&heights, unit.size)),
                Curve::line(&run.state(run.tables.latest()), 1, along(&after, unit.size)),
            ],
        };
        drawings.push(profile.draw().map_err(drawn(ID))?);
        let mut pressures = Vec::new();
        for k in run.ends() {
            let field = run.field(k, TableName::ContactField, "pressure")?;
            pressures.extend(field.map(|field| (run.state(k), field)));
        }
        let all: Vec<f64> = pressures.iter().flat_map(|(_, p)| within(p)).collect();
        let unit = unit_of(PRESSURE, quantity::largest(&all));
        let curves = pressures.iter().enumerate();
        let pressure = Chart {
            title: titled(study, run, "pressure"),
            x,
            y: Axis {
                label: labelled("pressure", unit.symbol),
                ..Axis::default()
            },
            curves: curves
                .map(|(k, (state, p))| Curve::line(state, k, along(p, unit.size)))
                .collect(),
        };
        drawings.push(pressure.draw().map_err(drawn(ID))?);
        each.push(format!(
            "{}the height there falls from {} to {}",
            name_of(study, run),
            shown(heights[cell], LENGTH),
            shown(after[cell], LENGTH)
        ));
    }
    let columns = vec!["i", "j", "pressure"];
    Ok(Figure {
        id: ID,
        title: "Section through the deepest point".to_owned(),
        drawings,
        caption: format!(
            "Profile and pressure along x about the deepest point of wear: {}.",
            each.join("; ")
        ),
        query: study.query_last("contact_field", &columns),
        sources: vec![
            ("surface", vec!["height"]),
            ("wear_field", vec!["wear_depth"]),
            ("contact_field", columns),
        ],
    })
}
