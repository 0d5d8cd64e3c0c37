//! Springs to the ground whose force is no multiple of displacement, beside the sliders of a contact element.

use serde::{Deserialize, Serialize};

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
