//! Direction of a Newton step: the free directions of each cell, and conjugate gradients in them.

use super::newton::{Gap, ON_CIRCLE, Solver};
use super::resultants::{MOTIONS, Motions, solve_small};
use super::vector::{Vector, dot, norm, plus, quarter_turn, scaled};

/// Assumed change of a shear near the circle |q| = µp due to the slip, divided by the step of a single cell.
const NEAR_STEP: f64 = 0.2;

/// Relative residual at which an inner solve stops, divided by the root of the error, and its bounds.
const FORCING: f64 = 0.3;
const FORCINGS: (f64, f64) = (1e-3, 0.1);

/// Free directions of the shear on a contact cell in a Newton step.
#[derive(Clone, Copy)]
pub(super) enum FreeDirections<const A: usize> {
    /// Both components of the shear of a stick cell are free.
    Stick,
    /// Only the angle of the shear of a slip cell is free. The shear changes along the unit tangent, and the compliance
    /// (s·q̂)/µp resists a rotation of the shear.
    Slip { tangent: Vector<A>, compliance: f64 },
}

impl<const A: usize> Solver<'_, '_, A> {
    /// Determines the free directions of each contact cell. Returns the number of cells that have changed between stick
    /// and slip, and the number of cells that stick.
    pub(super) fn set_free(&mut self) -> (usize, usize) {
        let (mut changed, mut sticking) = (0, 0);
        let push = NEAR_STEP / self.lambda;
        let shears = self.shear.iter().zip(&self.slip).zip(&self.limit);
        for (freedom, ((&q, &s), &limit)) in self.freedom.iter_mut().zip(shears) {
            let (size, along) = (norm(q), dot(q, s));
            let slips = along > 0.0
                && (size >= limit * (1.0 - ON_CIRCLE)
                    || (size >= limit * (1.0 - self.options.circle_width)
                        && norm(plus(q, push, s)) >= limit));
            changed += usize::from(slips == matches!(freedom, FreeDirections::Stick));
            sticking += usize::from(!slips);
            *freedom = if slips {
                FreeDirections::Slip {
                    tangent: scaled(1.0 / size, quarter_turn(q)),
                    compliance: along / (size * limit),
                }
            } else {
                FreeDirections::Stick
            };
        }
        (changed, sticking)
    }

    /// Computes `work` = P S M S P `source`: the preconditioner in the free directions P. S = √(λ/(λ + D)) scales the
    /// slip cells, because the half space matters little where a rotation is already stiff. [`super::coarse`] corrects
    /// M.
    pub(super) fn precondition(&mut self, source: &[Vector<A>]) {
        let lambda = self.lambda;
        for ((w, source), freedom) in self.work.iter_mut().zip(source).zip(&self.freedom) {
            *w = freedom.scaled(*source, lambda);
        }
        self.coarse.sum_source(&self.work);
        self.operator.stiffness(&mut self.work);
        self.coarse.correct(&mut self.work);
        for (w, freedom) in self.work.iter_mut().zip(&self.freedom) {
            *w = freedom.scaled(*w, lambda);
        }
    }

    /// Sets the coarse correction for the free directions.
    pub(super) fn set_springs(&mut self) {
        if !self.coarse.exists() {
            return;
        }
        let (freedom, lambda) = (&self.freedom, self.lambda);
        let [_, mean_stiffness] = self.operator.half_space().mean_stiffness();
        let unit = |axis: usize, cell: usize| {
            let mut unit = [0.0; A];
            unit[axis] = 1.0;
            freedom[cell].scaled(unit, lambda)
        };
        for (axis, springs) in self.coarse.springs.iter_mut().enumerate() {
            for (cell, s) in springs.iter_mut().enumerate() {
                *s = unit(axis, cell);
            }
            let mut mean = [0.0; A];
            for s in springs.iter() {
                mean = plus(mean, -mean_stiffness, *s);
            }
            self.operator.stiffness(springs);
            springs.iter_mut().for_each(|s| *s = plus(*s, 1.0, mean));
            for (s, freedom) in springs.iter_mut().zip(freedom) {
                *s = freedom.project(*s);
            }
        }
        self.coarse.prepare(unit);
    }

