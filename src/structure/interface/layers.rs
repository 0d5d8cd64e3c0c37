//! Layers of finite elements at a joint.

use std::collections::{BTreeMap, HashSet};

use super::OFF;
use crate::linalg::vectors::{dot, minus};
use crate::structure::contact_array::ContactArray;

/// Thickness of the layers of nodes above and below the joint, as most columns of nodes have them; where there are no columns, the distance of
/// the nearest nodes off the plane.
pub(super) fn layers(
    array: &ContactArray,
    all: &[[f64; 3]],
    origin: [f64; 3],
    axes: [[f64; 3]; 3],
) -> Vec<f64> {
    let sides = array.sides();
    let least = OFF * sides[0].min(sides[1]);
    let inside = |d: usize, v: f64| v.abs() <= 0.5 * array.size[d] + least;
    // Ordered, so that of columns that differ by rounding the same one stands for all on every machine.
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
        // A quarter of a step off whole ones: nodes of a column must not be told apart by rounding.
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
    // Those of most columns; of equally many the shorter ones, so that the order of a table does not matter.
    let usual = kinds.into_iter().max_by(|a, b| {
        a.1.cmp(&b.1)
            .then(b.0.len().cmp(&a.0.len()))
            .then(b.0[0].total_cmp(&a.0[0]))
    });
    match usual {
        Some((depths, _)) => {
            let above = std::iter::once(0.0).chain(depths.iter().copied());
            depths.iter().zip(above).map(|(z, last)| z - last).collect()
        }
        None => {
            let found: Vec<f64> = nearest.into_iter().filter(|z| z.is_finite()).collect();
            match found.is_empty() {
                true => Vec::new(),
                false => vec![found.iter().sum::<f64>() / found.len() as f64],
            }
        }
    }
}
