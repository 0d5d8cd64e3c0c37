//! Stability of an explicit wear step, estimated before a contact is computed.

use std::f64::consts::PI;

use crate::contact::cell_integrals;
use crate::recipe::Recipe;
use crate::wear::explicit;

/// Returns the explicit step depth of a recipe \[m\], and the largest stable step depth \[m\]. The largest stable step
/// depth applies to cells with the pressure `pressure` \[Pa\]. The step depth d is the wear of the fastest-wearing
/// cell, which has the pressure p. Every cell with the same slip path has N α µ·(slip path) = d/p. The explicit step is
/// stable if d/p is at most twice the smallest eigenvalue of the compliance. Returns `None` without an explicit step of
/// a given depth.
fn explicit_step(recipe: &Recipe, pressure: f64) -> Option<[f64; 2]> {
    let (wear, contact) = (recipe.wear.as_ref()?, recipe.contact()?);
    let depth_step = wear.depth_step.filter(|_| wear.scheme.is_explicit())?;
    let grid = recipe.surface()?.grid();
    let cell = cell_integrals(0.0, 0.0, grid.dx, grid.dy).inverse;
    let own = cell / (PI * contact.bodies.effective_modulus());
    Some([depth_step, explicit::largest_stable_depth(pressure, own)])
}

/// Warns of an explicit step that is unstable under the pressure cap. Other unstable steps can only be detected once
/// the pressures are known.
pub(super) fn warning(recipe: &Recipe) -> Option<String> {
    let cap = recipe.contact()?.conditions.pressure_cap?;
    let [depth_step, longest] = explicit_step(recipe, cap)?;
    (depth_step > longest).then(|| {
        format!(
            "wear.depth_step = {depth_step:e} m is unstable from the first step on: at most {longest:.2e} m is stable under contact.pressure_cap = {cap:e} Pa, and the contact area will be wrong; make wear.depth_step smaller or set wear.scheme to \"implicit\""
        )
    })
}

/// Warns of an explicit step that is unstable from the beginning or becomes unstable. `peak` is the largest pressure of
/// the unworn contact, `mean` the mean pressure of the worn contact \[Pa\].
pub fn unstable_explicit_step(recipe: &Recipe, peak: f64, mean: f64) -> Option<String> {
    let [depth_step, at_first] = explicit_step(recipe, peak)?;
    let [_, at_last] = explicit_step(recipe, mean)?;
    let choice = if depth_step > at_first {
        "unstable from the first step on"
    } else if depth_step > at_last {
        "stable at first, but unstable once wear has spread the load"
    } else {
        return None;
    };
    let turns = depth_step * peak / at_first;
    Some(format!(
        "wear.depth_step = {depth_step:e} m is {choice}: cells below {turns:.2e} Pa overshoot, lift off and come back, and the contact area will be wrong; at most {at_last:.2e} m is stable under the {mean:.2e} Pa mean pressure of the worn contact; make wear.depth_step smaller or set wear.scheme to \"implicit\""
    ))
}
