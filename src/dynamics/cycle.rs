//! Loads, moments and relative displacements over the cycle of a converged response: per element and in total.

use super::contact_element::{ContactElement, ElementCycle};
use super::{HarmonicBalance, Response, Sampling};

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
    /// [`element_cycles`] of a response of this balance.
    pub fn element_cycles(&self, response: &Response, sampling: &Sampling) -> Vec<ElementCycle> {
        element_cycles(self.elements(), &response.displacement, sampling)
    }
}

/// The cycle of every element at the samples of `sampling`, which may be finer than those of the balance that gave the
/// displacement: three rows of coefficients an element, and what comes after them is not read \[m\].
pub fn element_cycles(
    elements: &[ContactElement],
    displacement: &[f64],
    sampling: &Sampling,
) -> Vec<ElementCycle> {
    let rows = displacement.chunks(3 * sampling.harmonics().coefficients());
    let pairs = elements.iter().zip(rows);
    pairs
        .map(|(element, row)| element.cycle(&sampling.synthesise(row)))
        .collect()
}

/// The cycle of the joint at the samples of `sampling`, with the elements at `positions` (x, y) \[m\]; arguments as of
/// [`element_cycles`].
pub fn joint_cycle(
    elements: &[ContactElement],
    displacement: &[f64],
    sampling: &Sampling,
    positions: &[[f64; 2]],
) -> JointCycle {
    let samples = sampling.samples();
    let area: f64 = elements.iter().map(|e| e.area).sum();
    // Elements without areas count alike.
    let weight = |element: &ContactElement| {
        if area > 0.0 {
            element.area / area
        } else {
            1.0 / elements.len() as f64
        }
    };
    let mut joint = JointCycle {
        displacement: vec![[0.0; 3]; samples],
        force: vec![[0.0; 3]; samples],
        moment: vec![[0.0; 3]; samples],
        dissipated_energy: 0.0,
    };
    let rows = displacement.chunks(3 * sampling.harmonics().coefficients());
    for ((element, row), [x, y]) in elements.iter().zip(rows).zip(positions) {
        let displacement = sampling.synthesise(row);
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
