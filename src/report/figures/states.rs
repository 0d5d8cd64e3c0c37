//! The joint at several states of a run: what a slider chooses.

use super::super::ReportError;
use super::super::plot::{NOTHING, Scale};
use super::super::quantity::{LENGTH, PRESSURE};
use super::pressure::LOADED;
use super::surface::{map, titled};
use super::{Figure, Study, top_of};
use crate::tables::TableName;

/// Most states of a run.
const MOST: usize = 8;
/// Cells along a side of a picture: so many are small ones.
const FINEST: usize = 128;

/// Pressure and worn depth at some kept iterations, from the unworn joint to the last; none of several runs, and where nothing wears.
pub fn figure(study: &Study) -> Result<Option<Figure>, ReportError> {
    let [run] = &study.runs[..] else {
        return Ok(None);
    };
    let kept = run.tables.iterations();
    let count = kept.len().min(MOST);
    let place = |k: usize| k * (kept.len() - 1) / (count - 1).max(1);
    let mut states = Vec::new();
    for k in (0..count).map(|k| kept[place(k)]) {
        let pressure = run.field(k, TableName::ContactField, "pressure")?;
        let depth = run.field(k, TableName::WearField, "wear_depth")?;
        states.extend(
            pressure
                .zip(depth)
                .map(|(pressure, depth)| (k, pressure, depth)),
        );
    }
    let ranges = (
        top_of(states.iter().flat_map(|(_, pressure, _)| pressure)),
        top_of(states.iter().flat_map(|(.., depth)| depth)),
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
            .map(|p| if *p == 0.0 { NOTHING } else { *p });
        let contact: Vec<f64> = contact.collect();
        let of_pressure = map(
            run,
            titled(study, run, "pressure"),
            &contact,
            [LOADED * top, top],
            PRESSURE,
            "pressure",
        )?;
        let of_depth = map(
            run,
            titled(study, run, "worn depth"),
            depth,
            [0.0, deepest],
            LENGTH,
            "worn depth",
        )?;
        let (Some(mut of_pressure), Some(of_depth)) = (of_pressure, of_depth) else {
            return Ok(None);
        };
        if let Scale::Continuous { log, .. } = &mut of_pressure.scale {
            *log = true;
        }
        for map in [of_pressure, of_depth] {
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
        caption: "Pressure and worn depth at kept iterations, in the same colours at all of them. Grey cells are not in contact.".to_owned(),
        query: study.query_last("contact_field", &columns),
        sources: vec![("contact_field", columns), ("wear_field", vec!["i", "j", "wear_depth"])],
    }))
}
