//! The loop over wear iterations.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::context::{Context, Keys, kept};
use super::state::{self, Committed};
use super::summary::{FREE_KEYS, INHERITED_KEYS, summary};
use super::{Inputs, RunError, Stage, fretting_cycle, static_contact, surface, wear};
use crate::scene::{self, Surface, Wear};
use crate::store::{Draft, FileSystem, Keep, Opening, RunIdentity, RunStore, StageKey, StoreError};
use crate::tables::{Table, TableName};

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
    /// The scene, with its files.
    pub inputs: &'a Inputs,
    /// Folder of the run.
    pub root: PathBuf,
    /// Begin from another run's iteration.
    pub source: Option<Source>,
    /// End after this stage.
    pub until: Option<Stage>,
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
    /// Seconds by stage over all iterations that are kept.
    pub timing: BTreeMap<String, f64>,
}

/// Begins or continues a run.
pub fn run(options: &RunOptions, observer: &dyn Observer) -> Result<Outcome, RunError> {
    let inputs = options.inputs;
    let mut store = open(options, observer)?;
    let Some(rough) = inputs.scene.rough() else {
        todo!()
    };
    let unworn = surface::surface(inputs, &rough, &mut store, observer)?;
    if options.until == Some(Stage::Surface) {
        return outcome(&store, Ending::Until(Stage::Surface));
    }
    let joint = inputs.plan.build(
        &inputs.scene.fidelity,
        &rough,
        unworn.patch,
        unworn.height,
        inputs.motion.clone(),
    );
    let mut context = Context {
        inputs,
        joint,
        surface_key: unworn.key,
        observer,
        wear_iteration: 0,
        is_last: false,
        timing: unworn.timing.into_iter().collect(),
    };
    let mut commits = 0;
    loop {
        // Whatever the next iteration depends on is read back from what is committed, so that a run which is continued
        // computes from the very same numbers as one that is not interrupted.
        let before = match (store.latest(), &inputs.scene.wear) {
            (Some(latest), Some(_)) => {
                context.wear_iteration = latest;
                Some(state::read(&mut context, &store, latest)?)
            }
            (Some(_), None) => return outcome(&store, Ending::Done),
            (None, _) => None,
        };
        if let (Some(before), Some(wear)) = (&before, &inputs.scene.wear)
            && is_finished(wear, before)
        {
            return outcome(&store, Ending::Done);
        }
        if store.latest().is_some() && (options.stop)(commits) {
            return outcome(&store, Ending::Stopped);
        }
        context.wear_iteration = store.next();
        let mut draft = store.draft(context.wear_iteration)?;
        let keys = Keys::of(inputs, &store, &context.surface_key, context.wear_iteration)?;
        if let Some(stage) = iterate(
            &mut context,
            &mut draft,
            &keys,
            before.as_ref(),
            options.until,
        )? {
            return outcome(&store, Ending::Until(stage));
        }
        let timing = context.timing_table()?;
        draft.put(TableName::Timing, &keys.fretting_cycle, &timing)?;
        draft.commit(&mut store)?;
        commits += 1;
        committed(&store, inputs, observer)?;
        prune(&mut store, inputs)?;
        let last = if inputs.scene.motion.is_some() {
            Stage::FrettingCycle
        } else {
            Stage::StaticContact
        };
        if options.until == Some(last) {
            return outcome(&store, Ending::Until(last));
        }
    }
}

