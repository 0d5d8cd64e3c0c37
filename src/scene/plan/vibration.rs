//! The vibrating structure of a scene: what is decided about it, and what is built.

use std::f64::consts::TAU;

use super::{Decisions, Plan, PlanError};
use crate::dynamics::oscillator::mass_on_springs;
use crate::dynamics::reduced::{Damping, reduced_model, reference_springs};
use crate::dynamics::{
    ContactElement, DynamicsError, Harmonics, Load, SecondOrder, Settings, Vibration,
};
use crate::model_update::{Criterion, ElementParameters};
use crate::scene::{
    Contact, DampingBasis, Dynamics, FrictionLaw, Port, Scene, Stiffness, Structure, Update,
};
use crate::structure::reduction::Reduced;

/// Where the contact elements of a structure are.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layout {
    /// Centres (x, y), from the middle of the joint \[m\].
    pub centres: Vec<[f64; 2]>,
    /// Area of each \[m²\]; 0 for that of an oscillator.
    pub area: f64,
    /// Half the length of the joint along x \[m\].
    pub lever: f64,
}

/// Contact elements of the structure.
pub(super) fn contact_elements(scene: &Scene) -> usize {
    match (&scene.structure, &scene.contact) {
        (None, _) | (_, None) => 0,
        (Some(Structure::Oscillator { .. }), Some(_)) => 1,
        (Some(Structure::Resonator { geometry }), Some(_)) => geometry.contact_cells().len(),
    }
}

pub(super) fn decide(scene: &Scene, decisions: &mut Decisions) -> Result<(), PlanError> {
    let (Some(structure), Some(dynamics)) = (&scene.structure, &scene.dynamics) else {
        decisions.add(
            "structure, dynamic response, model update",
            "none",
            "no [structure] and [dynamics]",
        );
        return Ok(());
    };
    match structure {
        Structure::Resonator { .. } => decisions.add(
            "structure",
            format!(
                "resonator: {} elastic modes, and the static residual of all others",
                dynamics.modes
            ),
            "computed once and shared between runs by its content",
        ),
        Structure::Oscillator { .. } => decisions.add(
            "structure",
            "one mass, three degrees of freedom",
            "structure.kind = \"oscillator\"",
        ),
    }
    let elements = contact_elements(scene);
    match (&scene.contact, dynamics.friction_law) {
        (None, _) => decisions.add(
            "contact elements",
            "none",
            "no [contact]: the joint is bonded, the response linear",
        ),
        (Some(_), FrictionLaw::Cone) => decisions.add(
            "contact elements",
            format!("{elements}, three-dimensional, |T| <= mu N"),
            "dynamics.friction_law = \"cone\"",
        ),
        (Some(_), FrictionLaw::Box) => decisions.add(
            "contact elements",
            format!("{elements}, three-dimensional, |Tx| and |Ty| <= mu N each"),
            "dynamics.friction_law = \"box\"",
        ),
    }
    if elements > 0 {
        decisions.add(
            "unknowns of the harmonic balance",
            "after the linear response: those of contact elements that slip or open",
            "the others follow their springs, which is checked over the whole cycle",
        );
    }
    match scene.fidelity.harmonic_tolerance {
        Some(tolerance) => decisions.add(
            "harmonics",
            format!(
                "after dynamic_response: from {:?} up to 31, until those left out change amplitude and dissipation by less than {tolerance}",
                dynamics.harmonics
            ),
            "no dynamics.harmonics; the expected cost is that of those to begin with, each extension takes some three times as long",
        ),
        None => decisions.add(
            "harmonics",
            format!("{:?}", dynamics.harmonics),
            if elements > 0 {
                "not extended; what those left out would change is in dynamic_response"
            } else {
                "a linear response has no others than its forces"
            },
        ),
    }
    if dynamics.damping_ratio > 0.0 {
        decisions.add(
            "damping",
            format!("ratio {} in every mode", dynamics.damping_ratio),
            match dynamics.damping_basis {
                DampingBasis::Stuck => "modes of the unworn contact stuck",
                DampingBasis::Free => "modes without contact springs",
            },
        );
    }
    decisions.add(
        "forced response",
        match dynamics.points {
            Some(points) => format!("at {points} frequencies"),
            None => "as continuation places its points".to_owned(),
        },
        "for the unworn joint, at output.response_at and at the end",
    );
    let Some(contact) = &scene.contact else {
        return Ok(());
    };
    if scene.surface.is_none() {
        decisions.add(
            "contact stiffness",
            "given",
            "contact.kn and contact.kt in place of a surface",
        );
        return Ok(());
    }
    let (choice, why) = match contact.stiffness {
        Stiffness::Total => (
            "that of the whole rough patch",
            "contact.stiffness = \"total\", as published",
        ),
        Stiffness::Roughness => (
            "that of the rough patch without the smooth one's compliance",
            "contact.stiffness = \"roughness\": the structure has the bodies' compliance already",
        ),
        Stiffness::Tangent => (
            "each element its own tangent",
            "contact.stiffness = \"tangent\"",
        ),
    };
    decisions.add("contact stiffness", choice, why);
    match (&scene.wear, scene.update) {
        (None, _) => decisions.add("model update", "none", "no [wear]"),
        (Some(_), None) => decisions.add(
            "model update",
            "never",
            "no [update]: the joint keeps moving as the unworn one",
        ),
        (Some(_), Some(Update::StiffnessChange(change))) => decisions.add(
            "model update",
            format!("after static_contact: where kn or kt has changed by {change} since the last"),
            "update.stiffness_change",
        ),
        (Some(_), Some(Update::Iterations(every))) => decisions.add(
            "model update",
            format!("every {every} wear iterations"),
            "update.iterations",
        ),
        (Some(_), Some(Update::WearVolume(volume))) => decisions.add(
            "model update",
            format!("after wear: at every {volume:e} m^3"),
            "update.wear_volume",
        ),
    }
    Ok(())
}

