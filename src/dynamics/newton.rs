//! Newton's method for the harmonic balance, optionally with the frequency as one more unknown and one more condition.
//!
//! The solver computes a simplified correction to decide whether it accepts or shortens a trial step. The simplified
//! correction applies the current factors to the residual after the step. With the simplified correction, the
//! acceptance depends neither on units nor on the distance to a resonance. Deuflhard calls this property natural
//! monotonicity (Newton Methods for Nonlinear Problems, §3.3).

use std::cell::RefCell;

use num_complex::Complex64;

use super::aft::{InterfaceElement, PeriodicityError, Workspace};
use super::closed_model::{PortModel, Precision};
use super::krylov::{self, MOST_ITERATIONS, SlowDirections, dot, norm};
use super::preconditioner::{ElementPart, Preconditioner};
use super::{DynamicsError, Energy, HarmonicBalance, Response};
use crate::journal::{Inputs, Reader, Writer};
use crate::linalg::{Blocks, Factors, RowMatrix as Matrix, add_scaled};

/// Required relative decrease of the correction, divided by the step length.
const DESCENT: f64 = 0.25;
/// Number of trial step lengths 1, ½, …. If a step crosses no kink of the friction law with one of these lengths,
/// shorter lengths do not help.
const HALVINGS: u32 = 6;
/// Correction below which one more step usually converges. The trial step at such a correction needs no Jacobian.
const NEARLY: f64 = 1e-4;
/// Correction below which expensive Jacobians are reused for further steps.
const NEAR: f64 = 2e-3;
/// Number of Krylov iterations above which a step costs more than new Jacobians.
const DEAR: usize = 25;
/// Largest ratio of the correction after a step with a reused Jacobian to the correction before the step. Above this
/// ratio, or if more than two steps with the reused Jacobian would remain, the solver computes the Jacobians again.
const CHORD: f64 = 0.1;
/// Ratio of the correction to the tolerance below which two steps with a reused Jacobian usually converge.
const FEW_CHORDS: f64 = 1e3;
/// Largest relative tolerance of a step if iterations are expensive.
const LOOSE: f64 = 1e-2;
/// Ratio of a step to the preconditioned estimate of the step. If iterations are expensive and a step exceeds this
/// ratio, an iterative solve measures the trial steps.
const MISSED: f64 = 4.0;
/// Relative tolerance of the iterative solve that measures trial steps.
const MEASURED: f64 = 0.1;
/// Largest permitted number of consecutive steps that do not decrease the correction. The law has kinks, and a full
/// step across a kink often helps although the correction increases.
const TRIALS: usize = 3;
/// Number of Krylov iterations above which the element part of the preconditioner is rebuilt.
const STALE: usize = 25;
/// Number of Krylov iterations above which the preconditioner is rebuilt if iterations are expensive. Stored directions
/// then compensate for an old preconditioner.
const LOST: usize = 75;
/// Largest grip of the mean displacement (see [`LEAST_GRIP`]), far from the solution. If only a few sticking elements
/// support the mean displacement, the mean runs away when these elements begin to slip. Grip shortens the step of the
/// mean.
const MOST_GRIP: f64 = 1e-2;
/// Grip over the relative correction, between its limits.
const GRIP_PER_CORRECTION: f64 = 0.1;
/// Relative change of the frequency since the start of the solve above which the solver skips a trial step. A larger
/// change of the frequency leads to another resonance or to no resonance.
const FAR: f64 = 0.5;
/// Correction that the solver accepts if no step decreases the correction. Kinks of the friction law can cause such a
/// correction. The response reports the correction.
const ACCEPTED: f64 = 1e-6;
/// Accepted correction divided by the tolerance of the settings, if iterations are expensive. Rounding can keep the
/// correction of an expensive iteration above the tolerance.
const ACCEPTED_OF_COSTLY: f64 = 10.0;
/// Number of iterations within which the correction must halve.
const PATIENCE: usize = 8;
/// Number of consecutive increases of the correction that are allowed if the frequency is free.
const RUNAWAY: usize = 2;
/// Smallest correction that counts as an increase for [`RUNAWAY`]. Rounding can cause an increase to a smaller
/// correction.
const AWAY: f64 = 0.1;
/// Weight of a relative change of the frequency; a relative change of the displacement has the weight 1. Near a
/// resonance, a frequency change of about 1 % changes the amplitude by 100 %.
pub(super) const FREQUENCY_WEIGHT: f64 = 100.0;

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Solves for the response from `state` at the load `factor`, until the correction is within `tolerance`. Reuses
    /// the `frame` of an earlier solve if the frame fits, and stores its own frame for a later solve.
    pub(super) fn converge(
        &self,
        mut state: State,
        factor: f64,
        condition: &Condition,
        tolerance: f64,
        frame: &mut Option<SolverCache>,
    ) -> Result<Response, DynamicsError> {
        let first_omega = state.omega;
        // A spent budget stops the solve before the first evaluation. Even one evaluation of many samples is expensive
        // if hundreds of solves begin with a spent budget.
        if self.effort.is_spent() {
            return Err(DynamicsError::EvaluationLimit {
                frequency: state.omega / (2.0 * std::f64::consts::PI),
            });
        }
        let mut grip = MOST_GRIP;
        let mut current = self.evaluate(&state, factor, condition, Some(grip))?;
        let mut failures = 0;
        let mut correction = f64::INFINITY;
        // The last measured correction, for the error, and the correction of the current state.
        let (mut last_measured, mut current_size) = (f64::INFINITY, f64::INFINITY);
        let mut iterations_done = 0;
        // A caller retries a missed resonance from a nearer start; at a single frequency there is sometimes no nearer
        // start.
        let patience = match condition {
            Condition::Frequency => 2 * PATIENCE,
            Condition::Linear { .. } => PATIENCE,
        };
        let (mut smallest, mut smallest_at) = (f64::INFINITY, 0);
        // True if the Jacobians belong to an earlier state. If a step with earlier Jacobians is not accepted, the
        // solver computes new Jacobians.
        let mut is_old = false;
        // Previous correction, and the number of consecutive increases.
        let (mut previous, mut growths) = (f64::INFINITY, 0);
        for iteration in 0..=self.settings.max_iterations {
            self.gauge.add_iteration(self.harmonics().highest());
            iterations_done = iteration;
            if self.effort.is_spent() {
                break;
            }
            while self.enlarge(&mut state, &current) {
                current = self.evaluate(&state, factor, condition, Some(grip))?;
                (correction, is_old) = (f64::INFINITY, false);
            }
            let is_frequency_given = matches!(condition, Condition::Frequency);
            if (current.elements.is_empty() && is_frequency_given) || correction <= tolerance {
                let correction = if correction.is_finite() {
                    correction
                } else {
                    0.0
                };
                return self.response(state, factor, current, iteration, correction);
            }
            if iteration == self.settings.max_iterations {
                break;
            }
            let mut current_frame = self.frame(&current, frame.take())?;
            let solver = self.solver(&current, &current_frame)?;
            let slope = match condition {
                Condition::Frequency => None,
                // If iterations are expensive, the step and the motion with frequency are solved together.
                Condition::Linear { .. } if self.has_expensive_jacobian => {
                    Some(self.rough_slope(&current, &solver, condition, state.omega)?)
                }
                Condition::Linear { .. } => {
                    let omega = state.omega;
                    Some(self.slope(
                        &current,
                        &current_frame,
                        &solver,
                        condition,
                        omega,
                        STEP_TOLERANCE,
                    )?)
                }
            };
            let complete = |direct, condition_residual| {
                self.with_frequency_step(slope.as_ref(), (direct, condition_residual))
            };
            let sizes = UnknownSizes::of(&state, &current, self.width());
            let solve = |evaluation: &Evaluation, tolerance: f64| match &slope {
                Some(slope) if self.has_expensive_jacobian => {
                    let right = (&evaluation.residual[..], evaluation.condition);
                    let scale = sizes.per_frequency();
                    self.bordered_step(
                        &solver,
                        &current,
                        &current_frame,
                        slope,
                        scale,
                        right,
                        tolerance,
                    )
                }
                _ => {
                    let (direct, effort) = self.step(
                        &solver,
                        &current,
                        &current_frame,
                        &evaluation.residual,
                        tolerance,
                    )?;
                    Ok((complete(direct, evaluation.condition), effort))
                }
            };
            let estimate_size = |evaluation: &Evaluation| {
                let direct = solver.approximate(&evaluation.residual);
                sizes.size(&complete(direct, evaluation.condition))
            };
            let rough_size = estimate_size(&current);
            current_size = rough_size;
            let mut size_before = rough_size;
            let (step, effort) = solve(&current, self.step_tolerance(rough_size, tolerance))?;
            // A preconditioner that misses most of a step cannot measure the correction after a trial step.
            let is_missed = self.has_expensive_jacobian && sizes.size(&step) > MISSED * size_before;
            if is_missed {
                size_before = sizes.size(&step);
            }
            let measure = |evaluation: &Evaluation| -> Result<f64, DynamicsError> {
                if !is_missed {
                    return Ok(estimate_size(evaluation));
                }
                let (step, _) = solve(evaluation, MEASURED)?;
                Ok(sizes.size(&step))
            };
            // The grip decreases with the correction, so the grip does not slow the convergence.
            grip = (GRIP_PER_CORRECTION * rough_size).clamp(LEAST_GRIP, MOST_GRIP);
            // A weakly supported mean displacement can move far while the rest of the solution converges. A step in
            // which the mean moves far counts as progress.
            let makes_progress = |evaluation: &Evaluation| {
                is_missed && estimate_size(evaluation) <= 0.5 * rough_size
            };
            // If the correction does not halve over many iterations, the iterates probably alternate between two sides
            // of a kink.
            if rough_size < 0.5 * smallest {
                (smallest, smallest_at) = (rough_size, iteration);
            } else if iteration - smallest_at >= patience {
                break;
            }
            // A correction that only grows leads to another resonance, if to any.
            let grows = rough_size > previous && rough_size > AWAY;
            growths = if grows { growths + 1 } else { 0 };
            previous = rough_size;
            if !is_frequency_given && growths > RUNAWAY {
                break;
            }
            if sizes.size(&step) <= tolerance && size_before <= tolerance {
                correction = sizes.size(&step);
                *frame = Some(current_frame);
                continue;
            }
            let jacobian_threshold = match effort {
                0..=DEAR if self.has_expensive_jacobian => NEAR,
                _ => NEARLY,
            };
            let chord_limit = f64::min(FEW_CHORDS * tolerance, LOOSE);
            let jacobian_threshold = jacobian_threshold.max(tolerance / CHORD).max(chord_limit);
            let mut is_refused = false;
            let mut best: Option<(f64, f64, State, Evaluation)> = None;
            let mut full: Option<(State, Evaluation)> = None;
            for halving in 0..HALVINGS {
                let length = 0.5_f64.powi(halving as i32);
                let trial = self.take_step(&state, &current, &step, length);
                if (trial.omega / first_omega - 1.0).abs() > FAR {
                    continue;
                }
                // Most full steps are accepted. A shorter step needs a Jacobian only after the solver accepts the step.
                let trial_grip = (halving == 0 && size_before > jacobian_threshold).then_some(grip);
                let trial_evaluation = self.evaluate(&trial, factor, condition, trial_grip)?;
                let trial_size = measure(&trial_evaluation)?;
                let is_accepted = trial_size <= (1.0 - DESCENT * length) * size_before
                    || makes_progress(&trial_evaluation);
                is_refused = is_old && !is_accepted && trial_size > tolerance;
                if is_refused {
                    break;
                }
                if is_accepted || best.as_ref().is_none_or(|(b, ..)| trial_size < *b) {
                    let worse = best.replace((trial_size, length, trial, trial_evaluation));
                    if let Some((_, 1.0, trial, trial_evaluation)) = worse {
                        full = Some((trial, trial_evaluation));
                    }
                } else if halving == 0 {
                    full = Some((trial, trial_evaluation));
                }
                if is_accepted {
                    break;
                }
            }
            if is_refused {
                current = self.evaluate(&state, factor, condition, Some(grip))?;
                (correction, is_old) = (f64::INFINITY, false);
                *frame = Some(current_frame);
                continue;
            }
            let Some((trial_size, length, trial, trial_evaluation)) = best else {
                break;
            };
            last_measured = trial_size;
            if trial_size < size_before || makes_progress(&trial_evaluation) {
                failures = 0;
                correction = if length == 1.0 {
                    trial_size
                } else {
                    f64::INFINITY
                };
                let previous_evaluation = std::mem::replace(&mut current, trial_evaluation);
                state = trial;
                let share = trial_size / size_before;
                let can_reuse = share <= CHORD && trial_size * share * share <= tolerance;
                is_old = self.has_expensive_jacobian && can_reuse && !current.has_jacobians();
                if is_old {
                    current.contact_jacobians = previous_evaluation.contact_jacobians;
                }
            } else if trial_size <= tolerance {
                // The change of the correction is rounding.
                correction = trial_size;
            } else {
                failures += 1;
                correction = f64::INFINITY;
                if failures > TRIALS || !trial_size.is_finite() {
                    break;
                }
                let Some(full_step) = (if length == 1.0 {
                    Some((trial, trial_evaluation))
                } else {
                    full
                }) else {
                    break;
                };
                (state, current) = full_step;
                is_old = false;
            }
            if !current.has_jacobians() {
                current = self.evaluate(&state, factor, condition, Some(grip))?;
            }
            if effort
                > if self.has_expensive_jacobian {
                    LOST
                } else {
                    STALE
                }
            {
                current_frame.forget();
            }
            *frame = Some(current_frame);
        }
        let accepted = match self.has_expensive_jacobian {
            true => ACCEPTED_OF_COSTLY * self.settings.tolerance,
            false => ACCEPTED,
        };
        if current_size <= accepted {
            return self.response(state, factor, current, iterations_done, current_size);
        }
        Err(DynamicsError::NotConverged {
            frequency: state.omega / (2.0 * std::f64::consts::PI),
            load_factor: factor,
            iterations: iterations_done,
            correction: last_measured,
            tolerance,
            active: current.elements.len(),
            elements: self.elements.len(),
        })
    }

    /// Returns the relative tolerance of the step from a state whose correction is about `correction`. If iterations
    /// are expensive, the tolerance of the step is the larger of two values. One value is the curvature error of the
    /// step (Eisenstat and Walker 1996). The other value is the tolerance of the step that the final tolerance
    /// requires.
    fn step_tolerance(&self, correction: f64, tolerance: f64) -> f64 {
        if !self.has_expensive_jacobian {
            return STEP_TOLERANCE;
        }
        let wanted = 0.3 * tolerance / correction;
        correction.max(wanted).clamp(STEP_TOLERANCE, LOOSE)
    }

    /// Updates the displacement of passive elements, and activates passive elements that slip or open. Returns true if
    /// any element becomes active.
    fn enlarge(&self, state: &mut State, evaluation: &Evaluation) -> bool {
        let width = self.width();
        let mut has_grown = false;
        for (index, element) in self.elements.iter().enumerate() {
            if state.active[index] {
                continue;
            }
            let row = &evaluation.displacement[index * width..][..width];
            state.contact[index * width..][..width].copy_from_slice(row);
            if !self.sampling.follows_reference(element, row) {
                state.active[index] = true;
                has_grown = true;
            }
        }
        has_grown
    }

    fn take_step(
        &self,
        state: &State,
        evaluation: &Evaluation,
        step: &NewtonStep,
        length: f64,
    ) -> State {
        let width = self.width();
        let mut moved_state = state.clone();
        moved_state.omega += length * step.omega;
        for (&element, step) in evaluation.elements.iter().zip(step.unknowns.chunks(width)) {
            add_scaled(
                &mut moved_state.contact[element * width..][..width],
                length,
                step,
            );
        }
        moved_state
    }
}

