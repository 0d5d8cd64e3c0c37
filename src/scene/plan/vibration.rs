//! The vibrating structure of a scene: what is decided about it.

use serde_json::json;

use crate::recipe::{self, ElementStiffness, Reasons};
use crate::scene::{Contact, DampingBasis, Dynamics, Scene, Stiffness};
use crate::structure::reduction::ContactPorts;

/// Contact elements of the structure.
pub(super) fn contact_elements(scene: &Scene) -> usize {
    let structure = scene.structure.as_ref().filter(|_| scene.contact.is_some());
    structure.map_or(0, |structure| {
        structure.contact_elements(contact_ports(scene))
    })
}

/// What the contact elements are: where each has a law of its own, pairs of nodes, between which cells move as the mesh does.
pub(super) fn contact_ports(scene: &Scene) -> ContactPorts {
    let rough = scene.contact.as_ref().filter(|_| scene.surface.is_some());
    match rough.map(|contact| contact.stiffness) {
        Some(Stiffness::Sliders) => ContactPorts::Nodes,
        _ => ContactPorts::Faces,
    }
}

/// The structure and its response; of none without vibration.
pub(super) fn decide(scene: &Scene) -> Option<(recipe::Structure, recipe::Response)> {
    let (structure, dynamics) = (scene.structure.as_ref()?, scene.dynamics.as_ref()?);
    let mut why = Reasons::default();
    why.add("source", structure.why());
    let structure = recipe::Structure {
        source: structure.clone(),
        modes: dynamics.modes,
        contact_ports: contact_ports(scene),
        why,
    };
    Some((structure, response(scene, dynamics)))
}

fn response(scene: &Scene, dynamics: &Dynamics) -> recipe::Response {
    let has_contact = contact_elements(scene) > 0;
    let mut why = Reasons::default();
    let structure = scene.structure.as_ref();
    let has_springs = structure.is_some_and(|structure| !structure.springs().is_empty());
    if !has_contact && !has_springs {
        why.add(
            "elements",
            "no [contact]: the joint is bonded, the response linear",
        );
    }
    why.add(
        "harmonics",
        match scene.fidelity.harmonic_tolerance {
            Some(_) => "no dynamics.harmonics; each extension takes some three times as long",
            None if has_contact || has_springs => {
                "not extended; what those left out would change is in dynamic_response"
            }
            None => "a linear response has no others than its forces",
        },
    );
    why.add(
        "damping_basis",
        match dynamics.damping_basis {
            DampingBasis::Stuck => "modes of the unworn contact stuck",
            DampingBasis::Free => "modes without contact springs",
        },
    );
    why.add(
        "points",
        "for the unworn joint, at output.response_at and at the end",
    );
    recipe::Response {
        forces: dynamics.forces.clone(),
        base: dynamics.base,
        at: dynamics.response.clone(),
        harmonics: dynamics.harmonics.clone(),
        harmonic_tolerance: scene.fidelity.harmonic_tolerance,
        samples: scene.fidelity.aft_samples,
        damping_ratio: dynamics.damping_ratio,
        rayleigh: dynamics.rayleigh,
        damping_basis: dynamics.damping_basis,
        frequency: dynamics.frequency,
        points: dynamics.points,
        why,
    }
}

/// The contact elements; none without structure or contact.
pub(super) fn elements(scene: &Scene) -> Option<recipe::Elements> {
    let (dynamics, contact) = (scene.dynamics.as_ref()?, scene.contact.as_ref()?);
    let mut why = Reasons::default();
    why.add(
        "friction_law",
        format!("dynamics.friction_law = {}", json!(dynamics.friction_law)),
    );
    let stiffness = stiffness(scene, contact, &mut why);
    let update = scene.update.unwrap_or_default();
    why.add(
        "update",
        match (&scene.wear, update.key()) {
            (None, _) => "no [wear]",
            (Some(_), None) => "no [update]: the joint keeps moving as the unworn one",
            (Some(_), Some(key)) => key,
        },
    );
    Some(recipe::Elements {
        count: contact_elements(scene),
        friction_coefficient: contact.friction_coefficient.unwrap_or(0.0),
        friction_law: dynamics.friction_law,
        stiffness,
        update,
        why,
    })
}

fn stiffness(scene: &Scene, contact: &Contact, why: &mut Reasons) -> ElementStiffness {
    if scene.surface.is_none() {
        why.add(
            "stiffness",
            "contact.kn and contact.kt in place of a surface",
        );
        let given = contact.given;
        return ElementStiffness::Given {
            kn: given.map_or(0.0, |given| given.kn),
            kt: given.map_or(0.0, |given| given.kt),
            gap: given.map_or(0.0, |given| given.gap),
            normal_load: contact.normal_load,
        };
    }
    why.add(
        "stiffness",
        match contact.stiffness {
            Stiffness::Total => "contact.stiffness = \"total\", as published",
            Stiffness::Roughness => {
                "contact.stiffness = \"roughness\": the structure has the bodies' compliance already"
            }
            Stiffness::Tangent => "contact.stiffness = \"tangent\"",
            Stiffness::Sliders => "contact.stiffness = \"sliders\"",
        },
    );
    ElementStiffness::Contact {
        stiffness: contact.stiffness,
        distribution: contact.distribution,
    }
}
