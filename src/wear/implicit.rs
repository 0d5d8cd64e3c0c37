//! The second-order implicit wear step.
//!
//! Wear depth w grows by dw/dn = α(c p + f) per cycle, where c = ∮µ|dv| is the slip seen by friction (so that c p is the
//! dissipated energy). Where the load varies in the cycle p is the pressure under its largest load, under which all cells touch that ever
//! do, and c what they dissipate in proportion to that; f is what is left where p is zero. With c frozen, a step that is implicit in p
//! is a *normal contact with an additional diagonal compliance* N α c, and stable at any size:
//!
//! 1. half a step with c at its beginning, by backward Euler: pressure p½ on the surface w½;
//! 2. the fretting cycle there: c½, f½ — the midpoint rule in the slip;
//! 3. the whole step with c½ by the L-stable two-stage SDIRK method (γ = 1 − 1/√2) in the pressure: p₁, p₂.
//!
//! Both are of second order, and all coefficients are positive: wear only grows, and nowhere but where c p or f is positive.
//!
//! The embedded error compares with Simpson's rule over c₀p₀, c½p½ and the extrapolated (2c½ − c₀)p₂: it sees the change of
//! slip *and* of pressure, and is of third order as the step's own error is. Where cycles are stepped a few cells may decide whether the joint
//! slides, so that a step is held against Simpson's rule over the energies of three cycles too, that of its end among them, which is the
//! cycle of the next state and costs nothing more.
//!
//! Where the motion changes as the joint wears, each of these cycles has that of its own contact.

use std::f64::consts::FRAC_1_SQRT_2;

use super::WearLaw;
use super::cycle::{CycleSolution, March};
use super::joint::{FrettingJoint, WearError, WornState};
use super::motion::Motion;
use super::scheme::check_cycle;
use crate::contact::normal::NormalSolution;
use crate::grid::ByAxis;

/// γ of the two-stage SDIRK method.
const GAMMA: f64 = 1.0 - FRAC_1_SQRT_2;

/// A proportion c above this many times µ·(slip path) comes from a cell whose pressure is larger under another load than the largest; what is
/// above it is worn explicitly.
const LARGEST_RATIO: f64 = 4.0;

/// Part of the step that the error estimate would allow, taken.
const SAFETY: f64 = 0.85;

/// Part of the volume worn so far that counts as if the step wore it. Where wear dies out, the step's own volume falls below
/// what the solves' tolerances leave of error, and no step would be short enough.
const SETTLED: f64 = 0.005;

/// Bounds on the change of the step from one to the next.
const CHANGE: (f64, f64) = (0.2, 3.0);

/// Times the tolerance of a normal solve to which half step and first stage are solved, up to [`LOOSEST`]. They enter the wear by the slip of the
/// middle and by a part of the pressure alone: with 100 the worn volume changed by 10⁻⁵.
const LOOSER: f64 = 100.0;
const LOOSEST: f64 = 1e-4;

/// Tolerance of a normal solve that need not be as exact as the contact of a state.
pub(super) fn looser(tolerance: f64) -> f64 {
    tolerance.max((LOOSER * tolerance).min(LOOSEST))
}

/// Wear per cycle over α, split for the step: energy = c·p + f.
pub(super) struct Rate {
    pub(super) proportion: Vec<f64>,
    pub(super) rest: Vec<f64>,
}

/// What a step begins with.
pub(super) struct Begin {
    pub(super) rate: Rate,
    /// Pressure under the largest load of the cycle \[Pa\].
    pub(super) pressure: Vec<f64>,
}

/// A finished step.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Cycles of the step.
    pub cycles: u64,
    /// Wear depth after it \[m\].
    pub wear: Vec<f64>,
    /// Contact after it under the largest load of the cycle, as the last stage found it: what the next contact starts from.
    pub contact: NormalSolution,
    /// Shear at t = 0 in its middle, to start the next cycle from \[Pa\].
    pub shear: ByAxis<Vec<f64>>,
    /// The cycle of its middle.
    pub middle: MiddleCycle,
    /// Estimated error of the worn volume in this step (L1 of the wear field) \[m³\].
    pub error: f64,
    /// Cycles that the error would allow to the next step.
    pub proposal: f64,
    /// Steps that were tried and found inaccurate before this one.
    pub rejected: usize,
    /// The cycle at its end, where cycles are stepped.
    pub end: Option<EndCycle>,
}

