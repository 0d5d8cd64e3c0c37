//! Springs to the ground whose force is no multiple of displacement, beside the sliders of a contact element.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::Harmonics;
use crate::linalg::add_scaled;

/// A spring along one direction; its force is positive along the displacement, as that of a slider.
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
        /// g \[m\]: where it touches.
        gap: f64,
    },
}

impl Spring {
    /// The direction of its force.
    pub fn direction(&self) -> usize {
        match *self {
            Spring::Cubic { direction, .. } | Spring::Stop { direction, .. } => direction,
        }
    }

    /// Force \[N\] at a displacement along it, and its derivative \[N/m\].
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

    /// Adds the coefficients of the force of a cubic spring over a cycle, and their derivatives (row by row), of those of the displacement along it:
    /// exactly, so that it does no work.
    pub(super) fn add(
        &self,
        harmonics: &Harmonics,
        displacement: &[f64],
        force: &mut [f64],
        slope: &mut [f64],
    ) {
        // Products of four harmonics at most: so many samples sum them up exactly.
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

    /// Whether its force has a kink: it is sampled as that of a slider is.
    pub(super) fn is_sampled(&self) -> bool {
        matches!(self, Spring::Stop { .. })
    }

    /// Name, value and what would be right of a parameter that is out of its range.
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
