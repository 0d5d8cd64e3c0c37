//! From a measured height map to heights on the joint's grid.
//!
//! In this order: the map is laid on the joint, centred (its own spacing decides how much of it the joint needs, nothing is
//! stretched silently); the trend is fitted to the measured points that belong to the joint, and subtracted; points that were
//! not measured are masked or filled; the map is resampled to the joint's cells, unless it has their shape already.

mod detrend;
mod fill;
mod resample;

use serde::{Deserialize, Serialize};

use super::topography::Topography;
use crate::grid::{Grid, Patch};

/// A map and a joint whose sizes differ by less than this share are taken as one and the same.
pub const SIZE_TOLERANCE: f64 = 0.01;

/// Below this a difference in size is rounding (SUR keeps its spacing in single precision).
const ROUNDING: f64 = 1e-5;

/// A cell belongs to the joint if at least this share of it was measured.
const MEASURED_SHARE: f64 = 0.5;

/// What is subtracted from the map: a polynomial in x and y fitted by least squares to the measured points of the joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Detrend {
    /// Nothing: the heights are kept as they are, with their mean.
    None,
    /// The mean.
    Mean,
    /// The mean plane.
    Plane,
    /// Plane and curvature (six terms).
    Quadratic,
}

/// What becomes of points that were not measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fill {
    /// Cells less than half measured leave the joint: they carry no load.
    Mask,
    /// The smoothest surface through the rim of the hole: the Laplace equation with the measured neighbours as boundary values,
    /// solved about the mean plane (exact for a plane). It has neither roughness nor a peak of its own.
    Interpolate,
}

/// The choices of the user.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct PrepareOptions {
    /// Trend to subtract.
    pub detrend: Detrend,
    /// What becomes of holes.
    pub fill: Fill,
}

/// A topography on the joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Prepared {
    /// The joint: as given, without the cells that were not measured if holes are masked.
    pub patch: Patch,
    /// Heights \[m\], one a cell; 0 outside the patch. With a trend subtracted their mean over the patch is zero.
    pub heights: Vec<f64>,
    /// What was done that the user should know.
    pub notices: Vec<Notice>,
    /// Points of the map along x and y of the joint.
    pub points: [f64; 2],
    /// Spacing of the points along x over that along y, where the map states none and is taken to cover the joint.
    pub assumed_aspect: Option<f64>,
}

/// Something done to a topography that the user should know. `Display` says it in a sentence.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Notice {
    /// The map is larger than the joint: its middle was used.
    #[error("the map of {:.6e} x {:.6e} m is larger than the joint of {:.6e} x {:.6e} m: its middle is used", map[0], map[1], joint[0], joint[1])]
    Cropped {
        /// Sides of the map \[m\].
        map: [f64; 2],
        /// Sides of the joint \[m\].
        joint: [f64; 2],
    },
    /// The map differs in size by less than [`SIZE_TOLERANCE`]: its spacing was adjusted.
    #[error("the map of {:.6e} x {:.6e} m is fitted to the joint of {:.6e} x {:.6e} m", map[0], map[1], joint[0], joint[1])]
    Fitted {
        /// Sides of the map \[m\].
        map: [f64; 2],
        /// Sides of the joint \[m\].
        joint: [f64; 2],
    },
    /// The map has another shape than the joint's grid.
    #[error("{} x {} points of the map are resampled to the joint's grid of {} x {}{}", from[0], from[1], to[0], to[1],
        if *assumed { "; it states no spacing and is taken to cover the joint (surface.spacing)" } else { "" })]
    Resampled {
        /// Points of the map that the joint covers, in part or whole.
        from: [usize; 2],
        /// Cells of the joint.
        to: [usize; 2],
        /// The map states no spacing, so its size is an assumption.
        assumed: bool,
    },
    /// Cells left the joint.
    #[error(
        "{points} points of the joint were not measured: {cells} cells are taken out of the joint"
    )]
    Masked {
        /// Unmeasured points of the map within the joint.
        points: usize,
        /// Cells taken out.
        cells: usize,
    },
    /// Heights were made up.
    #[error("{points} points of the joint were not measured: filled smoothly from their rims")]
    Filled {
        /// Unmeasured points of the map within the joint.
        points: usize,
    },
}

