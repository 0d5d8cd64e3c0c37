//! One Jenkins element (a spring and a slider in series) under harmonic displacement.

use std::f64::consts::PI;

/// Spring of stiffness k in series with a slider of friction limit R, driven by u = U cos θ in steady state.
///
/// The force on the branch from the maximum down is max(−R, kU cos θ − kU + R), the other branch its image; sticking
/// throughout, it is kU cos θ. First harmonics after T. K. Caughey (J. Appl. Mech. 27, 1960, 640) for the bilinear element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jenkins {
    /// Spring stiffness k \[N/m\].
    pub stiffness: f64,
    /// Friction limit R = µN \[N\].
    pub limit: f64,
}

impl Jenkins {
    /// Whether it slips at the amplitude `amplitude` \[m\].
    pub fn slips(&self, amplitude: f64) -> bool {
        self.stiffness * amplitude > self.limit
    }

    /// Energy dissipated in one cycle, 4R (U − R/k) \[J\].
    pub fn dissipated_energy(&self, amplitude: f64) -> f64 {
        4.0 * self.limit * (amplitude - self.limit / self.stiffness).max(0.0)
    }

    /// Phase θ* after the maximum at which slip begins, cos θ* = 1 − 2R/kU; π if it never does.
    pub fn slip_phase(&self, amplitude: f64) -> f64 {
        if self.slips(amplitude) {
            (1.0 - 2.0 * self.limit / (self.stiffness * amplitude)).acos()
        } else {
            PI
        }
    }

    /// Force at the phase `theta` of the steady cycle \[N\].
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

    /// Half-range coefficients (cosine, sine) of harmonic `order` of the force \[N\]; zero for even orders.
    ///
    /// The sine of the first one is −E_d/πU: the force leads the displacement.
    pub fn coefficients(&self, amplitude: f64, order: u32) -> (f64, f64) {
        let peak = self.stiffness * amplitude;
        if order.is_multiple_of(2) {
            return (0.0, 0.0);
        }
        if !self.slips(amplitude) {
            return (if order == 1 { peak } else { 0.0 }, 0.0);
        }
        let (r, t, k) = (self.limit, self.slip_phase(amplitude), f64::from(order));
        // 2/π times the integral over the half cycle: stick in 0…t, slip at −R in t…π.
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
