//! Newton's method for the harmonic balance, with one more unknown (the frequency) and condition if asked for.
//!
//! Steps are measured by the correction that the factor at hand gives for the residual after them, so acceptance does not depend
//! on units or on how near a resonance the structure is (natural monotonicity: Deuflhard, Newton Methods for Nonlinear Problems,
//! §3.3).

use super::aft::InterfaceElement;
use super::krylov::{dot, norm};
use super::newton_step::{Change, Condition, Evaluation, Frame, LEAST_GRIP, STEP_TOLERANCE, State};
use super::{DynamicsError, HarmonicBalance, Response};
use crate::linalg::add_scaled;

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
/// Accepted correction over the tolerance where an iteration is costly. Rounding may keep such a response from the tolerance.
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
            true => ACCEPTED_OF_COSTLY * tolerance,
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
