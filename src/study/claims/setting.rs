//! Which part a run plays, by its recipe.

use serde_json::{Value, json};

use crate::recipe::{ElementStiffness, Recipe, UpdateCriterion};

/// What of a scene decides which part a run plays.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Setting {
    /// The scene without what a study varies: roughness, cap, update, harmonics, contact elements, algorithm, seed, output.
    pub base: String,
    /// Which law contact elements have, in words; empty without them.
    pub law: String,
    /// Seed of the surface, where it is generated.
    pub seed: Option<u64>,
    /// RMS height of a generated surface \[m\].
    pub rq: Option<f64>,
    /// Its correlation lengths \[m\].
    pub correlation_length: Option<[f64; 2]>,
    /// Hardness limit \[Pa\].
    pub pressure_cap: Option<f64>,
    /// True for a sphere.
    pub sphere: bool,
    /// Criterion of the model update, in words.
    pub update: String,
    /// That criterion, where it is a change of stiffness.
    pub stiffness_change: Option<f64>,
    /// True if a structure vibrates.
    pub vibrates: bool,
    /// Harmonics of the response, as JSON.
    pub harmonics: String,
    /// True if each contact element has a stiffness of its own.
    pub tangent: bool,
    /// Shorter side of the joint \[m\].
    pub side: Option<f64>,
    /// Side along x, whose half is the lever of moments \[m\].
    pub length: Option<f64>,
    /// Depth of an explicit wear step \[m\]; none for other schemes.
    pub explicit: Option<f64>,
    /// Worn volume per energy \[m³/J\].
    pub coefficient: Option<f64>,
    /// Cycles that end the run.
    pub cycles: Option<u64>,
    /// Friction coefficient.
    pub friction_coefficient: Option<f64>,
    /// Static load \[N\].
    pub normal_load: f64,
    /// Poisson ratio, where it is that of both bodies.
    pub poisson_ratio: Option<f64>,
    /// Dundurs' β of the bodies.
    pub dundurs_beta: f64,
    /// Tolerances of the normal and the tangential solves.
    pub tolerances: [f64; 2],
}

impl Setting {
    /// That of a run, by its recipe and by the scene as the run is known by it.
    pub fn of(recipe: &Recipe, scene: &Value) -> Setting {
        let (contact, elements) = (recipe.contact(), recipe.elements());
        let heights = recipe.surface().map(|surface| &surface.heights);
        let rq = heights.and_then(|heights| heights.rq());
        let correlation_length = heights.and_then(|heights| heights.correlation_length());
        let bodies = contact.map(|contact| contact.bodies);
        let same_ratio = bodies.filter(|b| b.lower.poisson_ratio == b.upper.poisson_ratio);
        let wear = recipe.wear.as_ref();
        let given = elements.and_then(|elements| match elements.stiffness {
            ElementStiffness::Given { normal_load, .. } => {
                Some((Some(elements.friction_coefficient), normal_load))
            }
            ElementStiffness::Contact { .. } => None,
        });
        let load =
            contact.map(|contact| (contact.friction_coefficient, contact.conditions.normal_load));
        let load = load.or(given);
        let size = recipe.surface().map(|surface| surface.size);
        Setting {
            base: base(scene),
            law: law(scene),
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

/// The law of contact elements: its word, and how a stiffness of the whole joint is shared.
fn law(scene: &Value) -> String {
    if scene["dynamics"].is_null() {
        return String::new();
    }
    let word = |key: &str| scene["contact"][key].as_str().unwrap_or_default();
    match (word("stiffness"), word("distribution")) {
        (kind @ ("total" | "roughness"), shared) => format!("{kind}, {shared}"),
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
        ("dynamics", "harmonics"),
        // Where a run ends, and how its steps are taken.
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
