//! Error bars: distance of a worn state's figures from the exact result of the same model. The exact result
//! has exact wear steps, exact contact solves, and a vibration with all harmonics in which each element moves
//! and is loaded individually.
//!
//! The error of the worn volume has three parts: the estimates of the wear steps, times a safety factor; the
//! duality gaps of the cycles, which bound the dissipation of friction, with the sampling error; and the
//! error of the vibration in the energy of every cycle. The error of every other figure follows the volume.
//! The error of a figure is proportional to the figure's change over the last step, or over the last update if a
//! vibration drives the joint. Direct errors by the vibration and the cycle are added. Where wear dies out, the energy
//! per cycle falls strongly while little volume is worn. A small error of the volume is then a large error of the
//! energy, and the bar shows it.
//!
//! Where single cells decide between sticking and wearing, wear amplifies small errors. Therefore, under a prescribed
//! motion, the run also computes a coarse trajectory ([`super::coarse`]). The bar of any figure is at least one and a
//! half times the difference of both trajectories.

use std::ops::Add;

use super::WearLaw;

/// Error of a worn volume, by source \[m³\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct VolumeError {
    /// Error of the single wear steps.
    pub steps: f64,
    /// Error of the cycles: their solves, samples and closure.
    pub cycles: f64,
    /// Propagation of these errors by wear, beyond their sum.
    pub propagation: f64,
    /// Error by the harmonics that the vibration omits.
    pub harmonics: f64,
    /// Error by driving the contact with the mean displacement and the total load of a vibration.
    pub closure: f64,
    /// Error of the grid, if it was estimated with a grid half as fine.
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

/// Smallest relative error of every figure, of itself or of its change since the unworn state, as a fraction
/// of the volume's relative error. A figure that happens not to change in a step need not be exact.
pub const LEAST_FIGURE_ERROR: f64 = 0.125;

/// Smallest relative error of the energy per cycle, as a fraction of the volume's relative error. If the
/// force is prescribed, the errors of the energy are nearly as large as the volume's.
pub const LEAST_ENERGY_ERROR: f64 = 0.4;

/// Returns the error of the volume worn in a step, from the step's own `estimate`, with or without a coarse
/// trajectory \[m³\].
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

/// Returns the error of an explicit step of `cycles`, which assumes its initial rate throughout, as a volume
/// \[m³\]. The error is half the change of the energy per area over the step \[J/m²\], summed over cells of area
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
