//! One iteration: the preconditioned direction, a descending trial step, and the minimum on the chord to it.

use super::super::projection::project;
use super::super::rigid::{Motions, RigidMotions};
use super::{NOISE, Solver, snap};
use crate::contact::cells::{gather, scatter};
use crate::contact::sums::{dot, extremes, sums};

/// Smallest slope of a descending chord, divided by the sum of the magnitudes of the terms in the slope. A smaller
/// slope is rounding.
const LEAST_SLOPE: f64 = 1e-12;

/// Number of trials along one direction, each a quarter as long as the one before. A simpler direction follows.
const TRIALS: usize = 3;

/// Largest length of a step along a bent chord, as a multiple of the chord. The rounding of the resultants grows by the
/// same multiple.
const EXTENSION: f64 = 4.0;

/// Fraction of a bent chord. If the minimum of the energy lies beyond the fraction `WHOLE_CHORD_FRACTION`, the solver
/// takes the whole chord. With the whole chord, the opening cells open fully, and the step loses hardly any descent.
const WHOLE_CHORD_FRACTION: f64 = 0.8;

/// Bounds on the length of a trial step along a preconditioned direction, whose natural length is one. If the
/// projection cuts off most of a step, no length is best, and the prediction would diverge.
const LENGTHS: (f64, f64) = (1e-3, 4.0);

/// Multiple of a bent chord. A minimum beyond this multiple of the chord shows that bounds have cut off most of the
/// step.
const CUT_OFF_RATIO: f64 = 8.0;

/// Bound on the length of a long step along the gradient, in units of 1/λ.
const LONGEST_GRADIENT_STEP: f64 = 1e6;

/// Trial step that descends.
struct Trial {
    way: SearchDirection,
    length: f64,
    /// True if the step was projected.
    is_projected: bool,
}

/// Direction of a trial step.
#[derive(Clone, Copy, PartialEq)]
enum SearchDirection {
    Conjugate,
    Preconditioned,
    Gradient,
    /// The gradient on all cells, so far that most of them reach a bound.
    Long,
}

impl Solver<'_, '_> {
    /// Performs one iteration. Returns false if no direction descends, so that only rounding is left.
    pub(super) fn advance(&mut self) -> bool {
        let long = self.long_trial();
        if long.is_none() {
            self.precondition();
        }
        let Some(Trial {
            way,
            length,
            is_projected: bent,
        }) = long.or_else(|| self.descending_trial())
        else {
            return false;
        };
        scatter(&self.on_free.step, &self.free, &mut self.step);
        self.half_space.normal(&self.step, &mut self.image);
        if let Some(d) = self.problem.compliance {
            for (&c, step) in self.free.iter().zip(&self.on_free.step) {
                self.image[c] += d[c] * step;
            }
        }
        let values = &mut self.on_free;
        gather(&self.image, &self.free, &mut values.image);
        let slope = -dot(&values.step, &values.gap);
        let curvature = dot(&values.step, &values.image);
        let mut reach = f64::INFINITY;
        for (p, step) in values.pressure.iter().zip(&values.step) {
            let room = if *step < 0.0 { *p } else { self.cap - p };
            let part = room / step.abs();
            // A zero step gives an infinite part, or NaN on a bound. The comparison `part < reach` ignores infinity and
            // NaN.
            reach = if part < reach { part } else { reach };
        }
        let best = if curvature > 0.0 {
            slope / curvature
        } else {
            f64::INFINITY
        };
        let part = if bent && (WHOLE_CHORD_FRACTION..1.0).contains(&best) {
            1.0
        } else {
            best.min(reach)
                .min(if bent { EXTENSION } else { f64::INFINITY })
        };
        if !part.is_finite() {
            return false;
        }
        for (p, step) in values.pressure.iter_mut().zip(&values.step) {
            *p += part * step;
        }
        let largest_held = if self.capped_cells.is_empty() {
            0.0
        } else {
            self.cap
        };
        snap(&mut values.pressure, self.cap, largest_held);
        scatter(&values.pressure, &self.free, &mut self.pressure);
        self.move_residual(part);
        // If the solver takes only a part of the chord, the cells that the trial would open stay closed. A shorter
        // trial opens the cells that stay closed.
        let along_gradient = matches!(way, SearchDirection::Gradient | SearchDirection::Long);
        let length = match along_gradient {
            true => length * self.half_space.self_compliance(),
            false => length,
        };
        let cut_off = bent && best.is_finite() && best > CUT_OFF_RATIO;
        self.long_step_length = cut_off.then_some(length * best);
        match way {
            SearchDirection::Conjugate | SearchDirection::Preconditioned => {
                self.predicted = (length * best).clamp(LENGTHS.0, LENGTHS.1)
            }
            SearchDirection::Gradient => {
                self.predicted_gradient = (length * best).clamp(LENGTHS.0, 1.0)
            }
            // A long step does not predict the length of a step on the free cells.
            SearchDirection::Long => (),
        }
        self.iterations += 1;
        true
    }

