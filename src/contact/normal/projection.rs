//! The nearest pressure within its bounds that has given resultants.
//!
//! The minimum of ½|p − t|² over 0 ≤ p ≤ p_max with Σp, Σp y, −Σp x given is p = clip(t + s) with a rigid motion s. With the
//! load alone, Σp grows with s: Newton's method within a bracket. With moments, s is the minimum of a convex,
//! piecewise quadratic function of three unknowns, whose gradient is what the resultants are too large: Newton's method, with a
//! search along its steps.

use super::rigid::{Motions, RigidMotions};
use crate::contact::sums::{extremes, sums};

/// Resultants this close, relative to the load, are met: the rounding of a sum over the cells.
const ROUNDING: f64 = 1e-14;

/// What they may miss where the shift has no digits left.
const SPENT: f64 = 1e-11;

/// Where a long trial step leaves a shift so large that its last digits are more than the pressures, the shifted pressures have
/// those digits: the search goes on from them.
const REFINEMENTS: usize = 3;

/// Newton's method on a piecewise quadratic function ends; a target that no pressure reaches does not.
const MAX_STEPS: usize = 200;

/// Trials along one Newton step: its length may be wrong by many decades where few of many cells move.
const MAX_TRIALS: usize = 100;

/// Of the stiffness of all cells.
const STIFFENING: f64 = 1e-6;

/// Moves pressures, one a cell of `cells`, to the nearest ones within [0, `cap`] with the resultants `target`. False if there
/// are none (as far as the bounds let them come, they have then come nearer).
pub(super) fn project(
    motions: &RigidMotions,
    cells: &[usize],
    pressure: &mut [f64],
    cap: f64,
    target: &Motions,
) -> bool {
    if motions.none() {
        pressure.iter_mut().for_each(|p| *p = p.clamp(0.0, cap));
        return true;
    }
    let scale = scale(motions, pressure, cap, target);
    let mut off = f64::INFINITY;
    for _ in 0..REFINEMENTS {
        if motions.rotates() {
            let shift;
            (shift, off) = search(motions, cells, pressure, cap, target, scale);
            for (p, &c) in pressure.iter_mut().zip(cells) {
                *p += motions.at(&shift, c);
            }
        } else {
            let shift;
            (shift, off) = level(pressure, cap, target[0]);
            pressure.iter_mut().for_each(|p| *p += shift);
        }
        if off <= SPENT * scale {
            break;
        }
    }
    pressure.iter_mut().for_each(|p| *p = p.clamp(0.0, cap));
    off <= SPENT * scale
}

/// What a resultant is measured by: the target's, or the load of the pressures where the target is no load and no moment.
fn scale(motions: &RigidMotions, pressure: &[f64], cap: f64, target: &Motions) -> f64 {
    let [load] = sums(pressure, pressure, |p, _| [p.clamp(0.0, cap)]);
    let asked = motions.distance(target, &[0.0; 3]);
    if target[0] == 0.0 {
        asked.max(load)
    } else {
        asked
    }
}

/// The rigid motion that brings the cut pressures nearest to their resultants, and how far off those are then.
fn search(
    motions: &RigidMotions,
    cells: &[usize],
    pressure: &[f64],
    cap: f64,
    target: &Motions,
    scale: f64,
) -> (Motions, f64) {
    let resultants = |shift: &Motions| {
        let here = cells.iter().zip(pressure);
        let cut: Vec<f64> = here
            .map(|(&c, p)| (p + motions.at(shift, c)).clamp(0.0, cap))
            .collect();
        motions.resultants(cells, &cut)
    };
    let mut shift = [0.0; 3];
    let mut found = resultants(&shift);
    let mut best = (shift, f64::INFINITY);
    for _ in 0..MAX_STEPS {
        let off = motions.distance(&found, target);
        // What is left is the rounding of the sums.
        let spent = off <= SPENT * scale && off > 0.1 * best.1;
        if off < best.1 {
            best = (shift, off);
        }
        if spent || off <= ROUNDING * scale {
            break;
        }
        let missing = [0, 1, 2].map(|k| target[k] - found[k]);
        let inside = |(c, p): &(&usize, &f64)| {
            let p = **p + motions.at(&shift, **c);
            p > 0.0 && p < cap
        };
        let moving = cells.iter().zip(pressure.iter()).filter(inside);
        let moving: Vec<usize> = moving.map(|(c, _)| *c).collect();
        // Cells that do not tell the motions apart (or none) have a little of the stiffness of all.
        let step = motions
            .with_resultants(&moving, missing)
            .or_else(|| motions.with_resultants_of(&moving, cells, STIFFENING, missing));
        let Some(step) = step else {
            break;
        };
        let Some(next) = along(shift, step, target, &found, resultants) else {
            break;
        };
        (shift, found) = next;
    }
    best
}

/// Follows a step to where the slope of the function has fallen by half: it grows all the way. `None` where digits end.
fn along(
    shift: Motions,
    step: Motions,
    target: &Motions,
    found: &Motions,
    resultants: impl Fn(&Motions) -> Motions,
) -> Option<(Motions, Motions)> {
    let slope = |there: &Motions| {
        (0..3)
            .map(|k| step[k] * (there[k] - target[k]))
            .sum::<f64>()
    };
    let first = slope(found);
    let (mut low, mut high, mut part) = (0.0, f64::INFINITY, 1.0);
    for _ in 0..MAX_TRIALS {
        let trial = [0, 1, 2].map(|k| shift[k] + part * step[k]);
        let there = resultants(&trial);
        let slope = slope(&there);
        if slope.abs() <= 0.5 * first.abs() {
            return (trial != shift).then_some((trial, there));
        }
        if slope > 0.0 {
            high = part;
        } else {
            low = part;
        }
        part = if high.is_finite() {
            0.5 * (low + high)
        } else {
            4.0 * part
        };
    }
    None
}

/// The shift of all pressures alike with which, cut at their bounds, they come nearest to the sum `target`, and how far off
/// that is then.
fn level(pressure: &[f64], cap: f64, target: f64) -> (f64, f64) {
    let (least, most) = extremes(pressure);
    let (mut low, mut high) = (-most, cap.min(target) - least);
    let mut shift = 0.0f64.clamp(low.min(high), high);
    let mut best = (shift, f64::INFINITY);
    for _ in 0..MAX_STEPS {
        let [sum, moving] = sums(pressure, pressure, |p, _| {
            let p = p + shift;
            let above = if p > 0.0 { p } else { 0.0 };
            if above < cap {
                [above, if p > 0.0 { 1.0 } else { 0.0 }]
            } else {
                [cap, 0.0]
            }
        });
        let missing = target - sum;
        if missing.abs() < best.1 {
            best = (shift, missing.abs());
        }
        if missing.abs() <= ROUNDING * target {
            break;
        }
        if missing > 0.0 {
            low = shift;
        } else {
            high = shift;
        }
        let newton = shift + missing / moving;
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        if next == shift || next <= low || next >= high {
            // The last digits of the shift are spent.
            break;
        }
        shift = next;
    }
    best
}