    /// Applies the preconditioner to each free rigid motion, and returns the matrix of their resultants.
    pub(super) fn rigid_fields(&mut self) -> [[f64; MOTIONS]; MOTIONS] {
        let mut matrix = [[0.0; MOTIONS]; MOTIONS];
        for k in 0..self.resultants.required.len() {
            let motion = self.resultants.required[k].0;
            let mut unit = std::mem::take(&mut self.rigid[k]);
            for (cell, unit) in unit.iter_mut().enumerate() {
                *unit = self.resultants.motion(motion, cell);
            }
            self.precondition(&unit);
            matrix[motion] = self.resultants.sums(&self.work);
            unit.copy_from_slice(&self.work);
            self.rigid[k] = unit;
        }
        matrix
    }

    /// Solves (K + D) step = s by conjugate gradients in the free directions at constant resultants. Stops when more
    /// accuracy would not pay off before the free directions are determined again. Returns the change of the rigid
    /// motions that belongs to the step.
    pub(super) fn newton_direction(&mut self, gap: Gap) -> Motions {
        let forcing = forcing(gap.error);
        let allowed_gap = self.options.inner_share * self.options.tolerance * gap.scale;
        self.set_springs();
        let matrix = self.rigid_fields();
        let mut shift = [0.0; MOTIONS];
        for cell in 0..self.residual.len() {
            self.residual[cell] = self.freedom[cell].project(self.slip[cell]);
            self.direction[cell] = [0.0; A];
            self.step[cell] = [0.0; A];
        }
        let (mut product, mut first) = (0.0, 0.0);
        loop {
            let residual = std::mem::take(&mut self.residual);
            self.precondition(&residual);
            self.residual = residual;
            if !self.resultants.required.is_empty() {
                let change = solve_small(&matrix, &self.resultants.sums(&self.work));
                for k in 0..MOTIONS {
                    shift[k] -= change[k];
                }
                for cell in 0..self.work.len() {
                    for (rigid, &(motion, _)) in self.rigid.iter().zip(&self.resultants.required) {
                        self.work[cell] = plus(self.work[cell], -change[motion], rigid[cell]);
                    }
                    let field = self.resultants.field(&change, cell);
                    let freedom = self.freedom[cell];
                    self.residual[cell] = plus(self.residual[cell], -1.0, freedom.project(field));
                }
            }
            let (mut new_product, mut remaining_gap) = (0.0, 0.0);
            for cell in 0..self.residual.len() {
                let r = self.residual[cell];
                new_product += dot(r, self.work[cell]);
                remaining_gap += match self.freedom[cell] {
                    FreeDirections::Stick => self.limit[cell] * norm(r),
                    FreeDirections::Slip { compliance, .. } => 0.5 * dot(r, r) / compliance,
                };
            }
            if product == 0.0 {
                first = new_product;
            }
            if new_product <= 0.0
                || (product > 0.0
                    && (new_product <= forcing * forcing * first || remaining_gap <= allowed_gap))
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
                let mut image = freedom.project(self.image[cell]);
                if let FreeDirections::Slip { compliance, .. } = freedom {
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
}

impl<const A: usize> FreeDirections<A> {
    /// Returns the part of a vector in the free directions.
    pub(super) fn project(self, vector: Vector<A>) -> Vector<A> {
        match self {
            FreeDirections::Stick => vector,
            FreeDirections::Slip { tangent, .. } => scaled(dot(vector, tangent), tangent),
        }
    }

    /// Returns the part of a vector in the free directions, scaled for the preconditioner.
    fn scaled(self, vector: Vector<A>, lambda: f64) -> Vector<A> {
        match self {
            FreeDirections::Stick => vector,
            FreeDirections::Slip {
                tangent,
                compliance,
            } => {
                let factor = (lambda / (lambda + compliance)).sqrt();
                scaled(factor * dot(vector, tangent), tangent)
            }
        }
    }
}

/// Returns the relative residual at which an inner solve stops. The relative residual is large while cells still change
/// between stick and slip.
fn forcing(error: f64) -> f64 {
    (FORCING * error.sqrt()).clamp(FORCINGS.0, FORCINGS.1)
}
