//! The contact elements of an iteration: those of its own fine contact where they are due, else those of the one before.

use super::context::{Context, VibrationKeys, kept, put};
use super::error::NumericsError;
use super::state::Committed;
use super::static_contact::{StaticContact, stiffnesses};
use super::vibrating::{Model, Vibrating, linearise, springs};
use super::{RunError, Stage};
use crate::dynamics::ElementState;
use crate::model_update::{Compliance, Criterion, DueTo, ElementParameters, UpdateState};
use crate::recipe::build::Layout;
use crate::recipe::{Contact, ElementStiffness, Recipe};
use crate::store::Draft;
use crate::tables::typed;
use crate::wear::FrettingJoint;

/// Decides whether the contact elements are due, and makes them if so; or takes them from the draft.
pub fn model_update(
    context: &mut Context,
    vibrating: &Vibrating,
    draft: &mut Draft,
    keys: &VibrationKeys,
    contact: &StaticContact,
    wear_volume: f64,
    before: Option<&Model>,
) -> Result<Model, RunError> {
    let key = &keys.model_update;
    if let Some(row) = kept(draft, key)? {
        // The response replaces the elements by the same ones with their state.
        let mut elements = kept(draft, key)?;
        if elements.is_none() {
            elements = kept(draft, &keys.dynamic_response)?;
        }
        if let Some(elements) = elements {
            return Ok(model_of(&row, &elements));
        }
    }
    let model = renewed(context, vibrating, contact, wear_volume, before)?;
    // The elements go last: with both in the draft the stage is complete.
    put(draft, key, &row_of(&model))?;
    put(
        draft,
        key,
        &element_table(&vibrating.layout, &model.parameters, None),
    )?;
    Ok(model)
}

/// The contact elements of the fine contact if `before` is none or they are due; else `before`, no longer new.
pub fn renewed(
    context: &mut Context,
    vibrating: &Vibrating,
    contact: &StaticContact,
    wear_volume: f64,
    before: Option<&Model>,
) -> Result<Model, RunError> {
    let inputs = context.inputs;
    let now = UpdateState {
        iteration: context.clock.wear_iteration,
        compliance: compliance(vibrating, contact.kn, contact.kt),
        wear_volume,
    };
    let criterion = criterion(&inputs.recipe);
    let due = before.map(|before| criterion.due(&before.reference, &now));
    let reason = match due {
        Some(None) => {
            let before = before.expect("due is none without it");
            return Ok(Model {
                updated: false,
                reason: String::new(),
                ..before.clone()
            });
        }
        None => String::new(),
        Some(Some(due)) => match due.to {
            DueTo::Kn => "kn",
            DueTo::Kt => "kt",
            DueTo::Iterations => "iterations",
            DueTo::WearVolume => "wear_volume",
        }
        .to_owned(),
    };
    let parameters = parameters(context, vibrating, contact)?;
    Ok(Model {
        parameters,
        updated: true,
        reason,
        updates: before.map_or(0, |before| before.updates + 1),
        reference: now,
    })
}

/// When the contact elements are due.
fn criterion(recipe: &Recipe) -> Criterion {
    recipe
        .elements()
        .map_or(Criterion::Never, |elements| elements.update)
}

/// Compliance of the springs of a joint of kn and kt together.
fn compliance(vibrating: &Vibrating, kn: f64, kt: f64) -> Compliance {
    let total = Compliance::of(kn, kt);
    match vibrating.smooth {
        Some(smooth) => total.without(smooth),
        None => total,
    }
}

/// The next update, seen from the beginning of a step that may pass it.
pub struct Coming<'a> {
    vibrating: &'a Vibrating,
    criterion: Criterion,
    reference: UpdateState,
    /// How far on its way the beginning of the step is.
    pub begin: f64,
}

impl<'a> Coming<'a> {
    /// `None` where the length of a step has no influence on an update.
    pub fn of(
        recipe: &Recipe,
        vibrating: Option<&'a Vibrating>,
        before: &Committed,
    ) -> Result<Option<Self>, RunError> {
        let criterion = criterion(recipe);
        let (Some(vibrating), Some(driven)) = (vibrating, &before.driven) else {
            return Ok(None);
        };
        if matches!(criterion, Criterion::Never | Criterion::Iterations(_)) {
            return Ok(None);
        }
        let mut coming = Coming {
            vibrating,
            criterion,
            reference: driven.model.reference,
            begin: 0.0,
        };
        let stiffness = |k: Option<f64>| k.unwrap_or(f64::INFINITY);
        let (kn, kt) = (before.summary.kn, before.summary.kt);
        coming.begin = coming.at(stiffness(kn), stiffness(kt), before.volume);
        Ok(Some(coming))
    }

