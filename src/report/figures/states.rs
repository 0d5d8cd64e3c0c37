//! Figure of the joint at several states of a run, which the reader selects with a slider.

use super::super::ReportError;
use super::super::plot::{NO_DATA, Scale};
use super::super::quantity::{LENGTH, PRESSURE};
use super::pressure::LOADED;
use super::surface::{heading, map};
use super::{Figure, ReportedRuns, colour_top};
use crate::tables::TableName;

/// Maximum number of states.
const MAX_STATES: usize = 8;
/// Maximum number of cells along a side of a picture. The many pictures are small.
const FINEST: usize = 128;

/// Draws pressure and worn depth at some stored iterations, from the unworn joint to the last one.
///
/// Returns `None` for several runs and for a run without wear.
pub fn figure(study: &ReportedRuns) -> Result<Option<Figure>, ReportError> {
    let [run] = &study.runs[..] else {
        return Ok(None);
    };
    let iterations = run.tables.iterations();
    let count = iterations.len().min(MAX_STATES);
    let place = |k: usize| k * (iterations.len() - 1) / (count - 1).max(1);
    let mut states = Vec::new();
    for k in (0..count).map(|k| iterations[place(k)]) {
        let pressure = run.field(k, TableName::ContactField, "pressure")?;
        let depth = run.field(k, TableName::WearField, "wear_depth")?;
        states.extend(
            pressure
                .zip(depth)
                .map(|(pressure, depth)| (k, pressure, depth)),
        );
    }
    let ranges = (
        colour_top(states.iter().flat_map(|(_, pressure, _)| pressure)),
        colour_top(states.iter().flat_map(|(.., depth)| depth)),
    );
    let (Some(top), Some(deepest)) = ranges else {
        return Ok(None);
    };
    if states.len() < 3 {
        return Ok(None);
    }
    let (mut drawings, mut names) = (Vec::new(), Vec::new());
    for (k, pressure, depth) in &states {
        let contact = pressure
            .iter()
            .map(|p| if *p == 0.0 { NO_DATA } else { *p });
        let contact: Vec<f64> = contact.collect();
        let pressure_map = map(
            run,
            heading(study, run, "pressure"),
            &contact,
            [LOADED * top, top],
            PRESSURE,
            "pressure",
        )?;
        let depth_map = map(
            run,
            heading(study, run, "worn depth"),
            depth,
            [0.0, deepest],
            LENGTH,
            "worn depth",
        )?;
        let (Some(mut pressure_map), Some(depth_map)) = (pressure_map, depth_map) else {
            return Ok(None);
        };
        if let Scale::Continuous { log, .. } = &mut pressure_map.scale {
            *log = true;
        }
        for map in [pressure_map, depth_map] {
            drawings.push(map.draw_in(FINEST));
        }
        names.push(run.state(*k));
    }
    let columns = vec!["i", "j", "pressure"];
    Ok(Some(Figure {
        id: "states",
        title: "The joint over the cycles".to_owned(),
        drawings,
        states: names,
        caption: "Pressure and worn depth at stored iterations, all in the same colours. Grey cells are not in contact.".to_owned(),
        query: study.query_last("contact_field", &columns),
        sources: vec![("contact_field", columns), ("wear_field", vec!["i", "j", "wear_depth"])],
    }))
}
