//! Layers of finite elements at the joint.

use std::collections::{BTreeMap, HashSet};

use super::OFF;
use crate::linalg::vectors::{dot, minus};
use crate::structure::contact_array::ContactArray;

/// Returns the thicknesses of the element layers above and below the joint, as in most columns of nodes. Without
/// columns, returns the distance of the nearest nodes off the plane.
pub(super) fn layers(
    array: &ContactArray,
    all: &[[f64; 3]],
    origin: [f64; 3],
    axes: [[f64; 3]; 3],
) -> Vec<f64> {
    let sides = array.sides();
    let least = OFF * sides[0].min(sides[1]);
    let inside = |d: usize, v: f64| v.abs() <= 0.5 * array.size[d] + least;
    // Some columns of nodes differ only by rounding. The map is ordered, so that every machine selects the same column.
    let mut columns: BTreeMap<[i64; 3], Vec<f64>> = BTreeMap::new();
    let mut nearest = [f64::INFINITY; 2];
    for p in all {
        let d = minus(*p, origin);
        let [x, y, z] = axes.map(|axis| dot(d, axis));
        if z.abs() <= least || !inside(0, x) || !inside(1, y) {
            continue;
        }
        let is_above = z > 0.0;
        nearest[usize::from(is_above)] = nearest[usize::from(is_above)].min(z.abs());
        // The offset of a quarter step keeps the nodes of a column together: regular positions are not at a rounding
        // limit.
        let step = |v: f64, d: usize| (v / (4.0 * OFF * sides[d]) + 0.25).round() as i64;
        let key = [step(x, 0), step(y, 1), i64::from(is_above)];
        columns.entry(key).or_default().push(z.abs());
    }
    let nodes: HashSet<[i64; 2]> = (array.nodes().iter())
        .map(|(p, _)| [0, 1].map(|d| (p[d] / (4.0 * OFF * sides[d]) + 0.25).round() as i64))
        .collect();
    let mut kinds: Vec<(Vec<f64>, usize)> = Vec::new();
    for (key, mut depths) in columns {
        if !nodes.contains(&[key[0], key[1]]) {
            continue;
        }
        depths.sort_by(f64::total_cmp);
        let is_same = |kind: &(Vec<f64>, usize)| {
            kind.0.len() == depths.len()
                && depths
                    .iter()
                    .zip(&kind.0)
                    .all(|(a, b)| (a - b).abs() < least)
        };
        match kinds.iter_mut().find(|kind| is_same(kind)) {
            Some(kind) => kind.1 += 1,
            None => kinds.push((depths, 1)),
        }
    }
    // The layers of most columns. Ties go to the shorter list, so that the order of a table does not matter.
    let most_common = kinds.into_iter().max_by(|a, b| {
        a.1.cmp(&b.1)
            .then(b.0.len().cmp(&a.0.len()))
            .then(b.0[0].total_cmp(&a.0[0]))
    });
    match most_common {
        Some((depths, _)) => {
            let above = std::iter::once(0.0).chain(depths.iter().copied());
            depths.iter().zip(above).map(|(z, last)| z - last).collect()
        }
        None => {
            let distances: Vec<f64> = nearest.into_iter().filter(|z| z.is_finite()).collect();
            match distances.is_empty() {
                true => Vec::new(),
                false => vec![distances.iter().sum::<f64>() / distances.len() as f64],
            }
        }
    }
}
