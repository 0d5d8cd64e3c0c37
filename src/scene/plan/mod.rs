//! Planning of a scene: decides what a run computes.
//!
//! A [`Plan`] contains the recipe of a run. Planning runs no solver, so planning takes almost no time. Equal scenes
//! give equal plans on every machine. [`crate::rehearsal`] estimates the cost of a run on request.

pub mod element_table;
mod files;
mod numbers;
mod plausible;
mod rough;
mod stability;
mod structure_files;
mod vibration;

use serde_json::json;

use super::Scene;
use crate::model_update::ModelUpdateError;
use crate::recipe::{Check, CycleError, Decision, Inputs, Joint, StoredPlan};
use crate::surface::SurfaceError;
use files::Files;
use rough::Contents;

pub use files::{HistoryProblem, InputError};
pub use stability::unstable_explicit_step;
pub use structure_files::StructureFileError;

/// Error in a valid scene that cannot be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The program cannot march the cycle for the motion of the scene.
    #[error(transparent)]
    Cycle(#[from] CycleError),
    /// Normal and tangential contact are coupled, and the bodies move.
    #[error(
        "`material.lower` and `material.upper` differ so that pressure causes slip (Dundurs' beta = {beta:.4}); for such bodies this version computes only the static contact: remove [motion], [dynamics] and [wear], or make beta zero by equal constants for both bodies or by poisson_ratio = 0.5 for both"
    )]
    Dissimilar {
        /// Dundurs' β.
        beta: f64,
    },
    /// Static contact of coupled bodies with friction, with a key that load steps do not support.
    #[error(
        "`{key}` is {value}, and the bodies differ elastically (Dundurs' beta = {beta:.4}): with friction, such bodies can only be pressed together by a rising load without moments; give {instead}, or remove contact.friction_coefficient"
    )]
    IndentedWithout {
        /// The key.
        key: &'static str,
        /// Its value.
        value: &'static str,
        /// The alternative.
        instead: &'static str,
        /// Dundurs' β.
        beta: f64,
    },
    /// The structure cannot press the two faces of the joint together.
    #[error(
        "`contact.pressing` cannot be \"structure\": {reason}; use \"punch\", or remove the key"
    )]
    StructureCannotPress {
        /// The reason.
        reason: &'static str,
    },
    /// A preload at points of a structure that does not press its joint.
    #[error(
        "`contact.preload` needs a structure that presses the joint, and this structure does not: {reason}; give contact.normal_load instead"
    )]
    PreloadOfPunch {
        /// The reason.
        reason: &'static str,
    },
    /// A key whose value follows from the structure.
    #[error(
        "`{key}` is given, but the structure determines how its bodies press each other; remove the key, or set contact.pressing = \"punch\""
    )]
    DeterminedByStructure {
        /// The key.
        key: &'static str,
    },
    /// A bolt outside the structure without known position.
    #[error(
        "`contact.bolt_stiffness` and `contact.bolt` describe a bolt outside the structure, but its position is not given or the bolt is in the mesh; give contact.preload with head and nut, remove the key, or set contact.pressing = \"punch\""
    )]
    BoltOfStructure,
    /// The program cannot compute the bolt of `contact.bolt`, for the stated reason.
    #[error("`contact.bolt`: {reason}")]
    Bolt {
        /// The reason.
        reason: String,
    },
    /// The run ends at a preload, but the load is constant.
    #[error(
        "`wear.until.preload` ends a run when its bolt load falls, but this load is constant; give contact.bolt_stiffness, contact.bolt or contact.preload.in_mesh, or remove the key"
    )]
    LoadStays,
    /// A value of a key that the program does not support.
    #[error("`{key}` is {value}, which this version does not compute; use {instead}")]
    NotAvailable {
        /// The key.
        key: &'static str,
        /// Its value.
        value: &'static str,
        /// The alternative.
        instead: &'static str,
    },
    /// Output of cells outside the grid.
    #[error(
        "`output.cycle_fields.{key}` = {range:?}, but the cells of the grid have {key} from 0 to {last}: give two numbers in this range"
    )]
    NoSuchCells {
        /// `i` or `j`.
        key: &'static str,
        /// The requested first and last cell.
        range: [u64; 2],
        /// The last existing cell.
        last: usize,
    },
    /// Output of samples outside the cycle.
    #[error(
        "`output.cycle_fields.samples` has {sample}, but the cycle has the samples 0 to {last}: {instead}"
    )]
    NoSuchSample {
        /// The sample.
        sample: u64,
        /// The last existing sample.
        last: usize,
        /// The alternative.
        instead: &'static str,
    },
    /// Output of selected samples, although the samples of the cycle depend on the vibration.
    #[error(
        "`output.cycle_fields.samples` is given, but the samples of the cycle are decided only after dynamic_response; set fidelity.cycle = \"stepped\" or \"reversal\" too, or remove the key to write all samples"
    )]
    SamplesNotKnown,
    /// `superposition` of a rotation, or of forces together with displacements.
    #[error(
        "`fidelity.cycle` is \"superposition\", which needs a displacement on each moving axis or a force on each, and no rotation about z; use \"reversal\""
    )]
    NotSuperposed,
    /// `superposition` although the contact elements move their cells differently.
    #[error(
        "`fidelity.cycle` is \"superposition\", which moves all cells equally, but with `contact.stiffness` = \"sliders\" each contact element moves its own cells; use \"reversal\""
    )]
    SuperposedElements,
    /// The pressure cap times the area of the joint is less than the normal load.
    #[error(
        "`contact.pressure_cap` = {cap:.6e} Pa on the joint's {area:.6e} m² carries {capacity:.6e} N; `contact.normal_load` is {load:.6e} N: lower the load or raise the cap"
    )]
    CapTooLow {
        /// The cap \[Pa\].
        cap: f64,
        /// Nominal area of the joint \[m²\].
        area: f64,
        /// Largest load that the cap allows \[N\].
        capacity: f64,
        /// The largest load of the cycle \[N\].
        load: f64,
    },
    /// No wave of the surface fits the joint and its grid.
    #[error("`{key}` = {} m: {source}", .lengths.iter().map(|length| format!("{length:e}")).collect::<Vec<String>>().join(" and "))]
    Surface {
        /// The key of the lengths.
        key: &'static str,
        /// Lengths of the longest waves along x and y \[m\].
        lengths: Vec<f64>,
        /// The error.
        source: SurfaceError,
    },
    /// The load is more than any solid bears.
    #[error(
        "`contact.normal_load` = {load:.6e} N is a mean pressure of {pressure:.6e} Pa on the joint's {area:.6e} m², more than a thousand times the contact modulus {modulus:.6e} Pa: no solid bears that; lower the load, or check the units: N or kN, `joint.size` in mm or m, `material.youngs_modulus` in GPa or MPa"
    )]
    Overloaded {
        /// The largest load of the cycle \[N\].
        load: f64,
        /// Mean pressure \[Pa\].
        pressure: f64,
        /// Nominal area of the joint \[m²\].
        area: f64,
        /// Contact modulus of the two bodies \[Pa\].
        modulus: f64,
    },
    /// The tangential force exceeds the friction limit.
    #[error(
        "`motion.force` reaches {force:.6e} N under a normal load of {load:.6e} N, where friction carries less than {limit:.6e} N: the joint would slide away; make the force smaller, or give `motion.amplitude`"
    )]
    BeyondFriction {
        /// The tangential force \[N\].
        force: f64,
        /// The normal load at that instant \[N\].
        load: f64,
        /// Friction limit \[N\]: friction coefficient times normal load.
        limit: f64,
    },
    /// The moment about z exceeds the friction limit.
    #[error(
        "`motion.moment` reaches {moment:.6e} N m under a normal load of {load:.6e} N, where friction carries less than {limit:.6e} N m, even with all of the load on the outermost cell, {reach:.4} mm from the joint's centre: the joint would turn away; make the moment smaller, check whether its unit is N m or N mm, or give `motion.rotation`"
    )]
    BeyondFrictionMoment {
        /// The moment \[N m\].
        moment: f64,
        /// The normal load at that instant \[N\].
        load: f64,
        /// Distance of the outermost cell \[mm\].
        reach: f64,
        /// Friction limit \[N m\]: product of friction coefficient, normal load and `reach`.
        limit: f64,
    },
    /// No pressure can balance the moments.
    #[error(
        "`contact.moment` = {moment:?} N m moves the resultant of {load:.6e} N to {arm:.4?} mm from the joint's centre, but the joint only extends to {reach:.4?} mm: make the moment smaller or the load larger, or check whether its unit is N m or N mm"
    )]
    MomentNotCarried {
        /// Moments about x and y \[N m\].
        moment: [f64; 2],
        /// The least load of the cycle \[N\].
        load: f64,
        /// Position of the resultant of the load, x and y \[mm\].
        arm: [f64; 2],
        /// Position of the outermost cells, x and y \[mm\].
        reach: [f64; 2],
    },
    /// The grid and the contact elements do not match.
    #[error("joint.grid: {0}")]
    Elements(ModelUpdateError),
    /// The compliance of the mesh at the joint is unknown.
    #[error(
        "contact.stiffness = \"sliders\" (the default) subtracts the compliance of the finite elements at the joint, but no positions of nodes give their thickness; give structure.layer, or contact.stiffness = \"total\""
    )]
    NoLayer,
    /// The joint has no cell.
    #[error(
        "the joint has no cell: `joint.hole.diameter` removes all {cells} cells; make it smaller"
    )]
    NoCells {
        /// Cells of the grid.
        cells: usize,
    },
}

