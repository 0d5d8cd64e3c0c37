//! One Newton step of the harmonic balance: residual, Jacobian, and what solves with it.

use std::cell::RefCell;

use num_complex::Complex64;

use super::aft::{Closure, InterfaceElement};
use super::closed_model::{Among, Precision};
use super::krylov::{self, Learned, dot};
use super::preconditioner::{ElementPart, Preconditioner};
use super::{DynamicsError, HarmonicBalance};
use crate::linalg::{Blocks, Factors, RowMatrix as Matrix, add_scaled};

/// Relative tolerance of a Newton step solved by GMRES. Steps of a nearly linear problem then gain four digits each.
pub(super) const STEP_TOLERANCE: f64 = 1e-4;
/// Relative change of frequency for derivatives by central differences; half-power bandwidths are above 1e-4.
const FREQUENCY_DIFFERENCE: f64 = 1e-6;
/// Least share of the tangential stiffness that is left, in the Jacobian alone, to a mean displacement of full slip. Full slip
/// forgets its mean, and a motion that friction alone holds would otherwise run away; what something else holds converges hardly
/// slower.
pub(super) const LEAST_GRIP: f64 = 1e-6;
/// Share of the largest square that regularises a step whose matrix is singular.
const REGULARISATION: f64 = 1e-13;

/// Unknowns: contact displacements (all of them; those of passive elements follow) and frequency.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub(super) omega: f64,
    pub(super) contact: Vec<f64>,
    pub(super) active: Vec<bool>,
}

/// What fixes the frequency.
#[derive(Debug, Clone)]
pub(super) enum Condition {
    /// It is given.
    Frequency,
    /// The sum of the terms and `by_omega` ω is `value`.
    Linear {
        terms: Vec<Term>,
        by_omega: f64,
        value: f64,
    },
}

/// `weights · (cosine, sine)` of the harmonic of a slot at a port.
#[derive(Debug, Clone, Copy)]
pub(super) struct Term {
    pub(super) port: usize,
    pub(super) slot: usize,
    pub(super) weights: [f64; 2],
}

impl Term {
    fn of(&self, row: &[f64]) -> f64 {
        self.weights[0] * row[self.slot] + self.weights[1] * row[self.slot + 1]
    }
}

impl Condition {
    /// That a term is zero.
    pub(super) fn zero(term: Term) -> Condition {
        Condition::Linear {
            terms: vec![term],
            by_omega: 0.0,
            value: 0.0,
        }
    }

    fn terms(&self) -> &[Term] {
        match self {
            Condition::Frequency => &[],
            Condition::Linear { terms, .. } => terms,
        }
    }

    /// The sum of the terms, of rows of `n` coefficients of all ports.
    fn of_ports(&self, rows: &[f64], n: usize) -> f64 {
        let terms = self.terms().iter();
        terms.map(|term| term.of(&rows[term.port * n..])).sum()
    }
}

/// Everything that Newton's method wants to know about a state.
pub(super) struct Evaluation {
    pub(super) cores: Vec<Matrix<Complex64>>,
    pub(super) elements: Vec<usize>,
    /// Contact degrees of freedom of the active elements, then ports with loads.
    ports: Vec<usize>,
    /// Forces on them: what is beyond the reference with the sign of a load, then loads.
    forces: Vec<f64>,
    /// Share of the loads.
    factor: f64,
    /// Jacobians of what is beyond the reference, one per active element; none if not asked for.
    pub(super) beyond: Vec<Matrix>,
    /// Contact forces of the active elements, and how well their cycles close.
    pub(super) contact: Vec<(Vec<f64>, Closure)>,
    pub(super) displacement: Vec<f64>,
    pub(super) residual: Vec<f64>,
    pub(super) condition: f64,
}

impl Evaluation {
    /// Whether it was asked for with Jacobians.
    pub(super) fn has_jacobians(&self) -> bool {
        self.beyond.len() == self.elements.len()
    }
}

/// What depends on the active elements alone.
pub(super) struct Frame {
    elements: Vec<usize>,
    /// Among their degrees of freedom.
    among: Among,
    /// The element part of the preconditioner, if there is one by now.
    part: Option<ElementPart>,
    /// What solving with it has learned.
    learned: RefCell<Learned>,
}

impl Frame {
    /// The element part of the preconditioner is to be made anew.
    pub(super) fn forget(&mut self) {
        self.part = None;
        *self.learned.borrow_mut() = Learned::default();
    }
}

pub(super) enum Solver<'a> {
    Dense(Factors),
    Regularised {
        matrix: Matrix,
        normal: Factors,
    },
    Krylov {
        /// G.
        beyond: Blocks,
        preconditioner: Preconditioner<'a>,
    },
}

