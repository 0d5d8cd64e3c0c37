//! Error bars: difference between the figures of a worn state and the exact result of the same model. The exact result
//! has no errors of wear steps and contact solves. The vibration of the exact result has all harmonics and an
//! individual motion and load of each element.
//!
//! The error of the worn volume has three parts. The first part is the error estimate of the wear steps, times a safety
//! factor. The second part is the error of the energy of the cycles: the duality gaps of the solves, and the sampling
//! error. The duality gaps bound the error of the energy that friction dissipates. The third part is the error of the
//! energy of the cycles due to the error of the vibration. The error of the worn volume also gives the error of every
//! other figure. The error of a figure is proportional to the change of the figure over the last step. If a vibration
//! drives the joint, the error of a figure is proportional to the change over the last update of the vibration. Direct
//! errors by the vibration and the cycle are added. Where wear dies out, the energy per cycle falls strongly while
//! little volume is worn. Where wear dies out, a small error of the volume causes a large error of the energy. The
//! error bar of the energy includes the large error.
//!
//! Where single cells decide between sticking and wearing, wear amplifies small errors. To measure the amplification of
//! errors by wear, a run under a prescribed motion also computes a coarse trajectory ([`super::coarse`]). The error bar
//! of a figure is at least 1½ times the difference of the figure between the run and the coarse trajectory.

use std::ops::Add;

use super::WearLaw;

/// Error of a worn volume, by source \[m³\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct VolumeError {
    /// Error of the single wear steps.
    pub steps: f64,
    /// Error of the cycles, from the solves, the sampling and the closure of the cycles.
    pub cycles: f64,
    /// Growth of the errors of the steps and cycles by wear, beyond the sum of the errors.
    pub propagation: f64,
    /// Error by the harmonics that the vibration omits.
    pub harmonics: f64,
    /// Error by driving the contact with the mean displacement and the total load of a vibration.
    pub closure: f64,
    /// Error by the cell size, if a computation on a grid half as fine estimated the error.
    pub grid: f64,
}

impl VolumeError {
    /// Returns the error by the contact alone: wear steps and cycles.
    pub fn contact_error(self) -> f64 {
        self.steps + self.cycles
    }

    /// Returns the sum of all errors, because they need not cancel.
    pub fn total(self) -> f64 {
        self.contact_error() + self.propagation + self.harmonics + self.closure + self.grid
    }
}

impl Add for VolumeError {
    type Output = VolumeError;

    fn add(self, other: VolumeError) -> VolumeError {
        VolumeError {
            steps: self.steps + other.steps,
            cycles: self.cycles + other.cycles,
            propagation: self.propagation + other.propagation,
            harmonics: self.harmonics + other.harmonics,
            closure: self.closure + other.closure,
            grid: self.grid + other.grid,
        }
    }
}

/// Safety factor of an error estimated from two results alone, as in [Roache 1994]. The error of a step
/// changes the later steps, and the estimate misses that. Measured, true errors are 0.3 to 2.8 times the
/// estimate.
const SAFETY: f64 = 3.0;

/// Safety factor of an error estimated along with a coarse trajectory, which includes the effect on later
/// steps.
const SAFETY_BESIDE_COARSE: f64 = 2.0;

/// Ratio of the smallest relative error of a figure to the relative error of the worn volume. For a figure that is not
/// zero in the unworn state, the ratio applies to the change of the figure since the unworn state. A figure that
/// happens not to change in a step can still have an error.
pub const LEAST_FIGURE_ERROR: f64 = 0.125;

/// Smallest relative error of the energy per cycle, as a fraction of the volume's relative error. If the
/// force is prescribed, the errors of the energy are nearly as large as the volume's.
pub const LEAST_ENERGY_ERROR: f64 = 0.4;

/// Returns the error of the volume worn in a step \[m³\]. The error is `estimate` times a safety factor. The safety
/// factor is smaller if the run also computes a coarse trajectory (`beside_coarse`).
pub fn step_error(estimate: f64, beside_coarse: bool) -> f64 {
    let safety = match beside_coarse {
        true => SAFETY_BESIDE_COARSE,
        false => SAFETY,
    };
    safety * estimate
}

/// Returns the relative error of a figure that changed from `before` to `after` while `volume` was worn.
/// `error` is the error of the volume `all` worn in all steps (all three \[m³\]). `wears` is the fraction of
/// the figure that wear has changed. Returns 0 if nothing wears.
pub fn figure_error(
    [before, after]: [f64; 2],
    wears: f64,
    error: VolumeError,
    volume: f64,
    all: f64,
) -> f64 {
    if volume <= 0.0 || all <= 0.0 {
        return 0.0;
    }
    let least = LEAST_FIGURE_ERROR * wears * error.contact_error() / all;
    let change = ((after - before) / after).abs();
    if change.is_finite() {
        let by_vibration = change * (error.harmonics + error.closure) / volume;
        least.max(change * error.contact_error() / volume) + by_vibration
    } else {
        least
    }
}

/// Returns the error of the volume worn in an explicit step of `cycles` \[m³\]. An explicit step assumes the initial
/// wear rate throughout the step. `begin` and `end` are the energies per area and cycle at both ends of the step
/// \[J/m²\]. The error is half the wear volume that the change from `begin` to `end` causes, summed over cells of area
/// `cell_area` \[m²\].
pub fn constant_rate_error(
    [begin, end]: [&[f64]; 2],
    law: WearLaw,
    cycles: u64,
    cell_area: f64,
) -> f64 {
    let changes = begin.iter().zip(end).map(|(a, b)| (a - b).abs());
    0.5 * law.over(cycles) * changes.sum::<f64>() * cell_area
}
