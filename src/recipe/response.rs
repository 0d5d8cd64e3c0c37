//! How a structure is made to vibrate, and what of its response is wanted.

use serde::{Deserialize, Serialize};

use super::decision::Decisions;
use super::{Reasons, Recipe};
use crate::dynamics::{Load, Rayleigh};

/// A point of a structure and a direction.
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
    /// Half range \[N\].
    pub amplitude: f64,
    /// Where it acts, and along which axis.
    #[serde(flatten)]
    pub port: Port,
    /// Lead \[rad\].
    pub phase: f64,
    /// k; 0 for a constant force.
    pub harmonic: u32,
}

/// A motion of the ground: `amplitude · cos(k ω t + phase)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Base {
    /// What moves as given, and its half range.
    #[serde(flatten)]
    pub motion: BaseMotion,
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Lead \[rad\].
    pub phase: f64,
    /// k, one or more.
    pub harmonic: u32,
}

/// What of the ground moves as given, with its half range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BaseMotion {
    /// Its acceleration \[m/s²\].
    Acceleration(f64),
    /// Its displacement \[m\].
    Displacement(f64),
}

impl Base {
    /// The load −m·a on a `mass` \[kg\] that is seen from the ground. For a displacement u, whose acceleration is −(kω)²u, it is the
    /// factor m·u \[N s²\] of (kω)², to be added by [`HarmonicBalance::with_inertial_loads`](crate::dynamics::HarmonicBalance::with_inertial_loads).
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

    /// Half range of that load \[N\] on a `mass` \[kg\] at a `frequency` of the fundamental \[Hz\].
    pub fn force(&self, mass: f64, frequency: f64) -> f64 {
        mass * match self.motion {
            BaseMotion::Acceleration(a) => a,
            BaseMotion::Displacement(u) => {
                u * (std::f64::consts::TAU * f64::from(self.harmonic) * frequency).powi(2)
            }
        }
    }
}

/// Of which structure the damped modes are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DampingBasis {
    /// The unworn contact closed and stuck.
    Stuck,
    /// Without contact springs.
    Free,
}

/// How a structure is made to vibrate, and what of its response is wanted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Response {
    /// The forces; the drive is the first of harmonic 1 at the response and along it, or the first of all where none is there. Without any, the ground is.
    pub forces: Vec<Force>,
    /// How the ground of an oscillator moves; none: it rests.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base: Option<Base>,
    /// Whose displacement is the response.
    pub at: Port,
    /// Orders of the harmonics, 0 among them: all, or those to begin with if there is a `harmonic_tolerance`.
    pub harmonics: Vec<u32>,
    /// Relative error by harmonics left out, up to which they are extended; none: they are not.
    pub harmonic_tolerance: Option<f64>,
    /// Whether the response with about twice as many drives the wear.
    pub harmonic_correction: bool,
    /// Samples of a vibration cycle at which contact elements are evaluated.
    pub samples: usize,
    /// Modal damping ratio.
    pub damping_ratio: f64,
    /// Loss factor of the structure.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub loss_factor: f64,
    /// Damping by mass and stiffness beside it; none: there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rayleigh: Option<Rayleigh>,
    /// Of which structure the damped modes are.
    pub damping_basis: DampingBasis,
    /// Frequency of the response that moves the joint \[Hz\]; none: that of the phase resonance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_frequency: Option<f64>,
    /// Range in which the resonance is looked for and the forced response is computed \[Hz\]; none with a given frequency, without a forced response.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frequency: Option<[f64; 2]>,
    /// Equidistant points of the forced response; none: as continuation places them.
    pub points: Option<usize>,
    /// The reasons.
    pub why: Reasons,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde calls it")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl Recipe {
    /// The ports of the vibration that are no contact ports; of none without vibration.
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
    /// The frequencies that the response in force may have \[Hz\]: the given one, or the range of the resonance.
    pub fn frequencies_in_force(&self) -> Option<[f64; 2]> {
        self.at_frequency.map(|at| [at, at]).or(self.frequency)
    }

    /// Says which harmonics there are.
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
            (_, None) => "as continuation places its points".to_owned(),
        };
        decisions.add("forced response", points, self.why.of("points"));
    }
}
