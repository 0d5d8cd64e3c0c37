//! Weights of nodes in the displacement of a contact element.

use super::{LINE, OFF};

/// Reach of the weights around a contact element, in sides of the array: the first that has nodes enough.
const REACHES: [f64; 5] = [1.0, 1.5, 2.0, 3.0, 4.5];
/// A weight below this share of the largest is that of rounding.
const NO_WEIGHT: f64 = 1e-9;
/// A weight may be as far below zero as this share of the sum of all.
const NEGATIVE: f64 = -0.5;

/// Weights of the nodes around a place: a tent over the array's sides times the area of each, made to reproduce what is linear.
pub(super) fn around(
    place: [f64; 2],
    sides: [f64; 2],
    points: &[[f64; 2]],
    areas: &[f64],
) -> Option<Vec<(usize, f64)>> {
    REACHES.iter().find_map(|reach| {
        let tent =
            |d: usize, p: &[f64; 2]| (1.0 - (p[d] - place[d]).abs() / (reach * sides[d])).max(0.0);
        let area = |n: usize| areas.get(n).copied().unwrap_or(1.0);
        let tents: Vec<(usize, f64)> = (points.iter().enumerate())
            .map(|(n, p)| (n, tent(0, p) * tent(1, p) * area(n)))
            .filter(|w| w.1 > 0.0)
            .collect();
        let largest = tents.iter().fold(0.0, |a: f64, w| a.max(w.1));
        let tents: Vec<(usize, f64)> = (tents.into_iter())
            .filter(|w| w.1 > NO_WEIGHT * largest)
            .collect();
        let sum: f64 = tents.iter().map(|w| w.1).sum();
        if tents.is_empty() {
            return None;
        }
        // In sides of the array.
        let off = |n: usize| [0, 1].map(|d| (points[n][d] - place[d]) / sides[d]);
        let middle = [0, 1].map(|d| tents.iter().map(|&(n, w)| w * off(n)[d]).sum::<f64>() / sum);
        if middle.iter().all(|m| m.abs() < OFF) {
            return Some(tents.iter().map(|&(n, w)| (n, w / sum)).collect());
        }
        let moment = |a: usize, b: usize| {
            let each = tents.iter();
            each.map(|&(n, w)| w * (off(n)[a] - middle[a]) * (off(n)[b] - middle[b]))
                .sum::<f64>()
                / sum
        };
        let (xx, xy, yy) = (moment(0, 0), moment(0, 1), moment(1, 1));
        let (trace, determinant) = (xx + yy, xx * yy - xy * xy);
        // A single node has no moments.
        if determinant <= LINE * trace * trace {
            return None;
        }
        let slope = [
            (yy * middle[0] - xy * middle[1]) / determinant,
            (xx * middle[1] - xy * middle[0]) / determinant,
        ];
        let weights: Vec<(usize, f64)> = (tents.iter())
            .map(|&(n, w)| {
                let d = [0, 1].map(|k| off(n)[k] - middle[k]);
                (n, w / sum * (1.0 - slope[0] * d[0] - slope[1] * d[1]))
            })
            .collect();
        let below: f64 = weights.iter().map(|w| w.1.min(0.0)).sum();
        (below > NEGATIVE).then_some(weights)
    })
}
