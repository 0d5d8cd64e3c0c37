//! Wear law: the worn volume is proportional to the dissipated energy.
//!
//!
//! ```
//! use fretwear::wear::WearLaw;
//!
//! // 2000 µm³/J, over a million cycles of 0.1 mJ.
//! let law = WearLaw { coefficient: 2e-15 };
//! let volume = law.volume(1e6 * 1e-4);
//! assert!((volume / 2e-13 - 1.0).abs() < 1e-12);
//! assert!((law.energy(volume) / 100.0 - 1.0).abs() < 1e-12);
//! ```

/// Wear law by dissipated energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WearLaw {
    /// Worn volume per dissipated energy α \[m³/J\].
    pub coefficient: f64,
}

impl WearLaw {
    /// Returns the worn volume V = α E \[m³\] for a dissipated energy \[J\] [A eq. 2.5].
    pub fn volume(self, energy: f64) -> f64 {
        self.coefficient * energy
    }

    /// Returns the dissipated energy \[J\] for a worn volume \[m³\] [A eq. 2.5].
    pub fn energy(self, volume: f64) -> f64 {
        volume / self.coefficient
    }

    /// Returns the wear depth Δh = α ∫ q·ds \[m\] for an energy dissipated per area \[J/m²\] [A eq. 2.6].
    pub fn depth(self, energy: f64) -> f64 {
        self.coefficient * energy
    }

    /// Returns the wear depth \[m\] after `cycles` equal cycles, per energy that each dissipates per area
    /// \[m³/J\]: N α.
    pub fn over(self, cycles: u64) -> f64 {
        cycles as f64 * self.coefficient
    }
}
