//! Runs the stages of a run. For each stage, the runner computes the key and reuses a result of an earlier start with
//! the same key. The runner times each stage, writes the tables and passes notices on. The runner does not depend on
//! the list of stages or on their contents.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::json;

use super::RunError;
use super::clock::Clock;
use super::declaration::{Declaration, is_in};
use super::list::{STAGES, stages_of};
use super::observer::Observer;
use super::output_schedule::{IterationSchedule, OutputSchedule};
use super::reduced::ReducedTables;
use super::run::identity_of;
use super::solvers::Solvers;
use super::stage::{Stage, When};
use super::stage_inputs::StageInputs;
use crate::journal::INTERVAL;
use crate::recipe::{Inputs, Part, Recipe};
use crate::store::{Cache, Recompute, RunReader, RunStore, StageKey, StoreError, StoredResult};
use crate::tables::{Provenance, Table, TableName, Tables, TypedTable, typed};

/// Stages that balance an inherited wear under another scene, with its own load, friction and motion.
const BALANCE_STAGES: [Stage; 4] = [
    Stage::StaticContact,
    Stage::ModelUpdate,
    Stage::DynamicResponse,
    Stage::FrettingCycle,
];

/// Tables that runs share.
enum CacheLookup {
    /// The cache contains the tables.
    Found(Tables),
    /// The tables must be computed, and then stored in the cache unless the cache has failed.
    Not { to_be_shared: bool },
}

/// Runs the stages of a run.
pub struct Runner<'a> {
    inputs: &'a Inputs,
    observer: &'a dyn Observer,
    solvers: Solvers,
    /// Tables that are computed once per run.
    once: Tables,
    /// Results of the unworn iteration, the reference for changes.
    unworn: Tables,
    /// Keys of the stages that wrote the tables in `once`.
    keys: BTreeMap<Stage, StageKey>,
    /// Cost of the stages since the last commit.
    timing: typed::Timing,
}

/// Returns true if any stage reads the table. Other tables are for drawings, and the runner does not keep them.
fn is_read(table: &TableName) -> bool {
    STAGES.iter().any(|stage| stage.reads.contains(table))
}

/// Returns the stages of the iteration `wear_iteration`, in their order.
pub fn stages_in(
    recipe: &Recipe,
    wear_iteration: u64,
) -> impl Iterator<Item = &'static Declaration> {
    stages_of(recipe).filter(move |stage| stage.when.is_in(wear_iteration))
}

/// Returns the last stage before `reader`, in the iteration or once per run, that writes a table. `None` if no
/// earlier stage writes it.
pub fn writer_before(
    recipe: &Recipe,
    wear_iteration: u64,
    reader: Stage,
    table: TableName,
) -> Option<&'static Declaration> {
    let is_in_iteration =
        |stage: &&Declaration| stage.when == When::Once || stage.when.is_in(wear_iteration);
    let before = stages_of(recipe).filter(|stage| stage.stage < reader);
    let writers = before.filter(is_in_iteration);
    writers
        .filter(|stage| stage.writes_in(recipe).any(|written| written == table))
        .last()
}

impl<'a> Runner<'a> {
    /// Creates a runner that has computed nothing.
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

    /// Returns the key of a stage: its declared inputs, and the keys of the stages that wrote them.
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
            // Another version may compute other results.
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

