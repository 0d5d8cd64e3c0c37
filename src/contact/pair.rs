//! Elastic constants of two bodies together.

use serde::{Deserialize, Serialize};

use std::f64::consts::PI;

use crate::material::Elastic;

/// |β| below which bodies count as elastically alike: rounding of equal constants.
const ALIKE: f64 = 1e-12;

/// The two bodies in contact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    /// The body below the contact plane.
    pub lower: Elastic,
    /// The body above it.
    pub upper: Elastic,
}

impl Pair {
    /// Two bodies of one material.
    pub fn same(material: Elastic) -> Self {
        Pair {
            lower: material,
            upper: material,
        }
    }

    /// E* with 1/E* = Σ (1 − ν²)/E over both bodies \[Pa\].
    pub fn effective_modulus(&self) -> f64 {
        1.0 / self.sum(|m| (1.0 - m.poisson_ratio.powi(2)) / m.youngs_modulus)
    }

    /// Dundurs' second constant β: normal and tangential problems are uncoupled where it is zero.
    pub fn dundurs_beta(&self) -> f64 {
        let term = |m: &Elastic| (1.0 - 2.0 * m.poisson_ratio) / m.shear_modulus();
        let scale = |m: &Elastic| 2.0 * (1.0 - m.poisson_ratio) / m.shear_modulus();
        (term(&self.lower) - term(&self.upper)) / (scale(&self.lower) + scale(&self.upper))
    }

    /// True where pressure displaces the surfaces along each other and shear across: |β| above rounding.
    pub fn is_coupled(&self) -> bool {
        self.dundurs_beta().abs() > ALIKE
    }

    /// γ = (1 − 2ν)/(4πG) of the lower body less that of the upper one = β/(πE*): the factor of x/r² and y/r² in the
    /// coupling of pressure and shear \[1/Pa\].
    pub(crate) fn coupling_compliance(&self) -> f64 {
        let term = |m: &Elastic| (1.0 - 2.0 * m.poisson_ratio) / m.shear_modulus();
        0.25 * (term(&self.lower) - term(&self.upper)) / PI
    }

    /// Σ (1 − ν²)/(πE): the factor of 1/r in the displacements zz, xx and yy \[1/Pa\].
    pub(crate) fn compliance(&self) -> f64 {
        1.0 / (PI * self.effective_modulus())
    }

    /// Σ ν(1 + ν)/(πE): the factor of x²/r³, y²/r³ and xy/r³ in xx, yy and xy \[1/Pa\].
    pub(crate) fn lateral_compliance(&self) -> f64 {
        self.sum(|m| m.poisson_ratio * (1.0 + m.poisson_ratio) / m.youngs_modulus) / PI
    }

    fn sum(&self, term: impl Fn(&Elastic) -> f64) -> f64 {
        term(&self.lower) + term(&self.upper)
    }
}

/// What elastically different bodies have of each other's tractions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Coupling {
    /// Nothing: they are alike, or nothing of it matters.
    None,
    /// No shear: only the tangential stiffness knows.
    Frictionless,
    /// Shear by pressing them together with friction.
    Indented {
        /// Steps in which the load rises.
        load_steps: usize,
    },
}

impl Coupling {
    /// Steps in which the load rises, where it rises in steps.
    pub fn load_steps(self) -> Option<usize> {
        match self {
            Coupling::Indented { load_steps } => Some(load_steps),
            Coupling::None | Coupling::Frictionless => None,
        }
    }
}
