//! Tangential stiffness of contact elements from the dissipated energy. The energy is the dissipation of the fine
//! contact per cycle in the cells of each element.
//!
//! The laws come from a loading along a line under the loads at rest. A real motion can be an orbit, or can change the
//! local normal loads strongly. On an orbit or under varying loads, the sliders dissipate more or less energy than the
//! fine contact. One factor per element scales the stiffness of all sliders of the element. A stiffer slider slips over
//! a larger part of the motion, so the factor corrects the energy. The strengths of the sliders do not change.

use super::ElementParameters;

/// Bounds of a factor. A backbone along a line is wrong by less than a factor of two. If a larger factor is needed, the
/// energy is dissipated elsewhere.
const FACTORS: [f64; 2] = [0.5, 2.0];
/// An element keeps its law if the element dissipates less than this fraction of the mean energy per element. If an
/// element hardly slips, its dissipated energy is too small to determine its stiffness. The element then keeps the
/// stiffness of its backbone.
const LEAST_ENERGY: f64 = 0.02;
/// Number of bisections of the logarithm of [`FACTORS`], down to 3e-4.
const HALVINGS: usize = 12;
/// `MAX_ROUNDS` bounds the number of rounds in [`match_dissipation`]. Each round multiplies the target energies of all
/// elements by one ratio. The rounds end if the relative error of the total energy is at most `ENERGY_TOLERANCE`.
const MAX_ROUNDS: usize = 4;
const ENERGY_TOLERANCE: f64 = 1e-3;

/// Scales the tangential stiffness of the elements of `laws`, and returns the scaled elements. Each scaled element
/// dissipates the same `energy` as the fine contact \[J\]. The scale factors are bounded. If the factors of some
/// elements reach their bounds, the target energies of all elements rise by the same ratio. The total energy of the
/// elements then equals the energy of the fine contact. `dissipated` returns the energy of elements with other
/// parameters in the same motion \[J\].
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

/// Returns `laws` with the tangential stiffness of each element's sliders multiplied by the element's factor in
/// `factors`.
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
