//! Weights of the nodes in the displacement of a contact element.

use super::{LINE, OFF};

/// Radii of the weights around a contact element, in sides of the array. The first radius with enough nodes is used.
const REACHES: [f64; 5] = [1.0, 1.5, 2.0, 3.0, 4.5];
/// The interpolation ignores a weight below `NO_WEIGHT` times the largest weight, because of rounding.
const NO_WEIGHT: f64 = 1e-9;
/// Limit of the sum of the negative weights. All weights sum to one.
const NEGATIVE: f64 = -0.5;

/// Computes the weights of the nodes around a place. A weight is a tent function times the area of the node. The
/// weights are corrected so that the weighted mean of a linear function is exact.
pub(super) fn node_weights(
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
        // Offset from the place in sides of the array.
        let offset = |n: usize| [0, 1].map(|d| (points[n][d] - place[d]) / sides[d]);
        let centroid =
            [0, 1].map(|d| tents.iter().map(|&(n, w)| w * offset(n)[d]).sum::<f64>() / sum);
        if centroid.iter().all(|m| m.abs() < OFF) {
            return Some(tents.iter().map(|&(n, w)| (n, w / sum)).collect());
        }
        let moment = |a: usize, b: usize| {
            let each = tents.iter();
            each.map(|&(n, w)| w * (offset(n)[a] - centroid[a]) * (offset(n)[b] - centroid[b]))
                .sum::<f64>()
                / sum
        };
        let (xx, xy, yy) = (moment(0, 0), moment(0, 1), moment(1, 1));
        let (trace, determinant) = (xx + yy, xx * yy - xy * xy);
        // One node, or nodes on a line, cannot reproduce linear functions.
        if determinant <= LINE * trace * trace {
            return None;
        }
        let slope = [
            (yy * centroid[0] - xy * centroid[1]) / determinant,
            (xx * centroid[1] - xy * centroid[0]) / determinant,
        ];
        let weights: Vec<(usize, f64)> = (tents.iter())
            .map(|&(n, w)| {
                let d = [0, 1].map(|k| offset(n)[k] - centroid[k]);
                (n, w / sum * (1.0 - slope[0] * d[0] - slope[1] * d[1]))
            })
            .collect();
        let negative_sum: f64 = weights.iter().map(|w| w.1.min(0.0)).sum();
        (negative_sum > NEGATIVE).then_some(weights)
    })
}
