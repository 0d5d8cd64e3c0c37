//! Recomputation of a stage of a committed iteration from the tables of the run.

use std::collections::BTreeMap;

use super::RunError;
use super::declaration::{Declaration, is_in};
use super::list::STAGES;
use super::observer::Observer;
use super::output_schedule::{IterationSchedule, OutputSchedule};
use super::runner::{Runner, read_optional, stages_in, writer_before};
use super::stage::{Stage, When};
use crate::recipe::{Inputs, Recipe};
use crate::store::RunReader;
use crate::tables::{TableName, Tables};

/// Results of a recomputed stage.
pub struct Recomputed {
    /// Tables of the stage.
    pub tables: Tables,
    /// Whether each table is identical, to the last bit, to the stored table. The comparison omits tables that were not
    /// due, and tables that a later stage overwrites.
    pub same: BTreeMap<TableName, bool>,
}

/// Computes a stage of an iteration again. The iteration does not matter for a stage that runs once per run.
/// `recompute` reads the inputs from the commit. If a later stage overwrites an input, `recompute` repeats the stage
/// that wrote the input first.
///
/// # Errors
/// [`RunError::NotInIteration`], [`RunError::WithoutTheOneBefore`] and [`RunError::OfAnotherScene`]. Errors of reading
/// the run and errors of the stage.
pub fn recompute(
    reader: &RunReader,
    inputs: &Inputs,
    stage: Stage,
    wear_iteration: u64,
    threads: usize,
    observer: &dyn Observer,
) -> Result<Recomputed, RunError> {
    let recipe = &inputs.recipe;
    let iteration_stages = || stages_in(recipe, wear_iteration);
    let once = STAGES
        .into_iter()
        .filter(|s| s.when == When::Once && s.is_in(recipe));
    let declarations: Vec<&'static Declaration> = once.chain(iteration_stages()).collect();
    let Some(declaration) = declarations.iter().copied().find(|s| s.stage == stage) else {
        let stages = declarations.iter().map(|s| s.stage).collect();
        return Err(RunError::NotInIteration {
            stage,
            wear_iteration,
            stages,
        });
    };
    require_own(reader, wear_iteration)?;
    let mut runner = Runner::new(inputs, threads, observer);
    runner.load_once(reader)?;
    let tables = match declaration.when {
        When::Once => {
            let no_tables = Tables::new();
            runner.compute(
                declaration,
                0,
                OutputSchedule::default(),
                &no_tables,
                &no_tables,
            )?
        }
        _ => {
            let before = match wear_iteration.checked_sub(1) {
                Some(before) if reader.commit_of(before).is_err() => {
                    return Err(RunError::WithoutTheOneBefore { wear_iteration });
                }
                Some(before) => runner.previous_tables(reader, before)?,
                None => Tables::new(),
            };
            let mut recomputation = Recomputation {
                recipe,
                reader,
                wear_iteration,
                before,
                runner,
                done: BTreeMap::new(),
            };
            recomputation.compute(declaration)?
        }
    };
    let mut same = BTreeMap::new();
    for (name, table) in &tables {
        let stored = match declaration.when {
            When::Once => reader.read_once(*name)?,
            // A table that was not due is computed but not stored.
            _ => reader
                .commit_of(wear_iteration)?
                .table(name.as_str())
                .filter(|_| last_writer(recipe, wear_iteration, *name) == Some(stage))
                .map(|_| reader.read(wear_iteration, *name))
                .transpose()?,
        };
        if let Some(stored) = stored {
            same.insert(*name, stored == *table);
        }
    }
    Ok(Recomputed { tables, same })
}

/// Rejects an iteration that a sibling run inherited from a run of another scene.
pub fn require_own(reader: &RunReader, wear_iteration: u64) -> Result<(), RunError> {
    let record = reader.record();
    let origin = record.origin.as_ref();
    match origin.filter(|origin| wear_iteration <= origin.wear_iteration) {
        Some(origin) if reader.scene_hash_of(wear_iteration)? != record.scene_hash => {
            Err(RunError::OfAnotherScene {
                wear_iteration,
                run: origin.run.clone(),
            })
        }
        _ => Ok(()),
    }
}

/// Returns the last stage that writes a table in an iteration.
fn last_writer(recipe: &Recipe, wear_iteration: u64, table: TableName) -> Option<Stage> {
    let writers = stages_in(recipe, wear_iteration);
    let writers = writers.filter(|s| s.writes_in(recipe).any(|written| written == table));
    writers.last().map(|writer| writer.stage)
}

struct Recomputation<'a> {
    recipe: &'a Recipe,
    reader: &'a RunReader,
    wear_iteration: u64,
    before: Tables,
    runner: Runner<'a>,
    /// Stages that were computed again as inputs.
    done: BTreeMap<Stage, Tables>,
}

impl Recomputation<'_> {
    fn compute(&mut self, stage: &'static Declaration) -> Result<Tables, RunError> {
        let k = self.wear_iteration;
        let mut tables = Tables::new();
        // The schedule of the iteration follows from its wear step.
        let reads = stage.reads.iter().copied().chain([TableName::WearStep]);
        for name in reads.filter(|name| is_in(self.recipe, *name)) {
            let Some(writer) = writer_before(self.recipe, k, stage.stage, name) else {
                continue;
            };
            if writer.when == When::Once {
                continue;
            }
            let table = match last_writer(self.recipe, k, name) == Some(writer.stage) {
                true => read_optional(self.reader, k, name)?,
                false => self.recomputed(writer)?.remove(&name),
            };
            tables.extend(table.map(|table| (name, table)));
        }
        let moment = IterationSchedule::of(self.recipe, k, &tables, &self.before)?;
        self.runner
            .compute(stage, k, moment.due, &tables, &self.before)
    }

    fn recomputed(&mut self, stage: &'static Declaration) -> Result<Tables, RunError> {
        if let Some(tables) = self.done.get(&stage.stage) {
            return Ok(tables.clone());
        }
        let tables = self.compute(stage)?;
        self.done.insert(stage.stage, tables.clone());
        Ok(tables)
    }
}
