//! About how far each coordinate goes of a mass that bounces along its normal: that may be a thousandth of what it does along another axis, or a
//! thousand times as much, and an error of each coordinate is measured by its own motion.

use num_complex::Complex64;

use super::contact_element::ContactElement;
use super::vibration::Vibration;
use super::{HarmonicBalance, Load};

/// Least size of a coordinate across the normal, in parts of the largest: friction moves what no load does.
const LEAST: f64 = 1e-3;

impl Vibration {
    /// Sizes of the coordinates \[m\] at an angular frequency: `along` that of the `normal` one, and of the others what the loads move
    /// without contact, or with one that sticks.
    pub(super) fn coordinate_sizes(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        omega: f64,
        (normal, along): (usize, f64),
    ) -> Vec<f64> {
        let model = &self.model;
        let n = model.mass.rows();
        let mut sizes = vec![0.0_f64; n];
        for grips in [0.0, 1.0] {
            let mut stiffness = model.stiffness.clone();
            for (element, springs) in balance.reference.iter().enumerate() {
                for (d, spring) in springs[..2].iter().enumerate() {
                    let row = model.basis.row(3 * element + d);
                    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                        let closed = stiffness.at(i, j) + grips * spring * row[i] * row[j];
                        stiffness.set(i, j, closed);
                    }
                }
            }
            let of_both = [(&self.loads, 0), (&self.inertial_loads, 2)];
            let loads = of_both.into_iter().flat_map(|(loads, power)| {
                let grown = move |load: &Load| {
                    let rate = f64::from(load.harmonic) * omega;
                    (*load, rate, rate.powi(power))
                };
                loads.iter().map(grown)
            });
            for (load, rate, factor) in loads {
                let system = model.dynamic_stiffness(&stiffness, rate);
                let force = factor * load.cosine.hypot(load.sine);
                let port = model.basis.row(load.port).iter();
                let mut moved: Vec<Complex64> = port.map(|b| (force * b).into()).collect();
                // What nothing holds is moved without bound, and tells no size.
                let Ok(factors) = system.factorize() else {
                    continue;
                };
                factors.solve(&mut moved);
                for (size, moved) in sizes.iter_mut().zip(&moved) {
                    *size += if moved.is_finite() { moved.norm() } else { 0.0 };
                }
            }
        }
        sizes[normal] = 0.0;
        let largest = sizes.iter().fold(0.0, |a: f64, b| a.max(*b));
        let least = if largest > 0.0 {
            LEAST * largest
        } else {
            along
        };
        sizes.iter_mut().for_each(|size| *size = size.max(least));
        sizes[normal] = along;
        sizes
    }
}
