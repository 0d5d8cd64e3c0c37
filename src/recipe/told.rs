//! A recipe in words: what will exist, what will not, and why. Each part of it says its own.

use super::Recipe;
use super::cycle::CYCLE;
use super::decision::{Decision, Told};

/// The decisions of a recipe, in the order of the stages that they are about.
pub fn told(recipe: &Recipe) -> Vec<Decision> {
    let mut told = Told::default();
    let elements = recipe.elements();
    if let (Some(surface), Some(contact)) = (recipe.surface(), recipe.contact()) {
        contact.tell(surface, &mut told);
        match recipe.cycle() {
            Some(cycle) => {
                cycle.tell(contact, &mut told);
                if let Some(fields) = &recipe.output.cycle_fields {
                    fields.tell(recipe, &mut told);
                }
            }
            None => told.add(CYCLE, "none", contact.why.of("cycle")),
        }
        match &recipe.wear {
            Some(wear) => wear.tell(&mut told),
            None => told.add("wear", "none", "no [wear]: a single pass"),
        }
    }
    let (Some(structure), Some(response)) = (&recipe.structure, &recipe.response) else {
        told.add(
            "structure, dynamic response, model update",
            "none",
            "no [structure] and [dynamics]",
        );
        return told.0;
    };
    structure.tell(&mut told);
    match elements {
        Some(elements) => elements.tell(&mut told),
        None => told.add("contact elements", "none", response.why.of("elements")),
    }
    response.tell(&mut told);
    if let Some(elements) = elements {
        elements.tell_stiffness(recipe.wear.is_some(), &mut told);
    }
    told.0
}