/// A topography that cannot be brought onto the joint.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PrepareError {
    /// The map does not cover the joint.
    #[error(
        "the map of {:.6e} x {:.6e} m is smaller than the joint of {:.6e} x {:.6e} m; make the joint smaller (joint.size), or correct the map's spacing (surface.spacing, between neighbouring points along x and y)", map[0], map[1], joint[0], joint[1]
    )]
    Smaller {
        /// Sides of the map \[m\].
        map: [f64; 2],
        /// Sides of the joint \[m\].
        joint: [f64; 2],
    },
    /// The measured points do not determine the trend.
    #[error(
        "{points} measured points do not determine the {terms} terms of detrend = \"{detrend}\"; see whether surface.spacing is right, or use a simpler trend"
    )]
    Underdetermined {
        /// The trend, as the scene spells it.
        detrend: &'static str,
        /// Measured points within the joint.
        points: usize,
        /// Terms of the polynomial.
        terms: usize,
    },
    /// The filling of holes did not converge.
    #[error(
        "filling the holes did not converge: residual {residual:.3e} after {iterations} iterations, {tolerance:.1e} asked; use fill = \"mask\""
    )]
    NotConverged {
        /// Iterations spent.
        iterations: usize,
        /// Largest residual reached, as a share of the range of heights.
        residual: f64,
        /// The residual asked for.
        tolerance: f64,
    },
    /// Nothing of the joint was measured.
    #[error("none of the joint's {cells} cells was measured")]
    NothingMeasured {
        /// Kept cells of the joint.
        cells: usize,
    },
    /// A topography that contradicts itself, which no reader returns.
    #[error("the topography has {found} heights for {nx} x {ny} points")]
    Length {
        /// Heights.
        found: usize,
        /// Points along x.
        nx: usize,
        /// Points along y.
        ny: usize,
    },
    /// A height that is neither a number nor a hole.
    #[error(
        "the height of point ({i}, {j}) is {value}; heights are finite, or NaN where nothing was measured"
    )]
    Infinite {
        /// Point along x.
        i: usize,
        /// Point along y.
        j: usize,
        /// The value.
        value: f64,
    },
}

/// Brings a topography onto the joint.
///
/// A map with the shape of the joint's grid is used point by point; another one is resampled conservatively (see the source of
/// `resample`): the mean is preserved, a plane stays a plane, and coarsening averages over the cell rather than picking points.
///
/// # Errors
/// [`PrepareError`]; above all a map that is smaller than the joint.
pub fn onto_joint(
    topography: &Topography,
    patch: &Patch,
    options: PrepareOptions,
) -> Result<Prepared, PrepareError> {
    check(topography)?;
    let grid = patch.grid;
    let mut notices = Vec::new();
    let mut map = Map::laid_on(topography, patch, &mut notices)?;
    let missing = (0..map.heights.len())
        .filter(|&k| map.within[k] && map.heights[k].is_nan())
        .count();
    map.detrend(options.detrend)?;

    let as_it_is = map.whole && [map.grid.nx, map.grid.ny] == [grid.nx, grid.ny];
    let measured: Vec<bool> = map.heights.iter().map(|h| !h.is_nan()).collect();
    let masks = missing > 0 && options.fill == Fill::Mask;
    // Resampling looks at neighbours: what lies in the bolt hole or was not measured must not leak into the joint.
    if !as_it_is || (missing > 0 && options.fill == Fill::Interpolate) {
        for (height, &within) in map.heights.iter_mut().zip(&map.within) {
            if !within {
                *height = f64::NAN;
            }
        }
        fill::harmonic(&map.grid, &mut map.heights)?;
    }
    let mut heights = if as_it_is {
        map.heights.clone()
    } else {
        notices.push(Notice::Resampled {
            from: [map.grid.nx, map.grid.ny],
            to: [grid.nx, grid.ny],
            assumed: topography.spacing.is_none(),
        });
        resample::parabolic(&map.grid, &map.heights, &map.window, &grid)
    };

    let mut patch = patch.clone();
    if masks {
        // Outside the joint "not measured" means nothing.
        let known = (0..measured.len()).map(|k| f64::from(measured[k] || !map.within[k]));
        let share = resample::constant(&map.grid, &known.collect::<Vec<_>>(), &map.window, &grid);
        let before = patch.cells();
        for (kept, share) in patch.kept.iter_mut().zip(&share) {
            *kept &= *share >= MEASURED_SHARE;
        }
        notices.push(Notice::Masked {
            points: missing,
            cells: before - patch.cells(),
        });
        if patch.cells() == 0 {
            return Err(PrepareError::NothingMeasured { cells: before });
        }
    } else if missing > 0 {
        notices.push(Notice::Filled { points: missing });
    }
    let shift = match options.detrend {
        Detrend::None => 0.0,
        _ => mean(&patch, &heights),
    };
    for (height, &kept) in heights.iter_mut().zip(&patch.kept) {
        *height = if kept { *height - shift } else { 0.0 };
    }
    let assumed = topography.spacing.is_none();
    Ok(Prepared {
        patch,
        heights,
        notices,
        points: map.window.map(|[start, end]| end - start),
        assumed_aspect: assumed.then_some(map.grid.dx / map.grid.dy),
    })
}

