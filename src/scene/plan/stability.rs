//! Whether the explicit wear step of a scene is stable, as far as that is known before a run.
//!
//! A step of depth d, reached by the cell that wears fastest under its pressure p, makes N α µ·(slip path) = d/p on every cell
//! that slips as far: more than twice the smallest eigenvalue of the compliance if d > 2 λ_min p. The pressure falls while
//! wear spreads the load, so that a step which is stable at first need not stay so.

use super::before::Before;
use super::course::Course;
use crate::recipe::Decision;
use crate::scene::{Scheme, Surface, Wear};
use crate::wear::explicit;

/// What wears, and how it is expected to.
pub(super) struct Wearing<'a> {
    pub wear: &'a Wear,
    pub surface: &'a Surface,
    pub cap: Option<f64>,
    pub before: Before,
    pub course: Course,
}

/// What is decided about the explicit step, if there is one, and the warning where it is not stable.
pub(super) fn decide(wearing: &Wearing) -> Option<(Decision, Option<String>)> {
    let (Scheme::Explicit, Some(depth_step)) = (wearing.wear.scheme, wearing.wear.depth_step)
    else {
        return None;
    };
    let before = &wearing.before;
    let worn = (before.nominal / wearing.course.area).min(before.peak);
    let limit = |pressure| explicit::largest_stable_depth(pressure, before.self_compliance);
    let (first, last) = (limit(before.peak), limit(worn));
    let choice = if depth_step > first {
        "beyond stability from the first step on"
    } else if depth_step > last {
        "stable at first, beyond stability once wear has spread the load"
    } else {
        "stable"
    };
    let source = match (wearing.cap, wearing.surface) {
        (Some(cap), _) if cap <= before.peak => "contact.pressure_cap",
        (_, Surface::Sphere { .. }) => "Hertz",
        (_, Surface::Flat) => "the edge of a flat punch, some five times the mean",
        _ => "a rough contact, E* times rms slope",
    };
    let turns = depth_step / limit(1.0);
    let decision = Decision {
        what: "stability of the explicit step".to_owned(),
        choice: choice.to_owned(),
        why: format!(
            "stable up to wear.depth_step = {first:.2e} m at the largest unworn pressure of {:.2e} Pa ({source}), and up to {last:.2e} m at the {worn:.2e} Pa that the worn contact bears in the mean: {depth_step:e} m needs {turns:.2e} Pa on the cells that wear fastest",
            before.peak
        ),
    };
    let warning = (depth_step > last).then(|| {
        format!(
            "wear.depth_step = {depth_step:e} m is {choice}: cells below {turns:.2e} Pa overshoot, lift off and come back, and the contact area will be wrong; at most {last:.2e} m is stable throughout; make wear.depth_step smaller or wear.scheme \"implicit\""
        )
    });
    Some((decision, warning))
}
