//! Upper bound of the amplitude of any steady motion, for any contact: damping takes no more power than the loads
//! supply.
//!
//! Over a period, the contact forces take energy from the structure or exchange no energy with it. Because contact
//! forces supply no energy, the mean power of the damping is at most the mean power of the loads. The powers are sums
//! over the harmonics of the velocity v and of the loads f: Σ v̄ᵀ C v ≤ Σ Re f̄ᵀ v. With y = C^½ v and g = C^-½ f, the
//! inequality of the powers becomes the ball |y − g/2| ≤ |g|/2. The velocity of a port b in the first harmonic, a ω =
//! |sᵀ y₁| with s = C^-½ b, is at most (|sᵀ g₁| + |s| |g|)/2. A single load F on the port b is a special case. The
//! bound of the amplitude a is then F/(c ω), the amplitude of a resonance with the damping c.
//!
//! The bound applies separately to each set of coordinates that exchanges no energy with other coordinates. A contact
//! without adhesion takes energy from the motion along its normal. The contact passes none of the normal energy to the
//! motion in the plane of the contact. Friction supplies no energy to the motion in the plane over a period, for any
//! change of the normal load. The contact supplies no energy to the motion in its plane. Only loads in the plane of the
//! contact supply energy to this motion.

use num_complex::Complex64;
use std::collections::BTreeMap;

use super::{Load, SecondOrder};
use crate::linalg::{RowMatrix, generalised_eigen};

/// Share of the largest damping rate below which a coordinate counts as undamped.
const UNDAMPED: f64 = 1e-12;
/// Share of a port along undamped coordinates that counts as rounding.
const ROUNDING: f64 = 1e-9;

impl SecondOrder {
    /// Returns for each coordinate whether the coordinate can exchange energy with the motion of `port`. Mass, damping
    /// and stiffness exchange energy between coordinates; a contact exchanges energy along its normal and in its plane.
    pub(super) fn exchanges_energy_with_port(&self, port: usize) -> Vec<bool> {
        let n = self.mass.rows();
        let moves = |port: usize, k: usize| self.basis.at(port, k) != 0.0;
        // Groups of ports that exchange energy with each other.
        let exchanges = (0..self.contact_dofs / 3).flat_map(|e| {
            let first = 3 * e;
            [vec![first, first + 1], vec![first + 2]]
        });
        let exchanges: Vec<Vec<usize>> = exchanges.collect();
        let mut shares: Vec<bool> = (0..n).map(|k| moves(port, k)).collect();
        loop {
            let shares_energy = |k: usize| {
                let matrices = [&self.mass, &self.damping, &self.hysteretic, &self.stiffness];
                let by_matrix = |i: usize| {
                    let linked = |m: &RowMatrix| m.at(i, k) != 0.0 || m.at(k, i) != 0.0;
                    shares[i] && matrices.into_iter().any(linked)
                };
                let by_contact = |ports: &Vec<usize>| {
                    let touches = |k: usize| ports.iter().any(|port| moves(*port, k));
                    touches(k) && (0..n).any(|i| shares[i] && touches(i))
                };
                shares[k] || (0..n).any(by_matrix) || exchanges.iter().any(by_contact)
            };
            let extended: Vec<bool> = (0..n).map(shares_energy).collect();
            if extended == shares {
                return shares;
            }
            shares = extended;
        }
    }
}

/// C^-½ f of forces f, by harmonic order.
type Forces = BTreeMap<u32, Vec<Complex64>>;

/// Coordinates that diagonalise the damping.
pub(super) struct DampingRates<'a> {
    model: &'a SecondOrder,
    /// Rates \[1/s\], ascending, and mass-normalised shapes, `coordinates × rates`.
    rates: Vec<f64>,
    shapes: RowMatrix,
}

