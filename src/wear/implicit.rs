//! Second-order implicit wear step.
//!
//! The wear depth w grows by dw/dn = α(c p + f) per cycle. The factor c = ∮µ|dv| weights the slip path by friction, so
//! that c p is the dissipated energy. If the load varies in the cycle, p is the pressure under the largest load, which
//! has the largest contact area. For a varying load, c is the dissipated energy divided by p. The energy f is the
//! remaining energy, mainly of cells with p = 0. With constant c, a step that is implicit in p is a *normal contact
//! with an additional diagonal compliance* N α c. A step that is implicit in p is stable at any size:
//!
//! 1. Half a step with c of the beginning, by backward Euler, gives the pressure p½ on the surface w½.
//! 2. The fretting cycle there gives c½ and f½: the midpoint rule in the slip.
//! 3. The whole step with c½ uses the L-stable two-stage SDIRK method (γ = 1 − 1/√2) in the pressure: p₁, p₂.
//!
//! The midpoint rule and the SDIRK method are both of second order. All coefficients of both methods are positive. The
//! wear depth of a cell never decreases, and the wear depth grows only if c p or f of the cell is positive.
//!
//! The embedded error estimate compares the step with Simpson's rule over c₀p₀, c½p½ and the extrapolated (2c½ − c₀)p₂.
//! The estimate includes the change of the slip *and* the change of the pressure. The estimate and the error of the
//! step are both of third order. With stepped cycles, a few cells can decide whether the joint slides. A second
//! estimate detects sliding that begins in the step. The second estimate compares the step with Simpson's rule over the
//! energies of the cycles at the beginning, the middle and the end of the step. The cycle at the end of the step adds
//! no cost, because the next state uses the same cycle.
//!
//! If wear changes the motion, the contact of each cycle determines the motion of the same cycle.

use std::f64::consts::FRAC_1_SQRT_2;

use super::WearLaw;
use super::cycle::{CycleSolution, March};
use super::joint::{FrettingJoint, WearError, WornState};
use super::motion::Motion;
use super::scheme::check_wear_per_cycle;
use crate::contact::normal::NormalSolution;
use crate::grid::ByAxis;

/// γ of the two-stage SDIRK method.
const GAMMA: f64 = 1.0 - FRAC_1_SQRT_2;

/// Largest ratio of the proportion c to µ·(slip path). A larger ratio comes from a cell whose pressure peaks under
/// another load than the largest load. The step treats the energy above `LARGEST_RATIO` explicitly, as a part of f.
const LARGEST_RATIO: f64 = 4.0;

/// The error test compares the error of a step with the volume of the step plus a part of the volume worn before the
/// step. `PRIOR_VOLUME_FRACTION` is the ratio of this part to the volume worn before the step. Where wear dies out, the
/// volume of a step is smaller than the errors of the solves. Without the added part, the error test would reject every
/// step.
const PRIOR_VOLUME_FRACTION: f64 = 0.005;

/// Bounds on the ratio of the length of the next step to the length of the current step.
const STEP_CHANGE_BOUNDS: (f64, f64) = (0.2, 3.0);

/// Factor on the normal solve's tolerance for the half step and the first stage, up to [`LARGEST_TOLERANCE`]. Both
/// solves enter the wear only by the slip of the middle and by a part of the pressure. A factor of 100 changed the worn
/// volume by a relative 10⁻⁵.
const TOLERANCE_FACTOR: f64 = 100.0;
const LARGEST_TOLERANCE: f64 = 1e-4;

/// Returns the tolerance of a normal solve within a step. The returned tolerance is at least as large as `tolerance`,
/// the tolerance for the contact of a worn state.
pub(super) fn relaxed_tolerance(tolerance: f64) -> f64 {
    tolerance.max((TOLERANCE_FACTOR * tolerance).min(LARGEST_TOLERANCE))
}

/// Wear per cycle over α, split for the step: energy = c·p + f.
pub(super) struct Rate {
    pub(super) proportion: Vec<f64>,
    pub(super) explicit_rate: Vec<f64>,
}

/// State at the beginning of a step.
pub(super) struct StepBegin {
    pub(super) rate: Rate,
    /// Pressure under the largest load of the cycle \[Pa\].
    pub(super) pressure: Vec<f64>,
}

