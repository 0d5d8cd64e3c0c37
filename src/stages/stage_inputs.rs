//! Inputs and outputs of a stage.

use super::RunError;
use super::error::NumericsError;
use super::output_schedule::OutputSchedule;
use super::stage::Stage;
use crate::recipe::{GridTwin, Inputs, Part, Recipe};
use crate::structure::imported::ImportedStructure;
use crate::surface::prepare::PreparedSurface;
use crate::tables::{TableName, Tables, TypedTable};
use crate::wear::{Motion, WearError};

/// Inputs of a stage, restricted to the inputs that it declares.
pub struct StageInputs<'a> {
    /// The declared parts of the recipe, without all other parts.
    pub recipe: Recipe,
    /// The iteration.
    pub wear_iteration: u64,
    /// True if the iteration writes the force-displacement curves of the stiffnesses.
    pub curves_due: bool,
    /// True if the iteration is the last iteration of the run.
    pub is_last: bool,
    /// True if the iteration writes a forced response.
    pub forced_response_due: bool,
    /// True if the iteration compares the reversal cycle with a stepped cycle.
    pub cycle_check_due: bool,
    declared: DeclaredInputs,
    inputs: &'a Inputs,
    tables: Vec<&'a Tables>,
    before: &'a Tables,
    unworn: &'a Tables,
}

/// Inputs that a stage declares.
#[derive(Clone, Copy)]
pub struct DeclaredInputs {
    /// The stage.
    pub stage: Stage,
    /// Parts of the recipe.
    pub recipe: &'static [Part],
    /// Tables of the run and of the same iteration.
    pub reads: &'static [TableName],
    /// Tables of the previous iteration.
    pub before: &'static [TableName],
}

/// Results of a stage.
#[derive(Default)]
pub struct Outputs {
    /// Its tables.
    pub tables: Tables,
    /// Notices for the user.
    pub notices: Vec<String>,
}

impl Outputs {
    /// Adds a table.
    pub fn add_table<T: TypedTable>(&mut self, values: &T) -> Result<(), RunError> {
        self.tables.insert(T::TABLE, values.to_table()?);
        Ok(())
    }

    /// Adds a notice for the user.
    pub fn notice(&mut self, text: impl Into<String>) {
        self.notices.push(text.into());
    }
}

impl<'a> StageInputs<'a> {
    /// Collects the inputs of a stage.
    ///
    /// `tables` contains the tables that the run computes once. `tables` also contains the tables of earlier stages of
    /// the iteration. `before` contains the tables of the previous iteration, and is empty if no previous iteration
    /// exists. `unworn` contains the one-row tables of the first iteration.
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
            is_last: due.end && declared.recipe.contains(&Part::End),
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

    /// Returns the same inputs with another recipe. Lookups search `tables` first.
    pub fn with_recipe<'b>(&'b self, recipe: &Recipe, tables: &'b Tables) -> StageInputs<'b> {
        StageInputs {
            recipe: recipe.clone(),
            tables: [&[tables], &self.tables[..]].concat(),
            ..*self
        }
    }

    /// Returns the table `T` from the current iteration or from the tables that are computed once per run.
    pub fn table<T: TypedTable>(&self) -> Result<T, RunError> {
        self.optional_table()?.ok_or_else(|| self.missing(T::TABLE))
    }

    /// Returns the table `T` from the current iteration or from the tables that are computed once per run. Returns
    /// `None` if the table does not exist.
    pub fn optional_table<T: TypedTable>(&self) -> Result<Option<T>, RunError> {
        self.require_declared(T::TABLE, self.declared.reads);
        let table = self.tables.iter().find_map(|tables| tables.get(&T::TABLE));
        Ok(table.map(T::of).transpose()?)
    }

    /// Returns a table of the previous iteration.
    pub fn before<T: TypedTable>(&self) -> Result<T, RunError> {
        self.optional_previous_table()?
            .ok_or_else(|| self.missing(T::TABLE))
    }

    /// Returns a table of the previous iteration, or `None` if it does not exist. The unworn state has no previous
    /// iteration.
    pub fn optional_previous_table<T: TypedTable>(&self) -> Result<Option<T>, RunError> {
        self.require_declared(T::TABLE, self.declared.before);
        let table = self.before.get(&T::TABLE);
        Ok(table.map(T::of).transpose()?)
    }

    /// Returns a one-row table of the unworn iteration, or `None` in the unworn state itself.
    pub fn unworn<T: TypedTable>(&self) -> Result<Option<T>, RunError> {
        self.require_declared(T::TABLE, self.declared.before);
        let table = self.unworn.get(&T::TABLE);
        Ok(table.map(T::of).transpose()?)
    }

    /// Returns the prescribed motion. The motion has no axis if the scene prescribes no motion.
    pub fn motion(&self) -> &Motion {
        self.require_part(Part::Cycle);
        &self.inputs.motion
    }

    /// Returns the wear of the run on half the grid. Returns `None` if the scene requests no grid check, or before the
    /// run on half the grid is done.
    pub fn grid_twin(&self) -> Option<&GridTwin> {
        self.require_part(Part::GridCheck);
        self.inputs.grid_twin.as_deref()
    }

    /// Returns the heights of a surface that comes from a file, on the cells of the joint; `None` for other surfaces.
    pub fn measured(&self) -> Option<&PreparedSurface> {
        self.require_part(Part::Surface);
        self.inputs.measured.as_deref()
    }

    /// Returns the matrices of a structure that comes from files; `None` for other structures.
    pub fn imported(&self) -> Option<&ImportedStructure> {
        self.require_part(Part::Structure);
        self.inputs.imported.as_deref()
    }

    /// Converts a numerical error into the error of a run at this stage.
    pub fn run_error(&self, error: NumericsError) -> RunError {
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
