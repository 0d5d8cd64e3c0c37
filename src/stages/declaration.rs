//! What a stage is: a value that says what it reads and what it writes, and computes the one from the other.

use std::fmt;
use std::str::FromStr;

use super::RunError;
use super::moment::Moment;
use super::reads::{Outputs, Reads};
use super::solvers::Solvers;
use crate::recipe::{Part, Recipe};
use crate::tables::{Place, TableName};

/// A stage, in the order in which they are passed through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// The reduced structure, once a run and shared between runs.
    Structure,
    /// The unworn surface, once a run.
    Surface,
    /// The unworn joint under its load, once a run.
    Reference,
    /// The state before any wear.
    Unworn,
    /// The wear step that leads to an iteration.
    Wear,
    /// Pressure, gap and stiffness.
    StaticContact,
    /// The contact elements of the structure, where they are due.
    ModelUpdate,
    /// The steady vibration.
    DynamicResponse,
    /// The vibration of the worn joint over the frequency range, where it is asked for.
    ForcedResponse,
    /// Shear, slip and dissipation over a steady cycle.
    FrettingCycle,
    /// What the fine contact and the contact elements say of the same quantity.
    Ledger,
    /// The figures of an iteration with their error bars.
    Summary,
}

/// When a stage is passed through.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// Once a run.
    Once,
    /// In the unworn iteration alone.
    Unworn,
    /// In every iteration but the unworn one.
    Worn,
    /// In every iteration.
    Always,
}

impl When {
    /// True if an iteration passes through such a stage.
    pub fn is_in(self, wear_iteration: u64) -> bool {
        match self {
            When::Once => false,
            When::Unworn => wear_iteration == 0,
            When::Worn => wear_iteration > 0,
            When::Always => true,
        }
    }
}

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
    pub compute: fn(&Reads, &mut Solvers) -> Result<Outputs, RunError>,
}

impl Declaration {
    /// The tables that it writes in a run of this recipe, unless they are not due.
    pub fn writes_in(&self, recipe: &Recipe) -> impl Iterator<Item = TableName> {
        let writes = self.writes.iter().copied();
        writes.filter(|table| is_in(recipe, *table))
    }

    /// True if a run of this recipe has the stage.
    pub fn is_in(&self, recipe: &Recipe) -> bool {
        is_in(recipe, self.writes[0])
    }
}

/// True if runs of a recipe have a table: absent physics has none.
pub fn is_in(recipe: &Recipe, table: TableName) -> bool {
    let structure = recipe.structure.as_ref();
    let (rough, vibrates) = (recipe.surface().is_some(), structure.is_some());
    let bolted = recipe.contact().is_some_and(|c| c.bolt_stiffness.is_some());
    let curves = recipe.output.curves_every > 0;
    match table {
        TableName::Structure
        | TableName::StructurePort
        | TableName::StructureMode
        | TableName::StructureResidual => structure.is_some_and(|s| s.is_reduced()),
        TableName::Surface | TableName::ContactField | TableName::StaticContact => rough,
        TableName::Reference => rough && (vibrates || bolted),
        TableName::WearField | TableName::WearStep => recipe.wear.is_some(),
        TableName::Indentation => rough && curves,
        TableName::Hysteresis => recipe.cycle().is_some() && curves,
        TableName::Cycle | TableName::FrettingCycle => recipe.cycle().is_some(),
        TableName::ContactElement | TableName::JointCycle => {
            vibrates && recipe.elements().is_some()
        }
        TableName::Response | TableName::DynamicResponse | TableName::Frf => vibrates,
        TableName::ReferenceElement
        | TableName::ModelUpdate
        | TableName::WornResponse
        | TableName::Ledger => rough && vibrates,
        TableName::Summary | TableName::Timing => true,
        TableName::Trade | TableName::Claims => false,
    }
}

/// The stages of a recipe, in their order.
pub fn stages_of(recipe: &Recipe) -> impl Iterator<Item = &'static Declaration> {
    super::STAGES
        .into_iter()
        .filter(|stage| stage.is_in(recipe))
}

/// True of a table that is written once a run.
pub fn is_once(table: TableName) -> bool {
    table.schema().place == Place::Once
}

impl Stage {
    /// All stages.
    pub const ALL: [Stage; 12] = [
        Stage::Structure,
        Stage::Surface,
        Stage::Reference,
        Stage::Unworn,
        Stage::Wear,
        Stage::StaticContact,
        Stage::ModelUpdate,
        Stage::DynamicResponse,
        Stage::ForcedResponse,
        Stage::FrettingCycle,
        Stage::Ledger,
        Stage::Summary,
    ];

    /// Name in tables, keys and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Structure => "structure",
            Stage::Surface => "surface",
            Stage::Reference => "reference",
            Stage::Unworn => "unworn",
            Stage::Wear => "wear",
            Stage::StaticContact => "static_contact",
            Stage::ModelUpdate => "model_update",
            Stage::DynamicResponse => "dynamic_response",
            Stage::ForcedResponse => "forced_response",
            Stage::FrettingCycle => "fretting_cycle",
            Stage::Ledger => "ledger",
            Stage::Summary => "summary",
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A name that is no stage.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("\"{name}\" is no stage; the stages are {}", Stage::ALL.map(Stage::name).join(", "))]
pub struct UnknownStage {
    /// The name.
    pub name: String,
}

impl FromStr for Stage {
    type Err = UnknownStage;

    fn from_str(name: &str) -> Result<Self, UnknownStage> {
        let named = Stage::ALL.into_iter().find(|stage| stage.name() == name);
        named.ok_or_else(|| UnknownStage {
            name: name.to_owned(),
        })
    }
}
