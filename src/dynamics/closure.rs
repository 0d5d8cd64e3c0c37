//! What is lost where one mean displacement and the total load stand for those of many elements: the closures under which a
//! vibration drives a rough contact.

use super::Sampling;
use super::contact_element::{ContactElement, ElementCycle, ElementState};
use super::cycle::JointCycle;
use super::slider::Slider;

/// Energies of a cycle of the joint with and without the closures.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ClosureEnergy {
    /// What friction would dissipate in one element with the stiffness of all loaded ones, under the mean displacement of all and
    /// the total load \[J\].
    pub mean_motion: f64,
    /// What the closures may make wrong \[J\]: the larger of two differences. One is of the energy that the elements dissipate as
    /// they are to that of the mean motion. It is without meaning where elastic displacement is shared by the elements, as in a half
    /// space, rather than their own; so the other is of the work of friction if every element that slips or opens slid by
    /// all of its own displacement, to that by the mean one under its part of the total load.
    pub error: f64,
}

impl ClosureEnergy {
    /// Of `elements` under the coefficients of their displacement, as [`super::cycle::element_cycles`] takes them; `joint` is their cycle.
    pub fn new(
        elements: &[ContactElement],
        displacement: &[f64],
        sampling: &Sampling,
        joint: &JointCycle,
    ) -> Self {
        let width = 3 * sampling.harmonics().coefficients();
        let moved: Vec<Vec<[f64; 3]>> = displacement
            .chunks(width)
            .take(elements.len())
            .map(|row| sampling.synthesise(row))
            .collect();
        let pairs = elements.iter().zip(&moved);
        let cycles: Vec<ElementCycle> = pairs.map(|(e, u)| e.cycle(u)).collect();
        let loaded: Vec<usize> = (0..elements.len())
            .filter(|&e| elements[e].normal_load() > 0.0)
            .collect();
        if loaded.is_empty() {
            return ClosureEnergy::default();
        }
        let whole = joined(loaded.iter().map(|&e| &elements[e]));
        let load = whole.normal_load();
        // The normal displacement that gives the total load: its mean over the area is that of elements which open, too.
        let mean: Vec<[f64; 3]> = joint
            .displacement
            .iter()
            .zip(&joint.force)
            .map(|(u, force)| [u[0], u[1], whole.displacement_under(force[2])])
            .collect();
        let together = whole.cycle(&mean);
        let apart: f64 = cycles.iter().map(|c| c.dissipated_energy).sum();
        let slid: f64 = loaded
            .iter()
            .filter(|&&e| cycles[e].state != ElementState::Stick)
            .map(|&e| {
                let part = elements[e].normal_load() / load;
                let own = friction_work(&moved[e], |j| cycles[e].force[j][2]);
                let closed = friction_work(&mean, |j| part * together.force[j][2]);
                elements[e].friction_coefficient * (own - closed)
            })
            .sum();
        ClosureEnergy {
            mean_motion: together.dissipated_energy,
            error: (apart - together.dissipated_energy).abs().max(slid.abs()),
        }
    }
}

/// Elements that move alike, with at least one among them, as one of the friction of the first: sliders of the same number are one.
fn joined<'a>(elements: impl Iterator<Item = &'a ContactElement> + Clone) -> ContactElement {
    let first = elements.clone().next().expect("an element");
    let number = elements.clone().map(|e| e.sliders.len()).max();
    let slider = |k: usize| {
        let alike = elements.clone().filter_map(move |e| e.sliders.get(k));
        let sum = |of: fn(&Slider) -> f64| -> f64 { alike.clone().map(of).sum() };
        let normal_stiffness = sum(|s| s.normal_stiffness);
        let lost = sum(|s| s.normal_stiffness * s.gap);
        Slider {
            normal_load: sum(|s| s.normal_load),
            gap: match normal_stiffness {
                0.0 => 0.0,
                kn => lost / kn,
            },
            tangential_stiffness: sum(|s| s.tangential_stiffness),
            normal_stiffness,
        }
    };
    ContactElement {
        area: elements.clone().map(|e| e.area).sum(),
        friction_coefficient: first.friction_coefficient,
        law: first.law,
        sliders: (0..number.unwrap_or(0)).map(slider).collect(),
    }
}

/// ∮ N |du| over the samples of a cycle \[J\].
fn friction_work(displacement: &[[f64; 3]], load: impl Fn(usize) -> f64) -> f64 {
    let samples = displacement.len();
    (0..samples)
        .map(|j| {
            let before = (j + samples - 1) % samples;
            let path = (displacement[j][0] - displacement[before][0])
                .hypot(displacement[j][1] - displacement[before][1]);
            0.5 * (load(j) + load(before)) * path
        })
        .sum()
}
