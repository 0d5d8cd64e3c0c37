//! The border of a Newton step whose frequency is free: how the state moves with frequency, and a condition with both.

use super::aft::InterfaceElement;
use super::krylov::{MOST_ITERATIONS, dot};
use super::newton_step::{
    Change, Condition, Evaluation, Frame, LEAST_GRIP, STEP_TOLERANCE, Solver, State, Term,
};
use super::{DynamicsError, HarmonicBalance};
use crate::linalg::add_scaled;

/// Relative change of frequency for derivatives by central differences; half-power bandwidths are above 1e-4.
const FREQUENCY_DIFFERENCE: f64 = 1e-6;

/// How the state and the condition move with frequency: the border of a Newton step.
pub(super) struct Slope {
    /// ∂ residual / ∂ω.
    residual: Vec<f64>,
    /// ∂ condition / ∂ω, and along each of the active unknowns.
    partial: f64,
    row: Vec<f64>,
    /// −J⁻¹ `residual`, or what the preconditioner makes of it.
    motion: Vec<f64>,
    /// Derivative of the condition with frequency, the active unknowns moving by that.
    total: f64,
}

impl Slope {
    /// The same with another motion.
    fn with_motion(&self, motion: Vec<f64>) -> Slope {
        Slope {
            total: self.partial + dot(&self.row, &motion),
            residual: self.residual.clone(),
            partial: self.partial,
            row: self.row.clone(),
            motion,
        }
    }
}

impl<E: InterfaceElement> HarmonicBalance<E> {
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
        let (mut unknowns, iterations) =
            match frame.solve(operator, precondition, &right, tolerance) {
                Err(error @ DynamicsError::Krylov { .. }) => {
                    let dense = self.dense_instead(at, frame, error)?;
                    let exact = slope.with_motion(dense.approximate(&slope.residual));
                    let direct = dense.approximate(residual);
                    return Ok((
                        self.completed(Some(&exact), (direct, left)),
                        MOST_ITERATIONS,
                    ));
                }
                solved => solved?,
            };
        let omega = unknowns.pop().unwrap_or_default() / scale;
        Ok((Change { unknowns, omega }, iterations))
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
        let total = partial + dot(&row, &motion);
        Ok(Slope {
            residual,
            partial,
            row,
            motion,
            total,
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
            let cores = self.cores(omega)?;
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
