//! Tangential stiffness of contact elements from the energy that the fine contact dissipates around them in a cycle.
//!
//! The laws come from a loading along a line under the loads at rest. On an orbit, or if places gain and lose much of
//! their load, the fine contact dissipates more or less than sliders with these laws. One factor per element on the
//! stiffness of its sliders corrects the energy: a stiffer slider slips over more of the motion. The strengths stay the
//! same.

use super::ElementParameters;

/// Bounds of a factor. A backbone along a line is wrong by less than a factor of two. If a larger factor is needed, the
/// energy is dissipated elsewhere.
const FACTORS: [f64; 2] = [0.5, 2.0];
/// Elements that dissipate less than this fraction of the mean energy keep their law. The stiffness of an element that
/// hardly slips follows from its backbone, not from the little energy that it dissipates.
const LEAST_ENERGY: f64 = 0.02;
/// Number of bisections of the logarithm of [`FACTORS`], down to 3e-4.
const HALVINGS: usize = 12;
/// Bound on the rounds in which the other elements take over the energy that some cannot dissipate, and the relative
/// error of the total energy at which the rounds end.
const MAX_ROUNDS: usize = 4;
const ENERGY_TOLERANCE: f64 = 1e-3;

/// Returns elements of these `laws` with the tangential stiffness for which each dissipates the `energy` of the fine
/// contact \[J\], as far as bounded factors permit. If the factors of some elements reach their bounds, the target
/// energies of all elements rise by the same ratio. The total energy of the elements then equals the energy of the fine
/// contact. `dissipated` returns the energy of elements with other parameters in the same motion \[J\].
pub fn match_dissipation(
    energy: &[f64],
    laws: &ElementParameters,
    dissipated: impl Fn(&ElementParameters) -> Vec<f64>,
) -> ElementParameters {
    let total: f64 = energy.iter().sum();
    let least = LEAST_ENERGY * total / energy.len().max(1) as f64;
    let mut target: Vec<f64> = energy.to_vec();
    let mut adjusted = laws.clone();
    for _ in 0..MAX_ROUNDS {
        let mut factors = factors(&target, laws, &dissipated);
        let slipping = factors.iter_mut().zip(energy);
        let low_energy = slipping.filter(|(_, energy)| **energy <= least);
        low_energy.for_each(|(factor, _)| *factor = 1.0);
        adjusted = scale_stiffness(laws, &factors);
        let ratio = total / dissipated(&adjusted).iter().sum::<f64>();
        if !ratio.is_finite() || (ratio - 1.0).abs() <= ENERGY_TOLERANCE {
            break;
        }
        target.iter_mut().for_each(|energy| *energy *= ratio);
    }
    adjusted
}

/// Returns the factors for which each element dissipates its target energy.
fn factors(
    target: &[f64],
    laws: &ElementParameters,
    dissipated: &impl Fn(&ElementParameters) -> Vec<f64>,
) -> Vec<f64> {
    let mut bounds = vec![FACTORS; target.len()];
    let middle = |[low, high]: &[f64; 2]| (low * high).sqrt();
    for _ in 0..HALVINGS {
        let factors: Vec<f64> = bounds.iter().map(middle).collect();
        let actual = dissipated(&scale_stiffness(laws, &factors));
        let energies = actual.iter().zip(target);
        for ((bound, factor), (actual, target)) in bounds.iter_mut().zip(factors).zip(energies) {
            bound[usize::from(actual >= target)] = factor;
        }
    }
    bounds.iter().map(middle).collect()
}

/// Returns elements whose sliders have their tangential stiffness multiplied by these factors.
fn scale_stiffness(laws: &ElementParameters, factors: &[f64]) -> ElementParameters {
    let mut laws = laws.clone();
    let stiffness = laws.kt.iter_mut().zip(factors);
    stiffness.for_each(|(kt, factor)| *kt *= factor);
    if let Some(sliders) = &mut laws.sliders {
        let pairs = sliders.kt.iter_mut().zip(&sliders.element);
        pairs.for_each(|(kt, &element)| *kt *= factors[element]);
    }
    laws
}
