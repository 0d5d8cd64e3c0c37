//! Elastic constants of two half spaces in contact, as the closed forms combine them.
//!
//! Reduced from shear moduli, where the solvers reduce from Young's, so that one checks the other.

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

/// E* with 1/E* = Σ (1 − ν)/2G, which is Σ (1 − ν²)/E \[Pa\] (Johnson, Contact Mechanics, §4.2).
pub fn effective_modulus(pair: &Pair) -> f64 {
    1.0 / sum(pair, |shear, nu| 0.5 * (1.0 - nu) / shear)
}

/// G* with 1/G* = Σ (2 − ν)/G \[Pa\]: a circle of radius a that sticks has kt = 8 G* a (Johnson §7.2).
pub fn tangential_modulus(pair: &Pair) -> f64 {
    1.0 / sum(pair, |shear, nu| (2.0 - nu) / shear)
}

/// Σ ν/G \[1/Pa\]: the part of the shear compliance that depends on direction (it carries the cos 2θ terms).
pub fn directional_compliance(pair: &Pair) -> f64 {
    sum(pair, |shear, nu| nu / shear)
}
