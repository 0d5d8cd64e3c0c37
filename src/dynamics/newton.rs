//! Newton's method for the harmonic balance, with one more unknown (the frequency) and condition if asked for.
//!
//! Steps are measured by the correction that the factor at hand gives for the residual after them, so acceptance does not depend
//! on units or on how near a resonance the structure is (natural monotonicity: Deuflhard, Newton Methods for Nonlinear Problems,
//! §3.3).

use num_complex::Complex64;

use super::aft::InterfaceElement;
use super::dense::{Factors, Matrix};
use super::krylov::{self, ElementPart, Preconditioner, dot, norm};
use super::{DynamicsError, HarmonicBalance, Response};

/// The correction must shrink by this share of the step's length.
const DESCENT: f64 = 0.25;
/// Step lengths tried: 1, ½, … ; a kink of the friction law is passed by one of them or by none.
const HALVINGS: u32 = 6;
/// Steps in a row that may fail to descend: the law has kinks, across which a full step often helps although it looks worse.
const TRIALS: usize = 3;
/// Relative tolerance of a Newton step solved by GMRES. Steps of a nearly linear problem then gain four digits each.
const STEP_TOLERANCE: f64 = 1e-4;
/// Krylov iterations from which the element part of the preconditioner is made anew.
const STALE: usize = 25;
/// Relative change of frequency for derivatives by central differences; half-power bandwidths are above 1e-4.
const FREQUENCY_DIFFERENCE: f64 = 1e-6;
/// Weight of a relative change of frequency against one of displacement: amplitudes change by 100 % within about 1 %.
const FREQUENCY_WEIGHT: f64 = 100.0;
/// Share of the tangential stiffness that is left, in the Jacobian alone, to a mean displacement of full slip. Full slip forgets its
/// mean, and a motion that friction alone holds would otherwise run away; what something else holds converges hardly slower.
const MEAN_GRIP: f64 = 1e-6;
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
#[derive(Debug, Clone, Copy)]
pub(super) enum Condition {
    /// It is given.
    Frequency,
    /// `weights · (cosine, sine, ω) = value`, with the coefficients of the first harmonic at `port`.
    Linear {
        port: usize,
        slot: usize,
        weights: [f64; 3],
        value: f64,
    },
}

/// Everything that Newton's method wants to know about a state.
struct Evaluation {
    cores: Vec<Matrix<Complex64>>,
    elements: Vec<usize>,
    /// Contact degrees of freedom of the active elements, then ports with loads.
    ports: Vec<usize>,
    /// Forces on them: what is beyond the reference with the sign of a load, then loads.
    forces: Vec<f64>,
    /// Jacobians of what is beyond the reference.
    beyond: Vec<Vec<f64>>,
    displacement: Vec<f64>,
    residual: Vec<f64>,
    condition: f64,
}

