//! Semi-smooth Newton method.

use super::coarse::Coarse;
use super::direction::FreeDirections;
use super::operator::Operator;
use super::resultants::{MOTIONS, Motions, Resultants, solve_small};
use super::vector::{Vector, dot, into_disc, nearly_turn, norm, plus, scaled, turn_towards};
use super::{TangentialOptions, TangentialProblem};
use crate::contact::error::ContactError;

/// Smallest dissipation by which the gap is divided, as a fraction of the dissipation of gross slip. Without a smallest
/// dissipation, the relative duality gap would be meaningless if every cell sticks.
const DISSIPATION_FLOOR: f64 = 1e-4;

/// Smallest motion in the dissipation floor, as a fraction of the displacement of a cell alone under the friction
/// limit. A smaller motion changes the shear by less than the rounding of the shear.
const SMALLEST_MOTION: f64 = 1e-8;

/// Rounding error of the slip, relative to the displacement of a cell under the largest shear on the cell alone. A slip
/// below the rounding error is meaningless.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Largest relative distance from the circle |q| = µp at which a shear counts as on the circle. `ON_CIRCLE` is the
/// rounding error of a projection onto the circle.
pub(super) const ON_CIRCLE: f64 = 1e-12;

/// Smallest fraction of a Newton step after which Newton steps continue. If the line search shortens a Newton step
/// further, the solver takes gradient steps.
const SHORT_STEP: f64 = 0.2;

/// Largest rotation of the shear on a slip cell in one Newton step \[rad\].
const LARGEST_TURN: f64 = 1.0;

/// Smallest fraction of the predicted decrease that a full Newton step must reach.
const SUFFICIENT_DECREASE: f64 = 1e-4;

/// Newton steps without a halved error before gradient steps follow.
const NEWTON_PATIENCE: usize = 6;

/// Largest number of iterations that update the slip before the solver computes the slip from the shear again. Each
/// update adds a rounding error to the slip.
const TRUSTED_ITERATIONS: usize = 50;

/// Conjugate gradient steps without a halved error before Newton steps follow.
const CONJUGATE_PATIENCE: usize = 20;

/// Number of gradient steps between two Newton steps if Newton steps fail.
const GRADIENT_STEPS: usize = 10;

/// Shortest gradient step that is tried, as a fraction of the step of a cell alone.
const SHORTEST: f64 = 1e-4;

/// Relative duality gap, and the dissipation by which it is divided.
#[derive(Clone, Copy)]
pub(super) struct Gap {
    pub(super) error: f64,
    pub(super) scale: f64,
}

/// State of a solve. Every field has one entry per contact cell, in the order of the operator.
pub(super) struct Solver<'a, 'h, const A: usize> {
    pub(super) operator: Operator<'h, A>,
    pub(super) problem: &'a TangentialProblem<'a>,
    pub(super) options: TangentialOptions,
    pub(super) resultants: Resultants<A>,
    /// Amounts of the rigid motions during the load step, given or computed so far \[m\].
    pub(super) displacement: Motions,
    pub(super) offset: Option<Vec<Vector<A>>>,
    pub(super) limit: Vec<f64>,
    pub(super) limit_sum: f64,
    /// Duality gap that the rounding of the shears alone causes \[Pa m\].
    pub(super) rounding: f64,
    /// Smallest motion in the floor of the gap \[m\].
    pub(super) least_motion: f64,
    pub(super) lambda: f64,
    pub(super) freedom: Vec<FreeDirections<A>>,
    pub(super) shear: Vec<Vector<A>>,
    pub(super) slip: Vec<Vector<A>>,
    pub(super) step: Vec<Vector<A>>,
    pub(super) direction: Vec<Vector<A>>,
    pub(super) image: Vec<Vector<A>>,
    pub(super) residual: Vec<Vector<A>>,
    pub(super) work: Vec<Vector<A>>,
    /// Preconditioner applied to each free motion.
    pub(super) rigid: Vec<Vec<Vector<A>>>,
    pub(super) coarse: Coarse<A>,
    /// Length of the next conjugate gradient step; 0 if there was no step before.
    pub(super) predicted: f64,
    /// Cells that have begun or ceased to slip since the coarse correction was set.
    pub(super) changed_cells: usize,
    pub(super) steps: usize,
    pub(super) iterations: usize,
}