    /// Computes the preconditioned gap and the conjugate direction on the free cells, both without resultants.
    fn precondition(&mut self) {
        let values = &mut self.on_free;
        gather(&self.pressure, &self.free, &mut values.pressure);
        gather(&self.step, &self.free, &mut values.direction);
        gather(&self.image, &self.free, &mut values.image);
        // The gap stays unchanged if too few cells determine the motions, or if no motion is unknown.
        without_resultants(&self.motions, &self.free, &mut values.gap);
        // The last step is no longer needed. Field `step` now carries the input of the transform, and field `image`
        // carries the output.
        self.last_free.iter().for_each(|&c| self.step[c] = 0.0);
        if self.coarse.is_stale(&self.free) {
            self.set_springs();
        }
        scatter(&self.on_free.gap, &self.free, &mut self.step);
        self.stiffen();
        let values = &mut self.on_free;
        gather(&self.image, &self.free, &mut values.preconditioned);
        self.coarse
            .correct(&self.free, &values.gap, &mut values.preconditioned);
        without_resultants(&self.motions, &self.free, &mut values.preconditioned);
        let change = dot(&values.preconditioned, &values.image);
        let curvature = dot(&values.direction, &values.image);
        let beta = if curvature > 0.0 {
            (change / curvature).max(0.0)
        } else {
            0.0
        };
        for (d, z) in values.direction.iter_mut().zip(&values.preconditioned) {
            *d = beta * *d - z;
        }
        without_resultants(&self.motions, &self.free, &mut values.direction);
    }

    /// Sets the springs of the free cells, by an update if few cells have changed.
    fn set_springs(&mut self) {
        if !self.coarse.can_update(&self.free) {
            self.free.iter().for_each(|&c| self.step[c] = 1.0);
            self.stiffen();
        } else if let Some(kernel) = self.coarse.kernel() {
            kernel.resize(self.step.len(), 0.0);
            self.step[0] = 1.0;
            self.half_space.normal_inverse(&self.step, kernel);
            self.step[0] = 0.0;
        }
        let scaling = self.scaling.as_deref();
        let scale = |c: usize| scaling.map_or(1.0, |scaling| scaling[c]);
        match self.coarse.can_update(&self.free) {
            true => self.coarse.update_springs(&self.free, scale),
            false => self.coarse.prepare(&self.free, |c| self.image[c], scale),
        }
    }

    /// Computes `image` = S M S `step` on the free cells. M is the preconditioner. S is the scaling for the diagonal
    /// compliance, and S is 1 without a diagonal compliance.
    fn stiffen(&mut self) {
        if let Some(scaling) = &self.scaling {
            self.free.iter().for_each(|&c| self.step[c] *= scaling[c]);
        }
        self.half_space.normal_inverse(&self.step, &mut self.image);
        if let Some(scaling) = &self.scaling {
            self.free.iter().for_each(|&c| self.image[c] *= scaling[c]);
        }
    }

