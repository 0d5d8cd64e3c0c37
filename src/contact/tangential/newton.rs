//! The semi-smooth Newton method.

use super::operator::Operator;
use super::resultants::{MOTIONS, Motions, Resultants, solve_small};
use super::vector::{Vector, dot, into_disc, norm, plus, quarter_turn, scaled, turn, turn_towards};
use super::{TangentialOptions, TangentialProblem};
use crate::contact::error::ContactError;

/// Dissipation below this part of that of gross slip counts as if it were that much in the relative gap: the gap would lose
/// its meaning where everything sticks.
const DISSIPATION_FLOOR: f64 = 1e-4;

/// A motion below this part of the displacement of a cell alone under its limit counts as if it were that much in the floor
/// above: the change of shear that it makes drowns in the rounding of the shear.
const SMALLEST_MOTION: f64 = 1e-8;

/// A shear this close to its limit is on it: rounding of a projection onto the circle.
const ON_CIRCLE: f64 = 1e-12;

/// A shear this close to its limit, that the slip drives beyond it, is taken as slipping in a Newton step. Were only shears on
/// the circle taken so, a chord that is shortened would leave all cells just inside of it, to stick in the next step again.
const NEAR_CIRCLE: f64 = 0.05;

/// A Newton step that the chord shortens to less than this part is followed by gradient steps.
const SHORT: f64 = 0.2;

/// Largest turn of the shear's direction on a slip cell in one Newton step \[rad\].
const LARGEST_TURN: f64 = 1.0;

/// The least part of the decrease predicted by the slope that a full Newton step must reach.
const SUFFICIENT_DECREASE: f64 = 1e-4;

/// Newton steps without a halved error, after which gradient steps are taken.
const PATIENCE: usize = 6;

/// Gradient steps between two Newton steps where those fail.
const GRADIENT_STEPS: usize = 10;

/// Part of the tolerance that an inner solve leaves at most on cells that stick.
const INNER_SHARE: f64 = 0.25;

/// The part of the first residual at which an inner solve stops, over the root of the error, and its bounds.
const FORCING: f64 = 0.3;
const FORCINGS: (f64, f64) = (1e-3, 0.1);

/// What is free to change on a contact cell in a Newton step.
#[derive(Clone, Copy)]
enum Freedom<const A: usize> {
    /// Both components of the shear.
    Stick,
    /// The angle: the unit tangent, and (s·q̂)/µp, the compliance that a turn of the shear meets.
    Slip { tangent: Vector<A>, compliance: f64 },
}

/// The relative duality gap and what it is relative to.
#[derive(Clone, Copy)]
struct Gap {
    error: f64,
    scale: f64,
}

