//! Projection of a pressure onto the admissible pressures that have the prescribed resultants.
//!
//! The projection minimises ½|p − t|² over 0 ≤ p ≤ p_max with prescribed Σp, Σp y and −Σp x. A rigid motion s gives the
//! minimum p = clip(t + s). If only the load is given, Σp grows with s, and Newton's method within a bracket finds s.
//! If moments are given, s minimises a convex, piecewise quadratic function of three unknowns. The gradient of the
//! function is the excess of the resultants. Newton's method with a line search finds the minimum of the function.

use super::rigid::{Motions, RigidMotions};
use crate::contact::sums::{extremes, sums};

/// Largest error of the resultants that counts as zero, relative to the load. `ROUNDING` is the rounding error of a sum
/// over the cells.
const ROUNDING: f64 = 1e-14;

/// Largest accepted error of the resultants, relative to the load, if rounding of the shift prevents a smaller error.
const ROUNDED_TOLERANCE: f64 = 1e-11;

/// Number of restarts of the search. A long trial step can need a shift so large that the rounding of the shift exceeds
/// the pressures. The search restarts from the shifted pressures, which contain the rounding of the shift.
const REFINEMENTS: usize = 3;

/// Bound on Newton steps. The method ends on a piecewise quadratic function, unless no pressure reaches the target.
const MAX_STEPS: usize = 200;

/// Bound on trials along one Newton step. If few of many cells move, the length of the Newton step may be wrong by many
/// orders of magnitude.
const MAX_TRIALS: usize = 100;

/// Fraction of the stiffness of all cells that is added if the moving cells do not determine the motions.
const REGULARISATION: f64 = 1e-6;

/// Replaces `pressure` by the nearest pressures within [0, `cap`] that have the resultants `target`. `pressure` has one
/// value per cell of `cells`. Returns false if no pressures within [0, `cap`] have the resultants `target`. The
/// pressures then come as near to `target` as [0, `cap`] permits.
pub(super) fn project(
    motions: &RigidMotions,
    cells: &[usize],
    pressure: &mut [f64],
    cap: f64,
    target: &Motions,
) -> bool {
    if motions.is_empty() {
        pressure.iter_mut().for_each(|p| *p = p.clamp(0.0, cap));
        return true;
    }
    let scale = scale(motions, pressure, cap, target);
    let mut error = f64::INFINITY;
    for _ in 0..REFINEMENTS {
        if motions.rotates() {
            let shift;
            (shift, error) = rigid_shift(motions, cells, pressure, cap, target, scale);
            for (p, &c) in pressure.iter_mut().zip(cells) {
                *p += motions.displacement_at(&shift, c);
            }
        } else {
            let shift;
            (shift, error) = uniform_shift(pressure, cap, target[0]);
            pressure.iter_mut().for_each(|p| *p += shift);
        }
        if error <= ROUNDED_TOLERANCE * scale {
            break;
        }
    }
    pressure.iter_mut().for_each(|p| *p = p.clamp(0.0, cap));
    error <= ROUNDED_TOLERANCE * scale
}

/// Returns the scale of the resultants, which is the size of the target. If the target has no load, the scale is at
/// least the load of the pressures.
fn scale(motions: &RigidMotions, pressure: &[f64], cap: f64, target: &Motions) -> f64 {
    let [load] = sums(pressure, pressure, |p, _| [p.clamp(0.0, cap)]);
    let target_size = motions.distance(target, &[0.0; 3]);
    if target[0] == 0.0 {
        target_size.max(load)
    } else {
        target_size
    }
}

/// Finds the rigid motion that brings the clipped pressures nearest to the required resultants. Returns the rigid
/// motion and the remaining error of the resultants.
fn rigid_shift(
    motions: &RigidMotions,
    cells: &[usize],
    pressure: &[f64],
    cap: f64,
    target: &Motions,
    scale: f64,
) -> (Motions, f64) {
    let resultants = |shift: &Motions| {
        let pairs = cells.iter().zip(pressure);
        let clipped: Vec<f64> = pairs
            .map(|(&c, p)| (p + motions.displacement_at(shift, c)).clamp(0.0, cap))
            .collect();
        motions.resultants(cells, &clipped)
    };
    let mut shift = [0.0; 3];
    let mut current = resultants(&shift);
    let mut best = (shift, f64::INFINITY);
    for _ in 0..MAX_STEPS {
        let error = motions.distance(&current, target);
        // Further steps would only reduce the rounding of the sums.
        let is_rounding = error <= ROUNDED_TOLERANCE * scale && error > 0.1 * best.1;
        if error < best.1 {
            best = (shift, error);
        }
        if is_rounding || error <= ROUNDING * scale {
            break;
        }
        let missing = [0, 1, 2].map(|k| target[k] - current[k]);
        let inside = |(c, p): &(&usize, &f64)| {
            let p = **p + motions.displacement_at(&shift, **c);
            p > 0.0 && p < cap
        };
        let moving = cells.iter().zip(pressure.iter()).filter(inside);
        let moving: Vec<usize> = moving.map(|(c, _)| *c).collect();
        // If the moving cells do not determine the motions, add a little of the stiffness of all cells.
        let step = motions.with_resultants(&moving, missing).or_else(|| {
            motions.with_regularised_resultants(&moving, cells, REGULARISATION, missing)
        });
        let Some(step) = step else {
            break;
        };
        let Some(next) = line_search(shift, step, target, &current, resultants) else {
            break;
        };
        (shift, current) = next;
    }
    best
}

/// Searches along `step` until the slope of the function is at most half of the first slope, in magnitude. The slope
/// increases along `step`. Returns `None` if rounding prevents the line search from halving the slope.
fn line_search(
    shift: Motions,
    step: Motions,
    target: &Motions,
    start: &Motions,
    resultants: impl Fn(&Motions) -> Motions,
) -> Option<(Motions, Motions)> {
    let slope = |trial_resultants: &Motions| {
        (0..3)
            .map(|k| step[k] * (trial_resultants[k] - target[k]))
            .sum::<f64>()
    };
    let first = slope(start);
    let (mut low, mut high, mut part) = (0.0, f64::INFINITY, 1.0);
    for _ in 0..MAX_TRIALS {
        let trial = [0, 1, 2].map(|k| shift[k] + part * step[k]);
        let trial_resultants = resultants(&trial);
        let slope = slope(&trial_resultants);
        if slope.abs() <= 0.5 * first.abs() {
            return (trial != shift).then_some((trial, trial_resultants));
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

/// Finds the uniform shift with which the clipped pressures come nearest to the sum `target`. Returns the shift and the
/// remaining error of the sum.
fn uniform_shift(pressure: &[f64], cap: f64, target: f64) -> (f64, f64) {
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
            // The shift has no digits left.
            break;
        }
        shift = next;
    }
    best
}
