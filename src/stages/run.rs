//! The loop over wear iterations.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use super::RunError;
use super::grid_twin::with_twin;
use super::joint_state::RunEnds;
use super::list::stages_of;
use super::observer::{Observer, Progress};
use super::reduced::ReducedTables;
use super::run_cost::RunCost;
use super::runner::Runner;
use super::stage::{Stage, When};
use crate::model_update::UpdateCriterion;
use crate::recipe::{Durability, Inputs, Keep as KeepOf, Recipe, StoredPlan};
use crate::store::{
    Cache, FileSystem, Keep, RunIdentity, RunReader, RunStore, UnsyncedFileSystem, check_plan,
    sync_all,
};
use crate::tables::{Table, TableName, typed};

/// Keys that do not affect computed iterations. The keys define the end of a run, the kept iterations, and the times of
/// writing to the disk.
pub const FREE_KEYS: [&str; 7] = [
    "wear.cycles",
    "wear.volume",
    "wear.until.*",
    "output.durability",
    "output.keep.*",
    "output.response_at.*",
    "output.resonance",
];

/// A sibling run and the source run must have equal values of the keys `INHERITED_KEYS`. The inherited wear applies
/// only to the same cells and heights. In a scene with a structure, the wear belongs to the cells of the contact
/// elements.
const INHERITED_KEYS: [&str; 3] = ["joint.*", "surface.*", "structure.kind"];

/// Start of a sibling run: an iteration of another run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// Folder of the source run.
    pub run: PathBuf,
    /// Iteration of the source run.
    pub wear_iteration: u64,
}

/// Options of a run.
pub struct RunOptions<'a> {
    /// Recipe of the run, and the contents of the input files of the recipe.
    pub inputs: &'a Inputs,
    /// Folder of the run.
    pub root: PathBuf,
    /// Iteration of another run from which the run begins.
    pub source: Option<Source>,
    /// The run ends after this stage.
    pub until: Option<Stage>,
    /// Number of threads for the transforms of the contact solvers. Results do not depend on the number of threads.
    pub threads: usize,
    /// Cache of reduced structures, shared between runs; `None` disables sharing.
    pub cache: Option<Cache>,
    /// File system for all files of the run.
    pub file_system: Arc<dyn FileSystem>,
    /// `run` calls `stop` before every iteration except the unworn iteration. The argument of `stop` is the number of
    /// iterations committed since the start. If `stop` returns true, the run ends before the iteration.
    pub stop: &'a dyn Fn(u64) -> bool,
}

/// Reason why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The scene is complete.
    Done,
    /// The requested stage is complete.
    Until(Stage),
    /// The run was asked to stop.
    Stopped,
}

/// Results of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Reason why the run ended.
    pub ending: Ending,
    /// The last committed iteration.
    pub wear_iteration: Option<u64>,
    /// Hash of the commit of the last committed iteration, as known to the current process.
    pub commit: Option<String>,
    /// Summary of the last committed iteration.
    pub summary: Option<Table>,
    /// The unworn joint and the joint of the last iteration.
    pub ends: Option<RunEnds>,
    /// Cost of the run, over all its starts.
    pub spent: RunCost,
}

/// Begins or continues a run.
///
/// # Errors
/// [`RunError`]. Committed iterations remain, and finished stages of the next iteration are used again.
pub fn run(options: &RunOptions, observer: &dyn Observer) -> Result<Outcome, RunError> {
    let inputs = options.inputs;
    check_until(&inputs.recipe, options.until)?;
    if inputs.recipe.grid_check && options.source.is_some() {
        return Err(RunError::GridCheck {
            reason: "the run on half the grid starts from the unworn scene, but this run begins from another run",
        });
    }
    let mut store = open(options, observer)?;
    let ending = match run_with_grid_check(options, &mut store, observer) {
        Ok(ending) => ending,
        Err(RunError::EndedBefore(_)) => Ending::Stopped,
        Err(error) => {
            store.note_failure(&error.to_string());
            return Err(error);
        }
    };
    let outcome = outcome(&mut store, inputs, ending)?;
    if inputs.recipe.output.durability == Durability::End {
        sync_all(options.file_system.as_ref(), &options.root)?;
    }
    Ok(outcome)
}

/// If the scene requests a grid check, runs the scene on half the grid first. Then runs the scene on the whole grid.
fn run_with_grid_check(
    options: &RunOptions,
    store: &mut RunStore,
    observer: &dyn Observer,
) -> Result<Ending, RunError> {
    let stops_before = |stage| stage < Stage::GridTwin;
    if !options.inputs.recipe.grid_check
        || options.until.is_some_and(stops_before)
        || options.until.is_none() && is_complete(store, options.inputs, observer)?
    {
        return pass_through(options, store, observer);
    }
    let Some(inputs) = with_twin(options, observer)? else {
        return Ok(Ending::Stopped);
    };
    let options = RunOptions {
        inputs: &inputs,
        root: options.root.clone(),
        source: options.source.clone(),
        cache: options.cache.clone(),
        file_system: options.file_system.clone(),
        ..*options
    };
    pass_through(&options, store, observer)
}