/// The state of a solve. Every field has one entry a contact cell, in the order of the operator's.
pub(super) struct Solver<'a, 'h, const A: usize> {
    pub(super) operator: Operator<'h, A>,
    problem: &'a TangentialProblem<'a>,
    options: TangentialOptions,
    resultants: Resultants<A>,
    /// Amounts of the rigid motions in this step, given or found so far \[m\].
    pub(super) displacement: Motions,
    offset: Option<Vec<Vector<A>>>,
    limit: Vec<f64>,
    limit_sum: f64,
    /// Least motion that the gap's floor supposes \[m\].
    least_motion: f64,
    lambda: f64,
    freedom: Vec<Freedom<A>>,
    pub(super) shear: Vec<Vector<A>>,
    pub(super) slip: Vec<Vector<A>>,
    step: Vec<Vector<A>>,
    direction: Vec<Vector<A>>,
    image: Vec<Vector<A>>,
    residual: Vec<Vector<A>>,
    work: Vec<Vector<A>>,
    /// The preconditioner applied to each free motion.
    rigid: Vec<Vec<Vector<A>>>,
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
        let lambda = operator.self_compliance();
        let peak = limit.iter().fold(0.0f64, |m, l| m.max(*l));
        let zeros = || vec![[0.0; A]; limit.len()];
        Solver {
            problem,
            options,
            displacement,
            offset,
            limit_sum: limit.iter().sum(),
            least_motion: SMALLEST_MOTION * lambda * peak,
            lambda,
            freedom: vec![Freedom::Stick; limit.len()],
            shear: zeros(),
            slip: zeros(),
            step: zeros(),
            direction: zeros(),
            image: zeros(),
            residual: zeros(),
            work: zeros(),
            rigid: resultants.asked.iter().map(|_| zeros()).collect(),
            operator,
            resultants,
            limit,
            steps: 0,
            iterations: 0,
        }
    }

    /// The displacement of a contact cell that is given or that the rigid motions make.
    fn given(&self, cell: usize) -> Vector<A> {
        let rigid = self.resultants.field(&self.displacement, cell);
        match &self.offset {
            Some(offset) => plus(rigid, 1.0, offset[cell]),
            None => rigid,
        }
    }

    /// Solves; the first error is that of a slip computed anew from the shear found, the second that of the resultants.
    pub(super) fn run(
        &mut self,
        start: Option<&Vec<Vec<f64>>>,
    ) -> Result<(f64, f64), ContactError> {
        self.begin(start)?;
        self.renew_slip();
        let mut fresh = true;
        let (mut best, mut since) = (f64::INFINITY, 0);
        loop {
            self.improve_multipliers();
            let gap = self.gap();
            if gap.error <= self.options.tolerance {
                if fresh {
                    return Ok((gap.error, self.resultants.error(&self.shear, &self.limit)));
                }
                self.renew_slip();
                fresh = true;
                continue;
            }
            if self.steps >= self.options.max_steps
                || self.iterations >= self.options.max_iterations
            {
                return Err(self.not_converged(gap.error));
            }
            since += 1;
            if gap.error <= 0.5 * best {
                (best, since) = (gap.error, 0);
            }
            self.steps += 1;
            if since <= PATIENCE
                && let Some(part) = self.newton(gap)
            {
                fresh = false;
                if part < SHORT {
                    since = PATIENCE;
                }
                continue;
            }
            since = 0;
            if self.descend() {
                fresh = false;
            } else if fresh {
                // No direction lowers the energy of a slip that is exact to rounding.
                return Err(self.not_converged(gap.error));
            } else {
                self.renew_slip();
                fresh = true;
            }
        }
    }

    fn not_converged(&self, error: f64) -> ContactError {
        ContactError::NotConverged {
            problem: "tangential",
            iterations: self.steps,
            error,
            tolerance: self.options.tolerance,
        }
    }

    /// The first shear: within the discs, and with the resultants asked for.
    fn begin(&mut self, start: Option<&Vec<Vec<f64>>>) -> Result<(), ContactError> {
        if let Some(first) = start.or(self.problem.previous) {
            for (q, &c) in self.shear.iter_mut().zip(self.operator.cells()) {
                *q = std::array::from_fn(|axis| first[axis][c]);
            }
            for (q, limit) in self.shear.iter_mut().zip(&self.limit) {
                *q = into_disc(*q, *limit);
            }
        }
        if self.resultants.asked.is_empty() {
            return Ok(());
        }
        // What the resultants lack, as a stuck contact would carry it.
        let lack = self.resultants.lack(&self.shear);
        let matrix = self.rigid_fields();
        let amounts = solve_small(&matrix, &lack);
        for (k, &(motion, _)) in self.resultants.asked.iter().enumerate() {
            for (q, rigid) in self.shear.iter_mut().zip(&self.rigid[k]) {
                *q = plus(*q, amounts[motion], *rigid);
            }
        }
        let Some(shift) = self.resultants.balance(&self.shear, &self.limit) else {
            return Err(self.beyond());
        };
        for (cell, q) in self.shear.iter_mut().enumerate() {
            let shifted = plus(*q, 1.0, self.resultants.field(&shift, cell));
            *q = into_disc(shifted, self.limit[cell]);
        }
        Ok(())
    }

    /// The resultants asked for against what friction carries in their proportion.
    pub(super) fn beyond(&self) -> ContactError {
        let cell_area = self.problem.patch.grid.cell_area();
        let factor = if self.limit.is_empty() {
            0.0
        } else {
            self.resultants.limit_factor(&self.limit)
        };
        // The first motion that has a share stands for all.
        let &(motion, sum) = self
            .resultants
            .asked
            .iter()
            .find(|(_, sum)| *sum != 0.0)
            .unwrap_or(&self.resultants.asked[0]);
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

    /// s = Δδ + … − K(q − q₀) from scratch.
    fn renew_slip(&mut self) {
        let previous = self.problem.previous;
        self.operator
            .displacement(&self.shear, previous, &mut self.image);
        for cell in 0..self.slip.len() {
            self.slip[cell] = plus(self.given(cell), -1.0, self.image[cell]);
        }
    }

    /// Moves the free rigid motions to where the gradient step keeps the resultants.
    fn improve_multipliers(&mut self) {
        if self.resultants.asked.is_empty() {
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
        for (cell, s) in self.slip.iter_mut().enumerate() {
            *s = plus(*s, 1.0, self.resultants.field(amounts, cell));
        }
    }

    /// True where the shear is at its limit and along the slip.
    pub(super) fn slips(&self, cell: usize) -> bool {
        norm(self.shear[cell]) >= self.limit[cell] * (1.0 - ON_CIRCLE)
            && dot(self.shear[cell], self.slip[cell]) > 0.0
    }

    /// The relative duality gap.
    fn gap(&self) -> Gap {
        let (mut gap, mut bound, mut reach) = (0.0, 0.0, self.least_motion * self.least_motion);
        for (cell, (&q, &s)) in self.shear.iter().zip(&self.slip).enumerate() {
            let limit = self.limit[cell];
            let full = limit * norm(s);
            let along = dot(q, s);
            // What is left of the slip of a stick cell will be taken as none: all that it would dissipate is an error.
            let slips = along > 0.0 && norm(q) >= limit * (1.0 - ON_CIRCLE);
            gap += if slips {
                full - along
            } else {
                full.max(full - along)
            };
            bound += full;
            let given = self.given(cell);
            let elastic = plus(given, -1.0, s);
            reach = reach.max(dot(given, given)).max(dot(elastic, elastic));
        }
        let scale = bound.max(DISSIPATION_FLOOR * self.limit_sum * reach.sqrt());
        // Rounding can leave a sum of exact complements slightly negative.
        let error = if gap <= 0.0 { 0.0 } else { gap / scale };
        Gap { error, scale }
    }

    /// A Newton step: the part of it that was taken, none where the energy does not fall along it.
    fn newton(&mut self, gap: Gap) -> Option<f64> {
        self.set_free();
        let shift = self.newton_direction(gap);
        if self.turn_and_project() {
            self.advance(&shift)
        } else {
            None
        }
    }

    /// Decides what is free on each contact cell.
    fn set_free(&mut self) {
        for cell in 0..self.freedom.len() {
            let (q, s, limit) = (self.shear[cell], self.slip[cell], self.limit[cell]);
            let (size, along) = (norm(q), dot(q, s));
            let at_limit = size >= limit * (1.0 - ON_CIRCLE)
                || (size >= limit * (1.0 - NEAR_CIRCLE)
                    && norm(plus(q, 1.0 / self.lambda, s)) >= limit);
            self.freedom[cell] = if at_limit && along > 0.0 {
                Freedom::Slip {
                    tangent: scaled(1.0 / size, quarter_turn(q)),
                    compliance: along / (size * limit),
                }
            } else {
                Freedom::Stick
            };
        }
    }

    /// `work` = P S M S P `source`: the preconditioner in the free directions P. The slip cells' part is scaled by
    /// S = √(λ/(λ + D)): where a turn is stiff already, the half space counts little.
    fn precondition(&mut self, source: impl Fn(&Self, usize) -> Vector<A>) {
        let mut work = std::mem::take(&mut self.work);
        for (cell, w) in work.iter_mut().enumerate() {
            *w = self.freedom[cell].scaled(source(self, cell), self.lambda);
        }
        self.operator.stiffness(&work, &mut self.image);
        for ((w, image), freedom) in work.iter_mut().zip(&self.image).zip(&self.freedom) {
            *w = freedom.scaled(*image, self.lambda);
        }
        self.work = work;
    }

    /// The preconditioner applied to each free rigid motion, and the matrix of their resultants.
    fn rigid_fields(&mut self) -> [[f64; MOTIONS]; MOTIONS] {
        let mut matrix = [[0.0; MOTIONS]; MOTIONS];
        for k in 0..self.resultants.asked.len() {
            let motion = self.resultants.asked[k].0;
            self.precondition(|solver, cell| solver.resultants.motion(motion, cell));
            let sums = self.resultants.sums(&self.work);
            matrix[motion] = sums;
            self.rigid[k].copy_from_slice(&self.work);
        }
        matrix
    }

    /// Conjugate gradients for (K + D) step = s in the free directions at constant resultants, to what is worth while before
    /// the cells are looked at again. Gives the change of the rigid motions that belongs to the step.
    fn newton_direction(&mut self, gap: Gap) -> Motions {
        let forcing = forcing(gap.error);
        let enough = INNER_SHARE * self.options.tolerance * gap.scale;
        let matrix = self.rigid_fields();
        let mut shift = [0.0; MOTIONS];
        for cell in 0..self.residual.len() {
            self.residual[cell] = self.freedom[cell].free(self.slip[cell]);
            self.direction[cell] = [0.0; A];
            self.step[cell] = [0.0; A];
        }
        let (mut product, mut first) = (0.0, 0.0);
        loop {
            self.precondition(|solver, cell| solver.residual[cell]);
            if !self.resultants.asked.is_empty() {
                let change = solve_small(&matrix, &self.resultants.sums(&self.work));
                for k in 0..MOTIONS {
                    shift[k] -= change[k];
                }
                for cell in 0..self.work.len() {
                    for (rigid, &(motion, _)) in self.rigid.iter().zip(&self.resultants.asked) {
                        self.work[cell] = plus(self.work[cell], -change[motion], rigid[cell]);
                    }
                    let field = self.resultants.field(&change, cell);
                    let freedom = self.freedom[cell];
                    self.residual[cell] = plus(self.residual[cell], -1.0, freedom.free(field));
                }
            }
            let (mut new_product, mut left) = (0.0, 0.0);
            for cell in 0..self.residual.len() {
                let r = self.residual[cell];
                new_product += dot(r, self.work[cell]);
                left += match self.freedom[cell] {
                    Freedom::Stick => self.limit[cell] * norm(r),
                    Freedom::Slip { compliance, .. } => 0.5 * dot(r, r) / compliance,
                };
            }
            if product == 0.0 {
                first = new_product;
            }
            if new_product <= 0.0
                || (product > 0.0 && (new_product <= forcing * forcing * first || left <= enough))
                || self.iterations >= self.options.max_iterations
            {
                return shift;
            }
            let beta = if product > 0.0 {
                new_product / product
            } else {
                0.0
            };
            product = new_product;
            for (direction, work) in self.direction.iter_mut().zip(&self.work) {
                *direction = plus(*work, beta, *direction);
            }
            self.operator.compliance(&self.direction, &mut self.image);
            let mut curvature = 0.0;
            for cell in 0..self.image.len() {
                let (freedom, direction) = (self.freedom[cell], self.direction[cell]);
                let mut image = freedom.free(self.image[cell]);
                if let Freedom::Slip { compliance, .. } = freedom {
                    image = plus(image, compliance, direction);
                }
                curvature += dot(direction, image);
                self.image[cell] = image;
            }
            if curvature <= 0.0 {
                return shift;
            }
            let length = product / curvature;
            for cell in 0..self.image.len() {
                self.step[cell] = plus(self.step[cell], length, self.direction[cell]);
                self.residual[cell] = plus(self.residual[cell], -length, self.image[cell]);
            }
            self.iterations += 1;
        }
    }

    /// Turns the direction in `step` into a step between points inside the discs that have the resultants asked for: slip
    /// cells turn, stick cells that leave their disc stop on its circle. False where there is none.
    fn turn_and_project(&mut self) -> bool {
        let balanced = !self.resultants.asked.is_empty();
        for cell in 0..self.step.len() {
            let (q, d, limit) = (self.shear[cell], self.step[cell], self.limit[cell]);
            let moved = match self.freedom[cell] {
                Freedom::Slip { tangent, .. } => {
                    let angle = dot(d, tangent) / limit;
                    let moved = turn(q, angle.clamp(-LARGEST_TURN, LARGEST_TURN));
                    let out = (limit / norm(q) - 1.0).max(0.0);
                    plus(moved, out, plus(q, 1.0, moved))
                }
                Freedom::Stick => {
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
            self.step[cell] = moved;
        }
        if !balanced {
            return true;
        }
        // A slip cell is held on its circle by its slip: the balance may take it off by no less.
        for cell in 0..self.step.len() {
            let outward = match self.freedom[cell] {
                Freedom::Slip { compliance, .. } => 1.0 + compliance / self.lambda,
                Freedom::Stick => 1.0,
            };
            let target = plus(self.shear[cell], 1.0, self.step[cell]);
            self.work[cell] = scaled(outward, target);
        }
        let Some(shift) = self.resultants.balance(&self.work, &self.limit) else {
            return false;
        };
        for cell in 0..self.step.len() {
            let target = plus(self.work[cell], 1.0, self.resultants.field(&shift, cell));
            let next = into_disc(target, self.limit[cell]);
            self.step[cell] = plus(next, -1.0, self.shear[cell]);
        }
        true
    }

    /// Projected gradient steps with the length of Barzilai and Borwein, each to the minimum on its chord: the energy falls at
    /// every one of them. False where not even the first falls.
    fn descend(&mut self) -> bool {
        self.freedom.fill(Freedom::Stick);
        let mut length = 1.0 / self.lambda;
        for taken in 0..GRADIENT_STEPS {
            for (step, s) in self.step.iter_mut().zip(&self.slip) {
                *step = scaled(length, *s);
            }
            if !self.turn_and_project() || self.advance(&[0.0; MOTIONS]).is_none() {
                return taken > 0;
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

    /// Takes the step, or the part of it that minimises F on the chord, and says which. None where F does not fall along it.
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
        // A curvature that is not positive is the rounding of one that vanishes: a periodic contact that moves as a whole.
        let full = curvature <= 0.0 || descent - 0.5 * curvature >= SUFFICIENT_DECREASE * descent;
        let part = if full {
            1.0
        } else {
            (descent / curvature).min(1.0)
        };
        for cell in 0..self.step.len() {
            self.shear[cell] = plus(self.shear[cell], part, self.step[cell]);
            self.slip[cell] = plus(self.slip[cell], -part, self.image[cell]);
        }
        if !self.resultants.asked.is_empty() {
            self.move_rigidly(&shift.map(|s| part * s));
        }
        Some(part)
    }
}

impl<const A: usize> Freedom<A> {
    /// The part of a vector in the free directions.
    fn free(self, vector: Vector<A>) -> Vector<A> {
        match self {
            Freedom::Stick => vector,
            Freedom::Slip { tangent, .. } => scaled(dot(vector, tangent), tangent),
        }
    }

    /// The same, scaled as the preconditioner has it.
    fn scaled(self, vector: Vector<A>, lambda: f64) -> Vector<A> {
        match self {
            Freedom::Stick => vector,
            Freedom::Slip {
                tangent,
                compliance,
            } => {
                let factor = (lambda / (lambda + compliance)).sqrt();
                scaled(factor * dot(vector, tangent), tangent)
            }
        }
    }
}

/// The part of the first residual at which an inner solve stops: loose while the cells still change.
fn forcing(error: f64) -> f64 {
    (FORCING * error.sqrt()).clamp(FORCINGS.0, FORCINGS.1)
}
