//! Figure of the contact elements of the structure.

use std::collections::{HashMap, HashSet};

use polars::prelude::DataFrame;

use super::super::ReportError;
use super::super::plot::{Map, Scale};
use super::super::quantity::{
    self, FORCE, STIFFNESS, Units, four_digits, unit_of, with_best_unit, with_unit,
};
use super::super::run_tables::{numeric_column, text_column};
use super::course::axis_label;
use super::surface::heading;
use super::{Figure, ReportedRun, ReportedRuns, range_of, widened};
use crate::recipe::ContactArray;
use crate::tables::TableName;

const STATES: [&str; 4] = ["stick", "partial", "slip", "open"];
/// One millimetre \[m\].
const MM: f64 = 1e-3;

/// Contact elements as cells of the joint.
struct Lattice {
    cells: [usize; 2],
    size: [f64; 2],
    /// Element of each cell, x slowest. `None` in the hole.
    of_cell: Vec<Option<usize>>,
}

/// Draws maps of the contact elements at the last iteration of each run.
pub fn figures(study: &ReportedRuns) -> Result<Vec<Figure>, ReportError> {
    const ID: &str = "contact-elements";
    let (mut drawings, mut each) = (Vec::new(), Vec::new());
    let mut frames = Vec::new();
    for run in &study.runs {
        let last = run.tables.latest();
        let frame = run
            .tables
            .iteration_table(last, TableName::ContactElement)?;
        frames.extend(frame.map(|frame| (run, frame)));
    }
    for (run, frame) in &frames {
        let Some(lattice) = lattice(run, frame) else {
            continue;
        };
        let states = text_column(frame, "state").unwrap_or_default();
        let count = |state: &str| states.iter().filter(|s| *s == state).count();
        for map in maps(study, run, &frames, frame, &lattice, &states) {
            drawings.push(map.draw());
        }
        let range = |column: &str, units: Units| {
            let [low, high] = range_of(&numeric_column(frame, column)?)?;
            Some(match low == high {
                true => with_best_unit(low, units),
                false => {
                    let unit = unit_of(units, high);
                    format!(
                        "{} to {}",
                        four_digits(low / unit.size),
                        with_unit(high, unit)
                    )
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
        states: Vec::new(),
        caption: format!(
            "The map shows the worst state of each element over the vibration cycle, on its part of the joint. At the last iteration: {}.",
            each.join(". ")
        ),
        query: study.query_last("contact_element", &columns),
        sources: vec![("contact_element", columns)],
    }])
}

/// Returns the lattice of the elements, or `None` for a single element.
fn lattice(run: &ReportedRun, frame: &DataFrame) -> Option<Lattice> {
    let structure = run.tables.recipe().structure.as_ref()?;
    let array = structure.source.contact_array()?;
    let (x, y) = (numeric_column(frame, "x")?, numeric_column(frame, "y")?);
    let places: Vec<[f64; 2]> = x.into_iter().zip(y).map(|(x, y)| [x, y]).collect();
    let at_nodes = !structure.contact_ports.are_faces();
    (places.len() > 1).then(|| Lattice::new(&array, at_nodes, &places))
}

impl Lattice {
    /// Assigns cells of the joint to elements.
    ///
    /// An element at a node covers half a mesh cell on each side of the node. The element does not cover the hole or
    /// the region outside the joint.
    fn new(array: &ContactArray, at_nodes: bool, places: &[[f64; 2]]) -> Lattice {
        let size = array.size;
        let parts = if at_nodes { 2 } else { 1 };
        let place = |value: f64, d: usize| {
            let place = (value / size[d] + 0.5) * array.counts[d] as f64;
            // The position of a face element is the centre of the face, in the middle of a cell. A node is at the
            // corner of cells.
            let place = if at_nodes {
                place.round()
            } else {
                place.floor()
            };
            place as usize
        };
        let elements = places.iter().enumerate();
        let elements: HashMap<[usize; 2], usize> = elements
            .map(|(element, [x, y])| ([place(*x, 0), place(*y, 1)], element))
            .collect();
        let in_mesh: HashSet<[usize; 2]> = array.cells().into_iter().collect();
        let cells = array.counts.map(|count| count * parts);
        let all = (0..cells[0]).flat_map(|i| (0..cells[1]).map(move |j| [i, j]));
        let of_cell = all.map(|cell| {
            in_mesh.get(&cell.map(|k| k / parts))?;
            elements.get(&cell.map(|k| k.div_ceil(parts))).copied()
        });
        Lattice {
            cells,
            size,
            of_cell: of_cell.collect(),
        }
    }
}

fn maps(
    study: &ReportedRuns,
    run: &ReportedRun,
    all: &[(&ReportedRun, DataFrame)],
    frame: &DataFrame,
    lattice: &Lattice,
    states: &[String],
) -> Vec<Map> {
    let spread = |values: &[f64]| -> Vec<f64> {
        let value = |element: &Option<usize>| element.map_or(f64::NAN, |element| values[element]);
        lattice.of_cell.iter().map(value).collect()
    };
    let map = |title: &str, values: &[f64], scale: Scale| Map {
        title: heading(study, run, title),
        cells: lattice.cells,
        values: spread(values),
        size: lattice.size.map(|side| side / MM),
        scale,
        nothing: "no value",
        curves: Vec::new(),
    };
    let mut maps = Vec::new();
    if !states.is_empty() {
        let class = |state: &String| STATES.iter().position(|name| name == state);
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
        let values = numeric_column(frame, column).unwrap_or_default();
        let all_values = all
            .iter()
            .filter_map(|(_, frame)| numeric_column(frame, column));
        let all_values: Vec<f64> = all_values.flatten().collect();
        let (Some(range), false) = (range_of(&all_values), values.is_empty()) else {
            continue;
        };
        // The caption reports a value that is the same for all elements, so a map is not needed.
        if range[1] - range[0] <= 1e-9 * range[1].abs() {
            continue;
        }
        let range = widened(range);
        let unit = unit_of(units, quantity::largest(&range));
        let values: Vec<f64> = values.iter().map(|value| value / unit.size).collect();
        let scale = Scale::Continuous {
            range: range.map(|end| end / unit.size),
            log: false,
            label: axis_label(name, unit.symbol),
        };
        maps.push(map(name, &values, scale));
    }
    maps
}

#[cfg(test)]
mod tests {
    use super::Lattice;
    use crate::recipe::ContactArray;

    /// Counts the cells of each element.
    fn counts(lattice: &Lattice, elements: usize) -> Vec<usize> {
        let mut counts = vec![0; elements];
        for element in lattice.of_cell.iter().flatten() {
            counts[*element] += 1;
        }
        counts
    }

    /// The area of an element in the map equals its area in the structure. The rest is the hole.
    #[test]
    fn nodes_and_faces_have_their_own_parts_of_the_joint() {
        let array = ContactArray {
            size: [30e-3, 40e-3],
            counts: [9, 7],
            absent: vec![[0, 0], [4, 3], [5, 3]],
        };
        let (places, areas): (Vec<[f64; 2]>, Vec<f64>) = array.nodes().into_iter().unzip();
        let lattice = Lattice::new(&array, true, &places);
        let cell = 30e-3 * 40e-3 / 18.0 / 14.0;
        for (count, area) in counts(&lattice, places.len()).into_iter().zip(areas) {
            assert!((count as f64 * cell / area - 1.0).abs() < 1e-9, "{count}");
        }
        let faces: Vec<[f64; 2]> = array.faces().into_iter().map(|face| face.0).collect();
        let lattice = Lattice::new(&array, false, &faces);
        assert!(
            counts(&lattice, faces.len())
                .iter()
                .all(|count| *count == 1)
        );
        let hole = lattice.of_cell.iter().filter(|cell| cell.is_none());
        assert_eq!(hole.count(), 3);
    }
}
