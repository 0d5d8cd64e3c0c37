//! Nonlinear springs to the ground, parallel to the sliders of a contact element.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::Harmonics;
use crate::linalg::add_scaled;

/// Spring along one direction. The force of a spring is positive along the displacement, as for a slider.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Spring {
    /// k₃ u³.
    Cubic {
        /// 0, 1, 2 for x, y, n.
        direction: usize,
        /// k₃ \[N/m³\]; softening if negative.
        stiffness: f64,
    },
    /// k max(0, u − g).
    Stop {
        /// 0, 1, 2 for x, y, n.
        direction: usize,
        /// k \[N/m\].
        stiffness: f64,
        /// g \[m\]: displacement at first contact.
        gap: f64,
    },
}

impl Spring {
    /// Returns the direction of the force.
    pub fn direction(&self) -> usize {
        match *self {
            Spring::Cubic { direction, .. } | Spring::Stop { direction, .. } => direction,
        }
    }

    /// Returns the force \[N\] at a displacement along the spring, and the derivative of the force \[N/m\].
    pub fn force(&self, displacement: f64) -> [f64; 2] {
        match *self {
            Spring::Cubic { stiffness, .. } => {
                let square = displacement * displacement;
                [stiffness * square * displacement, 3.0 * stiffness * square]
            }
            Spring::Stop { stiffness, gap, .. } if displacement > gap => {
                [stiffness * (displacement - gap), stiffness]
            }
            Spring::Stop { .. } => [0.0; 2],
        }
    }

    /// Adds the coefficients of the force of a cubic spring over a cycle, and their derivatives, row by row.
    ///
    /// The derivatives are with respect to the coefficients of the displacement along the spring. The coefficients and
    /// the derivatives are exact, so the spring does no work over a cycle.
    pub(super) fn add(
        &self,
        harmonics: &Harmonics,
        displacement: &[f64],
        force: &mut [f64],
        slope: &mut [f64],
    ) {
        // The integrands are products of at most four harmonics, so a sum over `samples` samples gives exact integrals.
        let n = harmonics.coefficients();
        let samples = 4 * harmonics.highest() as usize + 1;
        for j in 0..samples {
            let basis = harmonics.basis(TAU * j as f64 / samples as f64);
            let at: f64 = displacement.iter().zip(&basis).map(|(a, b)| a * b).sum();
            let [value, derivative] = self.force(at);
            for c in 0..n {
                let weight = Harmonics::weight(c) / samples as f64 * basis[c];
                force[c] += weight * value;
                add_scaled(&mut slope[c * n..][..n], weight * derivative, &basis);
            }
        }
    }

    /// Returns true if the force has a kink and is sampled, as for a slider.
    pub(super) fn is_sampled(&self) -> bool {
        matches!(self, Spring::Stop { .. })
    }

    /// Returns the name, the value and the allowed values of a parameter outside of its allowed range, or `None` if all
    /// parameters are allowed.
    pub(super) fn fault(&self) -> Option<(&'static str, f64, &'static str)> {
        let not_negative = |value: f64| value >= 0.0 && value.is_finite();
        match *self {
            Spring::Cubic { direction, .. } | Spring::Stop { direction, .. } if direction > 2 => {
                let value = direction as f64;
                Some(("the direction of a spring", value, "0, 1 or 2"))
            }
            Spring::Cubic { stiffness, .. } if !stiffness.is_finite() => {
                Some(("the cubic stiffness", stiffness, "a finite number"))
            }
            Spring::Stop { stiffness, .. } if !not_negative(stiffness) => {
                let expected = "a finite number, zero or more";
                Some(("the stiffness of a stop", stiffness, expected))
            }
            Spring::Stop { gap, .. } if !not_negative(gap) => {
                Some(("the gap of a stop", gap, "a finite number, zero or more"))
            }
            _ => None,
        }
    }
}