    /// Returns the tables of a stage that runs once per run. The runner reads the tables from the run or from the cache
    /// that runs share, or the runner computes the tables.
    pub fn once(
        &mut self,
        stage: &'static Declaration,
        store: &mut RunStore,
        cache: Option<&Cache>,
    ) -> Result<(), RunError> {
        let key = self.key(stage, 0, &self.keys, None, OutputSchedule::default());
        let names: Vec<TableName> = stage.writes_in(self.recipe()).collect();
        let cache = cache.filter(|_| stage.shared);
        // The cost of the stage counts for the iteration that is committed next.
        let mut draft = store.draft(store.next())?;
        let tables = match self.stored_once(store, &names, &key)? {
            Some(tables) => {
                if let StoredResult::Valid(mut cost) = draft.get(&key)? {
                    self.add_cost(&mut cost)?;
                }
                tables
            }
            None => {
                let tables = match self.cached(cache, &names, &key) {
                    CacheLookup::Found(tables) => tables,
                    CacheLookup::Not { to_be_shared } => {
                        let before = self.timing.stage.len();
                        let no_tables = Tables::new();
                        let tables = self.compute(
                            stage,
                            0,
                            OutputSchedule::default(),
                            &no_tables,
                            &no_tables,
                        )?;
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
        self.keep_read_tables(tables);
        self.keys.insert(stage.stage, key);
        Ok(())
    }

    /// Obtains the tables of all stages that run once per run, without a run. Shared tables come from the cache.
    ///
    /// # Errors
    /// Errors of the stages.
    pub fn once_in_memory(&mut self, cache: Option<&Cache>) -> Result<(), RunError> {
        let recipe = self.recipe();
        let no_tables = Tables::new();
        for stage in stages_of(recipe).filter(|stage| stage.when == When::Once) {
            let key = self.key(stage, 0, &self.keys, None, OutputSchedule::default());
            let names: Vec<TableName> = stage.writes_in(recipe).collect();
            let cache = cache.filter(|_| stage.shared);
            let tables = match self.cached(cache, &names, &key) {
                CacheLookup::Found(tables) => tables,
                CacheLookup::Not { to_be_shared } => {
                    let tables =
                        self.compute(stage, 0, OutputSchedule::default(), &no_tables, &no_tables)?;
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
            self.keep_read_tables(tables);
            self.keys.insert(stage.stage, key);
        }
        Ok(())
    }

    /// Computes the needed stages of the unworn iteration before `end`, without a run. A stage that finds no steady
    /// vibration is reported and skipped, since its result is only an initial guess.
    ///
    /// # Errors
    /// Errors of the stages.
    pub fn unworn_in_memory(
        &mut self,
        end: Stage,
        is_needed: impl Fn(Stage) -> bool,
    ) -> Result<Tables, RunError> {
        let (mut tables, no_tables) = (Tables::new(), Tables::new());
        let before = stages_in(self.recipe(), 0).filter(|stage| stage.stage < end);
        for stage in before.filter(|stage| is_needed(stage.stage)) {
            match self.compute(stage, 0, OutputSchedule::default(), &tables, &no_tables) {
                Ok(written) => tables.extend(written),
                Err(error @ RunError::Dynamics { .. }) => self.observer.notice(&error.to_string()),
                Err(error) => return Err(error),
            }
        }
        Ok(tables)
    }

    /// Calls `work` with the inputs of a stage and the shared solvers. The inputs come from `tables` and from the
    /// previous iteration.
    ///
    /// # Errors
    /// Errors of `work`.
    pub fn with_inputs<T>(
        &mut self,
        stage: &'static Declaration,
        wear_iteration: u64,
        [tables, before]: [&Tables; 2],
        work: impl FnOnce(&StageInputs, &mut Solvers) -> Result<T, RunError>,
    ) -> Result<T, RunError> {
        let (declared, table_sets) = (stage.declared(), [tables, &self.once]);
        let reads = StageInputs::new(
            declared,
            self.inputs,
            wear_iteration,
            OutputSchedule::default(),
            table_sets,
            [before, &self.unworn],
        );
        self.solvers.begin();
        work(&reads, &mut self.solvers)
    }

    /// Keeps the tables of a stage in memory if other stages read the tables.
    fn keep_read_tables(&mut self, tables: Tables) {
        let read = tables.into_iter().filter(|(name, _)| is_read(name));
        self.once.extend(read);
    }

    /// Loads the tables that are computed once per run, without a check of their keys.
    ///
    /// # Errors
    /// [`RunError::NotComputed`] for a table that the run does not have yet.
    pub fn load_once(&mut self, reader: &RunReader) -> Result<(), RunError> {
        let recipe = self.recipe();
        for stage in stages_of(recipe).filter(|stage| stage.when == When::Once) {
            for table in stage.writes_in(recipe).filter(is_read) {
                let stage = stage.stage;
                let stored = reader.read_once(table)?;
                let stored = stored.ok_or(RunError::NotComputed { stage, table })?;
                self.once.insert(table, stored);
            }
        }
        Ok(())
    }

    /// Runs the stages of the next iteration and commits it. Returns the stage `until` if the run has reached it.
    pub fn iteration(
        &mut self,
        store: &mut RunStore,
        until: Option<Stage>,
    ) -> Result<Option<Stage>, RunError> {
        let recipe = self.recipe();
        let wear_iteration = store.next();
        let before = match store.latest() {
            Some(latest) => self.previous_tables(store.reader(), latest)?,
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
            let moment = IterationSchedule::of(recipe, wear_iteration, &tables, &before)?;
            if !(stage.is_due)(&moment) {
                continue;
            }
            // Ends after the stage `until`. If `until` is the last stage of the iteration, the runner commits the
            // iteration before the run ends.
            if let Some(ended) = last.filter(|ended| until == Some(*ended)) {
                return Ok(Some(ended));
            }
            let due = moment.due;
            let key = self.key(stage, wear_iteration, &keys, parent.as_ref(), due);
            let written = match draft.get(&key)? {
                StoredResult::Valid(mut written) if is_complete(recipe, stage, &written) => {
                    self.add_cost(&mut written)?;
                    written
                }
                _ => {
                    let (stored, keep) = draft.partial_results(&key)?;
                    let solved = self.solvers.journal.open(&stored, INTERVAL, keep);
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
                    let mut interim = rewritten_tables(recipe, wear_iteration, stage);
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

    /// Computes a stage from the tables of its iteration and of the previous iteration.
    ///
    /// # Errors
    /// Errors of the stage, and [`RunError::EndedBefore`] if the observer ends the run before the stage.
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
        let table_sets = [tables, &self.once];
        let reads = StageInputs::new(
            stage.declared(),
            self.inputs,
            wear_iteration,
            due,
            table_sets,
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

    /// Returns the cost of everything computed after the first `rows` rows of the timing table. The runner stores the
    /// returned cost with the results of the stage.
    fn cost_since(&self, rows: usize) -> Result<Table, RunError> {
        let cost = typed::Timing {
            stage: self.timing.stage[rows..].to_vec(),
            seconds: self.timing.seconds[rows..].to_vec(),
            fft_pairs: self.timing.fft_pairs[rows..].to_vec(),
            cpu_seconds: self.timing.cpu_seconds[rows..].to_vec(),
        };
        Ok(cost.to_table()?)
    }

    /// Adds the cost of a stage that an earlier start computed.
    fn add_cost(&mut self, tables: &mut Tables) -> Result<(), RunError> {
        if let Some(cost) = tables.remove(&TableName::Timing) {
            let cost = typed::Timing::of(&cost)?;
            self.timing.cpu_seconds.extend(cost.cpu_seconds);
            self.timing.stage.extend(cost.stage);
            self.timing.seconds.extend(cost.seconds);
            self.timing.fft_pairs.extend(cost.fft_pairs);
        }
        Ok(())
    }

    /// Reads the tables of an iteration that the stages of the next iteration read. The runner reads the tables from
    /// the commit. A continued run and an uninterrupted run then compute from the same numbers. If another scene
    /// computed an inherited iteration, the runner balances the inherited iteration under the scene of the run.
    pub fn previous_tables(
        &mut self,
        reader: &RunReader,
        wear_iteration: u64,
    ) -> Result<Tables, RunError> {
        let recipe = self.recipe();
        self.load_unworn(reader)?;
        let origin = reader.record().origin.as_ref();
        let inherited = origin.is_some_and(|origin| origin.wear_iteration == wear_iteration);
        if inherited && reader.scene_hash_of(wear_iteration)? != reader.record().scene_hash {
            return self.balance_inherited(reader, wear_iteration);
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

    /// Loads the results of the unworn iteration from the history, since the iteration itself may be pruned.
    fn load_unworn(&mut self, reader: &RunReader) -> Result<(), RunError> {
        // If another scene computed the unworn state, the unworn state is no reference for changes in the run.
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

    fn balance_inherited(
        &mut self,
        reader: &RunReader,
        wear_iteration: u64,
    ) -> Result<Tables, RunError> {
        let recipe = self.recipe();
        let wear_tables = [
            TableName::WearField,
            TableName::WearStep,
            TableName::ContactField,
            TableName::Summary,
        ];
        let inherited = wear_tables
            .into_iter()
            .map(|name| Ok((name, reader.read(wear_iteration, name)?)));
        let inherited: Tables = inherited.collect::<Result<_, RunError>>()?;
        // Uses the inherited wear without a wear step. The inherited contact is the initial guess.
        let no_step = typed::WearStep::default().to_table()?;
        let mut tables = inherited.clone();
        tables.remove(&TableName::Summary);
        tables.insert(TableName::WearStep, no_step);
        let summary = inherited[&TableName::Summary].clone();
        let before = Tables::from([(TableName::Summary, summary)]);
        for stage in stages_of(recipe).filter(|stage| BALANCE_STAGES.contains(&stage.stage)) {
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
        // Omits the results that depend on the changed keys. The error bars would treat a change of the omitted results
        // as wear.
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
        // Keeps the inherited coarse trajectory, and with it the uncertainty of the inherited wear.
        let coarse = [TableName::CoarseField, TableName::CoarseStep];
        for name in coarse.into_iter().filter(|name| is_in(recipe, *name)) {
            let table = read_optional(reader, wear_iteration, name)?;
            tables.extend(table.map(|table| (name, table)));
        }
        Ok(tables)
    }

    /// Returns the tables of a run under a key, if all of them exist and match each other.
    fn stored_once(
        &self,
        store: &RunStore,
        names: &[TableName],
        key: &StageKey,
    ) -> Result<Option<Tables>, RunError> {
        let mut stored = Tables::new();
        for &name in names {
            match store.once(name, key)? {
                StoredResult::Valid(table) => stored.insert(name, table),
                StoredResult::Stale(_) => return Ok(None),
            };
        }
        match ReducedTables::check_stored(&stored, self.recipe()) {
            Ok(()) => Ok(Some(stored)),
            Err(reason) => {
                self.observer.notice(&format!(
                    "the structure of the run is computed again: {reason}"
                ));
                Ok(None)
            }
        }
    }

    /// Looks up the tables of a stage in the cache. A failure of the cache is reported, and the run computes the
    /// tables.
    fn cached(&self, cache: Option<&Cache>, names: &[TableName], key: &StageKey) -> CacheLookup {
        let Some(cache) = cache else {
            return CacheLookup::Not {
                to_be_shared: false,
            };
        };
        let reason = match cache.get(names, key) {
            Ok(StoredResult::Valid(tables)) => {
                let tables: Tables = names.iter().copied().zip(tables).collect();
                match ReducedTables::check_stored(&tables, self.recipe()) {
                    Ok(()) => {
                        self.observer.notice(&format!(
                            "the reduced structure is read from {}",
                            cache.root().display()
                        ));
                        return CacheLookup::Found(tables);
                    }
                    Err(reason) => Some(reason),
                }
            }
            Ok(StoredResult::Stale(Recompute::Missing)) => None,
            Ok(StoredResult::Stale(why)) => Some(why.to_string()),
            Err(error @ StoreError::Table { .. }) => Some(error.to_string()),
            Err(error) => {
                self.observer.notice(&format!(
                    "the cache of structures, {}, cannot be read: {error}",
                    cache.root().display()
                ));
                return CacheLookup::Not {
                    to_be_shared: false,
                };
            }
        };
        if let Some(reason) = reason {
            self.observer.notice(&format!(
                "the reduced structure in {} is computed again and replaced: {reason}",
                cache.root().display()
            ));
        }
        CacheLookup::Not { to_be_shared: true }
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

/// Returns true if the drafted tables of a stage are complete. Tables that are written only when due are not
/// required. A vibration without a rough contact is always complete, since it may lack the tables of a resonance.
fn is_complete(recipe: &Recipe, stage: &Declaration, written: &Tables) -> bool {
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

/// Returns the tables of a stage that a later stage of the same iteration overwrites.
fn rewritten_tables(recipe: &Recipe, wear_iteration: u64, stage: &Declaration) -> Vec<TableName> {
    let later = stages_in(recipe, wear_iteration).filter(|later| later.stage > stage.stage);
    let later: Vec<TableName> = later.flat_map(|later| later.writes_in(recipe)).collect();
    let written = stage.writes_in(recipe);
    written.filter(|table| later.contains(table)).collect()
}

/// Reads a table of a committed iteration. Returns `None` if the iteration has no table with the name `name`. A table
/// is missing if the table was not due, or if the source run lacks the table.
pub fn read_optional(
    reader: &RunReader,
    wear_iteration: u64,
    name: TableName,
) -> Result<Option<Table>, RunError> {
    match reader.read(wear_iteration, name) {
        Err(StoreError::NoTable { .. }) => Ok(None),
        table => Ok(Some(table?)),
    }
}
