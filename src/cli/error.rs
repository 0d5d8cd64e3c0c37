//! Errors of the commands, and the exit code of each error.

use std::path::PathBuf;

use fretwear::report::trade::TradeError;
use fretwear::scene::{InputError, SceneError};
use fretwear::stages::RunError;
use fretwear::store::StoreError;
use fretwear::structure::StructureError;

use super::Exit;

/// Error of a command.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Input(#[from] InputError),
    #[error(
        "{source}\n{} was changed after the run wrote it: remove it, and the run continues with the scene stored in run.json",
        path.display()
    )]
    EditedScene { path: PathBuf, source: SceneError },
    #[cfg(feature = "polars")]
    #[error("cannot start or wait for the process of a run: {0}; --jobs 1 needs no processes")]
    Processes(std::io::Error),
    #[error("{0}")]
    NoIteration(String),
    #[error("there is no run at {}; give the scene that starts it", path.display())]
    NothingToRun { path: PathBuf },
    #[error("only scenes have a JSON Schema: run `fretwear schema scene --json-schema`")]
    NoJsonSchema,
    #[error("{0}; no table has that name either: `fretwear schema` lists the tables")]
    UnknownWord(fretwear::scene::explain::UnknownKey),
    #[error("{like} is not a shipped scene; choose one of {known}")]
    UnknownExample { like: String, known: String },
    #[error(
        "the scene {like} needs its hole, because the bolt of its structure goes through the joint; give another diameter"
    )]
    HoleRequired { like: String },
    #[error("cannot write {}: {source}", path.display())]
    NewScene {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{} exists already and is not replaced: give another name, or remove it", path.display())]
    SceneExists { path: PathBuf },
    #[error("{key} has no line of its own in the scene {like}; change it in the written file")]
    NoLine { key: String, like: String },
    #[error("there is no run at {}, and no folder of runs: `fretwear run SCENE` writes its run to runs/NAME", path.display())]
    NoFolder { path: PathBuf },
    #[error("cannot list {}: {source}", path.display())]
    Folder {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("cannot watch for signals: {0}")]
    Signals(std::io::Error),
    #[error("asked to stop")]
    AskedToStop,
    #[error("{} has no [structure] of kind \"resonator\" to export", path.display())]
    NothingToExport { path: PathBuf },
    #[error(
        "a run computes the stiffness of this joint from its surface; give --kt and --kn (from a run's summary), or --tied"
    )]
    UnknownStiffness,
    #[error("{} is a file; give a folder, which is created if it is missing", path.display())]
    NotAFolder { path: PathBuf },
    #[error("cannot write {}: {source}", path.display())]
    Export {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("the run {} has no finite-element structure, so there is no reduced model to write", path.display())]
    NothingReduced { path: PathBuf },
    #[error(
        "cannot compute the residual flexibility of the reduced structure: {0}; two points of force and response may coincide"
    )]
    Residual(#[from] fretwear::linalg::LinalgError),
    #[error("the run {} has no vibrating contact elements to write", path.display())]
    NoElements { path: PathBuf },
    #[error("the run {} has neither a surface nor contact elements nor the edges of a structure to draw", path.display())]
    NothingToDraw { path: PathBuf },
    #[error(transparent)]
    Structure(#[from] StructureError),
    #[error(transparent)]
    Matrices(#[from] fretwear::structure::readers::ReadError),
    #[error(transparent)]
    Map(#[from] fretwear::surface::readers::ReadError),
    #[error("--fixed: {0}")]
    Fixed(#[from] fretwear::structure::inspection::FixedError),
    #[error("the run {} has no [wear]: nothing in it changes with cycles", path.display())]
    NothingWears { path: PathBuf },
    #[error("the run {} has no history of the {figure}: {reason}", path.display())]
    NoMilestone {
        path: PathBuf,
        figure: &'static str,
        reason: &'static str,
    },
    #[error(transparent)]
    Milestone(fretwear::milestones::MilestoneError),
    #[error("there is no scene (*.toml) in {}", path.display())]
    NoScenes { path: PathBuf },
    #[error(
        "{} and {} have the same name {name} and would share a folder of runs; rename one of them",
        paths[0].display(), paths[1].display()
    )]
    SameName { name: String, paths: [PathBuf; 2] },
    #[error(
        "{option} needs a single scene, but {scenes} are given: several scenes are run only with the presets fast, balanced and reference"
    )]
    SingleSceneOption { option: &'static str, scenes: usize },
    #[error("{}: {source}", path.display())]
    Scenes {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{} lies within the run {}; give a folder outside of it", path.display(), run.display())]
    WithinARun { path: PathBuf, run: PathBuf },
    #[error(
        "{stage} of iteration {wear_iteration} is not the same: {tables}; the run was computed by another version, on another processor, or with another end or other requested responses"
    )]
    StageDiffers {
        stage: fretwear::stages::Stage,
        wear_iteration: u64,
        tables: String,
    },
    #[error(
        "{} has no harmonic force in [dynamics]: without a vibration there is no backbone to follow",
        path.display()
    )]
    NothingVibrates { path: PathBuf },
    #[error(
        "{} gives dynamics.at without dynamics.frequency: also give dynamics.frequency, the range in which the backbone searches for resonances",
        path.display()
    )]
    NoRange { path: PathBuf },
    #[error(
        "the backbone cannot go from {from} N to {to} N; --from must be less than --to (defaults: a thousandth of the scene's force, and twice the scene's force)"
    )]
    Levels { from: f64, to: f64 },
    #[error("{end}: {reason}; with --over KEY it is a value of that key")]
    Level { end: &'static str, reason: String },
    #[error(
        "{key} cannot go from {from} to {to}: --from and --to must be two different values with the dimension of the key"
    )]
    OverLevels {
        key: String,
        from: String,
        to: String,
    },
    #[error(
        "--over {key} and --set {set} change the same key: leave --set out, because --from and --to give its values"
    )]
    OverAndSet { key: String, set: String },
    #[error("--over {key}, at {value}: {source}")]
    OverAt {
        key: String,
        value: String,
        source: Box<CliError>,
    },
    #[error(
        "{} would be overwritten: it is a scene or another output of this command; give another file",
        path.display()
    )]
    OutputIsTaken { path: PathBuf },
    #[error(
        "--over {key} changes a key of scenes, but {run} is a run, whose keys are fixed: give its scene, or leave --over out to follow the force"
    )]
    OverOfARun { key: String, run: String },
    #[error(
        "--set changes the keys of scenes, but the keys of a run are fixed: give a scene too, or start a run with `fretwear run --from RUN@K --set …`"
    )]
    SetOfARun,
    #[error(transparent)]
    Campaign(#[from] fretwear::campaign::CampaignError),
    #[cfg(not(feature = "polars"))]
    #[error(
        "this program was built without Polars and lacks `compare`, `report`, `reproduce`, `campaign report` and `backbone --svg`; build it with `cargo build --release`"
    )]
    NoPolars,
    #[error("row {index} ({settings}){}: {source}", more_rows(*others))]
    Row {
        index: usize,
        settings: String,
        /// Number of other rows with an error.
        others: usize,
        source: Box<CliError>,
    },
    #[error("{reason}")]
    RowChanged { reason: String },
    #[error("row {index} failed before: {reason}; --retry tries it again")]
    RowFailed {
        index: usize,
        reason: String,
        code: u8,
    },
    #[error("row {index} failed: {reason}")]
    RowFailedNow { index: usize, reason: String },
    #[error(
        "--scratch needs a campaign with keep = \"history\": whole runs are computed in the folder of their campaign"
    )]
    ScratchOfRuns,
    #[error("cannot start a process for row {index}: {source}")]
    Spawn {
        index: usize,
        source: std::io::Error,
    },
    #[error(transparent)]
    Knob(#[from] fretwear::scene::variants::UnknownKnob),
    #[error(transparent)]
    Trade(#[from] TradeError),
    #[cfg(feature = "polars")]
    #[error(transparent)]
    Report(#[from] fretwear::report::ReportError),
}

fn more_rows(count: usize) -> String {
    match count {
        0 => String::new(),
        count => format!(", and {count} other rows"),
    }
}

impl From<StoreError> for CliError {
    fn from(error: StoreError) -> Self {
        CliError::Run(error.into())
    }
}

impl CliError {
    /// Returns the exit code of the error.
    pub fn exit(&self) -> Exit {
        match self {
            CliError::Run(error) if error.is_scene() => Exit::Scene,
            CliError::AskedToStop => Exit::Stopped,
            CliError::StageDiffers { .. } | CliError::RowChanged { .. } => Exit::Damaged,
            CliError::Row { source, .. } | CliError::OverAt { source, .. } => source.exit(),
            CliError::RowFailed { code, .. } => Exit::of_failure(*code),
            CliError::Campaign(error) if error.is_usage() => Exit::Scene,
            CliError::Campaign(error) if error.is_damage_or_mismatch() => Exit::Damaged,
            #[cfg(not(feature = "polars"))]
            CliError::NoPolars => Exit::Scene,
            CliError::Scene(_) | CliError::Input(_) => Exit::Scene,
            CliError::Run(error) if error.is_not_converged() => Exit::NotConverged,
            CliError::Run(RunError::Store(error)) if error.is_damage_or_mismatch() => Exit::Damaged,
            CliError::Run(RunError::Store(
                StoreError::NoRun { .. }
                | StoreError::FileInsteadOfFolder { .. }
                | StoreError::NoIteration { .. },
            ))
            | CliError::EditedScene { .. }
            | CliError::NothingToRun { .. }
            | CliError::NoIteration(_)
            | CliError::NoFolder { .. }
            | CliError::UnknownExample { .. }
            | CliError::NoLine { .. }
            | CliError::HoleRequired { .. }
            | CliError::NoJsonSchema
            | CliError::UnknownWord(_)
            | CliError::NothingToExport { .. }
            | CliError::NotAFolder { .. }
            | CliError::NothingReduced { .. }
            | CliError::NoElements { .. }
            | CliError::NothingToDraw { .. }
            | CliError::NothingVibrates { .. }
            | CliError::NoRange { .. }
            | CliError::NothingWears { .. }
            | CliError::NoMilestone { .. }
            | CliError::Milestone(_)
            | CliError::Levels { .. }
            | CliError::Level { .. }
            | CliError::OverLevels { .. }
            | CliError::OverOfARun { .. }
            | CliError::OverAndSet { .. }
            | CliError::OutputIsTaken { .. }
            | CliError::SetOfARun
            | CliError::NoScenes { .. }
            | CliError::SameName { .. }
            | CliError::SingleSceneOption { .. }
            | CliError::ScratchOfRuns
            | CliError::Knob(_)
            | CliError::Matrices(_)
            | CliError::Fixed(_)
            | CliError::Map(_)
            | CliError::UnknownStiffness
            | CliError::Structure(
                StructureError::OutOfRange { .. } | StructureError::Contradiction { .. },
            ) => Exit::Scene,
            CliError::Structure(StructureError::NotConverged { .. }) => Exit::NotConverged,
            CliError::Trade(TradeError::Store(error)) if error.is_damage_or_mismatch() => {
                Exit::Damaged
            }
            #[cfg(feature = "polars")]
            CliError::Report(error) if error.is_no_run() => Exit::Scene,
            #[cfg(feature = "polars")]
            CliError::Report(error) if error.is_damage_or_mismatch() => Exit::Damaged,
            _ => Exit::Failure,
        }
    }
}
