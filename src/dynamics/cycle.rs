//! Loads, moments and relative displacements over the cycle of a converged response: per element and in total.

use super::contact_element::{ContactElement, ElementCycle};
use super::{HarmonicBalance, Response};

/// The whole joint at the samples of one cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct JointCycle {
    /// Area-weighted mean displacement of the elements, `[x, y, n]` \[m\].
    pub displacement: Vec<[f64; 3]>,
    /// Sum of `[T_x, T_y, N]` \[N\], N with the preload.
    pub force: Vec<[f64; 3]>,
    /// Sum of moments about the origin of the positions, `[Σ yN, −Σ xN, Σ (xT_y − yT_x)]` \[N m\].
    pub moment: Vec<[f64; 3]>,
    /// Energy dissipated in one cycle, from samples \[J\].
    pub dissipated_energy: f64,
}

impl HarmonicBalance<ContactElement> {
    /// The cycle of every element.
    pub fn element_cycles(&self, response: &Response) -> Vec<ElementCycle> {
        let width = 3 * self.harmonics().coefficients();
        let rows = response.displacement.chunks(width);
        let pairs = self.elements().iter().zip(rows);
        pairs
            .map(|(element, row)| element.cycle(&self.sampling().synthesise(row)))
            .collect()
    }

    /// The cycle of the joint, with the elements at `positions` (x, y) \[m\].
    pub fn joint_cycle(&self, response: &Response, positions: &[[f64; 2]]) -> JointCycle {
        let width = 3 * self.harmonics().coefficients();
        let samples = self.sampling().samples();
        let area: f64 = self.elements().iter().map(|e| e.area).sum();
        // Elements without areas count alike.
        let weight = |element: &ContactElement| {
            if area > 0.0 {
                element.area / area
            } else {
                1.0 / self.elements().len() as f64
            }
        };
        let mut joint = JointCycle {
            displacement: vec![[0.0; 3]; samples],
            force: vec![[0.0; 3]; samples],
            moment: vec![[0.0; 3]; samples],
            dissipated_energy: 0.0,
        };
        let rows = response.displacement.chunks(width);
        for ((element, row), [x, y]) in self.elements().iter().zip(rows).zip(positions) {
            let displacement = self.sampling().synthesise(row);
            let cycle = element.cycle(&displacement);
            joint.dissipated_energy += cycle.dissipated_energy;
            for j in 0..samples {
                let [tx, ty, n] = cycle.force[j];
                for d in 0..3 {
                    joint.displacement[j][d] += weight(element) * displacement[j][d];
                    joint.force[j][d] += cycle.force[j][d];
                }
                joint.moment[j][0] += y * n;
                joint.moment[j][1] -= x * n;
                joint.moment[j][2] += x * ty - y * tx;
            }
        }
        joint
    }
}
