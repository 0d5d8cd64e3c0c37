//! What moves the joint of a run: its vibrating structure, the contact elements in force, and the response to them.

use super::RunError;
use super::dynamic_response::shaken_of;
use super::model_update::model_of;
use super::reference::Reference;
use super::structure::Stored;
use crate::contact::{ContactError, Shear};
use crate::dynamics::cycle::joint_cycle;
use crate::dynamics::{ContactElement, Harmonics, Sampling, Start, Truncation, Vibration};
use crate::model_update::{
    Compliance, ContactElements, Distribution, ElementParameters, Linearisation, Springs,
    UpdateState, fine_displacement,
};
use crate::recipe::build::Layout;
use crate::recipe::{ElementStiffness, Inputs, Recipe};
use crate::store::{RunStore, StageKey};
use crate::tables::typed;
use crate::wear::{Channel, FrettingJoint, Motion};

/// Samples of a cycle at which a computed motion is looked at: reversals are found to 2e-5 of the reach.
const FINE_SAMPLES: usize = 512;

/// A structure with a place for contact elements.
pub struct Vibrating {
    pub vibration: Vibration,
    pub layout: Layout,
    /// Of the structure's reduction.
    pub key: StageKey,
    /// The fine cells of every contact element; none where the stiffness is given.
    pub elements: Option<ContactElements>,
    /// Compliance of the smooth patch, where the stiffness or the motion needs it.
    pub smooth: Option<Compliance>,
}

/// The contact elements in force.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    pub parameters: ElementParameters,
    /// They are those of this iteration.
    pub updated: bool,
    /// Which quantity called for it.
    pub reason: String,
    /// Updates so far.
    pub updates: u64,
    /// The state at the last update.
    pub reference: UpdateState,
}

/// The response in force, as far as a later one and the fretting cycle depend on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Shaken {
    pub harmonics: Harmonics,
    pub start: Start,
    pub resonance_frequency: f64,
    pub peak_frequency: f64,
    pub peak_amplitude: f64,
    /// Work of the contact forces per cycle \[J\].
    pub friction_energy: f64,
    /// Energy of a cycle that the closures of the fine contact, mean displacement and total load, make wrong \[J\].
    pub closure_energy: f64,
    /// Errors by the harmonics left out.
    pub truncation: Truncation,
}

/// What moves the joint at an iteration.
#[derive(Debug, Clone, PartialEq)]
pub struct Driven {
    pub model: Model,
    pub shaken: Shaken,
    /// The tables of the response: iterations that do not renew it have the same.
    pub tables: InForce,
}

/// The tables of the response in force.
#[derive(Debug, Clone, PartialEq)]
pub struct InForce {
    pub response: typed::Response,
    pub row: typed::DynamicResponse,
    pub cycle: typed::JointCycle,
    pub elements: typed::ContactElement,
}

impl Driven {
    pub fn of(model: Model, tables: InForce) -> Result<Driven, RunError> {
        Ok(Driven {
            shaken: shaken_of(&tables.response, &tables.row)?,
            model,
            tables,
        })
    }

    /// What moved the joint at a committed iteration.
    pub fn committed(store: &RunStore, wear_iteration: u64) -> Result<Driven, RunError> {
        let tables = InForce {
            response: store.typed(wear_iteration)?,
            row: store.typed(wear_iteration)?,
            cycle: store.typed(wear_iteration)?,
            elements: store.typed(wear_iteration)?,
        };
        let model = model_of(&store.typed(wear_iteration)?, &tables.elements);
        Driven::of(model, tables)
    }
}

impl Vibrating {
    /// From the structure and the unworn joint, for a joint with a surface.
    pub fn with_surface(
        inputs: &Inputs,
        stored: Stored,
        elements: ContactElements,
        reference: &Reference,
    ) -> Result<Vibrating, RunError> {
        let recipe = &inputs.recipe;
        let parts = (&recipe.structure, &recipe.response, recipe.elements());
        let (Some(structure), Some(response), Some(of_recipe)) = parts else {
            unreachable!("a vibrating joint with a surface has contact elements");
        };
        let layout = structure.layout();
        let unworn = of_recipe.with(&layout, &reference.elements);
        let reduced = stored.reduced.as_ref();
        Ok(Vibrating {
            vibration: structure.vibration(response, true, reduced, &unworn)?,
            layout,
            key: stored.key,
            elements: Some(elements),
            smooth: reference.smooth,
        })
    }

