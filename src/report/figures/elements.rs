//! The contact elements of the structure.

use polars::prelude::DataFrame;

use super::super::ReportError;
use super::super::plot::{Map, Scale};
use super::super::quantity::{self, FORCE, STIFFNESS, Units, in_unit, number, shown, unit_of};
use super::super::run_tables::{numbers, texts};
use super::course::labelled;
use super::surface::titled;
use super::{Figure, Of, Study, drawn, range_of, widened};
use crate::tables::TableName;

const STATES: [&str; 4] = ["stick", "partial", "slip", "open"];
/// One millimetre \[m\].
const MM: f64 = 1e-3;

/// Elements on the lattice that they lie on.
struct Lattice {
    cells: [usize; 2],
    size: [f64; 2],
    /// Where each element stands among the cells, x slowest.
    place: Vec<usize>,
}

/// The map of the elements at the last iteration of each run.
pub fn figures(study: &Study) -> Result<Vec<Figure>, ReportError> {
    const ID: &str = "contact-elements";
    let (mut drawings, mut each) = (Vec::new(), Vec::new());
    let mut frames = Vec::new();
    for run in &study.runs {
        let last = run.tables.latest();
        let frame = run.tables.at(last, TableName::ContactElement)?;
        frames.extend(frame.map(|frame| (run, frame)));
    }
    for (run, frame) in &frames {
        let Some(lattice) = lattice(run, frame) else {
            continue;
        };
        let states = texts(frame, "state").unwrap_or_default();
        let count = |state: &str| states.iter().filter(|s| *s == state).count();
        for map in maps(study, run, &frames, frame, &lattice, &states) {
            drawings.push(map.draw().map_err(drawn(ID))?);
        }
        let range = |column: &str, units: Units| {
            let [low, high] = range_of(&numbers(frame, column)?)?;
            Some(match low == high {
                true => shown(low, units),
                false => {
                    let unit = unit_of(units, high);
                    format!("{} to {}", number(low / unit.size), in_unit(high, unit))
                }
            })
        };
        let counts: Vec<String> = STATES
            .iter()
            .filter(|state| count(state) > 0)
            .map(|state| format!("{} {state}", count(state)))
            .collect();
        each.push(format!(
            "{}{}; normal load {}, kn {}",
            match study.is_single() {
                true => String::new(),
                false => format!("{}: ", run.label),
            },
            counts.join(", "),
            range("normal_load", FORCE).unwrap_or_default(),
            range("kn", STIFFNESS).unwrap_or_default(),
        ));
    }
    if drawings.is_empty() {
        return Ok(Vec::new());
    }
    let columns = vec!["x", "y", "normal_load", "kn", "state"];
    Ok(vec![Figure {
        id: ID,
        title: "Contact elements".to_owned(),
        drawings,
        caption: format!(
            "State is the worst of an element over the vibration cycle. At the last iteration: {}.",
            each.join(". ")
        ),
        query: study.query_last("contact_element", &columns),
        sources: vec![("contact_element", columns)],
    }])
}

/// `None` for a single element, which makes no map.
fn lattice(run: &Of, frame: &DataFrame) -> Option<Lattice> {
    let (cells, size) = run.tables.recipe().structure.as_ref()?.lattice()?;
    let (x, y) = (numbers(frame, "x")?, numbers(frame, "y")?);
    let cell = |value: f64, d: usize| {
        let part = value / size[d] + 0.5;
        ((part * cells[d] as f64) as usize).min(cells[d] - 1)
    };
    let place = x.iter().zip(&y);
    let place = place
        .map(|(x, y)| cell(*x, 0) * cells[1] + cell(*y, 1))
        .collect();
    (x.len() > 1).then_some(Lattice { cells, size, place })
}

fn maps(
    study: &Study,
    run: &Of,
    all: &[(&Of, DataFrame)],
    frame: &DataFrame,
    lattice: &Lattice,
    states: &[String],
) -> Vec<Map> {
    let spread = |values: &[f64]| -> Vec<f64> {
        let mut cells = vec![f64::NAN; lattice.cells[0] * lattice.cells[1]];
        for (place, value) in lattice.place.iter().zip(values) {
            cells[*place] = *value;
        }
        cells
    };
    let map = |title: &str, values: &[f64], scale: Scale| Map {
        title: titled(study, run, title),
        cells: lattice.cells,
        values: spread(values),
        size: lattice.size.map(|side| side / MM),
        scale,
        nothing: "no value",
        curves: Vec::new(),
    };
    let mut maps = Vec::new();
    if !states.is_empty() {
        let class = |state: &String| STATES.iter().position(|known| known == state);
        let classes: Vec<f64> = states
            .iter()
            .map(|state| class(state).map_or(f64::NAN, |k| k as f64))
            .collect();
        let names = STATES.map(str::to_owned).to_vec();
        maps.push(map("state", &classes, Scale::Classes(names)));
    }
    for (column, name, units) in [
        ("normal_load", "normal load", FORCE),
        ("kn", "normal stiffness kn", STIFFNESS),
    ] {
        let values = numbers(frame, column).unwrap_or_default();
        let of_all = all.iter().filter_map(|(_, frame)| numbers(frame, column));
        let of_all: Vec<f64> = of_all.flatten().collect();
        let (Some(range), false) = (range_of(&of_all), values.is_empty()) else {
            continue;
        };
        // One value for all is a sentence, no map.
        if range[1] - range[0] <= 1e-9 * range[1].abs() {
            continue;
        }
        let range = widened(range);
        let unit = unit_of(units, quantity::largest(&range));
        let values: Vec<f64> = values.iter().map(|value| value / unit.size).collect();
        let scale = Scale::Continuous {
            range: range.map(|end| end / unit.size),
            log: false,
            label: labelled(name, unit.symbol),
        };
        maps.push(map(name, &values, scale));
    }
    maps
}
