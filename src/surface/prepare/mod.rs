//! Conversion of a measured height map to heights on the joint's grid.
//!
//! The conversion of a height map has five steps in the following order:
//! 1. The conversion places the centre of the map on the centre of the joint, or at a shift. The spacing of the map
//!    determines which part of the map the joint covers. The conversion never stretches the map without a note to the
//!    user.
//! 2. The spacing of the map can equal the size of the joint's cells. The conversion then cuts a window of whole points
//!    from the map.
//! 3. The conversion fits a trend to the measured points of the joint and subtracts the trend.
//! 4. The conversion masks or fills unmeasured points.
//! 5. The conversion resamples the map to the joint's cells, unless the points of the map are already the cells.

mod detrend;
mod fill;
mod form;
mod resample;

use serde::{Deserialize, Serialize};

pub use form::Form;

use super::statistics::moments;
use super::topography::Topography;
use crate::grid::{Grid, Patch};

/// Largest relative difference in size at which a map and a joint count as equally large.
pub const SIZE_TOLERANCE: f64 = 0.01;

/// Range of plausible sides of a map \[m\]; beyond it the spacing is doubtful.
pub const PLAUSIBLE_SIDES: [f64; 2] = [1e-6, 1.0];

/// Range of plausible heights of a map \[m\]; beyond it the unit is doubtful.
pub const PLAUSIBLE_HEIGHTS: [f64; 2] = [1e-9, 1e-3];

/// Smallest number of points along a side of the joint; with fewer a map shows no roughness.
const FEWEST_POINTS: f64 = 4.0;

/// Largest permitted difference between the map's points and the joint's cells. The difference is in cells over the
/// length of the joint. Below `SAME_CELLS`, the points and the cells coincide.
const SAME_CELLS: f64 = 0.01;

/// A relative difference in size below `ROUNDING` is a rounding error, because SUR files store the spacing in single
/// precision.
const ROUNDING: f64 = 1e-5;

/// Smallest measured fraction of a cell that belongs to the joint.
const MEASURED_SHARE: f64 = 0.5;

/// Trend to subtract from the map. The trend is a polynomial in x and y. The conversion fits the polynomial to the
/// measured points of the joint by least squares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Detrend {
    /// Subtracts no trend, so the heights keep their mean.
    None,
    /// Mean height.
    Mean,
    /// Mean plane.
    Plane,
    /// Plane and curvature (six terms).
    Quadratic,
}

/// Treatment of points that were not measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fill {
    /// Removes cells from the joint of which less than half is measured. A removed cell carries no load.
    Mask,
    /// Fills a hole with the solution of the Laplace equation, which is the smoothest surface through the rim. The
    /// boundary values are the heights of the measured neighbours above the mean plane. The fill is exact for a plane.
    /// The fill has no roughness and no peaks.
    Interpolate,
}

/// User's choices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrepareOptions {
    /// Trend to subtract.
    pub detrend: Detrend,
    /// Treatment of holes.
    pub fill: Fill,
    /// Position of the map's centre relative to the joint's centre along x and y \[m\].
    pub shift: [f64; 2],
}

/// Topography on the joint.
#[derive(Debug, Clone, PartialEq)]
pub struct PreparedSurface {
    /// Input joint. If holes are masked, without the cells that were not measured.
    pub patch: Patch,
    /// Heights \[m\], one per cell; 0 outside the patch. If a trend is subtracted, the mean of the heights over the
    /// patch is zero.
    pub heights: Vec<f64>,
    /// Actions that the user should know.
    pub notices: Vec<Notice>,
    /// Heights of the first and of the second face \[m\], if the surface is a composite of two faces.
    pub faces: Option<[Vec<f64>; 2]>,
    /// Fit of the map to the joint; for two faces the worse value of each figure.
    pub fit: Fit,
}

/// Figures that show how well a map fits its joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Points of the map along x and y of the joint.
    pub points: [f64; 2],
    /// Ratio of the point spacing along x to the spacing along y.
    pub aspect: f64,
    /// Whether the map states no spacing and is assumed to cover the joint.
    pub is_assumed: bool,
    /// Fraction of the joint's points that was not measured.
    pub unmeasured: f64,
    /// Autocorrelations of the heights at a lag of two points along x and along y, without the trend. `None` for a flat
    /// or an empty map.
    pub correlation: [Option<f64>; 2],
    /// Longer side of the map \[m\]; `None` for a map without spacing.
    pub side: Option<f64>,
    /// Range of heights on the joint, after the trend \[m\].
    pub range: f64,
}

