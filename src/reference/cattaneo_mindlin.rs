//! Cattaneo–Mindlin solution: a sphere under an oscillating tangential force.

use std::f64::consts::PI;

use super::{Hertz, elastic};
use crate::contact::Pair;

/// Hertz contact under constant normal load, with a tangential force along x up to µN.
///
/// Source: Johnson, Contact Mechanics, §7.2 and §7.4. Shear traction, force and displacement are positive along +x. The
/// displacement is the displacement of the pushed body relative to the opposite body. The slip is the displacement
/// minus the elastic displacement of the surfaces.
///
/// The solution is exact if the transverse traction is neglected. The superposition of two elliptical tractions
/// displaces the stick circle uniformly along x, for any ν. In the slip annulus, the tractions also displace points
/// along y, by about ν/(4 − 2ν) of the slip. The traction of this solution only opposes the x component of slip. A
/// friction law that aligns the traction with the slip vector deviates from this solution unless ν = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CattaneoMindlin {
    /// Radius of curvature of the sphere \[m\].
    pub radius: f64,
    /// Normal load N \[N\].
    pub load: f64,
    /// Friction coefficient µ.
    pub friction_coefficient: f64,
    /// Both bodies.
    pub pair: Pair,
}

impl CattaneoMindlin {
    /// Returns the normal contact.
    pub fn hertz(&self) -> Hertz {
        Hertz {
            radius: self.radius,
            load: self.load,
            effective_modulus: elastic::effective_modulus(&self.pair),
        }
    }

    /// Returns the force at which the whole contact slides, µN \[N\].
    pub fn sliding_force(&self) -> f64 {
        self.friction_coefficient * self.load
    }

    /// Returns the displacement at which the whole contact slides, 3µN/16aG* \[m\].
    pub fn sliding_displacement(&self) -> f64 {
        3.0 * self.sliding_force()
            / (16.0 * self.hertz().contact_radius() * elastic::tangential_modulus(&self.pair))
    }

    /// Returns the tangential stiffness in full stick, kt = 8G*a \[N/m\].
    pub fn tangential_stiffness(&self) -> f64 {
        8.0 * elastic::tangential_modulus(&self.pair) * self.hertz().contact_radius()
    }

    /// Returns the radius of the stick circle on first loading, c = a(1 − T/µN)^{1/3} \[m\]; 0 in full
    /// sliding.
    pub fn stick_radius(&self, force: f64) -> f64 {
        self.hertz().contact_radius() * (1.0 - force / self.sliding_force()).max(0.0).cbrt()
    }

    /// Returns the displacement under the first loading \[m\]: δ = δₛ(1 − (1 − T/µN)^{2/3}) (Johnson eq. 7.42). `force`
    /// is T, between 0 and µN.
    pub fn displacement(&self, force: f64) -> f64 {
        let remaining = (1.0 - force / self.sliding_force()).max(0.0).cbrt();
        self.sliding_displacement() * (1.0 - remaining * remaining)
    }

    /// Returns the force under a displacement ≥ 0 on first loading \[N\]: the inverse of
    /// [`Self::displacement`], and µN beyond δₛ.
    pub fn force(&self, displacement: f64) -> f64 {
        let remaining = (1.0 - displacement / self.sliding_displacement()).max(0.0);
        self.sliding_force() * (1.0 - remaining.powf(1.5))
    }

    /// Returns the shear traction along x at the radius `r` under the first loading by `force` \[Pa\]. The traction is
    /// µp(r) of the contact circle minus µp(r) of the stick circle.
    pub fn traction(&self, force: f64, r: f64) -> f64 {
        let hertz = self.hertz();
        let stick = self.stick_radius(force);
        let ratio = r / stick;
        let within = if stick > 0.0 && ratio < 1.0 {
            hertz.peak_pressure() * stick / hertz.contact_radius() * (1.0 - ratio * ratio).sqrt()
        } else {
            0.0
        };
        self.friction_coefficient * (hertz.pressure(r) - within)
    }