fn open(options: &RunOptions, observer: &dyn Observer) -> Result<RunStore, RunError> {
    let inputs = options.inputs;
    let seed = match &inputs.scene.surface {
        Some(
            Surface::Gaussian { seed, .. }
            | Surface::Exponential { seed, .. }
            | Surface::SelfAffine { seed, .. },
        ) => Some(*seed),
        _ => None,
    };
    let identity = RunIdentity {
        scene: inputs.canonical.clone(),
        scene_toml: inputs.scene.to_toml(),
        plan: serde_json::to_value(&inputs.plan).expect("a plan is numbers and words"),
        program_version: env!("CARGO_PKG_VERSION").to_owned(),
        threads: 1,
        seed,
        free_keys: FREE_KEYS.map(str::to_owned).to_vec(),
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
    if inputs.scene.wear.is_some() {
        committed(&store, inputs, observer)?;
    }
    // A run that was killed before it pruned, or is finished and now keeps less, has no commit that would do it.
    prune(&mut store, inputs)?;
    Ok(store)
}

/// Computes the stages of one iteration. The stage after which to end, if it comes before the commit.
fn iterate(
    context: &mut Context,
    draft: &mut Draft,
    keys: &Keys,
    before: Option<&Committed>,
    until: Option<Stage>,
) -> Result<Option<Stage>, RunError> {
    let scene = &context.inputs.scene;
    let mut worn = match (&keys.wear, &scene.wear, before) {
        (Some(key), Some(wear), Some(before)) => {
            wear::wear(context, draft, keys, key, wear, before)?
        }
        _ => wear::unworn(context, draft, keys)?,
    };
    if until == Some(Stage::Wear) && keys.wear.is_some() {
        return Ok(Some(Stage::Wear));
    }
    context.reach(before.map_or(0, |b| b.cycles) + worn.n_cycles);
    let predicted = worn.predicted.take();
    let (contact, shear) =
        static_contact::static_contact(context, draft, keys, &worn.wear, predicted)?;
    if scene.motion.is_none() {
        let row = summary(context, before, &worn, &contact, None)?;
        put_summary(draft, &keys.static_contact, &row)?;
        return Ok(None);
    }
    if until == Some(Stage::StaticContact) {
        return Ok(Some(Stage::StaticContact));
    }
    if !fretting_cycle::is_complete(context, draft, keys)? {
        let cycle =
            fretting_cycle::fretting_cycle(context, draft, keys, &worn.wear, &contact, &shear)?;
        let row = summary(context, before, &worn, &contact, Some(&cycle))?;
        put_summary(draft, &keys.fretting_cycle, &row)?;
        fretting_cycle::put_fields(context, draft, keys, &contact, &cycle)?;
    }
    Ok(None)
}

fn put_summary(draft: &mut Draft, key: &StageKey, row: &Table) -> Result<(), RunError> {
    if kept(draft, TableName::Summary, key)?.is_none() {
        draft.put(TableName::Summary, key, row)?;
    }
    Ok(())
}

fn is_finished(wear: &Wear, at: &Committed) -> bool {
    wear.cycles.is_some_and(|cycles| at.cycles >= cycles)
        || wear.volume.is_some_and(|volume| at.volume >= volume)
}

fn committed(store: &RunStore, inputs: &Inputs, observer: &dyn Observer) -> Result<(), RunError> {
    let Some(wear_iteration) = store.latest() else {
        return Ok(());
    };
    let summary = store.read(wear_iteration, TableName::Summary)?;
    let worn = inputs.scene.wear.is_some();
    let number = |column: &str| -> Result<f64, RunError> {
        Ok(if worn { summary.f64(column)?[0] } else { 0.0 })
    };
    observer.committed(&Progress {
        wear_iteration,
        cycles: if worn {
            summary.i64("cycles")?[0] as u64
        } else {
            0
        },
        volume: number("wear_volume")?,
        error: number("error_wear")?,
    });
    Ok(())
}

fn prune(store: &mut RunStore, inputs: &Inputs) -> Result<(), RunError> {
    if let scene::Keep::Some {
        every,
        last,
        updates: _,
    } = inputs.scene.output.keep
    {
        store.prune(&Keep {
            every,
            last,
            also: Default::default(),
        })?;
    }
    Ok(())
}

fn outcome(store: &RunStore, ending: Ending) -> Result<Outcome, RunError> {
    let mut timing = BTreeMap::new();
    for wear_iteration in store.reader().iterations() {
        let table = match store.read(wear_iteration, TableName::Timing) {
            Ok(table) => table,
            // No result depends on it.
            Err(StoreError::Damaged(_)) => continue,
            Err(error) => return Err(error.into()),
        };
        for (stage, seconds) in table.text("stage")?.iter().zip(table.f64("seconds")?) {
            *timing.entry(stage.clone()).or_insert(0.0) += seconds;
        }
    }
    let wear_iteration = store.latest();
    let summary = wear_iteration
        .map(|k| store.read(k, TableName::Summary))
        .transpose()?;
    Ok(Outcome {
        ending,
        wear_iteration,
        summary,
        timing,
    })
}