    /// Tries a long step if the last step ended at the bounds long before the minimum along the step. If the last step
    /// ended at the bounds early, mainly the gaps decide which cells carry load. The displacement under pressure has
    /// less effect on the set of loaded cells. A long step decides for all cells at once which cells carry load.
    /// Returns `None` and restores the free cells if the step does not descend.
    fn long_trial(&mut self) -> Option<Trial> {
        let length = self.long_step_length.take()?.min(LONGEST_GRADIENT_STEP)
            / self.half_space.self_compliance();
        let free = std::mem::replace(&mut self.free, self.kept.clone());
        let held = std::mem::take(&mut self.capped_cells);
        let gap: Vec<f64> = self
            .kept
            .iter()
            .map(|&c| self.residual[c] - self.motions.displacement_at(&self.motion, c))
            .collect();
        let free_gap = std::mem::replace(&mut self.on_free.gap, gap);
        gather(&self.pressure, &self.free, &mut self.on_free.pressure);
        let target = self.target;
        if let Some(bent) = self.descends(SearchDirection::Long, length, &target) {
            self.last_free.iter().for_each(|&c| self.step[c] = 0.0);
            return Some(Trial {
                way: SearchDirection::Long,
                length,
                is_projected: bent,
            });
        }
        (self.free, self.capped_cells, self.on_free.gap) = (free, held, free_gap);
        None
    }

    /// Finds a step whose chord descends. Stores the chord in `step`, and the end of the chord in `trial`.
    fn descending_trial(&mut self) -> Option<Trial> {
        let held_resultants = self.held_resultants();
        let target = [0, 1, 2].map(|k| self.target[k] - held_resultants[k]);
        for way in [
            SearchDirection::Conjugate,
            SearchDirection::Preconditioned,
            SearchDirection::Gradient,
        ] {
            let mut length = match way {
                SearchDirection::Gradient => {
                    self.predicted_gradient / self.half_space.self_compliance()
                }
                _ => self.predicted,
            };
            for _ in 0..TRIALS {
                if let Some(bent) = self.descends(way, length, &target) {
                    return Some(Trial {
                        way,
                        length,
                        is_projected: bent,
                    });
                }
                length *= 0.25;
            }
        }
        None
    }

    /// Computes a trial step. Returns whether the projection has bent the trial step, or `None` if the trial step does
    /// not descend. `target` are the resultants of the free cells.
    fn descends(&mut self, way: SearchDirection, length: f64, target: &Motions) -> Option<bool> {
        let values = &mut self.on_free;
        let (direction, length) = match way {
            SearchDirection::Conjugate => (&values.direction, length),
            SearchDirection::Preconditioned => (&values.preconditioned, -length),
            SearchDirection::Gradient | SearchDirection::Long => (&values.gap, -length),
        };
        values.trial.clear();
        let pairs = values.pressure.iter().zip(direction);
        values.trial.extend(pairs.map(|(p, d)| p + length * d));
        let (low, high) = extremes(&values.trial);
        let bent = low < 0.0
            || high > self.cap
            || matches!(way, SearchDirection::Gradient | SearchDirection::Long);
        if bent {
            // Reject a very long trial, because rounding hides the resultants of a very long trial.
            if !project(
                &self.motions,
                &self.free,
                &mut values.trial,
                self.cap,
                target,
            ) {
                return None;
            }
        }
        values.step.clear();
        let pairs = values.trial.iter().zip(&values.pressure);
        values.step.extend(pairs.map(|(trial, p)| trial - p));
        let [slope, size] = sums(&values.step, &values.gap, |step, gap| {
            let term = -step * gap;
            [term, term.abs()]
        });
        let [moved, total] = sums(&values.step, &values.pressure, |step, p| [step.abs(), p]);
        (slope > LEAST_SLOPE * size && moved > NOISE * total).then_some(bent)
    }

    /// Returns the resultants of the cells that stay at the cap.
    fn held_resultants(&self) -> Motions {
        if self.capped_cells.is_empty() {
            return [0.0; 3];
        }
        let cap = vec![self.cap; self.capped_cells.len()];
        self.motions.resultants(&self.capped_cells, &cap)
    }
}

/// Subtracts from values on some cells the rigid motion that has the same resultants.
fn without_resultants(motions: &RigidMotions, cells: &[usize], values: &mut [f64]) {
    let own = motions.resultants(cells, values);
    let Some(motion) = motions.with_resultants(cells, own) else {
        return;
    };
    if motions.rotates() {
        for (value, &c) in values.iter_mut().zip(cells) {
            *value -= motions.displacement_at(&motion, c);
        }
    } else {
        values.iter_mut().for_each(|value| *value -= motion[0]);
    }
}
