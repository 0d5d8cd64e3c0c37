//! Rigid motion where the elastic cells do not determine it.
//!
//! With one elastic cell, or with elastic cells in a line, the cells do not resist every rotation of the bodies.
//! Without resistance to a rotation, a contact is solved if some rigid motion gives every open cell a gap. The module
//! `settle` minimises the sum of the squares of all violations by Newton's method. The sum of the squares is a convex,
//! piecewise quadratic function. Newton's method shortens each step until the sum of the squares decreases. The
//! remaining violations are a descending pressure step without resultants.

use super::rigid::{Motions, RigidMotions};

/// Bound on Newton steps. Newton's method ends on a piecewise quadratic function.
const MAX_STEPS: usize = 100;

/// Halvings of a step after which the remaining violation counts as rounding.
const MAX_HALVINGS: usize = 30;

/// Condition on the gap of a cell.
pub(super) enum Bound {
    /// The gap must not be negative.
    Open,
    /// The gap must be zero.
    Elastic,
    /// The gap must not be positive.
    Capped,
}

/// Finds the motion, starting from `start`, for which the gaps `residual` − motion on `cells` violate their bounds
/// least.
pub(super) fn least_violation(
    motions: &RigidMotions,
    start: Motions,
    cells: &[usize],
    residual: impl Fn(usize) -> f64,
    bound: impl Fn(usize) -> Bound,
) -> Motions {
    let violation = |motion: &Motions, c: usize| {
        let gap = residual(c) - motions.displacement_at(motion, c);
        match bound(c) {
            Bound::Open => gap.min(0.0),
            Bound::Elastic => gap,
            Bound::Capped => gap.max(0.0),
        }
    };
    let square = |motion: &Motions| -> f64 {
        let squares = cells.iter().map(|&c| violation(motion, c).powi(2));
        squares.sum()
    };
    let mut motion = start;
    let mut least_square = square(&motion);
    for _ in 0..MAX_STEPS {
        let (violated, amounts): (Vec<usize>, Vec<f64>) = cells
            .iter()
            .map(|&c| (c, violation(&motion, c)))
            .filter(|(_, amount)| *amount != 0.0)
            .unzip();
        let resultants = motions.resultants(&violated, &amounts);
        let mut step = motions.with_resultants_or_zero(&violated, resultants);
        let mut descending = None;
        for _ in 0..MAX_HALVINGS {
            let trial = [0, 1, 2].map(|k| motion[k] + step[k]);
            let trial_square = square(&trial);
            if trial_square < least_square {
                descending = Some((trial, trial_square));
                break;
            }
            step = step.map(|s| 0.5 * s);
        }
        let Some(next) = descending else {
            break;
        };
        (motion, least_square) = next;
    }
    motion
}