impl Fit {
    /// Rejects a map if the joint covers too few points of the map.
    ///
    /// # Errors
    /// [`PrepareError::FewPoints`]
    pub fn check(&self) -> Result<(), PrepareError> {
        let points = self.points;
        match points.iter().all(|points| *points >= FEWEST_POINTS) {
            true => Ok(()),
            false => Err(PrepareError::FewPoints { points }),
        }
    }

    /// Returns the worse of two fits, figure by figure.
    fn worse(self, other: Fit) -> Fit {
        let worse_of_both =
            |a: Option<f64>, b: Option<f64>, worse: fn(f64, f64) -> f64| match (a, b) {
                (Some(a), Some(b)) => Some(worse(a, b)),
                (a, b) => a.or(b),
            };
        let skew = |aspect: f64| aspect.max(1.0 / aspect);
        let is_other = skew(other.aspect) > skew(self.aspect);
        Fit {
            points: [0, 1].map(|axis| self.points[axis].min(other.points[axis])),
            aspect: if is_other { other.aspect } else { self.aspect },
            is_assumed: if is_other {
                other.is_assumed
            } else {
                self.is_assumed
            },
            unmeasured: self.unmeasured.max(other.unmeasured),
            correlation: [0, 1].map(|axis| {
                worse_of_both(self.correlation[axis], other.correlation[axis], f64::min)
            }),
            side: worse_of_both(self.side, other.side, f64::max),
            range: self.range.max(other.range),
        }
    }
}

impl PreparedSurface {
    /// Returns the composite of two faces: the sum of their heights on the cells that both have. The heights
    /// of each face point outwards from its own body. Where cells are masked, the mean of the composite is
    /// not zero.
    pub fn composite(self, second: PreparedSurface) -> PreparedSurface {
        let mut patch = self.patch;
        for (kept, other) in patch.is_in_joint.iter_mut().zip(&second.patch.is_in_joint) {
            *kept &= other;
        }
        let on_both = |heights: Vec<f64>| -> Vec<f64> {
            let cells = heights.into_iter().zip(&patch.is_in_joint);
            cells.map(|(h, kept)| if *kept { h } else { 0.0 }).collect()
        };
        let faces = [self.heights, second.heights].map(on_both);
        let [first, other] = &faces;
        let heights = first.iter().zip(other).map(|(a, b)| a + b).collect();
        let second_notices = second.notices.into_iter();
        let second_notices = second_notices.map(|notice| Notice::SecondFace(Box::new(notice)));
        PreparedSurface {
            patch,
            heights,
            notices: self.notices.into_iter().chain(second_notices).collect(),
            faces: Some(faces),
            fit: self.fit.worse(second.fit),
        }
    }
}

/// Action on a topography that the user should know. `Display` writes the notice as a sentence.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Notice {
    /// The action concerns the second of two faces.
    #[error("second face: {0}")]
    SecondFace(Box<Notice>),
    /// Reader's remark on the file.
    #[error("{0}")]
    Remark(String),
    /// The map was moved to a window of whole points: not its middle, or not exactly at the shift.
    #[error("the map is moved by {:.3e} x {:.3e} m, so that its points lie on the cells of the joint; nothing is resampled", offset[0], offset[1])]
    Moved {
        /// Displacement of the map \[m\].
        offset: [f64; 2],
    },
    /// The map is larger than the joint, and its middle was used.
    #[error("the map of {:.6e} x {:.6e} m is larger than the joint of {:.6e} x {:.6e} m: its middle is used", map[0], map[1], joint[0], joint[1])]
    Cropped {
        /// Sides of the map \[m\].
        map: [f64; 2],
        /// Sides of the joint \[m\].
        joint: [f64; 2],
    },
    /// The size of the map differs by less than [`SIZE_TOLERANCE`], and its spacing was adjusted.
    #[error("the map of {:.6e} x {:.6e} m is fitted to the joint of {:.6e} x {:.6e} m", map[0], map[1], joint[0], joint[1])]
    Fitted {
        /// Sides of the map \[m\].
        map: [f64; 2],
        /// Sides of the joint \[m\].
        joint: [f64; 2],
    },
    /// The shape of the map differs from the joint's grid.
    #[error("{} x {} points of the map are resampled to the joint's grid of {} x {}: Rq goes from {:.3e} to {:.3e} m{}", from[0], from[1], to[0], to[1],
        rq[0], rq[1], if *assumed { "; it states no spacing and is taken to cover the joint (surface.spacing)" } else { "" })]
    Resampled {
        /// Rq of the joint's points, and of its cells \[m\].
        rq: [f64; 2],
        /// Points of the map that the joint covers, in part or whole.
        from: [usize; 2],
        /// Cells of the joint.
        to: [usize; 2],
        /// Whether the map states no spacing, so that its size is an assumption.
        assumed: bool,
    },
    /// Cells were removed from the joint.
    #[error(
        "{points} points of the joint ({}) were not measured: {cells} cells are taken out of the joint",
        percent(*share)
    )]
    Masked {
        /// Fraction of the unmeasured points.
        share: f64,
        /// Unmeasured points of the map within the joint.
        points: usize,
        /// Cells removed.
        cells: usize,
    },
    /// Unmeasured heights were interpolated.
    #[error(
        "{points} points of the joint ({}) were not measured: filled smoothly from their rims",
        percent(*share)
    )]
    Filled {
        /// Fraction of the unmeasured points.
        share: f64,
        /// Unmeasured points of the map within the joint.
        points: usize,
    },
}

fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

/// Errors of placing a topography on the joint.
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
    /// A shift moves the map off the joint.
    #[error(
        "with surface.second.shift the map lies from {:.6e} to {:.6e} m along {axis}, and the joint from {:.6e} to {:.6e} m: both faces must cover the joint; \
         make the shift or joint.size smaller", map[0], map[1], joint[0], joint[1]
    )]
    Uncovered {
        /// Axis, x or y.
        axis: char,
        /// Ends of the map, from the centre of the joint \[m\].
        map: [f64; 2],
        /// Ends of the joint \[m\].
        joint: [f64; 2],
    },
    /// A map without spacing covers the whole joint and cannot be shifted.
    #[error("surface.second.shift moves a map that states no spacing; give surface.second.spacing")]
    ShiftWithoutSpacing,
    /// The joint covers too few points of the height map.
    #[error(
        "the joint covers {:.3} x {:.3} points of the map, and at least {least} x {least} are needed: correct the distance of its points (surface.spacing, \
         or surface.correct.spacing if the file is wrong), or joint.size", points[0], points[1], least = FEWEST_POINTS
    )]
    FewPoints {
        /// Points along x and y.
        points: [f64; 2],
    },
    /// The measured points do not determine the trend.
    #[error(
        "{points} measured points do not determine the {terms} terms of detrend = \"{detrend}\"; see whether surface.spacing is right, or use a simpler trend"
    )]
    Underdetermined {
        /// Name of the subtracted trend, as in the scene.
        detrend: &'static str,
        /// Measured points within the joint.
        points: usize,
        /// Terms of the polynomial.
        terms: usize,
    },
    /// The filling of holes did not converge.
    #[error(
        "filling the holes did not converge: residual {residual:.3e} after {iterations} iterations, and the tolerance is {tolerance:.1e}; use fill = \"mask\""
    )]
    NotConverged {
        /// Iterations used.
        iterations: usize,
        /// Largest residual reached, as a fraction of the range of heights.
        residual: f64,
        /// Required residual.
        tolerance: f64,
    },
    /// No cell of the joint was measured.
    #[error("none of the joint's {cells} cells was measured")]
    NothingMeasured {
        /// Kept cells of the joint.
        cells: usize,
    },
    /// The number of heights contradicts the number of points. No reader returns a topography with a wrong number of
    /// heights.
    #[error("the topography has {found} heights for {nx} x {ny} points")]
    Length {
        /// Number of heights.
        found: usize,
        /// Points along x.
        nx: usize,
        /// Points along y.
        ny: usize,
    },
    /// A height is infinite.
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