/// A change of the active unknowns and of the frequency.
pub(super) struct Change {
    pub(super) unknowns: Vec<f64>,
    pub(super) omega: f64,
}

/// How the state and the condition move with frequency: the border of a Newton step.
pub(super) struct Slope {
    /// ∂ residual / ∂ω.
    residual: Vec<f64>,
    /// ∂ condition / ∂ω, and along each of the active unknowns.
    partial: f64,
    row: Vec<f64>,
    /// −J⁻¹ `residual`, or what the preconditioner makes of it.
    pub(super) motion: Vec<f64>,
    /// Derivative of the condition with frequency, the active unknowns moving by that.
    total: f64,
}

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Unknowns per element.
    pub(super) fn width(&self) -> usize {
        3 * self.harmonics().coefficients()
    }

    /// Residual of a state; with a `grip` (see [`LEAST_GRIP`]) Jacobians of the elements too.
    pub(super) fn evaluate(
        &self,
        state: &State,
        factor: f64,
        condition: &Condition,
        grip: Option<f64>,
    ) -> Result<Evaluation, DynamicsError> {
        let harmonics = self.harmonics();
        let n = harmonics.coefficients();
        let width = self.width();
        let cores = self.model.cores(harmonics, state.omega)?;
        let elements: Vec<usize> = (0..self.elements.len())
            .filter(|e| state.active[*e])
            .collect();
        let mut work = self.sampling.workspace();
        let mut ports: Vec<usize> = elements.iter().flat_map(|e| 3 * e..3 * e + 3).collect();
        let mut forces = vec![0.0; elements.len() * width];
        let mut beyond = Vec::new();
        let mut contact = Vec::with_capacity(elements.len());
        for (&element, g) in elements.iter().zip(forces.chunks_mut(width)) {
            let u = &state.contact[element * width..][..width];
            let law = &self.elements[element];
            let mut jacobian = grip.map(|_| Matrix::zeros(width, width));
            let values = jacobian.as_mut().map(Matrix::values_mut);
            let closure = self.sampling.evaluate(law, u, g, values, &mut work);
            self.effort.add_element(&closure, n);
            contact.push((g.to_vec(), closure));
            for d in 0..3 {
                let stiffness = self.reference[element][d];
                for i in d * n..(d + 1) * n {
                    g[i] = stiffness * u[i] - g[i];
                    if let Some(jacobian) = &mut jacobian {
                        jacobian.row_mut(i)[i] -= stiffness;
                    }
                }
                if let (Some(jacobian), Some(grip)) = (&mut jacobian, grip)
                    && d < 2
                {
                    jacobian.row_mut(d * n)[d * n] += grip * stiffness;
                }
            }
            beyond.extend(jacobian);
        }
        ports.extend(&self.load_ports);
        forces.extend(self.loads_at(state.omega, factor));
        let displacement = self.model.respond(harmonics, &cores, &ports, &forces, true);
        let mut residual = Vec::with_capacity(elements.len() * width);
        for &element in &elements {
            let range = element * width..(element + 1) * width;
            let pairs = state.contact[range.clone()]
                .iter()
                .zip(&displacement[range]);
            residual.extend(pairs.map(|(u, linear)| u - linear));
        }
        let condition = match condition {
            Condition::Frequency => 0.0,
            Condition::Linear {
                by_omega, value, ..
            } => condition.of_ports(&displacement, n) + by_omega * state.omega - value,
        };
        Ok(Evaluation {
            cores,
            elements,
            ports,
            forces,
            factor,
            beyond,
            contact,
            displacement,
            residual,
            condition,
        })
    }

    /// The frame of the active elements of `at`: the one at hand if it is theirs.
    pub(super) fn frame(
        &self,
        at: &Evaluation,
        old: Option<Frame>,
    ) -> Result<Frame, DynamicsError> {
        let mut frame = match old {
            Some(frame) if frame.elements == at.elements => frame,
            _ => {
                let elements = at.elements.iter();
                let ports: Vec<usize> = elements.flat_map(|e| 3 * e..3 * e + 3).collect();
                let precision = match self.wants_krylov(at.residual.len()) {
                    true => Precision::Single,
                    false => Precision::Double,
                };
                Frame {
                    elements: at.elements.clone(),
                    among: self.model.among(&ports, precision),
                    part: None,
                    learned: RefCell::default(),
                }
            }
        };
        if let (true, None, Some(basis)) = (
            self.wants_krylov(at.residual.len()),
            &frame.part,
            &self.model.basis,
        ) {
            let harmonics = self.harmonics();
            let (model, elements) = (&self.model, &at.elements);
            let part = ElementPart::new(model, basis, harmonics, elements, &at.beyond)?;
            frame.part = Some(part);
        }
        Ok(frame)
    }

    fn wants_krylov(&self, unknowns: usize) -> bool {
        let modal = self.model.leading * self.harmonics().coefficients();
        // The modal part is eliminated: it must be the smaller part.
        self.model.basis.is_some()
            && unknowns > self.settings.dense_unknowns
            && 2 * modal < unknowns
    }

    pub(super) fn solver<'a>(
        &'a self,
        at: &'a Evaluation,
        frame: &'a Frame,
    ) -> Result<Solver<'a>, DynamicsError> {
        if let (true, Some(part)) = (self.wants_krylov(at.residual.len()), &frame.part) {
            let harmonics = self.harmonics();
            return Ok(Solver::Krylov {
                beyond: Blocks::new(self.width(), at.beyond.iter()),
                preconditioner: Preconditioner::new(part, harmonics, &at.cores)?,
            });
        }
        let matrix = self.jacobian(at, frame);
        let of_matrix = DynamicsError::of_matrix("Jacobian of the harmonic balance");
        match matrix.clone().factorize().map_err(of_matrix) {
            Ok(factors) => Ok(Solver::Dense(factors)),
            // A mean position that friction leaves free (full sliding without a spring) has no equation: least squares with the
            // smallest step.
            Err(error) if error.is_singular() => {
                let mut normal = Matrix::zeros(matrix.columns(), matrix.columns());
                normal.add_transposed_product(&matrix, &matrix);
                let largest = (0..normal.rows()).fold(0.0_f64, |m, i| m.max(normal.at(i, i)));
                for i in 0..normal.rows() {
                    normal.set(i, i, normal.at(i, i) + REGULARISATION * largest);
                }
                let of_matrix =
                    DynamicsError::of_matrix("regularised Jacobian of the harmonic balance");
                let normal = normal.factorize().map_err(of_matrix)?;
                Ok(Solver::Regularised { matrix, normal })
            }
            Err(error) => Err(error),
        }
    }

    /// 1 + H G on the active unknowns.
    fn jacobian(&self, at: &Evaluation, frame: &Frame) -> Matrix {
        let harmonics = self.harmonics();
        let n = harmonics.coefficients();
        let width = self.width();
        let size = at.residual.len();
        let mut matrix = Matrix::identity(size);
        let dofs = size / n;
        for (index, core) in at.cores.iter().enumerate() {
            let block = frame.among.receptance(core);
            let slot = harmonics.slot(index);
            for i in 0..dofs {
                for j in 0..dofs {
                    let value = block.at(i, j);
                    let (element, d) = (j / 3, j % 3);
                    let columns = element * width..(element + 1) * width;
                    let source = |c: usize| at.beyond[element].row(d * n + c);
                    let target = &mut matrix.row_mut(i * n + slot)[columns.clone()];
                    add_scaled(target, value.re, source(slot));
                    if index > 0 {
                        add_scaled(target, value.im, source(slot + 1));
                        let target = &mut matrix.row_mut(i * n + slot + 1)[columns];
                        add_scaled(target, -value.im, source(slot));
                        add_scaled(target, value.re, source(slot + 1));
                    }
                }
            }
        }
        matrix
    }

    /// (1 + H G) v of v and `forces` G v.
    fn operate(&self, at: &Evaluation, frame: &Frame, forces: &[f64], v: &[f64]) -> Vec<f64> {
        let mut out = frame.among.respond(self.harmonics(), &at.cores, forces);
        add_scaled(&mut out, 1.0, v);
        out
    }

    /// −J⁻¹ `residual`, to a tolerance relative to it where that takes Krylov iterations, and how many.
    pub(super) fn step(
        &self,
        solver: &Solver<'_>,
        at: &Evaluation,
        frame: &Frame,
        residual: &[f64],
        tolerance: f64,
    ) -> Result<(Vec<f64>, usize), DynamicsError> {
        let Solver::Krylov {
            beyond,
            preconditioner,
        } = solver
        else {
            return Ok((solver.approximate(residual), 0));
        };
        let right: Vec<f64> = residual.iter().map(|r| -r).collect();
        let operator = |v: &[f64]| self.operate(at, frame, &beyond.apply(v), v);
        let precondition = |v: &[f64]| preconditioner.apply(v);
        if !self.is_costly {
            let solved = krylov::solve(operator, precondition, &right, tolerance)?;
            return Ok((solved.x, solved.iterations));
        }
        // Preconditioned from the left, so that what is left is small as a correction, which is what Newton's method measures: a mean
        // displacement that little holds is much of that for next to no residual.
        let mut memory = frame.learned.borrow_mut();
        let solved = krylov::solve(
            |v| precondition(&operator(v)),
            |v| memory.apply(v),
            &precondition(&right),
            tolerance,
        )?;
        memory.add(solved.learned);
        Ok((solved.x, solved.iterations))
    }

    /// The step of a bordered system to a relative tolerance, and the Krylov iterations it took: of the unknowns and of the frequency, of
    /// which `scale` makes what counts like an unknown, in one solution. The `slope` is that of the preconditioner, which with it
    /// inverts the border exactly.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn bordered_step(
        &self,
        solver: &Solver<'_>,
        at: &Evaluation,
        frame: &Frame,
        slope: &Slope,
        scale: f64,
        (residual, left): (&[f64], f64),
        tolerance: f64,
    ) -> Result<(Change, usize), DynamicsError> {
        let Solver::Krylov {
            beyond,
            preconditioner,
        } = solver
        else {
            let direct = solver.approximate(residual);
            return Ok((self.completed(Some(slope), (direct, left)), 0));
        };
        let n = residual.len();
        let operator = |v: &[f64]| {
            let (v, omega) = (&v[..n], v[n] / scale);
            let mut out = self.operate(at, frame, &beyond.apply(v), v);
            add_scaled(&mut out, omega, &slope.residual);
            out.push(dot(&slope.row, v) + slope.partial * omega);
            out
        };
        let precondition = |v: &[f64]| {
            let mut out = preconditioner.apply(&v[..n]);
            let omega = (v[n] - dot(&slope.row, &out)) / slope.total;
            add_scaled(&mut out, omega, &slope.motion);
            out.push(scale * omega);
            out
        };
        let right: Vec<f64> = residual.iter().chain([&left]).map(|r| -r).collect();
        let mut memory = frame.learned.borrow_mut();
        let solved = krylov::solve(
            |v| precondition(&operator(v)),
            |v| memory.apply(v),
            &precondition(&right),
            tolerance,
        )?;
        memory.add(solved.learned);
        let mut unknowns = solved.x;
        let omega = unknowns.pop().unwrap_or_default() / scale;
        Ok((Change { unknowns, omega }, solved.iterations))
    }

    /// How the state moves with frequency, and the condition with both.
    pub(super) fn slope(
        &self,
        at: &Evaluation,
        frame: &Frame,
        solver: &Solver<'_>,
        condition: &Condition,
        omega: f64,
        tolerance: f64,
    ) -> Result<Slope, DynamicsError> {
        self.slope_by(at, condition, omega, |residual| {
            let (motion, _) = self.step(solver, at, frame, residual, tolerance)?;
            Ok(motion)
        })
    }

    /// As [`Self::slope`], by the preconditioner alone.
    pub(super) fn rough_slope(
        &self,
        at: &Evaluation,
        solver: &Solver<'_>,
        condition: &Condition,
        omega: f64,
    ) -> Result<Slope, DynamicsError> {
        self.slope_by(at, condition, omega, |residual| {
            Ok(solver.approximate(residual))
        })
    }

    fn slope_by(
        &self,
        at: &Evaluation,
        condition: &Condition,
        omega: f64,
        step: impl FnOnce(&[f64]) -> Result<Vec<f64>, DynamicsError>,
    ) -> Result<Slope, DynamicsError> {
        let by_frequency = self.by_frequency(at, omega)?;
        let width = self.width();
        let elements = at.elements.iter();
        let rows = elements.flat_map(|e| &by_frequency[e * width..(e + 1) * width]);
        let residual: Vec<f64> = rows.map(|v| -v).collect();
        let motion = step(&residual)?;
        let partial = self.partial(condition, &by_frequency);
        let row = self.border(at, condition);
        Ok(Slope {
            total: partial + dot(&row, &motion),
            residual,
            partial,
            row,
            motion,
        })
    }

    /// ∂ condition / ∂ω at constant contact forces.
    fn partial(&self, condition: &Condition, by_frequency: &[f64]) -> f64 {
        match condition {
            Condition::Frequency => 0.0,
            Condition::Linear { by_omega, .. } => {
                condition.of_ports(by_frequency, self.harmonics().coefficients()) + by_omega
            }
        }
    }

    /// ∂ displacement of all ports / ∂ω at constant forces, but for loads that grow with frequency.
    fn by_frequency(&self, at: &Evaluation, omega: f64) -> Result<Vec<f64>, DynamicsError> {
        let step = FREQUENCY_DIFFERENCE * omega;
        let respond = |omega: f64| -> Result<Vec<f64>, DynamicsError> {
            let harmonics = self.harmonics();
            let cores = self.model.cores(harmonics, omega)?;
            let model = &self.model;
            if self.has_inertial_loads() {
                let loads = self.loads_at(omega, at.factor);
                let contact = &at.forces[..at.forces.len() - loads.len()];
                let forces = [contact, &loads].concat();
                return Ok(model.respond(harmonics, &cores, &at.ports, &forces, true));
            }
            Ok(model.respond(harmonics, &cores, &at.ports, &at.forces, false))
        };
        let (mut change, low) = (respond(omega + step)?, respond(omega - step)?);
        for (high, low) in change.iter_mut().zip(low) {
            *high = (*high - low) / (2.0 * step);
        }
        Ok(change)
    }

    /// The derivative of the condition along each active unknown: −cᵀ H G of the weights c of its terms. The transpose of the receptance
    /// of a harmonic, which is symmetric, is its conjugate, so that Hᵀ c is H c with the signs of all sines changed before and after.
    fn border(&self, at: &Evaluation, condition: &Condition) -> Vec<f64> {
        let terms = condition.terms();
        let harmonics = self.harmonics();
        let (n, width) = (harmonics.coefficients(), self.width());
        let ports: Vec<usize> = terms.iter().map(|term| term.port).collect();
        let mut weights = vec![0.0; terms.len() * n];
        for (term, row) in terms.iter().zip(weights.chunks_mut(n)) {
            row[term.slot] = term.weights[0];
            row[term.slot + 1] = -term.weights[1];
        }
        let mut response = self
            .model
            .respond(harmonics, &at.cores, &ports, &weights, true);
        for row in response.chunks_mut(n) {
            // A mean has no sine.
            row.iter_mut()
                .skip(2)
                .step_by(2)
                .for_each(|sine| *sine = -*sine);
        }
        let blocks = at.elements.iter().zip(&at.beyond);
        let rows = blocks.flat_map(|(element, jacobian)| {
            let response = &response[element * width..][..width];
            let mut row = vec![0.0; width];
            for (i, value) in response.iter().enumerate() {
                add_scaled(&mut row, -value, jacobian.row(i));
            }
            row
        });
        rows.collect()
    }

    /// Block elimination of the bordered system: `direct` = −J⁻¹ r is completed by the motion with frequency.
    pub(super) fn completed(
        &self,
        slope: Option<&Slope>,
        (mut direct, left): (Vec<f64>, f64),
    ) -> Change {
        let Some(slope) = slope else {
            return Change {
                unknowns: direct,
                omega: 0.0,
            };
        };
        let omega = -(left + dot(&slope.row, &direct)) / slope.total;
        add_scaled(&mut direct, omega, &slope.motion);
        Change {
            unknowns: direct,
            omega,
        }
    }

    /// Derivative of the first harmonic (cosine, sine) at `port` with respect to frequency along the branch of a response.
    pub(super) fn port_slope(
        &self,
        response: &super::Response,
        port: usize,
        slot: usize,
    ) -> Result<[f64; 2], DynamicsError> {
        let state = State {
            omega: response.omega,
            contact: response.displacement[..response.force.len()].to_vec(),
            active: response.active.clone(),
        };
        let condition = |weights| {
            Condition::zero(Term {
                port,
                slot,
                weights,
            })
        };
        let (cosine, sine) = (condition([1.0, 0.0]), condition([0.0, 1.0]));
        let at = self.evaluate(&state, response.load_factor, &cosine, Some(LEAST_GRIP))?;
        let frame = self.frame(&at, None)?;
        let solver = self.solver(&at, &frame)?;
        let omega = state.omega;
        let slope = self.slope(&at, &frame, &solver, &cosine, omega, STEP_TOLERANCE)?;
        let by_frequency = self.by_frequency(&at, omega)?;
        let of_sine =
            self.partial(&sine, &by_frequency) + dot(&self.border(&at, &sine), &slope.motion);
        Ok([slope.total, of_sine])
    }
}

impl Solver<'_> {
    /// −J⁻¹ `residual` with what is at hand, without iterating.
    pub(super) fn approximate(&self, residual: &[f64]) -> Vec<f64> {
        let mut out: Vec<f64> = residual.iter().map(|r| -r).collect();
        match self {
            Solver::Dense(factors) => factors.solve(&mut out),
            Solver::Regularised { matrix, normal } => {
                out = matrix.transposed().apply(&out);
                normal.solve(&mut out);
            }
            Solver::Krylov { preconditioner, .. } => out = preconditioner.apply(&out),
        }
        out
    }
}
