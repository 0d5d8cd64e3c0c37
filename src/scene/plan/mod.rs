//! What a scene needs: the one place that decides what will exist.
//!
//! A [`Plan`] has the recipe of a run and what it is expected to cost, in cells, transform pairs and bytes, never in seconds, so
//! that equal scenes give equal plans on every machine.

mod bearing;
mod before;
mod cost;
mod course;
mod disk;
mod files;
mod memory;
mod rough;
mod seconds;
mod solves;
mod stability;
mod vibration;
mod vibration_cost;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::Scene;
use super::canonical::FOLLOWING_KEYS;
use crate::recipe::{CycleError, Decision, Identity, Inputs, Joint, Recipe, told};
use crate::wear::Motion;
use before::Texture;
use files::Files;
use rough::{Contents, motion_of};

pub use files::{HistoryProblem, InputError};
pub use seconds::{Rates, Seconds};

/// A scene that is well written and cannot be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// A motion that the cycle cannot march.
    #[error(transparent)]
    Cycle(#[from] CycleError),
    /// Normal and tangential contact are coupled, and the bodies move.
    #[error(
        "`material.lower` and `material.upper` differ so that pressure causes slip (Dundurs' beta = {beta:.4}); of such bodies this version computes the static contact only: leave [motion], [dynamics] and [wear] out, or make beta zero with the same constants for both or with both poisson_ratio = 0.5"
    )]
    Dissimilar {
        /// Dundurs' β.
        beta: f64,
    },
    /// A static contact of coupled bodies with friction, under what it is not pressed by in steps.
    #[error(
        "`{key}` is {value}, and the bodies differ elastically (Dundurs' beta = {beta:.4}): with friction they are pressed together by a rising load without moments; give {instead}, or leave contact.friction_coefficient out"
    )]
    IndentedWithout {
        /// The key.
        key: &'static str,
        /// Its value.
        value: &'static str,
        /// What would be right.
        instead: &'static str,
        /// Dundurs' β.
        beta: f64,
    },
    /// A value that this version does not compute.
    #[error("`{key}` is {value}, which this version does not compute; use {instead}")]
    NotAvailable {
        /// The key.
        key: &'static str,
        /// Its value.
        value: &'static str,
        /// What would be right.
        instead: &'static str,
    },
    /// `superposition` of a rotation, or of forces and displacements together.
    #[error(
        "`fidelity.cycle` is \"superposition\", which needs displacements along all axes that move, or forces along all of them, and no rotation about z; use \"reversal\""
    )]
    NotSuperposed,
    /// The cap is too low for the load.
    #[error(
        "`contact.pressure_cap` = {cap:.6e} Pa on the joint's {area:.6e} m² carries {capacity:.6e} N; `contact.normal_load` is {load:.6e} N: lower the load or raise the cap"
    )]
    CapTooLow {
        /// The cap \[Pa\].
        cap: f64,
        /// Nominal area of the joint \[m²\].
        area: f64,
        /// Their product \[N\].
        capacity: f64,
        /// The largest load of the cycle \[N\].
        load: f64,
    },
    /// Forces that friction cannot hold.
    #[error(
        "`motion.force` reaches {force:.6e} N under a normal load of {load:.6e} N, where friction carries less than {limit:.6e} N: the joint would slide away; make the force smaller, or give `motion.amplitude`"
    )]
    BeyondFriction {
        /// The tangential force \[N\].
        force: f64,
        /// The normal load at that instant \[N\].
        load: f64,
        /// Friction coefficient times it \[N\].
        limit: f64,
    },
    /// No cell is left.
    #[error(
        "the joint has no cell: `joint.hole.diameter` takes all of {cells} cells; make it smaller"
    )]
    NoCells {
        /// Cells of the grid.
        cells: usize,
    },
}

