//! One iteration: the preconditioned direction, a trial step that descends, and the chord to it.

use super::super::projection::project;
use super::super::rigid::{Motions, RigidMotions};
use super::{NOISE, Solver, snap};
use crate::contact::cells::{gather, scatter};
use crate::contact::sums::{dot, extremes, sums};

/// A chord descends if its slope is this part of the sum of its terms' sizes; less is rounding.
const LEAST_SLOPE: f64 = 1e-12;

/// Shorter trials along one direction before a plainer one is taken, each a quarter as long.
const TRIALS: usize = 3;

/// How far a chord that projection has bent is followed beyond its end. The rounding of its resultants grows as much.
const EXTENSION: f64 = 4.0;

/// A bent chord with its minimum beyond this part is taken whole: cells that it opens then do open, and of the descent to the
/// minimum next to nothing is lost.
const WHOLE: f64 = 0.8;

/// Bounds on the length of a trial step along a preconditioned direction, whose natural length is one. Where the projection
/// cuts most of a step off, no length is the best one, and the prediction would run away.
const LENGTHS: (f64, f64) = (1e-3, 4.0);

/// Beyond so many times its length the minimum of a bent chord says that bounds have cut off most of the step.
const BEYOND: f64 = 8.0;

/// Bound on the length of a long step, along the gradient in units of 1/λ.
const LONGEST: f64 = 1e6;

/// A step that descends.
struct Trial {
    way: Way,
    length: f64,
    /// Whether it was projected.
    bent: bool,
}

/// Which way a trial step goes.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Conjugate,
    Preconditioned,
    Gradient,
    /// The gradient on all cells, so far that most of them come to a bound.
    Long,
}

impl Solver<'_, '_> {
    /// One iteration. False where no direction descends: rounding is all that is left.
    pub(super) fn advance(&mut self) -> bool {
        let long = self.long_trial();
        if long.is_none() {
            self.precondition();
        }
        let Some(Trial { way, length, bent }) = long.or_else(|| self.descending_trial()) else {
            return false;
        };
        scatter(&self.on_free.step, &self.free, &mut self.step);
        self.half_space.normal(&self.step, &mut self.image);
        if let Some(d) = self.problem.compliance {
            for (&c, step) in self.free.iter().zip(&self.on_free.step) {
                self.image[c] += d[c] * step;
            }
        }
        let on = &mut self.on_free;
        gather(&self.image, &self.free, &mut on.image);
        let slope = -dot(&on.step, &on.gap);
        let curvature = dot(&on.step, &on.image);
        let mut reach = f64::INFINITY;
        for (p, step) in on.pressure.iter().zip(&on.step) {
            let room = if *step < 0.0 { *p } else { self.cap - p };
            let part = room / step.abs();
            // Of a step of nothing the part is infinite, or not a number on a bound.
            reach = if part < reach { part } else { reach };
        }
        let best = if curvature > 0.0 {
            slope / curvature
        } else {
            f64::INFINITY
        };
        let part = if bent && (WHOLE..1.0).contains(&best) {
            1.0
        } else {
            best.min(reach)
                .min(if bent { EXTENSION } else { f64::INFINITY })
        };
        if !part.is_finite() {
            return false;
        }
        for (p, step) in on.pressure.iter_mut().zip(&on.step) {
            *p += part * step;
        }
        let held = if self.held.is_empty() { 0.0 } else { self.cap };
        snap(&mut on.pressure, self.cap, held);
        scatter(&on.pressure, &self.free, &mut self.pressure);
        self.move_residual(part);
        // Where the best part of a chord is less than all of it, cells that the trial opens do not open: a shorter trial does it.
        let along_gradient = matches!(way, Way::Gradient | Way::Long);
        let length = match along_gradient {
            true => length * self.half_space.self_compliance(),
            false => length,
        };
        let cut_off = bent && best.is_finite() && best > BEYOND;
        self.long = cut_off.then_some(length * best);
        match way {
            Way::Conjugate | Way::Preconditioned => {
                self.predicted = (length * best).clamp(LENGTHS.0, LENGTHS.1)
            }
            Way::Gradient => self.predicted_gradient = (length * best).clamp(LENGTHS.0, 1.0),
            // Which says nothing of the free cells'.
            Way::Long => (),
        }
        self.iterations += 1;
        true
    }

    /// The preconditioned gap and the conjugate direction, both without resultants, on the free cells.
    fn precondition(&mut self) {
        let on = &mut self.on_free;
        gather(&self.pressure, &self.free, &mut on.pressure);
        gather(&self.step, &self.free, &mut on.direction);
        gather(&self.image, &self.free, &mut on.image);
        // Too few cells for all motions (or none unknown): the gap as it is will do.
        without_resultants(&self.motions, &self.free, &mut on.gap);
        // The last step has been read: its field carries values into the transform, and its image the result out of it.
        self.moved.iter().for_each(|&c| self.step[c] = 0.0);
        if self.coarse.is_stale(&self.free) {
            self.set_springs();
        }
        scatter(&self.on_free.gap, &self.free, &mut self.step);
        self.stiffen();
        let on = &mut self.on_free;
        gather(&self.image, &self.free, &mut on.preconditioned);
        self.coarse
            .correct(&self.free, &on.gap, &mut on.preconditioned);
        without_resultants(&self.motions, &self.free, &mut on.preconditioned);
        let change = dot(&on.preconditioned, &on.image);
        let curvature = dot(&on.direction, &on.image);
        let beta = if curvature > 0.0 {
            (change / curvature).max(0.0)
        } else {
            0.0
        };
        for (d, z) in on.direction.iter_mut().zip(&on.preconditioned) {
            *d = beta * *d - z;
        }
        without_resultants(&self.motions, &self.free, &mut on.direction);
    }

