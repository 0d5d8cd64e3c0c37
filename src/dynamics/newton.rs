//! Newton's method for the harmonic balance, with one more unknown (the frequency) and condition if asked for.
//!
//! Steps are measured by the correction that the factor at hand gives for the residual after them, so acceptance does not depend
//! on units or on how near a resonance the structure is (natural monotonicity: Deuflhard, Newton Methods for Nonlinear Problems,
//! §3.3).

use std::cell::RefCell;

use num_complex::Complex64;

use super::aft::{Closure, InterfaceElement, Workspace};
use super::closed_model::{Among, Precision};
use super::krylov::{self, Learned, MOST_ITERATIONS, dot, norm};
use super::preconditioner::{ElementPart, Preconditioner};
use super::{DynamicsError, Energy, HarmonicBalance, Response};
use crate::journal::{Inputs, Reader, Writer};
use crate::linalg::{Blocks, Factors, RowMatrix as Matrix, add_scaled};

/// The correction must shrink by this share of the step's length.
const DESCENT: f64 = 0.25;
/// Step lengths tried: 1, ½, … ; a kink of the friction law is passed by one of them or by none.
const HALVINGS: u32 = 6;
/// Correction from which one more step mostly converges, so that no Jacobian is wanted after it.
const NEARLY: f64 = 1e-4;
/// Correction from which Jacobians that cost much are kept for further steps, and the share of a correction that such a step may
/// leave: at more, or where more than two such steps would be left, they are made anew. A step of more Krylov iterations costs more
/// than they do.
const NEAR: f64 = 2e-3;
const DEAR: usize = 25;
const CHORD: f64 = 0.1;
/// Correction over the tolerance from which two steps with a Jacobian that is kept mostly converge.
const FEW_CHORDS: f64 = 1e3;
/// Where an iteration is dear: the largest relative tolerance of a step.
const LOOSE: f64 = 1e-2;
/// There, a step that is so many times what the preconditioner makes of it is measured by solving for it, to that relative tolerance.
const MISSED: f64 = 4.0;
const MEASURED: f64 = 0.1;
/// Steps in a row that may fail to descend: the law has kinks, across which a full step often helps although it looks worse.
const TRIALS: usize = 3;
/// Krylov iterations from which the element part of the preconditioner is made anew, and where they have learned what it misses.
const STALE: usize = 25;
const LOST: usize = 75;
/// Grip of the mean displacement far from the solution, and per relative correction on the way: means that nothing but a few
/// sticking elements holds run off when these begin to slip, and a held one is a shorter step.
const MOST_GRIP: f64 = 1e-2;
const GRIP_PER_CORRECTION: f64 = 0.1;
/// Relative change of frequency from its start that leads to another resonance, if to any.
const FAR: f64 = 0.5;
/// Correction that is accepted where no step makes it smaller: kinks of the law may leave as much. The response says what is left.
const ACCEPTED: f64 = 1e-6;
/// Accepted correction over the tolerance of the settings where an iteration is costly. Rounding may keep such a response from the tolerance.
const ACCEPTED_OF_COSTLY: f64 = 10.0;
/// Iterations after which the correction must have halved.
const PATIENCE: usize = 8;
/// Times in a row that a correction may grow at most where the frequency is free, and from which size on: below, it is rounding.
const RUNAWAY: usize = 2;
const AWAY: f64 = 0.1;
/// Weight of a relative change of frequency against one of displacement: amplitudes change by 100 % within about 1 %.
pub(super) const FREQUENCY_WEIGHT: f64 = 100.0;

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Converges `state` at the load `factor`, until the correction is within `tolerance`. A `frame` of an earlier solve saves its making, and
    /// stands there for a later one.
    pub(super) fn converge(
        &self,
        mut state: State,
        factor: f64,
        condition: &Condition,
        tolerance: f64,
        frame: &mut Option<Frame>,
    ) -> Result<Response, DynamicsError> {
        let first_omega = state.omega;
        // A single evaluation of many samples is no little where hundreds of searches end here.
        if self.effort.is_spent() {
            return Err(DynamicsError::Spent {
                frequency: state.omega / (2.0 * std::f64::consts::PI),
            });
        }
        let mut grip = MOST_GRIP;
        let mut at = self.evaluate(&state, factor, condition, Some(grip))?;
        let mut failures = 0;
        let mut correction = f64::INFINITY;
        // The last one measured, for the error, and that of the state at hand.
        let (mut reached, mut standing) = (f64::INFINITY, f64::INFINITY);
        let mut spent = 0;
        // A resonance that is missed is tried again from nearer; at a given frequency there may be nothing nearer.
        let patience = match condition {
            Condition::Frequency => 2 * PATIENCE,
            Condition::Linear { .. } => PATIENCE,
        };
        let (mut least, mut since) = (f64::INFINITY, 0);
        // Whether the Jacobians are of a state before: their step is taken only where it is a good one.
        let mut is_old = false;
        // How often in a row the correction has grown.
        let (mut last, mut growths) = (f64::INFINITY, 0);
        for iteration in 0..=self.settings.most_iterations {
            self.gauge.add_iteration(self.harmonics().highest());
            spent = iteration;
            if self.effort.is_spent() {
                break;
            }
            while self.enlarge(&mut state, &at) {
                at = self.evaluate(&state, factor, condition, Some(grip))?;
                (correction, is_old) = (f64::INFINITY, false);
            }
            let free = matches!(condition, Condition::Frequency);
            if (at.elements.is_empty() && free) || correction <= tolerance {
                let correction = if correction.is_finite() {
                    correction
                } else {
                    0.0
                };
                return self.response(state, factor, at, iteration, correction);
            }
            if iteration == self.settings.most_iterations {
                break;
            }
            let mut now = self.frame(&at, frame.take())?;
            let solver = self.solver(&at, &now)?;
            let slope = match condition {
                Condition::Frequency => None,
                // Where an iteration is dear, the motion with frequency is found with the step.
                Condition::Linear { .. } if self.is_costly => {
                    Some(self.rough_slope(&at, &solver, condition, state.omega)?)
                }
                Condition::Linear { .. } => {
                    let omega = state.omega;
                    Some(self.slope(&at, &now, &solver, condition, omega, STEP_TOLERANCE)?)
                }
            };
            let complete = |direct, left| self.completed(slope.as_ref(), (direct, left));
            let reach = Reach::of(&state, &at, self.width());
            let solved = |there: &Evaluation, tolerance: f64| match &slope {
                Some(slope) if self.is_costly => {
                    let right = (&there.residual[..], there.condition);
                    let scale = reach.per_frequency();
                    self.bordered_step(&solver, &at, &now, slope, scale, right, tolerance)
                }
                _ => {
                    let (direct, effort) =
                        self.step(&solver, &at, &now, &there.residual, tolerance)?;
                    Ok((complete(direct, there.condition), effort))
                }
            };
            let roughly = |there: &Evaluation| {
                let direct = solver.approximate(&there.residual);
                reach.size(&complete(direct, there.condition))
            };
            let rough = roughly(&at);
            standing = rough;
            let mut before = rough;
            let (step, effort) = solved(&at, self.step_tolerance(rough, tolerance))?;
            // A preconditioner that misses most of a step is no measure of what trials leave.
            let is_missed = self.is_costly && reach.size(&step) > MISSED * before;
            if is_missed {
                before = reach.size(&step);
            }
            let measure = |there: &Evaluation| -> Result<f64, DynamicsError> {
                if !is_missed {
                    return Ok(roughly(there));
                }
                let (step, _) = solved(there, MEASURED)?;
                Ok(reach.size(&step))
            };
            // What little holds is not to be held longer than the rest needs it.
            grip = (GRIP_PER_CORRECTION * rough).clamp(LEAST_GRIP, MOST_GRIP);
            // What little holds may move far while everything else settles: that is progress too.
            let gains = |there: &Evaluation| is_missed && roughly(there) <= 0.5 * rough;
            // A state that gains nothing over many steps is a cycle between two sides of a kink.
            if rough < 0.5 * least {
                (least, since) = (rough, iteration);
            } else if iteration - since >= patience {
                break;
            }
            // One that only grows runs away to another resonance, if to any.
            let grows = rough > last && rough > AWAY;
            growths = if grows { growths + 1 } else { 0 };
            last = rough;
            if !free && growths > RUNAWAY {
                break;
            }
            if reach.size(&step) <= tolerance && before <= tolerance {
                correction = reach.size(&step);
                *frame = Some(now);
                continue;
            }
            let near = match effort {
                0..=DEAR if self.is_costly => NEAR,
                _ => NEARLY,
            };
            let roughly = f64::min(FEW_CHORDS * tolerance, LOOSE);
            let near = near.max(tolerance / CHORD).max(roughly);
            let mut is_refused = false;
            let mut best: Option<(f64, f64, State, Evaluation)> = None;
            let mut full: Option<(State, Evaluation)> = None;
            for halving in 0..HALVINGS {
                let length = 0.5_f64.powi(halving as i32);
                let trial = self.moved(&state, &at, &step, length);
                if (trial.omega / first_omega - 1.0).abs() > FAR {
                    continue;
                }
                // Most full steps are taken; of the others the Jacobian is of use only once they are.
                let wanted = (halving == 0 && before > near).then_some(grip);
                let there = self.evaluate(&trial, factor, condition, wanted)?;
                let left = measure(&there)?;
                let enough = left <= (1.0 - DESCENT * length) * before || gains(&there);
                is_refused = is_old && !enough && left > tolerance;
                if is_refused {
                    break;
                }
                if enough || best.as_ref().is_none_or(|(b, ..)| left < *b) {
                    let worse = best.replace((left, length, trial, there));
                    if let Some((_, 1.0, trial, there)) = worse {
                        full = Some((trial, there));
                    }
                } else if halving == 0 {
                    full = Some((trial, there));
                }
                if enough {
                    break;
                }
            }
            if is_refused {
                at = self.evaluate(&state, factor, condition, Some(grip))?;
                (correction, is_old) = (f64::INFINITY, false);
                *frame = Some(now);
                continue;
            }
            let Some((left, length, trial, there)) = best else {
                break;
            };
            reached = left;
            if left < before || gains(&there) {
                failures = 0;
                correction = if length == 1.0 { left } else { f64::INFINITY };
                let old = std::mem::replace(&mut at, there);
                state = trial;
                let share = left / before;
                let lasts = share <= CHORD && left * share * share <= tolerance;
                is_old = self.is_costly && lasts && !at.has_jacobians();
                if is_old {
                    at.beyond = old.beyond;
                }
            } else if left <= tolerance {
                // Rounding: neither better nor worse.
                correction = left;
            } else {
                failures += 1;
                correction = f64::INFINITY;
                if failures > TRIALS || !left.is_finite() {
                    break;
                }
                let Some(all) = (if length == 1.0 {
                    Some((trial, there))
                } else {
                    full
                }) else {
                    break;
                };
                (state, at) = all;
                is_old = false;
            }
            if !at.has_jacobians() {
                at = self.evaluate(&state, factor, condition, Some(grip))?;
            }
            if effort > if self.is_costly { LOST } else { STALE } {
                now.forget();
            }
            *frame = Some(now);
        }
        let accepted = match self.is_costly {
            true => ACCEPTED_OF_COSTLY * self.settings.tolerance,
            false => ACCEPTED,
        };
        if standing <= accepted {
            return self.response(state, factor, at, spent, standing);
        }
        Err(DynamicsError::NotConverged {
            frequency: state.omega / (2.0 * std::f64::consts::PI),
            load_factor: factor,
            iterations: spent,
            correction: reached,
            tolerance,
            active: at.elements.len(),
            elements: self.elements.len(),
        })
    }

    /// How exactly the step from a state is solved whose correction is known to be about `correction`. Where an iteration is dear, no
    /// more exactly than what the step leaves by its curvature (Eisenstat and Walker 1996), or than is wanted in the end.
    fn step_tolerance(&self, correction: f64, tolerance: f64) -> f64 {
        if !self.is_costly {
            return STEP_TOLERANCE;
        }
        let wanted = 0.3 * tolerance / correction;
        correction.max(wanted).clamp(STEP_TOLERANCE, LOOSE)
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
            if !self.sampling.follows_reference(element, row) {
                state.active[index] = true;
                grown = true;
            }
        }
        grown
    }

    fn moved(&self, state: &State, at: &Evaluation, step: &Change, length: f64) -> State {
        let width = self.width();
        let mut out = state.clone();
        out.omega += length * step.omega;
        for (&element, step) in at.elements.iter().zip(step.unknowns.chunks(width)) {
            add_scaled(&mut out.contact[element * width..][..width], length, step);
        }
        out
    }
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

    /// What counts as much as a change of frequency of 1 rad/s \[m\].
    fn per_frequency(&self) -> f64 {
        FREQUENCY_WEIGHT * self.displacement / self.omega
    }

    fn size(&self, step: &Change) -> f64 {
        let displacement = norm(&step.unknowns) / self.displacement;
        displacement.hypot(FREQUENCY_WEIGHT * step.omega / self.omega)
    }
}

