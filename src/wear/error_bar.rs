//! Error bars: how far a worn state's figures may be from those of exact wear steps and exact contact solves of the same model,
//! and of a vibration with all harmonics whose elements each move and are loaded by themselves.
//!
//! The worn volume is in error by what the wear steps estimate of themselves, times a factor of safety; by the duality gaps
//! of the cycles, which bound what friction dissipates, and what their samples leave; and by what the vibration makes wrong in
//! the energy of every cycle. Every other figure follows the volume: its error is what the last step changed it by, in proportion
//! (a vibration in force: the last update), and what vibration and cycle make wrong in it directly. Where wear dies out the energy
//! of a cycle falls by a large part while little volume is worn, so that a small error of volume is a large one of the energy; the
//! bar says so.
//!
//! Where single cells decide between sticking and wearing, wear makes large errors of small ones. Under a prescribed motion a coarse
//! trajectory ([`super::coarse`]) is worn beside, and one and a half times what it differs by is the least that the bar of any figure is.

use std::ops::Add;

use super::WearLaw;

/// Error of a worn volume, by source \[m³\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct VolumeError {
    /// Wear steps, each by itself.
    pub steps: f64,
    /// Cycles: their solves, samples and ends.
    pub cycles: f64,
    /// What wear has made of them, beyond that.
    pub propagation: f64,
    /// Harmonics left out of the vibration.
    pub harmonics: f64,
    /// Mean displacement and total load, by which a vibration drives the contact.
    pub closure: f64,
    /// The grid, where half of it has been looked at.
    pub grid: f64,
}

impl VolumeError {
    /// By the contact alone: wear steps and cycles.
    pub fn of_contact(self) -> f64 {
        self.steps + self.cycles
    }

    /// Errors need not cancel.
    pub fn total(self) -> f64 {
        self.of_contact() + self.propagation + self.harmonics + self.closure + self.grid
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

/// Of an error estimated from two results alone, as in [Roache 1994]: what a step does wrong goes on to change the later ones.
/// Measured, true errors are 0.3 to 2.8 times the estimate.
const SAFETY: f64 = 3.0;

/// Safety factor of an error estimated beside a coarse trajectory, which has what a step goes on to change.
const SAFETY_BESIDE_COARSE: f64 = 2.0;

/// Part of the volume's relative error that every figure has at least, of itself or of its change since the unworn state: one that happens not to
/// change in a step is not right for that.
pub const LEAST: f64 = 0.125;

/// Part of the volume's relative error that the energy of a cycle has at least: its errors are nearly as large where the force is given.
pub const LEAST_OF_ENERGY: f64 = 0.4;

/// Error of the volume worn in a step, its own estimate being `estimate`, with a coarse trajectory beside it or without \[m³\].
pub fn of_step(estimate: f64, beside_coarse: bool) -> f64 {
    let safety = match beside_coarse {
        true => SAFETY_BESIDE_COARSE,
        false => SAFETY,
    };
    safety * estimate
}

/// Relative error of a figure that changed from `before` to `after` while `volume` was worn, under an `error` of the volume worn in
/// `all` steps (all three \[m³\]). The part `wears` of the figure is what wear has changed it by. 0 where nothing wears.
pub fn of_figure(
    [before, after]: [f64; 2],
    wears: f64,
    error: VolumeError,
    volume: f64,
    all: f64,
) -> f64 {
    if volume <= 0.0 || all <= 0.0 {
        return 0.0;
    }
    let least = LEAST * wears * error.of_contact() / all;
    let change = ((after - before) / after).abs();
    if change.is_finite() {
        let by_vibration = change * (error.harmonics + error.closure) / volume;
        least.max(change * error.of_contact() / volume) + by_vibration
    } else {
        least
    }
}

/// What an explicit step of `cycles` makes wrong, as it takes the rate of its beginning for that of all its length: half the
/// change of the energy per area \[J/m²\] over it, summed over cells of `cell_area` \[m²\]. A volume \[m³\].
pub fn of_constant_rate(
    [begin, end]: [&[f64]; 2],
    law: WearLaw,
    cycles: u64,
    cell_area: f64,
) -> f64 {
    let changes = begin.iter().zip(end).map(|(a, b)| (a - b).abs());
    0.5 * law.over(cycles) * changes.sum::<f64>() * cell_area
}