/// Sizes of the unknowns, by which corrections are scaled.
struct UnknownSizes {
    displacement: f64,
    omega: f64,
}

impl UnknownSizes {
    fn of(state: &State, evaluation: &Evaluation, width: usize) -> UnknownSizes {
        let squares: f64 = evaluation
            .elements
            .iter()
            .map(|e| {
                let row = &state.contact[e * width..][..width];
                dot(row, row)
            })
            .sum();
        UnknownSizes {
            displacement: squares.sqrt().max(f64::MIN_POSITIVE),
            omega: state.omega,
        }
    }

    /// Returns the displacement \[m\] that has the same weight in a step as a frequency change of 1 rad/s.
    fn per_frequency(&self) -> f64 {
        FREQUENCY_WEIGHT * self.displacement / self.omega
    }

    fn size(&self, step: &NewtonStep) -> f64 {
        let displacement = norm(&step.unknowns) / self.displacement;
        displacement.hypot(FREQUENCY_WEIGHT * step.omega / self.omega)
    }
}

// Newton step of the harmonic balance: residual, Jacobian, and their solvers.

/// Relative tolerance of a Newton step solved by GMRES. Steps of a nearly linear problem then gain four digits each.
pub(super) const STEP_TOLERANCE: f64 = 1e-4;
/// Smallest grip: the share of the tangential stiffness that the Jacobian adds for the mean displacement. Elements in
/// full slip do not resist a change of the mean displacement. If only friction supports the mean displacement, Newton's
/// method without grip diverges in the mean. Grip hardly slows the convergence of a mean with other support.
pub(super) const LEAST_GRIP: f64 = 1e-6;
/// Number of unknowns up to which elimination replaces failed Krylov iterations: half a gigabyte.
const MOST_DENSE: usize = 6000;
/// Number of elements that a thread evaluates at a time.
const AT_ONCE: usize = 8;
/// Regularisation of a step with a singular matrix, divided by the largest diagonal entry of the normal matrix.
const REGULARISATION: f64 = 1e-13;