/// Plan of a run. The plan contains the inputs of the run and the reasons for the decisions. The inputs include the
/// contents of all input files.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The inputs of a run.
    pub inputs: Inputs,
    /// The decisions made from the scene alone, and the decisions that stages will make by a stated rule.
    pub decisions: Vec<Decision>,
    /// Figures for an engineer to check, by rules of thumb.
    pub checks: Vec<Check>,
    /// Warnings for the user before the run.
    pub warnings: Vec<String>,
}

impl Plan {
    /// Returns notices about a measured surface and the matrices of a structure. The stages of the run report the same
    /// notices.
    pub fn notices(&self) -> impl Iterator<Item = String> + use<'_> {
        let measured = self.inputs.measured.iter();
        let measured = measured.flat_map(|surface| surface.notices.iter().map(ToString::to_string));
        let imported = self.inputs.imported.iter();
        let notes = imported.flat_map(|found| found.notes.clone());
        let pressing = self.inputs.recipe.pressing_notice().map(str::to_owned);
        measured.chain(notes).chain(pressing)
    }
}

impl Plan {
    /// Reads each file of a scene once, and decides the computations of the run.
    ///
    /// # Errors
    /// [`InputError`] if an input file is invalid, or if a valid scene cannot be run.
    pub fn of(scene: &Scene) -> Result<Plan, InputError> {
        let given_load = scene.rough().map(|rough| rough.conditions.normal_load);
        let Files {
            scene,
            contents,
            mut inputs,
        } = Files::read(scene)?;
        decide(&scene, &contents, &mut inputs)?;
        let recipe = &inputs.recipe;
        let warnings = stability::warning(recipe);
        let decisions = crate::recipe::decisions(recipe);
        let checks = plausible::checks(&inputs, given_load);
        let implausible = checks.iter().filter_map(|check| check.warning.clone());
        let doubts = inputs.imported.iter();
        let doubts = doubts.flat_map(|found| {
            found
                .doubts
                .iter()
                .map(|doubt| format!("structure: {doubt}"))
        });
        let warnings: Vec<String> = warnings
            .into_iter()
            .chain(implausible)
            .chain(doubts)
            .collect();
        inputs.identity.plan = json!(StoredPlan {
            recipe: recipe.clone(),
            warnings: warnings.clone(),
        });
        Ok(Plan {
            inputs,
            decisions,
            checks,
            warnings,
        })
    }
}

