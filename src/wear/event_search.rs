//! Searches for the length of the wear step that ends at an event and not beyond the event.
//!
//! A computation can stop at the first wear step that meets a condition, for example to update the contact elements.
//! Without the search for the event, the result of the computation would depend on arbitrary lengths of the wear steps.

use super::WearLaw;
use super::implicit::{self, Limits, Step};
use super::joint::{FrettingJoint, WearError, WornState};

/// Largest number of step lengths that the search tries for one event. After `MOST_TRIES` tries, the search uses the
/// shortest step length that passes the event.
const MOST_TRIES: usize = 8;

/// The search does not shorten a step that passes at least `EVENTS_BEYOND_RESOLUTION` events. So many events per step
/// are finer than the resolution of the wear, and every step ends beyond an event.
const EVENTS_BEYOND_RESOLUTION: f64 = 30.0;

/// Largest overshoot of a step beyond the event, as a fraction of the tolerance. Late in a run the stiffness
/// hardly rises, so that a small overshoot is many cycles.
const OVERSHOOT: f64 = 0.1;

/// Initial exponent of the progress as a power of the cycles, until two lengths give one. The stiffness rises
/// fast at first.
const EXPONENT: f64 = 0.7;

/// Bounds on the exponent that two lengths give; another exponent is ignored.
const EXPONENTS: (f64, f64) = (0.02, 5.0);

/// Smallest ratio of one length to the length tried before.
const SHORTEST_RATIO: f64 = 0.1;

/// Search for the length of one step. The progress towards the event is a number that reaches 1 at the event.
#[derive(Debug, Clone)]
pub struct EventSearch {
    begin_progress: f64,
    tolerance: f64,
    /// Longest step that ends before the event, the shortest beyond it, and the last one tried with its
    /// progress.
    below: u64,
    above: Option<u64>,
    last: Option<(u64, f64)>,
    tried: usize,
}

impl EventSearch {
    /// Starts a search. `begin` is the progress at the beginning of the step. A step may overshoot the event
    /// by a fraction of `tolerance`. If the progress jumps, the length is found within `tolerance` of itself.
    pub fn new(begin: f64, tolerance: f64) -> EventSearch {
        EventSearch {
            begin_progress: begin,
            tolerance,
            below: 0,
            above: None,
            last: None,
            tried: 0,
        }
    }

    /// Makes an implicit step like [`implicit::advance`], but shorter if it would pass the event. `reached`
    /// returns the progress at the end of a step, whose contact is then the contact of its worn surface.
    /// Lengths tried before count as rejected.
    ///
    /// # Errors
    /// Errors of the steps, of the contact after them, and of `reached`.
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
            // The step's own contact comes from its last stage. An update uses the contact of the worn
            // surface.
            let start = Some(&step.contact.pressure[..]);
            step.contact = joint.contact(&step.wear, None, load, start)?;
            let reached = reached(joint, &step)?;
            Ok((step, reached))
        };
        let (mut step, mut far) = attempt(proposal, limits)?;
        // Number of cycles that the error test permits for the next step. The shortening of the current step by the
        // search does not reduce this number.
        let uncut = step.proposal.min(step.cycles as f64);
        let (mut rejected, mut beyond) = (step.rejected, None);
        while let Some(cycles) = self.next_length(step.cycles, far) {
            if self.above == Some(step.cycles) {
                beyond = Some(step);
            }
            match beyond.take_if(|beyond| beyond.cycles == cycles) {
                Some(shortest) => {
                    // The shortest step beyond the event was counted as rejected. The last step is rejected in its
                    // place.
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

    /// Returns the length of the next trial step after a step of `cycles` with the progress `reached`. Returns `None`
    /// to accept the step of `cycles`. A step that ends at the event is accepted. A step that ends before the event is
    /// accepted if no longer trial step has passed the event.
    pub fn next_length(&mut self, cycles: u64, reached: f64) -> Option<u64> {
        self.tried += 1;
        if self.begin_progress >= 1.0
            || self.above.is_none() && reached - self.begin_progress > EVENTS_BEYOND_RESOLUTION
        {
            return None;
        }
        let band = OVERSHOOT * self.tolerance;
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
        if between as f64 <= narrow || self.tried >= MOST_TRIES {
            return (cycles != above).then_some(above);
        }
        let target = 1.0 + 0.5 * band - self.begin_progress;
        let progress = reached - self.begin_progress;
        let exponent = self.exponent(cycles, progress).unwrap_or(EXPONENT);
        self.last = Some((cycles, progress));
        let guess = cycles as f64 * (target / progress).powf(1.0 / exponent).max(SHORTEST_RATIO);
        let (least, most) = (self.below as f64 + 1.0, above as f64 - 1.0);
        if guess >= least && guess <= most {
            Some(guess as u64)
        } else {
            Some(self.below + between / 2)
        }
    }

    fn exponent(&self, cycles: u64, progress: f64) -> Option<f64> {
        let (last, last_progress) = self.last?;
        let exponent = (progress / last_progress).ln() / (cycles as f64 / last as f64).ln();
        (exponent >= EXPONENTS.0 && exponent <= EXPONENTS.1).then_some(exponent)
    }
}
