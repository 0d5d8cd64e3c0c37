//! Projected conjugate gradient steps, with which a solve begins.
//!
//! The solver computes β of Hestenes and Stiefel from the true change of the slip. With β of Hestenes and Stiefel, the
//! search direction remains conjugate while cells begin and cease to slip. A trial step is projected into the discs and
//! onto the resultants. The shear changes along the chord to the projected point, up to the minimum of F on the chord.
//! Each step costs one convolution. While no cell begins or ceases to slip, the steps are the steps of the conjugate
//! gradient method.

use super::direction::FreeDirections;
use super::newton::Solver;
use super::resultants::solve_small;
use super::vector::{dot, plus, scaled};

/// Bounds on the length of a trial step, whose natural length is one.
const LENGTHS: (f64, f64) = (0.05, 4.0);

/// Smallest fraction of sticking cells for conjugate gradient steps on a shear with two components. If fewer cells
/// stick, the solver takes Newton steps. The directions of sliding shears are angles. A few Newton steps find the
/// angles of sliding shears exactly. Conjugate gradients on chords of the circles do not find the angles.
const LEAST_STICKING_FRACTION: f64 = 0.02;

/// Number of trials along one direction, each a quarter as long as the one before. The plain direction follows.
const TRIALS: usize = 3;

impl<const A: usize> Solver<'_, '_, A> {
    /// Takes one step. Returns false if no step descends, or if Newton steps are better.
    pub(super) fn conjugate_step(&mut self) -> bool {
        let (changed, sticking) = self.set_free();
        if A > 1 && (sticking as f64) < LEAST_STICKING_FRACTION * self.freedom.len() as f64 {
            return false;
        }
        self.changed_cells += changed;
        let is_first = self.predicted == 0.0;
        if is_first
            || self.changed_cells as f64
                > self.options.max_changed_fraction * self.freedom.len() as f64
        {
            self.changed_cells = 0;
            self.set_springs();
            self.rigid_fields();
        } else if changed > 0 {
            for rigid in &mut self.rigid {
                for (r, freedom) in rigid.iter_mut().zip(&self.freedom) {
                    *r = freedom.project(*r);
                }
            }
        }
        let slip = std::mem::take(&mut self.slip);
        self.precondition(&slip);
        self.slip = slip;
        if !self.resultants.required.is_empty() {
            let mut matrix = [[0.0; 3]; 3];
            for (rigid, &(motion, _)) in self.rigid.iter().zip(&self.resultants.required) {
                matrix[motion] = self.resultants.sums(rigid);
            }
            let change = solve_small(&matrix, &self.resultants.sums(&self.work));
            for (rigid, &(motion, _)) in self.rigid.iter().zip(&self.resultants.required) {
                for (w, r) in self.work.iter_mut().zip(rigid) {
                    *w = plus(*w, -change[motion], *r);
                }
            }
        }
        let mut beta = 0.0;
        if !is_first {
            let (mut change, mut curvature) = (0.0, 0.0);
            let steps = self.step.iter().zip(&self.image).zip(&self.freedom);
            for (w, ((step, image), freedom)) in self.work.iter().zip(steps) {
                let step = freedom.project(*step);
                let mut image = freedom.project(*image);
                if let FreeDirections::Slip { compliance, .. } = *freedom {
                    image = plus(image, compliance, step);
                }
                change -= dot(*w, image);
                curvature += dot(step, image);
            }
            if curvature > 0.0 {
                beta = (change / curvature).max(0.0);
            }
        }
        let shortened = if A == 1 {
            1.0
        } else {
            self.options.chord_fraction
        };
        let mut length = if is_first {
            1.0
        } else {
            shortened * self.predicted
        };
        let steps = self.step.iter_mut().zip(&mut self.direction);
        for ((w, freedom), (step, direction)) in self.work.iter().zip(&self.freedom).zip(steps) {
            *direction = plus(*w, beta, freedom.project(*step));
            *step = scaled(length, *direction);
        }
        for trial in 0..TRIALS {
            if trial > 0 {
                for (step, direction) in self.step.iter_mut().zip(&self.direction) {
                    *step = scaled(length, *direction);
                }
            }
            if self.turn_and_project() && self.minimise_on_chord(length) {
                self.iterations += 1;
                return true;
            }
            length *= 0.25;
        }
        self.predicted = 0.0;
        !is_first && self.conjugate_step()
    }

    /// Changes the shear along the chord `step`, up to the minimum of F on the chord. If a shear meets the friction
    /// limit on the chord, the function stops at the friction limit. Returns false if the chord does not descend.
    fn minimise_on_chord(&mut self, length: f64) -> bool {
        let along = |slip: &[_], step: &[_]| -> f64 {
            slip.iter().zip(step).map(|(s, d)| dot::<A>(*s, *d)).sum()
        };
        let descent = along(&self.slip, &self.step);
        if descent <= 0.0 {
            return false;
        }
        self.operator.compliance(&self.step, &mut self.image);
        let curvature = along(&self.image, &self.step);
        let best = if curvature > 0.0 {
            descent / curvature
        } else {
            LENGTHS.1
        };
        let part = if best > 1.0 {
            best.min(self.reach())
        } else {
            best
        };
        self.take_part(part);
        self.predicted = (length * best).clamp(LENGTHS.0, LENGTHS.1);
        true
    }

    /// Returns how far the chord stays within the discs, as a multiple of its length.
    fn reach(&self) -> f64 {
        if A > 1 {
            return 1.0;
        }
        let mut reach = f64::INFINITY;
        for ((q, d), limit) in self.shear.iter().zip(&self.step).zip(&self.limit) {
            let (q, d) = (q[0], d[0]);
            if d != 0.0 {
                reach = reach.min((limit - q * d.signum()) / d.abs());
            }
        }
        reach.max(1.0)
    }
}