impl<'a, 'h, const A: usize> Solver<'a, 'h, A> {
    pub(super) fn new(
        operator: Operator<'h, A>,
        problem: &'a TangentialProblem<'a>,
        resultants: Resultants<A>,
        displacement: Motions,
        options: TangentialOptions,
    ) -> Self {
        let cells = operator.cells();
        let limit: Vec<f64> = cells.iter().map(|&c| problem.limit[c]).collect();
        let offset = problem.offset.map(|offset| {
            cells
                .iter()
                .map(|&c| std::array::from_fn(|axis| offset[axis][c]))
                .collect()
        });
        let coarse = Coarse::new(operator.half_space(), operator.cells());
        let lambda = operator.self_compliance();
        let peak = resultants.limit_peak;
        let largest_shear = problem
            .previous
            .iter()
            .flat_map(|q| q.iter().flatten())
            .fold(peak, |m, q| m.max(q.abs()));
        let limit_sum = resultants.limit_sum;
        let zeros = || vec![[0.0; A]; limit.len()];
        Solver {
            problem,
            options,
            displacement,
            offset,
            limit_sum,
            rounding: ROUNDING * lambda * largest_shear * limit_sum,
            least_motion: SMALLEST_MOTION * lambda * peak,
            lambda,
            freedom: vec![FreeDirections::Stick; limit.len()],
            shear: zeros(),
            slip: zeros(),
            step: zeros(),
            direction: zeros(),
            image: zeros(),
            residual: zeros(),
            work: zeros(),
            rigid: resultants.required.iter().map(|_| zeros()).collect(),
            operator,
            resultants,
            limit,
            coarse,
            predicted: 0.0,
            changed_cells: 0,
            steps: 0,
            iterations: 0,
        }
    }

    /// Returns the imposed displacement of a contact cell: the rigid motions plus the given offset.
    fn imposed_displacement(&self, cell: usize) -> Vector<A> {
        let rigid = self.resultants.field(&self.displacement, cell);
        match &self.offset {
            Some(offset) => plus(rigid, 1.0, offset[cell]),
            None => rigid,
        }
    }

    /// Solves the step. Returns the gap, of a slip that is exact up to rounding, and the error of the resultants.
    pub(super) fn run(
        &mut self,
        start: Option<&Vec<Vec<f64>>>,
    ) -> Result<(Gap, f64), ContactError> {
        self.begin(start)?;
        self.renew_slip();
        // Whether the slip was just computed from the shear, and the iterations up to that point.
        let (mut is_fresh, mut renewed_at) = (true, self.iterations);
        let (mut best, mut steps_since_halving) = (f64::INFINITY, 0);
        let mut conjugate = true;
        loop {
            self.improve_multipliers();
            let gap = self.gap();
            if gap.error <= self.options.tolerance {
                if is_fresh || self.iterations - renewed_at <= TRUSTED_ITERATIONS {
                    return Ok((gap, self.resultants.error(&self.shear, &self.limit)));
                }
                self.renew_slip();
                (is_fresh, renewed_at) = (true, self.iterations);
                continue;
            }
            if self.steps >= self.options.max_steps
                || self.iterations >= self.options.max_iterations
            {
                return Err(self.not_converged(gap.error));
            }
            steps_since_halving += 1;
            if gap.error <= 0.5 * best {
                (best, steps_since_halving) = (gap.error, 0);
            }
            self.steps += 1;
            if conjugate {
                if steps_since_halving <= CONJUGATE_PATIENCE && self.conjugate_step() {
                    is_fresh = false;
                    continue;
                }
                conjugate = false;
                steps_since_halving = 0;
            }
            if steps_since_halving <= NEWTON_PATIENCE
                && let Some(part) = self.newton(gap)
            {
                is_fresh = false;
                if part < SHORT_STEP {
                    steps_since_halving = NEWTON_PATIENCE;
                }
                continue;
            }
            steps_since_halving = 0;
            if self.descend() {
                is_fresh = false;
            } else if is_fresh {
                // No direction lowers the energy, and the slip is exact up to rounding.
                return Err(self.not_converged(gap.error));
            } else {
                self.renew_slip();
                (is_fresh, renewed_at) = (true, self.iterations);
            }
        }
    }

