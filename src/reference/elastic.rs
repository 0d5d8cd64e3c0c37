//! Elastic constants of two half spaces in contact, combined as in the closed forms.
//!
//! The closed forms compute the constants from shear moduli, and the solvers from Young's moduli. The two computations
//! check each other.

use crate::contact::{Elastic, Pair};

fn sum(pair: &Pair, term: impl Fn(f64, f64) -> f64) -> f64 {
    [pair.lower, pair.upper]
        .iter()
        .map(
            |Elastic {
                 youngs_modulus,
                 poisson_ratio,
             }| { term(0.5 * youngs_modulus / (1.0 + poisson_ratio), *poisson_ratio) },
        )
        .sum()
}

/// Returns the effective modulus E* of two bodies \[Pa\] (Johnson, Contact Mechanics, §4.2). The sums over the bodies
/// are 1/E* = Σ (1 − ν)/2G = Σ (1 − ν²)/E.
pub fn effective_modulus(pair: &Pair) -> f64 {
    1.0 / sum(pair, |shear, nu| 0.5 * (1.0 - nu) / shear)
}

/// Returns G* with 1/G* = Σ (2 − ν)/G \[Pa\]. A sticking circle of radius a has kt = 8 G* a (Johnson §7.2).
pub fn tangential_modulus(pair: &Pair) -> f64 {
    1.0 / sum(pair, |shear, nu| (2.0 - nu) / shear)
}

/// Returns Σ ν/G \[1/Pa\]: the direction-dependent part of the shear compliance, which multiplies the cos 2θ
/// terms.
pub fn directional_compliance(pair: &Pair) -> f64 {
    sum(pair, |shear, nu| nu / shear)
}
