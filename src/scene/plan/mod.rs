//! What a scene needs: the one place that decides what will exist.
//!
//! A [`Plan`] has the recipe of a run. It computes nothing, so that it costs a run no time, and equal scenes give equal plans on every
//! machine. What a run will cost is rehearsed where somebody asks for it ([`crate::rehearsal`]).

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
    /// A structure that cannot press its joint.
    #[error("`contact.pressing` is \"structure\", and {reason}; use \"punch\", or leave it out")]
    StructureCannotPress {
        /// Why not.
        reason: &'static str,
    },
    /// A preload at places of a structure that does not press.
    #[error(
        "`contact.preload` says where a structure is pressed, and it does not press: {reason}; give contact.normal_load in its place"
    )]
    PreloadOfPunch {
        /// Why not.
        reason: &'static str,
    },
    /// What the structure decides.
    #[error(
        "`{key}` is given, and the structure decides how its bodies lie against each other; leave it out, or give contact.pressing = \"punch\""
    )]
    HeldByStructure {
        /// The key.
        key: &'static str,
    },
    /// The bolt of a punch.
    #[error(
        "`contact.bolt_stiffness`, and `contact.bolt`, are those of a bolt outside of the structure, and where it acts is not known or the bolt is in the mesh; give contact.preload with head and nut, leave it out, or give contact.pressing = \"punch\""
    )]
    BoltOfStructure,
    /// A bolt by its dimensions that does not fit.
    #[error("`contact.bolt`: {reason}")]
    Bolt {
        /// Why.
        reason: String,
    },
    /// A milestone of a load that stays.
    #[error(
        "`wear.until.preload` ends a run whose load falls, and this one stays; give contact.bolt_stiffness, contact.bolt or contact.preload.in_mesh, or leave it out"
    )]
    LoadStays,
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
    /// Fields of cells beyond the grid.
    #[error(
        "`output.cycle_fields.{key}` = {range:?}, and the cells of the grid have {key} from 0 to {last}: give two numbers of these"
    )]
    NoSuchCells {
        /// `i` or `j`.
        key: &'static str,
        /// The first and the last cell asked for.
        range: [u64; 2],
        /// The last there is.
        last: usize,
    },
    /// Fields of samples beyond the cycle.
    #[error(
        "`output.cycle_fields.samples` has {sample}, and the cycle has the samples 0 to {last}: {instead}"
    )]
    NoSuchSample {
        /// The sample.
        sample: u64,
        /// The last there is.
        last: usize,
        /// What would be right.
        instead: &'static str,
    },
    /// Fields of chosen samples of a cycle whose samples depend on a vibration.
    #[error(
        "`output.cycle_fields.samples` is given, and which samples the cycle has is decided after dynamic_response; give fidelity.cycle = \"stepped\" or \"reversal\" too, or leave the samples out for all"
    )]
    SamplesNotKnown,
    /// `superposition` of a rotation, or of forces and displacements together.
    #[error(
        "`fidelity.cycle` is \"superposition\", which needs displacements along all axes that move, or forces along all of them, and no rotation about z; use \"reversal\""
    )]
    NotSuperposed,
    /// `superposition` of contact elements that move their own cells.
    #[error(
        "`fidelity.cycle` is \"superposition\", which moves all cells alike, and with `contact.stiffness` = \"sliders\" each contact element moves its own; use \"reversal\""
    )]
    SuperposedElements,
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
    /// No wave of the surface fits the joint and its grid.
    #[error("`{key}` = {} m: {source}", .lengths.iter().map(|length| format!("{length:e}")).collect::<Vec<String>>().join(" and "))]
    Surface {
        /// The key of the lengths.
        key: &'static str,
        /// The longest waves' lengths along x and y \[m\].
        lengths: Vec<f64>,
        /// What is wrong.
        source: SurfaceError,
    },
    /// More load than any solid bears.
    #[error(
        "`contact.normal_load` = {load:.6e} N is a mean pressure of {pressure:.6e} Pa on the joint's {area:.6e} m², more than a thousand times the contact modulus {modulus:.6e} Pa: no solid bears that; lower the load, or see whether its unit is N or kN, that of `joint.size` mm or m, and that of `material.youngs_modulus` GPa or MPa"
    )]
    Overloaded {
        /// The largest load of the cycle \[N\].
        load: f64,
        /// That over the area \[Pa\].
        pressure: f64,
        /// Nominal area of the joint \[m²\].
        area: f64,
        /// Contact modulus of the two bodies \[Pa\].
        modulus: f64,
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
    /// A moment about z that friction cannot hold.
    #[error(
        "`motion.moment` reaches {moment:.6e} N m under a normal load of {load:.6e} N, where friction carries less than {limit:.6e} N m, were all of the load on the outermost cell, {reach:.4} mm from the joint's centre: the joint would turn away; make the moment smaller, see whether its unit is N m or N mm, or give `motion.rotation`"
    )]
    TurnsAway {
        /// The moment \[N m\].
        moment: f64,
        /// The normal load at that instant \[N\].
        load: f64,
        /// The outermost cell's distance \[mm\].
        reach: f64,
        /// Friction coefficient times the load times that \[N m\].
        limit: f64,
    },
    /// Moments that no pressure has.
    #[error(
        "`contact.moment` = {moment:?} N m moves the resultant of {load:.6e} N to {arm:.4?} mm from the joint's centre, and the joint reaches {reach:.4?} mm: make the moment smaller or the load larger, or see whether its unit is N m or N mm"
    )]
    MomentNotCarried {
        /// About x and y \[N m\].
        moment: [f64; 2],
        /// The least load of the cycle \[N\].
        load: f64,
        /// Where its resultant would be, x and y \[mm\].
        arm: [f64; 2],
        /// The outermost cells, x and y \[mm\].
        reach: [f64; 2],
    },
    /// The grid and the contact elements do not fit.
    #[error("joint.grid: {0}")]
    Elements(ModelUpdateError),
    /// Nothing says what the mesh under the joint has of its compliance.
    #[error(
        "contact.stiffness = \"sliders\", its default, takes from the bodies' compliance what the finite elements have of it, and no positions of nodes say how thick they are at the joint; give structure.layer, or contact.stiffness = \"total\""
    )]
    NoLayer,
    /// No cell is left.
    #[error(
        "the joint has no cell: `joint.hole.diameter` takes all of {cells} cells; make it smaller"
    )]
    NoCells {
        /// Cells of the grid.
        cells: usize,
    },
}

