//! The unworn surface, once a run.

use super::context::Timing;
use super::{Inputs, Observer, RunError, Stage};
use crate::grid::Patch;
use crate::scene::{self, RoughJoint};
use crate::store::{Kept, RunStore, StageKey};
use crate::surface::generate::{self, RandomSurface, Spectrum};
use crate::surface::prepare::{self, PrepareOptions, Prepared};
use crate::surface::readers::{self, ReadOptions};
use crate::tables::{TableName, TypedTable, typed};

/// The joint's cells and their unworn heights.
pub struct Unworn {
    pub patch: Patch,
    pub height: Vec<f64>,
    pub key: StageKey,
    /// What computing it cost; none where it was there already.
    pub timing: Option<Timing>,
}

/// Computes the surface, or takes the one that an earlier start computed from the same inputs.
pub fn surface(
    inputs: &Inputs,
    rough: &RoughJoint,
    store: &mut RunStore,
    observer: &dyn Observer,
) -> Result<Unworn, RunError> {
    let key = StageKey::new(
        Stage::Surface.name(),
        &[TableName::Surface],
        &inputs.sections(&["joint", "surface"]),
        &[],
    );
    let grid = rough.grid;
    if let Kept::Valid(table) = store.once(TableName::Surface, &key)? {
        let typed::Surface { height, kept, .. } = typed::Surface::of(&table)?;
        return Ok(Unworn {
            patch: Patch { grid, kept },
            height,
            key,
            timing: None,
        });
    }
    observer.stage(Stage::Surface, 0);
    let begin = std::time::Instant::now();
    let (patch, height, notices) = heights(inputs, rough)?;
    for notice in notices {
        observer.notice(&format!("[surface]: {notice}"));
    }
    let cells = (0..grid.len()).map(|c| grid.cell(c));
    let (i, j) = cells.map(|(i, j)| (i as i32, j as i32)).unzip();
    let table = typed::Surface {
        i,
        j,
        height: height.clone(),
        kept: patch.kept.clone(),
    };
    store.put_once(TableName::Surface, &key, &table.to_table()?)?;
    let timing = Timing {
        stage: Stage::Surface,
        part: None,
        seconds: begin.elapsed().as_secs_f64(),
        fft_pairs: 0.0,
    };
    Ok(Unworn {
        patch,
        height,
        key,
        timing: Some(timing),
    })
}

/// The heights of a surface's file on the joint's cells, from the bytes of the file; none of another surface. Only they are
/// kept: the map may be many times larger than the joint's grid.
///
/// # Errors
/// [`RunError`] for bytes that are no map of heights, and a map that does not fit the joint.
pub fn measured(rough: &RoughJoint, bytes: Vec<u8>) -> Result<Option<Prepared>, RunError> {
    let scene::Surface::File {
        path,
        unit,
        detrend,
        fill,
        spacing,
    } = rough.surface
    else {
        return Ok(None);
    };
    let options = ReadOptions {
        height_unit: *unit,
        lateral_unit: None,
        spacing: *spacing,
    };
    let topography = readers::parse(path, &bytes, &options)?;
    drop(bytes);
    let options = PrepareOptions {
        detrend: *detrend,
        fill: *fill,
    };
    prepare::onto_joint(&topography, &rough.patch(), options)
        .map(Some)
        .map_err(|source| RunError::Prepare {
            path: path.clone(),
            source,
        })
}

/// Cells, unworn heights, and what the user should know of them.
fn heights(
    inputs: &Inputs,
    rough: &RoughJoint,
) -> Result<(Patch, Vec<f64>, Vec<String>), RunError> {
    if let Some(measured) = &inputs.measured {
        let notices = measured.notices.iter().map(ToString::to_string).collect();
        return Ok((measured.patch.clone(), measured.heights.clone(), notices));
    }
    let patch = rough.patch();
    let mut notices = Vec::new();
    let mut random = |spectrum, rq, seed| -> Result<Vec<f64>, RunError> {
        let generated = generate::random(&patch, &RandomSurface { rq, spectrum, seed })?;
        notices.extend(generated.warnings.iter().map(ToString::to_string));
        Ok(generated.heights)
    };
    let height = match rough.surface {
        scene::Surface::Flat => generate::flat(&patch),
        scene::Surface::Sphere { radius } => generate::sphere(&patch, *radius)?,
        scene::Surface::Gaussian {
            rq,
            correlation_length,
            seed,
        } => random(
            Spectrum::Gaussian {
                correlation_length: *correlation_length,
            },
            *rq,
            *seed,
        )?,
        scene::Surface::Exponential {
            rq,
            correlation_length,
            seed,
        } => random(
            Spectrum::Exponential {
                correlation_length: *correlation_length,
            },
            *rq,
            *seed,
        )?,
        scene::Surface::SelfAffine {
            rq,
            hurst,
            rolloff_wavelength,
            cutoff_wavelength,
            seed,
        } => {
            let spectrum = Spectrum::SelfAffine {
                hurst: *hurst,
                rolloff_wavelength: *rolloff_wavelength,
                cutoff_wavelength: cutoff_wavelength.unwrap_or(0.0),
            };
            random(spectrum, *rq, *seed)?
        }
        scene::Surface::File { .. } => unreachable!("the inputs hold what a file gives"),
    };
    Ok((patch, height, notices))
}
