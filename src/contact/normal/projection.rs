//! The nearest pressure within its bounds that has given resultants.
//!
//! The minimum of ½|p − t|² over 0 ≤ p ≤ p_max with Σp, Σp y, −Σp x given is p = clip(t + s) with a rigid motion s. With the
//! load alone, Σp grows with s: Newton's method within a bracket. With moments, s is the maximum of a concave,
//! piecewise quadratic function of three unknowns: Newton's method, with a gradient step where it does not come nearer.

use super::rigid::{Motions, RigidMotions};

/// Resultants this close, relative to the load, are met: the rounding of a sum over the cells.
const ROUNDING: f64 = 1e-14;

/// What they may miss where the shift has no digits left.
const SPENT: f64 = 1e-11;

/// Newton's method on a piecewise quadratic function ends; a target that no pressure reaches does not.
const MAX_STEPS: usize = 200;

/// Halvings of a Newton step before a gradient step is taken in its place.
const MAX_HALVINGS: usize = 8;

/// Moves `pressure` on `cells` to the nearest one within [0, `cap`] with the resultants `target`. False if there is none (as
/// far as the bounds let it come, it has then come nearer).
pub(super) fn project(
    motions: &RigidMotions,
    cells: &[usize],
    pressure: &mut [f64],
    cap: f64,
    target: &Motions,
) -> bool {
    if motions.none() {
        for &c in cells {
            pressure[c] = pressure[c].clamp(0.0, cap);
        }
        return true;
    }
    if !motions.rotates() {
        return level(cells, pressure, cap, target[0]);
    }
    let within = ROUNDING * motions.distance(target, &[0.0; 3]);
    let at = |shift: &Motions, pressure: &[f64], c: usize| {
        (pressure[c] + motions.at(shift, c)).clamp(0.0, cap)
    };
    let resultants = |shift: &Motions, pressure: &[f64]| {
        motions.resultants(cells.iter().copied(), |c| at(shift, pressure, c))
    };
    let mut shift = [0.0; 3];
    let mut found = resultants(&shift, pressure);
    let mut met = false;
    for _ in 0..MAX_STEPS {
        let off = motions.distance(&found, target);
        if off <= within {
            met = true;
            break;
        }
        let missing = [0, 1, 2].map(|k| target[k] - found[k]);
        let moving = cells.iter().copied().filter(|&c| {
            let p = pressure[c] + motions.at(&shift, c);
            p > 0.0 && p < cap
        });
        let mut next = None;
        if let Some(step) = motions.with_resultants(moving, missing) {
            let mut part = 1.0;
            for _ in 0..MAX_HALVINGS {
                let trial = [0, 1, 2].map(|k| shift[k] + part * step[k]);
                let there = resultants(&trial, pressure);
                if motions.distance(&there, target) < off {
                    next = Some((trial, there));
                    break;
                }
                part *= 0.5;
            }
        }
        let (trial, there) = match next {
            Some(next) => next,
            None => {
                // As if every cell moved: the step of the largest curvature, which never goes too far.
                let Some(step) = motions.with_resultants(cells.iter().copied(), missing) else {
                    break;
                };
                let trial = [0, 1, 2].map(|k| shift[k] + step[k]);
                (trial, resultants(&trial, pressure))
            }
        };
        if trial == shift {
            // The last digits of the shift are spent.
            met = off <= SPENT / ROUNDING * within;
            break;
        }
        (shift, found) = (trial, there);
    }
    for &c in cells {
        pressure[c] = at(&shift, pressure, c);
    }
    met
}

/// Shifts all pressures alike and cuts them at their bounds, so that their sum is `target`. False if it is out of reach.
fn level(cells: &[usize], pressure: &mut [f64], cap: f64, target: f64) -> bool {
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for &c in cells {
        least = least.min(pressure[c]);
        most = most.max(pressure[c]);
    }
    let (mut low, mut high) = (-most, cap.min(target) - least);
    let mut shift = 0.0f64.clamp(low.min(high), high);
    let mut met = false;
    for _ in 0..MAX_STEPS {
        let (mut sum, mut moving) = (0.0, 0usize);
        for &c in cells {
            let p = pressure[c] + shift;
            if p >= cap {
                sum += cap;
            } else if p > 0.0 {
                sum += p;
                moving += 1;
            }
        }
        let missing = target - sum;
        if missing.abs() <= ROUNDING * target {
            met = true;
            break;
        }
        if missing > 0.0 {
            low = shift;
        } else {
            high = shift;
        }
        let newton = shift + missing / moving as f64;
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        if next == shift || next <= low || next >= high {
            // The last digits of the shift are spent.
            met = missing.abs() <= SPENT * target;
            break;
        }
        shift = next;
    }
    for &c in cells {
        pressure[c] = (pressure[c] + shift).clamp(0.0, cap);
    }
    met
}