impl DampingRates<'_> {
    pub(super) fn of(model: &SecondOrder) -> Option<DampingRates<'_>> {
        let is_hysteretic = model.hysteretic.values().iter().any(|h| *h != 0.0);
        if model.residual.is_some() || is_hysteretic {
            return None;
        }
        let (rates, shapes) = generalised_eigen(&model.damping, &model.mass).ok()?;
        Some(DampingRates {
            model,
            rates,
            shapes,
        })
    }

    /// Computes C^-½ b of a port b, or returns `None` if a part of the port is undamped.
    pub(super) fn scaled(&self, port: usize) -> Option<Vec<f64>> {
        let row = self.model.basis.row(port);
        let along = |r: usize| -> f64 {
            let each = row.iter().enumerate();
            each.map(|(i, b)| b * self.shapes.at(i, r)).sum()
        };
        let parts: Vec<f64> = (0..self.rates.len()).map(along).collect();
        let least = UNDAMPED * self.rates.last()?;
        let size = norm(parts.iter().copied());
        let each = parts.into_iter().zip(&self.rates);
        each.map(|(part, &rate)| match rate > least {
            true => Some(part / rate.sqrt()),
            false => (part.abs() <= ROUNDING * size).then_some(0.0),
        })
        .collect()
    }

    /// Computes C^-½ f of the loads that move coordinates of a set, times a power of their order.
    pub(super) fn forces(&self, loads: &[Load], power: i32, set: &[bool]) -> Option<Forces> {
        let mut forces = Forces::new();
        let moves = |load: &Load| {
            let mut row = self.model.basis.row(load.port).iter().zip(set);
            load.harmonic > 0 && row.any(|(share, is_in)| *is_in && *share != 0.0)
        };
        for load in loads.iter().filter(|load| moves(load)) {
            let sum = forces
                .entry(load.harmonic)
                .or_insert_with(|| vec![Complex64::ZERO; self.rates.len()]);
            let size = f64::from(load.harmonic).powi(power);
            let force = size * Complex64::new(load.cosine, -load.sine);
            for (sum, part) in sum.iter_mut().zip(self.scaled(load.port)?) {
                *sum += force * part;
            }
        }
        Some(forces)
    }
}

fn size(forces: &Forces) -> f64 {
    norm(forces.values().flatten().map(|f| f.norm()))
}

/// Returns the bound of the velocity of a port in the first harmonic \[m/s\].
pub(super) fn velocity_bound(port: &[f64], forces: &Forces) -> f64 {
    let along = forces.get(&1).map_or(0.0, |force| {
        let each = force.iter().zip(port);
        each.map(|(f, s)| f * s).sum::<Complex64>().norm()
    });
    (along + norm(port.iter().copied()) * size(forces)) / 2.0
}

fn norm(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|value| value * value).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::oscillator::{Oscillator, mass_on_springs};
    use super::{DampingRates, Load, velocity_bound};

    const DAMPING: [f64; 3] = [2.0, 5.0, 0.0];

    #[test]
    fn a_resonance_reaches_what_damping_allows() {
        let model = mass_on_springs([1.0, 3.0, 2.0], DAMPING, [1e4, 2e4, 3e4], 3).unwrap();
        let damping = DampingRates::of(&model).unwrap();
        let plane = model.exchanges_energy_with_port(0);
        assert_eq!(plane, [true, true, false]);
        let of = |loads: &[Load]| damping.forces(loads, 0, &plane).unwrap();
        let along_x = of(&[Oscillator::load(0, 8.0, 0.3)]);
        let port = damping.scaled(0).unwrap();
        // F/c.
        assert!((velocity_bound(&port, &along_x) / 4.0 - 1.0).abs() < 1e-12);
        // A second load can be out of phase and then supplies additional power.
        let mut loads = vec![Oscillator::load(0, 8.0, 0.3), Oscillator::load(1, 6.0, 1.2)];
        let both = of(&loads);
        assert!(velocity_bound(&port, &both) > 4.0);
        // A load along the normal supplies no power in the plane.
        loads.push(Oscillator::load(2, 100.0, 0.0));
        assert_eq!(of(&loads), both);
        assert!(damping.scaled(2).is_none(), "nothing damps the normal");
    }
}