/// Runs the stages that are due once per run, then all iterations.
fn pass_through(
    options: &RunOptions,
    store: &mut RunStore,
    observer: &dyn Observer,
) -> Result<Ending, RunError> {
    let inputs = options.inputs;
    if options.until.is_none() && is_complete(store, inputs, observer)? {
        return Ok(Ending::Done);
    }
    let mut runner = Runner::new(inputs, options.threads, observer);
    for stage in stages_of(&inputs.recipe).filter(|stage| stage.when == When::Once) {
        runner.once(stage, store, options.cache.as_ref())?;
        if options.until == Some(stage.stage) {
            return Ok(Ending::Until(stage.stage));
        }
    }
    let mut commits = 0;
    loop {
        if is_done(store, inputs, observer)? {
            return Ok(Ending::Done);
        }
        if store.latest().is_some() && (options.stop)(commits) {
            return Ok(Ending::Stopped);
        }
        let next = store.next();
        let ended_stage = runner.iteration(store, options.until)?;
        if store.next() > next {
            commits += 1;
            report_commit(store, inputs, observer)?;
            if store.is_history_due() {
                prune(store, inputs)?;
            }
        }
        if let Some(stage) = ended_stage {
            return Ok(Ending::Until(stage));
        }
    }
}

/// Returns true if a run is done and all its tables exist. The next start computes a damaged or missing table of
/// `once/` again, even after the end of the run.
fn is_complete(
    store: &RunStore,
    inputs: &Inputs,
    observer: &dyn Observer,
) -> Result<bool, RunError> {
    let reader = store.reader();
    let mut has_tables = reader.is_once_sound()?;
    for stage in stages_of(&inputs.recipe).filter(|stage| stage.when == When::Once) {
        for table in stage.writes_in(&inputs.recipe) {
            has_tables = has_tables && reader.has_once(table)?;
        }
    }
    if !has_tables || !is_done(store, inputs, observer)? {
        return Ok(false);
    }
    let once = reader.verify_once()?;
    let is_sound = once.iter().all(|report| report.damage.is_none());
    Ok(is_sound && ReducedTables::damage(reader)?.is_none())
}

/// Returns true if the last iteration reaches the end of the scene. The error bar of the last iteration may still
/// exceed the requested tolerance.
fn is_done(store: &RunStore, inputs: &Inputs, observer: &dyn Observer) -> Result<bool, RunError> {
    let Some(latest) = store.latest() else {
        return Ok(false);
    };
    let Some(wear) = &inputs.recipe.wear else {
        return Ok(true);
    };
    let summary: typed::Summary = store.typed(latest)?;
    let (cycles, volume) = (
        summary.cycles.unwrap_or(0),
        summary.wear_volume.unwrap_or(0.0),
    );
    let has_lost = has_lost_before(store.reader(), &inputs.recipe, latest)?;
    if !has_lost && !wear.is_reached(cycles as u64, volume) {
        return Ok(false);
    }
    let value = |bar: Option<f64>| bar.unwrap_or(0.0);
    let vibration_error = value(summary.error_harmonics) + value(summary.error_closure);
    let step_error = value(summary.error_wear_volume) - vibration_error;
    if let Some(requested) = inputs
        .recipe
        .asked_error
        .filter(|requested| step_error > *requested)
    {
        observer.notice(&format!(
            "fidelity.tolerance = {requested}: the wear steps contribute {step_error:.2e} to the error bar of wear_volume; reduce fidelity.tolerance or wear.tolerance"
        ));
    }
    Ok(true)
}

/// Returns true if the previous iteration had lost the preload that ends a run.
///
/// # Errors
/// Errors of reading the run.
pub(super) fn has_lost_before(
    reader: &RunReader,
    recipe: &Recipe,
    wear_iteration: u64,
) -> Result<bool, RunError> {
    let ends = recipe
        .wear
        .as_ref()
        .is_some_and(|wear| wear.until_preload.is_some());
    let Some(before) = wear_iteration.checked_sub(1).filter(|_| ends) else {
        return Ok(false);
    };
    // If another scene computed the previous iteration, the loss of load in the previous iteration does not count.
    if reader.scene_hash_of(before)? != reader.record().scene_hash {
        return Ok(false);
    }
    let row = reader.history()?.row::<typed::Summary>(before)?;
    Ok(row.is_some_and(|row| recipe.ends_after(row.normal_load, row.error_normal_load)))
}