/// What the decided things are expected to cost. Estimates are rounded to three digits, more than there are right.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Contact elements of the structure.
    pub contact_elements: usize,
    /// Unknowns of the harmonic balance if every contact element were active.
    pub unknowns: usize,
    /// Cells of the joint; 0 without a rough surface.
    pub cells: usize,
    /// Points of the plane that fields are transformed on.
    pub plane: [usize; 2],
    /// Peak of memory of the whole program \[B\]: what is allocated at its fullest moment.
    pub memory: u64,
    /// The same of a run that finds its structure reduced already \[B\]; none where nothing is to be reduced.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory_cached: Option<u64>,
    /// Disk of all iterations that are kept \[B\].
    pub disk: u64,
    /// Disk of one iteration, in the mean \[B\].
    pub disk_per_iteration: u64,
    /// Wear iterations; 0 without wear.
    pub iterations: f64,
    /// Between which they should lie.
    pub iterations_range: [f64; 2],
    /// Transform pairs of the whole run.
    pub fft_pairs: f64,
    /// Between which they should lie.
    pub fft_pairs_range: [f64; 2],
    /// The pairs by stage, and by part of a stage that is told apart, as the `timing` table names them.
    pub fft_pairs_by_stage: BTreeMap<String, f64>,
    /// Transform pairs of one iteration, in the mean.
    pub pairs_per_iteration: f64,
    /// Times that the model is updated.
    pub updates: f64,
    /// Operations on dense matrices to reduce the structure; none where nothing is to be reduced.
    pub structure_operations: f64,
    /// Operations on dense matrices of all vibrations.
    pub response_operations: f64,
}

/// What a scene needs: the recipe of its run with what its files say, and what it is expected to cost.
#[derive(Debug, Clone)]
pub struct Plan {
    /// All that a run is computed from.
    pub inputs: Inputs,
    /// What was decided from the scene alone, and what will be decided by a stated rule.
    pub decisions: Vec<Decision>,
    /// What the user should change or know before it runs.
    pub warnings: Vec<String>,
    /// What it is expected to cost.
    pub cost: Cost,
}

impl Plan {
    /// Reads the files of a scene, each once, and decides what it needs.
    ///
    /// # Errors
    /// [`InputError`] for a file that cannot be used, and for a scene that is well written and cannot be run.
    pub fn of(scene: &Scene) -> Result<Plan, InputError> {
        let files = Files::read(scene)?;
        let recipe = decide(scene, &files.motion, &files.contents)?;
        let texture = files
            .measured
            .as_deref()
            .map(|on_joint| Texture::of(&on_joint.patch, &on_joint.heights));
        let (cost, wearing) = cost::cost(scene, &files.motion, texture, &recipe);
        let stability = wearing.and_then(|wearing| stability::decide(&wearing));
        let mut decisions = told(&recipe);
        let mut warnings = Vec::new();
        if let Some((decision, warning)) = stability {
            let after = decisions.iter().position(|d| d.what == "wear");
            decisions.insert(after.map_or(decisions.len(), |wear| wear + 1), decision);
            warnings.extend(warning);
        }
        Ok(Plan {
            inputs: Inputs {
                identity: Identity {
                    scene: files.canonical,
                    following: FOLLOWING_KEYS,
                    scene_toml: scene.to_toml(),
                    plan: json!({ "recipe": recipe, "warnings": warnings, "cost": cost }),
                },
                motion: files.motion,
                measured: files.measured,
                recipe,
            },
            decisions,
            warnings,
            cost,
        })
    }
}

/// What a scene needs, as far as that does not depend on the files that it names.
///
/// # Errors
/// As for [`Plan::of`], but for the files.
pub(super) fn decide_without_files(scene: &Scene) -> Result<Recipe, PlanError> {
    let motion = scene.contact.as_ref();
    let motion = motion.map_or_else(|| Motion::none(0.0), |contact| motion_of(scene, contact));
    decide(scene, &motion, &Contents::default())
}

/// Decides what a scene needs. `motion` is that of its `[motion]`.
///
/// # Errors
/// [`PlanError`] for a scene that is well written and cannot be run.
fn decide(scene: &Scene, motion: &Motion, contents: &Contents) -> Result<Recipe, PlanError> {
    let (mut surface, mut contact, mut cycle) = (None, None, None);
    if let Some(rough) = scene.rough() {
        let decided = rough::decide(scene, &rough, motion, contents)?;
        (surface, contact, cycle) = (Some(decided.0), Some(decided.1), decided.2);
    }
    let elements = vibration::elements(scene);
    let joint = Joint {
        surface,
        contact,
        cycle,
        elements,
    };
    let has_joint = joint.surface.is_some() || joint.elements.is_some();
    let (structure, response) = vibration::decide(scene).unzip();
    Ok(Recipe {
        title: scene.title.clone(),
        structure,
        joints: has_joint.then_some(joint).into_iter().collect(),
        response,
        wear: scene.wear.clone(),
        output: scene.output.clone(),
        asked_error: scene.fidelity.tolerance,
    })
}
