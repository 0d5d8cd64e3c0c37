//! Which part a run plays, by its scene.

use serde_json::{Value, json};

use crate::scene::plan::Plan;
use crate::scene::{Scene, Scheme, Surface, Update};

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
    /// That of a scene.
    pub fn of(scene: &Scene) -> Setting {
        let contact = scene.contact.as_ref();
        let (rq, correlation_length) = match &scene.surface {
            Some(
                Surface::Gaussian {
                    rq,
                    correlation_length,
                    ..
                }
                | Surface::Exponential {
                    rq,
                    correlation_length,
                    ..
                },
            ) => (Some(*rq), Some(*correlation_length)),
            Some(Surface::SelfAffine { rq, .. }) => (Some(*rq), None),
            _ => (None, None),
        };
        let bodies = scene.material.as_ref();
        let same_ratio = bodies.filter(|m| m.lower.poisson_ratio == m.upper.poisson_ratio);
        let wear = scene.wear.as_ref();
        let dynamics = scene.dynamics.as_ref();
        Setting {
            base: base(scene),
            rq,
            correlation_length,
            pressure_cap: contact.and_then(|contact| contact.pressure_cap),
            sphere: matches!(scene.surface, Some(Surface::Sphere { .. })),
            update: scene
                .update
                .map_or("never".to_owned(), |update| json!(update).to_string()),
            stiffness_change: match scene.update {
                Some(Update::StiffnessChange(change)) => Some(change),
                _ => None,
            },
            vibrates: scene.structure.is_some(),
            harmonics: dynamics.map_or_else(String::new, |d| json!(d.harmonics).to_string()),
            tangent: contact.is_some_and(|c| c.stiffness == crate::scene::Stiffness::Tangent),
            explicit: wear
                .filter(|w| w.scheme == Scheme::Explicit)
                .and_then(|w| w.depth_step),
            coefficient: wear.map(|wear| wear.coefficient),
            cycles: wear.and_then(|wear| wear.cycles),
            sliding_force: contact.and_then(|c| Some(c.friction_coefficient? * c.normal_load)),
            normal_load: contact.map_or(0.0, |contact| contact.normal_load),
            poisson_ratio: same_ratio.map(|material| material.lower.poisson_ratio),
            dundurs_beta: bodies.map_or(0.0, |material| Plan::pair(material).dundurs_beta()),
            tolerances: [
                scene.fidelity.normal_tolerance,
                scene.fidelity.tangential_tolerance,
            ],
        }
    }
}

fn base(scene: &Scene) -> String {
    let mut base = scene.canonical();
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