    /// The contact elements with these parameters.
    pub fn contact_elements(
        &self,
        recipe: &Recipe,
        parameters: &ElementParameters,
    ) -> Vec<ContactElement> {
        let elements = recipe.elements();
        elements.map_or_else(Vec::new, |elements| elements.with(&self.layout, parameters))
    }

    /// The motion that this response gives the fine contact, at many samples, under the static `load`: the mean of the elements'
    /// displacement over the area, and what the load of the joint varies by. The mean of that variation is left out: under
    /// prescribed displacement it is the bolt that bears the load.
    pub fn motion(&self, inputs: &Inputs, driven: &Driven, load: f64) -> Result<Motion, RunError> {
        let steps = inputs.recipe.cycle().map_or(1, |cycle| cycle.steps);
        let samples = steps * FINE_SAMPLES.div_ceil(steps);
        let sampling = Sampling::new(driven.shaken.harmonics.clone(), samples)?;
        let elements = self.contact_elements(&inputs.recipe, &driven.model.parameters);
        let cycle = joint_cycle(
            &elements,
            &driven.shaken.start.displacement,
            &sampling,
            &self.layout.centres,
        )?;
        let axes = match shear_of(&inputs.recipe) {
            Shear::AlongX => 1,
            Shear::InPlane => 2,
        };
        let series = |of: &[[f64; 3]]| -> Vec<Vec<f64>> {
            (0..axes)
                .map(|d| of.iter().map(|v| v[d]).collect())
                .collect()
        };
        let mut displacement = series(&cycle.displacement);
        if let Some(smooth) = self.smooth {
            displacement =
                fine_displacement(&displacement, &series(&cycle.force), smooth.tangential);
        }
        let motion = Motion {
            time: (0..samples).map(|k| k as f64 / samples as f64).collect(),
            drive: displacement
                .into_iter()
                .map(Channel::Displacement)
                .collect(),
            rotation: None,
            normal_load: cycle.force.iter().map(|f| f[2]).collect(),
        };
        Ok(motion.with_mean_load(load))
    }
}

fn shear_of(recipe: &Recipe) -> Shear {
    recipe
        .contact()
        .map_or(Shear::AlongX, |contact| contact.shear)
}

/// The fine contact linearised.
pub fn linearise(
    recipe: &Recipe,
    joint: &mut FrettingJoint,
    pressure: &[f64],
) -> Result<Linearisation, ContactError> {
    let cap = joint.pressure_cap;
    Linearisation::new(&mut joint.half_space, pressure, cap, shear_of(recipe))
}

/// What of the fine contact's compliance the contact elements get.
pub fn springs<'a>(
    recipe: &Recipe,
    linearisation: &'a Linearisation,
    smooth: Option<Compliance>,
) -> Springs<'a> {
    let elements = recipe.elements();
    match elements.is_some_and(|elements| elements.stiffness.is_tangent()) {
        true => Springs::Tangent(linearisation),
        false => shared_springs(recipe, linearisation.compliance(), smooth),
    }
}

/// A compliance of the whole joint to be shared among the contact elements, without that of the smooth patch if it is given.
pub fn shared_springs(
    recipe: &Recipe,
    total: Compliance,
    smooth: Option<Compliance>,
) -> Springs<'static> {
    let distribution = match recipe.elements().map(|elements| elements.stiffness) {
        Some(ElementStiffness::Contact { distribution, .. }) => distribution,
        _ => Distribution::default(),
    };
    match smooth {
        Some(smooth) => Springs::Roughness {
            total,
            smooth,
            distribution,
        },
        None => Springs::Total {
            total,
            distribution,
        },
    }
}
