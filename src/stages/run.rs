//! The loop over wear iterations.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use super::context::{Clock, Context, Keys, is_kept, put};
use super::dynamic_response::{dynamic_response, worn_is_due, worn_response};
use super::ledger::ledger;
use super::model_update::{model_update, parameters};
use super::spent::Spent;
use super::state::{self, Committed};
use super::structure::Stored;
use super::summary::{FREE_KEYS, INHERITED_KEYS, summary};
use super::vibrating::Vibrating;
use super::vibration_alone::vibration_alone;
use super::{RunError, Stage, fretting_cycle, reference, static_contact, structure, surface, wear};
use crate::model_update::Criterion;
use crate::recipe::{self, Inputs};
use crate::store::{Cache, Draft, FileSystem, Keep, Opening, RunIdentity, RunStore, StageKey};
use crate::tables::{Table, TableName, typed};

/// Where a sibling run begins.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// Folder of the other run.
    pub run: PathBuf,
    /// The iteration of it.
    pub wear_iteration: u64,
}

/// What to run and how far.
pub struct RunOptions<'a> {
    /// The recipe, with what its files say.
    pub inputs: &'a Inputs,
    /// Folder of the run.
    pub root: PathBuf,
    /// Begin from another run's iteration.
    pub source: Option<Source>,
    /// End after this stage.
    pub until: Option<Stage>,
    /// Threads for the transforms of the contact solvers; results do not depend on their number.
    pub threads: usize,
    /// Where reduced structures are shared between runs; none: they are not.
    pub cache: Option<Cache>,
    /// Through which all files of the run are written and read.
    pub file_system: Arc<dyn FileSystem>,
    /// Asked before every iteration but the unworn one, with the number of iterations that this start has committed; true ends
    /// the run there.
    pub stop: &'a dyn Fn(u64) -> bool,
}

/// Who watches a run.
pub trait Observer {
    /// The run is open: where it continues, and what was found.
    fn opened(&self, opening: &Opening);
    /// Something the user should know.
    fn notice(&self, text: &str);
    /// A stage begins.
    fn stage(&self, stage: Stage, wear_iteration: u64);
    /// An iteration is committed.
    fn committed(&self, progress: &Progress);
}

/// How far a run is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// The iteration.
    pub wear_iteration: u64,
    /// Cycles behind it; 0 without wear.
    pub cycles: u64,
    /// Worn volume \[m³\].
    pub volume: f64,
    /// Estimated relative error of the wear field.
    pub error: f64,
}

/// Why a run came back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The scene is computed.
    Done,
    /// The stage asked for is computed.
    Until(Stage),
    /// It was asked to stop.
    Stopped,
}

/// What a run leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Why it ended.
    pub ending: Ending,
    /// The last committed iteration.
    pub wear_iteration: Option<u64>,
    /// Its summary.
    pub summary: Option<Table>,
    /// What the run has cost, over all its starts.
    pub spent: Spent,
}

/// Begins or continues a run.
pub fn run(options: &RunOptions, observer: &dyn Observer) -> Result<Outcome, RunError> {
    let inputs = options.inputs;
    check_until(inputs, options.until)?;
    let mut store = open(options, observer)?;
    // Damage to what is computed once a run is repaired by computing it again, also in a run that is done.
    let whole = options.until.is_none() && store.reader().is_once_sound()?;
    if whole && is_done(&store, inputs, observer)? {
        return outcome(&mut store, inputs, Ending::Done);
    }
    let mut clock = Clock {
        observer,
        wear_iteration: 0,
        timing: Vec::new(),
    };
    let stored = structure::structure(inputs, &mut store, options.cache.as_ref(), &mut clock)?;
    if options.until == Some(Stage::Structure) {
        return outcome(&mut store, inputs, Ending::Until(Stage::Structure));
    }
    let recipe = &inputs.recipe;
    match (recipe.surface().zip(recipe.contact()), stored) {
        (Some(rough), stored) => run_rough(options, store, clock, rough, stored),
        (None, Some(stored)) => {
            if store.latest().is_none() {
                vibration_alone(inputs, stored, &mut store, &mut clock)?;
                committed(&store, inputs, observer)?;
            }
            let ending = options.until.map_or(Ending::Done, Ending::Until);
            outcome(&mut store, inputs, ending)
        }
        (None, None) => unreachable!("a scene has a surface or a structure"),
    }
}

/// True if the last iteration is that which ends the scene. Its error bar may be wider than was asked for.
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
    if !wear.is_reached(cycles as u64, volume) {
        return Ok(false);
    }
    let of = |bar: Option<f64>| bar.unwrap_or(0.0);
    let of_vibration = of(summary.error_harmonics) + of(summary.error_closure);
    let steps = of(summary.error_wear_volume) - of_vibration;
    if let Some(asked) = inputs.recipe.asked_error.filter(|asked| steps > *asked) {
        observer.notice(&format!(
            "fidelity.tolerance = {asked}: the wear steps' part of the error bar of wear_volume is {steps:.2e}; give a smaller fidelity.tolerance or wear.tolerance"
        ));
    }
    Ok(true)
}