/// Accepted wear step.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Cycles of the step.
    pub cycles: u64,
    /// Wear depth after the step \[m\].
    pub wear: Vec<f64>,
    /// Contact after the step under the largest load of the cycle, from the last stage. The solve of the next contact
    /// starts from the pressure of this contact.
    pub contact: NormalSolution,
    /// Shear at t = 0 in the middle of the step \[Pa\], from which the next cycle starts.
    pub shear: ByAxis<Vec<f64>>,
    /// Cycle in the middle of the step.
    pub middle: MiddleCycle,
    /// Estimated error of the volume that the step wears (L1 norm of the wear field) \[m³\].
    pub error: f64,
    /// Cycles that the error allows for the next step.
    pub proposal: f64,
    /// Number of longer steps that the error test rejected before it accepted the step.
    pub rejected: usize,
    /// Cycle at the end of the step, if cycles are stepped.
    pub end: Option<EndCycle>,
}

/// Summary of the steady cycle in the middle of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MiddleCycle {
    /// Energy dissipated \[J\].
    pub dissipation: f64,
    /// Half range of the force along the motion \[N\].
    pub force: f64,
    /// Tangential compliance of the contact in the middle \[m/N\]; `None` if the motion does not change.
    pub compliance: Option<f64>,
}

/// Steady cycle at the end of a step, with all its inputs. A caller with the same inputs can reuse the cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct EndCycle {
    /// Motion.
    pub motion: Motion,
    /// Wear depth \[m\].
    pub wear: Vec<f64>,
    /// Static pressure at the mean load \[Pa\].
    pub pressure: Vec<f64>,
    /// Shear that the cycle was started from \[Pa\].
    pub start: ByAxis<Vec<f64>>,
    /// Steady cycle.
    pub cycle: CycleSolution,
    /// Number of pairs of Fourier transforms that the end cycle needed. The caller that reuses the end cycle counts
    /// these transform pairs.
    pub fft_pairs: f64,
}

/// Bounds on a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Error allowed, as a fraction of the volume worn in the step plus a small share of the volume worn
    /// before.
    pub tolerance: f64,
    /// Largest wear depth of a step, at the rate of its beginning \[m\].
    pub depth_step: Option<f64>,
    /// Cycles left.
    pub remaining: u64,
    /// Safety factor on the step length that the error estimate allows.
    pub safety: f64,
}

impl Limits {
    /// Default of [`Limits::safety`].
    pub const SAFETY: f64 = 0.85;
}

/// Returns the number of cycles for the first step, before an error estimate exists. The wear compliance of a cell is N
/// α µ·(slip path). At the end of the first step, the wear compliance of the fastest-wearing cell equals the
/// self-compliance of a cell on the half space.
pub fn first_proposal(joint: &FrettingJoint, state: &WornState, law: WearLaw) -> f64 {
    let longest_path = state.cycle.slip_path.iter();
    let longest_path = longest_path.fold(0.0f64, |m, path| m.max(*path));
    joint.half_space.self_compliance() / law.depth(joint.friction_coefficient * longest_path)
}

/// Makes one step of at most `proposal` cycles. `advance` shortens the step until the error of the step is within
/// `limits`.
pub fn advance(
    joint: &mut FrettingJoint,
    state: &WornState,
    law: WearLaw,
    proposal: f64,
    limits: Limits,
) -> Result<Step, WearError> {
    check_wear_per_cycle(proposal)?;
    joint.reset_motion();
    let begin = begin(joint, state)?;
    let deepest = law.depth(state.cycle.energy.iter().fold(0.0f64, |m, e| m.max(*e)));
    let by_depth = limits.depth_step.map_or(f64::INFINITY, |d| d / deepest);
    let mut cycles = whole_cycles(proposal.min(by_depth), limits.remaining);
    let mut rejected = 0;
    loop {
        let mut step = attempt(joint, state, &begin, law, cycles)?;
        let before = joint.volume(&state.wear);
        let volume = joint.volume(&step.wear) - before + PRIOR_VOLUME_FRACTION * before;
        let mut end = None;
        if joint.march == March::Stepped && step.error <= limits.tolerance * volume {
            let final_cycle = end_cycle(joint, &step)?;
            step.error = step
                .error
                .max(simpson_difference(joint, state, law, &step, &final_cycle));
            end = Some(final_cycle);
        }
        let relative = if volume > 0.0 {
            step.error / volume
        } else {
            0.0
        };
        // The relative error of a step is of second order in its length.
        let factor = limits.safety * (limits.tolerance / relative).sqrt();
        step.proposal = cycles as f64 * factor.clamp(STEP_CHANGE_BOUNDS.0, STEP_CHANGE_BOUNDS.1);
        if relative <= limits.tolerance {
            step.rejected = rejected;
            step.end = end;
            return Ok(step);
        }
        joint
            .half_space
            .count_pairs(end.map_or(0.0, |end| end.fft_pairs));
        if cycles == 1 {
            let tolerance = limits.tolerance;
            return Err(WearError::StepTooSmall {
                cycles,
                error: relative,
                tolerance,
            });
        }
        cycles = whole_cycles(step.proposal.min(0.9 * cycles as f64), limits.remaining);
        rejected += 1;
    }
}

