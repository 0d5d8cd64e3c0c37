//! Wear schemes, and one step of any of them.

use serde::{Deserialize, Serialize};

use super::implicit::{EndCycle, Limits, MiddleCycle, Step, first_proposal};
use super::joint::{FrettingJoint, WearError, WornState};
use super::{WearLaw, explicit, semi_implicit};
use crate::grid::ByAxis;

/// Wear scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scheme {
    /// Second-order implicit scheme, [`super::implicit`].
    Implicit,
    /// First-order implicit scheme, [`super::semi_implicit`].
    #[serde(rename = "semi_implicit")]
    SemiImplicit,
    /// Explicit scheme, [`super::explicit`].
    Explicit,
}

/// Accepted step, with the contact that it predicts.
pub struct StepOutcome {
    /// Wear depth after the step \[m\].
    pub wear: Vec<f64>,
    /// Cycles of the step.
    pub cycles: u64,
    /// Estimated error of the volume worn in the step \[m³\]; 0 if the scheme has no estimate.
    pub error: f64,
    /// Cycles proposed for the next step.
    pub proposal: f64,
    /// Number of other step lengths that were tried.
    pub rejected: usize,
    /// Gap \[m\]; `None` if the scheme solves no contact.
    pub gap: Option<Vec<f64>>,
    /// Pressure \[Pa\].
    pub pressure: Vec<f64>,
    /// Shear \[Pa\].
    pub shear: ByAxis<Vec<f64>>,
    /// Cycle in the middle of the step; `None` if the scheme keeps the cycle of its beginning.
    pub middle: Option<MiddleCycle>,
    /// Cycle at the end of the step, if it was computed.
    pub end: Option<EndCycle>,
}

impl Scheme {
    /// Returns true if the scheme estimates the error of its steps.
    pub fn estimates_error(self) -> bool {
        self == Scheme::Implicit
    }

    /// Returns true if a depth is the scheme's only measure of a step.
    pub fn needs_depth_step(self) -> bool {
        self != Scheme::Implicit
    }

    /// Returns true for the published step, whose length is limited by stability.
    pub fn is_explicit(self) -> bool {
        self == Scheme::Explicit
    }

    /// Describes the wear step of the scheme with `tolerance` and `depth_step` \[m\]. Also returns the setting and the
    /// property of the scheme.
    pub fn describe(self, tolerance: f64, depth_step: f64) -> (String, &'static str) {
        match self {
            Scheme::Implicit => (
                format!("implicit, second order, error {tolerance} of the volume of each step"),
                "wear.scheme = \"implicit\": stable at any step",
            ),
            Scheme::SemiImplicit => (
                format!(
                    "implicit in the pressure, first order, {depth_step:e} m per step at its initial rate"
                ),
                "wear.scheme = \"semi_implicit\": uses the slip at the beginning of a step, and estimates no error",
            ),
            Scheme::Explicit => (
                format!("explicit, {depth_step:e} m per step"),
                "wear.scheme = \"explicit\": the published step [A eq. 2.7-2.8]",
            ),
        }
    }

    /// Makes one step from a worn state. The closure `implicit` makes the step of the implicit scheme. Steps of the
    /// explicit and the semi-implicit scheme wear the depth `depth_step` of `limits`.
    ///
    /// # Errors
    /// Errors of `implicit` and of the contact.
    pub fn advance<E: From<WearError>>(
        self,
        joint: &mut FrettingJoint,
        state: &WornState,
        law: WearLaw,
        limits: Limits,
        implicit: impl FnOnce(&mut FrettingJoint) -> Result<Step, E>,
    ) -> Result<StepOutcome, E> {
        let outcome = |cycles: u64, wear: Vec<f64>| StepOutcome {
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
                    ..outcome(cycles, wear)
                })
            }
            Scheme::Explicit => {
                let cycles = by_depth(joint, state, law, limits)?;
                let wear = explicit::advance(&state.wear, &state.cycle.energy, law, cycles);
                Ok(outcome(cycles, wear))
            }
        }
    }
}

/// Largest ratio of the wear of a single cycle to the wear of a step. A much larger ratio gives steps that only look
/// accurate, because wear within one cycle has no rate. A test compared few cycles of a torsion joint with many cycles
/// at a proportionally smaller wear coefficient. With a ratio of 62, the few cycles wore three times as much as the
/// many cycles. The error bar in the test was 9 %.
const LARGEST_CYCLE: f64 = 10.0;

/// Rejects a cycle that wears far more than a step of `proposal` cycles, with `proposal` below 1.
pub(super) fn check_wear_per_cycle(proposal: f64) -> Result<(), WearError> {
    let times = 1.0 / proposal;
    match times > LARGEST_CYCLE {
        true => Err(WearError::CycleWearsTooMuch { times }),
        false => Ok(()),
    }
}

/// Returns the number of cycles for a step of the depth `depth_step` at the wear rate of `state` [A eq. 2.7]. The
/// number does not exceed the remaining cycles.
fn by_depth(
    joint: &FrettingJoint,
    state: &WornState,
    law: WearLaw,
    limits: Limits,
) -> Result<u64, WearError> {
    let deepest = law.depth(state.cycle.energy.iter().fold(0.0f64, |m, e| m.max(*e)));
    let depth_step = limits.depth_step.unwrap_or(f64::INFINITY);
    check_wear_per_cycle(first_proposal(joint, state, law))?;
    // Without wear the step would be infinite.
    Ok(match deepest > 0.0 {
        true => explicit::cycles(depth_step, deepest).min(limits.remaining),
        false => limits.remaining,
    })
}
