//! Elastic constants of two half spaces in contact, as the closed forms combine them.

/// The two bodies in contact: isotropic, linear elastic half spaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bodies {
    /// Young's modulus of each body \[Pa\].
    pub youngs_modulus: [f64; 2],
    /// Poisson's ratio of each body.
    pub poisson_ratio: [f64; 2],
}

impl Bodies {
    /// Two bodies of one material.
    pub fn alike(youngs_modulus: f64, poisson_ratio: f64) -> Self {
        Bodies {
            youngs_modulus: [youngs_modulus; 2],
            poisson_ratio: [poisson_ratio; 2],
        }
    }

    fn sum(&self, term: impl Fn(f64, f64) -> f64) -> f64 {
        (0..2)
            .map(|body| {
                let nu = self.poisson_ratio[body];
                term(0.5 * self.youngs_modulus[body] / (1.0 + nu), nu)
            })
            .sum()
    }

    /// E* with 1/E* = Σ (1 − ν²)/E = Σ (1 − ν)/2G \[Pa\] (Johnson, Contact Mechanics, eq. 4.22).
    pub fn effective_modulus(&self) -> f64 {
        1.0 / self.sum(|shear, nu| 0.5 * (1.0 - nu) / shear)
    }

    /// G* with 1/G* = Σ (2 − ν)/G \[Pa\]: a circle of radius a that sticks has kt = 8 G* a (Johnson eq. 7.43).
    pub fn tangential_modulus(&self) -> f64 {
        1.0 / self.sum(|shear, nu| (2.0 - nu) / shear)
    }

    /// Σ ν/G \[1/Pa\]: the part of the shear compliance that depends on direction (it carries the cos 2θ terms).
    pub fn directional_compliance(&self) -> f64 {
        self.sum(|shear, nu| nu / shear)
    }
}
