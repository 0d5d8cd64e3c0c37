//! First-order implicit wear step: implicit in the pressure, with the slip at the beginning of the step.
//!
//! The semi-implicit step solves one normal contact with the added wear compliance N α c. The semi-implicit method is
//! backward Euler, which is stable at any step length and of first order. A semi-implicit step costs a third of the
//! [`super::implicit`] step and estimates no error. The semi-implicit step serves for comparison.

use super::WearLaw;
use super::implicit::{StepBegin, begin};
use super::joint::{FrettingJoint, WearError, WornState};
use crate::contact::normal::NormalSolution;

/// Returns the wear depth after `cycles` \[m\], and the contact there under the largest load of the cycle.
pub fn advance(
    joint: &mut FrettingJoint,
    state: &WornState,
    law: WearLaw,
    cycles: u64,
) -> Result<(Vec<f64>, NormalSolution), WearError> {
    let StepBegin { rate, pressure } = begin(joint, state)?;
    let reach = law.over(cycles);
    let mut wear: Vec<f64> = state.wear.clone();
    let compliance: Vec<f64> = rate.proportion.iter().map(|c| reach * c).collect();
    wear.iter_mut()
        .zip(&rate.explicit_rate)
        .for_each(|(w, f)| *w += reach * f);
    let load = joint.motion.largest_load();
    let contact = joint.contact(&wear, Some(&compliance), load, Some(&pressure))?;
    for ((w, d), p) in wear.iter_mut().zip(&compliance).zip(&contact.pressure) {
        *w += d * p;
    }
    Ok((wear, contact))
}