    /// Returns the errors of the shear with which a solve would start.
    pub(super) fn evaluate(
        &mut self,
        start: Option<&Vec<Vec<f64>>>,
    ) -> Result<(Gap, f64), ContactError> {
        self.begin(start)?;
        self.renew_slip();
        self.improve_multipliers();
        let gap = self.gap();
        Ok((gap, self.resultants.error(&self.shear, &self.limit)))
    }

    fn not_converged(&self, error: f64) -> ContactError {
        ContactError::NotConverged {
            problem: "tangential",
            iterations: self.steps,
            error,
            tolerance: self.options.tolerance,
        }
    }

    /// Sets the first shear, within the discs and with the required resultants.
    fn begin(&mut self, start: Option<&Vec<Vec<f64>>>) -> Result<(), ContactError> {
        if let Some(first) = start.or(self.problem.previous) {
            for (q, &c) in self.shear.iter_mut().zip(self.operator.cells()) {
                *q = std::array::from_fn(|axis| first[axis][c]);
            }
            for (q, limit) in self.shear.iter_mut().zip(&self.limit) {
                *q = into_disc(*q, *limit);
            }
        }
        if self.resultants.required.is_empty() {
            return Ok(());
        }
        // Add the missing resultants as a stuck contact would carry them.
        let lack = self.resultants.deficit(&self.shear);
        self.set_springs();
        let matrix = self.rigid_fields();
        let amounts = solve_small(&matrix, &lack);
        for (k, &(motion, _)) in self.resultants.required.iter().enumerate() {
            for (q, rigid) in self.shear.iter_mut().zip(&self.rigid[k]) {
                *q = plus(*q, amounts[motion], *rigid);
            }
        }
        let Some(shift) = self.resultants.balance(&self.shear, &self.limit) else {
            return Err(self.friction_exceeded());
        };
        for (cell, q) in self.shear.iter_mut().enumerate() {
            let shifted = plus(*q, 1.0, self.resultants.field(&shift, cell));
            *q = into_disc(shifted, self.limit[cell]);
        }
        Ok(())
    }

    /// Returns the error that compares the required resultants with the largest ones in the same proportion.
    pub(super) fn friction_exceeded(&self) -> ContactError {
        let cell_area = self.problem.patch.grid.cell_area();
        let factor = if self.limit.is_empty() {
            0.0
        } else {
            self.resultants.limit_factor(&self.limit)
        };
        // Report the first motion with a nonzero resultant.
        let &(motion, sum) = self
            .resultants
            .required
            .iter()
            .find(|(_, sum)| *sum != 0.0)
            .unwrap_or(&self.resultants.required[0]);
        let (name, unit) = [
            ("tangential force along x", 1.0),
            ("tangential force along y", 1.0),
            ("moment about z", self.resultants.length),
        ][motion];
        ContactError::FrictionExceeded {
            name,
            asked: sum * cell_area * unit,
            limit: factor * sum.abs() * cell_area * unit,
        }
    }

    /// Computes s = Δδ + … − K(q − q₀) from scratch.
    fn renew_slip(&mut self) {
        let previous = self.problem.previous;
        self.operator
            .displacement(&self.shear, previous, &mut self.image);
        for cell in 0..self.slip.len() {
            self.slip[cell] = plus(self.imposed_displacement(cell), -1.0, self.image[cell]);
        }
    }