// One Newton step of the harmonic balance: residual, Jacobian, and what solves with it.

/// Relative tolerance of a Newton step solved by GMRES. Steps of a nearly linear problem then gain four digits each.
pub(super) const STEP_TOLERANCE: f64 = 1e-4;
/// Least share of the tangential stiffness that is left, in the Jacobian alone, to a mean displacement of full slip. Full slip
/// forgets its mean, and a motion that friction alone holds would otherwise run away; what something else holds converges hardly
/// slower.
pub(super) const LEAST_GRIP: f64 = 1e-6;
/// Unknowns up to which a step that Krylov iterations do not find is found by elimination: half a gigabyte.
const MOST_DENSE: usize = 6000;
/// Elements that a thread evaluates at once.
const AT_ONCE: usize = 8;
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

    pub(super) fn terms(&self) -> &[Term] {
        match self {
            Condition::Frequency => &[],
            Condition::Linear { terms, .. } => terms,
        }
    }

    /// The sum of the terms, of rows of `n` coefficients of all ports.
    pub(super) fn of_ports(&self, rows: &[f64], n: usize) -> f64 {
        let terms = self.terms().iter();
        terms.map(|term| term.of(&rows[term.port * n..])).sum()
    }
}

/// Everything that Newton's method wants to know about a state.
pub(super) struct Evaluation {
    pub(super) cores: Vec<Matrix<Complex64>>,
    pub(super) elements: Vec<usize>,
    /// Contact degrees of freedom of the active elements, then ports with loads.
    pub(super) ports: Vec<usize>,
    /// Forces on them: what is beyond the reference with the sign of a load, then loads.
    pub(super) forces: Vec<f64>,
    /// Share of the loads.
    pub(super) factor: f64,
    /// Jacobians of what is beyond the reference, one per active element; none if not asked for.
    pub(super) beyond: Vec<Matrix>,
    /// Contact forces of the active elements, and how well their cycles close.
    pub(super) contact: Vec<(Vec<f64>, Closure)>,
    pub(super) displacement: Vec<f64>,
    pub(super) residual: Vec<f64>,
    pub(super) condition: f64,
}

