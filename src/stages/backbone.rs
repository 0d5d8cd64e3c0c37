//! The backbone of a joint: unworn in memory, or of a committed iteration from its tables. It is no stage of a run, and no run is changed.

use super::RunError;
use super::contact_elements::parameters;
use super::contact_state::{harmonics_of, parameters_of};
use super::dynamic_response::{contact_elements, failed, harmonic_tolerance};
use super::forced_response;
use super::observer::Observer;
use super::reads::Reads;
use super::recompute::require_own;
use super::runner::{Runner, committed};
use super::solvers::{Solvers, given};
use super::stage::Stage;
use crate::dynamics::{Backbone, Levels};
use crate::recipe::Inputs;
use crate::store::{Cache, RunReader};
use crate::tables::{Tables, typed};

/// The backbone of the unworn joint of a scene. What leads to it is computed in memory; nothing is written but, where there is a cache, a
/// reduced structure.
///
/// # Errors
/// [`RunError`] of the stages before it, and [`RunError::Dynamics`] if the least level has no phase resonance.
///
/// # Panics
/// On a recipe without structure and response.
pub fn backbone_of_scene(
    inputs: &Inputs,
    cache: Option<&Cache>,
    levels: Levels,
    threads: usize,
    observer: &dyn Observer,
) -> Result<Backbone, RunError> {
    let mut runner = Runner::new(inputs, threads, observer);
    runner.once_in_memory(cache)?;
    // The harmonics are those of the resonance; where they are given, it is not needed.
    let has_resonance = harmonic_tolerance(&inputs.recipe).is_some();
    let is_needed = |stage: Stage| stage != Stage::DynamicResponse || has_resonance;
    let tables = runner.unworn_in_memory(Stage::ForcedResponse, is_needed)?;
    let none = Tables::new();
    runner.reading(
        &forced_response::DECLARATION,
        0,
        [&tables, &none],
        |reads, solvers| backbone(reads, solvers, levels),
    )
}

/// The backbone of a committed iteration, with the contact elements that its own fine contact gives, and in the harmonics of its response.
///
/// # Errors
/// [`RunError::OfAnotherScene`], those of reading the run, and [`RunError::Dynamics`] if the least level
/// has no phase resonance.
///
/// # Panics
/// On a recipe without structure and response.
pub fn backbone_of_run(
    reader: &RunReader,
    inputs: &Inputs,
    wear_iteration: u64,
    levels: Levels,
    threads: usize,
    observer: &dyn Observer,
) -> Result<Backbone, RunError> {
    require_own(reader, wear_iteration)?;
    let stage = &forced_response::DECLARATION;
    let mut runner = Runner::new(inputs, threads, observer);
    runner.take_once(reader)?;
    // A later stage may have written one of them again: pressure and gap, which count here, are the same in both.
    let commit = reader.commit_of(wear_iteration)?;
    let read = stage.reads.iter().copied();
    let of_iteration = read.filter(|name| commit.table(name.as_str()).is_some());
    let tables: Tables = of_iteration
        .map(|name| Ok((name, committed(reader, wear_iteration, name)?)))
        .collect::<Result<_, RunError>>()?;
    let read = [&tables, &Tables::new()];
    runner.reading(stage, wear_iteration, read, |reads, solvers| {
        backbone(reads, solvers, levels)
    })
}

/// What the forced response reads is what the backbone reads.
fn backbone(reads: &Reads, solvers: &mut Solvers, levels: Levels) -> Result<Backbone, RunError> {
    let vibration = solvers.vibration(reads)?;
    let parameters = match reads.maybe::<typed::ModelUpdate>()? {
        Some(update) if update.updated => parameters_of(&reads.table()?, reads.maybe()?),
        Some(_) => parameters(reads, solvers, &reads.table()?, &reads.table()?)?.0,
        None => given(reads),
    };
    let harmonics = match reads.maybe::<typed::Response>()? {
        Some(response) => harmonics_of(&response)?.0,
        None => vibration.harmonics.clone(),
    };
    let elements = contact_elements(reads, &parameters);
    let balance = vibration.balance_of(elements, harmonics);
    let found = balance.and_then(|balance| vibration.backbone(balance, levels));
    found.map_err(|source| failed(reads, source))
}

/// Adds the points of a backbone to a table, under the name of its state, which is after `cycles` of wear.
pub fn add_backbone(
    table: &mut typed::Backbone,
    state: &str,
    (wear_iteration, cycles): (u64, u64),
    backbone: &Backbone,
) {
    for point in &backbone.points {
        table.state.push(state.to_owned());
        table.iteration.push(wear_iteration as i64);
        table.cycles.push(cycles as i64);
        table.branch.push(point.branch as i64);
        table.force.push(point.force);
        table.frequency.push(point.frequency);
        table.damping_ratio.push(point.damping_ratio);
        table.amplitude.push(point.amplitude);
        table.kinetic_energy.push(point.kinetic_energy);
        table.input_energy.push(point.energy.input);
        table.friction_energy.push(point.energy.friction);
        table.viscous_energy.push(point.energy.viscous);
        table.sliding_fraction.push(point.sliding_fraction());
        table.open_fraction.push(point.open_fraction());
    }
}
