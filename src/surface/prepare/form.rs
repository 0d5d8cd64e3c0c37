//! Form of a whole height map: the tilt and the curvature of the map.

use super::detrend::{self, Polynomial};
use crate::grid::Grid;
use crate::surface::topography::Topography;

/// Tilt and curvature of a map, by least squares over its measured points.
pub struct Form {
    /// Rise of the mean plane from end to end along x and y \[m\].
    pub rise: [f64; 2],
    /// Height of the ends above the middle along x and y in the mean paraboloid \[m\].
    pub bow: [f64; 2],
    plane: Polynomial,
    grid: Grid,
}

impl Form {
    /// Fits the form of a map. Returns `None` if the points of the map do not determine a paraboloid.
    pub fn fit(map: &Topography) -> Option<Form> {
        let [dx, dy] = map.spacing.unwrap_or([1.0; 2]);
        let grid = Grid {
            nx: map.nx,
            ny: map.ny,
            dx,
            dy,
        };
        let plane = detrend::fit(&grid, &map.heights, 1)?;
        let [_, along_x, along_y, ..] = plane.coefficients;
        let paraboloid = detrend::fit(&grid, &map.heights, 2)?;
        let [_, _, _, bow_x, _, bow_y] = paraboloid.coefficients;
        Some(Form {
            rise: [2.0 * along_x, 2.0 * along_y],
            bow: [bow_x, bow_y],
            plane,
            grid,
        })
    }

    /// Returns the heights of the map minus its mean plane \[m\].
    pub fn without_plane(&self, map: &Topography) -> Vec<f64> {
        let points = map.heights.iter().enumerate();
        points
            .map(|(index, h)| h - self.plane.at(&self.grid, index))
            .collect()
    }
}
