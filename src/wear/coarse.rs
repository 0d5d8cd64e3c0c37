//! Coarse trajectory: a second computation of the wear beside the run. Steps of the coarse trajectory are twice as long
//! as steps of the run, and stepped cycles have half as many samples. The errors of the coarse trajectory and the
//! errors of the run have opposite signs.
//!
//! The error of a step propagates: where a single cell decides between sticking and wearing, the error grows. The sum
//! of the errors of single steps does not include the growth of the errors. The coarse trajectory makes larger errors
//! than the run, and the same wear propagates the errors of both. The difference between the coarse trajectory and the
//! run, in any figure, shows the effect of the errors on that figure.
//!
//! Because coarse steps and steps of the run are both of second order, the error of a plain coarse step has the same
//! sign as the error of the run. With plain coarse steps, a critical cell sticks in both trajectories or wears in both
//! trajectories. The difference between the trajectories would not show an error of the run in the critical cell. To
//! reverse the sign of the error of a coarse step, the program computes each coarse step twice. One coarse step starts
//! from the state of the coarse trajectory, and the other coarse step starts from the state of the run. The wear of the
//! coarse step from the run's state minus the wear of the run is the error of the coarse step. The program subtracts 2½
//! times the error of the coarse step from the coarse step. If steps are short, the exact solution lies between the run
//! and the coarse trajectory.
//!
//! The solves of the coarse trajectory are less exact than the solves of the run. Coarse steps that are longer than two
//! steps of the run would cost less but give no error bar. In a test, coarse steps had the length of three or four
//! steps of the run. The test subtracted 1½ or 1⅓ times the error of the coarse step. A line contact with a critical
//! cell in this test had an error of 20 %, but an error bar of only 5 %. Subtracting twice as much would increase the
//! differences of other joints by a factor of two and a half.

use super::WearLaw;
use super::cycle::FEWEST_SAMPLES;
use super::cycle::March;
use super::implicit;
use super::joint::{FrettingJoint, WearError, WornState};
use crate::grid::Patch;

/// Factor on the error that is subtracted from a coarse step. If a plain coarse step has the error e, the factor 2.5
/// gives a coarse step with the error −1.5 e. A test used the factor 2 for a line contact in partial slip. In that
/// test, the coarse trajectory agreed with the run, although the run had an error of 22 %.
const ERROR_REFLECTION: f64 = 2.5;

/// Factor on the tolerance of a tangential solve for the coarse trajectory. The coarse trajectory shows differences of
/// a hundredth of the run's values. A factor of 10 on the tolerance changed the differences by up to a sixth. A factor
/// of 3 on the tolerance changed the differences by up to a sixteenth.
const LOOSER_TANGENTIAL: f64 = 3.0;

/// Run's trajectory over a coarse step.
#[derive(Debug, Clone, Copy)]
pub struct RunTrajectory<'a> {
    /// State at the beginning of the step.
    pub begin: &'a WornState,
    /// Wear depth at the end of the step \[m\].
    pub end: &'a [f64],
}

/// Makes one coarse step of `cycles` and returns the state at its end. Stepped cycles use every other sample.
/// The error of the step is opposite to the error of a plain step along the run's trajectory `own`. The wear
/// of no cell decreases.
///
/// # Errors
/// Errors of the contact and of the cycle.
pub fn advance(
    joint: &mut FrettingJoint,
    state: &WornState,
    own: RunTrajectory,
    law: WearLaw,
    cycles: u64,
) -> Result<WornState, WearError> {
    let samples = joint.motion.samples();
    let halves = samples.is_multiple_of(2) && samples >= 2 * FEWEST_SAMPLES;
    let every = match joint.march == March::Stepped && halves {
        true => 2,
        false => 1,
    };
    let thinned = joint.motion.thinned(every);
    let whole = std::mem::replace(&mut joint.motion, thinned);
    let exact = joint.options;
    joint.options.normal.tolerance = implicit::relaxed_tolerance(exact.normal.tolerance);
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
        let opposite = *wear - ERROR_REFLECTION * (coarse - own);
        // NaN passes through, and the contact rejects it.
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

/// Difference between the coarse trajectory and the run at the same cycles.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TrajectoryDifference {
    /// Difference of the total worn volume \[m³\].
    pub volume: f64,
    /// Sum of the differences of the cells' worn volumes: the L1 norm \[m³\].
    pub field: f64,
    /// Number of uncertain cells, divided by the number of cells above the pressure threshold in the run. The pressure
    /// of an uncertain cell differs from the threshold by no more than the error of the pressure.
    pub loaded_area: f64,
    /// Difference of the largest pressure, relative to the run.
    pub max_pressure: f64,
    /// Difference of the largest depth, relative to the run.
    pub largest_depth: f64,
    /// Difference of the depth that a hundredth of the cells exceed, relative to the run.
    pub depth_99: f64,
    /// Difference of the energy per cycle, relative to the run.
    pub dissipation: f64,
    /// Number of undecided cells. The run and the coarse trajectory give two wear depths of a cell. In an undecided
    /// cell, the two depths differ by more than a factor of two and by more than the mean depth.
    pub undecided: usize,
}

/// Factor on the difference of the trajectories that bounds the error of a figure. With short steps the difference is
/// four and a half times the run's error. With long steps, the difference is about as large as the run's error. If a
/// cell sticks in only one of the trajectories, the difference is also about as large as the run's error.
pub const ERROR_PER_DIFFERENCE: f64 = 1.5;

impl TrajectoryDifference {
    /// Compares the run's state `own` with the `coarse` state. A cell counts as loaded if the pressure on the cell
    /// exceeds `threshold` times the largest pressure of the joint.
    pub fn between(
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
            let spread = ERROR_PER_DIFFERENCE * (*own - *coarse).abs();
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
                [own, coarse].map(|state| depth_quantile(patch.joint_values(&state.wear), share));
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

/// Returns the depth that the fraction `share` of the cells does not exceed \[m\]. A `share` of 1 gives the largest
/// depth. Without cells, `depth_quantile` returns 0.
pub fn depth_quantile(mut depths: Vec<f64>, share: f64) -> f64 {
    let Some(last) = depths.len().checked_sub(1) else {
        return 0.0;
    };
    let at = ((share * depths.len() as f64).ceil() as usize).clamp(1, last + 1) - 1;
    *depths.select_nth_unstable_by(at, f64::total_cmp).1
}
