//! Hertz contact of a sphere and a flat.

use std::f64::consts::PI;

/// Paraboloid with radius of curvature R, height −r²/2R, pressed on a flat without friction.
///
/// Source: K. L. Johnson, Contact Mechanics (1985), §3.4 and §4.2. The approach is measured from the first
/// touch of the apex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hertz {
    /// Radius of curvature R at the apex \[m\].
    pub radius: f64,
    /// Normal load N \[N\].
    pub load: f64,
    /// Effective modulus E* \[Pa\].
    pub effective_modulus: f64,
}

impl Hertz {
    /// Returns the contact radius a = (3NR/4E*)^{1/3} \[m\].
    pub fn contact_radius(&self) -> f64 {
        (0.75 * self.load * self.radius / self.effective_modulus).cbrt()
    }

    /// Returns the contact area πa² \[m²\].
    pub fn contact_area(&self) -> f64 {
        PI * self.contact_radius().powi(2)
    }

    /// Returns the approach of points far from the contact, δ = a²/R \[m\].
    pub fn approach(&self) -> f64 {
        self.contact_radius().powi(2) / self.radius
    }

    /// Returns the largest pressure p₀ = 3N/2πa² \[Pa\].
    pub fn peak_pressure(&self) -> f64 {
        1.5 * self.load / self.contact_area()
    }

    /// Returns the pressure at distance `r` from the axis, p₀√(1 − r²/a²) within the contact and 0 outside
    /// \[Pa\].
    pub fn pressure(&self, r: f64) -> f64 {
        let ratio = r / self.contact_radius();
        self.peak_pressure() * (1.0 - ratio * ratio).max(0.0).sqrt()
    }

    /// Returns the sum of both bodies' surface displacements, positive into the bodies \[m\] (Johnson eq.
    /// 3.41a and 3.42a).
    pub fn displacement(&self, r: f64) -> f64 {
        let a = self.contact_radius();
        let scale = self.peak_pressure() / (2.0 * a * self.effective_modulus);
        if r <= a {
            scale * 0.5 * PI * (2.0 * a * a - r * r)
        } else {
            let s = a / r;
            scale * ((2.0 * a * a - r * r) * s.asin() + a * r * (1.0 - s * s).sqrt())
        }
    }

    /// Returns the gap between the deformed surfaces \[m\]: 0 within the contact, positive outside.
    pub fn gap(&self, r: f64) -> f64 {
        if r <= self.contact_radius() {
            0.0
        } else {
            0.5 * r * r / self.radius - self.approach() + self.displacement(r)
        }
    }

    /// Returns the normal stiffness kn = dN/dδ = 2E*a \[N/m\].
    pub fn normal_stiffness(&self) -> f64 {
        2.0 * self.effective_modulus * self.contact_radius()
    }

    /// Returns the load between a paraboloid and a half space \[N\]: N = (4/3) E* √R δ^{3/2}. `radius` is the tip
    /// radius R \[m\], and `approach` is the approach δ \[m\].
    pub fn load_at(radius: f64, effective_modulus: f64, approach: f64) -> f64 {
        4.0 / 3.0 * effective_modulus * radius.sqrt() * approach.powf(1.5)
    }
}