/// The steady cycle in the middle of a step, in few numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MiddleCycle {
    /// Energy dissipated \[J\].
    pub dissipation: f64,
    /// Half range of the force along the motion \[N\].
    pub force: f64,
    /// Tangential compliance of the contact there \[m/N\]; none where the motion stays.
    pub compliance: Option<f64>,
}

/// The steady cycle at the end of a step, with all that it hangs on: who asks for it there need not march it again.
#[derive(Debug, Clone, PartialEq)]
pub struct EndCycle {
    /// The motion.
    pub motion: Motion,
    /// Wear depth \[m\].
    pub wear: Vec<f64>,
    /// Static pressure at the mean load \[Pa\].
    pub pressure: Vec<f64>,
    /// Shear that it was marched from \[Pa\].
    pub start: ByAxis<Vec<f64>>,
    /// The cycle.
    pub cycle: CycleSolution,
    /// Transform pairs that it took; they count for who asks for it.
    pub fft_pairs: f64,
}

/// What bounds a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Error allowed, as a part of the volume worn in the step and, to a small share, before it.
    pub tolerance: f64,
    /// Largest wear depth at the rate of its beginning \[m\].
    pub depth_step: Option<f64>,
    /// Cycles left.
    pub remaining: u64,
}

/// Cycles for a first step, before any error is known: the fastest-wearing cell's wear compliance is then the half
/// space's own.
pub fn first_proposal(joint: &FrettingJoint, state: &WornState, law: WearLaw) -> f64 {
    let farthest = state.cycle.slip_path.iter();
    let farthest = farthest.fold(0.0f64, |m, path| m.max(*path));
    joint.half_space.self_compliance() / law.depth(joint.friction_coefficient * farthest)
}

/// Makes one step of at most `proposal` cycles, shorter ones until its error is within the limits.
pub fn advance(
    joint: &mut FrettingJoint,
    state: &WornState,
    law: WearLaw,
    proposal: f64,
    limits: Limits,
) -> Result<Step, WearError> {
    check_cycle(proposal)?;
    joint.follow_from_begin();
    let begin = begin(joint, state)?;
    let deepest = law.depth(state.cycle.energy.iter().fold(0.0f64, |m, e| m.max(*e)));
    let by_depth = limits.depth_step.map_or(f64::INFINITY, |d| d / deepest);
    let mut cycles = whole(proposal.min(by_depth), limits.remaining);
    let mut rejected = 0;
    loop {
        let mut step = attempt(joint, state, &begin, law, cycles)?;
        let before = joint.volume(&state.wear);
        let volume = joint.volume(&step.wear) - before + SETTLED * before;
        let mut end = None;
        if joint.march == March::Stepped && step.error <= limits.tolerance * volume {
            let found = end_cycle(joint, &step)?;
            step.error = step
                .error
                .max(in_retrospect(joint, state, law, &step, &found));
            end = Some(found);
        }
        let relative = if volume > 0.0 {
            step.error / volume
        } else {
            0.0
        };
        // The relative error of a step is of second order in its length.
        let factor = SAFETY * (limits.tolerance / relative).sqrt();
        step.proposal = cycles as f64 * factor.clamp(CHANGE.0, CHANGE.1);
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
        cycles = whole(step.proposal.min(0.9 * cycles as f64), limits.remaining);
        rejected += 1;
    }
}