/// Unknowns: frequency, and contact displacements of all elements (the displacements of passive elements follow).
#[derive(Debug, Clone)]
pub(super) struct State {
    pub(super) omega: f64,
    pub(super) contact: Vec<f64>,
    pub(super) active: Vec<bool>,
}

/// Condition that determines the frequency.
#[derive(Debug, Clone)]
pub(super) enum Condition {
    /// The frequency is prescribed.
    Frequency,
    /// The sum of the terms and `by_omega` ω equals `value`.
    Linear {
        terms: Vec<Term>,
        by_omega: f64,
        value: f64,
    },
}

/// Term `weights · (cosine, sine)` of the harmonic in a slot at a port.
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
    /// Creates the condition that a term is zero.
    pub(super) fn zero(term: Term) -> Condition {
        Condition::Linear {
            terms: vec![term],
            by_omega: 0.0,
            value: 0.0,
        }
    }

    pub(super) fn terms(&self) -> &[Term] {
        match self {
            Condition::Frequency => &[],
            Condition::Linear { terms, .. } => terms,
        }
    }

    /// Returns the sum of the terms for rows of `n` coefficients of all ports.
    pub(super) fn of_ports(&self, rows: &[f64], n: usize) -> f64 {
        let terms = self.terms().iter();
        terms.map(|term| term.of(&rows[term.port * n..])).sum()
    }
}

