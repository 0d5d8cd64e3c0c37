//! Closed form of a wear law: independent springs that wear under a frozen slip.

/// Wearing spring of a Winkler bed. The pressure of the spring is p = k(δ − h₀ − h). The spring wears by dh/dn =
/// α·4µs·p per cycle.
///
/// 4µs·p is the energy per cycle and area under slip between ±s (two strokes of 2s each) [A eq. 2.6]. The wear of the
/// spring therefore obeys the energy wear law for one cell that does not interact with other cells. The closed form
/// shows the order of a time-stepping scheme. The closed form is valid while the spring stays in contact: a spring that
/// starts in contact stays in contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WinklerWear {
    /// Pressure per displacement k \[Pa/m\].
    pub stiffness: f64,
    /// Wear coefficient α \[m³/J\].
    pub coefficient: f64,
    /// Friction coefficient µ.
    pub friction_coefficient: f64,
    /// Half of the stroke s \[m\].
    pub slip: f64,
}

impl WinklerWear {
    /// Returns the cycles in which the pressure falls by a factor e: 1/(4αµsk).
    pub fn decay_cycles(&self) -> f64 {
        1.0 / (4.0 * self.coefficient * self.friction_coefficient * self.slip * self.stiffness)
    }

    /// Returns the pressure after `cycles` under a fixed approach \[Pa\].
    pub fn pressure_at_fixed_approach(&self, initial_pressure: f64, cycles: f64) -> f64 {
        initial_pressure * (-cycles / self.decay_cycles()).exp()
    }

    /// Returns the wear depth after `cycles` under a fixed approach \[m\]. The depth tends to the initial overlap p₀/k.
    pub fn depth_at_fixed_approach(&self, initial_pressure: f64, cycles: f64) -> f64 {
        -initial_pressure / self.stiffness * (-cycles / self.decay_cycles()).exp_m1()
    }

    /// Returns the pressure after `cycles` under a fixed load \[Pa\]. The deviation of the pressure from the mean
    /// pressure of the bed decays.
    pub fn pressure_at_fixed_load(
        &self,
        initial_pressure: f64,
        mean_pressure: f64,
        cycles: f64,
    ) -> f64 {
        mean_pressure + (initial_pressure - mean_pressure) * (-cycles / self.decay_cycles()).exp()
    }

    /// Returns the wear depth after `cycles` under a fixed load \[m\].
    pub fn depth_at_fixed_load(
        &self,
        initial_pressure: f64,
        mean_pressure: f64,
        cycles: f64,
    ) -> f64 {
        let steady = mean_pressure / self.stiffness * cycles / self.decay_cycles();
        steady + self.depth_at_fixed_approach(initial_pressure - mean_pressure, cycles)
    }
}
