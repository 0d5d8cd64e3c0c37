//! The coarse trajectory: the wear of a joint once more, by steps twice as long and stepped cycles of half as many samples, with errors of the
//! other sign.
//!
//! An error that a step makes goes on: where a single cell decides between sticking and wearing it grows, and a sum of the errors of single
//! steps does not know it. The coarse trajectory makes larger errors and carries them forward by the same wear, so that what it differs by
//! from the run's own, of any figure, is what the errors have made of that figure.
//!
//! Both schemes are of second order, so that a coarse step errs to the same side as the run's own: with the errors that it has, a cell on the
//! verge would go the way that it goes in the run, and both would be wrong alike. So each coarse step is made from the run's own state
//! too; what it leads to beyond the run's own is its error, which is taken away 2½ times. Where steps are short the exact solution then lies
//! between the run's own and the coarse trajectory.
//!
//! Its solves are less exact than the run's. Longer steps would cost less, but are no bar: over three or four steps of the run, with the error
//! taken away 1½ or 1⅓ times for as small a difference, a line with a cell on the verge had a bar of 5 % where it was 20 % off; taken away
//! twice, the differences of other joints are two and a half times as large.

use super::WearLaw;
use super::cycle::FEWEST;
use super::cycle::March;
use super::implicit;
use super::joint::{FrettingJoint, WearError, WornState};
use crate::grid::Patch;

/// How often the error of a coarse step is taken away from it: the step is then half as far again beyond the run's own, on the other side.
/// With 2, the joint of a line in partial slip went the run's own way, which was 22 % off.
const OPPOSITE: f64 = 2.5;

/// Times the tolerance of a tangential solve to which those of the coarse trajectory are solved. It is there for differences of a hundredth of
/// the run: with 10 they changed by up to a sixth of themselves, with 3 by up to a sixteenth.
const LOOSER_TANGENTIAL: f64 = 3.0;

/// The run's own way over a coarse step.
#[derive(Debug, Clone, Copy)]
pub struct RunTrajectory<'a> {
    /// The state at its beginning.
    pub begin: &'a WornState,
    /// Wear depth at its end \[m\].
    pub end: &'a [f64],
}

/// Wears a state by one step of `cycles`, stepped cycles marched over every other sample, with an error opposite to that of such a step along
/// the run's `own` way: the state at its end. No cell has less wear than before.
///
/// # Errors
/// Those of the contact and of the cycle.
pub fn advance(
    joint: &mut FrettingJoint,
    state: &WornState,
    own: RunTrajectory,
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
    let exact = joint.options;
    joint.options.normal.tolerance = implicit::looser(exact.normal.tolerance);
    joint.options.tangential.tolerance *= LOOSER_TANGENTIAL;
    let worn = step(joint, state, own, law, cycles);
    joint.options = exact;
    joint.motion = whole;
    worn
}

fn step(
    joint: &mut FrettingJoint,
    state: &WornState,
    own: RunTrajectory,
    law: WearLaw,
    cycles: u64,
) -> Result<WornState, WearError> {
    let mut from = |state: &WornState| {
        let begin = implicit::begin(joint, state)?;
        implicit::attempt(joint, state, &begin, law, cycles)
    };
    let mut step = from(state)?;
    let along_own = match state.wear == own.begin.wear {
        true => step.wear.clone(),
        false => from(own.begin)?.wear,
    };
    let cells = step.wear.iter_mut().zip(&state.wear);
    for ((wear, before), (coarse, own)) in cells.zip(along_own.iter().zip(own.end)) {
        let opposite = *wear - OPPOSITE * (coarse - own);
        // What is no number is left for the contact to refuse.
        *wear = if opposite < *before {
            *before
        } else {
            opposite
        };
    }
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
pub struct TrajectoryDifference {
    /// Worn volume, of all cells together \[m³\].
    pub volume: f64,
    /// Worn volume, each cell by itself: the L1 norm \[m³\].
    pub field: f64,
    /// Cells of which it is not known whether their pressure is above a threshold, in parts of those of the run's own that are.
    pub loaded_area: f64,
    /// Largest pressure, relative to the run's own.
    pub max_pressure: f64,
    /// Largest depth, relative to the run's own.
    pub largest_depth: f64,
    /// Depth that a hundredth of the cells exceed, relative to the run's own.
    pub depth_99: f64,
    /// Energy of a cycle, relative to the run's own.
    pub dissipation: f64,
    /// Cells of which one trajectory wears less than half as deep as the other, by more than the mean depth.
    pub undecided: usize,
}

/// Times the difference of both trajectories that a figure may be off by. The difference is four and a half times the error of the own one where
/// steps are short; where they are not, or a cell goes another way in one of the two, it is about as large as the error.
pub const SPREAD: f64 = 1.5;

impl TrajectoryDifference {
    /// That of two states of a joint, the run's `own` and the `coarse` one. A cell is loaded at a pressure above `threshold` of the largest.
    pub fn of(
        own: &WornState,
        coarse: &WornState,
        patch: &Patch,
        threshold: f64,
    ) -> TrajectoryDifference {
        let cell_area = patch.grid.cell_area();
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
        let deepest = |share| {
            let [own, coarse] =
                [own, coarse].map(|state| depth_of(patch.gather(&state.wear), share));
            relative(own, coarse)
        };
        TrajectoryDifference {
            volume: differences().sum::<f64>().abs() * cell_area,
            field: differences().map(f64::abs).sum::<f64>() * cell_area,
            loaded_area: uncertain.count() as f64 / loaded.max(1) as f64,
            max_pressure: relative(peak, coarse_peak),
            largest_depth: deepest(1.0),
            depth_99: deepest(0.99),
            dissipation: relative(own.cycle.dissipation, coarse.cycle.dissipation),
            undecided: undecided.count(),
        }
    }
}

/// The depth \[m\] that this share of cells is worn to at most: the largest with 1. 0 of no cell.
pub fn depth_of(mut depths: Vec<f64>, share: f64) -> f64 {
    let Some(last) = depths.len().checked_sub(1) else {
        return 0.0;
    };
    let at = ((share * depths.len() as f64).ceil() as usize).clamp(1, last + 1) - 1;
    *depths.select_nth_unstable_by(at, f64::total_cmp).1
}
