//! Parameters of the height distribution.

use super::error::SurfaceError;
use crate::grid::Patch;

/// Amplitude parameters of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roughness {
    /// Mean height \[m\].
    pub mean: f64,
    /// Root mean square of the heights about their mean, √m₂ \[m\].
    pub rq: f64,
    /// Skewness m₃ / m₂^(3/2) [A eq. 4.1]; 0 for a flat surface.
    pub sk: f64,
    /// Kurtosis m₄ / m₂² [A eq. 4.2]: 3 for normally distributed heights. For a rough surface, the kurtosis is at least
    /// 1 + sk². For a flat surface, the kurtosis is set to 0.
    pub ku: f64,
}

/// Computes mean, Rq, Sk and Ku over the kept cells.
///
/// `roughness` computes the mean in two passes, from the heights minus the first height. Subtracting the first height
/// avoids rounding errors if the offset of the surface is much larger than the roughness. A constant surface has Rq = 0
/// exactly. The third and fourth moments are in units of Rq, so that the moments do not underflow.
///
/// # Errors
/// [`SurfaceError::Length`], [`SurfaceError::NotFinite`] (a kept cell without a finite height), [`SurfaceError::TooFewCells`]
/// (no kept cell).
pub fn roughness(patch: &Patch, heights: &[f64]) -> Result<Roughness, SurfaceError> {
    check(patch, heights)?;
    let kept = heights
        .iter()
        .zip(&patch.is_in_joint)
        .filter(|(_, kept)| **kept);
    moments(kept.map(|(&h, _)| h)).ok_or(SurfaceError::TooFewCells {
        kept: 0,
        needed: 1,
        purpose: "a statistic",
    })
}

/// Histogram of heights with equally spaced edges.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Edges \[m\], one more than the bins, from the lowest to the highest height.
    pub edges: Vec<f64>,
    /// Number of kept cells in each bin. A height on an inner edge belongs to the upper bin.
    pub counts: Vec<usize>,
}

/// Computes the distribution of the kept heights in `bins` equal bins. All cells of a flat surface are in the
/// first bin.
///
/// # Errors
/// Errors of [`roughness`], and [`SurfaceError::OutOfRange`] for `bins` = 0.
pub fn histogram(patch: &Patch, heights: &[f64], bins: usize) -> Result<Histogram, SurfaceError> {
    check(patch, heights)?;
    if bins == 0 {
        return Err(SurfaceError::OutOfRange {
            name: "bins",
            value: 0.0,
            expected: "at least 1",
        });
    }
    let kept: Vec<f64> = heights
        .iter()
        .zip(&patch.is_in_joint)
        .filter_map(|(&h, &kept)| kept.then_some(h))
        .collect();
    let low = kept.iter().copied().fold(f64::INFINITY, f64::min);
    let high = kept.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if kept.is_empty() {
        return Err(SurfaceError::TooFewCells {
            kept: 0,
            needed: 1,
            purpose: "a histogram",
        });
    }
    let width = (high - low) / bins as f64;
    let mut counts = vec![0; bins];
    for h in kept {
        let bin = if width > 0.0 { (h - low) / width } else { 0.0 };
        counts[(bin as usize).min(bins - 1)] += 1;
    }
    let edges = (0..=bins).map(|k| low + k as f64 * width).collect();
    Ok(Histogram { edges, counts })
}

/// Computes the moments of finite heights; `None` without heights.
pub(super) fn moments(heights: impl Iterator<Item = f64> + Clone) -> Option<Roughness> {
    let origin = heights.clone().next()?;
    let n = heights.clone().count() as f64;
    let shift = heights.clone().map(|h| h - origin).sum::<f64>() / n;
    let deviations = heights.map(|h| (h - origin) - shift);
    // Rounding error of the mean. If the program did not subtract the rounding error of the mean, the third and fourth
    // moments would change.
    let rest = deviations.clone().sum::<f64>() / n;
    let deviations = deviations.map(|d| d - rest);
    let mean = origin + (shift + rest);
    let largest = deviations.clone().fold(0.0, |m: f64, d| m.max(d.abs()));
    if largest == 0.0 {
        return Some(Roughness {
            mean,
            rq: 0.0,
            sk: 0.0,
            ku: 0.0,
        });
    }
    let unit = (deviations
        .clone()
        .map(|d| (d / largest).powi(2))
        .sum::<f64>()
        / n)
        .sqrt();
    let rq = largest * unit;
    let scaled = deviations.map(|d| d / largest / unit);
    Some(Roughness {
        mean,
        rq,
        sk: scaled.clone().map(|z| z * z * z).sum::<f64>() / n,
        ku: scaled.map(|z| (z * z) * (z * z)).sum::<f64>() / n,
    })
}

/// Checks the length of the field, and that every kept height is finite.
pub(super) fn check(patch: &Patch, heights: &[f64]) -> Result<(), SurfaceError> {
    if heights.len() != patch.grid.len() {
        return Err(SurfaceError::Length {
            found: heights.len(),
            expected: patch.grid.len(),
        });
    }
    let bad = heights
        .iter()
        .zip(&patch.is_in_joint)
        .position(|(h, &kept)| kept && !h.is_finite());
    match bad {
        Some(index) => {
            let (i, j) = patch.grid.cell(index);
            Err(SurfaceError::NotFinite {
                i,
                j,
                value: heights[index],
            })
        }
        None => Ok(()),
    }
}