enum Solver<'a> {
    Dense(Factors),
    Regularised { matrix: Matrix, normal: Factors },
    Krylov(Preconditioner<'a>),
}

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Converges `state` at the load `factor`.
    pub(super) fn newton(
        &self,
        mut state: State,
        factor: f64,
        condition: &Condition,
    ) -> Result<Response, DynamicsError> {
        let mut at = self.evaluate(&state, factor, condition)?;
        let mut part: Option<(Vec<usize>, ElementPart)> = None;
        let mut failures = 0;
        let mut correction = f64::INFINITY;
        // The last one measured, for the error.
        let mut reached = f64::INFINITY;
        for iteration in 0..=self.settings.most_iterations {
            while self.enlarge(&mut state, &at) {
                at = self.evaluate(&state, factor, condition)?;
                correction = f64::INFINITY;
            }
            let free = matches!(condition, Condition::Frequency);
            if (at.elements.is_empty() && free) || correction <= self.settings.tolerance {
                let correction = if correction.is_finite() {
                    correction
                } else {
                    0.0
                };
                return self.response(state, factor, at.displacement, iteration, correction);
            }
            if iteration == self.settings.most_iterations {
                break;
            }
            if self.wants_krylov(at.residual.len())
                && part
                    .as_ref()
                    .is_none_or(|(elements, _)| *elements != at.elements)
            {
                part = Some((at.elements.clone(), self.element_part(&at)?));
            }
            let solver = self.solver(&at, part.as_ref().map(|(_, part)| part))?;
            let slope = match condition {
                Condition::Frequency => None,
                Condition::Linear { .. } => {
                    Some(self.slope(&at, &state, factor, &solver, condition)?)
                }
            };
            let (direct, effort) = self.step(&solver, &at, &at.residual)?;
            let step = bordered(
                direct,
                slope.as_ref(),
                &self.border(&at, condition),
                at.condition,
            );
            let reach = Reach::of(&state, &at, self.width());
            let measured = self.measure(&solver, &at, slope.as_ref(), condition, &at);
            let before = reach.size(&measured);
            if reach.size(&step) <= self.settings.tolerance && before <= self.settings.tolerance {
                correction = reach.size(&step);
                continue;
            }
            let mut best: Option<(f64, f64, State, Evaluation)> = None;
            for halving in 0..HALVINGS {
                let length = 0.5_f64.powi(halving as i32);
                let trial = self.moved(&state, &at, &step, length);
                if trial.omega <= 0.0 {
                    continue;
                }
                let there = self.evaluate(&trial, factor, condition)?;
                let left =
                    reach.size(&self.measure(&solver, &at, slope.as_ref(), condition, &there));
                let enough = left <= (1.0 - DESCENT * length) * before;
                if best.as_ref().is_none_or(|(b, ..)| left < *b) {
                    best = Some((left, length, trial, there));
                }
                if enough {
                    break;
                }
            }
            let Some((left, length, trial, there)) = best else {
                break;
            };
            reached = left;
            if left < before {
                failures = 0;
                correction = if length == 1.0 { left } else { f64::INFINITY };
                (state, at) = (trial, there);
            } else if left <= self.settings.tolerance {
                // Rounding: neither better nor worse.
                correction = left;
            } else {
                failures += 1;
                correction = f64::INFINITY;
                if failures > TRIALS || !left.is_finite() {
                    break;
                }
                let trial = self.moved(&state, &at, &step, 1.0);
                if trial.omega <= 0.0 {
                    break;
                }
                at = self.evaluate(&trial, factor, condition)?;
                state = trial;
            }
            if effort > STALE {
                part = None;
            }
        }
        Err(DynamicsError::NotConverged {
            frequency: state.omega / (2.0 * std::f64::consts::PI),
            load_factor: factor,
            iterations: self.settings.most_iterations,
            correction: reached,
            tolerance: self.settings.tolerance,
            active: at.elements.len(),
            elements: self.elements.len(),
        })
    }

    /// Unknowns per element.
    fn width(&self) -> usize {
        3 * self.harmonics().coefficients()
    }

    fn evaluate(
        &self,
        state: &State,
        factor: f64,
        condition: &Condition,
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
        let mut beyond = Vec::with_capacity(elements.len());
        for (&element, g) in elements.iter().zip(forces.chunks_mut(width)) {
            let u = &state.contact[element * width..][..width];
            let mut jacobian = vec![0.0; width * width];
            let law = &self.elements[element];
            self.sampling
                .evaluate(law, u, g, Some(&mut jacobian), &mut work);
            for d in 0..3 {
                let stiffness = self.reference[element][d];
                for i in d * n..(d + 1) * n {
                    g[i] = stiffness * u[i] - g[i];
                    jacobian[i * width + i] -= stiffness;
                }
                if d < 2 {
                    jacobian[d * n * (width + 1)] += MEAN_GRIP * stiffness;
                }
            }
            beyond.push(jacobian);
        }
        ports.extend(&self.load_ports);
        forces.extend(self.load_rows.iter().map(|f| factor * f));
        let displacement = self.model.respond(harmonics, &cores, &ports, &forces, true);
        let mut residual = Vec::with_capacity(elements.len() * width);
        for &element in &elements {
            let range = element * width..(element + 1) * width;
            let pairs = state.contact[range.clone()]
                .iter()
                .zip(&displacement[range]);
            residual.extend(pairs.map(|(u, linear)| u - linear));
        }
        let condition = match *condition {
            Condition::Frequency => 0.0,
            Condition::Linear {
                port,
                slot,
                weights,
                value,
            } => {
                let row = &displacement[port * n..][..n];
                weights[0] * row[slot] + weights[1] * row[slot + 1] + weights[2] * state.omega
                    - value
            }
        };
        Ok(Evaluation {
            cores,
            elements,
            ports,
            forces,
            beyond,
            displacement,
            residual,
            condition,
        })
    }

    /// Gives passive elements the displacement that follows, and unknowns to those that slip or open. Whether any did.
    fn enlarge(&self, state: &mut State, at: &Evaluation) -> bool {
        let width = self.width();
        let mut grown = false;
        for (index, element) in self.elements.iter().enumerate() {
            if state.active[index] {
                continue;
            }
            let row = &at.displacement[index * width..][..width];
            state.contact[index * width..][..width].copy_from_slice(row);
            if !element.follows_reference(&self.sampling.synthesise(row)) {
                state.active[index] = true;
                grown = true;
            }
        }
        grown
    }

    fn wants_krylov(&self, unknowns: usize) -> bool {
        let modal = self.model.core.coordinates() * self.harmonics().coefficients();
        // The modal part is eliminated: it must be the smaller part.
        self.model.basis.is_some()
            && unknowns > self.settings.dense_unknowns
            && 2 * modal < unknowns
    }

    fn element_part(&self, at: &Evaluation) -> Result<ElementPart, DynamicsError> {
        let Some(basis) = &self.model.basis else {
            return Err(DynamicsError::Length {
                what: "basis of the structure",
                found: 0,
                expected: self.model.ports(),
            });
        };
        ElementPart::new(
            &self.model,
            basis,
            self.harmonics(),
            &at.elements,
            &at.beyond,
        )
    }

    fn solver<'a>(
        &'a self,
        at: &'a Evaluation,
        part: Option<&'a ElementPart>,
    ) -> Result<Solver<'a>, DynamicsError> {
        if let (true, Some(part)) = (self.wants_krylov(at.residual.len()), part) {
            return Ok(Solver::Krylov(Preconditioner::new(
                part,
                self.harmonics(),
                &at.cores,
            )?));
        }
        let matrix = self.jacobian(at);
        match Factors::new(matrix.clone(), "Jacobian of the harmonic balance") {
            Ok(factors) => Ok(Solver::Dense(factors)),
            // A mean position that friction leaves free (full sliding without a spring) has no equation: least squares with the
            // smallest step.
            Err(DynamicsError::Singular { .. }) => {
                let transposed = matrix.transposed();
                let mut normal = transposed.times(&matrix);
                let largest = (0..normal.rows()).fold(0.0_f64, |m, i| m.max(normal.at(i, i)));
                for i in 0..normal.rows() {
                    normal.set(i, i, normal.at(i, i) + REGULARISATION * largest);
                }
                let normal = Factors::new(normal, "regularised Jacobian of the harmonic balance")?;
                Ok(Solver::Regularised { matrix, normal })
            }
            Err(error) => Err(error),
        }
    }

    /// 1 + H G on the active unknowns.
    fn jacobian(&self, at: &Evaluation) -> Matrix {
        let harmonics = self.harmonics();
        let n = harmonics.coefficients();
        let width = self.width();
        let size = at.residual.len();
        let mut matrix = Matrix::identity(size);
        let dofs = &at.ports[..size / n];
        for (index, core) in at.cores.iter().enumerate() {
            let block = self.model.block(core, dofs);
            let slot = harmonics.slot(index);
            for i in 0..dofs.len() {
                for j in 0..dofs.len() {
                    let value = block.at(i, j);
                    let (element, d) = (j / 3, j % 3);
                    let columns = element * width..(element + 1) * width;
                    let source = |c: usize| &at.beyond[element][(d * n + c) * width..][..width];
                    let target = &mut matrix.row_mut(i * n + slot)[columns.clone()];
                    super::dense::add_scaled(target, value.re, source(slot));
                    if index > 0 {
                        super::dense::add_scaled(target, value.im, source(slot + 1));
                        let target = &mut matrix.row_mut(i * n + slot + 1)[columns];
                        super::dense::add_scaled(target, -value.im, source(slot));
                        super::dense::add_scaled(target, value.re, source(slot + 1));
                    }
                }
            }
        }
        matrix
    }

    /// (1 + H G) v, and H G v at all ports.
    fn operate(&self, at: &Evaluation, v: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let width = self.width();
        let n = self.harmonics().coefficients();
        let mut forces = Vec::with_capacity(v.len());
        for (jacobian, v) in at.beyond.iter().zip(v.chunks(width)) {
            forces.extend(jacobian.chunks(width).map(|row| dot(row, v)));
        }
        let dofs = &at.ports[..v.len() / n];
        let all = self
            .model
            .respond(self.harmonics(), &at.cores, dofs, &forces, true);
        let mut out = v.to_vec();
        for (out, &element) in out.chunks_mut(width).zip(&at.elements) {
            for (out, value) in out.iter_mut().zip(&all[element * width..]) {
                *out += value;
            }
        }
        (out, all)
    }

    /// −J⁻¹ `residual`, and the Krylov iterations it took.
    fn step(
        &self,
        solver: &Solver<'_>,
        at: &Evaluation,
        residual: &[f64],
    ) -> Result<(Vec<f64>, usize), DynamicsError> {
        match solver {
            Solver::Krylov(preconditioner) => {
                let right: Vec<f64> = residual.iter().map(|r| -r).collect();
                krylov::solve(
                    |v| self.operate(at, v).0,
                    |v| preconditioner.apply(v),
                    &right,
                    STEP_TOLERANCE,
                )
            }
            _ => Ok((approximate(solver, residual), 0)),
        }
    }

    /// Derivatives along frequency: of the residual behind −J⁻¹ (the motion of the state with frequency), and of the condition.
    fn slope(
        &self,
        at: &Evaluation,
        state: &State,
        _factor: f64,
        solver: &Solver<'_>,
        condition: &Condition,
    ) -> Result<Slope, DynamicsError> {
        let by_frequency = self.by_frequency(at, state.omega)?;
        let width = self.width();
        let residual: Vec<f64> = at
            .elements
            .iter()
            .flat_map(|e| by_frequency[e * width..(e + 1) * width].iter().map(|v| -v))
            .collect();
        let (motion, _) = self.step(solver, at, &residual)?;
        let partial = match *condition {
            Condition::Frequency => 0.0,
            Condition::Linear {
                port,
                slot,
                weights,
                ..
            } => {
                let row = &by_frequency[port * self.harmonics().coefficients()..];
                weights[0] * row[slot] + weights[1] * row[slot + 1] + weights[2]
            }
        };
        let border = self.border(at, condition);
        let total = partial + border(&motion);
        Ok(Slope { motion, total })
    }

    /// ∂ displacement of all ports / ∂ω at constant forces.
    fn by_frequency(&self, at: &Evaluation, omega: f64) -> Result<Vec<f64>, DynamicsError> {
        let step = FREQUENCY_DIFFERENCE * omega;
        let above = self.model.cores(self.harmonics(), omega + step)?;
        let below = self.model.cores(self.harmonics(), omega - step)?;
        let mut change = self
            .model
            .respond(self.harmonics(), &above, &at.ports, &at.forces, false);
        let low = self
            .model
            .respond(self.harmonics(), &below, &at.ports, &at.forces, false);
        for (high, low) in change.iter_mut().zip(low) {
            *high = (*high - low) / (2.0 * step);
        }
        Ok(change)
    }

    /// The derivative of the condition along a change of the active unknowns.
    fn border<'a>(
        &'a self,
        at: &'a Evaluation,
        condition: &'a Condition,
    ) -> impl Fn(&[f64]) -> f64 + 'a {
        move |v| match *condition {
            Condition::Frequency => 0.0,
            Condition::Linear {
                port,
                slot,
                weights,
                ..
            } => {
                let (_, all) = self.operate(at, v);
                let row = &all[port * self.harmonics().coefficients()..];
                -(weights[0] * row[slot] + weights[1] * row[slot + 1])
            }
        }
    }

    /// The correction that the factor at `at` gives for the residual of `there`.
    fn measure(
        &self,
        solver: &Solver<'_>,
        at: &Evaluation,
        slope: Option<&Slope>,
        condition: &Condition,
        there: &Evaluation,
    ) -> (Vec<f64>, f64) {
        let direct = approximate(solver, &there.residual);
        bordered(direct, slope, &self.border(at, condition), there.condition)
    }

    fn moved(&self, state: &State, at: &Evaluation, step: &(Vec<f64>, f64), length: f64) -> State {
        let width = self.width();
        let mut out = state.clone();
        out.omega += length * step.1;
        for (&element, step) in at.elements.iter().zip(step.0.chunks(width)) {
            super::dense::add_scaled(&mut out.contact[element * width..][..width], length, step);
        }
        out
    }

    /// Derivative of the first harmonic (cosine, sine) at `port` with respect to frequency along the branch of a response.
    pub(super) fn port_slope(
        &self,
        response: &Response,
        port: usize,
        slot: usize,
    ) -> Result<[f64; 2], DynamicsError> {
        let state = State {
            omega: response.omega,
            contact: response.displacement[..response.force.len()].to_vec(),
            active: response.active.clone(),
        };
        let factor = response.load_factor;
        let at = self.evaluate(&state, factor, &Condition::Frequency)?;
        let part = if self.wants_krylov(at.residual.len()) {
            Some(self.element_part(&at)?)
        } else {
            None
        };
        let solver = self.solver(&at, part.as_ref())?;
        let mut out = [0.0; 2];
        let condition = |weights| Condition::Linear {
            port,
            slot,
            weights,
            value: 0.0,
        };
        let slope = self.slope(&at, &state, factor, &solver, &condition([1.0, 0.0, 0.0]))?;
        out[0] = slope.total;
        let sine = condition([0.0, 1.0, 0.0]);
        let row = &self.by_frequency(&at, state.omega)?[port * self.harmonics().coefficients()..];
        out[1] = row[slot + 1] + self.border(&at, &sine)(&slope.motion);
        Ok(out)
    }
}