/// Decides what a run of the scene computes, and completes the recipe of its inputs.
///
/// # Errors
/// [`PlanError`] for a valid scene that cannot be run.
fn decide(scene: &Scene, contents: &Contents, inputs: &mut Inputs) -> Result<(), PlanError> {
    let Inputs { motion, recipe, .. } = inputs;
    let (mut surface, mut contact, mut cycle) = (None, None, None);
    if let Some(rough) = scene.rough() {
        let decided = rough::decide(scene, &rough, motion, contents)?;
        let is_pressed = decided.1.pressing.is_some();
        (surface, contact, cycle) = (Some(decided.0), Some(decided.1), decided.2);
        // The forces that press the joint are constant in the vibration.
        if let Some(response) = recipe.response.as_mut().filter(|_| is_pressed) {
            response.forces.retain(|force| force.harmonic > 0);
        }
    }
    let elements = vibration::elements(scene);
    let joint = Joint {
        surface,
        contact,
        cycle,
        elements,
    };
    let has_joint = joint.surface.is_some() || joint.elements.is_some();
    recipe.joints = has_joint.then_some(joint).into_iter().collect();
    let ends_by_load = recipe
        .wear
        .as_ref()
        .is_some_and(|wear| wear.until_preload.is_some());
    if ends_by_load
        && !recipe
            .contact()
            .is_some_and(|contact| contact.bolt_loses_load())
    {
        return Err(PlanError::LoadStays);
    }
    vibration::explain(scene, recipe);
    recipe.why = numbers::reasons(scene, recipe);
    Ok(())
}