    /// The springs of the free cells, from those of other cells where these are nearly the same.
    fn set_springs(&mut self) {
        if !self.coarse.is_near(&self.free) {
            self.free.iter().for_each(|&c| self.step[c] = 1.0);
            self.stiffen();
        } else if let Some(kernel) = self.coarse.kernel() {
            kernel.resize(self.step.len(), 0.0);
            self.step[0] = 1.0;
            self.half_space.normal_inverse(&self.step, kernel);
            self.step[0] = 0.0;
        }
        let scaling = self.scaling.as_deref();
        let of = |c: usize| scaling.map_or(1.0, |scaling| scaling[c]);
        match self.coarse.is_near(&self.free) {
            true => self.coarse.follow(&self.free, of),
            false => self.coarse.prepare(&self.free, |c| self.image[c], of),
        }
    }

    /// `image` = S M S `step` on the free cells: the preconditioner, scaled by S where there is a diagonal compliance.
    fn stiffen(&mut self) {
        if let Some(scaling) = &self.scaling {
            self.free.iter().for_each(|&c| self.step[c] *= scaling[c]);
        }
        self.half_space.normal_inverse(&self.step, &mut self.image);
        if let Some(scaling) = &self.scaling {
            self.free.iter().for_each(|&c| self.image[c] *= scaling[c]);
        }
    }

    /// A long step, where the last one ended at the bounds long before its minimum: which cells carry load is then decided by their gaps
    /// more than by what pressure makes of them, and the nearest pressures find that out at once on all cells. `None` leaves the free
    /// cells as they are.
    fn long_trial(&mut self) -> Option<Trial> {
        let length = self.long.take()?.min(LONGEST) / self.half_space.self_compliance();
        let free = std::mem::replace(&mut self.free, self.kept.clone());
        let held = std::mem::take(&mut self.held);
        let gap: Vec<f64> = self
            .kept
            .iter()
            .map(|&c| self.residual[c] - self.motions.at(&self.motion, c))
            .collect();
        let of_free = std::mem::replace(&mut self.on_free.gap, gap);
        gather(&self.pressure, &self.free, &mut self.on_free.pressure);
        let target = self.target;
        if let Some(bent) = self.descends(Way::Long, length, &target) {
            self.moved.iter().for_each(|&c| self.step[c] = 0.0);
            return Some(Trial {
                way: Way::Long,
                length,
                bent,
            });
        }
        (self.free, self.held, self.on_free.gap) = (free, held, of_free);
        None
    }

    /// Finds a step whose chord descends, and leaves it in `step` and its end in `trial`.
    fn descending_trial(&mut self) -> Option<Trial> {
        let held = self.held_resultants();
        let target = [0, 1, 2].map(|k| self.target[k] - held[k]);
        for way in [Way::Conjugate, Way::Preconditioned, Way::Gradient] {
            let mut length = match way {
                Way::Gradient => self.predicted_gradient / self.half_space.self_compliance(),
                _ => self.predicted,
            };
            for _ in 0..TRIALS {
                if let Some(bent) = self.descends(way, length, &target) {
                    return Some(Trial { way, length, bent });
                }
                length *= 0.25;
            }
        }
        None
    }

    /// Whether the step is bent by the projection, if it descends. `target` are the resultants of the free cells.
    fn descends(&mut self, way: Way, length: f64, target: &Motions) -> Option<bool> {
        let on = &mut self.on_free;
        let (direction, length) = match way {
            Way::Conjugate => (&on.direction, length),
            Way::Preconditioned => (&on.preconditioned, -length),
            Way::Gradient | Way::Long => (&on.gap, -length),
        };
        on.trial.clear();
        let ends = on.pressure.iter().zip(direction);
        on.trial.extend(ends.map(|(p, d)| p + length * d));
        let (low, high) = extremes(&on.trial);
        let bent = low < 0.0 || high > self.cap || matches!(way, Way::Gradient | Way::Long);
        if bent {
            // A trial so long that its digits do not hold the resultants would lose them.
            if !project(&self.motions, &self.free, &mut on.trial, self.cap, target) {
                return None;
            }
        }
        on.step.clear();
        let ends = on.trial.iter().zip(&on.pressure);
        on.step.extend(ends.map(|(trial, p)| trial - p));
        let [slope, size] = sums(&on.step, &on.gap, |step, gap| {
            let term = -step * gap;
            [term, term.abs()]
        });
        let [moved, total] = sums(&on.step, &on.pressure, |step, p| [step.abs(), p]);
        (slope > LEAST_SLOPE * size && moved > NOISE * total).then_some(bent)
    }

    /// What the cells that stay at the cap carry.
    fn held_resultants(&self) -> Motions {
        if self.held.is_empty() {
            return [0.0; 3];
        }
        let cap = vec![self.cap; self.held.len()];
        self.motions.resultants(&self.held, &cap)
    }
}

/// Takes the rigid motion out of values on some cells that gives them their resultants.
fn without_resultants(motions: &RigidMotions, cells: &[usize], values: &mut [f64]) {
    let own = motions.resultants(cells, values);
    let Some(motion) = motions.with_resultants(cells, own) else {
        return;
    };
    if motions.rotates() {
        for (value, &c) in values.iter_mut().zip(cells) {
            *value -= motions.at(&motion, c);
        }
    } else {
        values.iter_mut().for_each(|value| *value -= motion[0]);
    }
}
