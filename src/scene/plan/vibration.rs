//! The vibrating structure of a scene: what is decided about it.

use super::{Decisions, PlanError};
use crate::scene::{DampingBasis, FrictionLaw, Scene, Stiffness, Structure, Update};

/// Contact elements of the structure.
pub(super) fn contact_elements(scene: &Scene) -> usize {
    match (&scene.structure, &scene.contact) {
        (None, _) | (_, None) => 0,
        (Some(Structure::Oscillator { .. }), Some(_)) => 1,
        (Some(Structure::Resonator { geometry }), Some(_)) => geometry.contact_cells().len(),
    }
}

pub(super) fn decide(scene: &Scene, decisions: &mut Decisions) -> Result<(), PlanError> {
    let (Some(structure), Some(dynamics)) = (&scene.structure, &scene.dynamics) else {
        decisions.add(
            "structure, dynamic response, model update",
            "none",
            "no [structure] and [dynamics]",
        );
        return Ok(());
    };
    match structure {
        Structure::Resonator { .. } => decisions.add(
            "structure",
            format!(
                "resonator: {} elastic modes, and the static residual of all others",
                dynamics.modes
            ),
            "computed once and shared between runs by its content",
        ),
        Structure::Oscillator { .. } => decisions.add(
            "structure",
            "one mass, three degrees of freedom",
            "structure.kind = \"oscillator\"",
        ),
    }
    let elements = contact_elements(scene);
    match (&scene.contact, dynamics.friction_law) {
        (None, _) => decisions.add(
            "contact elements",
            "none",
            "no [contact]: the joint is bonded, the response linear",
        ),
        (Some(_), FrictionLaw::Cone) => decisions.add(
            "contact elements",
            format!("{elements}, three-dimensional, |T| <= mu N"),
            "dynamics.friction_law = \"cone\"",
        ),
        (Some(_), FrictionLaw::Box) => decisions.add(
            "contact elements",
            format!("{elements}, three-dimensional, |Tx| and |Ty| <= mu N each"),
            "dynamics.friction_law = \"box\"",
        ),
    }
    if elements > 0 {
        decisions.add(
            "unknowns of the harmonic balance",
            "after the linear response: those of contact elements that slip or open",
            "the others follow their springs, which is checked over the whole cycle",
        );
    }
    if dynamics.damping_ratio > 0.0 {
        decisions.add(
            "damping",
            format!("ratio {} in every mode", dynamics.damping_ratio),
            match dynamics.damping_basis {
                DampingBasis::Stuck => "modes of the unworn contact stuck",
                DampingBasis::Free => "modes without contact springs",
            },
        );
    }
    decisions.add(
        "forced response",
        match dynamics.points {
            Some(points) => format!("at {points} frequencies"),
            None => "as continuation places its points".to_owned(),
        },
        "for the unworn joint, at output.response_at and at the end",
    );
    let Some(contact) = &scene.contact else {
        return Ok(());
    };
    if scene.surface.is_none() {
        decisions.add(
            "contact stiffness",
            "given",
            "contact.kn and contact.kt in place of a surface",
        );
        return Ok(());
    }
    let (choice, why) = match contact.stiffness {
        Stiffness::Total => (
            "that of the whole rough patch",
            "contact.stiffness = \"total\", as published",
        ),
        Stiffness::Roughness => (
            "that of the rough patch without the smooth one's compliance",
            "contact.stiffness = \"roughness\": the structure has the bodies' compliance already",
        ),
        Stiffness::Tangent => (
            "each element its own tangent",
            "contact.stiffness = \"tangent\"",
        ),
    };
    decisions.add("contact stiffness", choice, why);
    match (&scene.wear, scene.update) {
        (None, _) => decisions.add("model update", "none", "no [wear]"),
        (Some(_), None) => decisions.add(
            "model update",
            "never",
            "no [update]: the joint keeps moving as the unworn one",
        ),
        (Some(_), Some(Update::StiffnessChange(change))) => decisions.add(
            "model update",
            format!("after static_contact: where kn or kt has changed by {change} since the last"),
            "update.stiffness_change",
        ),
        (Some(_), Some(Update::Iterations(every))) => decisions.add(
            "model update",
            format!("every {every} wear iterations"),
            "update.iterations",
        ),
        (Some(_), Some(Update::WearVolume(volume))) => decisions.add(
            "model update",
            format!("after wear: at every {volume:e} m^3"),
            "update.wear_volume",
        ),
    }
    Ok(())
}
