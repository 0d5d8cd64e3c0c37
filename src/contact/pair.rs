//! Elastic constants of a pair of bodies.

use serde::{Deserialize, Serialize};

use std::f64::consts::PI;

use crate::material::Elastic;

/// |β| below which bodies count as elastically alike. Equal constants differ by less, through rounding.
const LEAST_BETA: f64 = 1e-12;

/// Pair of bodies in contact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    /// Body below the contact plane.
    pub lower: Elastic,
    /// Body above the contact plane.
    pub upper: Elastic,
}

impl Pair {
    /// Returns a pair of bodies of one material.
    pub fn same(material: Elastic) -> Self {
        Pair {
            lower: material,
            upper: material,
        }
    }

    /// Returns E* with 1/E* = Σ (1 − ν²)/E over both bodies \[Pa\].
    pub fn effective_modulus(&self) -> f64 {
        1.0 / self.sum(|m| (1.0 - m.poisson_ratio.powi(2)) / m.youngs_modulus)
    }

    /// Returns Dundurs' second constant β. Normal and tangential problem are uncoupled where it is zero.
    pub fn dundurs_beta(&self) -> f64 {
        let term = |m: &Elastic| (1.0 - 2.0 * m.poisson_ratio) / m.shear_modulus();
        let scale = |m: &Elastic| 2.0 * (1.0 - m.poisson_ratio) / m.shear_modulus();
        (term(&self.lower) - term(&self.upper)) / (scale(&self.lower) + scale(&self.upper))
    }

    /// Returns true if pressure causes tangential displacement and shear causes normal displacement: |β| above
    /// rounding.
    pub fn is_coupled(&self) -> bool {
        self.dundurs_beta().abs() > LEAST_BETA
    }

    /// Returns γ = β/(πE*) \[1/Pa\]. γ is (1 − 2ν)/(4πG) of the lower body minus (1 − 2ν)/(4πG) of the upper body. The
    /// value γ is the factor of x/r² and y/r² in the coupling of pressure and shear.
    pub(crate) fn coupling_compliance(&self) -> f64 {
        let term = |m: &Elastic| (1.0 - 2.0 * m.poisson_ratio) / m.shear_modulus();
        0.25 * (term(&self.lower) - term(&self.upper)) / PI
    }

    /// Returns Σ (1 − ν²)/(πE), the factor of 1/r in the displacements zz, xx and yy \[1/Pa\].
    pub(crate) fn compliance(&self) -> f64 {
        1.0 / (PI * self.effective_modulus())
    }

    /// Returns Σ ν(1 + ν)/(πE) \[1/Pa\]. Σ ν(1 + ν)/(πE) is the factor of x²/r³, y²/r³ and xy/r³ in the displacements
    /// xx, yy and xy.
    pub(crate) fn lateral_compliance(&self) -> f64 {
        self.sum(|m| m.poisson_ratio * (1.0 + m.poisson_ratio) / m.youngs_modulus) / PI
    }

    fn sum(&self, term: impl Fn(&Elastic) -> f64) -> f64 {
        term(&self.lower) + term(&self.upper)
    }
}

/// Treatment of the coupling of pressure and shear between elastically different bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Coupling {
    /// No coupling: the bodies are alike, or the coupling is neglected.
    None,
    /// Pressing the bodies together causes no shear, and only the tangential stiffness of the contact includes the
    /// coupling.
    Frictionless,
    /// Pressing the bodies together with friction causes shear.
    Indented {
        /// Number of steps in which the load rises.
        load_steps: usize,
    },
}

impl Coupling {
    /// Returns the number of steps in which the load rises, if it rises in steps.
    pub fn load_steps(self) -> Option<usize> {
        match self {
            Coupling::Indented { load_steps } => Some(load_steps),
            Coupling::None | Coupling::Frictionless => None,
        }
    }
}
