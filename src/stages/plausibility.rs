//! What an engineer would look at once a state is computed: natural frequencies beside the drive, largest pressure, slip and worn depth
//! against what they are compared with.

use super::RunError;
use crate::recipe::{Check, Contact, Recipe};
use crate::store::RunReader;
use crate::tables::{TableName, typed};

/// Half range of slip over a cell from which on heights would have moved on to others.
const CELL: f64 = 1.0;
/// Parts of the slip path of a cycle in a half range of it.
const HALF_RANGES: f64 = 4.0;

/// The figures of the last state of a run, and of the unworn one where pressures were highest.
///
/// # Errors
/// Those of reading the run.
pub fn plausibility_checks(reader: &RunReader, recipe: &Recipe) -> Result<Vec<Check>, RunError> {
    let Some(last) = reader.latest() else {
        return Ok(Vec::new());
    };
    let mut found = Vec::new();
    found.extend(natural_frequencies(reader, recipe)?);
    let Some(contact) = recipe.contact() else {
        return Ok(found);
    };
    let unworn: Option<typed::Summary> = reader.history()?.row(0)?;
    let summary: typed::Summary = reader.typed(last)?;
    if let (true, Some(unworn)) = (last > 0, &unworn) {
        found.extend(peak(
            contact,
            "largest pressure, unworn",
            unworn.max_pressure,
        ));
    }
    found.extend(peak(contact, "largest pressure", summary.max_pressure));
    found.extend(slip(reader, recipe, last)?);
    if recipe.wear.is_some() && last > 0 {
        let rq = unworn.and_then(|summary| summary.rq);
        found.extend(depth(reader, last, rq)?);
    }
    Ok(found)
}

/// The largest pressure \[Pa\] against what solids bear.
fn peak(contact: &Contact, what: &'static str, pressure: Option<f64>) -> Option<Check> {
    let pressure = pressure?;
    Some(Check {
        what,
        value: format!(
            "{:.2} GPa, {:.4} of Young's modulus",
            pressure * 1e-9,
            pressure / contact.least_modulus()
        ),
        warning: None,
        remark: contact.peak_pressure_note(pressure),
    })
}

/// The deepest wear against the roughness that was there \[m\].
fn depth(reader: &RunReader, last: u64, rq: Option<f64>) -> Result<Option<Check>, RunError> {
    let worn: typed::WearField = reader.typed(last)?;
    let depth = largest(&worn.wear_depth);
    Ok(rq.filter(|rq| *rq > 0.0).map(|rq| Check {
        what: "deepest wear over Rq",
        value: format!(
            "{:.3} ({:.3} µm over the {:.3} µm of the unworn face)",
            depth / rq,
            depth * 1e6,
            rq * 1e6
        ),
        warning: None,
        remark: None,
    }))
}

/// The natural frequencies beside the frequency or the range of the drive, of a structure in finite elements.
fn natural_frequencies(reader: &RunReader, recipe: &Recipe) -> Result<Option<Check>, RunError> {
    let (Some(table), Some(response)) = (
        reader.read_once(TableName::StructureMode)?,
        &recipe.response,
    ) else {
        return Ok(None);
    };
    let Ok(frequencies) = table.f64("frequency") else {
        return Ok(None);
    };
    let Some([low, high]) = response.frequencies_in_force() else {
        return Ok(None);
    };
    let drive = match low == high {
        true => low.to_string(),
        false => format!("{low} to {high}"),
    };
    let elastic = || frequencies.iter().copied().filter(|f| *f > 0.0);
    let below = elastic().filter(|f| *f < low).fold(0.0, f64::max);
    let above = elastic()
        .filter(|f| *f > high)
        .fold(f64::INFINITY, f64::min);
    let mut within: Vec<f64> = elastic().filter(|f| (low..=high).contains(f)).collect();
    within.sort_by(f64::total_cmp);
    within.dedup();
    let each = [below].into_iter().chain(within).chain([above]);
    let each: Vec<String> = each
        .filter(|f| *f > 0.0 && f.is_finite())
        .map(|f| format!("{f:.1}"))
        .collect();
    Ok(Some(Check {
        what: "natural frequencies",
        value: format!(
            "{} Hz without the contact's springs, next to the drive of {drive} Hz",
            each.join(", ")
        ),
        warning: None,
        remark: None,
    }))
}

/// How far cells slip, against their side. Those that do not touch move too, and wear nothing.
fn slip(reader: &RunReader, recipe: &Recipe, last: u64) -> Result<Option<Check>, RunError> {
    let fields: typed::ContactField = reader.typed(last)?;
    let (Some(paths), Some(surface)) = (fields.slip_path, recipe.surface()) else {
        return Ok(None);
    };
    let grid = surface.grid();
    let of_touching = paths.iter().zip(&fields.pressure);
    let of_touching = of_touching.filter(|(_, pressure)| **pressure > 0.0);
    let path = of_touching.map(|(path, _)| *path).fold(0.0, f64::max);
    let (half, cell) = (path / HALF_RANGES, grid.dx.min(grid.dy));
    let part = half / cell;
    if path == 0.0 {
        return Ok(Some(Check {
            what: "slip over a cell",
            value: "none".to_owned(),
            warning: None,
            remark: Some(
                "nothing slips: all of the joint sticks, so that friction dissipates nothing and nothing wears; more slips under a larger motion or force, or less load or friction".to_owned(),
            ),
        }));
    }
    Ok(Some(Check {
        what: "slip over a cell",
        value: format!(
            "{part:.3} at most of cells that touch (half range of {:.3} µm over {:.3} µm)",
            half * 1e6,
            cell * 1e6
        ),
        warning: None,
        remark: (part > CELL).then(|| {
            format!(
                "the slip of {:.1} µm is more than the cell of {:.1} µm: slip is taken to be small, cells do not travel with it, and all wear is of the places that face each other at rest",
                half * 1e6,
                cell * 1e6
            )
        }),
    }))
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}