/// What an element adds to an evaluation.
struct OfElement {
    /// Beyond the reference with the sign of a load.
    force: Vec<f64>,
    beyond: Option<Matrix>,
    contact: (Vec<f64>, Closure),
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

    /// Solves `operator(x) = right` with what was learned before, and learns from it; x and the Krylov iterations. All systems of a frame
    /// have as many unknowns.
    ///
    /// It is preconditioned from the left, so that what is left is small as a correction, which is what Newton's method measures: a mean
    /// displacement that little holds is much of that for next to no residual.
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
        memory.add(solved.learned);
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

/// A change of the active unknowns and of the frequency.
pub(super) struct Change {
    pub(super) unknowns: Vec<f64>,
    pub(super) omega: f64,
}

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Receptances of the coordinates at every harmonic of the angular frequency `omega`.
    pub(super) fn cores(&self, omega: f64) -> Result<Vec<Matrix<Complex64>>, DynamicsError> {
        let orders = self.harmonics().orders();
        let receptance = |order: &u32| self.model.core.receptance(f64::from(*order) * omega);
        self.threads.map(orders, receptance).into_iter().collect()
    }

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
            let own = |element: &usize| self.evaluate_element(*element, state, grip, &mut work);
            part.iter().map(own).collect::<Vec<_>>()
        });
        for own in parts.into_iter().flatten() {
            forces.extend(own.force);
            beyond.extend(own.beyond);
            contact.push(own.contact);
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

    /// One element of [`Self::evaluate`].
    fn evaluate_element(
        &self,
        element: usize,
        state: &State,
        grip: Option<f64>,
        work: &mut Workspace,
    ) -> OfElement {
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
        OfElement {
            force: g,
            beyond: jacobian,
            contact,
        }
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
            let part =
                ElementPart::new(&self.threads, model, basis, harmonics, elements, &at.beyond)?;
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
                preconditioner: Preconditioner::new(&self.threads, part, harmonics, &at.cores)?,
            });
        }
        self.dense(at, frame)
    }

    fn dense(&self, at: &Evaluation, frame: &Frame) -> Result<Solver<'static>, DynamicsError> {
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
    pub(super) fn operate(
        &self,
        at: &Evaluation,
        frame: &Frame,
        forces: &[f64],
        v: &[f64],
    ) -> Vec<f64> {
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
        let solved = match self.is_costly {
            true => frame.solve(operator, precondition, &right, tolerance),
            false => krylov::solve(operator, precondition, &right, tolerance)
                .map(|solved| (solved.x, solved.iterations)),
        };
        match solved {
            Err(error @ DynamicsError::Krylov { .. }) => {
                let solver = self.dense_instead(at, frame, error)?;
                // As many iterations as failed, so that the preconditioner is made anew.
                Ok((solver.approximate(residual), krylov::MOST_ITERATIONS))
            }
            solved => solved,
        }
    }

    /// A solver by elimination where Krylov iterations end in `error`, if its matrix fits into memory.
    ///
    /// # Errors
    /// `error` if it does not.
    pub(super) fn dense_instead(
        &self,
        at: &Evaluation,
        frame: &Frame,
        error: DynamicsError,
    ) -> Result<Solver<'static>, DynamicsError> {
        match at.residual.len() <= MOST_DENSE {
            true => self.dense(at, frame),
            false => Err(error),
        }
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