/// How the state and the condition move with frequency.
struct Slope {
    motion: Vec<f64>,
    total: f64,
}

/// Sizes of the unknowns, against which corrections are measured.
struct Reach {
    displacement: f64,
    omega: f64,
}

impl Reach {
    fn of(state: &State, at: &Evaluation, width: usize) -> Reach {
        let squares: f64 = at
            .elements
            .iter()
            .map(|e| {
                let row = &state.contact[e * width..][..width];
                dot(row, row)
            })
            .sum();
        Reach {
            displacement: squares.sqrt().max(f64::MIN_POSITIVE),
            omega: state.omega,
        }
    }

    fn size(&self, step: &(Vec<f64>, f64)) -> f64 {
        let displacement = norm(&step.0) / self.displacement;
        displacement.hypot(FREQUENCY_WEIGHT * step.1 / self.omega)
    }
}

/// −J⁻¹ `residual` with what the solver has at hand, without iterating.
fn approximate(solver: &Solver<'_>, residual: &[f64]) -> Vec<f64> {
    let mut out: Vec<f64> = residual.iter().map(|r| -r).collect();
    match solver {
        Solver::Dense(factors) => factors.solve(&mut out),
        Solver::Regularised { matrix, normal } => {
            out = matrix.transposed().apply(&out);
            normal.solve(&mut out);
        }
        Solver::Krylov(preconditioner) => out = preconditioner.apply(&out),
    }
    out
}

/// Block elimination of the bordered system: `direct` = −J⁻¹ r is completed by the motion with frequency.
fn bordered(
    mut direct: Vec<f64>,
    slope: Option<&Slope>,
    border: &impl Fn(&[f64]) -> f64,
    condition: f64,
) -> (Vec<f64>, f64) {
    let Some(slope) = slope else {
        return (direct, 0.0);
    };
    let omega = -(condition + border(&direct)) / slope.total;
    super::dense::add_scaled(&mut direct, omega, &slope.motion);
    (direct, omega)
}
