//! From a measured height map to heights on the joint's grid.
//!
//! In this order: the map is laid on the joint, centred but for a shift (its own spacing decides how much of it the joint needs, nothing is
//! stretched silently); where its spacing is that of the joint's cells a window of whole points is taken; the trend is fitted to the measured points that belong to the joint, and subtracted; points that were
//! not measured are masked or filled; the map is resampled to the joint's cells, unless it has their shape already.

mod detrend;
mod fill;
mod form;
mod resample;

use serde::{Deserialize, Serialize};

pub use form::Form;

use super::statistics::moments;
use super::topography::Topography;
use crate::grid::{Grid, Patch};

/// A map and a joint whose sizes differ by less than this share are taken as one and the same.
pub const SIZE_TOLERANCE: f64 = 0.01;

/// Sides of a map beyond which its spacing is doubtful \[m\].
pub const SIDES: [f64; 2] = [1e-6, 1.0];

/// Heights of a map beyond which its unit is doubtful \[m\].
pub const HEIGHTS: [f64; 2] = [1e-9, 1e-3];

/// A map of fewer points along a side of the joint has no roughness.
const FEWEST_POINTS: f64 = 4.0;

/// The points of a map are those of the joint's cells if they stay within this share of a cell over the joint.
const SAME_CELLS: f64 = 0.01;

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
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrepareOptions {
    /// Trend to subtract.
    pub detrend: Detrend,
    /// What becomes of holes.
    pub fill: Fill,
    /// Place of the map's middle, from the middle of the joint along x and y \[m\].
    pub shift: [f64; 2],
}

/// A topography on the joint.
#[derive(Debug, Clone, PartialEq)]
pub struct PreparedSurface {
    /// The joint: as given, without the cells that were not measured if holes are masked.
    pub patch: Patch,
    /// Heights \[m\], one a cell; 0 outside the patch. With a trend subtracted their mean over the patch is zero.
    pub heights: Vec<f64>,
    /// What was done that the user should know.
    pub notices: Vec<Notice>,
    /// Heights of the first and the second face, of a composite of two \[m\].
    pub faces: Option<[Vec<f64>; 2]>,
    /// How the map fits to the joint; of two faces the one that fits less, figure by figure.
    pub fit: Fit,
}

/// How a map fits to its joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Points of the map along x and y of the joint.
    pub points: [f64; 2],
    /// Spacing of the points along x over that along y.
    pub aspect: f64,
    /// The map states no spacing and is taken to cover the joint.
    pub is_assumed: bool,
    /// Share of the joint's points that was not measured.
    pub unmeasured: f64,
    /// Autocorrelation of the heights over two points along x and y, after the trend; none of a flat or an empty map.
    pub correlation: [Option<f64>; 2],
    /// Longer side of the map \[m\]; none of a map without spacing.
    pub side: Option<f64>,
    /// Highest less lowest point of the joint, after the trend \[m\].
    pub range: f64,
}

impl Fit {
    /// Rejects a map of which the joint covers hardly any points.
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

    /// The worse of two, figure by figure.
    fn worse(self, other: Fit) -> Fit {
        let of_both = |a: Option<f64>, b: Option<f64>, worse: fn(f64, f64) -> f64| match (a, b) {
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
            correlation: [0, 1]
                .map(|axis| of_both(self.correlation[axis], other.correlation[axis], f64::min)),
            side: of_both(self.side, other.side, f64::max),
            range: self.range.max(other.range),
        }
    }
}

impl PreparedSurface {
    /// The composite of two faces, whose heights count outwards from their own bodies: the sum on the cells that both have. Where cells are masked
    /// its mean is not zero.
    pub fn composite(self, second: PreparedSurface) -> PreparedSurface {
        let mut patch = self.patch;
        for (kept, other) in patch.kept.iter_mut().zip(&second.patch.kept) {
            *kept &= other;
        }
        let on_both = |heights: Vec<f64>| -> Vec<f64> {
            let cells = heights.into_iter().zip(&patch.kept);
            cells.map(|(h, kept)| if *kept { h } else { 0.0 }).collect()
        };
        let faces = [self.heights, second.heights].map(on_both);
        let [first, other] = &faces;
        let heights = first.iter().zip(other).map(|(a, b)| a + b).collect();
        let of_second = second.notices.into_iter();
        let of_second = of_second.map(|notice| Notice::OfSecond(Box::new(notice)));
        PreparedSurface {
            patch,
            heights,
            notices: self.notices.into_iter().chain(of_second).collect(),
            faces: Some(faces),
            fit: self.fit.worse(second.fit),
        }
    }
}

