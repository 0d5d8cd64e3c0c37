//! Names of the stages, and the iterations in which each stage runs.

use std::fmt;
use std::str::FromStr;

/// A stage. The variants are in the order in which they run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// The reduced structure, once per run and shared between runs.
    Structure,
    /// The unworn surface, once per run.
    Surface,
    /// The run solves the unworn joint under the load of the scene once.
    Reference,
    /// The wear of the same scene on half the grid, once per run.
    GridTwin,
    /// The state before any wear.
    Unworn,
    /// The wear step that leads to an iteration.
    Wear,
    /// Pressure, gap and stiffness.
    StaticContact,
    /// The contact elements of the structure, where an update is due.
    ModelUpdate,
    /// The steady vibration.
    DynamicResponse,
    /// The forced response of the worn joint over the frequency range. The stage runs only if the scene requests the
    /// forced response.
    ForcedResponse,
    /// Shear, slip and dissipation over a steady cycle.
    FrettingCycle,
    /// The coarse trajectory. The difference between the coarse and the fine trajectory gives the error bars.
    CoarseTrajectory,
    /// Comparison of the fine contact with the contact elements.
    Ledger,
    /// The results of an iteration with their error bars.
    Summary,
}

/// The iterations in which a stage runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// Once per run.
    Once,
    /// In the unworn iteration only.
    Unworn,
    /// In every iteration except the unworn one.
    Worn,
    /// In every iteration.
    Always,
}

impl When {
    /// Returns true if a stage with the rule `self` runs in iteration `wear_iteration`.
    pub fn is_in(self, wear_iteration: u64) -> bool {
        match self {
            When::Once => false,
            When::Unworn => wear_iteration == 0,
            When::Worn => wear_iteration > 0,
            When::Always => true,
        }
    }
}

impl Stage {
    /// All stages.
    pub const ALL: [Stage; 14] = [
        Stage::Structure,
        Stage::Surface,
        Stage::Reference,
        Stage::GridTwin,
        Stage::Unworn,
        Stage::Wear,
        Stage::StaticContact,
        Stage::ModelUpdate,
        Stage::DynamicResponse,
        Stage::ForcedResponse,
        Stage::FrettingCycle,
        Stage::CoarseTrajectory,
        Stage::Ledger,
        Stage::Summary,
    ];

    /// Returns true if an interrupted stage keeps its solutions and continues after them.
    pub fn keeps_solves(self) -> bool {
        matches!(self, Stage::DynamicResponse | Stage::ForcedResponse)
    }

    /// Returns the name used in tables, in keys and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Structure => "structure",
            Stage::Surface => "surface",
            Stage::Reference => "reference",
            Stage::GridTwin => "grid_twin",
            Stage::Unworn => "unworn",
            Stage::Wear => "wear",
            Stage::StaticContact => "static_contact",
            Stage::ModelUpdate => "model_update",
            Stage::DynamicResponse => "dynamic_response",
            Stage::ForcedResponse => "forced_response",
            Stage::FrettingCycle => "fretting_cycle",
            Stage::CoarseTrajectory => "coarse_trajectory",
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

/// Error for a name that is not a stage.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("\"{name}\" is not a stage; the stages are {}", Stage::ALL.map(Stage::name).join(", "))]
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
