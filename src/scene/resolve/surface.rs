//! `[surface]`

use super::{All, Result};
use crate::recipe::HeightsFile;
use crate::scene::Surface;
use crate::scene::keys::{lines, surface::*};
use crate::scene::reader::Reader;

/// What a surface might begin with.
pub(super) fn first_lines() -> String {
    lines(&[&KIND, &RQ, &CORRELATION_LENGTH])
}

/// The surface of a joint whose longer side has this length \[m\].
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
            let rolloff_wavelength = reader.look(&ROLLOFF_WAVELENGTH)?.unwrap_or(longer);
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
        "file" => Surface::File(HeightsFile {
            path: reader.needed(&PATH)?,
            unit: reader.optional(&UNIT, None)?,
            detrend: reader.value(&DETREND)?,
            fill: reader.value(&FILL)?,
            spacing: reader.optional(&SPACING, None)?,
        }),
        _ => Surface::Flat,
    })
}

/// What surfaces with a correlation length have.
fn correlated(reader: &Reader<'_>) -> Result<(f64, [f64; 2], u64)> {
    let rq = reader.required(&RQ);
    let correlation_length = reader.required(&CORRELATION_LENGTH);
    (rq, correlation_length, reader.value(&SEED)).all()
}
