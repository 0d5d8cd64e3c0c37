//! Passes through the stages of a run: keys, what an earlier start left, computing, timing, notices and writing. Which stages there are,
//! and what they compute, the runner does not know.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::json;

use super::RunError;
use super::clock::Clock;
use super::declaration::{Declaration, is_in};
use super::list::{STAGES, stages_of};
use super::observer::Observer;
use super::output_schedule::{Moment, OutputSchedule};
use super::reduced::ReducedTables;
use super::run::identity_of;
use super::solvers::Solvers;
use super::stage::{Stage, When};
use super::stage_inputs::StageInputs;
use crate::journal::INTERVAL;
use crate::recipe::{Inputs, Part, Recipe};
use crate::store::{Cache, DraftEntry, Recompute, RunReader, RunStore, StageKey, StoreError};
use crate::tables::{Provenance, Table, TableName, Tables, TypedTable, typed};

/// The stages that bring an inherited wear into balance under another scene: its own load, friction and motion.
const OF_BALANCE: [Stage; 4] = [
    Stage::StaticContact,
    Stage::ModelUpdate,
    Stage::DynamicResponse,
    Stage::FrettingCycle,
];

/// Tables that runs share.
enum Shared {
    /// The cache has them.
    Found(Tables),
    /// They are to be computed, and then stored in the cache unless it failed already.
    Not { to_be_shared: bool },
}

/// Passes through the stages of a run.
pub struct Runner<'a> {
    inputs: &'a Inputs,
    observer: &'a dyn Observer,
    solvers: Solvers,
    /// The tables of the run, and the keys of the stages that wrote them.
    once: Tables,
    /// Figures of the unworn iteration, from which changes are counted.
    unworn: Tables,
    keys: BTreeMap<Stage, StageKey>,
    /// What stages cost since the last commit.
    timing: typed::Timing,
}

/// True of a table that a stage reads: of the others, which are for drawings, none is held.
fn is_read(table: &TableName) -> bool {
    STAGES.iter().any(|stage| stage.reads.contains(table))
}

/// The stages of the iteration `wear_iteration`, in their order.
pub fn stages_in(
    recipe: &Recipe,
    wear_iteration: u64,
) -> impl Iterator<Item = &'static Declaration> {
    stages_of(recipe).filter(move |stage| stage.when.is_in(wear_iteration))
}

/// The last stage before `reader` in an iteration that writes a table, or of the run; none of a table that nobody writes before.
pub fn writer_before(
    recipe: &Recipe,
    wear_iteration: u64,
    reader: Stage,
    table: TableName,
) -> Option<&'static Declaration> {
    let passed =
        |stage: &&Declaration| stage.when == When::Once || stage.when.is_in(wear_iteration);
    let before = stages_of(recipe).filter(|stage| stage.stage < reader);
    let writers = before.filter(passed);
    writers
        .filter(|stage| stage.writes_in(recipe).any(|written| written == table))
        .last()
}

