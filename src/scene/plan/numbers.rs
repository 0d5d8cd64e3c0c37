//! Where the numbers of a recipe come from that a preset has a say in.

use serde_json::json;

use crate::recipe::Reasons;
use crate::scene::Scene;
use crate::scene::keys::{self, AnyKey, Default, cycles::SCHEME, fidelity::*};

/// The reason of each number that a preset has a say in and that this scene uses, by its key.
pub(super) fn reasons(scene: &Scene) -> Reasons {
    let fidelity = &scene.fidelity;
    let given = |name: &str| {
        let path = name.split('.');
        let mut table = Some(scene.document());
        let mut found = None;
        for part in path {
            found = table.and_then(|table| table.get(part));
            table = found.and_then(|value| value.as_table());
        }
        found.is_some()
    };
    let by_error = |name: &str| {
        let alone = [
            CYCLE.name,
            CYCLE_EXTRAPOLATION.name,
            LOAD_STEPS.name,
            SCHEME.name,
        ];
        fidelity.tolerance.filter(|_| !alone.contains(&name))
    };
    let mut why = Reasons::default();
    let has_say = |key: &&AnyKey| matches!(key.default, Default::ByPreset(_));
    for key in keys::all()
        .filter(has_say)
        .filter(|key| is_used(scene, key.name))
    {
        let name = key.name;
        let own = [name, "wear.tolerance"];
        let own = &own[..if name == WEAR_TOLERANCE.name { 2 } else { 1 }];
        let reason = match (own.iter().find(|name| given(name)), by_error(name)) {
            (Some(given), _) => format!("{given} is given"),
            (None, Some(error)) => format!("fidelity.tolerance = {error}"),
            (None, None) => format!("fidelity.preset = {}", json!(fidelity.preset)),
        };
        why.add(name, reason);
    }
    why
}

fn is_used(scene: &Scene, name: &str) -> bool {
    let of_wear = [SCHEME.name, WEAR_TOLERANCE.name];
    let of_vibration = [AFT_SAMPLES.name, HARMONIC_TOLERANCE.name];
    match name {
        _ if of_wear.contains(&name) => scene.wear.is_some(),
        _ if of_vibration.contains(&name) => scene.dynamics.is_some(),
        _ => scene.surface.is_some(),
    }
}
