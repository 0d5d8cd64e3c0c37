//! Jenkins element (a spring and a slider in series) under harmonic displacement.

use std::f64::consts::PI;

/// Jenkins element: a spring of stiffness k in series with a slider of friction limit R. The displacement of the
/// element is u = U cos θ in steady state.
///
/// The force on the branch down from the maximum is max(−R, kU cos θ − kU + R). The branch up from the minimum is the
/// image of the branch down. If the element sticks throughout, the force is kU cos θ. First harmonics: T. K. Caughey
/// (J. Appl. Mech. 27, 1960, 640) for the bilinear element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jenkins {
    /// Spring stiffness k \[N/m\].
    pub stiffness: f64,
    /// Friction limit R = µN \[N\].
    pub limit: f64,
}

impl Jenkins {
    /// Returns true if the element slips at `amplitude` \[m\].
    pub fn slips(&self, amplitude: f64) -> bool {
        self.stiffness * amplitude > self.limit
    }

    /// Returns the energy dissipated per cycle, 4R (U − R/k) \[J\].
    pub fn dissipated_energy(&self, amplitude: f64) -> f64 {
        4.0 * self.limit * (amplitude - self.limit / self.stiffness).max(0.0)
    }

    /// Returns the phase θ* at which slip begins, measured from the maximum: cos θ* = 1 − 2R/kU. Returns π if the
    /// element never slips.
    pub fn slip_phase(&self, amplitude: f64) -> f64 {
        if self.slips(amplitude) {
            (1.0 - 2.0 * self.limit / (self.stiffness * amplitude)).acos()
        } else {
            PI
        }
    }

    /// Returns the force at the phase `theta` of the steady cycle \[N\].
    pub fn force(&self, amplitude: f64, theta: f64) -> f64 {
        let peak = self.stiffness * amplitude;
        if !self.slips(amplitude) {
            return peak * theta.cos();
        }
        let turns = theta / (2.0 * PI);
        let phase = 2.0 * PI * (turns - turns.floor());
        let branch = |phase: f64| (peak * (phase.cos() - 1.0) + self.limit).max(-self.limit);
        if phase <= PI {
            branch(phase)
        } else {
            -branch(phase - PI)
        }
    }

    /// Returns the half-range coefficients (cosine, sine) of the force's harmonic `order` \[N\]; zero for
    /// even orders.
    ///
    /// The sine of the first harmonic is −E_d/πU: the force leads the displacement.
    pub fn coefficients(&self, amplitude: f64, order: u32) -> (f64, f64) {
        let peak = self.stiffness * amplitude;
        if order.is_multiple_of(2) {
            return (0.0, 0.0);
        }
        if !self.slips(amplitude) {
            return (if order == 1 { peak } else { 0.0 }, 0.0);
        }
        let (r, t, k) = (self.limit, self.slip_phase(amplitude), f64::from(order));
        // 2/π times the integral over half a cycle: stick in 0…t, slip at −R in t…π.
        let (cosine_product, sine_product) = if order == 1 {
            (0.5 * t + 0.25 * (2.0 * t).sin(), 0.5 * t.sin().powi(2))
        } else {
            let (below, above) = (k - 1.0, k + 1.0);
            (
                0.5 * ((below * t).sin() / below + (above * t).sin() / above),
                0.5 * ((1.0 - (below * t).cos()) / below + (1.0 - (above * t).cos()) / above),
            )
        };
        let cosine = peak * cosine_product + (r - peak) * (k * t).sin() / k + r * (k * t).sin() / k;
        let sine = peak * sine_product + (r - peak) * (1.0 - (k * t).cos()) / k
            - r * ((k * t).cos() - (k * PI).cos()) / k;
        (2.0 / PI * cosine, 2.0 / PI * sine)
    }
}