fn check_until(recipe: &Recipe, until: Option<Stage>) -> Result<(), RunError> {
    let stages: Vec<Stage> = stages_of(recipe).map(|stage| stage.stage).collect();
    match until {
        Some(stage) if !stages.contains(&stage) => Err(RunError::NoSuchStage { stage, stages }),
        _ => Ok(()),
    }
}

/// Returns the identity of a run with the given inputs.
pub fn identity_of(inputs: &Inputs) -> RunIdentity {
    let surface = inputs.recipe.surface();
    let seed = surface.and_then(|surface| surface.heights.seed());
    RunIdentity {
        scene: inputs.identity.scene.clone(),
        scene_toml: inputs.identity.scene_toml.clone(),
        scene_written: inputs.identity.scene_written.clone(),
        plan: inputs.identity.plan.clone(),
        program_version: env!("CARGO_PKG_VERSION").to_owned(),
        threads: 1,
        seed,
        free_keys: FREE_KEYS.map(str::to_owned).to_vec(),
        following_keys: inputs.identity.following.map(str::to_owned).to_vec(),
        inherited_keys: INHERITED_KEYS.map(str::to_owned).to_vec(),
    }
}

fn open(options: &RunOptions, observer: &dyn Observer) -> Result<RunStore, RunError> {
    let inputs = options.inputs;
    let identity = identity_of(inputs);
    let file_system: Arc<dyn FileSystem> = match inputs.recipe.output.durability {
        Durability::Commit => options.file_system.clone(),
        Durability::End => Arc::new(UnsyncedFileSystem(options.file_system.clone())),
    };
    check_plan(file_system.clone(), &options.root, StoredPlan::of)?;
    let (mut store, opening) = match &options.source {
        None => RunStore::create_or_open(file_system, &options.root, &identity)?,
        Some(source) => RunStore::create_sibling(
            file_system,
            &options.root,
            &identity,
            &source.run,
            source.wear_iteration,
        )?,
    };
    observer.opened(&opening);
    if let Some(notice) = inputs.recipe.pressing_notice() {
        observer.notice(notice);
    }
    if inputs.recipe.wear.is_some() {
        report_commit(&store, inputs, observer)?;
    }
    // Prune the run at each start, because a finished run makes no further commit that prunes. An earlier process may
    // have ended before pruning, or the scene may keep fewer iterations than before.
    prune(&mut store, inputs)?;
    Ok(store)
}

fn report_commit(
    store: &RunStore,
    inputs: &Inputs,
    observer: &dyn Observer,
) -> Result<(), RunError> {
    let Some(wear_iteration) = store.latest() else {
        return Ok(());
    };
    let mut summary: typed::Summary = store.typed(wear_iteration)?;
    if inputs.recipe.wear.is_none() {
        summary = typed::Summary::default();
    }
    observer.committed(&Progress {
        wear_iteration,
        cycles: summary.cycles.unwrap_or(0) as u64,
        volume: summary.wear_volume.unwrap_or(0.0),
        error: summary.error_wear_volume.unwrap_or(0.0),
    });
    Ok(())
}

fn prune(store: &mut RunStore, inputs: &Inputs) -> Result<(), RunError> {
    if let KeepOf::Some {
        every,
        last,
        updates,
    } = inputs.recipe.output.keep
    {
        let mut also = BTreeSet::new();
        let criterion = inputs
            .recipe
            .elements()
            .map(|elements| elements.update.criterion);
        if updates && criterion.is_some_and(|criterion| criterion != UpdateCriterion::Never) {
            for wear_iteration in store.reader().iterations() {
                if store.typed::<typed::ModelUpdate>(wear_iteration)?.updated {
                    also.insert(wear_iteration);
                }
            }
        }
        store.prune(&Keep { every, last, also })?;
    }
    Ok(())
}

fn outcome(store: &mut RunStore, inputs: &Inputs, ending: Ending) -> Result<Outcome, RunError> {
    prune(store, inputs)?;
    store.write_history()?;
    if ending == Ending::Done {
        store.clear_staging()?;
    }
    let spent = RunCost::of(store.reader())?;
    let wear_iteration = store.latest();
    let summary = wear_iteration
        .map(|k| store.read(k, TableName::Summary))
        .transpose()?;
    let commit = wear_iteration.map(|k| store.reader().commit_of(k));
    let commit = commit.transpose()?.map(|commit| commit.hash.clone());
    let ends = RunEnds::of(store.reader())?;
    Ok(Outcome {
        ending,
        wear_iteration,
        commit,
        summary,
        ends,
        spent,
    })
}
