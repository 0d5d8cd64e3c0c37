//! Backbone of a joint: of an unworn joint in memory, or of a committed iteration from its tables. The backbone is
//! not a stage, and no run is changed.

use super::RunError;
use super::contact_state::harmonics_of;
use super::dynamic_response::{contact_elements, dynamics_error, harmonic_tolerance};
use super::forced_response;
use super::observer::Observer;
use super::recompute::require_own;
use super::runner::Runner;
use super::solvers::{Solvers, given_parameters};
use super::stage::Stage;
use super::stage_inputs::StageInputs;
use std::rc::Rc;

use crate::dynamics::{
    Backbone, ContactElement, DrivenStructure, DynamicsError, HarmonicBalance, Harmonics,
    LoadLevels, Vibration, resonance_over_parameter,
};
use crate::recipe::Inputs;
use crate::store::{Cache, RunReader};
use crate::tables::{Tables, typed};

/// Computes the backbone of the unworn joint of a scene in memory. If there is a cache, a reduced structure is stored
/// there. Nothing else is written.
///
/// # Errors
/// [`RunError`] of the earlier stages, and [`RunError::Dynamics`] if there is no phase resonance at the lowest level.
///
/// # Panics
/// If the recipe lacks structure or response.
pub fn backbone_of_scene(
    inputs: &Inputs,
    cache: Option<&Cache>,
    levels: LoadLevels,
    threads: usize,
    observer: &dyn Observer,
) -> Result<Backbone, RunError> {
    let has_resonance = harmonic_tolerance(&inputs.recipe).is_some();
    unworn(
        inputs,
        cache,
        threads,
        observer,
        has_resonance,
        |reads, solvers| backbone(reads, solvers, levels),
    )
}

/// Computes the phase resonance of the unworn joint as a function of a value in its scene. `inputs_at` returns the
/// inputs for a value. The harmonics of the first value are used for all values. An error after the first resonance
/// ends the curve and is returned with it.
///
/// # Errors
/// Errors of `inputs_at`, [`RunError`] of the stages before the resonance, and [`RunError::Dynamics`] if the first
/// value has no phase resonance.
///
/// # Panics
/// If the recipe lacks structure or response.
pub fn resonance_of_scenes<E: From<RunError>>(
    mut inputs_at: impl FnMut(f64) -> Result<Inputs, E>,
    cache: Option<&Cache>,
    levels: LoadLevels,
    threads: usize,
    observer: &dyn Observer,
) -> Result<(Backbone, Option<E>), E> {
    let mut harmonics: Option<Harmonics> = None;
    let driven = |value: f64| -> Result<DrivenStructure, CurveError<E>> {
        let inputs = inputs_at(value).map_err(CurveError)?;
        let has_resonance = harmonic_tolerance(&inputs.recipe).is_some();
        let result = unworn(
            &inputs,
            cache,
            threads,
            observer,
            has_resonance,
            |reads, solvers| {
                let (vibration, balance) = balance(reads, solvers, harmonics.as_ref())?;
                Ok(vibration.driven_structure(balance))
            },
        );
        let driven = result.map_err(|error| CurveError(error.into()))?;
        harmonics.get_or_insert_with(|| driven.balance.harmonics().clone());
        Ok(driven)
    };
    match resonance_over_parameter(levels, driven) {
        Ok((backbone, broken)) => Ok((backbone, broken.map(|CurveError(error)| error))),
        Err(CurveError(error)) => Err(error),
    }
}

/// Error during the computation of a point of the curve. The solver, the inputs or a stage can cause the error.
struct CurveError<E>(E);

impl<E: From<RunError>> From<DynamicsError> for CurveError<E> {
    fn from(source: DynamicsError) -> CurveError<E> {
        let wear_iteration = 0;
        CurveError(
            RunError::Dynamics {
                wear_iteration,
                source,
            }
            .into(),
        )
    }
}

/// Calls `work` with the inputs of the forced response of the unworn joint of a scene. The resonance, which
/// determines the harmonics, is computed only if `has_resonance` is true.
pub(super) fn unworn<T>(
    inputs: &Inputs,
    cache: Option<&Cache>,
    threads: usize,
    observer: &dyn Observer,
    has_resonance: bool,
    work: impl FnOnce(&StageInputs, &mut Solvers) -> Result<T, RunError>,
) -> Result<T, RunError> {
    let mut runner = Runner::new(inputs, threads, observer);
    runner.once_in_memory(cache)?;
    let is_needed = |stage: Stage| stage != Stage::DynamicResponse || has_resonance;
    let tables = runner.unworn_in_memory(Stage::ForcedResponse, is_needed)?;
    let no_tables = Tables::new();
    runner.with_inputs(
        &forced_response::DECLARATION,
        0,
        [&tables, &no_tables],
        work,
    )
}