/// Evaluation of a state for Newton's method.
pub(super) struct Evaluation {
    pub(super) cores: Vec<Matrix<Complex64>>,
    pub(super) elements: Vec<usize>,
    /// Contact degrees of freedom of the active elements, then ports with loads.
    pub(super) ports: Vec<usize>,
    /// Forces on `ports`: contact forces beyond the reference with the sign of a load, then loads.
    pub(super) forces: Vec<f64>,
    /// Applied share of the loads.
    pub(super) factor: f64,
    /// Jacobians of the forces beyond the reference, one per active element; empty if not requested.
    pub(super) contact_jacobians: Vec<Matrix>,
    /// Contact forces of the active elements, and the closure of their cycles.
    pub(super) contact: Vec<(Vec<f64>, PeriodicityError)>,
    pub(super) displacement: Vec<f64>,
    pub(super) residual: Vec<f64>,
    pub(super) condition: f64,
}

/// Contribution of an element to an evaluation.
struct ElementContribution {
    /// Force beyond the reference with the sign of a load.
    force: Vec<f64>,
    beyond: Option<Matrix>,
    contact: (Vec<f64>, PeriodicityError),
}

impl Evaluation {
    /// Returns true if the evaluation has Jacobians.
    pub(super) fn has_jacobians(&self) -> bool {
        self.contact_jacobians.len() == self.elements.len()
    }
}

/// Data that depend only on the set of active elements.
pub(super) struct SolverCache {
    elements: Vec<usize>,
    /// The model restricted to the contact degrees of freedom of the active elements.
    among: PortModel,
    /// The element part of the preconditioner. `None` before the solver builds the element part.
    part: Option<ElementPart>,
    /// Slow directions that earlier solves with the same preconditioner stored.
    learned: RefCell<SlowDirections>,
}

impl SolverCache {
    /// Discards the element part of the preconditioner and the stored directions.
    pub(super) fn forget(&mut self) {
        self.part = None;
        *self.learned.borrow_mut() = SlowDirections::default();
    }

