//! A mass on a spring, a dashpot and a Jenkins element: its backbone by the describing function.

use std::f64::consts::PI;

use super::Jenkins;

/// A mass m on a spring k and a dashpot c, with a Jenkins element beside them, which moves as u = U cos θ.
///
/// One harmonic is balanced, so that the element counts by its describing function: in phase with the displacement it is a spring of
/// stiffness F_c(U)/U, in phase with the velocity it takes E_d(U) a cycle, with [`Jenkins::coefficients`] and
/// [`Jenkins::dissipated_energy`] (T. K. Caughey, J. Appl. Mech. 27, 1960, 640). At the phase resonance the force F balances what is in
/// phase with the velocity, and inertia the rest: m ω² = k + F_c/U, F = c ω U + E_d/πU.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JenkinsOscillator {
    /// Mass m \[kg\].
    pub mass: f64,
    /// Dashpot c \[N s/m\].
    pub damping: f64,
    /// Spring k, without the element \[N/m\].
    pub stiffness: f64,
    /// The element.
    pub contact: Jenkins,
}

impl JenkinsOscillator {
    /// Angular frequency of the phase resonance at the amplitude `amplitude` \[m\], √((k + F_c/U)/m) \[rad/s\].
    pub fn backbone(&self, amplitude: f64) -> f64 {
        let (in_phase, _) = self.contact.coefficients(amplitude, 1);
        ((self.stiffness + in_phase / amplitude) / self.mass).sqrt()
    }

    /// Force at which that amplitude is the phase resonance, c ω U + E_d/πU \[N\]. Of friction alone it stays below 4R/π.
    pub fn resonant_force(&self, amplitude: f64) -> f64 {
        let viscous = self.damping * self.backbone(amplitude) * amplitude;
        viscous + self.contact.dissipated_energy(amplitude) / (PI * amplitude)
    }

    /// Damping ratio there: the energy of a cycle π F U over 4π times the kinetic energy ½ m ω² U², that is F/(2 m ω² U).
    pub fn damping_ratio(&self, amplitude: f64) -> f64 {
        let inertia = self.mass * self.backbone(amplitude).powi(2) * amplitude;
        self.resonant_force(amplitude) / (2.0 * inertia)
    }
}
