//! Westergaard's wavy surface on a flat.

use std::f64::consts::PI;

/// Surface with waves along x and constant along y, with the undeformed gap Δ(1 − cos(2πx/λ)), under a mean
/// pressure.
///
/// Δ is the amplitude: peak to valley is 2Δ, and the crest that touches first is at x = 0. Source: Johnson,
/// Contact Mechanics, §13.2. The slope of the gap is (4p*/E*) cos ψ √(sin²ψ − sin²ψₐ) with ψ = πx/λ. The gap is the
/// integral of the slope from the edge of contact. The mean gap is the mean of the gap over a wavelength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Westergaard {
    /// Wavelength λ \[m\].
    pub wavelength: f64,
    /// Amplitude Δ, half of peak to valley \[m\].
    pub amplitude: f64,
    /// Mean pressure p̄ over the wave \[Pa\].
    pub mean_pressure: f64,
    /// Effective modulus E* \[Pa\].
    pub effective_modulus: f64,
}

impl Westergaard {
    /// Returns the mean pressure p* = πE*Δ/λ at which the surfaces touch everywhere \[Pa\].
    pub fn full_contact_pressure(&self) -> f64 {
        PI * self.effective_modulus * self.amplitude / self.wavelength
    }

    /// Returns p̄/p*, at most 1.
    fn loading(&self) -> f64 {
        (self.mean_pressure / self.full_contact_pressure()).min(1.0)
    }

    /// Returns the half width of a contact strip, a = (λ/π) asin √(p̄/p*) \[m\]; λ/2 in full contact.
    pub fn half_width(&self) -> f64 {
        self.wavelength / PI * self.loading().sqrt().asin()
    }

    /// Returns the fraction of the area in contact, 2a/λ.
    pub fn area_fraction(&self) -> f64 {
        2.0 * self.half_width() / self.wavelength
    }

    /// Returns the pressure at `x` \[Pa\].
    pub fn pressure(&self, x: f64) -> f64 {
        let full = self.full_contact_pressure();
        let psi = PI * x / self.wavelength;
        if self.mean_pressure >= full {
            self.mean_pressure + full * (2.0 * psi).cos()
        } else {
            2.0 * full * psi.cos().abs() * (self.loading() - psi.sin().powi(2)).max(0.0).sqrt()
        }
    }

    /// Returns the gap between the deformed surfaces at `x` \[m\]; 0 in contact.
    pub fn gap(&self, x: f64) -> f64 {
        let sine = (PI * x / self.wavelength).sin().abs();
        let edge = self.loading().sqrt();
        if sine <= edge {
            return 0.0;
        }
        let root = (sine * sine - edge * edge).sqrt();
        let logarithm = if edge > 0.0 {
            edge * edge * (sine / edge).acosh()
        } else {
            0.0
        };
        2.0 * self.amplitude * (sine * root - logarithm)
    }

    /// Returns the mean gap over a wavelength \[m\]: Δ(1 − m + m ln m) with m = p̄/p*. The mean gap is Δ without load
    /// and 0 in full contact.
    pub fn mean_gap(&self) -> f64 {
        let m = self.loading();
        let entropy = if m > 0.0 { m * m.ln() } else { 0.0 };
        self.amplitude * (1.0 - m + entropy)
    }
}
