//! Setting of a run, as the recipe of the run states the setting. The setting determines the role of the run in a
//! study.

use serde_json::{Value, json};

use crate::recipe::{ElementStiffness, Recipe, UpdateCriterion};

/// Values of a scene that determine the role of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Setting {
    /// Scene without the keys that a study varies. The omitted keys are roughness, cap, update, harmonics, contact
    /// elements, algorithm, seed and output.
    pub base: String,
    /// Law of the contact elements in words, empty without contact elements.
    pub law: String,
    /// Seed of a generated surface.
    pub seed: Option<u64>,
    /// RMS height of a generated surface \[m\].
    pub rq: Option<f64>,
    /// Correlation lengths of the generated surface \[m\].
    pub correlation_length: Option<[f64; 2]>,
    /// Hardness limit \[Pa\].
    pub pressure_cap: Option<f64>,
    /// True for a sphere.
    pub sphere: bool,
    /// Criterion of the model update, in words.
    pub update: String,
    /// Threshold of the model update, if the criterion of the update is a change of stiffness.
    pub stiffness_change: Option<f64>,
    /// True if a structure vibrates.
    pub vibrates: bool,
    /// Harmonics of the response, as JSON.
    pub harmonics: String,
    /// True if the contact elements have individual stiffness.
    pub tangent: bool,
    /// Shorter side of the joint \[m\].
    pub side: Option<f64>,
    /// Side of the joint along x \[m\]. Half of the side along x is the lever of the moments.
    pub length: Option<f64>,
    /// Depth of an explicit wear step \[m\], `None` for other schemes.
    pub explicit: Option<f64>,
    /// Worn volume per energy \[m³/J\].
    pub coefficient: Option<f64>,
    /// Cycles that end the run.
    pub cycles: Option<u64>,
    /// Friction coefficient.
    pub friction_coefficient: Option<f64>,
    /// Static load \[N\].
    pub normal_load: f64,
    /// Poisson ratio, if both bodies have the same.
    pub poisson_ratio: Option<f64>,
    /// Dundurs' β of the bodies.
    pub dundurs_beta: f64,
    /// Tolerances of the normal and the tangential solves.
    pub tolerances: [f64; 2],
}

impl Setting {
    /// Returns the setting of a run, from its recipe and its canonical scene.
    pub fn of(recipe: &Recipe, scene: &Value) -> Setting {
        let (contact, elements) = (recipe.contact(), recipe.elements());
        let heights = recipe.surface().map(|surface| &surface.heights);
        let rq = heights.and_then(|heights| heights.rq());
        let correlation_length = heights.and_then(|heights| heights.correlation_length());
        let bodies = contact.map(|contact| contact.bodies);
        let same_ratio = bodies.filter(|b| b.lower.poisson_ratio == b.upper.poisson_ratio);
        let wear = recipe.wear.as_ref();
        let given_contact = elements.and_then(|elements| match elements.stiffness {
            ElementStiffness::Given { normal_load, .. } => {
                Some((Some(elements.friction_coefficient), normal_load))
            }
            ElementStiffness::Contact { .. } => None,
        });
        let load =
            contact.map(|contact| (contact.friction_coefficient, contact.conditions.normal_load));
        let load = load.or(given_contact);
        let size = recipe.surface().map(|surface| surface.size);
        Setting {
            base: base(scene),
            law: law(
                scene,
                contact.is_some_and(|contact| contact.pressing.is_some()),
            ),
            seed: scene["surface"]["seed"].as_u64(),
            side: size.map(|[x, y]| x.min(y)),
            length: size.map(|[x, _]| x),
            rq,
            correlation_length,
            pressure_cap: contact.and_then(|contact| contact.conditions.pressure_cap),
            sphere: heights.is_some_and(|heights| heights.sphere_radius().is_some()),
            update: match &scene["update"] {
                Value::Null => "never".to_owned(),
                update => update.to_string(),
            },
            stiffness_change: elements.and_then(|elements| match elements.update.criterion {
                UpdateCriterion::StiffnessChange { change, .. } => Some(change),
                _ => None,
            }),
            vibrates: recipe.structure.is_some(),
            harmonics: recipe
                .response
                .as_ref()
                .map_or_else(String::new, |r| json!(r.harmonics).to_string()),
            tangent: elements.is_some_and(|elements| elements.stiffness.is_tangent()),
            explicit: wear
                .filter(|w| w.scheme.is_explicit())
                .and_then(|w| w.depth_step),
            coefficient: wear.map(|wear| wear.coefficient),
            cycles: wear.and_then(|wear| wear.cycles),
            friction_coefficient: load.and_then(|(friction, _)| friction),
            normal_load: load.map_or(0.0, |(_, load)| load),
            poisson_ratio: same_ratio.map(|bodies| bodies.lower.poisson_ratio),
            dundurs_beta: bodies.map_or(0.0, |bodies| bodies.dundurs_beta()),
            tolerances: contact.map_or([0.0; 2], |contact| {
                [contact.tolerances.normal, contact.tolerances.tangential]
            }),
        }
    }
}

/// Returns the law of the contact elements: the stiffness kind, and the distribution of a stiffness of the whole joint.
///
/// The structure presses the joint only if the law is "sliders". Sliders of rigid punches are therefore another law.
fn law(scene: &Value, structure_presses: bool) -> String {
    if scene["dynamics"].is_null() {
        return String::new();
    }
    let word = |key: &str| scene["contact"][key].as_str().unwrap_or_default();
    match (word("stiffness"), word("distribution")) {
        (kind @ ("total" | "roughness"), shared) => format!("{kind}, {shared}"),
        ("sliders", _) if !structure_presses => "sliders, punch".to_owned(),
        (kind, _) => kind.to_owned(),
    }
}

fn base(scene: &Value) -> String {
    let mut base = scene.clone();
    for (section, key) in [
        ("surface", "rq"),
        ("surface", "seed"),
        ("contact", "pressure_cap"),
        ("contact", "stiffness"),
        ("contact", "distribution"),
        // The law of the contact elements has the pressing that takes effect.
        ("contact", "pressing"),
        ("dynamics", "harmonics"),
        // End of the run, and wear steps.
        ("wear", "cycles"),
        ("wear", "scheme"),
        ("wear", "tolerance"),
        ("wear", "depth_step"),
    ] {
        if let Some(section) = base.get_mut(section).and_then(Value::as_object_mut) {
            section.remove(key);
        }
    }
    if let Some(sections) = base.as_object_mut() {
        for section in ["update", "fidelity", "output"] {
            sections.remove(section);
        }
    }
    base.to_string()
}
