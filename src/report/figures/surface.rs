//! Figures of the rough surface and of the worn depth.

use super::super::ReportError;
use super::super::plot::{Curve, Map, Scale, WORN};
use super::super::quantity::{self, LENGTH, unit_of, with_best_unit, with_unit};
use super::course::axis_label;
use super::{
    Figure, ReportedRun, ReportedRuns, colour_range, colour_top, range_of, section, widened,
};
use crate::tables::TableName;

/// One millimetre \[m\].
const MM: f64 = 1e-3;

/// Draws the rough surface, unworn and worn.
pub fn figures(study: &ReportedRuns) -> Result<Vec<Figure>, ReportError> {
    const ID: &str = "surface";
    let mut fields = Vec::new();
    for run in &study.runs {
        let Some(heights) = run.heights()? else {
            continue;
        };
        let worn = worn_heights_of(run, &heights)?;
        fields.push((run, "unworn", heights));
        fields.extend(worn.map(|worn| (run, "worn", worn)));
    }
    let Some(range) = colour_range(fields.iter().flat_map(|(_, _, heights)| heights)) else {
        return Ok(Vec::new());
    };
    let (mut drawings, mut each) = (Vec::new(), Vec::new());
    for (run, state, heights) in &fields {
        let title = heading(study, run, &format!("height, {state}"));
        // All maps have the same colours.
        let map = map(run, title, heights, range, LENGTH, "height")?;
        drawings.extend(map.map(|map| map.draw()));
        let [low, high] = range_of(heights).unwrap_or(range);
        each.push(format!(
            "{} {} to {}",
            with_run_name(study, run, state),
            with_best_unit(low, LENGTH),
            with_best_unit(high, LENGTH)
        ));
    }
    Ok(vec![Figure {
        id: ID,
        title: "The rough surface".to_owned(),
        drawings,
        states: Vec::new(),
        caption: format!(
            "Composite height of the joint's cells, positive towards the other body: {}.",
            each.join("; ")
        ),
        query: study.query_once("surface"),
        sources: vec![
            ("surface", vec!["i", "j", "height", "kept"]),
            ("wear_field", vec!["i", "j", "wear_depth"]),
        ],
    }])
}

/// Returns the heights of the last state, or `None` without wear.
fn worn_heights_of(run: &ReportedRun, heights: &[f64]) -> Result<Option<Vec<f64>>, ReportError> {
    let depth = run.field(run.tables.latest(), TableName::WearField, "wear_depth")?;
    let worn_heights = |depth: Vec<f64>| heights.iter().zip(depth).map(|(h, d)| h - d).collect();
    Ok(depth.map(worn_heights))
}

/// Returns a heading, which begins with the name of the run if there are several runs.
pub fn heading(study: &ReportedRuns, run: &ReportedRun, text: &str) -> String {
    match study.is_single() {
        true => super::course::capitalised(text),
        false => with_run_name(study, run, text),
    }
}

/// Returns a part of a sentence, which begins with the name of the run if there are several runs.
pub fn with_run_name(study: &ReportedRuns, run: &ReportedRun, text: &str) -> String {
    match study.is_single() {
        true => text.to_owned(),
        false => format!("{}: {text}", run.label),
    }
}

/// Returns the map of a field in the unit that suits its range. Returns `None` if the run has no grid.
pub fn map(
    run: &ReportedRun,
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
            log: false,
            label: axis_label(name, unit.symbol),
        },
        nothing: "no contact",
        curves: Vec::new(),
    }))
}

/// Draws the worn depth, and the section through its deepest point.
pub fn wear_figures(study: &ReportedRuns) -> Result<Vec<Figure>, ReportError> {
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
    let Some(line) = section_point(&fields) else {
        return Ok(Vec::new());
    };
    Ok(vec![
        wear_map(study, &fields, line)?,
        section::figure(study, &fields, line)?,
    ])
}

/// Returns the deepest point of all runs \[m\]. The sections of all runs pass through it, so that they are comparable.
fn section_point(fields: &[(&ReportedRun, Vec<f64>)]) -> Option<[f64; 2]> {
    let by_depth = |a: &&(&ReportedRun, Vec<f64>), b: &&(&ReportedRun, Vec<f64>)| {
        quantity::largest(&a.1).total_cmp(&quantity::largest(&b.1))
    };
    let (run, depth) = fields.iter().max_by(by_depth)?;
    let (cells, size) = run.grid()?;
    Some(cell_centre(deepest(depth), cells, size))
}

/// Returns the centre of a cell \[m\].
fn cell_centre(cell: usize, cells: [usize; 2], size: [f64; 2]) -> [f64; 2] {
    let place = [cell / cells[1], cell % cells[1]];
    std::array::from_fn(|d| (place[d] as f64 + 0.5) * size[d] / cells[d] as f64)
}

/// Returns the cell with the largest value.
fn deepest(depth: &[f64]) -> usize {
    let key = |k: &usize| if depth[*k].is_nan() { -1.0 } else { depth[*k] };
    (0..depth.len())
        .max_by(|a, b| key(a).total_cmp(&key(b)))
        .unwrap_or(0)
}

fn wear_map(
    study: &ReportedRuns,
    fields: &[(&ReportedRun, Vec<f64>)],
    line: [f64; 2],
) -> Result<Figure, ReportError> {
    const ID: &str = "wear-map";
    let (mut drawings, mut each) = (Vec::new(), Vec::new());
    let all = fields.iter().flat_map(|(_, depth)| depth);
    let top = colour_top(all).unwrap_or(0.0);
    let unit = unit_of(LENGTH, top);
    for (run, depth) in fields {
        let (Some((cells, size)), Some([_, most])) = (run.grid(), range_of(depth)) else {
            continue;
        };
        let at = cell_centre(deepest(depth), cells, size);
        let title = heading(study, run, "worn depth");
        let Some(mut map) = map(run, title, depth, [0.0, top], LENGTH, "worn depth")? else {
            continue;
        };
        let y = line[1] / MM;
        map.curves
            .push(Curve::line("", WORN, vec![[0.0, y], [size[0] / MM, y]]));
        drawings.push(map.draw());
        let count = depth.iter().filter(|d| d.is_finite()).count();
        let worn = depth.iter().filter(|d| **d > 0.0).count();
        each.push(format!(
            "{}{} at x {} and y {}, {} of the cells worn",
            name_of(study, run),
            with_unit(most, unit),
            with_best_unit(at[0], LENGTH),
            with_best_unit(at[1], LENGTH),
            with_best_unit(worn as f64 / count.max(1) as f64, quantity::SHARE)
        ));
    }
    let columns = vec!["i", "j", "wear_depth"];
    Ok(Figure {
        id: ID,
        title: "Worn depth".to_owned(),
        drawings,
        states: Vec::new(),
        caption: format!(
            "Total worn depth. Deepest point: {}. The dashed line marks the section.",
            each.join("; ")
        ),
        query: study.query_last("wear_field", &columns),
        sources: vec![("wear_field", columns)],
    })
}

pub fn name_of(study: &ReportedRuns, run: &ReportedRun) -> String {
    match study.is_single() {
        true => String::new(),
        false => format!("{} ", run.label),
    }
}
