//! Flat rigid circular punch.

use std::f64::consts::PI;

use super::elastic;
use crate::contact::Pair;

/// Flat circular region of radius a that moves as a rigid body: pressed, or sheared without slip.
///
/// Source: Johnson, Contact Mechanics, eq. 3.34–3.36 (normal) and 7.43 (tangential). The shear solution is exact for
/// any Poisson's ratio. A traction along x, unbounded like an inverse square root at the rim, displaces the circle
/// uniformly along x. The traction does not displace the circle along y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircularPunch {
    /// Radius a \[m\].
    pub radius: f64,
    /// Both bodies.
    pub pair: Pair,
}

impl CircularPunch {
    /// Returns the normal stiffness kn = 2E*a \[N/m\].
    pub fn normal_stiffness(&self) -> f64 {
        2.0 * elastic::effective_modulus(&self.pair) * self.radius
    }

    /// Returns the tangential stiffness kt = 8G*a \[N/m\].
    pub fn tangential_stiffness(&self) -> f64 {
        8.0 * elastic::tangential_modulus(&self.pair) * self.radius
    }

    /// Returns the torsional stiffness of the punch about its axis \[N·m\]: Mz/θ = (16/3) G a³ with 1/G = Σ 1/G_i.
    /// Source: Reissner and Sagoci 1944; Johnson, Contact Mechanics, §3.9. The traction is circumferential and free of
    /// divergence. The traction therefore does not depend on Poisson's ratio.
    pub fn torsional_stiffness(&self) -> f64 {
        let compliance =
            1.0 / self.pair.lower.shear_modulus() + 1.0 / self.pair.upper.shear_modulus();
        16.0 / 3.0 * self.radius.powi(3) / compliance
    }

    /// Returns the traction at the radius `r` under the total `force` F \[Pa\]. For r < a, the traction is F / (2πa²√(1
    /// − r²/a²)). The traction is unbounded at the rim and zero outside the circle.
    pub fn traction(&self, force: f64, r: f64) -> f64 {
        let ratio = r / self.radius;
        if ratio < 1.0 {
            force / (2.0 * PI * self.radius * self.radius * (1.0 - ratio * ratio).sqrt())
        } else {
            0.0
        }
    }
}
