//! Nodes that are the corners of equal rectangles, and rectangles that are near no node.

use std::collections::HashSet;

use super::OFF;
use crate::structure::contact_array::{ContactArray, corners_of};

/// A rectangle belongs to the joint if its centre is nearer to a node than this times the root of the area of that node: in an array of
/// squares the corners of one are 0.71 of it from its centre.
const COVERED: f64 = 0.75;
/// Nodes next to one, in an array of squares.
const AROUND: usize = 4;

/// Least and most of points along x and along y.
pub(super) fn span(points: &[[f64; 2]]) -> [[f64; 2]; 2] {
    [0, 1].map(|d| {
        let values = || points.iter().map(|p| p[d]);
        [
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        ]
    })
}

/// Nodes that are the corners of equal rectangles.
pub(super) struct Lattice {
    pub counts: [usize; 2],
    there: HashSet<[usize; 2]>,
}

impl Lattice {
    /// `None` where they are not, or a node belongs to no rectangle.
    pub fn of(points: &[[f64; 2]]) -> Option<Lattice> {
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
        // An array has holes at most; nodes in disorder have about as many levels as there are nodes.
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
        let lattice = Lattice { counts, there };
        let used: HashSet<[usize; 2]> = (lattice.cells()).flat_map(corners_of).collect();
        (used.len() == lattice.there.len()).then_some(lattice)
    }

    /// Rectangles with all four corners.
    fn cells(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        self.all().filter(|cell| self.is_there(*cell))
    }

    fn all(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let counts = self.counts;
        (0..counts[0]).flat_map(move |i| (0..counts[1]).map(move |j| [i, j]))
    }

    fn is_there(&self, cell: [usize; 2]) -> bool {
        let corners = corners_of(cell);
        corners.iter().all(|corner| self.there.contains(corner))
    }

    pub fn absent(&self) -> Vec<[usize; 2]> {
        self.all().filter(|cell| !self.is_there(*cell)).collect()
    }
}

/// Rectangles whose centre is near no node. `centre` is the middle of the joint.
pub(super) fn uncovered(
    array: &ContactArray,
    points: &[[f64; 2]],
    centre: [f64; 2],
) -> Vec<[usize; 2]> {
    let distance =
        |a: [f64; 2], b: [f64; 2]| ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt();
    // The area of a node as a square as wide as the way to the last of those next to it.
    let reach: Vec<f64> = (points.iter().enumerate())
        .map(|(n, p)| {
            let others = points.iter().enumerate().filter(|(m, _)| *m != n);
            let mut ways: Vec<f64> = others.map(|(_, q)| distance(*p, *q)).collect();
            ways.sort_by(f64::total_cmp);
            COVERED * ways[AROUND.min(ways.len()) - 1]
        })
        .collect();
    let sides = array.sides();
    let all = (0..array.counts[0]).flat_map(|i| (0..array.counts[1]).map(move |j| [i, j]));
    all.filter(|&cell| {
        let at = array.place(cell.map(|k| k as f64 + 0.5));
        let at = [at[0] + centre[0], at[1] + centre[1]];
        // A rectangle coarser than the nodes is covered as far as half its side.
        let own = 0.5 * sides[0].min(sides[1]);
        !points
            .iter()
            .zip(&reach)
            .any(|(p, reach)| distance(*p, at) <= reach.max(own))
    })
    .collect()
}