    /// Moves the free rigid motions to the point where the gradient step keeps the resultants.
    fn improve_multipliers(&mut self) {
        if self.resultants.required.is_empty() {
            return;
        }
        let inverse = 1.0 / self.lambda;
        for ((target, q), s) in self.work.iter_mut().zip(&self.shear).zip(&self.slip) {
            *target = plus(*q, inverse, *s);
        }
        if let Some(shift) = self.resultants.balance(&self.work, &self.limit) {
            self.move_rigidly(&shift.map(|c| c * self.lambda));
        }
    }

    fn move_rigidly(&mut self, amounts: &Motions) {
        for (total, amount) in self.displacement.iter_mut().zip(amounts) {
            *total += amount;
        }
        self.resultants.add(amounts, &mut self.slip);
    }

    /// Returns true if the shear is at its limit and points along the slip.
    pub(super) fn slips(&self, cell: usize) -> bool {
        norm(self.shear[cell]) >= self.limit[cell] * (1.0 - ON_CIRCLE)
            && dot(self.shear[cell], self.slip[cell]) > 0.0
    }

    /// Returns the relative duality gap.
    fn gap(&self) -> Gap {
        let (mut gap, mut bound, mut reach) = (0.0, 0.0, self.least_motion * self.least_motion);
        let everywhere =
            (self.resultants.rotation.is_none() && self.offset.is_none() && !self.limit.is_empty())
                .then(|| self.imposed_displacement(0));
        for (cell, (&q, &s)) in self.shear.iter().zip(&self.slip).enumerate() {
            let limit = self.limit[cell];
            let sliding_dissipation = limit * norm(s);
            let along = dot(q, s);
            // The solution reports zero slip on stick cells, so the dissipation by their remaining slip counts as
            // error.
            let slips = along > 0.0 && norm(q) >= limit * (1.0 - ON_CIRCLE);
            gap += if slips {
                sliding_dissipation - along
            } else {
                sliding_dissipation.max(sliding_dissipation - along)
            };
            bound += sliding_dissipation;
            let imposed = everywhere.unwrap_or_else(|| self.imposed_displacement(cell));
            let elastic = plus(imposed, -1.0, s);
            reach = reach.max(dot(imposed, imposed)).max(dot(elastic, elastic));
        }
        let scale = bound.max(DISSIPATION_FLOOR * self.limit_sum * reach.sqrt());
        // The rounding of sums may make the gap slightly negative.
        let error = if gap <= self.rounding {
            0.0
        } else {
            (gap - self.rounding) / scale
        };
        Gap { error, scale }
    }

    /// Takes a Newton step. Returns the fraction of the step that was taken, or `None` if the energy does not fall
    /// along it.
    fn newton(&mut self, gap: Gap) -> Option<f64> {
        self.set_free();
        let shift = self.newton_direction(gap);
        if self.turn_and_project() {
            self.advance(&shift)
        } else {
            None
        }
    }

    /// Turns the direction in `step` into a step to a point inside the discs with the required resultants. The shear of
    /// a slip cell rotates. The shear of a stick cell that leaves the disc |q| ≤ µp stops on the circle |q| = µp.
    /// Returns false if no point inside the discs has the required resultants.
    pub(super) fn turn_and_project(&mut self) -> bool {
        let balanced = !self.resultants.required.is_empty();
        let cells = self.shear.iter().zip(&self.limit).zip(&self.freedom);
        for (step, ((&q, &limit), freedom)) in self.step.iter_mut().zip(cells) {
            let d = *step;
            let change = match *freedom {
                FreeDirections::Slip { tangent, .. } => {
                    let angle = dot(d, tangent) / limit;
                    let change = nearly_turn(q, angle.clamp(-LARGEST_TURN, LARGEST_TURN));
                    let outward = (limit / norm(q) - 1.0).max(0.0);
                    plus(change, outward, plus(q, 1.0, change))
                }
                FreeDirections::Stick => {
                    let target = plus(q, 1.0, d);
                    let size = norm(target);
                    if size <= limit || balanced {
                        d
                    } else if norm(q) >= limit * (1.0 - ON_CIRCLE) {
                        turn_towards(q, target)
                    } else {
                        plus(scaled(limit / size, target), -1.0, q)
                    }
                }
            };
            *step = change;
        }
        if !balanced {
            return true;
        }
        // The slip of a slip cell resists a change of the shear along the circle |q| = µp. The factor 1 + compliance/λ
        // on the target shear of a slip cell includes the resistance of the slip in the balance.
        for cell in 0..self.step.len() {
            let outward = match self.freedom[cell] {
                FreeDirections::Slip { compliance, .. } => 1.0 + compliance / self.lambda,
                FreeDirections::Stick => 1.0,
            };
            let target = plus(self.shear[cell], 1.0, self.step[cell]);
            self.work[cell] = scaled(outward, target);
        }
        let Some(shift) = self.resultants.balance(&self.work, &self.limit) else {
            return false;
        };
        self.resultants.add(&shift, &mut self.work);
        for cell in 0..self.step.len() {
            let target = self.work[cell];
            let (q, limit) = (self.shear[cell], self.limit[cell]);
            self.step[cell] = if norm(target) >= limit && norm(q) >= limit * (1.0 - ON_CIRCLE) {
                turn_towards(q, target)
            } else {
                plus(into_disc(target, limit), -1.0, q)
            };
        }
        true
    }

