//! The coarse trajectory: the wear of a joint once more, by steps twice as long and stepped cycles of half as many samples.
//!
//! An error that a step makes goes on: where a single cell decides between sticking and wearing it grows, and a sum of the errors of single
//! steps does not know it. The coarse trajectory makes larger errors of the same kind and carries them forward by the same wear, so that
//! what it differs by from the run's own, of any figure, is what the errors have made of that figure. Both are of second order: the run's own
//! error is a third of the difference where steps are short, and about all of it where they are not.

use super::WearLaw;
use super::cycle::March;
use super::implicit;
use super::joint::{FrettingJoint, WearError, WornState};
use super::sampled::FEWEST;

/// Wears a state by one step of `cycles`, whatever its error, stepped cycles marched over every other sample: the state at its end.
///
/// # Errors
/// Those of the contact and of the cycle.
pub fn advance(
    joint: &mut FrettingJoint,
    state: &WornState,
    law: WearLaw,
    cycles: u64,
) -> Result<WornState, WearError> {
    let samples = joint.motion.samples();
    let halves = samples.is_multiple_of(2) && samples >= 2 * FEWEST;
    let every = match joint.march == March::Stepped && halves {
        true => 2,
        false => 1,
    };
    let thinned = joint.motion.every(every);
    let whole = std::mem::replace(&mut joint.motion, thinned);
    let worn = step(joint, state, law, cycles);
    joint.motion = whole;
    worn
}

fn step(
    joint: &mut FrettingJoint,
    state: &WornState,
    law: WearLaw,
    cycles: u64,
) -> Result<WornState, WearError> {
    let begin = implicit::begin(joint, state)?;
    let step = implicit::attempt(joint, state, &begin, law, cycles)?;
    let contact = joint.static_contact(&step.wear, Some(&step.contact.pressure))?;
    let cycle = joint.cycle(&step.wear, &contact, Some(&step.shear))?;
    Ok(WornState {
        wear: step.wear,
        pressure: contact.pressure,
        cycle,
    })
}

/// What the coarse trajectory has otherwise than the run's own at the same cycles.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Difference {
    /// Worn volume, of all cells together \[m³\].
    pub volume: f64,
    /// Worn volume, each cell by itself: the L1 norm \[m³\].
    pub field: f64,
    /// Cells of which it is not known whether their pressure is above a threshold, in parts of those of the run's own that are.
    pub loaded_area: f64,
    /// Largest pressure, relative to the run's own.
    pub max_pressure: f64,
    /// Energy of a cycle, relative to the run's own.
    pub dissipation: f64,
    /// Cells of which one trajectory wears less than half as deep as the other, by more than the mean depth.
    pub undecided: usize,
}

/// Times the difference of both trajectories that a pressure may be off by: the difference is three times the error of the own one
/// where steps are short, and as large as it where they are not.
pub const SPREAD: f64 = 2.0;

impl Difference {
    /// That of two states of a joint, the run's `own` and the `coarse` one. A cell is loaded at a pressure above `threshold` of the largest.
    pub fn of(own: &WornState, coarse: &WornState, cell_area: f64, threshold: f64) -> Difference {
        let depths = || own.wear.iter().zip(&coarse.wear);
        let differences = || depths().map(|(own, coarse)| own - coarse);
        let largest = |state: &WornState| state.pressure.iter().fold(0.0f64, |m, p| m.max(*p));
        let [peak, coarse_peak] = [own, coarse].map(largest);
        let limit = threshold * peak;
        let loaded = own.pressure.iter().filter(|p| **p > limit).count();
        let pressures = own.pressure.iter().zip(&coarse.pressure);
        let uncertain = pressures.filter(|(own, coarse)| {
            let spread = SPREAD * (*own - *coarse).abs();
            spread > 0.0 && (*own - limit).abs() <= spread
        });
        let worn = own.wear.iter().filter(|depth| **depth > 0.0).count();
        let mean = own.wear.iter().sum::<f64>() / worn.max(1) as f64;
        let undecided = depths().filter(|(own, coarse)| {
            let (less, more) = (own.min(**coarse), own.max(**coarse));
            less < 0.5 * more && more - less > mean
        });
        let relative = |own: f64, coarse: f64| match own > 0.0 {
            true => (own - coarse).abs() / own,
            false => 0.0,
        };
        Difference {
            volume: differences().sum::<f64>().abs() * cell_area,
            field: differences().map(f64::abs).sum::<f64>() * cell_area,
            loaded_area: uncertain.count() as f64 / loaded.max(1) as f64,
            max_pressure: relative(peak, coarse_peak),
            dissipation: relative(own.cycle.dissipation, coarse.cycle.dissipation),
            undecided: undecided.count(),
        }
    }
}