/// The stages of a scene, in their order.
fn stages_of(inputs: &Inputs) -> Vec<Stage> {
    let recipe = &inputs.recipe;
    let (rough, vibrates) = (recipe.surface().is_some(), recipe.structure.is_some());
    Stage::ALL
        .into_iter()
        .filter(|stage| match stage {
            Stage::Structure | Stage::DynamicResponse => vibrates,
            Stage::Surface | Stage::StaticContact => rough,
            Stage::Reference => {
                let bolt = recipe.contact().and_then(|c| c.bolt_stiffness);
                rough && (vibrates || bolt.is_some())
            }
            Stage::ModelUpdate => rough && vibrates,
            Stage::FrettingCycle => recipe.cycle().is_some(),
            Stage::Wear => recipe.wear.is_some(),
        })
        .collect()
}

fn check_until(inputs: &Inputs, until: Option<Stage>) -> Result<(), RunError> {
    let stages = stages_of(inputs);
    match until {
        Some(stage) if !stages.contains(&stage) => Err(RunError::NoSuchStage { stage, stages }),
        _ => Ok(()),
    }
}

fn run_rough(
    options: &RunOptions,
    mut store: RunStore,
    mut clock: Clock,
    (surface, contact): (&recipe::Surface, &recipe::Contact),
    stored: Option<Stored>,
) -> Result<Outcome, RunError> {
    let inputs = options.inputs;
    let observer = clock.observer;
    let unworn = surface::surface(inputs, surface, &mut store, observer)?;
    if options.until == Some(Stage::Surface) {
        return outcome(&mut store, inputs, Ending::Until(Stage::Surface));
    }
    clock.timing.extend(unworn.timing);
    let motion = inputs.motion.clone();
    let cycle = inputs.recipe.cycle();
    let mut joint = contact.joint(cycle, unworn.patch, unworn.height, motion);
    joint.half_space.set_threads(options.threads);
    let bolt = contact.bolt_stiffness;
    let elements = surface.contact_elements()?;
    let mut reference = None;
    if elements.is_some() || bolt.is_some() {
        let (elements, key) = (elements.as_ref(), &unworn.key);
        reference = Some(reference::reference(
            inputs, &mut joint, elements, key, &mut store, &mut clock,
        )?);
    }
    if options.until == Some(Stage::Reference) {
        return outcome(&mut store, inputs, Ending::Until(Stage::Reference));
    }
    let unworn_approach = reference
        .as_ref()
        .map(|r| r.approach)
        .filter(|_| bolt.is_some());
    let vibrating = match (stored, elements, &reference) {
        (Some(stored), Some(elements), Some(reference)) => Some(Vibrating::with_surface(
            inputs, stored, elements, reference,
        )?),
        _ => None,
    };
    let mut context = Context {
        inputs,
        joint,
        surface_key: unworn.key,
        clock,
        load: inputs.motion.mean_load(),
        unworn_approach,
        is_last: false,
    };
    let mut commits = 0;
    loop {
        if is_done(&store, inputs, observer)? {
            return outcome(&mut store, inputs, Ending::Done);
        }
        // Whatever the next iteration depends on is read back from what is committed, so that a run which is continued
        // computes from the very same numbers as one that is not interrupted.
        let before = match (store.latest(), &inputs.recipe.wear) {
            (Some(latest), Some(_)) => {
                context.clock.wear_iteration = latest;
                let vibrating = vibrating.as_ref();
                Some(state::read(&mut context, vibrating, &store, latest)?)
            }
            _ => None,
        };
        if store.latest().is_some() && (options.stop)(commits) {
            return outcome(&mut store, inputs, Ending::Stopped);
        }
        context.clock.wear_iteration = store.next();
        let mut draft = store.draft(context.clock.wear_iteration)?;
        let keys = Keys::of(
            inputs,
            &store,
            &context.surface_key,
            vibrating.as_ref().map(|vibrating| &vibrating.key),
            context.clock.wear_iteration,
        )?;
        if let Some(stage) = iterate(
            &mut context,
            vibrating.as_ref(),
            &mut draft,
            &keys,
            before.as_ref(),
            options.until,
        )? {
            return outcome(&mut store, inputs, Ending::Until(stage));
        }
        let timing = context.clock.table();
        put(&mut draft, &keys.fretting_cycle, &timing)?;
        store.commit(draft)?;
        commits += 1;
        committed(&store, inputs, observer)?;
        if store.is_history_due() {
            prune(&mut store, inputs)?;
        }
        let last = stages_of(inputs).last().copied();
        if let Some(stage) = options.until.filter(|until| Some(*until) == last) {
            return outcome(&mut store, inputs, Ending::Until(stage));
        }
    }
}

