//! Published wear step: explicit, for as many cycles as wear a given depth [A eq. 2.7–2.8].

use super::WearLaw;

/// Returns N = floor(Δh_max / max Δh), at least one cycle [A eq. 2.7]. `deepest` is the largest wear depth
/// per cycle \[m\].
pub fn cycles(depth_step: f64, deepest: f64) -> u64 {
    // The conversion saturates, so that a joint that hardly wears makes one very long step.
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

/// Smallest eigenvalue of the half spaces' compliance on a grid, over a cell's own compliance. This eigenvalue belongs
/// to pressures that alternate from cell to cell.
const SMALLEST_EIGENVALUE: f64 = 0.5;

/// Returns how far a step exceeds the stability limit of the explicit scheme: N α µ·(slip path) of the
/// fastest cell in contact, over twice the smallest eigenvalue of the compliance. Above 1, cells overshoot,
/// lift off and come back.
///
/// `slip_path` \[m\] and `pressure` \[Pa\] have one value per cell; `self_compliance` is a cell's own
/// \[m/Pa\].
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

/// Returns the largest depth of a stable step for the fastest-wearing cell under this pressure \[m\]. A step
/// of depth d makes N α µ·(slip path) = d/p, so that it is stable up to d = 2 λ_min p.
pub fn largest_stable_depth(pressure: f64, self_compliance: f64) -> f64 {
    2.0 * SMALLEST_EIGENVALUE * self_compliance * pressure
}
