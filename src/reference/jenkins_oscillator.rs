//! Backbone of an oscillator with a Jenkins element, from the describing function of the element.

use std::f64::consts::PI;

use super::Jenkins;

/// Mass m on a spring k, a dashpot c and a Jenkins element in parallel. The displacement of the mass is u = U cos θ.
///
/// One harmonic is balanced, so that the describing function represents the element. In phase with the displacement,
/// the element is a spring of stiffness F_c(U)/U. In phase with the velocity, the force of the element dissipates
/// E_d(U) per cycle. See [`Jenkins::coefficients`] and [`Jenkins::dissipated_energy`] (T. K. Caughey, J. Appl. Mech.
/// 27, 1960, 640). At the phase resonance, the force F balances the forces in phase with the velocity: F = c ω U +
/// E_d/πU. The inertia balances the forces in phase with the displacement: m ω² = k + F_c/U.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JenkinsOscillator {
    /// Mass m \[kg\].
    pub mass: f64,
    /// Dashpot c \[N s/m\].
    pub damping: f64,
    /// Spring k, without the element \[N/m\].
    pub stiffness: f64,
    /// Jenkins element.
    pub contact: Jenkins,
}

impl JenkinsOscillator {
    /// Returns the angular frequency of the phase resonance at `amplitude` \[m\], √((k + F_c/U)/m) \[rad/s\].
    pub fn backbone(&self, amplitude: f64) -> f64 {
        let (in_phase, _) = self.contact.coefficients(amplitude, 1);
        ((self.stiffness + in_phase / amplitude) / self.mass).sqrt()
    }

    /// Returns the force at which `amplitude` is the phase resonance, c ω U + E_d/πU \[N\]. Without the dashpot, the
    /// force is below 4R/π.
    pub fn resonant_force(&self, amplitude: f64) -> f64 {
        let viscous = self.damping * self.backbone(amplitude) * amplitude;
        viscous + self.contact.dissipated_energy(amplitude) / (PI * amplitude)
    }

    /// Returns the damping ratio at the phase resonance with `amplitude`, F/(2 m ω² U). The damping ratio is the energy
    /// per cycle π F U divided by 4π times the kinetic energy ½ m ω² U².
    pub fn damping_ratio(&self, amplitude: f64) -> f64 {
        let inertia = self.mass * self.backbone(amplitude).powi(2) * amplitude;
        self.resonant_force(amplitude) / (2.0 * inertia)
    }
}
