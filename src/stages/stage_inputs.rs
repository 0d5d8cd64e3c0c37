//! What a stage is given, and what it gives back.

use super::RunError;
use super::error::NumericsError;
use super::output_schedule::OutputSchedule;
use super::stage::Stage;
use crate::recipe::{GridTwin, Inputs, Part, Recipe};
use crate::structure::imported::Imported;
use crate::surface::prepare::PreparedSurface;
use crate::tables::{TableName, Tables, TypedTable};
use crate::wear::{Motion, WearError};

/// What a stage reads: of everything there is, what it declares.
pub struct StageInputs<'a> {
    /// The parts of the recipe that the stage declares; none of the others.
    pub recipe: Recipe,
    /// The iteration.
    pub wear_iteration: u64,
    /// Whether the curves behind the stiffnesses belong to this iteration.
    pub curves_due: bool,
    /// Whether the run ends with this iteration.
    pub ends: bool,
    /// Whether a forced response belongs to it.
    pub forced_response_due: bool,
    /// Whether its cycle is held against a stepped one.
    pub cycle_check_due: bool,
    declared: DeclaredInputs,
    inputs: &'a Inputs,
    tables: Vec<&'a Tables>,
    before: &'a Tables,
    unworn: &'a Tables,
}

/// What a stage declares that it reads.
#[derive(Clone, Copy)]
pub struct DeclaredInputs {
    /// Which stage.
    pub stage: Stage,
    /// Parts of the recipe.
    pub recipe: &'static [Part],
    /// Tables of the run and of its own iteration.
    pub reads: &'static [TableName],
    /// Tables of the iteration before.
    pub before: &'static [TableName],
}

/// What a stage has computed.
#[derive(Default)]
pub struct Outputs {
    /// Its tables.
    pub tables: Tables,
    /// What the user should know of them.
    pub notices: Vec<String>,
}

impl Outputs {
    /// Adds a table.
    pub fn put<T: TypedTable>(&mut self, values: &T) -> Result<(), RunError> {
        self.tables.insert(T::TABLE, values.to_table()?);
        Ok(())
    }

    /// Adds something that the user should know.
    pub fn notice(&mut self, text: impl Into<String>) {
        self.notices.push(text.into());
    }
}

impl<'a> StageInputs<'a> {
    /// What of a run the stage sees. `tables` are those of the iteration, as the stages before this one have written them, and those of
    /// the run; `before` are those of the iteration before, if there is one, and `unworn` one-row tables of the first.
    pub fn new(
        declared: DeclaredInputs,
        inputs: &'a Inputs,
        wear_iteration: u64,
        due: OutputSchedule,
        tables: [&'a Tables; 2],
        [before, unworn]: [&'a Tables; 2],
    ) -> StageInputs<'a> {
        let mut recipe = inputs.recipe.only(declared.recipe);
        if !due.cycle_fields {
            recipe.output.cycle_fields = None;
        }
        StageInputs {
            recipe,
            wear_iteration,
            curves_due: due.curves && declared.recipe.contains(&Part::Curves),
            ends: due.end && declared.recipe.contains(&Part::End),
            forced_response_due: due.forced_response
                && declared.recipe.contains(&Part::ForcedResponse),
            cycle_check_due: due.cycle_check && declared.recipe.contains(&Part::End),
            declared,
            inputs,
            tables: tables.to_vec(),
            before,
            unworn,
        }
    }

    /// The same of another recipe, with `tables` in place of its own.
    pub fn with<'b>(&'b self, recipe: &Recipe, tables: &'b Tables) -> StageInputs<'b> {
        StageInputs {
            recipe: recipe.clone(),
            tables: [&[tables], &self.tables[..]].concat(),
            ..*self
        }
    }

    /// A table of the run or of this iteration.
    pub fn table<T: TypedTable>(&self) -> Result<T, RunError> {
        self.maybe()?.ok_or_else(|| self.missing(T::TABLE))
    }

    /// A table of the run or of this iteration; none where there is none.
    pub fn maybe<T: TypedTable>(&self) -> Result<Option<T>, RunError> {
        self.require_declared(T::TABLE, self.declared.reads);
        let table = self.tables.iter().find_map(|of| of.get(&T::TABLE));
        Ok(table.map(T::of).transpose()?)
    }

    /// A table of the iteration before.
    pub fn before<T: TypedTable>(&self) -> Result<T, RunError> {
        self.optional_before()?
            .ok_or_else(|| self.missing(T::TABLE))
    }

    /// A table of the iteration before; none where there is none, and none of the unworn state.
    pub fn optional_before<T: TypedTable>(&self) -> Result<Option<T>, RunError> {
        self.require_declared(T::TABLE, self.declared.before);
        let table = self.before.get(&T::TABLE);
        Ok(table.map(T::of).transpose()?)
    }

    /// A one-row table of the unworn iteration, of which that before follows; none in the unworn state itself.
    pub fn unworn<T: TypedTable>(&self) -> Result<Option<T>, RunError> {
        self.require_declared(T::TABLE, self.declared.before);
        let table = self.unworn.get(&T::TABLE);
        Ok(table.map(T::of).transpose()?)
    }

    /// The motion that is prescribed; of no axis where none is.
    pub fn motion(&self) -> &Motion {
        self.require_part(Part::Cycle);
        &self.inputs.motion
    }

    /// What the same scene on half the grid has worn, where that is asked for and has been run.
    pub fn grid_twin(&self) -> Option<&GridTwin> {
        self.require_part(Part::GridCheck);
        self.inputs.grid_twin.as_deref()
    }

    /// The heights of a surface from a file on the joint's cells; none of another surface.
    pub fn measured(&self) -> Option<&PreparedSurface> {
        self.require_part(Part::Surface);
        self.inputs.measured.as_deref()
    }

    /// The matrices of a structure that comes from files; none of another.
    pub fn imported(&self) -> Option<&Imported> {
        self.require_part(Part::Structure);
        self.inputs.imported.as_deref()
    }

    /// The error of a run whose stage failed.
    pub fn failed(&self, error: NumericsError) -> RunError {
        let (stage, wear_iteration) = (self.declared.stage, self.wear_iteration);
        match error {
            NumericsError::ModelUpdate(source) => RunError::ModelUpdate(source),
            NumericsError::Wear(WearError::Contact(source)) => RunError::Contact {
                stage,
                wear_iteration,
                source,
            },
            NumericsError::Wear(source) => RunError::Wear {
                stage,
                wear_iteration,
                source,
            },
        }
    }

    fn missing(&self, table: TableName) -> RunError {
        RunError::NotComputed {
            stage: self.declared.stage,
            table,
        }
    }

    fn require_declared(&self, table: TableName, declared: &[TableName]) {
        let stage = self.declared.stage;
        assert!(
            declared.contains(&table),
            "{stage} reads {table} and does not declare it"
        );
    }

    fn require_part(&self, part: Part) {
        let (stage, name) = (self.declared.stage, part.name());
        assert!(
            self.declared.recipe.contains(&part),
            "{stage} reads {name} and does not declare it"
        );
    }
}