impl<'a> Runner<'a> {
    /// A runner that has computed nothing.
    pub fn new(inputs: &'a Inputs, threads: usize, observer: &'a dyn Observer) -> Runner<'a> {
        Runner {
            inputs,
            observer,
            solvers: Solvers::new(threads, observer.gauge()),
            once: Tables::new(),
            unworn: Tables::new(),
            keys: BTreeMap::new(),
            timing: typed::Timing::default(),
        }
    }

    fn recipe(&self) -> &'a Recipe {
        &self.inputs.recipe
    }

    /// The key of a stage: what it declares to read, and the keys of what has written that.
    pub fn key(
        &self,
        stage: &Declaration,
        wear_iteration: u64,
        keys: &BTreeMap<Stage, StageKey>,
        parent: Option<&StageKey>,
        due: OutputSchedule,
    ) -> StageKey {
        let recipe = self.recipe();
        let mut parameters = recipe.parameters(stage.recipe);
        if stage.recipe.contains(&Part::Curves) {
            parameters.insert("curves_due".to_owned(), due.curves.into());
        }
        if stage.recipe.contains(&Part::ForcedResponse) {
            let name = Part::ForcedResponse.name().to_owned();
            parameters.insert(name, due.forced_response.into());
        }
        if stage.recipe.contains(&Part::End) {
            parameters.insert(Part::End.name().to_owned(), due.end.into());
            let check = due.cycle_check.into();
            parameters.insert("cycle_check_due".to_owned(), check);
        }
        let twin = self.inputs.grid_twin.as_ref();
        if let Some(twin) = twin.filter(|_| stage.recipe.contains(&Part::GridCheck)) {
            let last = json!([twin.cycles.last(), twin.volume.last()]);
            parameters.insert("grid_twin".to_owned(), last);
        }
        let reads_fields = stage.recipe.contains(&Part::CycleFields);
        let fields = recipe.output.cycle_fields.as_ref();
        let fields = fields.filter(|_| reads_fields && due.cycle_fields);
        if let Some(fields) = fields {
            let chosen = json!({ "samples": fields.samples, "cells": fields.cells });
            parameters.insert(Part::CycleFields.name().to_owned(), chosen);
        }
        let writes = stage.writes.iter().copied();
        let writes = writes.filter(|table| *table != TableName::CycleField || fields.is_some());
        let writes: Vec<TableName> = writes.collect();
        if stage.shared {
            // Another version may compute otherwise.
            let version = env!("CARGO_PKG_VERSION");
            parameters.insert("version".to_owned(), version.into());
        }
        let writer = |table: &TableName| {
            let writer = writer_before(recipe, wear_iteration, stage.stage, *table)?;
            Some(writer.stage)
        };
        let writers: BTreeSet<Stage> = stage.reads.iter().filter_map(writer).collect();
        let mut upstream: Vec<&StageKey> = writers.iter().filter_map(|s| keys.get(s)).collect();
        upstream.extend(parent.filter(|_| !stage.before.is_empty()));
        let name = stage.stage.name();
        StageKey::new(name, &writes, &parameters.into(), &upstream)
    }

    /// Takes the tables of a stage that is passed through once a run: those of this run, those of another one that shares them, or
    /// computed.
    pub fn once(
        &mut self,
        stage: &'static Declaration,
        store: &mut RunStore,
        cache: Option<&Cache>,
    ) -> Result<(), RunError> {
        let key = self.key(stage, 0, &self.keys, None, OutputSchedule::default());
        let names: Vec<TableName> = stage.writes_in(self.recipe()).collect();
        let cache = cache.filter(|_| stage.shared);
        // What it costs counts for the iteration that is committed next.
        let mut draft = store.draft(store.next())?;
        let tables = match self.own(store, &names, &key)? {
            Some(tables) => {
                if let DraftEntry::Valid(mut kept) = draft.get(&key)? {
                    self.adopt(&mut kept)?;
                }
                tables
            }
            None => {
                let tables = match self.shared(cache, &names, &key) {
                    Shared::Found(tables) => tables,
                    Shared::Not { to_be_shared } => {
                        let before = self.timing.stage.len();
                        let none = Tables::new();
                        let tables =
                            self.compute(stage, 0, OutputSchedule::default(), &none, &none)?;
                        let cost = Tables::from([(TableName::Timing, self.cost_since(before)?)]);
                        draft.put(&key, &cost, &[TableName::Timing])?;
                        if to_be_shared {
                            self.share(cache, store.provenance(), &key, &tables);
                        }
                        tables
                    }
                };
                for (name, table) in &tables {
                    store.put_once(*name, &key, table)?;
                }
                tables
            }
        };
        self.hold(tables);
        self.keys.insert(stage.stage, key);
        Ok(())
    }

    /// Takes the tables of all stages that are passed through once a run, those that runs share from the cache, without a run.
    ///
    /// # Errors
    /// Those of the stages.
    pub fn once_in_memory(&mut self, cache: Option<&Cache>) -> Result<(), RunError> {
        let recipe = self.recipe();
        let none = Tables::new();
        for stage in stages_of(recipe).filter(|stage| stage.when == When::Once) {
            let key = self.key(stage, 0, &self.keys, None, OutputSchedule::default());
            let names: Vec<TableName> = stage.writes_in(recipe).collect();
            let cache = cache.filter(|_| stage.shared);
            let tables = match self.shared(cache, &names, &key) {
                Shared::Found(tables) => tables,
                Shared::Not { to_be_shared } => {
                    let tables = self.compute(stage, 0, OutputSchedule::default(), &none, &none)?;
                    let provenance = Provenance {
                        scene_hash: identity_of(self.inputs).scene_hash(),
                        program_version: env!("CARGO_PKG_VERSION").to_owned(),
                    };
                    if to_be_shared {
                        self.share(cache, &provenance, &key, &tables);
                    }
                    tables
                }
            };
            self.hold(tables);
            self.keys.insert(stage.stage, key);
        }
        Ok(())
    }

    /// Computes the stages of the unworn iteration before `end` that are needed, without a run. One without a steady vibration is told and
    /// left out: it is no more than a start.
    ///
    /// # Errors
    /// Those of the stages.
    pub fn unworn_in_memory(
        &mut self,
        end: Stage,
        is_needed: impl Fn(Stage) -> bool,
    ) -> Result<Tables, RunError> {
        let (mut tables, none) = (Tables::new(), Tables::new());
        let before = stages_in(self.recipe(), 0).filter(|stage| stage.stage < end);
        for stage in before.filter(|stage| is_needed(stage.stage)) {
            match self.compute(stage, 0, OutputSchedule::default(), &tables, &none) {
                Ok(written) => tables.extend(written),
                Err(error @ RunError::Dynamics { .. }) => self.observer.notice(&error.to_string()),
                Err(error) => return Err(error),
            }
        }
        Ok(tables)
    }

    /// Lets `work` read what a stage reads, of `tables` and of the iteration before, with the solvers that stages share.
    ///
    /// # Errors
    /// Those of the work.
    pub fn reading<T>(
        &mut self,
        stage: &'static Declaration,
        wear_iteration: u64,
        [tables, before]: [&Tables; 2],
        work: impl FnOnce(&StageInputs, &mut Solvers) -> Result<T, RunError>,
    ) -> Result<T, RunError> {
        let (declared, given) = (stage.declared(), [tables, &self.once]);
        let reads = StageInputs::new(
            declared,
            self.inputs,
            wear_iteration,
            OutputSchedule::default(),
            given,
            [before, &self.unworn],
        );
        self.solvers.begin();
        work(&reads, &mut self.solvers)
    }

    /// Holds the tables of a stage for those that read them.
    fn hold(&mut self, tables: Tables) {
        let read = tables.into_iter().filter(|(name, _)| is_read(name));
        self.once.extend(read);
    }

    /// Takes up the tables of a run, whatever they were computed from.
    ///
    /// # Errors
    /// [`RunError::NotComputed`] for one that the run does not have yet.
    pub fn load_once(&mut self, reader: &RunReader) -> Result<(), RunError> {
        let recipe = self.recipe();
        for stage in stages_of(recipe).filter(|stage| stage.when == When::Once) {
            for table in stage.writes_in(recipe).filter(is_read) {
                let stage = stage.stage;
                let found = reader.read_once(table)?;
                let found = found.ok_or(RunError::NotComputed { stage, table })?;
                self.once.insert(table, found);
            }
        }
        Ok(())
    }

    /// Passes through the stages of the next iteration and commits it. The stage after which to end, if that was reached.
    pub fn iteration(
        &mut self,
        store: &mut RunStore,
        until: Option<Stage>,
    ) -> Result<Option<Stage>, RunError> {
        let recipe = self.recipe();
        let wear_iteration = store.next();
        let before = match store.latest() {
            Some(latest) => self.before(store.reader(), latest)?,
            None => Tables::new(),
        };
        let parent = store
            .latest()
            .map(|latest| store.reader().commit_of(latest));
        let parent = parent.transpose()?.map(StageKey::of_commit);
        let mut draft = store.draft(wear_iteration)?;
        let mut tables = Tables::new();
        let mut keys = self.keys.clone();
        let mut last = None;
        for stage in stages_in(recipe, wear_iteration) {
            let moment = Moment::of(recipe, wear_iteration, &tables, &before)?;
            if !(stage.is_due)(&moment) {
                continue;
            }
            // The end of an iteration is its commit.
            if let Some(ended) = last.filter(|ended| until == Some(*ended)) {
                return Ok(Some(ended));
            }
            let due = moment.due;
            let key = self.key(stage, wear_iteration, &keys, parent.as_ref(), due);
            let written = match draft.get(&key)? {
                DraftEntry::Valid(mut written) if is_whole(recipe, stage, &written) => {
                    self.adopt(&mut written)?;
                    written
                }
                _ => {
                    let (kept, keep) = draft.parts(&key)?;
                    let solved = self.solvers.journal.open(&kept, INTERVAL, keep);
                    if solved > 0 {
                        self.observer.notice(&format!(
                            "{} continues after {solved} solutions of an earlier start",
                            stage.stage
                        ));
                    }
                    let cost_before = self.timing.stage.len();
                    let written = self.compute(stage, wear_iteration, due, &tables, &before);
                    self.solvers.journal.close();
                    let mut written = written?;
                    let mut interim = written_again(recipe, wear_iteration, stage);
                    interim.push(TableName::Timing);
                    written.insert(TableName::Timing, self.cost_since(cost_before)?);
                    draft.put(&key, &written, &interim)?;
                    written.remove(&TableName::Timing);
                    written
                }
            };
            tables.extend(written);
            keys.insert(stage.stage, key);
            last = Some(stage.stage);
        }
        let key = last.and_then(|last| keys.get(&last));
        let key = StageKey::new("timing", &[TableName::Timing], &().into(), key.as_slice());
        let timing = std::mem::take(&mut self.timing).to_table()?;
        draft.put(&key, &Tables::from([(TableName::Timing, timing)]), &[])?;
        store.commit(draft)?;
        Ok(last.filter(|ended| until == Some(*ended)))
    }

    /// Computes a stage from the tables of its own iteration and of the one before.
    ///
    /// # Errors
    /// Those of the stage, and [`RunError::EndedBefore`] if the observer ends the run there.
    pub fn compute(
        &mut self,
        stage: &'static Declaration,
        wear_iteration: u64,
        due: OutputSchedule,
        tables: &Tables,
        before: &Tables,
    ) -> Result<Tables, RunError> {
        if self.observer.ends_before(stage.stage) {
            return Err(RunError::EndedBefore(stage.stage));
        }
        self.observer.stage(stage.stage, wear_iteration);
        let clock = Clock::begin();
        let given = [tables, &self.once];
        let reads = StageInputs::new(
            stage.declared(),
            self.inputs,
            wear_iteration,
            due,
            given,
            [before, &self.unworn],
        );
        self.solvers.begin();
        let outputs = (stage.compute)(&reads, &mut self.solvers)?;
        for cost in self.solvers.end(clock.spent()) {
            self.timing.stage.push(match cost.part {
                Some(part) => format!("{}.{part}", stage.stage),
                None => stage.stage.name().to_owned(),
            });
            self.timing.cpu_seconds.push(cost.spent.cpu_seconds);
            self.timing.seconds.push(cost.spent.seconds);
            self.timing.fft_pairs.push(cost.fft_pairs);
        }
        for notice in &outputs.notices {
            self.observer.notice(notice);
        }
        Ok(outputs.tables)
    }

    /// What was computed behind so many rows of the timing cost, to be kept with its result.
    fn cost_since(&self, rows: usize) -> Result<Table, RunError> {
        let cost = typed::Timing {
            stage: self.timing.stage[rows..].to_vec(),
            seconds: self.timing.seconds[rows..].to_vec(),
            fft_pairs: self.timing.fft_pairs[rows..].to_vec(),
            cpu_seconds: self.timing.cpu_seconds[rows..].to_vec(),
        };
        Ok(cost.to_table()?)
    }

    /// Counts what a stage cost that an earlier start computed.
    fn adopt(&mut self, kept: &mut Tables) -> Result<(), RunError> {
        if let Some(cost) = kept.remove(&TableName::Timing) {
            let cost = typed::Timing::of(&cost)?;
            self.timing.cpu_seconds.extend(cost.cpu_seconds);
            self.timing.stage.extend(cost.stage);
            self.timing.seconds.extend(cost.seconds);
            self.timing.fft_pairs.extend(cost.fft_pairs);
        }
        Ok(())
    }

    /// The tables of an iteration that the stages of the next one read, as they are committed: a run that is continued computes from
    /// the very same numbers as one that is not interrupted. What a sibling inherited from a run of another scene is brought into
    /// balance under its own.
    pub fn before(&mut self, reader: &RunReader, wear_iteration: u64) -> Result<Tables, RunError> {
        let recipe = self.recipe();
        self.take_unworn(reader)?;
        let origin = reader.record().origin.as_ref();
        let inherited = origin.is_some_and(|origin| origin.wear_iteration == wear_iteration);
        if inherited && reader.scene_hash_of(wear_iteration)? != reader.record().scene_hash {
            return self.balanced(reader, wear_iteration);
        }
        let stages = stages_in(recipe, wear_iteration + 1);
        let names: BTreeSet<TableName> = stages.flat_map(|stage| stage.before).copied().collect();
        let names = names.into_iter().filter(|name| is_in(recipe, *name));
        let mut before = Tables::new();
        for name in names {
            before.insert(name, reader.read(wear_iteration, name)?);
        }
        Ok(before)
    }

    /// Takes up the figures of the unworn iteration, which may be pruned.
    fn take_unworn(&mut self, reader: &RunReader) -> Result<(), RunError> {
        // What another scene had unworn says nothing of what this one changes.
        let record = reader.record();
        if self.unworn.is_empty() && reader.scene_hash_of(0)? == record.scene_hash {
            let history = reader.history()?;
            if let Some(summary) = history.row::<typed::Summary>(0)? {
                self.unworn.insert(TableName::Summary, summary.to_table()?);
            }
            if let Some(response) = history.row::<typed::DynamicResponse>(0)? {
                let table = response.to_table()?;
                self.unworn.insert(TableName::DynamicResponse, table);
            }
        }
        Ok(())
    }

    fn balanced(&mut self, reader: &RunReader, wear_iteration: u64) -> Result<Tables, RunError> {
        let recipe = self.recipe();
        let of_wear = [
            TableName::WearField,
            TableName::WearStep,
            TableName::ContactField,
            TableName::Summary,
        ];
        let inherited = of_wear
            .into_iter()
            .map(|name| Ok((name, reader.read(wear_iteration, name)?)));
        let inherited: Tables = inherited.collect::<Result<_, RunError>>()?;
        // The wear as it is, with no step to it, and the contact as a start.
        let no_step = typed::WearStep::default().to_table()?;
        let mut tables = inherited.clone();
        tables.remove(&TableName::Summary);
        tables.insert(TableName::WearStep, no_step);
        let summary = inherited[&TableName::Summary].clone();
        let before = Tables::from([(TableName::Summary, summary)]);
        for stage in stages_of(recipe).filter(|stage| OF_BALANCE.contains(&stage.stage)) {
            let balanced = self.compute(
                stage,
                wear_iteration,
                OutputSchedule::default(),
                &tables,
                &before,
            )?;
            tables.extend(balanced);
        }
        tables.insert(TableName::WearStep, inherited[&TableName::WearStep].clone());
        // What other keys make of these figures is no change by wear, which error bars would take it for.
        let summary = typed::Summary {
            resonance_frequency: None,
            peak_amplitude: None,
            dissipated_energy: None,
            normal_load: None,
            kn: None,
            kt: None,
            loaded_area_fraction: None,
            max_pressure: None,
            ..typed::Summary::of(&inherited[&TableName::Summary])?
        };
        tables.insert(TableName::Summary, summary.to_table()?);
        // What was uncertain of the wear that is inherited stays so.
        let coarse = [TableName::CoarseField, TableName::CoarseStep];
        for name in coarse.into_iter().filter(|name| is_in(recipe, *name)) {
            let table = read_optional(reader, wear_iteration, name)?;
            tables.extend(table.map(|table| (name, table)));
        }
        Ok(tables)
    }

    /// The tables of a run under a key, if all of them are there and fit to each other.
    fn own(
        &self,
        store: &RunStore,
        names: &[TableName],
        key: &StageKey,
    ) -> Result<Option<Tables>, RunError> {
        let mut found = Tables::new();
        for &name in names {
            match store.once(name, key)? {
                DraftEntry::Valid(table) => found.insert(name, table),
                DraftEntry::Stale(_) => return Ok(None),
            };
        }
        match ReducedTables::check_stored(&found, self.recipe()) {
            Ok(()) => Ok(Some(found)),
            Err(reason) => {
                self.observer.notice(&format!(
                    "the structure of the run is computed again: {reason}"
                ));
                Ok(None)
            }
        }
    }

    /// No run fails for its cache: it computes what it cannot find, and says so.
    fn shared(&self, cache: Option<&Cache>, names: &[TableName], key: &StageKey) -> Shared {
        let Some(cache) = cache else {
            return Shared::Not {
                to_be_shared: false,
            };
        };
        let again = match cache.get(names, key) {
            Ok(DraftEntry::Valid(tables)) => {
                let tables: Tables = names.iter().copied().zip(tables).collect();
                match ReducedTables::check_stored(&tables, self.recipe()) {
                    Ok(()) => {
                        self.observer.notice(&format!(
                            "the reduced structure is there already, in {}",
                            cache.root().display()
                        ));
                        return Shared::Found(tables);
                    }
                    Err(reason) => Some(reason),
                }
            }
            Ok(DraftEntry::Stale(Recompute::NotThere)) => None,
            Ok(DraftEntry::Stale(why)) => Some(why.to_string()),
            Err(error @ StoreError::Table { .. }) => Some(error.to_string()),
            Err(error) => {
                self.observer.notice(&format!(
                    "the cache of structures, {}, cannot be read: {error}",
                    cache.root().display()
                ));
                return Shared::Not {
                    to_be_shared: false,
                };
            }
        };
        if let Some(reason) = again {
            self.observer.notice(&format!(
                "the reduced structure in {} is computed again and replaced: {reason}",
                cache.root().display()
            ));
        }
        Shared::Not { to_be_shared: true }
    }

    fn share(
        &self,
        cache: Option<&Cache>,
        provenance: &Provenance,
        key: &StageKey,
        tables: &Tables,
    ) {
        let Some(cache) = cache else {
            return;
        };
        let named: Vec<(TableName, &Table)> = tables.iter().map(|(n, t)| (*n, t)).collect();
        if let Err(error) = cache.put(key, &named, provenance) {
            self.observer.notice(&format!(
                "the reduced structure is not stored in the cache {}: {error}",
                cache.root().display()
            ));
        }
    }
}

