//! Declaration of a stage: the inputs and the tables of the stage, and the function that computes the tables.

use super::RunError;
use super::output_schedule::IterationSchedule;
use super::solvers::Solvers;
use super::stage::{Stage, When};
use super::stage_inputs::{DeclaredInputs, Outputs, StageInputs};
use crate::recipe::{Part, Recipe, Wear};
use crate::tables::TableName;

/// Inputs and tables of a stage, and the function that computes the tables. A stage reads only the declared inputs. The
/// key of the stored tables consists of the declared inputs, so a run never reuses tables from other inputs.
pub struct Declaration {
    /// The stage.
    pub stage: Stage,
    /// The iterations in which the stage runs.
    pub when: When,
    /// Parts of the recipe that the stage reads.
    pub recipe: &'static [Part],
    /// Tables of the run and of the same iteration that the stage reads. Each table is read as the last earlier stage
    /// wrote it.
    pub reads: &'static [TableName],
    /// Tables of the previous iteration that the stage reads.
    pub before: &'static [TableName],
    /// Tables that the stage writes. The first table identifies the stage: a run that has this table has the stage. The
    /// stage omits a table if the scene does not have the physics of the table, or if the table is not due.
    pub writes: &'static [TableName],
    /// Returns true if the stage has work to do in an iteration.
    pub is_due: fn(&IterationSchedule) -> bool,
    /// True if runs share the tables of this stage.
    pub shared: bool,
    /// Computes the tables. The function `compute` and the solvers keep no state of a run.
    pub compute: fn(&StageInputs, &mut Solvers) -> Result<Outputs, RunError>,
}

/// Concatenates lists of tables. `N` is the sum of the lengths.
pub(super) const fn joined<const N: usize>(lists: &[&[TableName]]) -> [TableName; N] {
    let mut tables = [TableName::Summary; N];
    let (mut list, mut at) = (0, 0);
    while list < lists.len() {
        let mut item = 0;
        while item < lists[list].len() {
            tables[at] = lists[list][item];
            (item, at) = (item + 1, at + 1);
        }
        list += 1;
    }
    assert!(at == N, "N is the sum of the lengths");
    tables
}

impl Declaration {
    /// Returns the declared inputs.
    pub(super) fn declared(&self) -> DeclaredInputs {
        DeclaredInputs {
            stage: self.stage,
            recipe: self.recipe,
            reads: self.reads,
            before: self.before,
        }
    }

    /// Returns the tables that the stage writes in a run of `recipe`. Some of the tables are due only in some
    /// iterations.
    pub fn writes_in(&self, recipe: &Recipe) -> impl Iterator<Item = TableName> {
        let writes = self.writes.iter().copied();
        writes.filter(|table| is_in(recipe, *table))
    }

    /// Returns true if a run of `recipe` has the stage.
    pub fn is_in(&self, recipe: &Recipe) -> bool {
        match self.stage {
            // The stage writes the worn response of a joint, the forced response over a range, or both.
            Stage::ForcedResponse => self.writes_in(recipe).next().is_some(),
            _ => is_in(recipe, self.writes[0]),
        }
    }
}

/// Returns true if runs of a recipe have a table. Tables of absent physics do not exist.
pub fn is_in(recipe: &Recipe, table: TableName) -> bool {
    let structure = recipe.structure.as_ref();
    let (rough, vibrates) = (recipe.surface().is_some(), structure.is_some());
    let bolted = recipe
        .contact()
        .is_some_and(|c| c.conditions.bolt_stiffness.is_some());
    let curves = recipe.output.curves_every > 0;
    match table {
        TableName::Structure
        | TableName::StructurePort
        | TableName::StructureMode
        | TableName::StructureResidual => structure.is_some_and(|s| s.is_reduced()),
        TableName::StructureDamping => {
            let import = structure.and_then(|s| s.source.import());
            import.is_some_and(|import| import.has_damping)
        }
        TableName::StructureOutline | TableName::StructureOutlineMode => {
            let import = structure.and_then(|s| s.source.import());
            let is_mesh = import.is_some_and(|import| import.has_outline);
            is_mesh || structure.is_some_and(|s| s.source.resonator().is_some())
        }
        TableName::Surface | TableName::ContactField | TableName::StaticContact => rough,
        TableName::GridTwin => recipe.grid_check,
        TableName::Reference => rough && (vibrates || bolted),
        TableName::WearField | TableName::WearStep => recipe.wear.is_some(),
        TableName::CoarseField | TableName::CoarseStep => {
            let is_implicit = |wear: &Wear| wear.scheme.estimates_error();
            !vibrates && recipe.wear.as_ref().is_some_and(is_implicit)
        }
        TableName::Indentation => rough && curves,
        TableName::Hysteresis => recipe.cycle().is_some() && curves,
        TableName::Cycle | TableName::FrettingCycle => recipe.cycle().is_some(),
        TableName::CycleField => recipe.cycle().is_some() && recipe.output.cycle_fields.is_some(),
        TableName::ContactSlider => {
            let elements = recipe.elements();
            vibrates && elements.is_some_and(|elements| elements.has_banks())
        }
        TableName::ContactElement | TableName::JointCycle => {
            vibrates && recipe.elements().is_some()
        }
        TableName::Response | TableName::DynamicResponse | TableName::Resonance => vibrates,
        TableName::Frf | TableName::FrfHarmonic => {
            let response = recipe.response.as_ref();
            vibrates && response.is_some_and(|response| response.frequency.is_some())
        }
        TableName::ReferenceElement
        | TableName::ModelUpdate
        | TableName::WornResponse
        | TableName::Ledger => rough && vibrates,
        TableName::Summary | TableName::Timing => true,
        TableName::Backbone
        | TableName::Trade
        | TableName::Claims
        | TableName::CampaignFigure
        | TableName::CampaignBand
        | TableName::CampaignSensitivity => false,
    }
}
