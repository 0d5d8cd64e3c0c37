//! Whether the explicit wear step of a scene is stable under the pressures that were rehearsed: they fall while wear spreads the load, so
//! that a step which is stable at first need not stay so.

use super::rehearsed_run::RehearsedRun;
use crate::recipe::Recipe;
use crate::scene::plan::explicit_step;

/// What to say of an explicit step that is, or becomes, unstable on the cells of the scene.
pub(super) fn warning(recipe: &Recipe, course: &RehearsedRun) -> Option<String> {
    let (unworn, worn) = (course.iterations.first()?, course.iterations.last()?);
    let (peak, mean) = (
        unworn.peak_pressure,
        worn.mean_pressure.min(unworn.peak_pressure),
    );
    let [depth_step, at_first] = explicit_step(recipe, peak)?;
    let [_, at_last] = explicit_step(recipe, mean)?;
    let choice = if depth_step > at_first {
        "beyond stability from the first step on"
    } else if depth_step > at_last {
        "stable at first, beyond stability once wear has spread the load"
    } else {
        return None;
    };
    let turns = depth_step * peak / at_first;
    Some(format!(
        "wear.depth_step = {depth_step:e} m is {choice}: cells below {turns:.2e} Pa overshoot, lift off and come back, and the contact area will be wrong; at most {at_last:.2e} m is stable under the {mean:.2e} Pa that the worn contact bears in the mean; make wear.depth_step smaller or wear.scheme \"implicit\""
    ))
}
