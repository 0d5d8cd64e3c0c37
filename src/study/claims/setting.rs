//! Which part a run plays, by its recipe.

use serde_json::{Value, json};

use crate::recipe::{Criterion, ElementStiffness, Recipe};

/// What of a scene decides which part a run plays.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Setting {
    /// The scene without what a study varies: roughness, cap, update, harmonics, output.
    pub base: String,
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
    /// Depth of an explicit wear step \[m\]; none for other schemes.
    pub explicit: Option<f64>,
    /// Worn volume per energy \[m³/J\].
    pub coefficient: Option<f64>,
    /// Cycles that end the run.
    pub cycles: Option<u64>,
    /// Static load times friction coefficient \[N\].
    pub sliding_force: Option<f64>,
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
        let load = contact.map(|contact| (contact.friction_coefficient, contact.normal_load));
        let load = load.or(given);
        Setting {
            base: base(scene),
            rq,
            correlation_length,
            pressure_cap: contact.and_then(|contact| contact.pressure_cap),
            sphere: heights.is_some_and(|heights| heights.sphere_radius().is_some()),
            update: match &scene["update"] {
                Value::Null => "never".to_owned(),
                update => update.to_string(),
            },
            stiffness_change: elements.and_then(|elements| match elements.update {
                Criterion::StiffnessChange(change) => Some(change),
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
            sliding_force: load.and_then(|(friction, load)| Some(friction? * load)),
            normal_load: load.map_or(0.0, |(_, load)| load),
            poisson_ratio: same_ratio.map(|bodies| bodies.lower.poisson_ratio),
            dundurs_beta: bodies.map_or(0.0, |bodies| bodies.dundurs_beta()),
            tolerances: contact.map_or([0.0; 2], |contact| {
                [contact.normal_tolerance, contact.tangential_tolerance]
            }),
        }
    }
}

fn base(scene: &Value) -> String {
    let mut base = scene.clone();
    for (section, key) in [
        ("surface", "rq"),
        ("contact", "pressure_cap"),
        ("dynamics", "harmonics"),
        // The published algorithm takes smaller steps on smoother surfaces.
        ("wear", "depth_step"),
    ] {
        if let Some(section) = base.get_mut(section).and_then(Value::as_object_mut) {
            section.remove(key);
        }
    }
    if let Some(sections) = base.as_object_mut() {
        for section in ["update", "output"] {
            sections.remove(section);
        }
    }
    base.to_string()
}
