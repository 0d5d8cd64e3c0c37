//! The steady cycle of any motion, sample by sample.
//!
//! The cycle is marched twice, over every other sample until it closes and from there over all of them (`sequence`). The steps are
//! of second order, so that a third of the change between the two takes slip path and energy of each cell to steps of no length, and the
//! change says what is left.

use super::cycle::{CycleSolution, Instant, Tally};
use super::fields::{InstantFields, Kept};
use super::joint::{FrettingJoint, WearError};
use super::motion::Channel;
use super::sequence::{Closed, Sequence};
use crate::contact::normal::NormalSolution;
use crate::grid::ByAxis;

/// What extrapolation leaves of the energy, in parts of what half of the samples change on all cells. Measured on rough joints, it is 0.1 most often
/// and 0.8 at most in 70 drawn ones, where the motion turns between samples.
const LEFT: f64 = 0.8;

/// What it leaves where the motion is a history: a table of places has corners, at which steps are of first order. Measured, it is 1.33 at most.
const LEFT_OF_HISTORY: f64 = 1.6;

/// The least of that change, in parts of the energy of a cell times the square of the samples: of a single cell half of them may change nothing by
/// chance.
const LEAST_CHANGE: f64 = 16.0;

/// Part of what a cell slips and dissipates that extrapolation leaves it at least: where half of the samples change it by more, it is
/// not yet of second order, and to take all of it would be to say that the cell sticks.
const LEAST_EXTRAPOLATED: f64 = 0.5;

/// Half of fewer samples has no inside.
pub(super) const FEWEST: usize = 8;

impl FrettingJoint {
    /// Marches sample by sample until the cycle closes. An odd number of samples, fewer than 8, and any without
    /// [`FrettingOptions::extrapolate`](super::joint::FrettingOptions::extrapolate) are marched once.
    ///
    /// The fields are those of the march over all samples: extrapolated are slip path and energy alone.
    pub(super) fn by_samples(
        &mut self,
        wear: &[f64],
        contact: &NormalSolution,
        start: Option<&ByAxis<Vec<f64>>>,
        wanted: &dyn Fn(usize) -> bool,
    ) -> Result<(CycleSolution, Vec<InstantFields>), WearError> {
        let samples = self.motion.samples();
        // The last instant is the first one again.
        let instants: Vec<usize> = (0..=samples).filter(|k| wanted(*k)).collect();
        let limits = self.limits_over_cycle(wear, contact, !instants.is_empty())?;
        let halved = self.options.extrapolate && samples.is_multiple_of(2) && samples >= FEWEST;
        let cell_area = self.patch.grid.cell_area();
        let coarse = match halved {
            true => Some(Sequence::new(self, &limits, 2, start)?.close()?),
            false => None,
        };
        let start = coarse.as_ref().map_or(start, |coarse| Some(&coarse.shear));
        let Closed {
            mut tally,
            shear,
            instants: mut marched,
            mut kept,
        } = Sequence::new(self, &limits, 1, start)?
            .keeping(&instants)
            .close()?;
        let left = match self.motion.by_order {
            true => LEFT_OF_HISTORY,
            false => LEFT,
        };
        match &coarse {
            Some(coarse) => extrapolate(&mut tally, &coarse.tally, samples, left, cell_area),
            // So few samples say nothing of what they leave.
            None if self.options.extrapolate && samples < FEWEST => {
                let part = LEAST_CHANGE / (samples * samples) as f64;
                tally.dissipation_error += part * tally.energy.iter().sum::<f64>() * cell_area;
            }
            None => {}
        }
        self.about_their_middle(&mut marched);
        let solution = tally.finish(cell_area, shear, marched);
        let mut shear_of = |instant: usize| match instant {
            0 => kept.get(&0).cloned(),
            _ => kept.remove(&(instant % samples)),
        };
        let kept = instants.into_iter().map(|instant| Kept {
            instant,
            sample: instant % samples,
            shear: shear_of(instant).expect("every sample of a cycle is marched"),
        });
        let kept = kept.collect();
        let fields = self.fields(contact, Some(&limits), &solution, kept);
        Ok((solution, fields))
    }

    /// Shifts displacements that were found, and are known up to a constant, to the middle of their range.
    fn about_their_middle(&self, instants: &mut [Instant]) {
        let shift = |instants: &mut [Instant], value: fn(&mut Instant, usize) -> &mut f64, k| {
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            for instant in instants.iter_mut() {
                let value = *value(instant, k);
                (least, most) = (least.min(value), most.max(value));
            }
            for instant in instants.iter_mut() {
                *value(instant, k) -= 0.5 * (least + most);
            }
        };
        for (axis, channel) in self.motion.drive.iter().enumerate() {
            if channel.is_force() {
                shift(
                    instants,
                    |instant, axis| &mut instant.displacement[axis],
                    axis,
                );
            }
        }
        if self.motion.rotation.as_ref().is_some_and(Channel::is_force) {
            let rotation: fn(&mut Instant, usize) -> &mut f64 =
                |instant, _| &mut instant.torsion.as_mut().expect("a rotation is driven")[0];
            shift(instants, rotation, 0);
        }
    }
}

/// Takes slip path and energy to steps of no length, and estimates what that leaves: the part `left` of what half of the samples change.
fn extrapolate(tally: &mut Tally, coarse: &Tally, samples: usize, left: f64, cell_area: f64) {
    let least = LEAST_CHANGE / (samples * samples) as f64;
    let changes = tally.energy.iter().zip(&coarse.energy);
    let change: f64 = changes
        .map(|(fine, coarse)| (fine - coarse).abs().max(least * fine))
        .sum();
    tally.steps += coarse.steps;
    tally.error = tally.error.max(coarse.error);
    let extrapolated = |fine: f64, coarse: f64| fine + (fine - coarse) / 3.0;
    for (fine, coarse) in [
        (&mut tally.energy, &coarse.energy),
        (&mut tally.slip_path, &coarse.slip_path),
    ] {
        for (fine, coarse) in fine.iter_mut().zip(coarse) {
            *fine = extrapolated(*fine, *coarse).max(LEAST_EXTRAPOLATED * *fine);
        }
    }
    // The errors of the solves are amplified as the energies are.
    let of_solves = [tally.dissipation_error, -coarse.dissipation_error];
    tally.dissipation_error = extrapolated(of_solves[0], of_solves[1]) + left * change * cell_area;
}
