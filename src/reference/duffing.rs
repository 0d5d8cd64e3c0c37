//! Duffing oscillator m ü + c u̇ + k u + κ u³ = F cos ωt, approximated by one harmonic.

/// Parameters of a Duffing oscillator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Duffing {
    /// Mass m \[kg\].
    pub mass: f64,
    /// Damping c \[N s/m\].
    pub damping: f64,
    /// Linear stiffness k \[N/m\].
    pub stiffness: f64,
    /// Cubic stiffness κ \[N/m³\].
    pub cubic: f64,
}

impl Duffing {
    /// Returns the backbone: the angular frequency of the phase resonance at `amplitude`, ω² = (k + ¾κU²)/m \[rad/s\].
    /// The backbone is the solution with one harmonic. The backbone is correct to second order in the amplitude
    /// (Nayfeh, Mook, Nonlinear Oscillations, §2.3.1).
    pub fn backbone(&self, amplitude: f64) -> f64 {
        ((self.stiffness + 0.75 * self.cubic * amplitude.powi(2)) / self.mass).sqrt()
    }

    /// Returns the amplitude of the force at which `amplitude` is the phase resonance, cωU \[N\].
    pub fn resonant_force(&self, amplitude: f64) -> f64 {
        self.damping * self.backbone(amplitude) * amplitude
    }

    /// Returns the amplitude of the force that gives the response `amplitude` at the angular frequency
    /// `omega` \[N\].
    pub fn force(&self, amplitude: f64, omega: f64) -> f64 {
        let restoring =
            self.stiffness + 0.75 * self.cubic * amplitude.powi(2) - self.mass * omega * omega;
        amplitude * restoring.hypot(self.damping * omega)
    }

    /// Returns the two angular frequencies with the response `amplitude` at the force `force`, below and
    /// above the backbone \[rad/s\]. Returns `None` if the force cannot reach that amplitude.
    pub fn frequencies(&self, amplitude: f64, force: f64) -> Option<(f64, f64)> {
        // Quadratic equation for ω².
        let ratio = self.damping / self.mass;
        let backbone = self.backbone(amplitude).powi(2);
        let half = backbone - 0.5 * ratio * ratio;
        let constant = backbone * backbone - (force / (self.mass * amplitude)).powi(2);
        let root = (half * half - constant).sqrt();
        let below = (half - root).sqrt();
        (root.is_finite() && below.is_finite()).then(|| (below, (half + root).sqrt()))
    }
}
