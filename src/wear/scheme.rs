//! The wear step: which there are, and one of them made.

use serde::{Deserialize, Serialize};

use super::implicit::{EndCycle, Limits, MiddleCycle, Step, first_proposal};
use super::joint::{FrettingJoint, WearError, WornState};
use super::{WearLaw, explicit, semi_implicit};
use crate::grid::ByAxis;

/// Which wear step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scheme {
    /// [`super::implicit`].
    Implicit,
    /// [`super::semi_implicit`].
    #[serde(rename = "semi_implicit")]
    SemiImplicit,
    /// [`super::explicit`].
    Explicit,
}

/// A step that was made, with the contact that it predicts.
pub struct StepOutcome {
    /// Wear depth after it \[m\].
    pub wear: Vec<f64>,
    /// Its cycles.
    pub cycles: u64,
    /// Estimated error of its volume \[m³\]; 0 of a scheme without an estimate.
    pub error: f64,
    /// Cycles proposed to the next step.
    pub proposal: f64,
    /// Other lengths that were tried.
    pub rejected: usize,
    /// Gap \[m\]; none of a scheme that solves no contact.
    pub gap: Option<Vec<f64>>,
    /// Pressure \[Pa\].
    pub pressure: Vec<f64>,
    /// Shear \[Pa\].
    pub shear: ByAxis<Vec<f64>>,
    /// The cycle in its middle; none of a scheme that keeps the cycle of its beginning.
    pub middle: Option<MiddleCycle>,
    /// The cycle at its end, if that was marched.
    pub end: Option<EndCycle>,
}

impl Scheme {
    /// True of a scheme whose step estimates its error.
    pub fn estimates_error(self) -> bool {
        self == Scheme::Implicit
    }

    /// True of a scheme that has no other measure of its steps than a depth.
    pub fn needs_depth_step(self) -> bool {
        self != Scheme::Implicit
    }

    /// True of the published step, whose length stability bounds.
    pub fn is_explicit(self) -> bool {
        self == Scheme::Explicit
    }

    /// What its step is, of this tolerance and depth \[m\], and why.
    pub fn describe(self, tolerance: f64, depth_step: f64) -> (String, &'static str) {
        match self {
            Scheme::Implicit => (
                format!("implicit, second order, error {tolerance} of the volume of each step"),
                "wear.scheme = \"implicit\": stable at any step",
            ),
            Scheme::SemiImplicit => (
                format!(
                    "implicit in the pressure, first order, {depth_step:e} m a step at the rate of its beginning"
                ),
                "wear.scheme = \"semi_implicit\": the slip of a step's beginning, without an error to set the step",
            ),
            Scheme::Explicit => (
                format!("explicit, {depth_step:e} m a step"),
                "wear.scheme = \"explicit\": the published step [A eq. 2.7-2.8]",
            ),
        }
    }

    /// Makes one step from a worn state. `implicit` makes that of the implicit scheme; those of the others wear the depth of the limits.
    ///
    /// # Errors
    /// Those of `implicit` and of the contact.
    pub fn advance<E: From<WearError>>(
        self,
        joint: &mut FrettingJoint,
        state: &WornState,
        law: WearLaw,
        limits: Limits,
        implicit: impl FnOnce(&mut FrettingJoint) -> Result<Step, E>,
    ) -> Result<StepOutcome, E> {
        let of_depth = |cycles: u64, wear: Vec<f64>| StepOutcome {
            wear,
            cycles,
            error: 0.0,
            proposal: cycles as f64,
            rejected: 0,
            gap: None,
            pressure: state.pressure.clone(),
            shear: state.cycle.shear.clone(),
            middle: None,
            end: None,
        };
        match self {
            Scheme::Implicit => {
                let step = implicit(joint)?;
                Ok(StepOutcome {
                    wear: step.wear,
                    cycles: step.cycles,
                    error: step.error,
                    proposal: step.proposal,
                    rejected: step.rejected,
                    gap: Some(step.contact.gap),
                    pressure: step.contact.pressure,
                    shear: step.shear,
                    middle: Some(step.middle),
                    end: step.end,
                })
            }
            Scheme::SemiImplicit => {
                let cycles = by_depth(joint, state, law, limits)?;
                let (wear, contact) = semi_implicit::advance(joint, state, law, cycles)?;
                Ok(StepOutcome {
                    gap: Some(contact.gap),
                    pressure: contact.pressure,
                    ..of_depth(cycles, wear)
                })
            }
            Scheme::Explicit => {
                let cycles = by_depth(joint, state, law, limits)?;
                let wear = explicit::advance(&state.wear, &state.cycle.energy, law, cycles);
                Ok(of_depth(cycles, wear))
            }
        }
    }
}

/// Times that a single cycle may wear more than a step is to. Far beyond that a step may still look accurate: what wears at once has no rate. At
/// 62 times a torsion wore three times as much as in many cycles that wear as much together, with a bar of 9 %.
const LARGEST_CYCLE: f64 = 10.0;

/// Refuses a cycle that wears far more than a step of `proposal` cycles, a part of one.
pub(super) fn check_cycle(proposal: f64) -> Result<(), WearError> {
    let times = 1.0 / proposal;
    match times > LARGEST_CYCLE {
        true => Err(WearError::CycleWearsTooMuch { times }),
        false => Ok(()),
    }
}

/// Cycles that wear the depth of a step at the rate of its beginning [A eq. 2.7], no more than remain.
fn by_depth(
    joint: &FrettingJoint,
    state: &WornState,
    law: WearLaw,
    limits: Limits,
) -> Result<u64, WearError> {
    let deepest = law.depth(state.cycle.energy.iter().fold(0.0f64, |m, e| m.max(*e)));
    let depth_step = limits.depth_step.unwrap_or(f64::INFINITY);
    check_cycle(first_proposal(joint, state, law))?;
    // A joint that does not wear would make a step without end.
    Ok(match deepest > 0.0 {
        true => explicit::cycles(depth_step, deepest).min(limits.remaining),
        false => limits.remaining,
    })
}
