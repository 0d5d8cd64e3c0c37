//! `[surface]`

use super::Result;
use crate::recipe::HeightsFile;
use crate::scene::keys::{lines, surface::*};
use crate::scene::reader::Reader;
use crate::scene::{Joint, Surface};

/// What a surface might begin with.
pub(super) fn first_lines() -> String {
    lines(&[&KIND, &RQ, &CORRELATION_LENGTH])
}

pub(super) fn surface(reader: &Reader<'_>, joint: &Joint) -> Result<Surface> {
    if !reader.has("surface") {
        return Err(reader.missing_section(
            "surface",
            "the heights of the contact",
            &first_lines(),
        ));
    }
    Ok(match reader.kind(&KIND)? {
        "gaussian" => Surface::Gaussian {
            rq: reader.required(&RQ)?,
            correlation_length: reader.required(&CORRELATION_LENGTH)?,
            seed: reader.value(&SEED)?,
        },
        "exponential" => Surface::Exponential {
            rq: reader.required(&RQ)?,
            correlation_length: reader.required(&CORRELATION_LENGTH)?,
            seed: reader.value(&SEED)?,
        },
        "self_affine" => {
            let longer = joint.size[0].max(joint.size[1]);
            let rolloff_wavelength = reader.get(&ROLLOFF_WAVELENGTH)?.unwrap_or(longer);
            let cutoff_wavelength = reader.get(&CUTOFF_WAVELENGTH)?;
            if cutoff_wavelength.is_some_and(|cutoff| cutoff >= rolloff_wavelength) {
                return Err(reader.out_of_range(
                    &CUTOFF_WAVELENGTH,
                    format!(
                        "less than the rolloff_wavelength, {} mm",
                        rolloff_wavelength * 1e3
                    ),
                ));
            }
            Surface::SelfAffine {
                rq: reader.required(&RQ)?,
                hurst: reader.required(&HURST_EXPONENT)?,
                rolloff_wavelength,
                cutoff_wavelength,
                seed: reader.value(&SEED)?,
            }
        }
        "sphere" => Surface::Sphere {
            radius: reader.required(&RADIUS)?,
        },
        "file" => Surface::File(HeightsFile {
            path: reader.required(&PATH)?,
            unit: reader.get(&UNIT)?,
            detrend: reader.value(&DETREND)?,
            fill: reader.value(&FILL)?,
            spacing: reader.get(&SPACING)?,
        }),
        _ => Surface::Flat,
    })
}
