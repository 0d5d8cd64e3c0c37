//! The unworn surface, once a run.

use super::context::{Timing, parts};
use super::{Observer, RunError, Stage};
use crate::grid::Patch;
use crate::recipe::{self, Heights, Inputs};
use crate::store::{Kept, RunStore, StageKey};
use crate::surface::generate::{self, RandomSurface, Spectrum};
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
    recipe: &recipe::Surface,
    store: &mut RunStore,
    observer: &dyn Observer,
) -> Result<Unworn, RunError> {
    let key = StageKey::new(
        Stage::Surface.name(),
        &[TableName::Surface],
        &parts(&inputs.recipe, &["surface"]),
        &[],
    );
    let grid = recipe.grid();
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
    let (patch, height, notices) = heights(inputs, recipe)?;
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

/// Cells, unworn heights, and what the user should know of them.
fn heights(
    inputs: &Inputs,
    recipe: &recipe::Surface,
) -> Result<(Patch, Vec<f64>, Vec<String>), RunError> {
    if let Some(measured) = &inputs.measured {
        let notices = measured.notices.iter().map(ToString::to_string).collect();
        return Ok((measured.patch.clone(), measured.heights.clone(), notices));
    }
    let patch = recipe.patch()?;
    let mut notices = Vec::new();
    let mut random = |spectrum, rq, seed| -> Result<Vec<f64>, RunError> {
        let generated = generate::random(&patch, &RandomSurface { rq, spectrum, seed })?;
        notices.extend(generated.warnings.iter().map(ToString::to_string));
        Ok(generated.heights)
    };
    let height = match &recipe.heights {
        Heights::Flat => generate::flat(&patch),
        Heights::Sphere { radius } => generate::sphere(&patch, *radius)?,
        Heights::Gaussian {
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
        Heights::Exponential {
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
        Heights::SelfAffine {
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
        Heights::File { .. } => unreachable!("the inputs hold what a file gives"),
    };
    Ok((patch, height, notices))
}
