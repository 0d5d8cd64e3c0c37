//! `[surface]`

use super::{All, Result};
use crate::recipe::{HeightsFile, SecondFace};
use crate::scene::Surface;
use crate::scene::keys::{lines, surface::*};
use crate::scene::reader::Reader;
use crate::surface::readers::Correction;

/// Example lines for the section.
pub(super) fn first_lines() -> String {
    lines(&[&KIND, &RQ, &CORRELATION_LENGTH])
}

/// Reads the surface of a joint. The argument `longer` is the length of the longer side of the joint \[m\].
pub(super) fn surface(reader: &Reader<'_>, longer: f64) -> Result<Surface> {
    if !reader.has("surface") {
        return Err(reader.missing_section(
            "surface",
            "the heights of the contact",
            &first_lines(),
        ));
    }
    let kind = reader.kind(&KIND)?;
    Ok(match reader.note(&KIND, kind) {
        "gaussian" => {
            let (rq, correlation_length, seed) = correlated(reader)?;
            Surface::Gaussian {
                rq,
                correlation_length,
                seed,
            }
        }
        "exponential" => {
            let (rq, correlation_length, seed) = correlated(reader)?;
            Surface::Exponential {
                rq,
                correlation_length,
                seed,
            }
        }
        "self_affine" => {
            let rolloff_wavelength = reader.peek(&ROLLOFF_WAVELENGTH)?.unwrap_or(longer);
            reader.note(&ROLLOFF_WAVELENGTH, rolloff_wavelength);
            let cutoff_wavelength = reader.optional(&CUTOFF_WAVELENGTH, None)?;
            if cutoff_wavelength.is_some_and(|cutoff| cutoff >= rolloff_wavelength) {
                return Err(reader.out_of_range(
                    &CUTOFF_WAVELENGTH,
                    format!(
                        "less than the rolloff_wavelength, {} mm",
                        rolloff_wavelength * 1e3
                    ),
                ));
            }
            let (rq, hurst) = (reader.required(&RQ), reader.required(&HURST_EXPONENT)).all()?;
            Surface::SelfAffine {
                rq,
                hurst,
                rolloff_wavelength,
                cutoff_wavelength,
                seed: reader.value(&SEED)?,
            }
        }
        "sphere" => Surface::Sphere {
            radius: reader.required(&RADIUS)?,
        },
        "file" => {
            let path = reader.required_unrecorded(&PATH)?;
            let correct = Correction {
                unit: reader.optional(&CORRECT_UNIT, None)?,
                spacing: reader.optional(&CORRECT_SPACING, None)?,
            };
            if correct.unit.is_some() && reader.has(&UNIT) {
                return Err(reader.conflict(&UNIT, ONE_UNIT));
            }
            if correct.spacing.is_some() && reader.has(&SPACING) {
                return Err(reader.conflict(&SPACING, ONE_SPACING));
            }
            Surface::File(HeightsFile {
                path,
                unit: reader.optional(&UNIT, None)?,
                detrend: reader.value(&DETREND)?,
                fill: reader.value(&FILL)?,
                spacing: reader.optional(&SPACING, None)?,
                transpose: reader.value(&TRANSPOSE)?,
                correct,
                second: second(reader)?,
            })
        }
        _ => Surface::Flat,
    })
}

const ONE_UNIT: &str =
    "surface.correct.unit sets the unit of the heights already; give one or the other";
const ONE_SPACING: &str =
    "surface.correct.spacing sets the spacing of the points already; give one or the other";

/// Reads the second of two faces.
fn second(reader: &Reader<'_>) -> Result<Option<SecondFace>> {
    if !reader.has("surface.second") {
        return Ok(None);
    }
    Ok(Some(SecondFace {
        path: reader.required_unrecorded(&SECOND_PATH)?,
        unit: reader.optional(&SECOND_UNIT, None)?,
        spacing: reader.optional(&SECOND_SPACING, None)?,
        transpose: reader.value(&SECOND_TRANSPOSE)?,
        mirror: reader.value(&SECOND_MIRROR)?,
        shift: reader.optional(&SECOND_SHIFT, None)?.unwrap_or_default(),
        content: None,
    }))
}

/// Reads the values that all surfaces with a correlation length have.
fn correlated(reader: &Reader<'_>) -> Result<(f64, [f64; 2], u64)> {
    let rq = reader.required(&RQ);
    let correlation_length = reader.required(&CORRELATION_LENGTH);
    (rq, correlation_length, reader.value(&SEED)).all()
}
