//! Scenes as plain values, to be hashed and compared.

use serde_json::Value;

use super::{Scene, keys};
use crate::json;

/// What does not influence a result: texts for people, and places of files whose content counts instead.
const LEFT_OUT: [(&str, &str); 4] = [
    ("", "title"),
    ("", "name"),
    ("surface", "path"),
    ("motion", "path"),
];

/// Fields of the resonator that follow from other sections. They are in the canonical form, so that its `structure` is complete
/// in itself, and they are no difference of their own.
pub const FOLLOWING_KEYS: [&str; 5] = [
    "structure.lap_length",
    "structure.arm_height",
    "structure.lap_cells",
    "structure.material.*",
    "structure.tied",
];

/// Whether something may be computed from a key of a canonical scene: some have their default also where what they are about is not there.
pub fn means_something(canonical: &Value, key: &str) -> bool {
    let is_there = |section: &&str| canonical.get(section).is_some_and(|s| !s.is_null());
    keys::find(key).is_none_or(|key| key.with.iter().all(is_there))
}

/// See [`Scene::canonical`].
pub(super) fn canonical(scene: &Scene) -> Value {
    let mut value = serde_json::to_value(scene)
        .expect("a scene consists of numbers, words and UTF-8 paths, which JSON can hold");
    for (section, key) in LEFT_OUT {
        let object = match section {
            "" => value.as_object_mut(),
            _ => value.get_mut(section).and_then(Value::as_object_mut),
        };
        if let Some(object) = object {
            object.remove(key);
        }
    }
    as_keys(&mut value);
    json::sorted(value)
}

/// Gives what a scene holds under other names the names of its keys, by which differences are told.
fn as_keys(scene: &mut Value) {
    let section = |scene: &mut Value, name: &str, inner: &str| {
        let section = scene.get_mut(name)?.as_object_mut()?;
        let found = section.remove(inner)?;
        Some((section.clone(), found))
    };
    for (name, inner) in [("structure", "geometry"), ("contact", "given")] {
        if let Some((mut outer, Value::Object(found))) = section(scene, name, inner) {
            outer.extend(found);
            scene[name] = Value::Object(outer);
        }
    }
    if let Some((mut outer, mut forces)) = section(scene, "dynamics", "forces") {
        let mut base = outer.remove("base");
        let places = forces.as_array_mut().into_iter().flatten();
        for place in places.chain(outer.get_mut("response")).chain(&mut base) {
            if let Some(place) = place.as_object_mut()
                && let Some(axis) = place.remove("axis").and_then(|axis| axis.as_u64())
            {
                let direction = ["x", "y", "z"].get(axis as usize).copied();
                place.insert("direction".to_owned(), direction.into());
            }
        }
        outer.insert("force".to_owned(), forces);
        outer.extend(base.map(|base| ("base".to_owned(), base)));
        scene["dynamics"] = Value::Object(outer);
    }
}
