//! The first loading of a joint along its motion, from rest to an end of it and beyond.

use super::{FrettingJoint, WearError};
use crate::contact::normal::NormalSolution;
use crate::contact::tangential::TangentialOptions;
use crate::grid::ByAxis;

/// Relative duality gap of a point on the way: its force is in error by some thousandths of the largest. Half of the loop of a straight
/// motion is twice this loading (Masing), so that points are no more exact than what is made of the loop.
const TOLERANCE: f64 = 1e-5;

impl FrettingJoint {
    /// Shear of the cells at `parts` of the way from the middle of a straight motion to its end, ascending; 1 is the end \[Pa\].
    ///
    /// # Errors
    /// [`WearError::NotStraight`], and [`WearError::Contact`].
    pub fn loading(
        &mut self,
        contact: &NormalSolution,
        parts: &[f64],
    ) -> Result<Vec<ByAxis<Vec<f64>>>, WearError> {
        let motion = self.motion.straight().ok_or(WearError::NotStraight)?;
        let limit = self.limit(&contact.pressure);
        let rest = vec![0.0; motion.end.len()];
        let options = TangentialOptions {
            tolerance: TOLERANCE.max(self.options.tangential.tolerance),
            ..self.options.tangential
        };
        let mut shears: Vec<ByAxis<Vec<f64>>> = Vec::with_capacity(parts.len());
        for part in parts {
            let place: Vec<f64> = motion.end.iter().map(|d| part * d).collect();
            let step = self.step_within(options, &limit, None, [&rest, &place], shears.last())?;
            shears.push(step.shear);
        }
        Ok(shears)
    }
}
