//! A recipe with the contents of its input files.

use std::sync::Arc;

use serde_json::Value;

use super::Recipe;
use crate::structure::imported::ImportedStructure;
use crate::surface::prepare::PreparedSurface;
use crate::wear::Motion;

/// A recipe with the contents of its input files: everything from which a run is computed.
#[derive(Debug, Clone)]
pub struct Inputs {
    /// The recipe.
    pub recipe: Recipe,
    /// The prescribed motion over a cycle. The motion has no axis if the scene prescribes no motion.
    pub motion: Motion,
    /// Heights of a surface from a file, on the cells of the joint; `None` for other surfaces. The file is read once,
    /// so that the heights match the hash in the recipe.
    pub measured: Option<Arc<PreparedSurface>>,
    /// Matrices of a structure from files; `None` for other structures. The matrices match the hash in the recipe.
    pub imported: Option<Arc<ImportedStructure>>,
    /// Wear of the same scene on half the grid. `None` if the scene does not request the grid check, or before the run
    /// on half the grid is complete.
    pub grid_twin: Option<Arc<GridTwin>>,
    /// Identity of the run.
    pub identity: Identity,
}

/// Wear of a scene on half the grid, for each iteration.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GridTwin {
    /// Cycles up to each iteration.
    pub cycles: Vec<i64>,
    /// Worn volume \[m³\].
    pub volume: Vec<f64>,
}

/// Identity of a run: the scene, as the store compares and keeps it.
#[derive(Debug, Clone, PartialEq)]
pub struct Identity {
    /// The resolved scene, with the hashes of its files and without keys that do not influence a result.
    pub scene: Value,
    /// Keys of the scene whose values follow from other keys.
    pub following: [&'static str; 5],
    /// The text of `scene.toml`.
    pub scene_toml: String,
    /// Text of `scene.original.toml`: the scene as the user wrote it; `None` if it is not known.
    pub scene_written: Option<String>,
    /// Content of `plan.json`.
    pub plan: Value,
}