    /// Solves `operator(x) = right` with the stored directions, and stores new ones. Returns x and the number of Krylov
    /// iterations. All systems of a frame have the same number of unknowns.
    ///
    /// The system is preconditioned from the left, so the Krylov residual has the size of a correction, as in Newton's
    /// method. A weakly held mean displacement has a large correction with hardly any residual.
    pub(super) fn solve(
        &self,
        operator: impl Fn(&[f64]) -> Vec<f64>,
        precondition: impl Fn(&[f64]) -> Vec<f64>,
        right: &[f64],
        tolerance: f64,
    ) -> Result<(Vec<f64>, usize), DynamicsError> {
        let mut memory = self.learned.borrow_mut();
        let solved = krylov::solve(
            |v| precondition(&operator(v)),
            |v| memory.apply(v),
            &precondition(right),
            tolerance,
        )?;
        memory.add(solved.slow_directions);
        Ok((solved.x, solved.iterations))
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

/// Change of the active unknowns and of the frequency.
pub(super) struct NewtonStep {
    pub(super) unknowns: Vec<f64>,
    pub(super) omega: f64,
}

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Computes the receptances of the coordinates at every harmonic of the angular frequency `omega`.
    pub(super) fn cores(&self, omega: f64) -> Result<Vec<Matrix<Complex64>>, DynamicsError> {
        let orders = self.harmonics().orders();
        let receptance = |order: &u32| self.model.core.receptance(f64::from(*order) * omega);
        self.threads.map(orders, receptance).into_iter().collect()
    }

    /// Returns the number of unknowns per element.
    pub(super) fn width(&self) -> usize {
        3 * self.harmonics().coefficients()
    }

    /// Evaluates the residual of a state and, with a `grip` (see [`LEAST_GRIP`]), the Jacobians of the elements.
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
        let cores = self.cores(state.omega)?;
        let elements: Vec<usize> = (0..self.elements.len())
            .filter(|e| state.active[*e])
            .collect();
        self.effort.add(1);
        let mut ports: Vec<usize> = elements.iter().flat_map(|e| 3 * e..3 * e + 3).collect();
        let mut forces = Vec::with_capacity(elements.len() * width);
        let mut beyond = Vec::new();
        let mut contact = Vec::with_capacity(elements.len());
        let parts = self.threads.map(elements.chunks(AT_ONCE), |part| {
            let mut work = self.sampling.workspace();
            let evaluate_one =
                |element: &usize| self.evaluate_element(*element, state, grip, &mut work);
            part.iter().map(evaluate_one).collect::<Vec<_>>()
        });
        for contribution in parts.into_iter().flatten() {
            forces.extend(contribution.force);
            beyond.extend(contribution.beyond);
            contact.push(contribution.contact);
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
            contact_jacobians: beyond,
            contact,
            displacement,
            residual,
            condition,
        })
    }

    /// Evaluates one element for [`Self::evaluate`].
    fn evaluate_element(
        &self,
        element: usize,
        state: &State,
        grip: Option<f64>,
        work: &mut Workspace,
    ) -> ElementContribution {
        let n = self.harmonics().coefficients();
        let width = self.width();
        let u = &state.contact[element * width..][..width];
        let law = &self.elements[element];
        let mut g = vec![0.0; width];
        let mut jacobian = grip.map(|_| Matrix::zeros(width, width));
        let values = jacobian.as_mut().map(Matrix::values_mut);
        let closure = self.sampling.evaluate(law, u, &mut g, values, work);
        let contact = (g.clone(), closure);
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
        ElementContribution {
            force: g,
            beyond: jacobian,
            contact,
        }
    }

    /// Returns the frame for the active elements of an evaluation. Reuses the frame `old` if `old` has the same active
    /// elements.
    pub(super) fn frame(
        &self,
        evaluation: &Evaluation,
        old: Option<SolverCache>,
    ) -> Result<SolverCache, DynamicsError> {
        let mut frame = match old {
            Some(frame) if frame.elements == evaluation.elements => frame,
            _ => {
                let elements = evaluation.elements.iter();
                let ports: Vec<usize> = elements.flat_map(|e| 3 * e..3 * e + 3).collect();
                let precision = match self.wants_krylov(evaluation.residual.len()) {
                    true => Precision::Single,
                    false => Precision::Double,
                };
                SolverCache {
                    elements: evaluation.elements.clone(),
                    among: self.model.restricted_to(&ports, precision),
                    part: None,
                    learned: RefCell::default(),
                }
            }
        };
        if let (true, None, Some(basis)) = (
            self.wants_krylov(evaluation.residual.len()),
            &frame.part,
            &self.model.basis,
        ) {
            let harmonics = self.harmonics();
            let (model, elements) = (&self.model, &evaluation.elements);
            let part = ElementPart::new(
                &self.threads,
                model,
                basis,
                harmonics,
                elements,
                &evaluation.contact_jacobians,
            )?;
            frame.part = Some(part);
        }
        Ok(frame)
    }

    fn wants_krylov(&self, unknowns: usize) -> bool {
        let modal = self.model.leading_coordinates * self.harmonics().coefficients();
        // Elimination solves the modal part of the system, so the modal part must be the smaller part.
        self.model.basis.is_some()
            && unknowns > self.settings.dense_unknowns
            && 2 * modal < unknowns
    }

    pub(super) fn solver<'a>(
        &'a self,
        evaluation: &'a Evaluation,
        frame: &'a SolverCache,
    ) -> Result<Solver<'a>, DynamicsError> {
        if let (true, Some(part)) = (self.wants_krylov(evaluation.residual.len()), &frame.part) {
            let harmonics = self.harmonics();
            return Ok(Solver::Krylov {
                beyond: Blocks::new(self.width(), evaluation.contact_jacobians.iter()),
                preconditioner: Preconditioner::new(
                    &self.threads,
                    part,
                    harmonics,
                    &evaluation.cores,
                )?,
            });
        }
        self.dense(evaluation, frame)
    }

    fn dense(
        &self,
        evaluation: &Evaluation,
        frame: &SolverCache,
    ) -> Result<Solver<'static>, DynamicsError> {
        let matrix = self.jacobian(evaluation, frame);
        let of_matrix = DynamicsError::matrix_error("Jacobian of the harmonic balance");
        match matrix.clone().factorize().map_err(of_matrix) {
            Ok(factors) => Ok(Solver::Dense(factors)),
            // The mean position in full sliding without a spring has no equation. Least squares give the smallest step.
            Err(error) if error.is_singular() => {
                let mut normal = Matrix::zeros(matrix.columns(), matrix.columns());
                normal.add_transposed_product(&matrix, &matrix);
                let largest = (0..normal.rows()).fold(0.0_f64, |m, i| m.max(normal.at(i, i)));
                for i in 0..normal.rows() {
                    normal.set(i, i, normal.at(i, i) + REGULARISATION * largest);
                }
                let of_matrix =
                    DynamicsError::matrix_error("regularised Jacobian of the harmonic balance");
                let normal = normal.factorize().map_err(of_matrix)?;
                Ok(Solver::Regularised { matrix, normal })
            }
            Err(error) => Err(error),
        }
    }

    /// Computes 1 + H G for the active unknowns.
    fn jacobian(&self, evaluation: &Evaluation, frame: &SolverCache) -> Matrix {
        let harmonics = self.harmonics();
        let n = harmonics.coefficients();
        let width = self.width();
        let size = evaluation.residual.len();
        let mut matrix = Matrix::identity(size);
        let dofs = size / n;
        for (index, core) in evaluation.cores.iter().enumerate() {
            let block = frame.among.receptance(core);
            let slot = harmonics.slot(index);
            for i in 0..dofs {
                for j in 0..dofs {
                    let value = block.at(i, j);
                    let (element, d) = (j / 3, j % 3);
                    let columns = element * width..(element + 1) * width;
                    let source = |c: usize| evaluation.contact_jacobians[element].row(d * n + c);
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

    /// Computes (1 + H G) v from v and `forces` = G v.
    pub(super) fn operate(
        &self,
        evaluation: &Evaluation,
        frame: &SolverCache,
        forces: &[f64],
        v: &[f64],
    ) -> Vec<f64> {
        let mut out = frame
            .among
            .respond(self.harmonics(), &evaluation.cores, forces);
        add_scaled(&mut out, 1.0, v);
        out
    }

    /// Computes −J⁻¹ `residual` and the number of Krylov iterations. The tolerance of Krylov iterations is relative.
    pub(super) fn step(
        &self,
        solver: &Solver<'_>,
        evaluation: &Evaluation,
        frame: &SolverCache,
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
        let operator = |v: &[f64]| self.operate(evaluation, frame, &beyond.apply(v), v);
        let precondition = |v: &[f64]| preconditioner.apply(v);
        let solved = match self.has_expensive_jacobian {
            true => frame.solve(operator, precondition, &right, tolerance),
            false => krylov::solve(operator, precondition, &right, tolerance)
                .map(|solved| (solved.x, solved.iterations)),
        };
        match solved {
            Err(error @ DynamicsError::Krylov { .. }) => {
                let solver = self.dense_instead(evaluation, frame, error)?;
                // Returns the limit of iterations, so that the caller rebuilds the preconditioner.
                Ok((solver.approximate(residual), krylov::MOST_ITERATIONS))
            }
            solved => solved,
        }
    }

    /// Creates a solver by elimination after Krylov iterations failed with `error`, if its matrix fits into memory.
    ///
    /// # Errors
    /// `error` if the matrix does not fit.
    pub(super) fn dense_instead(
        &self,
        evaluation: &Evaluation,
        frame: &SolverCache,
        error: DynamicsError,
    ) -> Result<Solver<'static>, DynamicsError> {
        match evaluation.residual.len() <= MOST_DENSE {
            true => self.dense(evaluation, frame),
            false => Err(error),
        }
    }
}

impl Solver<'_> {
    /// Computes −J⁻¹ `residual` without iterating: exactly by factors, or approximately by the preconditioner.
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

// Border of a Newton step with a free frequency: the motion of the state with frequency, and the condition on state and
// frequency.

/// Relative change of frequency for derivatives by central differences; half-power bandwidths are above 1e-4.
const FREQUENCY_DIFFERENCE: f64 = 1e-6;

/// Derivatives of the state and of the condition with frequency: the border of a Newton step.
pub(super) struct FrequencyDerivatives {
    /// ∂ residual / ∂ω.
    residual: Vec<f64>,
    /// ∂ condition / ∂ω at constant contact forces.
    partial: f64,
    /// ∂ condition along each of the active unknowns.
    row: Vec<f64>,
    /// −J⁻¹ `residual` with the Jacobian J, or the approximation of −J⁻¹ `residual` by the preconditioner.
    motion: Vec<f64>,
    /// Total derivative of the condition with frequency, when the active unknowns move by `motion`.
    total: f64,
}

impl FrequencyDerivatives {
    /// Returns the slope with another motion.
    fn with_motion(&self, motion: Vec<f64>) -> FrequencyDerivatives {
        FrequencyDerivatives {
            total: self.partial + dot(&self.row, &motion),
            residual: self.residual.clone(),
            partial: self.partial,
            row: self.row.clone(),
            motion,
        }
    }
}

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Solves the bordered system for unknowns and frequency together, to a relative tolerance. Returns the step and
    /// the number of Krylov iterations.
    ///
    /// `scale` converts the frequency to the size of an unknown. With the preconditioner's own `slope`, the border is
    /// inverted exactly.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn bordered_step(
        &self,
        solver: &Solver<'_>,
        evaluation: &Evaluation,
        frame: &SolverCache,
        slope: &FrequencyDerivatives,
        scale: f64,
        (residual, condition_residual): (&[f64], f64),
        tolerance: f64,
    ) -> Result<(NewtonStep, usize), DynamicsError> {
        let Solver::Krylov {
            beyond,
            preconditioner,
        } = solver
        else {
            let direct = solver.approximate(residual);
            return Ok((
                self.with_frequency_step(Some(slope), (direct, condition_residual)),
                0,
            ));
        };
        let n = residual.len();
        let operator = |v: &[f64]| {
            let (v, omega) = (&v[..n], v[n] / scale);
            let mut out = self.operate(evaluation, frame, &beyond.apply(v), v);
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
        let right: Vec<f64> = residual
            .iter()
            .chain([&condition_residual])
            .map(|r| -r)
            .collect();
        let (mut unknowns, iterations) =
            match frame.solve(operator, precondition, &right, tolerance) {
                Err(error @ DynamicsError::Krylov { .. }) => {
                    let dense = self.dense_instead(evaluation, frame, error)?;
                    let exact = slope.with_motion(dense.approximate(&slope.residual));
                    let direct = dense.approximate(residual);
                    return Ok((
                        self.with_frequency_step(Some(&exact), (direct, condition_residual)),
                        MOST_ITERATIONS,
                    ));
                }
                solved => solved?,
            };
        let omega = unknowns.pop().unwrap_or_default() / scale;
        Ok((NewtonStep { unknowns, omega }, iterations))
    }

    /// Computes the derivatives of the state and of the condition with frequency.
    pub(super) fn slope(
        &self,
        evaluation: &Evaluation,
        frame: &SolverCache,
        solver: &Solver<'_>,
        condition: &Condition,
        omega: f64,
        tolerance: f64,
    ) -> Result<FrequencyDerivatives, DynamicsError> {
        self.slope_by(evaluation, condition, omega, |residual| {
            let (motion, _) = self.step(solver, evaluation, frame, residual, tolerance)?;
            Ok(motion)
        })
    }

    /// Computes the derivatives as [`Self::slope`], with the preconditioner only.
    pub(super) fn rough_slope(
        &self,
        evaluation: &Evaluation,
        solver: &Solver<'_>,
        condition: &Condition,
        omega: f64,
    ) -> Result<FrequencyDerivatives, DynamicsError> {
        self.slope_by(evaluation, condition, omega, |residual| {
            Ok(solver.approximate(residual))
        })
    }

    fn slope_by(
        &self,
        evaluation: &Evaluation,
        condition: &Condition,
        omega: f64,
        step: impl FnOnce(&[f64]) -> Result<Vec<f64>, DynamicsError>,
    ) -> Result<FrequencyDerivatives, DynamicsError> {
        let by_frequency = self.by_frequency(evaluation, omega)?;
        let width = self.width();
        let elements = evaluation.elements.iter();
        let rows = elements.flat_map(|e| &by_frequency[e * width..(e + 1) * width]);
        let residual: Vec<f64> = rows.map(|v| -v).collect();
        let motion = step(&residual)?;
        let partial = self.partial(condition, &by_frequency);
        let row = self.border(evaluation, condition);
        let total = partial + dot(&row, &motion);
        Ok(FrequencyDerivatives {
            residual,
            partial,
            row,
            motion,
            total,
        })
    }

    /// Computes ∂ condition / ∂ω at constant contact forces.
    fn partial(&self, condition: &Condition, by_frequency: &[f64]) -> f64 {
        match condition {
            Condition::Frequency => 0.0,
            Condition::Linear { by_omega, .. } => {
                condition.of_ports(by_frequency, self.harmonics().coefficients()) + by_omega
            }
        }
    }

    /// Computes ∂ displacement of all ports / ∂ω at constant contact forces; inertial loads change with frequency.
    fn by_frequency(&self, evaluation: &Evaluation, omega: f64) -> Result<Vec<f64>, DynamicsError> {
        let step = FREQUENCY_DIFFERENCE * omega;
        let respond = |omega: f64| -> Result<Vec<f64>, DynamicsError> {
            let harmonics = self.harmonics();
            let cores = self.cores(omega)?;
            let model = &self.model;
            if self.has_inertial_loads() {
                let loads = self.loads_at(omega, evaluation.factor);
                let contact = &evaluation.forces[..evaluation.forces.len() - loads.len()];
                let forces = [contact, &loads].concat();
                return Ok(model.respond(harmonics, &cores, &evaluation.ports, &forces, true));
            }
            Ok(model.respond(
                harmonics,
                &cores,
                &evaluation.ports,
                &evaluation.forces,
                false,
            ))
        };
        let (mut change, low) = (respond(omega + step)?, respond(omega - step)?);
        for (high, low) in change.iter_mut().zip(low) {
            *high = (*high - low) / (2.0 * step);
        }
        Ok(change)
    }

    /// Computes the derivative of the condition along each active unknown: −cᵀ H G with the weights c of its terms.
    ///
    /// The complex receptance of a harmonic is symmetric, so the transpose of the receptance in real coefficients is
    /// the conjugate receptance. Because the receptance is symmetric, the function computes Hᵀ c from a product with H.
    /// The function changes the signs of all sine coefficients before and after the product.
    fn border(&self, evaluation: &Evaluation, condition: &Condition) -> Vec<f64> {
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
            .respond(harmonics, &evaluation.cores, &ports, &weights, true);
        for row in response.chunks_mut(n) {
            // Column 0 is the mean, so the sines begin at column 2.
            row.iter_mut()
                .skip(2)
                .step_by(2)
                .for_each(|sine| *sine = -*sine);
        }
        let blocks = evaluation
            .elements
            .iter()
            .zip(&evaluation.contact_jacobians);
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

    /// Completes `direct` = −J⁻¹ r by the motion with frequency (block elimination of the bordered system).
    pub(super) fn with_frequency_step(
        &self,
        slope: Option<&FrequencyDerivatives>,
        (mut direct, condition_residual): (Vec<f64>, f64),
    ) -> NewtonStep {
        let Some(slope) = slope else {
            return NewtonStep {
                unknowns: direct,
                omega: 0.0,
            };
        };
        let omega = -(condition_residual + dot(&slope.row, &direct)) / slope.total;
        add_scaled(&mut direct, omega, &slope.motion);
        NewtonStep {
            unknowns: direct,
            omega,
        }
    }

    /// Computes the derivative of the first harmonic (cosine, sine) at `port` with respect to frequency along the
    /// branch of a response.
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
        let evaluation = self.evaluate(&state, response.load_factor, &cosine, Some(LEAST_GRIP))?;
        let frame = self.frame(&evaluation, None)?;
        let solver = self.solver(&evaluation, &frame)?;
        let omega = state.omega;
        let slope = self.slope(&evaluation, &frame, &solver, &cosine, omega, STEP_TOLERANCE)?;
        let by_frequency = self.by_frequency(&evaluation, omega)?;
        let sine_total = self.partial(&sine, &by_frequency)
            + dot(&self.border(&evaluation, &sine), &slope.motion);
        Ok([slope.total, sine_total])
    }
}

// Storage of solves in the journal, from which an interrupted run resumes.

/// Kinds of a stored solve.
const FOUND: u64 = 0;
const NOT_CONVERGED: u64 = 1;
/// Another error, which a repeated solve reports again at little cost.
const REFUSED: u64 = 2;

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Solves for the response from `state` at the load `factor`, or reads it from the journal.
    pub(super) fn solve_or_read(
        &self,
        state: State,
        factor: f64,
        condition: &Condition,
    ) -> Result<Response, DynamicsError> {
        self.newton_to(self.settings.tolerance, state, factor, condition)
    }

    /// Solves for the response from `state` at the load `factor`, or reads it from the journal. The tolerance is the
    /// coarser of `tolerance` and the tolerance of the settings.
    pub(super) fn newton_to(
        &self,
        tolerance: f64,
        state: State,
        factor: f64,
        condition: &Condition,
    ) -> Result<Response, DynamicsError> {
        let tolerance = tolerance.max(self.settings.tolerance);
        if !self.journal.is_open() {
            return self.solve_with_frame(&mut None, tolerance, state, factor, condition);
        }
        let inputs = self.inputs(&state, factor, condition, tolerance);
        if let Some(stored) = self.journal.reuse(&inputs) {
            // An entry without a response is solved again, but the solution is not stored again.
            let decoded = self.read(&stored);
            return decoded.unwrap_or_else(|| {
                self.solve_with_frame(&mut None, tolerance, state, factor, condition)
            });
        }
        let before = self.effort.spent();
        let result = self.solve_with_frame(&mut None, tolerance, state, factor, condition);
        let spent = self.effort.spent() - before;
        self.journal.add(&inputs, &encode(&result, spent));
        result
    }

    /// Solves for the response from `state` with the `frame` of an earlier solve nearby, without the journal.
    pub(super) fn solve_with_frame(
        &self,
        frame: &mut Option<SolverCache>,
        tolerance: f64,
        state: State,
        factor: f64,
        condition: &Condition,
    ) -> Result<Response, DynamicsError> {
        let converge = || self.converge(state, factor, condition, tolerance, frame);
        self.threads.install(converge)
    }

    /// Returns the two branches that `work` computes, or reads the two branches from the journal. `by` contains the
    /// numbers on which the branches depend.
    pub(super) fn stored_or_computed_branches(
        &self,
        by: &[f64],
        work: impl FnOnce() -> Option<[Vec<Response>; 2]>,
    ) -> Option<[Vec<Response>; 2]> {
        if !self.journal.is_open() {
            return work();
        }
        let inputs = Inputs::default().numbers(by).numbers(&self.load_rows);
        if let Some(stored) = self.journal.reuse(&inputs)
            && let Some(decoded) = self.read_branches(&stored)
        {
            return decoded;
        }
        let before = self.effort.spent();
        let branches = work();
        let mut out = Writer::default();
        out.count(self.effort.spent() - before);
        for branch in branches.iter().flatten() {
            out.count(branch.len() as u64);
            branch
                .iter()
                .for_each(|response| write_response(&mut out, response));
        }
        self.journal.add(&inputs, &out.0);
        branches
    }

    /// Returns `None` for an entry of another balance, and `Some(None)` for stored branches that were not found.
    fn read_branches(&self, stored: &[u8]) -> Option<Option<[Vec<Response>; 2]>> {
        let mut reader = Reader(stored);
        let spent = reader.count()?;
        let mut branches = None;
        if !reader.0.is_empty() {
            let mut branch = || {
                let count = reader.count()?;
                let responses = (0..count).map(|_| self.read_response(&mut reader));
                responses.collect::<Option<Vec<_>>>()
            };
            branches = Some([branch()?, branch()?]);
        }
        if !reader.0.is_empty() {
            return None;
        }
        self.effort.add(spent);
        Some(branches)
    }

    fn inputs(&self, state: &State, factor: f64, condition: &Condition, tolerance: f64) -> Inputs {
        let conditions = match condition {
            Condition::Frequency => vec![],
            Condition::Linear {
                terms,
                by_omega,
                value,
            } => {
                let terms = terms.iter().flat_map(|term| {
                    let [a, b] = term.weights;
                    [term.port as f64, term.slot as f64, a, b]
                });
                terms.chain([*by_omega, *value]).collect()
            }
        };
        Inputs::default()
            .numbers(&[state.omega, factor, tolerance])
            .numbers(&conditions)
            .numbers(&self.load_rows)
            .numbers(&state.contact)
            .flags(&state.active)
    }

    /// Returns `None` for an entry of another balance.
    fn read(&self, stored: &[u8]) -> Option<Result<Response, DynamicsError>> {
        let mut reader = Reader(stored);
        let kind = reader.count()?;
        let spent = reader.count()?;
        let result = match kind {
            FOUND => Ok(self.read_response(&mut reader)?),
            NOT_CONVERGED => Err(DynamicsError::NotConverged {
                frequency: reader.number()?,
                load_factor: reader.number()?,
                iterations: reader.count()? as usize,
                correction: reader.number()?,
                tolerance: reader.number()?,
                active: reader.count()? as usize,
                elements: reader.count()? as usize,
            }),
            _ => return None,
        };
        if !reader.0.is_empty() {
            return None;
        }
        self.effort.add(spent);
        Some(result)
    }

    fn read_response(&self, reader: &mut Reader<'_>) -> Option<Response> {
        let n = self.harmonics().coefficients();
        let elements = self.elements.len();
        Some(Response {
            omega: reader.number()?,
            load_factor: reader.number()?,
            iterations: reader.count()? as usize,
            correction: reader.number()?,
            closure: reader.number()?,
            energy: Energy {
                load_work: reader.number()?,
                friction: reader.number()?,
                viscous: reader.number()?,
                hysteretic: reader.number()?,
            },
            displacement: reader.numbers(self.model.ports() * n)?,
            force: reader.numbers(3 * elements * n)?,
            active: (0..elements)
                .map(|_| Some(reader.count()? != 0))
                .collect::<Option<_>>()?,
        })
    }
}

