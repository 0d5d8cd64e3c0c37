//! The tangential stiffness of contact elements from what the fine contact dissipates around them in a cycle of any motion.
//!
//! Laws are taken from a loading along a line under the loads at rest. On an orbit, or where places gain and lose much of their load, the
//! fine contact dissipates more or less than sliders with such laws do. One factor for each element on the stiffness of its sliders gives
//! it the energy: a stiffer slider slips over more of the way. Strengths remain.

use super::ElementParameters;

/// Bounds of a factor: a backbone of the line is not twice off, and what asks for more is dissipated elsewhere.
const FACTORS: [f64; 2] = [0.5, 2.0];
/// Elements in which less is dissipated than this part of the mean of all keep their law: how stiff an element is that all but sticks
/// is told by its backbone, and not by the little that it dissipates.
const LEAST_ENERGY: f64 = 0.02;
/// Halvings of the logarithm of [`FACTORS`]: to 3e-4.
const HALVINGS: usize = 12;
/// How often what some elements cannot dissipate is asked of the others, and what of all may be left at last.
const SHARINGS: usize = 4;
const LEFT: f64 = 1e-3;

/// Elements of these `laws` with the tangential stiffness by which each dissipates the `energy` of the fine contact \[J\], as far as a
/// factor within bounds does; where it does not, the others dissipate so much more, all in the same part, that the sum is that of the fine
/// contact. `dissipated` is what elements with other parameters dissipate in the same motion \[J\].
pub fn with_energy_of(
    energy: &[f64],
    laws: &ElementParameters,
    dissipated: impl Fn(&ElementParameters) -> Vec<f64>,
) -> ElementParameters {
    let all: f64 = energy.iter().sum();
    let least = LEAST_ENERGY * all / energy.len().max(1) as f64;
    let mut asked: Vec<f64> = energy.to_vec();
    let mut found = laws.clone();
    for _ in 0..SHARINGS {
        let mut factors = factors(&asked, laws, &dissipated);
        let slipping = factors.iter_mut().zip(energy);
        let little = slipping.filter(|(_, energy)| **energy <= least);
        little.for_each(|(factor, _)| *factor = 1.0);
        found = stiffer(laws, &factors);
        let part = all / dissipated(&found).iter().sum::<f64>();
        if !part.is_finite() || (part - 1.0).abs() <= LEFT {
            break;
        }
        asked.iter_mut().for_each(|energy| *energy *= part);
    }
    found
}

/// The factors by which each element dissipates what is asked of it.
fn factors(
    asked: &[f64],
    laws: &ElementParameters,
    dissipated: &impl Fn(&ElementParameters) -> Vec<f64>,
) -> Vec<f64> {
    let mut bounds = vec![FACTORS; asked.len()];
    let middle = |[low, high]: &[f64; 2]| (low * high).sqrt();
    for _ in 0..HALVINGS {
        let factors: Vec<f64> = bounds.iter().map(middle).collect();
        let found = dissipated(&stiffer(laws, &factors));
        let energies = found.iter().zip(asked);
        for ((bound, factor), (found, asked)) in bounds.iter_mut().zip(factors).zip(energies) {
            bound[usize::from(found >= asked)] = factor;
        }
    }
    bounds.iter().map(middle).collect()
}

/// Elements whose sliders are so many times as stiff along the joint.
fn stiffer(laws: &ElementParameters, factors: &[f64]) -> ElementParameters {
    let mut laws = laws.clone();
    let stiffness = laws.kt.iter_mut().zip(factors);
    stiffness.for_each(|(kt, factor)| *kt *= factor);
    if let Some(sliders) = &mut laws.sliders {
        let pairs = sliders.kt.iter_mut().zip(&sliders.element);
        pairs.for_each(|(kt, &element)| *kt *= factors[element]);
    }
    laws
}
