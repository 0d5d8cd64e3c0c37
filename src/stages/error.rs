//! Why a run ended without its result.

use crate::contact::ContactError;
use crate::dynamics::DynamicsError;
use crate::model_update::ModelUpdateError;
use crate::recipe::CycleError;
use crate::store::StoreError;
use crate::structure::StructureError;
use crate::structure::imported::ImportError;
use crate::surface::SurfaceError;
use crate::tables::TableError;
use crate::wear::WearError;

/// A run that could not go on. What is committed stays.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A computed motion that the cycle cannot march.
    #[error(transparent)]
    Cycle(#[from] CycleError),
    /// The surface cannot be generated.
    #[error("[surface]: {0}")]
    Surface(#[from] SurfaceError),
    /// A contact solve failed.
    #[error("{stage} of iteration {wear_iteration}: {source}")]
    Contact {
        /// The stage.
        stage: super::stage::Stage,
        /// The iteration.
        wear_iteration: u64,
        /// What is wrong.
        source: ContactError,
    },
    /// A fretting cycle or wear step failed.
    #[error("{stage} of iteration {wear_iteration}: {source}")]
    Wear {
        /// The stage.
        stage: super::stage::Stage,
        /// The iteration.
        wear_iteration: u64,
        /// What is wrong.
        source: WearError,
    },
    /// `--until` a stage that the scene does not have.
    #[error(
        "this scene has no stage {stage}; its stages are {}",
        stages.iter().map(|s| s.name()).collect::<Vec<_>>().join(", ")
    )]
    NoSuchStage {
        /// The stage asked for.
        stage: super::stage::Stage,
        /// Those there are.
        stages: Vec<super::stage::Stage>,
    },
    /// The observer has ended the run before a stage; no failure.
    #[error("the run was ended before {0}")]
    EndedBefore(super::stage::Stage),
    /// A table that a stage reads and that is not there.
    #[error(
        "the table {table} of {stage} is not there: start the run again, which computes it, or begin from an earlier iteration"
    )]
    NotComputed {
        /// The stage.
        stage: super::stage::Stage,
        /// The table.
        table: crate::tables::TableName,
    },
    /// A stage that an iteration does not pass through.
    #[error(
        "iteration {wear_iteration} has no stage {stage}; it has {}",
        stages.iter().map(|s| s.name()).collect::<Vec<_>>().join(", ")
    )]
    NotInIteration {
        /// The stage asked for.
        stage: super::stage::Stage,
        /// The iteration.
        wear_iteration: u64,
        /// Those there are.
        stages: Vec<super::stage::Stage>,
    },
    /// A stage cannot be computed again without the iteration before, which is pruned or damaged.
    #[error(
        "iteration {wear_iteration} is computed from iteration {}, which the run does not hold (pruned, or damaged); iterations after one that it holds can be computed again",
        wear_iteration - 1
    )]
    WithoutTheOneBefore {
        /// The iteration asked for.
        wear_iteration: u64,
    },
    /// An iteration that a sibling took over from a run of another scene.
    #[error(
        "iteration {wear_iteration} was computed in the run {run}, of another scene: ask that run"
    )]
    OfAnotherScene {
        /// The iteration asked for.
        wear_iteration: u64,
        /// Name of the run that it comes from.
        run: String,
    },
    /// The structure cannot be meshed or reduced.
    #[error("structure: {0}")]
    Structure(#[from] StructureError),
    /// The matrices of a structure from files.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// The contact elements cannot be made.
    #[error("model_update: {0}")]
    ModelUpdate(#[from] ModelUpdateError),
    /// The contact of the unworn or smooth joint, which the structure is closed by, failed.
    #[error("contact of the unworn joint: {0}")]
    Unworn(#[from] ContactError),
    /// What vibrates cannot be built, or its samples.
    #[error("dynamic_response: {0}")]
    Vibration(#[from] DynamicsError),
    /// No steady vibration was found.
    #[error("dynamic_response of iteration {wear_iteration}: {source}")]
    Dynamics {
        /// The iteration.
        wear_iteration: u64,
        /// What is wrong.
        source: DynamicsError,
    },
    /// The run cannot be compared with one on half the grid.
    #[error("`fidelity.grid_check`: {reason}; leave it out")]
    GridCheck {
        /// Why not.
        reason: &'static str,
    },
    /// The same scene on half the grid has not been run.
    #[error(
        "`fidelity.grid_check`: the same scene on half the grid is run before this one, by `fretwear run`, and is no stage to compute alone"
    )]
    NoGridTwin,
    /// The worn volume asked for is out of reach.
    #[error(
        "`wear.volume` = {volume:.6e} m³ is never reached: the joint stopped wearing at {reached:.6e} m³; give `wear.cycles` too, or a larger motion"
    )]
    WearsNoMore {
        /// The volume asked for \[m³\].
        volume: f64,
        /// The volume reached \[m³\].
        reached: f64,
    },
    /// The run store.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A table.
    #[error(transparent)]
    Table(#[from] TableError),
}

/// What the numerics of a stage can fail of.
pub enum NumericsError {
    Wear(WearError),
    ModelUpdate(ModelUpdateError),
}

impl From<WearError> for NumericsError {
    fn from(error: WearError) -> Self {
        NumericsError::Wear(error)
    }
}

impl From<ContactError> for NumericsError {
    fn from(error: ContactError) -> Self {
        NumericsError::Wear(error.into())
    }
}

impl From<ModelUpdateError> for NumericsError {
    fn from(error: ModelUpdateError) -> Self {
        NumericsError::ModelUpdate(error)
    }
}

impl RunError {
    /// True where a solver did not converge: the last commit is kept, and another tolerance or step may help.
    pub fn is_not_converged(&self) -> bool {
        let contact = |e: &ContactError| matches!(e, ContactError::NotConverged { .. });
        match self {
            RunError::Contact { source, .. } => contact(source),
            RunError::Wear { source, .. } => match source {
                WearError::Contact(source) => contact(source),
                WearError::NotSteady { .. }
                | WearError::NotTightened { .. }
                | WearError::StepTooSmall { .. }
                | WearError::CycleWearsTooMuch { .. } => true,
                WearError::NotStraight | WearError::NotSuperposed => false,
            },
            RunError::WearsNoMore { .. } => true,
            RunError::Unworn(source) => contact(source),
            RunError::Dynamics { source, .. } => source.is_not_converged(),
            RunError::ModelUpdate(source) => {
                matches!(source, ModelUpdateError::NotConverged { .. })
            }
            _ => false,
        }
    }

    /// True where what the user wrote is wrong.
    pub fn is_scene(&self) -> bool {
        matches!(
            self,
            RunError::NoSuchStage { .. }
                | RunError::NotInIteration { .. }
                | RunError::WithoutTheOneBefore { .. }
                | RunError::OfAnotherScene { .. }
                | RunError::Cycle(_)
                | RunError::Surface(_)
                | RunError::Vibration(DynamicsError::CutOff { .. })
                | RunError::Dynamics {
                    source: DynamicsError::Undamped { .. } | DynamicsError::Unsupported { .. },
                    ..
                }
        )
    }
}
