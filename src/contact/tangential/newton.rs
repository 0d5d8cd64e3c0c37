//! The semi-smooth Newton method.

use super::{
    CellState, TangentialOptions, TangentialProblem, TangentialSolution, compliance, stiffness,
};
use crate::contact::error::ContactError;
use crate::contact::half_space::HalfSpace;
use crate::grid::ByAxis;

/// Dissipation below this part of that of gross slip counts as if it were that much in the relative gap: the gap would lose
/// its meaning where everything sticks.
const DISSIPATION_FLOOR: f64 = 1e-4;

/// A shear this close to its limit is on it: rounding of a projection onto the circle.
const ON_CIRCLE: f64 = 1e-12;

/// Largest turn of the shear's direction on a slip cell in one Newton step \[rad\].
const LARGEST_TURN: f64 = 1.0;

/// The least part of the decrease predicted by the slope that a full Newton step must reach.
const SUFFICIENT_DECREASE: f64 = 1e-4;

fn zeros(axes: usize, cells: usize) -> ByAxis<Vec<f64>> {
    vec![vec![0.0; cells]; axes]
}

fn norm(field: &ByAxis<Vec<f64>>, c: usize) -> f64 {
    match &field[..] {
        [x] => x[c].abs(),
        [x, y] => x[c].hypot(y[c]),
        _ => 0.0,
    }
}

fn dot(a: &ByAxis<Vec<f64>>, b: &ByAxis<Vec<f64>>, c: usize) -> f64 {
    a.iter().zip(b).map(|(a, b)| a[c] * b[c]).sum()
}

/// Both components at a cell, an absent one as zero.
fn pair(field: &ByAxis<Vec<f64>>, c: usize) -> [f64; 2] {
    [field[0][c], field.get(1).map_or(0.0, |y| y[c])]
}

/// The change of a vector that turns by an angle. Written without a difference of nearly equal numbers: beside the slip of
/// sliding cells, rounding of their shear would drown the last steps of the sticking ones.
fn turn(vector: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, half) = (angle.sin(), (0.5 * angle).sin());
    let shrink = -2.0 * half * half;
    [
        shrink * vector[0] - sin * vector[1],
        shrink * vector[1] + sin * vector[0],
    ]
}

/// What is free to change on a contact cell in a Newton step.
#[derive(Clone, Copy)]
enum Freedom {
    /// Both components of the shear.
    Stick,
    /// The angle: the unit tangent, and (s·q̂)/µp, the compliance that a turn of the shear meets.
    Slip { tangent: [f64; 2], compliance: f64 },
}

pub(super) struct Solver<'a, 'h> {
    half_space: &'h mut HalfSpace,
    problem: &'a TangentialProblem<'a>,
    options: TangentialOptions,
    axes: usize,
    /// Positions of the cells in contact, and what is free on each.
    contact: Vec<usize>,
    freedom: Vec<Freedom>,
    lambda: f64,
    shear: ByAxis<Vec<f64>>,
    slip: ByAxis<Vec<f64>>,
    step: ByAxis<Vec<f64>>,
    direction: ByAxis<Vec<f64>>,
    image: ByAxis<Vec<f64>>,
    residual: ByAxis<Vec<f64>>,
    work: ByAxis<Vec<f64>>,
    iterations: usize,
}

impl<'a, 'h> Solver<'a, 'h> {
    pub(super) fn new(
        half_space: &'h mut HalfSpace,
        problem: &'a TangentialProblem<'a>,
        options: TangentialOptions,
    ) -> Self {
        let (axes, cells) = (problem.displacement.len(), problem.patch.grid.len());
        let contact: Vec<usize> = (0..cells)
            .filter(|&c| problem.patch.kept[c] && problem.limit[c] > 0.0)
            .collect();
        let lambda = half_space.self_shear_compliance();
        Solver {
            half_space,
            problem,
            options,
            axes,
            freedom: vec![Freedom::Stick; contact.len()],
            contact,
            lambda,
            shear: zeros(axes, cells),
            slip: zeros(axes, cells),
            step: zeros(axes, cells),
            direction: zeros(axes, cells),
            image: zeros(axes, cells),
            residual: zeros(axes, cells),
            work: zeros(axes, cells),
            iterations: 0,
        }
    }

