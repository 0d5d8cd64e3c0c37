//! `[surface]`

use super::Result;
use crate::scene::error::{Problem, SceneError};
use crate::scene::reader::{HURST, LARGEST_INTEGER, POSITIVE, Reader};
use crate::scene::{Detrend, Fill, Joint, Surface};
use crate::units::{self, Dimension};

/// Random surfaces start from this seed unless the scene says otherwise.
const SEED: u64 = 1;

const SURFACE_EXAMPLE: &str =
    "[surface]\nkind = \"gaussian\"\nrq = \"5 um\"\ncorrelation_length = [\"0.5 mm\", \"0.5 mm\"]";

pub(super) fn surface(reader: &Reader<'_>, joint: &Joint) -> Result<Surface> {
    if !reader.has("surface") {
        return Err(reader.missing_section(
            "surface",
            "the heights of the contact",
            SURFACE_EXAMPLE,
        ));
    }
    let kind = reader.kind("surface", "kind = \"gaussian\"")?;
    let length = |key, example| reader.quantity(key, Dimension::LENGTH, POSITIVE, example);
    let rq = || {
        length("surface.rq", "\"5 um\"")?
            .ok_or_else(|| reader.missing("surface.rq", "rq = \"5 um\""))
    };
    let seed = || {
        Ok(reader
            .integer("surface.seed", 0, LARGEST_INTEGER)?
            .unwrap_or(SEED))
    };
    let correlation_length = || {
        reader
            .pair(
                "surface.correlation_length",
                Dimension::LENGTH,
                POSITIVE,
                Some(|both| [both, both]),
                "[\"0.5 mm\", \"0.5 mm\"]",
            )?
            .ok_or_else(|| {
                reader.missing(
                    "surface.correlation_length",
                    "correlation_length = [\"0.5 mm\", \"0.5 mm\"]",
                )
            })
    };
    Ok(match kind {
        "gaussian" => Surface::Gaussian {
            rq: rq()?,
            correlation_length: correlation_length()?,
            seed: seed()?,
        },
        "exponential" => Surface::Exponential {
            rq: rq()?,
            correlation_length: correlation_length()?,
            seed: seed()?,
        },
        "self_affine" => {
            let rolloff_wavelength = length("surface.rolloff_wavelength", "\"10 mm\"")?
                .unwrap_or(joint.size[0].max(joint.size[1]));
            let cutoff_wavelength = length("surface.cutoff_wavelength", "\"0.1 mm\"")?;
            if cutoff_wavelength.is_some_and(|cutoff| cutoff >= rolloff_wavelength) {
                return Err(reader.out_of_range(
                    "surface.cutoff_wavelength",
                    format!(
                        "less than the rolloff_wavelength, {} mm",
                        rolloff_wavelength * 1e3
                    ),
                ));
            }
            Surface::SelfAffine {
                rq: rq()?,
                hurst: reader
                    .quantity("surface.hurst", Dimension::NONE, HURST, "0.8")?
                    .ok_or_else(|| reader.missing("surface.hurst", "hurst = 0.8"))?,
                rolloff_wavelength,
                cutoff_wavelength,
                seed: seed()?,
            }
        }
        "sphere" => Surface::Sphere {
            radius: length("surface.radius", "\"25 mm\"")?
                .ok_or_else(|| reader.missing("surface.radius", "radius = \"25 mm\""))?,
        },
        "file" => surface_file(reader)?,
        _ => Surface::Flat,
    })
}

fn surface_file(reader: &Reader<'_>) -> Result<Surface> {
    let path = reader
        .path("surface.path", "\"heights.npy\"")?
        .ok_or_else(|| reader.missing("surface.path", "path = \"heights.npy\""))?;
    let unit = reader
        .text("surface.unit", "\"um\"")?
        .map(|text| {
            units::parse_unit(text, Dimension::LENGTH).map_err(|source| {
                let node = reader.node("surface.unit").unwrap_or(reader.root);
                SceneError::new(
                    &node.place,
                    Problem::Unit {
                        key: "surface.unit".to_owned(),
                        value: text.to_owned(),
                        source,
                    },
                )
            })
        })
        .transpose()?;
    Ok(Surface::File {
        path,
        unit,
        detrend: reader
            .choice(
                "surface.detrend",
                &[
                    ("none", Detrend::None),
                    ("mean", Detrend::Mean),
                    ("plane", Detrend::Plane),
                    ("quadratic", Detrend::Quadratic),
                ],
            )?
            .unwrap_or(Detrend::Plane),
        fill: reader
            .choice(
                "surface.fill",
                &[("mask", Fill::Mask), ("interpolate", Fill::Interpolate)],
            )?
            .unwrap_or(Fill::Interpolate),
        spacing: reader.pair(
            "surface.spacing",
            Dimension::LENGTH,
            POSITIVE,
            None,
            "[\"2 um\", \"2 um\"]",
        )?,
    })
}