/// Computes the backbone of a committed iteration. The computation uses the contact elements of the iteration, and the
/// harmonics of the response.
///
/// # Errors
/// [`RunError::OfAnotherScene`], errors of reading the run, and [`RunError::Dynamics`] if there is no phase resonance
/// at the lowest level.
///
/// # Panics
/// If the recipe lacks structure or response.
pub fn backbone_of_run(
    reader: &RunReader,
    inputs: &Inputs,
    wear_iteration: u64,
    levels: LoadLevels,
    threads: usize,
    observer: &dyn Observer,
) -> Result<Backbone, RunError> {
    require_own(reader, wear_iteration)?;
    at_iteration(
        reader,
        inputs,
        wear_iteration,
        threads,
        observer,
        |reads, solvers| backbone(reads, solvers, levels),
    )
}

/// Calls `work` with the inputs of the forced response of a committed iteration.
pub(super) fn at_iteration<T>(
    reader: &RunReader,
    inputs: &Inputs,
    wear_iteration: u64,
    threads: usize,
    observer: &dyn Observer,
    work: impl FnOnce(&StageInputs, &mut Solvers) -> Result<T, RunError>,
) -> Result<T, RunError> {
    let stage = &forced_response::DECLARATION;
    let mut runner = Runner::new(inputs, threads, observer);
    runner.load_once(reader)?;
    // A later stage may have overwritten a table. The forced response needs only pressure and gap, which are the same
    // in both versions of the table.
    let commit = reader.commit_of(wear_iteration)?;
    let table_names = stage.reads.iter().copied();
    let stored_names = table_names.filter(|name| commit.table(name.as_str()).is_some());
    let tables: Tables = stored_names
        .map(|name| Ok((name, reader.read(wear_iteration, name)?)))
        .collect::<Result<_, RunError>>()?;
    let table_sets = [&tables, &Tables::new()];
    runner.with_inputs(stage, wear_iteration, table_sets, work)
}

/// Computes the backbone from the inputs of the forced response.
fn backbone(
    reads: &StageInputs,
    solvers: &mut Solvers,
    levels: LoadLevels,
) -> Result<Backbone, RunError> {
    let (vibration, balance) = balance(reads, solvers, None)?;
    let result = vibration.backbone(balance, levels);
    result.map_err(|source| dynamics_error(reads, source))
}

type Balance = HarmonicBalance<ContactElement>;

/// Returns the vibration of the joint and the harmonic balance of the vibration with the given `harmonics`. Without
/// `harmonics`, the balance uses the harmonics of the stored response. Without a stored response, the balance uses the
/// harmonics of the scene.
fn balance(
    reads: &StageInputs,
    solvers: &mut Solvers,
    harmonics: Option<&Harmonics>,
) -> Result<(Rc<Vibration>, Balance), RunError> {
    let vibration = solvers.vibration(reads)?;
    let parameters = match reads.optional_table::<typed::ModelUpdate>()? {
        Some(update) => forced_response::worn_elements(reads, solvers, &update)?,
        None => given_parameters(reads),
    };
    let in_force = reads.optional_table::<typed::DynamicResponse>()?;
    let stepped_part = in_force.and_then(|row| row.stepped_part).unwrap_or(1.0);
    let harmonics = match (harmonics, reads.optional_table::<typed::Response>()?) {
        (Some(harmonics), _) => harmonics.clone(),
        (None, Some(response)) => harmonics_of(&response)?.0,
        (None, None) => vibration.harmonics.clone(),
    };
    let elements = contact_elements(reads, &parameters, stepped_part);
    let balance = vibration.balance_of(elements, harmonics);
    let balance = balance.map_err(|source| dynamics_error(reads, source))?;
    Ok((vibration, balance))
}

/// Adds the points of a backbone to a table. `state` names the worn state after `cycles`. `over` contains the varied
/// key and its values in SI units, if it is not the force.
pub fn add_backbone(
    table: &mut typed::Backbone,
    state: &str,
    (wear_iteration, cycles): (u64, u64),
    backbone: &Backbone,
    over: Option<(&str, &[f64])>,
) {
    for (k, point) in backbone.points.iter().enumerate() {
        if let Some((key, values)) = over {
            table.key.get_or_insert_default().push(key.to_owned());
            table.value.get_or_insert_default().push(values[k]);
        }
        table.state.push(state.to_owned());
        table.iteration.push(wear_iteration as i64);
        table.cycles.push(cycles as i64);
        table.branch.push(point.branch as i64);
        table.force.push(point.force);
        table.frequency.push(point.frequency);
        table.damping_ratio.push(point.damping_ratio);
        table.amplitude.push(point.amplitude);
        table.kinetic_energy.push(point.kinetic_energy);
        table.input_energy.push(point.energy.load_work);
        table.friction_energy.push(point.energy.friction);
        table.viscous_energy.push(point.energy.viscous);
        table.hysteretic_energy.push(point.energy.hysteretic);
        table.sliding_fraction.push(point.sliding_fraction());
        table.open_fraction.push(point.open_fraction());
    }
}
