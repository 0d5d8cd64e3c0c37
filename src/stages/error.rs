//! Errors that end a run.

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

/// Error that ends a run. Committed iterations remain.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A cycle cannot follow the computed motion.
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
        /// The cause.
        source: ContactError,
    },
    /// A fretting cycle or wear step failed.
    #[error("{stage} of iteration {wear_iteration}: {source}")]
    Wear {
        /// The stage.
        stage: super::stage::Stage,
        /// The iteration.
        wear_iteration: u64,
        /// The cause.
        source: WearError,
    },
    /// `--until` names a stage that the scene does not have.
    #[error(
        "this scene has no stage {stage}; its stages are {}",
        stages.iter().map(|s| s.name()).collect::<Vec<_>>().join(", ")
    )]
    NoSuchStage {
        /// The requested stage.
        stage: super::stage::Stage,
        /// The stages of the scene.
        stages: Vec<super::stage::Stage>,
    },
    /// The observer ended the run before a stage, which is not a failure.
    #[error("the run was ended before {0}")]
    EndedBefore(super::stage::Stage),
    /// A table that a stage reads is missing.
    #[error(
        "the table {table} of {stage} is missing: restart the run to compute it, or begin from an earlier iteration"
    )]
    NotComputed {
        /// The stage.
        stage: super::stage::Stage,
        /// The table.
        table: crate::tables::TableName,
    },
    /// The iteration does not have the requested stage.
    #[error(
        "iteration {wear_iteration} has no stage {stage}; it has {}",
        stages.iter().map(|s| s.name()).collect::<Vec<_>>().join(", ")
    )]
    NotInIteration {
        /// The requested stage.
        stage: super::stage::Stage,
        /// The iteration.
        wear_iteration: u64,
        /// The stages of the iteration.
        stages: Vec<super::stage::Stage>,
    },
    /// A stage cannot be computed again, because the previous iteration is pruned or damaged.
    #[error(
        "iteration {wear_iteration} is computed from iteration {}, which is pruned or damaged; choose an iteration that follows a stored one",
        wear_iteration - 1
    )]
    WithoutTheOneBefore {
        /// The requested iteration.
        wear_iteration: u64,
    },
    /// An earlier run computed the iteration from another scene, and a sibling run inherited the iteration.
    #[error(
        "iteration {wear_iteration} was computed in the run {run}, of another scene: use that run"
    )]
    OfAnotherScene {
        /// The requested iteration.
        wear_iteration: u64,
        /// Name of the run that computed the iteration.
        run: String,
    },
    /// The structure cannot be meshed or reduced.
    #[error("structure: {0}")]
    Structure(#[from] StructureError),
    /// The matrices of a structure cannot be imported.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// The contact elements cannot be computed.
    #[error("model_update: {0}")]
    ModelUpdate(#[from] ModelUpdateError),
    /// The contact of the unworn or of the smooth joint failed.
    #[error("contact of the unworn joint: {0}")]
    Unworn(#[from] ContactError),
    /// The stage cannot build the vibration model or the time samples of the vibration model.
    #[error("dynamic_response: {0}")]
    Vibration(#[from] DynamicsError),
    /// No steady vibration was found.
    #[error("dynamic_response of iteration {wear_iteration}: {source}")]
    Dynamics {
        /// The iteration.
        wear_iteration: u64,
        /// The cause.
        source: DynamicsError,
    },
    /// The run cannot be compared with a run on half the grid.
    #[error("`fidelity.grid_check`: {reason}; leave it out")]
    GridCheck {
        /// The reason.
        reason: &'static str,
    },
    /// The stage needs a run on half the grid, but the run does not exist.
    #[error(
        "`fidelity.grid_check`: this stage cannot be computed alone, because it needs a run on half the grid; use `fretwear run`, which starts that run first"
    )]
    NoGridTwin,
    /// The requested worn volume cannot be reached.
    #[error(
        "`wear.volume` = {volume:.6e} m³ is never reached: the joint stopped wearing at {reached:.6e} m³; give `wear.cycles` too, or a larger motion"
    )]
    WearsNoMore {
        /// The requested volume \[m³\].
        volume: f64,
        /// The volume that the run reached \[m³\].
        reached: f64,
    },
    /// The run store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A table is invalid.
    #[error(transparent)]
    Table(#[from] TableError),
}

/// Error in the numerics of a stage.
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
    /// Returns true if a solver did not converge. The last commit remains, and another tolerance or step may help.
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

    /// Returns true if the input of the user is wrong.
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
