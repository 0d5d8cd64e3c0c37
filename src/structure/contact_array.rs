//! Positions of the contact elements: an array of equal rectangles over the joint of a structure.

use std::collections::{BTreeMap, HashSet};

use serde::{Deserialize, Serialize};

/// Array of equal rectangles over a joint. Rectangles in a hole or outside the outline are absent.
///
/// A contact element is a rectangle (*faces*) or a grid point between rectangles (*nodes*).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ContactArray {
    /// Sides of the joint along x and y \[m\].
    pub size: [f64; 2],
    /// Numbers of rectangles along x and y.
    pub counts: [usize; 2],
    /// Absent rectangles, as (i, j) along x and y.
    pub absent: Vec<[usize; 2]>,
}

/// Returns the four grid points around a rectangle, counter-clockwise.
pub fn corners_of([i, j]: [usize; 2]) -> [[usize; 2]; 4] {
    [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]]
}

impl ContactArray {
    /// Returns the rectangles that are present, with i along x slow and j along y fast.
    pub fn cells(&self) -> Vec<[usize; 2]> {
        let absent: HashSet<[usize; 2]> = self.absent.iter().copied().collect();
        (0..self.counts[0])
            .flat_map(|i| (0..self.counts[1]).map(move |j| [i, j]))
            .filter(|cell| !absent.contains(cell))
            .collect()
    }

    /// Returns the sides of a rectangle \[m\].
    pub fn sides(&self) -> [f64; 2] {
        [0, 1].map(|d| self.size[d] / self.counts[d] as f64)
    }

    /// Returns the area of a rectangle \[m²\].
    pub fn cell_area(&self) -> f64 {
        self.size[0] * self.size[1] / (self.counts[0] * self.counts[1]) as f64
    }

    /// Converts grid coordinates to a position (x, y) \[m\]. Grid coordinates count rectangles from the corner of the
    /// joint. The origin of the position is the centre of the joint.
    pub fn position_at(&self, [i, j]: [f64; 2]) -> [f64; 2] {
        let sides = self.sides();
        [
            (i - 0.5 * self.counts[0] as f64) * sides[0],
            (j - 0.5 * self.counts[1] as f64) * sides[1],
        ]
    }

    /// Returns the centre \[m\] and the area \[m²\] of each of [`Self::cells`].
    pub fn faces(&self) -> Vec<([f64; 2], f64)> {
        let centre = |cell: [usize; 2]| self.position_at(cell.map(|k| k as f64 + 0.5));
        let cells = self.cells().into_iter();
        cells.map(|cell| (centre(cell), self.cell_area())).collect()
    }

    /// Returns the position \[m\] and the area \[m²\] of each grid point (i, j). The index j along y runs faster than
    /// the index i along x.
    ///
    /// The area is a quarter of each present rectangle around the point. The function skips grid points without a
    /// present rectangle.
    pub fn nodes(&self) -> Vec<([f64; 2], f64)> {
        let mut faces: BTreeMap<[usize; 2], f64> = BTreeMap::new();
        for corner in self.cells().into_iter().flat_map(corners_of) {
            *faces.entry(corner).or_default() += 1.0;
        }
        let nodes = faces.into_iter().map(|(node, faces)| {
            let place = self.position_at(node.map(|k| k as f64));
            (place, 0.25 * faces * self.cell_area())
        });
        nodes.collect()
    }
}