/// Returns the whole number of cycles of a step, near `wanted` cycles. If at most three steps remain, the remaining
/// steps have equal lengths, so that the last step of the run is not short.
fn whole_cycles(wanted: f64, remaining: u64) -> u64 {
    if wanted >= remaining as f64 {
        return remaining;
    }
    let steps = (remaining as f64 / wanted).ceil();
    let cycles = if steps <= 3.0 {
        remaining as f64 / steps
    } else {
        wanted
    };
    (cycles as u64).clamp(1, remaining)
}

/// Computes one step of `cycles`, whatever its error.
pub(super) fn attempt(
    joint: &mut FrettingJoint,
    state: &WornState,
    begin: &StepBegin,
    law: WearLaw,
    cycles: u64,
) -> Result<Step, WearError> {
    let StepBegin {
        rate: begin,
        pressure,
    } = begin;
    joint.reset_motion();
    let load = joint.motion.largest_load();
    let reach = law.over(cycles);
    let add = |wear: &[f64], parts: &[(f64, &[f64])]| -> Vec<f64> {
        (0..wear.len())
            .map(|c| {
                wear[c]
                    + parts
                        .iter()
                        .map(|(factor, field)| factor * field[c])
                        .sum::<f64>()
            })
            .collect()
    };
    let scaled =
        |factor: f64, field: &[f64]| -> Vec<f64> { field.iter().map(|v| factor * v).collect() };
    let wear_rate = |rate: &Rate, pressure: &[f64]| -> Vec<f64> {
        rate.proportion
            .iter()
            .zip(pressure)
            .map(|(c, p)| c * p)
            .collect()
    };

    let base = add(&state.wear, &[(0.5 * reach, &begin.explicit_rate)]);
    let wear_compliance = scaled(0.5 * reach, &begin.proportion);
    let half = joint.contact_to(relaxed_tolerance, &base, &wear_compliance, load, pressure)?;
    let half_wear = add(&base, &[(0.5 * reach, &wear_rate(begin, &half.pressure))]);
    let shear = Some(&state.cycle.shear);
    let at_rest = match joint.motion.constant_load() {
        true => None,
        false => Some(joint.static_contact(&half_wear, Some(&half.pressure))?),
    };
    let at_rest = at_rest.as_ref().unwrap_or(&half);
    let compliance = joint.update_motion(&at_rest.pressure)?;
    let cycle = joint.cycle(&half_wear, at_rest, shear)?;
    let middle = split(joint, &half.pressure, &cycle.slip_path, &cycle.energy);

    let wear_compliance = scaled(GAMMA * reach, &middle.proportion);
    let base = add(&state.wear, &[(GAMMA * reach, &middle.explicit_rate)]);
    // Extrapolates the pressures of the beginning and the middle linearly to a fraction of the step.
    let on_line = |part: f64| -> Vec<f64> {
        let cells = pressure.iter().zip(&half.pressure);
        cells
            .map(|(begin, half)| (begin + 2.0 * part * (half - begin)).max(0.0))
            .collect()
    };
    let first = joint.contact_to(
        relaxed_tolerance,
        &base,
        &wear_compliance,
        load,
        &on_line(GAMMA),
    )?;
    let first_rate = wear_rate(&middle, &first.pressure);
    let base = add(
        &state.wear,
        &[
            ((1.0 - GAMMA) * reach, &first_rate),
            (reach, &middle.explicit_rate),
        ],
    );
    let second = joint.contact(&base, Some(&wear_compliance), load, Some(&on_line(1.0)))?;
    let second_rate = wear_rate(&middle, &second.pressure);
    let wear = add(&base, &[(GAMMA * reach, &second_rate)]);

    let lambda = joint.half_space.self_compliance();
    let error = (0..wear.len()).map(|c| {
        let last = (2.0 * middle.proportion[c] - begin.proportion[c]).max(0.0) * second.pressure[c];
        let between = middle.proportion[c] * half.pressure[c];
        let simpson = (begin.proportion[c] * pressure[c] + 4.0 * between + last) / 6.0;
        let step_rate = (1.0 - GAMMA) * first_rate[c] + GAMMA * second_rate[c];
        // Where the wear compliance exceeds the compliance of the half space, the implicit step damps the error of the
        // quadrature.
        reach * (step_rate - simpson).abs() / (1.0 + reach * middle.proportion[c] / lambda)
    });
    let error = error.sum::<f64>() * joint.patch.grid.cell_area();
    Ok(Step {
        cycles,
        wear,
        contact: second,
        middle: MiddleCycle {
            dissipation: cycle.dissipation,
            force: cycle.force_along(),
            compliance,
        },
        shear: cycle.shear,
        error,
        proposal: 0.0,
        rejected: 0,
        end: None,
    })
}

