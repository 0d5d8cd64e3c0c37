//! Why a run ended without its result.

use std::path::PathBuf;

use crate::contact::ContactError;
use crate::dynamics::DynamicsError;
use crate::model_update::ModelUpdateError;
use crate::scene::{PlanError, SceneError};
use crate::store::StoreError;
use crate::structure::StructureError;
use crate::surface::SurfaceError;
use crate::surface::prepare::PrepareError;
use crate::surface::readers::ReadError;
use crate::tables::TableError;
use crate::wear::WearError;

/// A run that could not go on. What is committed stays.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The scene is wrong.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The scene cannot be run.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The surface file cannot be read.
    #[error("surface.path: {0}")]
    Read(#[from] ReadError),
    /// The measured surface does not fit the joint.
    #[error("surface.path {}: {source}", path.display())]
    Prepare {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: PrepareError,
    },
    /// The surface cannot be generated.
    #[error("[surface]: {0}")]
    Surface(#[from] SurfaceError),
    /// The motion history is not one.
    #[error("motion.history {}: {problem}", path.display())]
    History {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: Box<HistoryProblem>,
    },
    /// A contact solve failed.
    #[error("{stage} of iteration {wear_iteration}: {source}")]
    Contact {
        /// The stage.
        stage: super::Stage,
        /// The iteration.
        wear_iteration: u64,
        /// What is wrong.
        source: ContactError,
    },
    /// A fretting cycle or wear step failed.
    #[error("{stage} of iteration {wear_iteration}: {source}")]
    Wear {
        /// The stage.
        stage: super::Stage,
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
        stage: super::Stage,
        /// Those there are.
        stages: Vec<super::Stage>,
    },
    /// The structure cannot be meshed or reduced.
    #[error("structure: {0}")]
    Structure(#[from] StructureError),
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

/// What can be wrong with a motion history.
#[derive(Debug, thiserror::Error)]
pub enum HistoryProblem {
    /// It cannot be read.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// It is no table of numbers.
    #[error("{0}")]
    Csv(#[from] csv::Error),
    /// It is no `cycle` table.
    #[error("{0}")]
    Table(#[from] TableError),
    /// A column is missing.
    #[error(
        "there is no column `{column}`; a history has time (parts of the period), displacement_x and, if they exist, displacement_y [m] and normal_load [N]"
    )]
    MissingColumn {
        /// The column.
        column: &'static str,
    },
    /// A value is no number.
    #[error("row {row}, column `{column}`: \"{value}\" is not a finite number")]
    NotANumber {
        /// The row, from 1.
        row: usize,
        /// The column.
        column: String,
        /// The text.
        value: String,
    },
    /// Too short.
    #[error("{rows} rows; a cycle needs at least 3 samples")]
    TooShort {
        /// Rows without the repeated first one.
        rows: usize,
    },
    /// Time does not run from 0 to 1.
    #[error("row {row}: time is {time}; time must increase from 0 to at most 1 (the period)")]
    Time {
        /// The row, from 1.
        row: usize,
        /// The time.
        time: f64,
    },
    /// The last sample, at time 1, is not the first again.
    #[error("the cycle does not close: {column} is {first:e} at time 0 and {last:e} at time 1")]
    NotClosed {
        /// The column.
        column: &'static str,
        /// Its value at 0.
        first: f64,
        /// Its value at 1.
        last: f64,
    },
    /// Motion along y in a scene without y.
    #[error("displacement_y is not zero, but `contact.transverse` is \"absent\"; use \"fixed\"")]
    TransverseAbsent,
    /// Displacement along y where the force along y is zero.
    #[error(
        "displacement_y is not zero, but `contact.transverse` is \"free\", which finds it from no force along y; use \"fixed\""
    )]
    TransverseFree,
}

impl RunError {
    /// True where a solver did not converge: the last commit is kept, and another tolerance or step may help.
    pub fn is_not_converged(&self) -> bool {
        let contact = |e: &ContactError| matches!(e, ContactError::NotConverged { .. });
        match self {
            RunError::Contact { source, .. } => contact(source),
            RunError::Wear { source, .. } => match source {
                WearError::Contact(source) => contact(source),
                WearError::NotSteady { .. } | WearError::StepTooSmall { .. } => true,
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

    /// True where what the user wrote is wrong: the scene, or a file that it names.
    pub fn is_scene(&self) -> bool {
        matches!(
            self,
            RunError::Scene(_)
                | RunError::NoSuchStage { .. }
                | RunError::Plan(_)
                | RunError::Read(_)
                | RunError::Prepare { .. }
                | RunError::Surface(_)
                | RunError::History { .. }
        )
    }
}