/// Something done to a topography that the user should know. `Display` says it in a sentence.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Notice {
    /// It was done to the second of two faces.
    #[error("second face: {0}")]
    OfSecond(Box<Notice>),
    /// The reader's remark on the file.
    #[error("{0}")]
    Remark(String),
    /// A window of whole points was taken that is not the middle of the map, or not where the shift puts it.
    #[error("the map is moved by {:.3e} x {:.3e} m, so that its points lie on the cells of the joint; nothing is resampled", offset[0], offset[1])]
    Moved {
        /// What the map is moved by \[m\].
        offset: [f64; 2],
    },
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
    #[error("{} x {} points of the map are resampled to the joint's grid of {} x {}: Rq goes from {:.3e} to {:.3e} m{}", from[0], from[1], to[0], to[1],
        rq[0], rq[1], if *assumed { "; it states no spacing and is taken to cover the joint (surface.spacing)" } else { "" })]
    Resampled {
        /// Rq of the joint's points, and of its cells \[m\].
        rq: [f64; 2],
        /// Points of the map that the joint covers, in part or whole.
        from: [usize; 2],
        /// Cells of the joint.
        to: [usize; 2],
        /// The map states no spacing, so its size is an assumption.
        assumed: bool,
    },
    /// Cells left the joint.
    #[error(
        "{points} points of the joint ({}) were not measured: {cells} cells are taken out of the joint",
        percent(*share)
    )]
    Masked {
        /// Their share.
        share: f64,
        /// Unmeasured points of the map within the joint.
        points: usize,
        /// Cells taken out.
        cells: usize,
    },
    /// Heights were made up.
    #[error(
        "{points} points of the joint ({}) were not measured: filled smoothly from their rims",
        percent(*share)
    )]
    Filled {
        /// Their share.
        share: f64,
        /// Unmeasured points of the map within the joint.
        points: usize,
    },
}

fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
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
    /// A shift takes the map off the joint.
    #[error(
        "with surface.second.shift the map lies from {:.6e} to {:.6e} m along {axis}, and the joint from {:.6e} to {:.6e} m: both faces must cover the joint; \
         make the shift or joint.size smaller", map[0], map[1], joint[0], joint[1]
    )]
    Uncovered {
        /// x or y.
        axis: char,
        /// Ends of the map, from the middle of the joint \[m\].
        map: [f64; 2],
        /// Ends of the joint \[m\].
        joint: [f64; 2],
    },
    /// A map without a spacing has no place but over the whole joint.
    #[error("surface.second.shift moves a map that states no spacing; give surface.second.spacing")]
    ShiftWithoutSpacing,
    /// Hardly any points.
    #[error(
        "the joint covers {:.3} x {:.3} points of the map, and {least} x {least} are the least: correct the distance of its points (surface.spacing, \
         or surface.correct.spacing over that of the file), or joint.size", points[0], points[1], least = FEWEST_POINTS
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
) -> Result<PreparedSurface, PrepareError> {
    check(topography)?;
    let grid = patch.grid;
    let mut notices = Vec::new();
    let mut map = Map::laid_on(topography, patch, options.shift, &mut notices)?;
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
    // Resampling looks at neighbours: what lies in the bolt hole or was not measured must not leak into the joint.
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
    let mut of_holes = None;
    if masks {
        // Outside the joint "not measured" means nothing.
        let known = (0..measured.len()).map(|k| f64::from(measured[k] || !map.within[k]));
        let share = resample::constant(&map.grid, &known.collect::<Vec<_>>(), &map.window, &grid);
        let before = patch.cells();
        for (kept, share) in patch.kept.iter_mut().zip(&share) {
            *kept &= *share >= MEASURED_SHARE;
        }
        of_holes = Some(Notice::Masked {
            share: unmeasured,
            points: missing,
            cells: before - patch.cells(),
        });
        if patch.cells() == 0 {
            return Err(PrepareError::NothingMeasured { cells: before });
        }
    } else if missing > 0 {
        of_holes = Some(Notice::Filled {
            share: unmeasured,
            points: missing,
        });
    }
    if !map.is_on_cells {
        let kept = patch.gather(&heights);
        notices.push(Notice::Resampled {
            rq: [
                rq_of_points,
                moments(kept.iter().copied()).map_or(0.0, |found| found.rq),
            ],
            from: [map.grid.nx, map.grid.ny],
            to: [grid.nx, grid.ny],
            assumed: topography.spacing.is_none(),
        });
    }
    notices.extend(of_holes);
    let shift = match options.detrend {
        Detrend::None => 0.0,
        _ => mean(&patch, &heights),
    };
    for (height, &kept) in heights.iter_mut().zip(&patch.kept) {
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

/// The part of a topography that covers the joint.
struct Map {
    /// Its points, with the spacing that they have on the joint.
    grid: Grid,
    heights: Vec<f64>,
    /// True for a point that lies in a kept cell of the joint.
    within: Vec<bool>,
    /// Where the joint begins and ends on this map, along x and y, in points.
    window: [[f64; 2]; 2],
    /// Its points are the cells of the joint.
    is_on_cells: bool,
}

impl Map {
    fn laid_on(
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
            // In points: the joint's length, and where it begins on the map.
            let mut length = all / ratio[axis];
            let spacing = map[axis] / all;
            let centred = 0.5 * (all - length) - shift[axis] / spacing;
            if centred < -ROUNDING * all || centred + length > all * (1.0 + ROUNDING) {
                let of_map = [-0.5, 0.5].map(|end| end * map[axis] + shift[axis]);
                return Err(PrepareError::Uncovered {
                    axis: ['x', 'y'][axis],
                    map: of_map,
                    joint: [-0.5, 0.5].map(|end| end * joint[axis]),
                });
            }
            let mut start = centred.clamp(0.0, all - length);
            if (length - cells[axis] as f64).abs() <= SAME_CELLS {
                length = cells[axis] as f64;
                // The lower one of two that are as near; half a point is no whole number but for rounding.
                start = (centred - ROUNDING).round().clamp(0.0, all - length);
                let moved = centred - start;
                offset[axis] = if moved.abs() > SAME_CELLS {
                    moved * spacing
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
            patch.kept[patch.grid.index(i, j)]
        });
        let found = Map {
            grid,
            heights: heights.collect(),
            within: within.collect(),
            window,
            is_on_cells: count == cells && window == cells.map(|cells| [0.0, cells as f64]),
        };
        if (0..grid.len()).all(|k| !found.within[k] || found.heights[k].is_nan()) {
            return Err(PrepareError::NothingMeasured {
                cells: patch.cells(),
            });
        }
        Ok(found)
    }

    /// Heights of the points of the joint that were measured \[m\].
    fn known(&self) -> impl Iterator<Item = f64> + Clone {
        let points = self.heights.iter().zip(&self.within);
        points.filter_map(|(&h, &within)| (within && !h.is_nan()).then_some(h))
    }

    /// Of the points of the joint that were measured \[m\].
    fn rq(&self) -> f64 {
        moments(self.known()).map_or(0.0, |found| found.rq)
    }

    /// `topography` is the whole map, with its trend.
    fn fit(&self, topography: &Topography, unmeasured: f64) -> Fit {
        let ends = |(low, high): (f64, f64), h: f64| (low.min(h), high.max(h));
        let (low, high) = self.known().fold((f64::INFINITY, f64::NEG_INFINITY), ends);
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

    /// Autocorrelation of the heights about their mean, over a lag in points.
    fn correlation(&self, [along_x, along_y]: [usize; 2]) -> Option<f64> {
        let (nx, ny) = (self.grid.nx, self.grid.ny);
        let found = moments(self.known())?;
        let (mut sum, mut pairs) = (0.0, 0.0);
        for i in 0..nx.saturating_sub(along_x) {
            for j in 0..ny.saturating_sub(along_y) {
                let ends = [(i, j), (i + along_x, j + along_y)].map(|(i, j)| self.grid.index(i, j));
                let [a, b] = ends.map(|end| self.heights[end] - found.mean);
                if ends.iter().all(|end| self.within[*end]) && !a.is_nan() && !b.is_nan() {
                    sum += a * b;
                    pairs += 1.0;
                }
            }
        }
        (pairs > 0.0 && found.rq > 0.0).then(|| sum / pairs / found.rq.powi(2))
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
