//! Measured height map, as read from a file.

use super::statistics::{Roughness, moments};

/// Heights of a measured surface on a regular grid of points.
///
/// **Axes**, the same for every file format: the first index i runs along x, the second index j along y. The height of
/// point (i, j) is at `i * ny + j`, as in the fields of a [`Grid`](crate::grid::Grid). Each point represents a cell of
/// the size `dx` by `dy` around the point. A map of nx points along x has the length nx·dx. X3P, SUR, SDF and AL3D
/// files store lines of constant y with x running fastest. Text below a header of Gwyddion or SPIP has the same order.
/// The readers transpose heights that are stored in lines of constant y. The readers do not transpose NPY arrays and
/// other text matrices. Axis 0 of an NPY array is x, and each line of a text matrix has one x.
#[derive(Debug, Clone, PartialEq)]
pub struct Topography {
    /// Points along x.
    pub nx: usize,
    /// Points along y.
    pub ny: usize,
    /// Distance between points along x and y \[m\], if the file states it.
    pub spacing: Option<[f64; 2]>,
    /// Heights \[m\], positive out of the material; NaN where nothing was measured (a hole).
    pub heights: Vec<f64>,
}

impl Topography {
    /// Returns the number of points without a height.
    pub fn holes(&self) -> usize {
        self.heights.iter().filter(|h| h.is_nan()).count()
    }

    /// Returns the map with x and y exchanged.
    pub fn transposed(&self) -> Topography {
        let points = (0..self.heights.len())
            .map(|index| self.heights[(index % self.nx) * self.ny + index / self.nx]);
        Topography {
            nx: self.ny,
            ny: self.nx,
            spacing: self.spacing.map(|[dx, dy]| [dy, dx]),
            heights: points.collect(),
        }
    }

    /// Returns the map mirrored along x: h(Lx − x, y).
    pub fn mirrored_along_x(&self) -> Topography {
        let lines = self.heights.chunks_exact(self.ny).rev();
        Topography {
            heights: lines.flatten().copied().collect(),
            ..self.clone()
        }
    }

    /// Returns the map mirrored along y: h(x, Ly − y).
    pub fn mirrored_along_y(&self) -> Topography {
        let lines = self.heights.chunks_exact(self.ny);
        let points = lines.flat_map(|line| line.iter().rev());
        Topography {
            heights: points.copied().collect(),
            ..self.clone()
        }
    }

    /// Returns the lengths of the sides \[m\], if the spacing is known.
    pub fn size(&self) -> Option<[f64; 2]> {
        self.spacing
            .map(|[dx, dy]| [self.nx as f64 * dx, self.ny as f64 * dy])
    }

    /// Returns mean, Rq, Sk and Ku of the heights at the measured points, without levelling. Returns `None` if the
    /// topography has no measured point.
    pub fn roughness(&self) -> Option<Roughness> {
        moments(self.heights.iter().copied().filter(|h| !h.is_nan()))
    }
}