impl Plan {
    /// Where the contact elements are; none without structure or contact.
    pub fn layout(scene: &Scene) -> Option<Layout> {
        scene.contact.as_ref()?;
        Some(match scene.structure.as_ref()? {
            Structure::Oscillator { .. } => Layout {
                centres: vec![[0.0; 2]],
                area: 0.0,
                lever: 0.0,
            },
            Structure::Resonator { geometry } => Layout {
                centres: geometry.contact_centres(),
                area: geometry.contact_area(),
                lever: 0.5 * geometry.lap_length,
            },
        })
    }

    /// The contact elements with these parameters.
    pub fn contact_elements(
        scene: &Scene,
        layout: &Layout,
        parameters: &ElementParameters,
    ) -> Vec<ContactElement> {
        let contact = scene.contact.as_ref();
        let friction_coefficient = contact.and_then(|c| c.friction_coefficient).unwrap_or(0.0);
        let law = scene
            .dynamics
            .as_ref()
            .map_or_else(FrictionLaw::default, |d| d.friction_law);
        (0..parameters.normal_load.len())
            .map(|e| ContactElement {
                area: layout.area,
                friction_coefficient,
                normal_load: parameters.normal_load[e],
                gap: parameters.gap[e],
                tangential_stiffness: parameters.kt[e],
                normal_stiffness: parameters.kn[e],
                law,
            })
            .collect()
    }

    /// Parameters of contact elements whose stiffness is given: load and stiffness by area.
    pub fn given_parameters(contact: &Contact, layout: &Layout) -> ElementParameters {
        let count = layout.centres.len();
        let part = |total: f64| vec![total / count as f64; count];
        let given = contact.given;
        ElementParameters {
            normal_load: part(contact.normal_load),
            gap: vec![given.map_or(0.0, |g| g.gap); count],
            kn: part(given.map_or(0.0, |g| g.kn)),
            kt: part(given.map_or(0.0, |g| g.kt)),
        }
    }

    /// The ports of the vibration that are no contact ports, in their order: those of the loads and of the response, each once.
    /// The mass of an oscillator is its contact, unless it has none.
    pub fn points(scene: &Scene) -> Vec<Port> {
        let (Some(structure), Some(dynamics)) = (&scene.structure, &scene.dynamics) else {
            return Vec::new();
        };
        match structure {
            Structure::Oscillator { .. } if scene.contact.is_some() => Vec::new(),
            Structure::Oscillator { .. } => (0..3)
                .map(|axis| Port {
                    at: dynamics.response.at.clone(),
                    axis,
                })
                .collect(),
            Structure::Resonator { .. } => {
                let mut points: Vec<Port> = Vec::new();
                let loads = dynamics.forces.iter().map(|force| &force.port);
                for port in loads.chain([&dynamics.response]) {
                    if !points.contains(port) {
                        points.push(port.clone());
                    }
                }
                points
            }
        }
    }