/// True if the tables that a stage has left are all that a run of this recipe has of it. What else there may be depends on what is due,
/// and a vibration has no tables of a resonance that it does not have.
fn is_whole(recipe: &Recipe, stage: &Declaration, written: &Tables) -> bool {
    const WHERE_DUE: [TableName; 5] = [
        TableName::Frf,
        TableName::FrfHarmonic,
        TableName::Indentation,
        TableName::Hysteresis,
        TableName::CycleField,
    ];
    let is_alone = recipe.surface().is_none();
    let mut always = stage.writes_in(recipe).filter(|t| !WHERE_DUE.contains(t));
    is_alone || always.all(|table| written.contains_key(&table))
}

/// The tables of a stage that a later one of the same iteration writes again.
fn written_again(recipe: &Recipe, wear_iteration: u64, stage: &Declaration) -> Vec<TableName> {
    let later = stages_in(recipe, wear_iteration).filter(|later| later.stage > stage.stage);
    let later: Vec<TableName> = later.flat_map(|later| later.writes_in(recipe)).collect();
    let written = stage.writes_in(recipe);
    written.filter(|table| later.contains(table)).collect()
}

/// A table of a committed iteration; none where it was not due, or the run that it is inherited from has none.
pub fn read_optional(
    reader: &RunReader,
    wear_iteration: u64,
    name: TableName,
) -> Result<Option<Table>, RunError> {
    match reader.read(wear_iteration, name) {
        Err(StoreError::NoTable { .. }) => Ok(None),
        found => Ok(Some(found?)),
    }
}
