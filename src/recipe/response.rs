//! Excitation of a structure, and the requested response.

use serde::{Deserialize, Serialize};

use super::decision::Decisions;
use super::{Reasons, Recipe};
use crate::dynamics::{Load, Rayleigh};

/// A point of a structure with a direction.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Port {
    /// Name of the point.
    pub at: String,
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
}

/// A force on a structure: `amplitude · cos(k ω t + phase)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Force {
    /// Half of the peak-to-peak range \[N\].
    pub amplitude: f64,
    /// Point and axis of the force.
    #[serde(flatten)]
    pub port: Port,
    /// Phase lead \[rad\].
    pub phase: f64,
    /// Harmonic number k; 0 for a constant force.
    pub harmonic: u32,
}

/// A motion of the ground: `amplitude · cos(k ω t + phase)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Base {
    /// Quantity that prescribes the motion of the base, with the amplitude of the quantity.
    #[serde(flatten)]
    pub motion: BaseMotion,
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Phase lead \[rad\].
    pub phase: f64,
    /// Harmonic number k, at least 1.
    pub harmonic: u32,
}

/// The prescribed quantity of the ground motion, with its amplitude.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BaseMotion {
    /// Acceleration \[m/s²\].
    Acceleration(f64),
    /// Displacement \[m\].
    Displacement(f64),
}

impl Base {
    /// Returns the load −m·a on a `mass` \[kg\] in the frame of the ground. A displacement u has the acceleration
    /// −(kω)²u. For a prescribed displacement, the function returns the factor m·u \[N s²\] of (kω)², for
    /// [`HarmonicBalance::with_inertial_loads`](crate::dynamics::HarmonicBalance::with_inertial_loads).
    pub fn load(&self, mass: f64) -> Load {
        let amplitude = match self.motion {
            BaseMotion::Acceleration(a) => -mass * a,
            BaseMotion::Displacement(u) => mass * u,
        };
        Load {
            port: self.axis,
            harmonic: self.harmonic,
            cosine: amplitude * self.phase.cos(),
            sine: -amplitude * self.phase.sin(),
        }
    }

    /// Returns the amplitude of the load of the base motion \[N\] on a `mass` \[kg\] at the fundamental `frequency`
    /// \[Hz\].
    pub fn force(&self, mass: f64, frequency: f64) -> f64 {
        mass * match self.motion {
            BaseMotion::Acceleration(a) => a,
            BaseMotion::Displacement(u) => {
                u * (std::f64::consts::TAU * f64::from(self.harmonic) * frequency).powi(2)
            }
        }
    }
}

/// The structure whose modes are damped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DampingBasis {
    /// The structure with the unworn contact closed and stuck.
    Stuck,
    /// The structure without contact springs.
    Free,
}

/// Excitation of a structure, and the requested response.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Response {
    /// Forces on the structure. The drive is the first force of harmonic 1 with the point and axis of the response. If
    /// no force has this point and axis, the drive is the first force. Without forces, the drive is the motion of the
    /// ground.
    pub forces: Vec<Force>,
    /// Motion of the ground of an oscillator; `None` if the ground is at rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base: Option<Base>,
    /// Port whose displacement is the response.
    pub at: Port,
    /// Harmonic numbers, including 0. With a `harmonic_tolerance`, the solver starts with the harmonics in this list
    /// and adds further harmonics.
    pub harmonics: Vec<u32>,
    /// Relative truncation error up to which the solver adds harmonics; `None` if the harmonics are fixed.
    pub harmonic_tolerance: Option<f64>,
    /// True if a response with about twice as many harmonics drives the wear.
    pub harmonic_correction: bool,
    /// Number of samples per vibration cycle at which contact elements are evaluated.
    pub samples: usize,
    /// Modal damping ratio.
    pub damping_ratio: f64,
    /// Loss factor of the structure.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub loss_factor: f64,
    /// Additional Rayleigh damping, proportional to mass and stiffness; `None` without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rayleigh: Option<Rayleigh>,
    /// The structure whose modes are damped.
    pub damping_basis: DampingBasis,
    /// Frequency of the response that drives the joint \[Hz\]; `None` for the phase resonance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_frequency: Option<f64>,
    /// Frequency range of the resonance search and of the forced response \[Hz\]. `None` if the scene prescribes the
    /// frequency and requests no forced response.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frequency: Option<[f64; 2]>,
    /// Number of equidistant points of the forced response; `None` for points chosen by continuation.
    pub points: Option<usize>,
    /// Reasons for the choices.
    pub why: Reasons,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde calls it")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl Recipe {
    /// Returns the ports of the vibration that are not contact ports; empty without vibration.
    pub fn points(&self) -> Vec<Port> {
        match (&self.structure, &self.response) {
            (Some(structure), Some(response)) => {
                structure.points(response, self.elements().is_some())
            }
            _ => Vec::new(),
        }
    }
}

impl Response {
    /// Returns the frequency range of the response \[Hz\]: the prescribed frequency, or the range of the resonance.
    pub fn frequencies_in_force(&self) -> Option<[f64; 2]> {
        self.at_frequency.map(|at| [at, at]).or(self.frequency)
    }

    /// Explains the harmonics, the damping and the excitation.
    pub(super) fn explain(&self, decisions: &mut Decisions) {
        let orders = &self.harmonics;
        let harmonics = match self.harmonic_tolerance {
            Some(tolerance) => format!(
                "after dynamic_response: from {orders:?} up to 31, until those left out change amplitude and dissipation by less than {tolerance}"
            ),
            None => format!("{orders:?}"),
        };
        decisions.add("harmonics", harmonics, self.why.of("harmonics"));
        if self.damping_ratio > 0.0 {
            let ratio = format!("ratio {} in every mode", self.damping_ratio);
            decisions.add("damping", ratio, self.why.of("damping_basis"));
        }
        if self.loss_factor > 0.0 {
            let factor = format!("{} of the stiffness", self.loss_factor);
            decisions.add("hysteretic damping", factor, "");
        }
        if let Some(Rayleigh { mass, stiffness }) = self.rayleigh {
            let matrix = format!("{mass} 1/s of the mass and {stiffness} s of the stiffness");
            decisions.add("Rayleigh damping", matrix, self.why.of("damping_basis"));
        }
        if let Some(base) = &self.base {
            let motion = match base.motion {
                BaseMotion::Acceleration(a) => format!("accelerates by {a} m/s²"),
                BaseMotion::Displacement(u) => format!("moves by {u} m"),
            };
            let along = ["x", "y", "z"][base.axis];
            let seen = "displacements are relative to it";
            decisions.add(
                "ground",
                format!("{motion} along {along}, half range"),
                seen,
            );
        }
        if let Some(frequency) = self.at_frequency {
            let at = format!("forced, at {frequency} Hz");
            decisions.add("response in force", at, "dynamics.at");
        }
        let points = match (self.frequency, self.points) {
            (None, _) => "none".to_owned(),
            (_, Some(points)) => format!("at {points} frequencies"),
            (_, None) => "at points chosen by continuation".to_owned(),
        };
        decisions.add("forced response", points, self.why.of("points"));
    }
}
