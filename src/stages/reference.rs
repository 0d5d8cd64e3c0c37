//! The run solves the unworn joint under the load of the scene once. The unworn joint is the reference for all changes
//! during the run.

use super::RunError;
use super::contact_elements::{linearise, springs};
use super::contact_state::contact_of;
use super::declaration::{Declaration, joined};
use super::error::NumericsError;
use super::reduced;
use super::solvers::Solvers;
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use crate::model_update::{Compliance, ElementParameters, StiffnessKind};
use crate::recipe::{ElementStiffness, Part};
use crate::tables::{TableName, typed};
use crate::wear::WearError;

/// The stage computes the approach at which a bolt begins to lose load. The stage also computes the contact elements
/// whose springs define the modal damping of the stuck joint.
pub const DECLARATION: Declaration = Declaration {
    stage: Stage::Reference,
    when: When::Once,
    recipe: &[Part::Surface, Part::Contact, Part::Cycle, Part::Elements],
    reads: &joined::<6>(&[&reduced::TABLES, &[TableName::Surface]]),
    before: &[],
    writes: &[TableName::Reference, TableName::ReferenceElement],
    is_due: |_| true,
    shared: false,
    compute,
};

fn compute(reads: &StageInputs, solvers: &mut Solvers) -> Result<Outputs, RunError> {
    let run_error = |source| match source {
        NumericsError::ModelUpdate(source) => RunError::ModelUpdate(source),
        NumericsError::Wear(WearError::Contact(source)) => RunError::Unworn(source),
        NumericsError::Wear(source) => RunError::Wear {
            stage: Stage::Reference,
            wear_iteration: 0,
            source,
        },
    };
    let mut outputs = Outputs::default();
    let (row, rows) = unworn_reference(reads, solvers, run_error)?;
    outputs.add_table(&row)?;
    if let Some(rows) = rows {
        outputs.add_table(&rows)?;
    }
    Ok(outputs)
}

fn unworn_reference(
    reads: &StageInputs,
    solvers: &mut Solvers,
    run_error: impl Fn(NumericsError) -> RunError,
) -> Result<(typed::Reference, Option<typed::ReferenceElement>), RunError> {
    let recipe = &reads.recipe;
    let load = contact_of(recipe).conditions.normal_load;
    let pressing = contact_of(recipe).pressing.as_ref();
    let joint = solvers.pressed_joint(reads, load)?;
    let wear = vec![0.0; joint.patch.grid.len()];
    let contact_error =
        |error: crate::contact::ContactError| run_error(WearError::Contact(error).into());
    let unworn = match pressing.is_some_and(|pressing| pressing.preload.is_found()) {
        true => joint.tighten_bolt(load),
        false => joint.contact(&wear, None, load, None),
    };
    let unworn = unworn.map_err(|error| run_error(error.into()))?;
    let mut row = typed::Reference {
        approach: unworn.approach,
        preload: joint.pressing.as_ref().map(|pressing| pressing.preload),
        shortening: joint.pressing.as_ref().map(|pressing| pressing.shortening),
        mesh_ratio: joint
            .pressing
            .as_ref()
            .and_then(|pressing| pressing.mesh_ratio),
        ..typed::Reference::default()
    };
    let Some(element_recipe) = recipe.elements() else {
        return Ok((row, None));
    };
    let smooth = match element_recipe.stiffness {
        ElementStiffness::Contact {
            stiffness: StiffnessKind::Roughness,
            ..
        } => {
            let shear = contact_of(recipe).shear;
            let smooth = Compliance::smooth(&mut joint.half_space, &joint.patch, shear);
            Some(smooth.map_err(contact_error)?)
        }
        _ => None,
    };
    row.smooth_compliance_normal = smooth.map(|smooth| smooth.normal);
    row.smooth_compliance_tangential = smooth.map(|smooth| smooth.tangential);
    let linearisation = linearise(recipe, joint, &unworn.pressure).map_err(contact_error)?;
    let elements = solvers.elements(reads)?;
    let springs = springs(recipe, &linearisation, smooth);
    let parameters = ElementParameters::new(&elements, &unworn.pressure, &unworn.gap, springs)?;
    let rows = typed::ReferenceElement {
        element: (0..parameters.normal_load.len() as i32).collect(),
        normal_load: parameters.normal_load,
        gap: parameters.gap,
        kn: parameters.kn,
        kt: parameters.kt,
    };
    Ok((row, Some(rows)))
}
