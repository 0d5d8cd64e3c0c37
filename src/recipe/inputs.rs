//! A recipe with what its files say.

use std::sync::Arc;

use serde_json::Value;

use super::Recipe;
use crate::structure::imported::Imported;
use crate::surface::prepare::PreparedSurface;
use crate::wear::Motion;

/// A recipe with what its files say: all that a run is computed from.
#[derive(Debug, Clone)]
pub struct Inputs {
    /// The recipe.
    pub recipe: Recipe,
    /// The motion over a cycle that is prescribed; of no axis where none is.
    pub motion: Motion,
    /// The heights of a surface from a file on the joint's cells; none of another surface. The file is read once: these are the
    /// heights of the very bytes whose hash is in the recipe.
    pub measured: Option<Arc<PreparedSurface>>,
    /// The matrices of a structure that comes from files; none of another. They are those of the very bytes whose hash is in the recipe.
    pub imported: Option<Arc<Imported>>,
    /// What the same scene on half the grid has worn; none where that is not asked for, or not run yet.
    pub grid_twin: Option<Arc<GridTwin>>,
    /// What the run is known by.
    pub identity: Identity,
}

/// The wear of a scene on half the grid, iteration by iteration.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GridTwin {
    /// Cycles behind each.
    pub cycles: Vec<i64>,
    /// Volume worn away \[m³\].
    pub volume: Vec<f64>,
}

/// What a run is known by: the scene, as the store compares and keeps it.
#[derive(Debug, Clone, PartialEq)]
pub struct Identity {
    /// The scene as resolved, with the hashes of its files and without what does not influence a result.
    pub scene: Value,
    /// Keys of it whose values follow from others.
    pub following: [&'static str; 5],
    /// The text of `scene.toml`.
    pub scene_toml: String,
    /// The text of `scene.original.toml`: the scene as it was written; none where that is not known.
    pub scene_written: Option<String>,
    /// What `plan.json` says.
    pub plan: Value,
}
