//! A vibration without a rough contact: one response, nothing wears.

use super::context::{Clock, VibrationKeys, is_kept, kept, put};
use super::dynamic_response::{IN_FORCE, forced_response, in_force, tell_missed};
use super::model_update::element_table;
use super::structure::Stored;
use super::{Observer, RunError, Stage};
use crate::dynamics::DynamicsError;
use crate::model_update::ElementParameters;
use crate::recipe::Inputs;
use crate::recipe::build::Layout;
use crate::store::{Draft, RunStore, StageKey};
use crate::tables::{TableName, typed};

/// Computes and commits the only iteration.
pub fn vibration_alone(
    inputs: &Inputs,
    stored: Stored,
    store: &mut RunStore,
    clock: &mut Clock,
) -> Result<(), RunError> {
    let keys = VibrationKeys::of(inputs, &stored.key, &[]);
    let mut draft = store.draft(0)?;
    let recipe = &inputs.recipe;
    let given = recipe.elements().and_then(|elements| elements.given());
    let (layout, parameters) = match (&recipe.structure, given) {
        (Some(structure), Some(parameters)) => (structure.layout(), parameters),
        _ => (Layout::default(), ElementParameters::default()),
    };
    if !is_complete(&mut draft, &keys, !layout.centres.is_empty())? {
        let observer = clock.observer;
        clock.timed(Stage::DynamicResponse, || {
            let key = &keys.dynamic_response;
            respond(
                inputs,
                &stored,
                observer,
                &mut draft,
                key,
                &layout,
                &parameters,
            )
        })?;
    }
    put(&mut draft, &keys.dynamic_response, &clock.table())?;
    store.commit(draft)?;
    Ok(())
}

/// True if an earlier start left all tables in the draft.
fn is_complete(
    draft: &mut Draft,
    keys: &VibrationKeys,
    has_contact: bool,
) -> Result<bool, RunError> {
    let key = &keys.dynamic_response;
    let Some(summary) = kept::<typed::Summary>(draft, key)? else {
        return Ok(false);
    };
    let has_resonance = summary.resonance_frequency.is_some();
    for name in tables(has_contact, has_resonance).chain([TableName::Frf]) {
        if !is_kept(draft, name, key)? {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The tables beside the forced response and the summary.
fn tables(has_contact: bool, has_resonance: bool) -> impl Iterator<Item = TableName> {
    IN_FORCE.into_iter().filter(move |name| match name {
        TableName::ContactElement => has_contact,
        TableName::JointCycle => has_contact && has_resonance,
        _ => has_resonance,
    })
}

fn respond(
    inputs: &Inputs,
    stored: &Stored,
    observer: &dyn Observer,
    draft: &mut Draft,
    key: &StageKey,
    layout: &Layout,
    parameters: &ElementParameters,
) -> Result<(), RunError> {
    let recipe = &inputs.recipe;
    let (Some(structure), Some(response)) = (&recipe.structure, &recipe.response) else {
        unreachable!("what vibrates has a structure and a response");
    };
    let elements = recipe
        .elements()
        .map(|elements| elements.with(layout, parameters));
    let elements = elements.unwrap_or_default();
    let reduced = stored.reduced.as_ref();
    let vibration =
        structure.vibration(response, recipe.elements().is_some(), reduced, &elements)?;
    let fail = |source| RunError::Dynamics {
        wear_iteration: 0,
        source,
    };
    let has_contact = !elements.is_empty();
    let tolerance = response.harmonic_tolerance;
    let resolved = match vibration.resolve(elements.clone(), None, tolerance) {
        Ok(resolved) => {
            tell_missed(observer, tolerance, &resolved);
            Some(resolved)
        }
        // The forced response has an answer all the same.
        Err(error @ DynamicsError::NoResonance { .. }) => {
            observer.notice(&format!("dynamics.frequency: {error}"));
            None
        }
        Err(error) => return Err(fail(error)),
    };
    let mut summary = typed::Summary::default();
    if let Some(resolved) = &resolved {
        let tables = in_force(inputs, layout, resolved, parameters)?;
        let (resonance, truncation) = (&resolved.resonance, &resolved.truncation);
        put(draft, key, &tables.response)?;
        put(draft, key, &tables.row)?;
        if has_contact {
            put(draft, key, &tables.cycle)?;
            put(draft, key, &tables.elements)?;
        }
        summary = typed::Summary {
            dissipated_energy: Some(resonance.phase.energy.friction),
            resonance_frequency: Some(resonance.phase.frequency()),
            peak_frequency: Some(resonance.peak_frequency),
            peak_amplitude: Some(resonance.peak_amplitude),
            error_dissipated_energy: Some(truncation.friction_energy),
            error_resonance_frequency: Some(truncation.frequency),
            error_peak_amplitude: Some(truncation.amplitude),
            ..summary
        };
    } else if has_contact {
        put(draft, key, &element_table(layout, parameters, None))?;
    }
    if has_contact {
        summary.kn = Some(parameters.kn.iter().sum());
        summary.kt = Some(parameters.kt.iter().sum());
    }
    let balance = match resolved {
        Some(resolved) => resolved.balance,
        None => vibration.balance(elements).map_err(fail)?,
    };
    let frf = forced_response(inputs, &vibration, balance, 0)?;
    put(draft, key, &frf)?;
    put(draft, key, &summary)
}
