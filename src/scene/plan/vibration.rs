//! Planning of the vibrating structure.

use serde_json::json;

use crate::recipe::{self, ElementStiffness, Reasons, Recipe};
use crate::scene::{Contact, DampingBasis, Scene, Stiffness};

/// Number of contact elements of the structure.
fn contact_elements(scene: &Scene) -> usize {
    let structure = scene.recipe.structure.as_ref();
    let structure = structure.filter(|_| scene.contact.is_some());
    structure.map_or(0, |structure| {
        structure.source.contact_elements(structure.contact_ports)
    })
}

/// Adds the reasons to structure and response.
pub(super) fn explain(scene: &Scene, recipe: &mut Recipe) {
    let (Some(structure), Some(response)) = (&mut recipe.structure, &mut recipe.response) else {
        return;
    };
    structure.why.add("source", structure.source.why());
    let has_contact = contact_elements(scene) > 0;
    let has_springs = !structure.source.springs().is_empty();
    let why = &mut response.why;
    if !has_contact && !has_springs {
        why.add(
            "elements",
            "no [contact]: the joint is bonded, the response linear",
        );
    }
    why.add(
        "harmonics",
        match response.harmonic_tolerance {
            Some(_) => "no dynamics.harmonics; each extension takes some three times as long",
            None if has_contact || has_springs => {
                "not extended; what those left out would change is in dynamic_response"
            }
            None => "a linear response has no others than its forces",
        },
    );
    why.add(
        "damping_basis",
        match response.damping_basis {
            DampingBasis::Stuck => "modes of the unworn contact stuck",
            DampingBasis::Free => "modes without contact springs",
        },
    );
    why.add(
        "points",
        match response.frequency {
            Some(_) => "for the unworn joint, at output.response_at and at the end",
            None => "no dynamics.frequency",
        },
    );
}

/// Returns the contact elements, `None` without structure or contact.
pub(super) fn elements(scene: &Scene) -> Option<recipe::Elements> {
    let contact = scene.contact.as_ref();
    let contact = contact.filter(|_| scene.recipe.response.is_some())?;
    let mut why = Reasons::default();
    why.add(
        "friction_law",
        format!("dynamics.friction_law = {}", json!(scene.friction_law)),
    );
    why.add("stiffness", why_stiffness(contact));
    why.add(
        "update",
        match (&scene.recipe.wear, scene.update.criterion.key()) {
            (None, _) => "no [wear]",
            (Some(_), None) => "no [update]: the joint keeps moving as the unworn one",
            (Some(_), Some(key)) => key,
        },
    );
    Some(recipe::Elements {
        count: contact_elements(scene),
        friction_coefficient: contact.friction_coefficient.unwrap_or(0.0),
        friction_law: scene.friction_law,
        stiffness: contact.elements,
        table: contact.table.as_ref().and_then(|file| file.table.clone()),
        update: scene.update,
        why,
    })
}

fn why_stiffness(contact: &Contact) -> &'static str {
    let ElementStiffness::Contact { stiffness, .. } = contact.elements else {
        return match contact.table {
            Some(_) => "contact.elements in place of a surface",
            None => "contact.kn and contact.kt in place of a surface",
        };
    };
    match stiffness {
        Stiffness::Total => "contact.stiffness = \"total\", as published",
        Stiffness::Roughness => {
            "contact.stiffness = \"roughness\": the structure has the bodies' compliance already"
        }
        Stiffness::Tangent => "contact.stiffness = \"tangent\"",
        Stiffness::Sliders => "contact.stiffness = \"sliders\"",
    }
}
