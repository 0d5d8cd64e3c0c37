//! What a stage is: a value that says what it reads and what it writes, and computes the one from the other.

use super::RunError;
use super::output_schedule::Moment;
use super::solvers::Solvers;
use super::stage::{Stage, When};
use super::stage_inputs::{DeclaredInputs, Outputs, StageInputs};
use crate::recipe::{Part, Recipe, Wear};
use crate::tables::TableName;

/// What a stage reads and writes, and how it computes the one from the other. A stage sees nothing but what it declares, and its key is
/// made of that: no table is used again that was computed from something else.
pub struct Declaration {
    /// Which stage.
    pub stage: Stage,
    /// When it is passed through.
    pub when: When,
    /// Parts of the recipe that it reads.
    pub recipe: &'static [Part],
    /// Tables of the run and of its own iteration that it reads, each as the last stage before it has written it.
    pub reads: &'static [TableName],
    /// Tables of the iteration before that it reads.
    pub before: &'static [TableName],
    /// Tables that it writes, its own first: a run that has that table has the stage. Others of physics that a scene does not have are
    /// left out, and what is not due.
    pub writes: &'static [TableName],
    /// Whether it has anything to do in an iteration of its run.
    pub is_due: fn(&Moment) -> bool,
    /// Whether its tables are shared between runs.
    pub shared: bool,
    /// Computes the tables. It holds no state of a run, and the solvers hold none either.
    pub compute: fn(&StageInputs, &mut Solvers) -> Result<Outputs, RunError>,
}

/// The tables of several lists, in their order. `N` is the sum of the lengths.
pub(super) const fn joined<const N: usize>(lists: &[&[TableName]]) -> [TableName; N] {
    let mut tables = [TableName::Summary; N];
    let (mut list, mut at) = (0, 0);
    while list < lists.len() {
        let mut own = 0;
        while own < lists[list].len() {
            tables[at] = lists[list][own];
            (own, at) = (own + 1, at + 1);
        }
        list += 1;
    }
    assert!(at == N, "N is the sum of the lengths");
    tables
}

impl Declaration {
    /// What it reads.
    pub(super) fn declared(&self) -> DeclaredInputs {
        DeclaredInputs {
            stage: self.stage,
            recipe: self.recipe,
            reads: self.reads,
            before: self.before,
        }
    }

    /// The tables that it writes in a run of this recipe, unless they are not due.
    pub fn writes_in(&self, recipe: &Recipe) -> impl Iterator<Item = TableName> {
        let writes = self.writes.iter().copied();
        writes.filter(|table| is_in(recipe, *table))
    }

    /// True if a run of this recipe has the stage.
    pub fn is_in(&self, recipe: &Recipe) -> bool {
        match self.stage {
            // The worn response of a joint, the forced response over a range, or both.
            Stage::ForcedResponse => self.writes_in(recipe).next().is_some(),
            _ => is_in(recipe, self.writes[0]),
        }
    }
}

/// True if runs of a recipe have a table: absent physics has none.
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