/// Computes the cycle at the end of a step.
fn end_cycle(joint: &mut FrettingJoint, step: &Step) -> Result<EndCycle, WearError> {
    let contact = joint.static_contact(&step.wear, Some(&step.contact.pressure))?;
    joint.update_motion(&contact.pressure)?;
    let before = joint.half_space.take_pairs();
    let cycle = joint.cycle(&step.wear, &contact, Some(&step.shear))?;
    let fft_pairs = joint.half_space.take_pairs();
    joint.half_space.count_pairs(before);
    Ok(EndCycle {
        motion: joint.motion.clone(),
        wear: step.wear.clone(),
        pressure: contact.pressure,
        start: step.shear.clone(),
        cycle,
        fft_pairs,
    })
}

/// Returns the difference between the volume worn in a step and the volume by Simpson's rule \[m³\]. Simpson's rule
/// uses the cycles at the beginning, in the middle and at the `end` of the step. The wear rate can grow in the second
/// half of the step if the joint begins to slide or if new cells touch. If the wear rate does not grow in the second
/// half of the step, `simpson_difference` returns 0. If the wear rate falls in the step, the implicit step damps the
/// difference.
fn simpson_difference(
    joint: &FrettingJoint,
    begin: &WornState,
    law: WearLaw,
    step: &Step,
    end: &EndCycle,
) -> f64 {
    let energies = [
        begin.cycle.dissipation,
        step.middle.dissipation,
        end.cycle.dissipation,
    ];
    let [first, middle, last] = energies;
    if last <= middle {
        return 0.0;
    }
    let worn = joint.volume(&step.wear) - joint.volume(&begin.wear);
    (law.over(step.cycles) * (first + 4.0 * middle + last) / 6.0 - worn).abs()
}

/// Computes the wear rate at the beginning of a step, and the pressure to which it is proportional.
pub(super) fn begin(joint: &mut FrettingJoint, state: &WornState) -> Result<StepBegin, WearError> {
    let pressure = if joint.motion.constant_load() {
        state.pressure.clone()
    } else {
        let load = joint.motion.largest_load();
        joint
            .contact(&state.wear, None, load, Some(&state.pressure))?
            .pressure
    };
    let CycleSolution {
        slip_path, energy, ..
    } = &state.cycle;
    Ok(StepBegin {
        rate: split(joint, &pressure, slip_path, energy),
        pressure,
    })
}

/// Splits the energy of a cycle into c·p and f, with p under the largest load. Under constant load c is µ
/// times the slip path, and f is zero.
fn split(joint: &FrettingJoint, pressure: &[f64], slip_path: &[f64], energy: &[f64]) -> Rate {
    let constant = joint.motion.constant_load();
    let mut rate = Rate {
        proportion: vec![0.0; pressure.len()],
        explicit_rate: vec![0.0; pressure.len()],
    };
    for c in 0..pressure.len() {
        let path = joint.friction_coefficient * slip_path[c];
        if constant || pressure[c] <= 0.0 {
            rate.proportion[c] = path;
        } else {
            rate.proportion[c] = (energy[c] / pressure[c]).min(LARGEST_RATIO * path);
        }
        if !constant {
            rate.explicit_rate[c] = (energy[c] - rate.proportion[c] * pressure[c]).max(0.0);
        }
    }
    rate
}