/// What a scene needs: the recipe of its run with what its files say.
#[derive(Debug, Clone)]
pub struct Plan {
    /// All that a run is computed from.
    pub inputs: Inputs,
    /// What was decided from the scene alone, and what will be decided by a stated rule.
    pub decisions: Vec<Decision>,
    /// Figures that an engineer would look at, by rules of thumb.
    pub checks: Vec<Check>,
    /// What the user should change or know before it runs.
    pub warnings: Vec<String>,
}

impl Plan {
    /// What there is to say of a measured surface and of the matrices of a structure: the run's stages say it too.
    pub fn notices(&self) -> impl Iterator<Item = String> + use<'_> {
        let measured = self.inputs.measured.iter();
        let measured = measured.flat_map(|found| found.notices.iter().map(ToString::to_string));
        let imported = self.inputs.imported.iter();
        let notes = imported.flat_map(|found| found.notes.clone());
        let pressing = self.inputs.recipe.pressing_notice().map(str::to_owned);
        measured.chain(notes).chain(pressing)
    }
}

impl Plan {
    /// Reads the files of a scene, each once, and decides what it needs.
    ///
    /// # Errors
    /// [`InputError`] for a file that cannot be used, and for a scene that is well written and cannot be run.
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

/// Decides what a scene needs, and completes the recipe of its inputs.
///
/// # Errors
/// [`PlanError`] for a scene that is well written and cannot be run.
fn decide(scene: &Scene, contents: &Contents, inputs: &mut Inputs) -> Result<(), PlanError> {
    let Inputs { motion, recipe, .. } = inputs;
    let (mut surface, mut contact, mut cycle) = (None, None, None);
    if let Some(rough) = scene.rough() {
        let decided = rough::decide(scene, &rough, motion, contents)?;
        let is_pressed = decided.1.pressing.is_some();
        (surface, contact, cycle) = (Some(decided.0), Some(decided.1), decided.2);
        // What presses the joint is at rest in the vibration.
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