    /// Returns the slip along x of the point (x, y) under `force` on first loading \[m\]. The slip is 0 within the
    /// stick circle and positive in the annulus. Outside the contact, the slip is the relative motion of the two free
    /// surfaces.
    ///
    /// The function computes the displacement of the surfaces under elliptical tractions by Johnson's eq. 3.91, summed
    /// over both bodies.
    pub fn slip(&self, force: f64, x: f64, y: f64) -> f64 {
        let hertz = self.hertz();
        let (a, stick) = (hertz.contact_radius(), self.stick_radius(force));
        let peak = self.friction_coefficient * hertz.peak_pressure();
        if x.hypot(y) <= stick {
            return 0.0;
        }
        let mut elastic = self.elliptical_displacement(peak, a, x, y);
        if stick > 0.0 {
            elastic -= self.elliptical_displacement(peak * stick / a, stick, x, y);
        }
        self.displacement(force) - elastic
    }

    /// Returns the displacement of the point (x, y) along x, as the sum over both bodies \[m\]. The traction is
    /// `peak`·√(1 − r²/`radius`²) along x.
    pub fn elliptical_displacement(&self, peak: f64, radius: f64, x: f64, y: f64) -> f64 {
        let r_squared = x * x + y * y;
        let r = r_squared.sqrt();
        let isotropic = 1.0 / elastic::tangential_modulus(&self.pair);
        let directional = elastic::directional_compliance(&self.pair);
        let scale = peak / (8.0 * radius);
        if r <= radius {
            let square = radius * radius;
            scale
                * 0.25
                * PI
                * (2.0 * isotropic * (2.0 * square - r_squared) + directional * (x * x - y * y))
        } else {
            let s = radius / r;
            let (arc, root) = (s.asin(), (1.0 - s * s).sqrt());
            let lens = 2.0 * radius * radius - r_squared;
            let mean = lens * arc + radius * r * root;
            let lobed = (r_squared * arc + lens * root * s) * (x * x - y * y) / r_squared;
            scale * (isotropic * mean + 0.5 * directional * lobed)
        }
    }

    /// Returns the force on the closed loop between displacements ±`amplitude`, on the branch that returns
    /// from +`amplitude` \[N\].
    ///
    /// Masing's rule (Johnson §7.4): the branch is the first loading from the turning point, doubled in both
    /// directions.
    pub fn unloading_force(&self, amplitude: f64, displacement: f64) -> f64 {
        self.force(amplitude) - 2.0 * self.force(0.5 * (amplitude - displacement))
    }

    /// Returns the dissipated energy of a cycle between −`force` and `force` \[J\]. `force` is T, at most µN. The
    /// energy is the area of Masing's loop (Johnson §7.4). With x = T/µN, the area is (9µ²N²/10aG*)·{1 − (1 − x)^{5/3}
    /// − (5x/6)(1 + (1 − x)^{2/3})}.
    pub fn energy_per_cycle_at_force(&self, force: f64) -> f64 {
        let sliding = self.sliding_force();
        let x = (force / sliding).min(1.0);
        let remaining = (1.0 - x).cbrt();
        let square = remaining * remaining;
        let bracket = 1.0 - square * square * remaining - 5.0 / 6.0 * x * (1.0 + square);
        9.0 * sliding * sliding
            / (10.0 * self.hertz().contact_radius() * elastic::tangential_modulus(&self.pair))
            * bracket
    }

    /// Returns the energy dissipated per cycle between displacements ±`amplitude` \[J\]. Beyond δₛ, the energy grows by
    /// 4µN(amplitude − δₛ).
    pub fn energy_per_cycle(&self, amplitude: f64) -> f64 {
        let gross = (amplitude - self.sliding_displacement()).max(0.0);
        self.energy_per_cycle_at_force(self.force(amplitude)) + 4.0 * self.sliding_force() * gross
    }

    /// Returns the energy dissipated per cycle and area at (x, y) between ±`force` \[J/m²\]. The energy density is 4µp
    /// times the slip in the first loading. The factor is 4, because a cycle has two strokes. In each stroke, a point
    /// slips twice as far as in the first loading (Masing's rule).
    pub fn energy_density(&self, force: f64, x: f64, y: f64) -> f64 {
        4.0 * self.friction_coefficient * self.hertz().pressure(x.hypot(y)) * self.slip(force, x, y)
    }
}