/// Converts a topography to heights on the joint.
///
/// A map with the shape of the joint's grid is used point by point. Other maps are resampled conservatively (see the
/// source of `resample`). The resampling preserves the mean and planes. On a coarser grid, a height is the mean over
/// the cell, not the height of one point.
///
/// # Errors
/// [`PrepareError`], mostly for a map that is smaller than the joint.
pub fn onto_joint(
    topography: &Topography,
    patch: &Patch,
    options: PrepareOptions,
) -> Result<PreparedSurface, PrepareError> {
    check(topography)?;
    let grid = patch.grid;
    let mut notices = Vec::new();
    let mut map = Map::place_on(topography, patch, options.shift, &mut notices)?;
    let points = map.within.iter().filter(|within| **within).count();
    let missing = (0..map.heights.len())
        .filter(|&k| map.within[k] && map.heights[k].is_nan())
        .count();
    let unmeasured = missing as f64 / points as f64;
    map.detrend(options.detrend)?;
    let fit = map.fit(topography, unmeasured);

    let measured: Vec<bool> = map.heights.iter().map(|h| !h.is_nan()).collect();
    let rq_of_points = map.rq();
    let masks = missing > 0 && options.fill == Fill::Mask;
    // Resampling uses neighbours, so that points in the bolt hole and unmeasured points must not affect the
    // joint.
    if !map.is_on_cells || (missing > 0 && options.fill == Fill::Interpolate) {
        for (height, &within) in map.heights.iter_mut().zip(&map.within) {
            if !within {
                *height = f64::NAN;
            }
        }
        fill::harmonic(&map.grid, &mut map.heights)?;
    }
    let mut heights = if map.is_on_cells {
        map.heights.clone()
    } else {
        resample::parabolic(&map.grid, &map.heights, &map.window, &grid)
    };

    let mut patch = patch.clone();
    let mut holes_notice = None;
    if masks {
        // Points outside the joint do not count as unmeasured.
        let is_measured = (0..measured.len()).map(|k| f64::from(measured[k] || !map.within[k]));
        let share = resample::constant(
            &map.grid,
            &is_measured.collect::<Vec<_>>(),
            &map.window,
            &grid,
        );
        let before = patch.cells();
        for (kept, share) in patch.is_in_joint.iter_mut().zip(&share) {
            *kept &= *share >= MEASURED_SHARE;
        }
        holes_notice = Some(Notice::Masked {
            share: unmeasured,
            points: missing,
            cells: before - patch.cells(),
        });
        if patch.cells() == 0 {
            return Err(PrepareError::NothingMeasured { cells: before });
        }
    } else if missing > 0 {
        holes_notice = Some(Notice::Filled {
            share: unmeasured,
            points: missing,
        });
    }
    if !map.is_on_cells {
        let kept_heights = patch.joint_values(&heights);
        notices.push(Notice::Resampled {
            rq: [
                rq_of_points,
                moments(kept_heights.iter().copied()).map_or(0.0, |statistics| statistics.rq),
            ],
            from: [map.grid.nx, map.grid.ny],
            to: [grid.nx, grid.ny],
            assumed: topography.spacing.is_none(),
        });
    }
    notices.extend(holes_notice);
    let shift = match options.detrend {
        Detrend::None => 0.0,
        _ => mean(&patch, &heights),
    };
    for (height, &kept) in heights.iter_mut().zip(&patch.is_in_joint) {
        *height = if kept { *height - shift } else { 0.0 };
    }
    Ok(PreparedSurface {
        patch,
        heights,
        notices,
        faces: None,
        fit,
    })
}

/// Part of a topography that covers the joint.
struct Map {
    /// Points of the map, with their spacing on the joint.
    grid: Grid,
    heights: Vec<f64>,
    /// True for a point in a kept cell of the joint.
    within: Vec<bool>,
    /// Ends of the joint along x and y on the map, in points of the map.
    window: [[f64; 2]; 2],
    /// Whether the points coincide with the cells of the joint.
    is_on_cells: bool,
}