// The border of a Newton step whose frequency is free: how the state moves with frequency, and a condition with both.

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

// A solve of the harmonic balance that an interrupted start may have made: what Newton's method led to, as it is kept.

/// What is kept of a solve.
const FOUND: u64 = 0;
const NOT_CONVERGED: u64 = 1;
/// Another error, which is met again at little cost.
const REFUSED: u64 = 2;

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Converges `state` at the load `factor`, unless an earlier start has.
    pub(super) fn newton(
        &self,
        state: State,
        factor: f64,
        condition: &Condition,
    ) -> Result<Response, DynamicsError> {
        self.newton_to(self.settings.tolerance, state, factor, condition)
    }

    /// Converges `state` at the load `factor` to `tolerance`, at least that of the settings, unless an earlier start has.
    pub(super) fn newton_to(
        &self,
        tolerance: f64,
        state: State,
        factor: f64,
        condition: &Condition,
    ) -> Result<Response, DynamicsError> {
        let tolerance = tolerance.max(self.settings.tolerance);
        if !self.journal.is_open() {
            return self.newton_from(&mut None, tolerance, state, factor, condition);
        }
        let inputs = self.inputs(&state, factor, condition, tolerance);
        if let Some(kept) = self.journal.take(&inputs) {
            // What is not read is refused again, and stands there already.
            let read = self.read(&kept);
            return read.unwrap_or_else(|| {
                self.newton_from(&mut None, tolerance, state, factor, condition)
            });
        }
        let before = self.effort.spent();
        let result = self.newton_from(&mut None, tolerance, state, factor, condition);
        let spent = self.effort.spent() - before;
        self.journal.add(&inputs, &written(&result, spent));
        result
    }

    /// Converges `state` with the frame of an earlier solve nearby, which is not kept in a journal.
    pub(super) fn newton_from(
        &self,
        frame: &mut Option<Frame>,
        tolerance: f64,
        state: State,
        factor: f64,
        condition: &Condition,
    ) -> Result<Response, DynamicsError> {
        let converge = || self.converge(state, factor, condition, tolerance, frame);
        self.threads.within(converge)
    }

    /// The two branches that `work` leads to, unless an earlier start has followed them; `by` are the numbers that they depend on.
    pub(super) fn kept_branches(
        &self,
        by: &[f64],
        work: impl FnOnce() -> Option<[Vec<Response>; 2]>,
    ) -> Option<[Vec<Response>; 2]> {
        if !self.journal.is_open() {
            return work();
        }
        let inputs = Inputs::default().numbers(by).numbers(&self.load_rows);
        if let Some(kept) = self.journal.take(&inputs)
            && let Some(read) = self.read_branches(&kept)
        {
            return read;
        }
        let before = self.effort.spent();
        let found = work();
        let mut out = Writer::default();
        out.count(self.effort.spent() - before);
        for branch in found.iter().flatten() {
            out.count(branch.len() as u64);
            branch.iter().for_each(|response| write(&mut out, response));
        }
        self.journal.add(&inputs, &out.0);
        found
    }

    /// None of what was not written for this balance; none within of what is not found.
    fn read_branches(&self, kept: &[u8]) -> Option<Option<[Vec<Response>; 2]>> {
        let mut reader = Reader(kept);
        let spent = reader.count()?;
        let mut found = None;
        if !reader.0.is_empty() {
            let mut branch = || {
                let count = reader.count()?;
                let responses = (0..count).map(|_| self.read_response(&mut reader));
                responses.collect::<Option<Vec<_>>>()
            };
            found = Some([branch()?, branch()?]);
        }
        if !reader.0.is_empty() {
            return None;
        }
        self.effort.add(spent);
        Some(found)
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

    /// None of what was not written for this balance.
    fn read(&self, kept: &[u8]) -> Option<Result<Response, DynamicsError>> {
        let mut reader = Reader(kept);
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
                input: reader.number()?,
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

fn write(out: &mut Writer, response: &Response) {
    out.numbers(&[response.omega, response.load_factor]);
    out.count(response.iterations as u64);
    let energy = &response.energy;
    out.numbers(&[response.correction, response.closure]);
    let Energy {
        input,
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

fn written(result: &Result<Response, DynamicsError>, spent: u64) -> Vec<u8> {
    let mut out = Writer::default();
    match result {
        Ok(response) => {
            out.count(FOUND);
            out.count(spent);
            write(&mut out, response);
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
