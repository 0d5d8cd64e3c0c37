//! Published wear step: explicit, for as many cycles as wear a given depth [A eq. 2.7–2.8].

use super::WearLaw;

/// Returns N = floor(Δh_max / max Δh), at least one cycle [A eq. 2.7]. `deepest` is the largest wear depth
/// per cycle \[m\].
pub fn cycles(depth_step: f64, deepest: f64) -> u64 {
    // The conversion to `u64` saturates. A joint that hardly wears makes one very long step.
    ((depth_step / deepest).floor() as u64).max(1)
}

/// Returns h + N Δh [A eq. 2.8], written for the wear depth \[m\]. `energy` is the energy per area and cycle
/// \[J/m²\].
pub fn advance(wear: &[f64], energy: &[f64], law: WearLaw, cycles: u64) -> Vec<f64> {
    let reach = law.over(cycles);
    wear.iter()
        .zip(energy)
        .map(|(w, e)| w + reach * e)
        .collect()
}

/// Smallest eigenvalue of the half spaces' compliance on a grid, over a cell's own compliance. The pressure with the
/// smallest eigenvalue alternates from cell to cell.
const SMALLEST_EIGENVALUE: f64 = 0.5;

/// Returns the ratio of N α µ·(slip path) to the stability limit of the explicit scheme. The slip path is the longest
/// slip path of the cells in contact. The stability limit is twice the smallest eigenvalue of the compliance. If the
/// ratio is above 1, cells wear too much in a step, lose contact and touch again later.
///
/// `slip_path` \[m\] and `pressure` \[Pa\] have one value per cell. `self_compliance` is the displacement of a cell by
/// a pressure of 1 Pa on the same cell \[m/Pa\].
pub fn stability_ratio(
    slip_path: &[f64],
    pressure: &[f64],
    friction_coefficient: f64,
    law: WearLaw,
    cycles: u64,
    self_compliance: f64,
) -> f64 {
    let longest = slip_path
        .iter()
        .zip(pressure)
        .filter(|(_, pressure)| **pressure > 0.0)
        .fold(0.0f64, |longest, (path, _)| longest.max(*path));
    let compliance = law.over(cycles) * friction_coefficient * longest;
    compliance / (2.0 * SMALLEST_EIGENVALUE * self_compliance)
}

/// Returns the largest wear depth of a stable step \[m\] for the fastest-wearing cell, which has the pressure
/// `pressure`. In a step of depth d, N α µ·(slip path) equals d/p. The step is stable up to the depth d = 2 λ_min p.
pub fn largest_stable_depth(pressure: f64, self_compliance: f64) -> f64 {
    2.0 * SMALLEST_EIGENVALUE * self_compliance * pressure
}