/// A whole number of cycles near `wanted` that does not leave a stub before the end.
fn whole(wanted: f64, remaining: u64) -> u64 {
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

/// One step of `cycles`, whatever its error.
pub(super) fn attempt(
    joint: &mut FrettingJoint,
    state: &WornState,
    begin: &Begin,
    law: WearLaw,
    cycles: u64,
) -> Result<Step, WearError> {
    let Begin {
        rate: begin,
        pressure,
    } = begin;
    joint.follow_from_begin();
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
    let worn = |rate: &Rate, pressure: &[f64]| -> Vec<f64> {
        rate.proportion
            .iter()
            .zip(pressure)
            .map(|(c, p)| c * p)
            .collect()
    };

    let base = add(&state.wear, &[(0.5 * reach, &begin.rest)]);
    let of_wear = scaled(0.5 * reach, &begin.proportion);
    let half = joint.contact_to(looser, &base, &of_wear, load, pressure)?;
    let half_wear = add(&base, &[(0.5 * reach, &worn(begin, &half.pressure))]);
    let shear = Some(&state.cycle.shear);
    let at_rest = match joint.motion.constant_load() {
        true => None,
        false => Some(joint.static_contact(&half_wear, Some(&half.pressure))?),
    };
    let at_rest = at_rest.as_ref().unwrap_or(&half);
    let compliance = joint.follow(&at_rest.pressure)?;
    let cycle = joint.cycle(&half_wear, at_rest, shear)?;
    let middle = split(joint, &half.pressure, &cycle.slip_path, &cycle.energy);

    let of_wear = scaled(GAMMA * reach, &middle.proportion);
    let base = add(&state.wear, &[(GAMMA * reach, &middle.rest)]);
    // On the line through the pressures of the beginning and the middle, at a part of the step.
    let on_line = |part: f64| -> Vec<f64> {
        let cells = pressure.iter().zip(&half.pressure);
        cells
            .map(|(begin, half)| (begin + 2.0 * part * (half - begin)).max(0.0))
            .collect()
    };
    let first = joint.contact_to(looser, &base, &of_wear, load, &on_line(GAMMA))?;
    let first_worn = worn(&middle, &first.pressure);
    let base = add(
        &state.wear,
        &[((1.0 - GAMMA) * reach, &first_worn), (reach, &middle.rest)],
    );
    let second = joint.contact(&base, Some(&of_wear), load, Some(&on_line(1.0)))?;
    let second_worn = worn(&middle, &second.pressure);
    let wear = add(&base, &[(GAMMA * reach, &second_worn)]);

    let lambda = joint.half_space.self_compliance();
    let error = (0..wear.len()).map(|c| {
        let last = (2.0 * middle.proportion[c] - begin.proportion[c]).max(0.0) * second.pressure[c];
        let between = middle.proportion[c] * half.pressure[c];
        let simpson = (begin.proportion[c] * pressure[c] + 4.0 * between + last) / 6.0;
        let taken = (1.0 - GAMMA) * first_worn[c] + GAMMA * second_worn[c];
        // Where wear is stiff (its compliance above the half space's), an implicit step damps what a quadrature sees.
        reach * (taken - simpson).abs() / (1.0 + reach * middle.proportion[c] / lambda)
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

/// The cycle at the end of a step.
fn end_cycle(joint: &mut FrettingJoint, step: &Step) -> Result<EndCycle, WearError> {
    let contact = joint.static_contact(&step.wear, Some(&step.contact.pressure))?;
    joint.follow(&contact.pressure)?;
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

/// What a step has worn otherwise than Simpson's rule over the cycles of its beginning, its middle and its `end` says \[m³\], where wear grows
/// towards its end: a joint that begins to slide, or new cells that come to bear, may show there alone. Where wear dies out an implicit step
/// damps what the quadrature sees.
fn in_retrospect(
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

/// The rate at the beginning of a step, with the pressure that it is in proportion to.
pub(super) fn begin(joint: &mut FrettingJoint, state: &WornState) -> Result<Begin, WearError> {
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
    Ok(Begin {
        rate: split(joint, &pressure, slip_path, energy),
        pressure,
    })
}

/// Splits the energy of a cycle into c·p and f, p under the largest load. With a constant load c is µ times the slip path, and f is zero.
fn split(joint: &FrettingJoint, pressure: &[f64], slip_path: &[f64], energy: &[f64]) -> Rate {
    let constant = joint.motion.constant_load();
    let mut rate = Rate {
        proportion: vec![0.0; pressure.len()],
        rest: vec![0.0; pressure.len()],
    };
    for c in 0..pressure.len() {
        let path = joint.friction_coefficient * slip_path[c];
        if constant || pressure[c] <= 0.0 {
            rate.proportion[c] = path;
        } else {
            rate.proportion[c] = (energy[c] / pressure[c]).min(LARGEST_RATIO * path);
        }
        if !constant {
            rate.rest[c] = (energy[c] - rate.proportion[c] * pressure[c]).max(0.0);
        }
    }
    rate
}