    pub(super) fn run(
        mut self,
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<TangentialSolution, ContactError> {
        if let Some(first) = start.or(self.problem.previous) {
            for &c in &self.contact {
                for axis in 0..self.axes {
                    self.shear[axis][c] = first[axis][c];
                }
            }
            self.project();
        }
        self.first_slip();
        let mut steps = 0;
        loop {
            let error = self.error();
            if error <= self.options.tolerance {
                return Ok(self.finish(steps, error));
            }
            if steps >= self.options.max_steps || self.iterations >= self.options.max_iterations {
                let tolerance = self.options.tolerance;
                return Err(ContactError::NotConverged {
                    problem: "tangential",
                    iterations: steps,
                    error,
                    tolerance,
                });
            }
            self.set_free();
            self.newton_direction(error);
            self.turn_and_project();
            if !self.advance() {
                self.gradient_direction();
                if !self.advance() {
                    let tolerance = self.options.tolerance;
                    return Err(ContactError::NotConverged {
                        problem: "tangential",
                        iterations: steps,
                        error,
                        tolerance,
                    });
                }
            }
            steps += 1;
        }
    }

    /// s = Δδ − K(q − q₀) from scratch.
    fn first_slip(&mut self) {
        for axis in 0..self.axes {
            self.work[axis].copy_from_slice(&self.shear[axis]);
            if let Some(previous) = self.problem.previous {
                for (w, p) in self.work[axis].iter_mut().zip(&previous[axis]) {
                    *w -= p;
                }
            }
        }
        compliance(self.half_space, &self.work, &mut self.image);
        for axis in 0..self.axes {
            for (s, u) in self.slip[axis].iter_mut().zip(&self.image[axis]) {
                *s = self.problem.displacement[axis] - u;
            }
        }
    }

    /// True where the shear is at its limit and along the slip.
    fn slips(&self, c: usize, along: f64) -> bool {
        norm(&self.shear, c) >= self.problem.limit[c] * (1.0 - ON_CIRCLE) && along > 0.0
    }

    /// The relative duality gap.
    fn error(&self) -> f64 {
        let (mut gap, mut bound, mut limits, mut reach) = (0.0, 0.0, 0.0, 0.0f64);
        for &c in &self.contact {
            let full = self.problem.limit[c] * norm(&self.slip, c);
            let along = dot(&self.shear, &self.slip, c);
            // What is left of the slip of a stick cell will be taken as none: all that it would dissipate is an error.
            gap += if self.slips(c, along) {
                full - along
            } else {
                full.max(full - along)
            };
            bound += full;
            limits += self.problem.limit[c];
            reach = reach.max(self.elastic_displacement(c));
        }
        let motion = self
            .problem
            .displacement
            .iter()
            .map(|d| d * d)
            .sum::<f64>()
            .sqrt();
        let scale = bound.max(DISSIPATION_FLOOR * limits * motion.max(reach));
        // Rounding can leave a sum of exact complements slightly negative.
        if gap <= 0.0 { 0.0 } else { gap / scale }
    }

    fn elastic_displacement(&self, c: usize) -> f64 {
        let square =
            (0..self.axes).map(|a| (self.problem.displacement[a] - self.slip[a][c]).powi(2));
        square.sum::<f64>().sqrt()
    }

    /// Decides what is free on each contact cell.
    fn set_free(&mut self) {
        for (freedom, &c) in self.freedom.iter_mut().zip(&self.contact) {
            let limit = self.problem.limit[c];
            let size = norm(&self.shear, c);
            let along = dot(&self.shear, &self.slip, c);
            *freedom = if size >= limit * (1.0 - ON_CIRCLE) && along > 0.0 {
                let tangent = match &self.shear[..] {
                    [x, y] => [-y[c] / size, x[c] / size],
                    _ => [0.0, 0.0],
                };
                Freedom::Slip {
                    tangent,
                    compliance: along / (size * limit),
                }
            } else {
                Freedom::Stick
            };
        }
    }

    /// Restricts `field` to the free directions, in place, on contact cells.
    fn restrict(&self, field: &mut ByAxis<Vec<f64>>) {
        for (freedom, &c) in self.freedom.iter().zip(&self.contact) {
            if let Freedom::Slip { tangent, .. } = freedom {
                let along: f64 = field.iter().zip(tangent).map(|(f, t)| f[c] * t).sum();
                for (f, t) in field.iter_mut().zip(tangent) {
                    f[c] = along * t;
                }
            }
        }
    }

    /// Scales the slip cells' part by √(λ/(λ + D)): where a turn is stiff already, the half space counts little.
    fn scale(&self, field: &mut ByAxis<Vec<f64>>) {
        for (freedom, &c) in self.freedom.iter().zip(&self.contact) {
            if let Freedom::Slip { compliance, .. } = freedom {
                let factor = (self.lambda / (self.lambda + compliance)).sqrt();
                for f in field.iter_mut() {
                    f[c] *= factor;
                }
            }
        }
    }

    /// Conjugate gradients for (K + D) step = s in the free directions, to a part of the error.
    fn newton_direction(&mut self, error: f64) {
        let forcing = (0.3 * error.sqrt()).clamp(1e-3, 0.1);
        let (axes, mut residual, mut work) = (
            self.axes,
            std::mem::take(&mut self.residual),
            std::mem::take(&mut self.work),
        );
        let mut direction = std::mem::take(&mut self.direction);
        for axis in 0..axes {
            residual[axis].fill(0.0);
            direction[axis].fill(0.0);
            self.step[axis].fill(0.0);
            for &c in &self.contact {
                residual[axis][c] = self.slip[axis][c];
            }
        }
        self.restrict(&mut residual);
        let (mut product, mut first) = (0.0, 0.0);
        loop {
            for axis in 0..axes {
                work[axis].fill(0.0);
                for &c in &self.contact {
                    work[axis][c] = residual[axis][c];
                }
            }
            self.scale(&mut work);
            stiffness(self.half_space, &work, &mut self.image);
            let mut image = std::mem::take(&mut self.image);
            self.restrict(&mut image);
            self.scale(&mut image);
            let new_product: f64 = self
                .contact
                .iter()
                .map(|&c| dot(&residual, &image, c))
                .sum();
            if first == 0.0 {
                first = new_product;
            }
            let enough = product > 0.0 && new_product <= forcing * forcing * first;
            if enough || new_product <= 0.0 || self.iterations >= self.options.max_iterations {
                self.image = image;
                break;
            }
            let beta = if product > 0.0 {
                new_product / product
            } else {
                0.0
            };
            product = new_product;
            for axis in 0..axes {
                for &c in &self.contact {
                    direction[axis][c] = image[axis][c] + beta * direction[axis][c];
                }
            }
            compliance(self.half_space, &direction, &mut image);
            self.restrict(&mut image);
            for (freedom, &c) in self.freedom.iter().zip(&self.contact) {
                if let Freedom::Slip { compliance, .. } = freedom {
                    for axis in 0..axes {
                        image[axis][c] += compliance * direction[axis][c];
                    }
                }
            }
            let curvature: f64 = self
                .contact
                .iter()
                .map(|&c| dot(&direction, &image, c))
                .sum();
            if curvature <= 0.0 {
                self.image = image;
                break;
            }
            let length = product / curvature;
            for axis in 0..axes {
                for &c in &self.contact {
                    self.step[axis][c] += length * direction[axis][c];
                    residual[axis][c] -= length * image[axis][c];
                }
            }
            self.image = image;
            self.iterations += 1;
        }
        (self.residual, self.work, self.direction) = (residual, work, direction);
    }

    /// Turns the Newton direction into a step between points inside the discs: slip cells turn, stick cells that leave
    /// their disc stop on its circle.
    fn turn_and_project(&mut self) {
        for (freedom, &c) in self.freedom.iter().zip(&self.contact) {
            let limit = self.problem.limit[c];
            let (q, d) = (pair(&self.shear, c), pair(&self.step, c));
            let moved = match freedom {
                Freedom::Slip { tangent, .. } => {
                    let along = d[0] * tangent[0] + d[1] * tangent[1];
                    turn(q, (along / limit).clamp(-LARGEST_TURN, LARGEST_TURN))
                }
                Freedom::Stick => {
                    let target = [q[0] + d[0], q[1] + d[1]];
                    let size = target[0].hypot(target[1]);
                    if size <= limit {
                        d
                    } else if q[0].hypot(q[1]) >= limit * (1.0 - ON_CIRCLE) {
                        turn(
                            q,
                            (q[0] * target[1] - q[1] * target[0])
                                .atan2(q[0] * target[0] + q[1] * target[1]),
                        )
                    } else {
                        [
                            target[0] * (limit / size) - q[0],
                            target[1] * (limit / size) - q[1],
                        ]
                    }
                }
            };
            for axis in 0..self.axes {
                self.step[axis][c] = moved[axis];
            }
        }
    }

    /// The projected gradient step: the shear moved along the slip by one over the cell's own compliance, back in its disc.
    fn gradient_direction(&mut self) {
        self.freedom.fill(Freedom::Stick);
        for axis in 0..self.axes {
            self.step[axis].fill(0.0);
            for &c in &self.contact {
                self.step[axis][c] = self.slip[axis][c] / self.lambda;
            }
        }
        self.turn_and_project();
    }

    /// Takes the step, or the part of it that minimises F on the chord. False where F does not fall along it.
    fn advance(&mut self) -> bool {
        compliance(self.half_space, &self.step, &mut self.image);
        let (mut descent, mut curvature) = (0.0, 0.0);
        for &c in &self.contact {
            descent += dot(&self.slip, &self.step, c);
            curvature += dot(&self.image, &self.step, c);
        }
        if descent <= 0.0 {
            return false;
        }
        // A curvature that is not positive is the rounding of one that vanishes: a periodic contact that moves as a whole.
        let full = curvature <= 0.0 || descent - 0.5 * curvature >= SUFFICIENT_DECREASE * descent;
        let part = if full {
            1.0
        } else {
            (descent / curvature).min(1.0)
        };
        for axis in 0..self.axes {
            for &c in &self.contact {
                self.shear[axis][c] += part * self.step[axis][c];
            }
            for (s, u) in self.slip[axis].iter_mut().zip(&self.image[axis]) {
                *s -= part * u;
            }
        }
        true
    }

    /// Puts shears beyond their limit on the circle.
    fn project(&mut self) {
        for &c in &self.contact {
            let size = norm(&self.shear, c);
            if size > self.problem.limit[c] {
                for axis in 0..self.axes {
                    self.shear[axis][c] *= self.problem.limit[c] / size;
                }
            }
        }
    }

    fn finish(mut self, steps: usize, error: f64) -> TangentialSolution {
        self.set_free();
        let cell_area = self.problem.patch.grid.cell_area();
        let mut state = vec![CellState::Open; self.problem.limit.len()];
        for (freedom, &c) in self.freedom.iter().zip(&self.contact) {
            state[c] = match freedom {
                Freedom::Slip { .. } => CellState::Slip,
                Freedom::Stick => CellState::Stick,
            };
        }
        for slip in &mut self.slip {
            for (c, s) in slip.iter_mut().enumerate() {
                if state[c] == CellState::Stick || !self.problem.patch.kept[c] {
                    *s = 0.0;
                }
            }
        }
        let dissipation = cell_area
            * self
                .contact
                .iter()
                .map(|&c| dot(&self.shear, &self.slip, c))
                .sum::<f64>();
        let force = self
            .shear
            .iter()
            .map(|q| cell_area * q.iter().sum::<f64>())
            .collect();
        TangentialSolution {
            shear: self.shear,
            slip: self.slip,
            state,
            force,
            dissipation,
            steps,
            iterations: self.iterations,
            error,
        }
    }
}
