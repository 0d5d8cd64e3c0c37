//! The rigid motion where the elastic cells do not determine it.
//!
//! On one cell, or on cells in a line, bodies that are free to turn are held by resultants alone: whether the contact is solved
//! depends on whether some motion leaves every open cell a gap. The motion taken is that of the least squares of all violations,
//! the minimum of a convex, piecewise quadratic function: Newton's method, each step shortened until it descends. Where it leaves
//! violations, these are a pressure step without resultants that descends.

use super::rigid::{Motions, RigidMotions};

/// Newton's method on a piecewise quadratic function ends.
const MAX_STEPS: usize = 100;

/// Halvings of a step before what is left is taken for rounding.
const MAX_HALVINGS: usize = 30;

/// What a gap has to be on a cell.
pub(super) enum Bound {
    /// Not negative.
    Open,
    /// None.
    Elastic,
    /// Not positive.
    Capped,
}

/// The motion, found from `start`, that leaves the gaps `residual` − motion on `cells` the least violation of their bounds.
pub(super) fn least_violation(
    motions: &RigidMotions,
    start: Motions,
    cells: &[usize],
    residual: impl Fn(usize) -> f64,
    bound: impl Fn(usize) -> Bound,
) -> Motions {
    let violation = |motion: &Motions, c: usize| {
        let gap = residual(c) - motions.at(motion, c);
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
    let mut worst = square(&motion);
    for _ in 0..MAX_STEPS {
        let (violated, by): (Vec<usize>, Vec<f64>) = cells
            .iter()
            .map(|&c| (c, violation(&motion, c)))
            .filter(|(_, by)| *by != 0.0)
            .unzip();
        let resultants = motions.resultants(&violated, &by);
        let mut step = motions.determined(&violated, resultants);
        let mut shorter = None;
        for _ in 0..MAX_HALVINGS {
            let trial = [0, 1, 2].map(|k| motion[k] + step[k]);
            let there = square(&trial);
            if there < worst {
                shorter = Some((trial, there));
                break;
            }
            step = step.map(|s| 0.5 * s);
        }
        let Some(next) = shorter else {
            break;
        };
        (motion, worst) = next;
    }
    motion
}