fn write_response(out: &mut Writer, response: &Response) {
    out.numbers(&[response.omega, response.load_factor]);
    out.count(response.iterations as u64);
    let energy = &response.energy;
    out.numbers(&[response.correction, response.closure]);
    let Energy {
        load_work: input,
        friction,
        viscous,
        hysteretic,
    } = *energy;
    out.numbers(&[input, friction, viscous, hysteretic]);
    out.numbers(&response.displacement);
    out.numbers(&response.force);
    let active = response.active.iter();
    active.for_each(|active| out.count(u64::from(*active)));
}

fn encode(result: &Result<Response, DynamicsError>, spent: u64) -> Vec<u8> {
    let mut out = Writer::default();
    match result {
        Ok(response) => {
            out.count(FOUND);
            out.count(spent);
            write_response(&mut out, response);
        }
        Err(DynamicsError::NotConverged {
            frequency,
            load_factor,
            iterations,
            correction,
            tolerance,
            active,
            elements,
        }) => {
            out.count(NOT_CONVERGED);
            out.count(spent);
            out.numbers(&[*frequency, *load_factor]);
            out.count(*iterations as u64);
            out.numbers(&[*correction, *tolerance]);
            out.count(*active as u64);
            out.count(*elements as u64);
        }
        Err(_) => {
            out.count(REFUSED);
            out.count(spent);
        }
    }
    out.0
}
