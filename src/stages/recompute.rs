//! A stage of a committed iteration, computed again from the tables of the run alone.

use std::collections::BTreeMap;

use super::RunError;
use super::declaration::{Declaration, is_in};
use super::list::STAGES;
use super::observer::Observer;
use super::output_schedule::{Moment, OutputSchedule};
use super::runner::{Runner, read_optional, stages_in, writer_before};
use super::stage::{Stage, When};
use crate::recipe::{Inputs, Recipe};
use crate::store::RunReader;
use crate::tables::{TableName, Tables};

/// A stage that was computed again.
pub struct Recomputed {
    /// Its tables.
    pub tables: Tables,
    /// Those of them that the run holds as this stage wrote them, and whether they are the same to the last bit. A table that was not
    /// due, or that a later stage writes again, is not among them.
    pub same: BTreeMap<TableName, bool>,
}

/// Computes a stage of an iteration again; of a stage that is passed through once a run, the iteration does not matter. What it reads is
/// what is committed; a table that a later stage has written again is computed again by the stage that wrote it first.
///
/// # Errors
/// [`RunError::NotInIteration`], [`RunError::WithoutTheOneBefore`], [`RunError::OfAnotherScene`], those of reading the run, and those of the
/// stage.
pub fn recompute(
    reader: &RunReader,
    inputs: &Inputs,
    stage: Stage,
    wear_iteration: u64,
    threads: usize,
    observer: &dyn Observer,
) -> Result<Recomputed, RunError> {
    let recipe = &inputs.recipe;
    let of_iteration = || stages_in(recipe, wear_iteration);
    let once = STAGES
        .into_iter()
        .filter(|s| s.when == When::Once && s.is_in(recipe));
    let all: Vec<&'static Declaration> = once.chain(of_iteration()).collect();
    let Some(declaration) = all.iter().copied().find(|s| s.stage == stage) else {
        let stages = all.iter().map(|s| s.stage).collect();
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
            let none = Tables::new();
            runner.compute(declaration, 0, OutputSchedule::default(), &none, &none)?
        }
        _ => {
            let before = match wear_iteration.checked_sub(1) {
                Some(before) if reader.commit_of(before).is_err() => {
                    return Err(RunError::WithoutTheOneBefore { wear_iteration });
                }
                Some(before) => runner.before(reader, before)?,
                None => Tables::new(),
            };
            let mut again = Recomputation {
                recipe,
                reader,
                wear_iteration,
                before,
                runner,
                done: BTreeMap::new(),
            };
            again.compute(declaration)?
        }
    };
    let mut same = BTreeMap::new();
    for (name, table) in &tables {
        let held = match declaration.when {
            When::Once => reader.read_once(*name)?,
            // What was not due is not there, and is computed all the same.
            _ => reader
                .commit_of(wear_iteration)?
                .table(name.as_str())
                .filter(|_| last_writer(recipe, wear_iteration, *name) == Some(stage))
                .map(|_| reader.read(wear_iteration, *name))
                .transpose()?,
        };
        if let Some(held) = held {
            same.insert(*name, held == *table);
        }
    }
    Ok(Recomputed { tables, same })
}

/// Refuses an iteration that a sibling took over from a run of another scene.
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

/// The stage whose version of a table an iteration holds.
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
    /// What was computed on the way.
    done: BTreeMap<Stage, Tables>,
}

impl Recomputation<'_> {
    fn compute(&mut self, stage: &'static Declaration) -> Result<Tables, RunError> {
        let k = self.wear_iteration;
        let mut tables = Tables::new();
        // Where the iteration stands follows from its step.
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
                false => self.again(writer)?.remove(&name),
            };
            tables.extend(table.map(|table| (name, table)));
        }
        let moment = Moment::of(self.recipe, k, &tables, &self.before)?;
        self.runner
            .compute(stage, k, moment.due, &tables, &self.before)
    }

    fn again(&mut self, stage: &'static Declaration) -> Result<Tables, RunError> {
        if let Some(tables) = self.done.get(&stage.stage) {
            return Ok(tables.clone());
        }
        let tables = self.compute(stage)?;
        self.done.insert(stage.stage, tables.clone());
        Ok(tables)
    }
}
