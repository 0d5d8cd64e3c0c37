//! Plausibility checks of a computed state. The checks compare the natural frequencies with the frequency of the drive.
//! The checks compare pressure with Young's modulus, slip with the cell size, and worn depth with the roughness.

use super::RunError;
use crate::recipe::{Check, Contact, Recipe};
use crate::store::RunReader;
use crate::tables::{TableName, typed};

/// Largest ratio of the half range of slip to the cell size. Above this ratio, the fixed heights of the cells are
/// questionable.
const LARGEST_SLIP: f64 = 1.0;
/// The slip path per cycle is `HALF_RANGES` times the half range of the slip.
const HALF_RANGES: f64 = 4.0;

/// Returns the checks of the last state of a run. The function also checks the pressure in the unworn state, because
/// the pressure is highest in the unworn state.
///
/// # Errors
/// Errors of reading the run.
pub fn plausibility_checks(reader: &RunReader, recipe: &Recipe) -> Result<Vec<Check>, RunError> {
    let Some(last) = reader.latest() else {
        return Ok(Vec::new());
    };
    let mut checks = Vec::new();
    checks.extend(natural_frequencies(reader, recipe)?);
    let Some(contact) = recipe.contact() else {
        return Ok(checks);
    };
    let unworn: Option<typed::Summary> = reader.history()?.row(0)?;
    let summary: typed::Summary = reader.typed(last)?;
    if let (true, Some(unworn)) = (last > 0, &unworn) {
        checks.extend(peak(
            contact,
            "largest pressure, unworn",
            unworn.max_pressure,
        ));
    }
    checks.extend(peak(contact, "largest pressure", summary.max_pressure));
    checks.extend(slip(reader, recipe, last)?);
    if recipe.wear.is_some() && last > 0 {
        let rq = unworn.and_then(|summary| summary.rq);
        checks.extend(depth(reader, last, rq)?);
    }
    Ok(checks)
}

/// Compares the largest pressure \[Pa\] with Young's modulus.
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

/// Compares the deepest wear with the roughness of the unworn surface \[m\].
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

/// Returns the natural frequencies next to the frequency or the range of the drive, for a finite element structure.
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
    let nearest = [below].into_iter().chain(within).chain([above]);
    let nearest: Vec<String> = nearest
        .filter(|f| *f > 0.0 && f.is_finite())
        .map(|f| format!("{f:.1}"))
        .collect();
    Ok(Some(Check {
        what: "natural frequencies",
        value: format!(
            "{} Hz without the contact's springs, next to the drive of {drive} Hz",
            nearest.join(", ")
        ),
        warning: None,
        remark: None,
    }))
}

/// Compares the slip of the touching cells with the cell size. The function skips cells that do not touch, because a
/// cell without contact does not wear.
fn slip(reader: &RunReader, recipe: &Recipe, last: u64) -> Result<Option<Check>, RunError> {
    let fields: typed::ContactField = reader.typed(last)?;
    let (Some(paths), Some(surface)) = (fields.slip_path, recipe.surface()) else {
        return Ok(None);
    };
    let grid = surface.grid();
    let touching = paths.iter().zip(&fields.pressure);
    let touching = touching.filter(|(_, pressure)| **pressure > 0.0);
    let path = touching.map(|(path, _)| *path).fold(0.0, f64::max);
    let (half, cell) = (path / HALF_RANGES, grid.dx.min(grid.dy));
    let part = half / cell;
    if path == 0.0 {
        return Ok(Some(Check {
            what: "slip over a cell",
            value: "none".to_owned(),
            warning: None,
            remark: Some(
                "nothing slips: the whole joint sticks, so that friction dissipates nothing and nothing wears; for slip, increase the motion or the force, or reduce the load or the friction".to_owned(),
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
        remark: (part > LARGEST_SLIP).then(|| {
            format!(
                "the slip of {:.1} µm exceeds the cell of {:.1} µm. The model assumes small slip: cells do not move with it, and wear stays at the places that face each other at rest",
                half * 1e6,
                cell * 1e6
            )
        }),
    }))
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}
