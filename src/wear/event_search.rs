//! Where a wear step has to end for an event to fall on its end rather than inside of it.
//!
//! What is computed up to the end of the step that meets a condition, an update of the contact elements say, would otherwise
//! depend on the steps that happened to be taken.

use super::WearLaw;
use super::implicit::{self, Limits, Step};
use super::joint::{FrettingJoint, WearError, WornState};

/// Lengths tried for one event, after which the shortest that passes it stands.
const MOST: usize = 8;

/// A step that would pass so many such events is not cut: they are finer than what wear is resolved to, and every step ends
/// beyond one.
const MANY: f64 = 30.0;

/// How far beyond the event a step may end, in parts of the tolerance: late in a run stiffness hardly rises any more, and a little of
/// it is many cycles.
const LANDED: f64 = 0.1;

/// The way to an event goes like this power of the cycles, until two lengths tell: stiffness rises fast at first.
const EXPONENT: f64 = 0.7;

/// Powers that two lengths are believed to tell.
const EXPONENTS: (f64, f64) = (0.02, 5.0);

/// What is left of a length at least from one try to the next.
const SHORTEST: f64 = 0.1;

/// The search for the length of one step. How far its end is on the way to the event is a number that reaches 1 there.
#[derive(Debug, Clone)]
pub struct EventSearch {
    begin: f64,
    tolerance: f64,
    /// The longest step that ends before the event, the shortest beyond it, and the last one tried.
    below: u64,
    above: Option<u64>,
    last: Option<(u64, f64)>,
    tried: usize,
}

impl EventSearch {
    /// `begin` is how far on its way the beginning of the step is. A step may end beyond the event by a part of `tolerance`, or, where
    /// the way has jumps, by `tolerance` of its length.
    pub fn new(begin: f64, tolerance: f64) -> EventSearch {
        EventSearch {
            begin,
            tolerance,
            below: 0,
            above: None,
            last: None,
            tried: 0,
        }
    }

    /// An implicit step as [`implicit::advance`] makes it, but shorter where it would pass the event. `reached` says how far on its way
    /// a step ends, whose contact is then that of its wear. Steps tried before count as rejected.
    ///
    /// # Errors
    /// Those of the steps, of the contact after them, and of `reached`.
    pub fn advance<E: From<WearError>>(
        mut self,
        joint: &mut FrettingJoint,
        state: &WornState,
        law: WearLaw,
        proposal: f64,
        limits: Limits,
        mut reached: impl FnMut(&mut FrettingJoint, &Step) -> Result<f64, E>,
    ) -> Result<Step, E> {
        let load = joint.motion.mean_load;
        let mut attempt = |proposal, limits| -> Result<(Step, f64), E> {
            let mut step = implicit::advance(joint, state, law, proposal, limits)?;
            // The step's own contact is that of its last stage; an update sees the one that is found on the worn surface.
            let start = Some(&step.contact.pressure[..]);
            step.contact = joint.contact(&step.wear, None, load, start)?;
            let reached = reached(joint, &step)?;
            Ok((step, reached))
        };
        let (mut step, mut far) = attempt(proposal, limits)?;
        // What accuracy would allow to the next step, had this one not been cut.
        let uncut = step.proposal.min(step.cycles as f64);
        let (mut rejected, mut beyond) = (step.rejected, None);
        while let Some(cycles) = self.next(step.cycles, far) {
            if self.above == Some(step.cycles) {
                beyond = Some(step);
            }
            match beyond.take_if(|beyond| beyond.cycles == cycles) {
                Some(shortest) => {
                    // It counted as rejected, which the other one is now.
                    step = shortest;
                    break;
                }
                None => {
                    let limits = Limits {
                        remaining: cycles,
                        ..limits
                    };
                    (step, far) = attempt(cycles as f64, limits)?;
                    rejected += 1 + step.rejected;
                }
            }
        }
        step.rejected = rejected;
        step.proposal = step.proposal.max(uncut);
        Ok(step)
    }

    /// The length to try after a step of `cycles` that got as far as `reached`; `None` if that may stand: it ends at the event, or
    /// before it with no longer one known to pass it.
    pub fn next(&mut self, cycles: u64, reached: f64) -> Option<u64> {
        self.tried += 1;
        if self.begin >= 1.0 || self.above.is_none() && reached - self.begin > MANY {
            return None;
        }
        let band = LANDED * self.tolerance;
        if reached > 1.0 + band {
            self.above = Some(cycles);
        } else if reached >= 1.0 {
            return None;
        } else {
            self.below = cycles;
        }
        let above = self.above?;
        let between = above - self.below;
        let narrow = (self.tolerance * above as f64).max(1.0);
        if between as f64 <= narrow || self.tried >= MOST {
            return (cycles != above).then_some(above);
        }
        let target = 1.0 + 0.5 * band - self.begin;
        let gone = reached - self.begin;
        let exponent = self.exponent(cycles, gone).unwrap_or(EXPONENT);
        self.last = Some((cycles, gone));
        let guess = cycles as f64 * (target / gone).powf(1.0 / exponent).max(SHORTEST);
        let (least, most) = (self.below as f64 + 1.0, above as f64 - 1.0);
        if guess >= least && guess <= most {
            Some(guess as u64)
        } else {
            Some(self.below + between / 2)
        }
    }

    fn exponent(&self, cycles: u64, gone: f64) -> Option<f64> {
        let (last, before) = self.last?;
        let exponent = (gone / before).ln() / (cycles as f64 / last as f64).ln();
        (exponent >= EXPONENTS.0 && exponent <= EXPONENTS.1).then_some(exponent)
    }
}