    /// Takes projected gradient steps with the length of Barzilai and Borwein, each to the minimum on its chord. The
    /// energy falls at every step. Returns false if even the first step fails.
    fn descend(&mut self) -> bool {
        self.freedom.fill(FreeDirections::Stick);
        let mut length = 1.0 / self.lambda;
        for count in 0..GRADIENT_STEPS {
            // The farther a step leads out of the discs, the harder it is to balance up to rounding.
            while !self.gradient_step(length) {
                length *= 0.1;
                if length * self.lambda < SHORTEST {
                    return count > 0;
                }
            }
            self.iterations += 1;
            let (mut square, mut curvature) = (0.0, 0.0);
            for (step, image) in self.step.iter().zip(&self.image) {
                square += dot(*step, *step);
                curvature += dot(*step, *image);
            }
            if curvature > 0.0 {
                length = square / curvature;
            }
            self.improve_multipliers();
        }
        true
    }

    fn gradient_step(&mut self, length: f64) -> bool {
        for (step, s) in self.step.iter_mut().zip(&self.slip) {
            *step = scaled(length, *s);
        }
        self.turn_and_project() && self.advance(&[0.0; MOTIONS]).is_some()
    }

    /// Adds the fraction `part` of the step to the shear. `image` is the displacement of the step. The fraction `part`
    /// of `image` changes the slip and the operator's field.
    pub(super) fn take_part(&mut self, part: f64) {
        for (q, step) in self.shear.iter_mut().zip(&self.step) {
            *q = plus(*q, part, *step);
        }
        for (s, image) in self.slip.iter_mut().zip(&self.image) {
            *s = plus(*s, -part, *image);
        }
        self.operator.add(part);
    }

    /// Takes the whole step, or the part of the step that minimises F on the chord. Returns the part of the step, or
    /// `None` if F does not decrease.
    fn advance(&mut self, shift: &Motions) -> Option<f64> {
        self.operator.compliance(&self.step, &mut self.image);
        let (mut descent, mut curvature) = (0.0, 0.0);
        for ((s, image), step) in self.slip.iter().zip(&self.image).zip(&self.step) {
            descent += dot(*s, *step);
            curvature += dot(*image, *step);
        }
        if descent <= 0.0 {
            return None;
        }
        // If a periodic contact moves as a whole, the exact curvature is zero. With rounding, the computed curvature
        // can be negative.
        let takes_full_step =
            curvature <= 0.0 || descent - 0.5 * curvature >= SUFFICIENT_DECREASE * descent;
        let part = if takes_full_step {
            1.0
        } else {
            (descent / curvature).min(1.0)
        };
        self.take_part(part);
        if !self.resultants.required.is_empty() {
            self.move_rigidly(&shift.map(|s| part * s));
        }
        Some(part)
    }
}
