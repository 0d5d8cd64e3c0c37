//! Description of a recipe: the included parts, the missing parts, and the reasons. Each part of the recipe writes its
//! own description.

use super::Recipe;
use super::cycle::CYCLE;
use super::decision::{Decision, Decisions};

/// Returns the decisions of a recipe, in the order of their stages.
pub fn decisions(recipe: &Recipe) -> Vec<Decision> {
    let mut decisions = Decisions::default();
    let elements = recipe.elements();
    if let (Some(surface), Some(contact)) = (recipe.surface(), recipe.contact()) {
        contact.explain(surface, &mut decisions);
        match recipe.cycle() {
            Some(cycle) => {
                cycle.explain(contact, &mut decisions);
                if let Some(fields) = &recipe.output.cycle_fields {
                    fields.explain(recipe, &mut decisions);
                }
            }
            None => decisions.add(CYCLE, "none", contact.why.of("cycle")),
        }
        match &recipe.wear {
            Some(wear) => wear.explain(&mut decisions),
            None => decisions.add("wear", "none", "no [wear]: a single pass"),
        }
    }
    let (Some(structure), Some(response)) = (&recipe.structure, &recipe.response) else {
        decisions.add(
            "structure, dynamic response, model update",
            "none",
            "no [structure] and [dynamics]",
        );
        return decisions.0;
    };
    structure.explain(&mut decisions);
    match elements {
        Some(elements) => elements.explain(&mut decisions),
        None => decisions.add("contact elements", "none", response.why.of("elements")),
    }
    response.explain(&mut decisions);
    if let Some(elements) = elements {
        elements.explain_stiffness(recipe.wear.is_some(), &mut decisions);
    }
    decisions.0
}
