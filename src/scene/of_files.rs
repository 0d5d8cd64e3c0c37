//! Conversion of a scene with a resonator into a scene whose structure is read from files.

use toml::{Table, Value};

use super::Scene;

impl Scene {
    /// Returns the text of the scene `self` with `keys` in place of the keys in `[structure]`. The function replaces
    /// each point of the scene by the nodes that `point` returns for the name of the point.
    pub fn reading_matrices(
        &self,
        keys: impl IntoIterator<Item = (&'static str, &'static str)>,
        point: impl Fn(&str) -> Option<String>,
    ) -> String {
        let mut table = self.document().clone();
        let entries = keys.into_iter();
        let structure: Table = entries
            .map(|(key, value)| (key.to_owned(), value.into()))
            .collect();
        table.insert("structure".to_owned(), structure.into());
        if let Some(joint) = table.get_mut("joint").and_then(Value::as_table_mut) {
            // The files define the contact elements and the hole of the joint.
            joint.remove("elements");
            joint.remove("hole");
        }
        let default_point = self
            .structure()
            .and_then(|structure| structure.points().first().copied());
        let name_point = |place: &mut Value, default_point: Option<&str>| {
            let Some(place) = place.as_table_mut() else {
                return;
            };
            let at = place.get("at").and_then(Value::as_str).or(default_point);
            if let Some(nodes) = at.and_then(&point) {
                place.insert("at".to_owned(), nodes.into());
            }
        };
        let dynamics = table.get_mut("dynamics").and_then(Value::as_table_mut);
        for (key, value) in dynamics.into_iter().flatten() {
            match (key.as_str(), value) {
                ("force", Value::Array(forces)) => {
                    forces
                        .iter_mut()
                        .for_each(|force| name_point(force, default_point));
                }
                ("force", force) => name_point(force, default_point),
                ("response", response) => name_point(response, None),
                _ => (),
            }
        }
        table.to_string()
    }
}
