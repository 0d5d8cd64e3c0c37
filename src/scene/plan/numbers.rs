//! Reasons for the numbers of a recipe that a preset affects.

use serde_json::json;

use crate::recipe::{Reasons, Recipe};
use crate::scene::Scene;
use crate::scene::keys::{cycles::*, fidelity::*};

/// Returns the reason of each number of a recipe that a preset affects, by its key. A number is given in the scene, or
/// follows from the requested tolerance or from the preset. The cycle itself records the reason for its marching.
pub(super) fn reasons(scene: &Scene, recipe: &Recipe) -> Reasons {
    let fidelity = &scene.fidelity;
    let load_steps = recipe.contact().and_then(|c| c.coupling.load_steps());
    let (cycle, wear) = (recipe.cycle().is_some(), recipe.wear.is_some());
    let has_shear = cycle || load_steps.is_some();
    let vibrates = recipe.response.is_some();
    let response = recipe.response.as_ref();
    let extended = response.is_some_and(|response| response.harmonic_tolerance.is_some());
    // Keys of a number, whether the recipe has the number, and whether it follows from a requested tolerance.
    let numbers: [(&[&str], bool, bool); 10] = [
        (&[NORMAL_TOLERANCE.name], recipe.contact().is_some(), true),
        (&[TANGENTIAL_TOLERANCE.name], has_shear, true),
        (&[LOAD_STEPS.name], load_steps.is_some(), false),
        (&[CYCLE_TOLERANCE.name], cycle, true),
        (&[STEPS_PER_CYCLE.name], cycle, true),
        (&[CYCLE_EXTRAPOLATION.name], cycle, false),
        (&[WEAR_STEP_TOLERANCE.name, WEAR_TOLERANCE.name], wear, true),
        (&[SCHEME.name], wear, false),
        (&[AFT_SAMPLES.name], vibrates, true),
        (&[HARMONIC_TOLERANCE.name], extended, true),
    ];
    let mut why = Reasons::default();
    for (keys, _, by_error) in numbers.into_iter().filter(|number| number.1) {
        let own = keys.iter().find(|name| scene.given_value(name).is_some());
        let reason = match (own, recipe.asked_error.filter(|_| by_error)) {
            (Some(own), _) => format!("{own} is given"),
            (None, Some(error)) => format!("fidelity.tolerance = {error}"),
            (None, None) => format!("fidelity.preset = {}", json!(fidelity.preset)),
        };
        why.add(keys[0], reason);
    }
    why
}