    fn at(&self, kn: f64, kt: f64, wear_volume: f64) -> f64 {
        let now = UpdateState {
            iteration: self.reference.iteration,
            compliance: compliance(self.vibrating, kn, kt),
            wear_volume,
        };
        self.criterion.progress(&self.reference, &now)
    }

    /// How far on its way a joint under `pressure` is, with so much volume worn away in all: 1 where the update is due.
    pub fn reached(
        &self,
        joint: &mut FrettingJoint,
        contact: Option<&Contact>,
        pressure: &[f64],
        wear_volume: f64,
    ) -> Result<f64, NumericsError> {
        let (kn, kt) = match (self.criterion, contact) {
            (Criterion::StiffnessChange(_), Some(contact)) => {
                stiffnesses(joint, pressure, contact.shear, contact.coupling)?
            }
            _ => (f64::INFINITY, f64::INFINITY),
        };
        Ok(self.at(kn, kt, wear_volume))
    }
}

/// Parameters of the contact elements as the fine contact of this iteration gives them.
pub fn parameters(
    context: &mut Context,
    vibrating: &Vibrating,
    contact: &StaticContact,
) -> Result<ElementParameters, RunError> {
    let inputs = context.inputs;
    let Some(elements) = &vibrating.elements else {
        unreachable!("a joint with a surface has a map from its cells to the contact elements");
    };
    let (pressure, gap) = (&contact.solution.pressure, &contact.solution.gap);
    let tangent = ElementStiffness::is_tangent;
    if inputs
        .recipe
        .elements()
        .is_some_and(|e| tangent(&e.stiffness))
    {
        let (linearisation, _) = context.timed(Stage::ModelUpdate, |joint| {
            Ok(linearise(&inputs.recipe, joint, pressure)?)
        })?;
        let springs = springs(&inputs.recipe, &linearisation, vibrating.smooth);
        return Ok(ElementParameters::new(elements, pressure, gap, springs)?);
    }
    // kn and kt of the whole joint are known already: no linearisation is needed to share them.
    let springs = super::vibrating::shared_springs(
        &inputs.recipe,
        Compliance::of(contact.kn, contact.kt),
        vibrating.smooth,
    );
    Ok(ElementParameters::new(elements, pressure, gap, springs)?)
}

/// The row of `model_update`.
fn row_of(model: &Model) -> typed::ModelUpdate {
    let reference = &model.reference;
    typed::ModelUpdate {
        updated: model.updated,
        reason: model.reason.clone(),
        updates: model.updates as i64,
        update_iteration: reference.iteration as i64,
        compliance_normal: reference.compliance.normal,
        compliance_tangential: reference.compliance.tangential,
        wear_volume: reference.wear_volume,
    }
}

/// The contact elements as a table, with the worst state of each over the cycle once it is known.
pub fn element_table(
    layout: &Layout,
    parameters: &ElementParameters,
    states: Option<&[ElementState]>,
) -> typed::ContactElement {
    let count = parameters.normal_load.len();
    let name = |state: &ElementState| {
        match state {
            ElementState::Stick => "stick",
            ElementState::Slip => "slip",
            ElementState::Open => "open",
        }
        .to_owned()
    };
    typed::ContactElement {
        element: (0..count as i32).collect(),
        x: layout.centres.iter().map(|c| c[0]).collect(),
        y: layout.centres.iter().map(|c| c[1]).collect(),
        area: vec![layout.area; count],
        normal_load: parameters.normal_load.clone(),
        gap: parameters.gap.clone(),
        kn: parameters.kn.clone(),
        kt: parameters.kt.clone(),
        state: states.map(|states| states.iter().map(name).collect()),
    }
}

/// The model of both tables.
pub fn model_of(row: &typed::ModelUpdate, elements: &typed::ContactElement) -> Model {
    Model {
        parameters: ElementParameters {
            normal_load: elements.normal_load.clone(),
            gap: elements.gap.clone(),
            kn: elements.kn.clone(),
            kt: elements.kt.clone(),
        },
        updated: row.updated,
        reason: row.reason.clone(),
        updates: row.updates as u64,
        reference: UpdateState {
            iteration: row.update_iteration as u64,
            compliance: Compliance {
                normal: row.compliance_normal,
                tangential: row.compliance_tangential,
            },
            wear_volume: row.wear_volume,
        },
    }
}
