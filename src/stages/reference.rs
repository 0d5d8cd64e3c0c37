//! The unworn joint under its load, once a run: against it the whole run is measured.

use super::context::{Clock, parts};
use super::error::NumericsError;
use super::vibrating::{linearise, springs};
use super::{RunError, Stage};
use crate::model_update::{Compliance, ContactElements, ElementParameters, StiffnessKind};
use crate::recipe::{ElementStiffness, Inputs};
use crate::store::{Kept, RunStore, StageKey};
use crate::tables::{TableName, TypedTable, typed};
use crate::wear::{FrettingJoint, WearError};

const TABLES: [TableName; 2] = [TableName::Reference, TableName::ReferenceElement];

/// What of the unworn contact a run depends on.
pub struct Reference {
    /// Approach of the joint: where its bolt begins to lose load \[m\].
    pub approach: f64,
    /// Compliance of the smooth patch, where the stiffness or the motion needs it.
    pub smooth: Option<Compliance>,
    /// Contact elements, whose springs the damping in modes of the stuck joint is that of; of none without a structure.
    pub elements: ElementParameters,
}

/// Solves the unworn contact, or takes what an earlier start found of it. `elements` are those of the structure.
pub fn reference(
    inputs: &Inputs,
    joint: &mut FrettingJoint,
    elements: Option<&ContactElements>,
    surface: &StageKey,
    store: &mut RunStore,
    clock: &mut Clock,
) -> Result<Reference, RunError> {
    let reads = parts(&inputs.recipe, &["contact", "elements"]);
    let key = StageKey::new(Stage::Reference.name(), &TABLES, &reads, &[surface]);
    let row = store.once(TableName::Reference, &key)?;
    let of_elements = store.once(TableName::ReferenceElement, &key)?;
    let (row, of_elements) = match (row, of_elements) {
        (Kept::Valid(row), Kept::Valid(rows)) => (
            typed::Reference::of(&row)?,
            Some(typed::ReferenceElement::of(&rows)?),
        ),
        (Kept::Valid(row), _) if elements.is_none() => (typed::Reference::of(&row)?, None),
        _ => {
            let (row, rows) = solve(inputs, joint, elements, clock)?;
            store.put_once(TableName::Reference, &key, &row.to_table()?)?;
            if let Some(rows) = &rows {
                store.put_once(TableName::ReferenceElement, &key, &rows.to_table()?)?;
            }
            (row, rows)
        }
    };
    let smooth = row.smooth_compliance_normal;
    let smooth = smooth.zip(row.smooth_compliance_tangential);
    Ok(Reference {
        approach: row.approach,
        smooth: smooth.map(|(normal, tangential)| Compliance { normal, tangential }),
        elements: of_elements.map_or_else(ElementParameters::default, |rows| ElementParameters {
            normal_load: rows.normal_load,
            gap: rows.gap,
            kn: rows.kn,
            kt: rows.kt,
        }),
    })
}

fn solve(
    inputs: &Inputs,
    joint: &mut FrettingJoint,
    elements: Option<&ContactElements>,
    clock: &mut Clock,
) -> Result<(typed::Reference, Option<typed::ReferenceElement>), RunError> {
    let wrong = |source| match source {
        NumericsError::ModelUpdate(source) => RunError::ModelUpdate(source),
        NumericsError::Wear(WearError::Contact(source)) => RunError::Unworn(source),
        NumericsError::Wear(source) => RunError::Wear {
            stage: Stage::Reference,
            wear_iteration: 0,
            source,
        },
    };
    clock.timed_pairs(Stage::Reference, joint, |joint| {
        unworn(inputs, joint, elements).map_err(wrong)
    })
}

fn unworn(
    inputs: &Inputs,
    joint: &mut FrettingJoint,
    elements: Option<&ContactElements>,
) -> Result<(typed::Reference, Option<typed::ReferenceElement>), NumericsError> {
    let wear = vec![0.0; joint.patch.grid.len()];
    let unworn = joint.static_contact(&wear, None)?;
    let mut row = typed::Reference {
        approach: unworn.approach,
        ..typed::Reference::default()
    };
    let Some(elements) = elements else {
        return Ok((row, None));
    };
    let recipe = &inputs.recipe;
    let stiffness = recipe.elements().map(|elements| elements.stiffness);
    let smooth = match (stiffness, recipe.contact()) {
        (
            Some(ElementStiffness::Contact {
                stiffness: StiffnessKind::Roughness,
                ..
            }),
            Some(contact),
        ) => {
            let smooth = Compliance::smooth(&mut joint.half_space, &joint.patch, contact.shear);
            Some(smooth.map_err(WearError::Contact)?)
        }
        _ => None,
    };
    row.smooth_compliance_normal = smooth.map(|smooth| smooth.normal);
    row.smooth_compliance_tangential = smooth.map(|smooth| smooth.tangential);
    let linearisation = linearise(recipe, joint, &unworn.pressure).map_err(WearError::Contact)?;
    let springs = springs(recipe, &linearisation, smooth);
    let found = ElementParameters::new(elements, &unworn.pressure, &unworn.gap, springs)?;
    let rows = typed::ReferenceElement {
        element: (0..found.normal_load.len() as i32).collect(),
        normal_load: found.normal_load,
        gap: found.gap,
        kn: found.kn,
        kt: found.kt,
    };
    Ok((row, Some(rows)))
}