/// The part of a topography that covers the joint.
struct Map {
    /// Its points, with the spacing that they have on the joint.
    grid: Grid,
    heights: Vec<f64>,
    /// True for a point that lies in a kept cell of the joint.
    within: Vec<bool>,
    /// Where the joint begins and ends on this map, along x and y, in points.
    window: [[f64; 2]; 2],
    /// The joint is the whole map.
    whole: bool,
}

impl Map {
    fn laid_on(
        topography: &Topography,
        patch: &Patch,
        notices: &mut Vec<Notice>,
    ) -> Result<Self, PrepareError> {
        let points = [topography.nx, topography.ny];
        let joint = patch.grid.size();
        let map = topography.size().unwrap_or(joint);
        let ratio = [map[0] / joint[0], map[1] / joint[1]];
        if ratio.iter().any(|&r| r < 1.0 - SIZE_TOLERANCE) {
            return Err(PrepareError::Smaller { map, joint });
        }
        let crops = ratio.map(|r| r > 1.0 + SIZE_TOLERANCE);
        if crops.contains(&true) {
            notices.push(Notice::Cropped { map, joint });
        }
        if (0..2).any(|axis| !crops[axis] && (ratio[axis] - 1.0).abs() > ROUNDING) {
            notices.push(Notice::Fitted { map, joint });
        }
        let (mut first, mut count, mut window) = ([0; 2], points, [[0.0; 2]; 2]);
        for axis in 0..2 {
            let all = points[axis] as f64;
            if crops[axis] {
                let length = all / ratio[axis];
                let start = 0.5 * (all - length);
                first[axis] = start.floor() as usize;
                count[axis] = ((start + length).ceil() as usize).min(points[axis]) - first[axis];
                window[axis] = [
                    start - first[axis] as f64,
                    start - first[axis] as f64 + length,
                ];
            } else {
                window[axis] = [0.0, all];
            }
        }
        let spacing = |axis: usize| joint[axis] / (window[axis][1] - window[axis][0]);
        let grid = Grid {
            nx: count[0],
            ny: count[1],
            dx: spacing(0),
            dy: spacing(1),
        };
        let heights = (0..grid.len()).map(|index| {
            let (i, j) = grid.cell(index);
            topography.heights[(first[0] + i) * topography.ny + first[1] + j]
        });
        let cell = |axis: usize, point: usize, cells: usize| {
            let [start, end] = window[axis];
            let at = (point as f64 + 0.5 - start) / (end - start) * cells as f64;
            (at.max(0.0) as usize).min(cells - 1)
        };
        let within = (0..grid.len()).map(|index| {
            let (i, j) = grid.cell(index);
            let (i, j) = (cell(0, i, patch.grid.nx), cell(1, j, patch.grid.ny));
            patch.kept[patch.grid.index(i, j)]
        });
        let found = Map {
            grid,
            heights: heights.collect(),
            within: within.collect(),
            window,
            whole: crops == [false; 2],
        };
        if (0..grid.len()).all(|k| !found.within[k] || found.heights[k].is_nan()) {
            return Err(PrepareError::NothingMeasured {
                cells: patch.cells(),
            });
        }
        Ok(found)
    }

    fn detrend(&mut self, trend: Detrend) -> Result<(), PrepareError> {
        let (order, name) = match trend {
            Detrend::None => return Ok(()),
            Detrend::Mean => (0, "mean"),
            Detrend::Plane => (1, "plane"),
            Detrend::Quadratic => (2, "quadratic"),
        };
        let fitted: Vec<f64> = self
            .heights
            .iter()
            .zip(&self.within)
            .map(|(&h, &within)| if within { h } else { f64::NAN })
            .collect();
        let trend = detrend::fit(&self.grid, &fitted, order).ok_or_else(|| {
            PrepareError::Underdetermined {
                detrend: name,
                points: fitted.iter().filter(|h| !h.is_nan()).count(),
                terms: detrend::terms(order),
            }
        })?;
        for (index, height) in self.heights.iter_mut().enumerate() {
            *height -= trend.at(&self.grid, index);
        }
        Ok(())
    }
}

fn check(topography: &Topography) -> Result<(), PrepareError> {
    let (nx, ny) = (topography.nx, topography.ny);
    if topography.heights.len() != nx * ny || topography.heights.is_empty() {
        return Err(PrepareError::Length {
            found: topography.heights.len(),
            nx,
            ny,
        });
    }
    match topography.heights.iter().position(|h| h.is_infinite()) {
        Some(index) => Err(PrepareError::Infinite {
            i: index / ny,
            j: index % ny,
            value: topography.heights[index],
        }),
        None => Ok(()),
    }
}

fn mean(patch: &Patch, heights: &[f64]) -> f64 {
    let kept = heights.iter().zip(&patch.kept).filter(|(_, kept)| **kept);
    kept.map(|(h, _)| h).sum::<f64>() / patch.cells() as f64
}
