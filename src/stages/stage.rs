//! The names of the stages, and when each is passed through.

use std::fmt;
use std::str::FromStr;

/// A stage, in the order in which they are passed through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// The reduced structure, once a run and shared between runs.
    Structure,
    /// The unworn surface, once a run.
    Surface,
    /// The unworn joint under its load, once a run.
    Reference,
    /// The wear of the same scene on half the grid, once a run.
    GridTwin,
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
    /// The coarse trajectory, whose differences make the error bars.
    CoarseTrajectory,
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

    /// Whether what it has solved is kept where it is interrupted, and it goes on from there.
    pub fn keeps_solves(self) -> bool {
        matches!(self, Stage::DynamicResponse | Stage::ForcedResponse)
    }

    /// Name in tables, keys and on the command line.
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