impl Map {
    fn place_on(
        topography: &Topography,
        patch: &Patch,
        shift: [f64; 2],
        notices: &mut Vec<Notice>,
    ) -> Result<Self, PrepareError> {
        let points = [topography.nx, topography.ny];
        let cells = [patch.grid.nx, patch.grid.ny];
        let joint = patch.grid.size();
        if topography.spacing.is_none() && shift != [0.0; 2] {
            return Err(PrepareError::ShiftWithoutSpacing);
        }
        let map = topography.size().unwrap_or(joint);
        let ratio = [map[0] / joint[0], map[1] / joint[1]];
        if ratio.iter().any(|&r| r < 1.0 - SIZE_TOLERANCE) {
            return Err(PrepareError::Smaller { map, joint });
        }
        let crops = [0, 1].map(|axis| ratio[axis] > 1.0 + SIZE_TOLERANCE || shift[axis] != 0.0);
        if ratio.iter().any(|&r| r > 1.0 + SIZE_TOLERANCE) {
            notices.push(Notice::Cropped { map, joint });
        }
        if (0..2).any(|axis| !crops[axis] && (ratio[axis] - 1.0).abs() > ROUNDING) {
            notices.push(Notice::Fitted { map, joint });
        }
        let (mut first, mut count, mut window) = ([0; 2], points, [[0.0; 2]; 2]);
        let mut offset = [0.0; 2];
        for axis in 0..2 {
            let all = points[axis] as f64;
            window[axis] = [0.0, all];
            if !crops[axis] {
                continue;
            }
            // Length of the joint, and start of the joint on the map, in points of the map.
            let mut length = all / ratio[axis];
            let spacing = map[axis] / all;
            let centred = 0.5 * (all - length) - shift[axis] / spacing;
            if centred < -ROUNDING * all || centred + length > all * (1.0 + ROUNDING) {
                let map_ends = [-0.5, 0.5].map(|end| end * map[axis] + shift[axis]);
                return Err(PrepareError::Uncovered {
                    axis: ['x', 'y'][axis],
                    map: map_ends,
                    joint: [-0.5, 0.5].map(|end| end * joint[axis]),
                });
            }
            let mut start = centred.clamp(0.0, all - length);
            if (length - cells[axis] as f64).abs() <= SAME_CELLS {
                length = cells[axis] as f64;
                // Of two equally near windows, take the lower. Half a point rounds down up to rounding
                // errors.
                start = (centred - ROUNDING).round().clamp(0.0, all - length);
                let displacement = centred - start;
                offset[axis] = if displacement.abs() > SAME_CELLS {
                    displacement * spacing
                } else {
                    0.0
                };
            }
            first[axis] = start.floor() as usize;
            count[axis] = ((start + length).ceil() as usize).min(points[axis]) - first[axis];
            window[axis] = [
                start - first[axis] as f64,
                start - first[axis] as f64 + length,
            ];
        }
        if offset != [0.0; 2] {
            notices.push(Notice::Moved { offset });
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
            patch.is_in_joint[patch.grid.index(i, j)]
        });
        let map_on_joint = Map {
            grid,
            heights: heights.collect(),
            within: within.collect(),
            window,
            is_on_cells: count == cells && window == cells.map(|cells| [0.0, cells as f64]),
        };
        if (0..grid.len()).all(|k| !map_on_joint.within[k] || map_on_joint.heights[k].is_nan()) {
            return Err(PrepareError::NothingMeasured {
                cells: patch.cells(),
            });
        }
        Ok(map_on_joint)
    }

    /// Returns the measured heights of the joint's points \[m\].
    fn measured_heights(&self) -> impl Iterator<Item = f64> + Clone {
        let points = self.heights.iter().zip(&self.within);
        points.filter_map(|(&h, &within)| (within && !h.is_nan()).then_some(h))
    }

    /// Returns the Rq of the measured points of the joint \[m\].
    fn rq(&self) -> f64 {
        moments(self.measured_heights()).map_or(0.0, |statistics| statistics.rq)
    }

    /// Computes the figures of the fit. `topography` is the whole map, with its trend.
    fn fit(&self, topography: &Topography, unmeasured: f64) -> Fit {
        let ends = |(low, high): (f64, f64), h: f64| (low.min(h), high.max(h));
        let (low, high) = self
            .measured_heights()
            .fold((f64::INFINITY, f64::NEG_INFINITY), ends);
        Fit {
            points: self.window.map(|[start, end]| end - start),
            aspect: self.grid.dx / self.grid.dy,
            is_assumed: topography.spacing.is_none(),
            unmeasured,
            correlation: [[2, 0], [0, 2]].map(|lag| self.correlation(lag)),
            side: topography.size().map(|[x, y]| x.max(y)),
            range: high - low,
        }
    }

    /// Computes the autocorrelation of the heights about their mean, over a lag in points.
    fn correlation(&self, [along_x, along_y]: [usize; 2]) -> Option<f64> {
        let (nx, ny) = (self.grid.nx, self.grid.ny);
        let statistics = moments(self.measured_heights())?;
        let (mut sum, mut pairs) = (0.0, 0.0);
        for i in 0..nx.saturating_sub(along_x) {
            for j in 0..ny.saturating_sub(along_y) {
                let ends = [(i, j), (i + along_x, j + along_y)].map(|(i, j)| self.grid.index(i, j));
                let [a, b] = ends.map(|end| self.heights[end] - statistics.mean);
                if ends.iter().all(|end| self.within[*end]) && !a.is_nan() && !b.is_nan() {
                    sum += a * b;
                    pairs += 1.0;
                }
            }
        }
        (pairs > 0.0 && statistics.rq > 0.0).then(|| sum / pairs / statistics.rq.powi(2))
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
    let kept = heights
        .iter()
        .zip(&patch.is_in_joint)
        .filter(|(_, kept)| **kept);
    kept.map(|(h, _)| h).sum::<f64>() / patch.cells() as f64
}
