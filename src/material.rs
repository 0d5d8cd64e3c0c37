//! Materials of the bodies.

use serde::{Deserialize, Serialize};

/// Elastic constants of a linear elastic, isotropic material.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Elastic {
    /// Young's modulus \[Pa\].
    pub youngs_modulus: f64,
    /// Poisson ratio.
    pub poisson_ratio: f64,
}

impl Elastic {
    /// Returns the shear modulus G = E / 2(1 + ν) \[Pa\].
    pub fn shear_modulus(&self) -> f64 {
        0.5 * self.youngs_modulus / (1.0 + self.poisson_ratio)
    }
}

/// Elastic material with a density.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Elastic constants.
    #[serde(flatten)]
    pub elastic: Elastic,
    /// Density \[kg/m³\].
    pub density: f64,
}
