//! What bodies are made of.

use serde::{Deserialize, Serialize};

/// Constants of a linear elastic, isotropic material.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Elastic {
    /// Young's modulus \[Pa\].
    pub youngs_modulus: f64,
    /// Poisson ratio.
    pub poisson_ratio: f64,
}

impl Elastic {
    /// Shear modulus G = E / 2(1 + ν) \[Pa\].
    pub fn shear_modulus(&self) -> f64 {
        0.5 * self.youngs_modulus / (1.0 + self.poisson_ratio)
    }
}

/// An elastic material with mass.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Its elastic constants.
    #[serde(flatten)]
    pub elastic: Elastic,
    /// Density \[kg/m³\].
    pub density: f64,
}
