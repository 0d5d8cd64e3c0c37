//! A wear law with a closed form: independent springs that wear under a frozen slip.

/// A spring of a Winkler bed, pressure p = k(δ − h₀ − h), that wears by dh/dn = α·4µs·p per cycle.
///
/// 4µs·p is the energy of a cycle per unit of area under slip between ±s (two strokes of 2s each) [A eq. 2.6], so this is the
/// energy wear law with the coupling between cells taken out, and the order of a time-stepping scheme can be read off it.
/// It holds while the spring stays in contact, which it does when it starts so.
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
    /// Cycles in which pressure falls by a factor e: 1/(4αµsk).
    pub fn decay_cycles(&self) -> f64 {
        1.0 / (4.0 * self.coefficient * self.friction_coefficient * self.slip * self.stiffness)
    }

    /// Pressure after `cycles` under a fixed approach \[Pa\].
    pub fn pressure_at_fixed_approach(&self, initial_pressure: f64, cycles: f64) -> f64 {
        initial_pressure * (-cycles / self.decay_cycles()).exp()
    }

    /// Wear depth after `cycles` under a fixed approach \[m\]; tends to the initial overlap p₀/k.
    pub fn depth_at_fixed_approach(&self, initial_pressure: f64, cycles: f64) -> f64 {
        -initial_pressure / self.stiffness * (-cycles / self.decay_cycles()).exp_m1()
    }

    /// Pressure after `cycles` under a fixed load \[Pa\]: what departs from the bed's mean pressure decays.
    pub fn pressure_at_fixed_load(
        &self,
        initial_pressure: f64,
        mean_pressure: f64,
        cycles: f64,
    ) -> f64 {
        mean_pressure + (initial_pressure - mean_pressure) * (-cycles / self.decay_cycles()).exp()
    }

    /// Wear depth after `cycles` under a fixed load \[m\].
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