fn open(options: &RunOptions, observer: &dyn Observer) -> Result<RunStore, RunError> {
    let inputs = options.inputs;
    let surface = inputs.recipe.surface();
    let seed = surface.and_then(|surface| surface.heights.seed());
    let identity = RunIdentity {
        scene: inputs.identity.scene.clone(),
        scene_toml: inputs.identity.scene_toml.clone(),
        plan: inputs.identity.plan.clone(),
        program_version: env!("CARGO_PKG_VERSION").to_owned(),
        threads: 1,
        seed,
        free_keys: FREE_KEYS.map(str::to_owned).to_vec(),
        following_keys: inputs.identity.following.map(str::to_owned).to_vec(),
        inherited_keys: INHERITED_KEYS.map(str::to_owned).to_vec(),
    };
    let file_system = options.file_system.clone();
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
    if inputs.recipe.wear.is_some() {
        committed(&store, inputs, observer)?;
    }
    // A run that was killed before it pruned, or is finished and now keeps less, has no commit that would do it.
    prune(&mut store, inputs)?;
    Ok(store)
}

/// Computes the stages of one iteration. The stage after which to end, if it comes before the commit.
fn iterate(
    context: &mut Context,
    vibrating: Option<&Vibrating>,
    draft: &mut Draft,
    keys: &Keys,
    before: Option<&Committed>,
    until: Option<Stage>,
) -> Result<Option<Stage>, RunError> {
    let recipe = &context.inputs.recipe;
    let mut worn = match (&keys.wear, &recipe.wear, before) {
        (Some(key), Some(wear), Some(before)) => {
            wear::wear(context, draft, keys, key, wear, vibrating, before)?
        }
        _ => wear::unworn(context, draft, keys)?,
    };
    if until == Some(Stage::Wear) && keys.wear.is_some() {
        return Ok(until);
    }
    let cycles = before.map_or(0, |b| b.cycles) + worn.n_cycles;
    let volume = before.map_or(0.0, |b| b.volume) + worn.volume;
    context.reach(cycles, volume);
    let predicted = worn.predicted.take();
    let (contact, shear) =
        static_contact::static_contact(context, draft, keys, &worn.wear, predicted)?;
    if recipe.cycle().is_none() {
        let row = summary(context, before, &worn, &contact, None, None)?;
        put_summary(draft, &keys.static_contact, &row)?;
        return Ok(None);
    }
    if until == Some(Stage::StaticContact) {
        return Ok(until);
    }
    let driven = match (vibrating, &keys.vibration) {
        (Some(vibrating), Some(own)) => {
            let moved = before.and_then(|before| before.driven.as_ref());
            let model = moved.map(|driven| &driven.model);
            let model = model_update(context, vibrating, draft, own, &contact, volume, model)?;
            if until == Some(Stage::ModelUpdate) {
                return Ok(until);
            }
            let (inputs, clock) = (context.inputs, &mut context.clock);
            let driven = dynamic_response(inputs, vibrating, clock, draft, own, model, moved)?;
            if worn_is_due(inputs, before.map(|b| b.cycles), cycles, context.is_last) {
                let parameters = if driven.model.updated {
                    driven.model.parameters.clone()
                } else {
                    parameters(context, vibrating, &contact)?
                };
                let (clock, shaken) = (&mut context.clock, &driven.shaken);
                worn_response(inputs, vibrating, clock, draft, own, &parameters, shaken)?;
            }
            if until == Some(Stage::DynamicResponse) {
                return Ok(until);
            }
            state::follow(context, vibrating, &driven)?;
            Some(driven)
        }
        _ => None,
    };
    if !fretting_cycle::is_complete(context, draft, keys)? {
        let cycle =
            fretting_cycle::fretting_cycle(context, draft, keys, &worn.wear, &contact, &shear)?;
        if let (Some(vibrating), Some(own), Some(driven)) = (vibrating, &keys.vibration, &driven) {
            let keys = (own, &keys.fretting_cycle);
            ledger(context, vibrating, draft, keys, driven, &contact, &cycle)?;
        }
        let row = summary(
            context,
            before,
            &worn,
            &contact,
            driven.as_ref(),
            Some(&cycle),
        )?;
        put_summary(draft, &keys.fretting_cycle, &row)?;
        fretting_cycle::put_fields(context, draft, keys, &contact, &cycle)?;
    }
    Ok(None)
}

fn put_summary(draft: &mut Draft, key: &StageKey, row: &typed::Summary) -> Result<(), RunError> {
    match is_kept(draft, TableName::Summary, key)? {
        true => Ok(()),
        false => put(draft, key, row),
    }
}

fn committed(store: &RunStore, inputs: &Inputs, observer: &dyn Observer) -> Result<(), RunError> {
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
    if let recipe::Keep::Some {
        every,
        last,
        updates,
    } = inputs.recipe.output.keep
    {
        let mut also = BTreeSet::new();
        let criterion = inputs.recipe.elements().map(|elements| elements.update);
        if updates && criterion.is_some_and(|criterion| criterion != Criterion::Never) {
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
    let spent = Spent::of(store.reader())?;
    let wear_iteration = store.latest();
    let summary = wear_iteration
        .map(|k| store.read(k, TableName::Summary))
        .transpose()?;
    Ok(Outcome {
        ending,
        wear_iteration,
        summary,
        spent,
    })
}