    /// When the contact elements are renewed.
    pub fn criterion(update: Option<Update>) -> Criterion {
        match update {
            None => Criterion::Never,
            Some(Update::StiffnessChange(change)) => Criterion::StiffnessChange(change),
            Some(Update::Iterations(every)) => Criterion::Iterations(every),
            Some(Update::WearVolume(volume)) => Criterion::WearVolume(volume),
        }
    }

    /// The vibration of a scene, but for its contact elements. `reduced` is its structure, none for an oscillator; damping in
    /// modes of the stuck joint is that of the `unworn` contact elements.
    ///
    /// # Errors
    /// [`DynamicsError`] for numbers that the dynamics refuses.
    ///
    /// # Panics
    /// On a scene without structure, or with a resonator that is not there.
    pub fn vibration(
        scene: &Scene,
        reduced: Option<&Reduced>,
        unworn: &[ContactElement],
    ) -> Result<Vibration, DynamicsError> {
        let (Some(structure), Some(dynamics)) = (&scene.structure, &scene.dynamics) else {
            panic!("a scene without [structure] and [dynamics] does not vibrate");
        };
        let springs = reference_springs(unworn);
        let springs = (dynamics.damping_basis == DampingBasis::Stuck).then_some(&springs[..]);
        let points = Plan::points(scene);
        let place = |port: &Port| points.iter().position(|p| p == port).unwrap_or(0);
        let (model, first): (SecondOrder, usize) = match structure {
            Structure::Oscillator {
                mass,
                damping,
                stiffness,
            } => oscillator(*mass, *damping, *stiffness, dynamics, unworn, springs)?,
            Structure::Resonator { .. } => {
                let reduced = reduced.expect("the structure is reduced before it vibrates");
                let numbers: Option<Vec<usize>> = points
                    .iter()
                    .map(|port| reduced.ports.of_point(&port.at, port.axis))
                    .collect();
                let numbers = numbers.expect("the scene checks the names of points");
                let damping = Damping {
                    ratio: dynamics.damping_ratio,
                    springs,
                };
                (
                    reduced_model(reduced, &numbers, damping)?,
                    reduced.ports.contact_ports(),
                )
            }
        };
        let number = |port: &Port| match structure {
            Structure::Oscillator { .. } => port.axis,
            Structure::Resonator { .. } => first + place(port),
        };
        Ok(Vibration {
            loads: dynamics
                .forces
                .iter()
                .map(|force| Load {
                    port: number(&force.port),
                    harmonic: force.harmonic,
                    cosine: force.amplitude * force.phase.cos(),
                    sine: if force.harmonic == 0 {
                        0.0
                    } else {
                        -force.amplitude * force.phase.sin()
                    },
                })
                .collect(),
            response_port: number(&dynamics.response),
            harmonics: Harmonics::new(&dynamics.harmonics)?,
            settings: Settings {
                samples: scene.fidelity.aft_samples,
                ..Settings::default()
            },
            range: (dynamics.frequency[0] * TAU, dynamics.frequency[1] * TAU),
            model,
        })
    }
}

/// An oscillator with its contact element, or without.
fn oscillator(
    mass: [f64; 3],
    damping: [f64; 3],
    stiffness: [f64; 3],
    dynamics: &Dynamics,
    elements: &[ContactElement],
    springs: Option<&[f64]>,
) -> Result<(SecondOrder, usize), DynamicsError> {
    let mut model = mass_on_springs(mass, damping, stiffness, 3 * elements.len())?;
    if dynamics.damping_ratio > 0.0 {
        let own = model.damping.clone();
        let none = vec![0.0; model.contact_dofs];
        model = model.with_damping_ratio(dynamics.damping_ratio, springs.unwrap_or(&none))?;
        for axis in 0..3 {
            let sum = model.damping.at(axis, axis) + own.at(axis, axis);
            model.damping.set(axis, axis, sum);
        }
    }
    Ok((model, 0))
}
