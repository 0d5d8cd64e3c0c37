//! Detection of nodes that are the corners of equal rectangles, and of rectangles without nodes nearby.

use std::collections::HashSet;

use super::OFF;
use crate::structure::contact_array::{ContactArray, corners_of};

/// A rectangle belongs to the joint if a node is near its centre. The limit of the distance is `COVERED` times the
/// square root of the area of the node. In an array of squares, the distance from a corner to the centre is 0.71 times
/// the side of a square.
const COVERED: f64 = 0.75;
/// Number of neighbours of a node in an array of squares.
const AROUND: usize = 4;

/// Returns the minimum and maximum of the points along x and along y.
pub(super) fn span(points: &[[f64; 2]]) -> [[f64; 2]; 2] {
    [0, 1].map(|d| {
        let values = || points.iter().map(|p| p[d]);
        [
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        ]
    })
}

/// Array of nodes that are the corners of equal rectangles.
pub(super) struct Lattice {
    pub counts: [usize; 2],
    grid_points: HashSet<[usize; 2]>,
}

impl Lattice {
    /// Finds the array of the nodes. Returns `None` if the nodes form no array, or if a node belongs to no rectangle.
    pub fn detect(points: &[[f64; 2]]) -> Option<Lattice> {
        let span = span(points);
        let mut counts = [0_usize; 2];
        for d in 0..2 {
            let [least, most] = span[d];
            let mut values: Vec<f64> = points.iter().map(|p| p[d]).collect();
            values.sort_by(f64::total_cmp);
            let mut levels = 1;
            let mut last = values[0];
            for &value in &values {
                if value - last > OFF * (most - least) / (points.len() as f64).sqrt() {
                    levels += 1;
                    last = value;
                }
            }
            counts[d] = levels - 1;
        }
        // An array with holes has fewer nodes than grid points. Unordered nodes have about as many levels as nodes.
        let places = (counts[0] + 1).checked_mul(counts[1] + 1)?;
        if counts.contains(&0) || places > 8 * points.len() {
            return None;
        }
        let mut there = HashSet::new();
        for p in points {
            let place = [0, 1].map(|d| {
                let [least, most] = span[d];
                (p[d] - least) / (most - least) * counts[d] as f64
            });
            if place.iter().any(|v| (v - v.round()).abs() > OFF) {
                return None;
            }
            if !there.insert(place.map(|v| v.round() as usize)) {
                return None;
            }
        }
        let lattice = Lattice {
            counts,
            grid_points: there,
        };
        let used: HashSet<[usize; 2]> = (lattice.cells()).flat_map(corners_of).collect();
        (used.len() == lattice.grid_points.len()).then_some(lattice)
    }

    /// Returns the rectangles with all four corners.
    fn cells(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        self.all().filter(|cell| self.has_all_corners(*cell))
    }

    fn all(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let counts = self.counts;
        (0..counts[0]).flat_map(move |i| (0..counts[1]).map(move |j| [i, j]))
    }

    fn has_all_corners(&self, cell: [usize; 2]) -> bool {
        let corners = corners_of(cell);
        corners
            .iter()
            .all(|corner| self.grid_points.contains(corner))
    }

    pub fn absent(&self) -> Vec<[usize; 2]> {
        self.all()
            .filter(|cell| !self.has_all_corners(*cell))
            .collect()
    }
}

/// Returns the rectangles whose centre is near no node. `centre` is the middle of the joint in the axes of `points`.
pub(super) fn uncovered_cells(
    array: &ContactArray,
    points: &[[f64; 2]],
    centre: [f64; 2],
) -> Vec<[usize; 2]> {
    let distance =
        |a: [f64; 2], b: [f64; 2]| ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt();
    // The area of a node is a square as wide as the distance to the fourth nearest node.
    let reach: Vec<f64> = (points.iter().enumerate())
        .map(|(n, p)| {
            let others = points.iter().enumerate().filter(|(m, _)| *m != n);
            let mut distances: Vec<f64> = others.map(|(_, q)| distance(*p, *q)).collect();
            distances.sort_by(f64::total_cmp);
            COVERED * distances[AROUND.min(distances.len()) - 1]
        })
        .collect();
    let sides = array.sides();
    let all = (0..array.counts[0]).flat_map(|i| (0..array.counts[1]).map(move |j| [i, j]));
    all.filter(|&cell| {
        let at = array.position_at(cell.map(|k| k as f64 + 0.5));
        let at = [at[0] + centre[0], at[1] + centre[1]];
        // If the rectangles are coarser than the nodes, the reach is half a side of the rectangle.
        let half_side = 0.5 * sides[0].min(sides[1]);
        !points
            .iter()
            .zip(&reach)
            .any(|(p, reach)| distance(*p, at) <= reach.max(half_side))
    })
    .collect()
}
