//! The scene: the TOML a user writes, resolved to SI with every default filled in.
//!
//! [`load`] reads a file, the files it is based on and the `--set` of a command line, refuses what it does not know, and gives a
//! [`Scene`]. A scene knows what is wanted; what is built for it is decided elsewhere.
//!
//! ```
//! use std::path::Path;
//! use fretwear::scene::{self, Plan};
//!
//! let sets = ["joint.grid=[60, 48]".to_owned()];
//! let scene = scene::load(Path::new("pipelines/prescribed_fretting.toml"), &sets)?;
//! let plan = Plan::of(&scene)?;
//! // The recipe has every number that a run would use, and the plan says why.
//! assert_eq!(plan.inputs.recipe.surface().map(|surface| surface.grid), Some([60, 48]));
//! for decision in &plan.decisions {
//!     println!("{decision:?}");
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod begun;
mod canonical;
mod document;
mod error;
pub mod explain;
mod faults;
mod keys;
mod of_files;
pub mod plan;
mod reader;
mod resolve;
pub mod variants;

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::contact::Pair;
use crate::grid::{Grid, Patch};
use crate::material::Elastic;
use crate::model_update::{ContactElements, ModelUpdateError};
use crate::wear::cycle::March;

pub use crate::contact::Boundary;
pub use crate::dynamics::{FrictionLaw, Rayleigh};
pub use crate::model_update::{Distribution, StiffnessKind as Stiffness};
pub use crate::recipe::{
    Base, BaseMotion, Criterion as Update, DampingBasis, Force, Heights as Surface, Keep, Output,
    Port, StructureSource as Structure, Wear,
};
pub use crate::structure::resonator::Resonator;
pub use crate::surface::prepare::{Detrend, Fill};
pub use crate::wear::Scheme;
pub use canonical::{FOLLOWING_KEYS, means_something};
pub use error::{Place, Problem, SceneError};
pub use faults::MOST as MOST_FAULTS;
pub use plan::{InputError, Plan, PlanError};

/// A complete, checked scene. All quantities are SI.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scene {
    /// What the user calls it.
    pub title: Option<String>,
    /// The name of its file without the extension.
    pub name: String,
    /// Extent, grid and contact elements of the joint; none for an oscillator.
    pub joint: Option<Joint>,
    /// Elastic constants and density of the bodies; none for an oscillator.
    pub material: Option<Bodies>,
    /// The rough surface (one composite surface against a flat); none where the stiffness of the contact is given, or there
    /// is no contact.
    pub surface: Option<Surface>,
    /// Friction, load and boundary conditions; none for a structure without contact.
    pub contact: Option<Contact>,
    /// What vibrates; always together with `dynamics`.
    pub structure: Option<Structure>,
    /// How it is made to vibrate, and what of the response is wanted.
    pub dynamics: Option<Dynamics>,
    /// The prescribed cyclic motion; none for a static contact, or where a structure moves the joint.
    pub motion: Option<Motion>,
    /// Wear over many cycles; none for a single pass.
    pub wear: Option<Wear>,
    /// When the worn contact changes the contact elements of the structure; none: never.
    pub update: Option<Update>,
    /// Accuracy against cost.
    pub fidelity: Fidelity,
    /// What a run keeps.
    pub output: Output,
    #[serde(skip)]
    document: toml::Table,
}

/// `[joint]`
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Joint {
    /// Side lengths along x and y \[m\].
    pub size: [f64; 2],
    /// Cells along x and y; there whenever there is a surface.
    pub grid: Option<[usize; 2]>,
    /// Contact elements along x and y; there whenever there is a structure with a joint.
    pub elements: Option<[usize; 2]>,
    /// A round hole in the middle.
    pub hole: Option<Hole>,
}

/// `[joint] hole`
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Hole {
    /// Diameter \[m\].
    pub diameter: f64,
}

/// `[material]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bodies {
    /// The body below the joint.
    pub lower: Solid,
    /// The body above the joint.
    pub upper: Solid,
}

/// What a scene says of a body's material.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Solid {
    /// Its elastic constants.
    #[serde(flatten)]
    pub elastic: Elastic,
    /// Density \[kg/m³\]; only a structure needs it.
    pub density: Option<f64>,
}

/// `[contact]`
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contact {
    /// Coulomb's coefficient of friction, zero or greater; there whenever there is a motion or a structure.
    pub friction_coefficient: Option<f64>,
    /// Static load that presses the bodies together \[N\]; 0 where the approach is given.
    pub normal_load: f64,
    /// Approach of the bodies from height 0, in place of the load \[m\]; none: the load is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub approach: Option<f64>,
    /// Stiffness of a contact without a surface.
    pub given: Option<GivenContact>,
    /// Which stiffness of the rough contact the contact elements get.
    pub stiffness: Stiffness,
    /// How a stiffness of the whole joint is shared among the contact elements.
    pub distribution: Distribution,
    /// Stiffness of the bolt and of what it clamps \[N/m\]: the load falls as wear brings the bodies closer; none: it does not.
    pub bolt_stiffness: Option<f64>,
    /// Largest pressure a point can carry \[Pa\], [A eq. 4.3]; none: elastic.
    pub pressure_cap: Option<f64>,
    /// What lies beyond the edges of the joint.
    pub boundary: Boundary,
    /// What happens to the in-plane direction that is not driven.
    pub transverse: Transverse,
    /// What happens to the rotations of the bodies about x and y.
    pub rotation: Rotation,
    /// Moments about x and y, through the middle of the joint, under which free rotations are found \[N m\]; none: no moments.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moment: Option<[f64; 2]>,
}

/// Contact stiffness given in place of a surface: totals over the joint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GivenContact {
    /// Normal stiffness \[N/m\].
    pub kn: f64,
    /// Tangential stiffness \[N/m\].
    pub kt: f64,
    /// Gap without load \[m\]; zero under load.
    pub gap: f64,
}

/// What happens to the in-plane direction that is not driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Transverse {
    /// It does not exist: neither shear nor displacement along y.
    Absent,
    /// The mean displacement along y is held; local shear along y is free to arise.
    Fixed,
    /// The force along y is zero, and the mean displacement along y found.
    Free,
}

/// What happens to the rotations of the bodies about x and y.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rotation {
    /// They are held; the moments are reactions.
    Fixed,
    /// They are found such that the contact has the moments given.
    Free,
}

/// `[dynamics]`
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Dynamics {
    /// The forces; the drive is the first of harmonic 1 at the response and along it, or the first of all where none is there.
    pub forces: Vec<Force>,
    /// How the ground of an oscillator moves; none: it rests.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base: Option<Base>,
    /// Whose displacement is the response.
    pub response: Port,
    /// Orders of the harmonics, 0 among them: all, or those to begin with if there is a [`Fidelity::harmonic_tolerance`].
    pub harmonics: Vec<u32>,
    /// Elastic modes of the reduced structure.
    pub modes: usize,
    /// Modal damping ratio.
    pub damping_ratio: f64,
    /// The scene gives that ratio; it is no default.
    #[serde(skip)]
    pub has_damping_ratio: bool,
    /// Damping by mass and stiffness beside it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rayleigh: Option<Rayleigh>,
    /// Of which structure the damped modes are.
    pub damping_basis: DampingBasis,
    /// Friction in the plane.
    pub friction_law: FrictionLaw,
    /// Range in which the resonance is looked for and the forced response is computed \[Hz\].
    pub frequency: [f64; 2],
    /// Equidistant points of the forced response; none: as continuation places them.
    pub points: Option<usize>,
}

impl Bodies {
    /// The elastic constants of both bodies.
    pub fn pair(&self) -> Pair {
        Pair {
            lower: self.lower.elastic,
            upper: self.upper.elastic,
        }
    }
}

/// `[motion]`: what drives the joint in every cycle of period T.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Motion {
    /// u(t) = amplitude · cos(2πt/T + phase), or the force instead, N(t) = normal_load + normal_load_amplitude · cos(2πt/T).
    Harmonic {
        /// Half ranges of the relative displacement along x and y \[m\]; zero where the force is given.
        amplitude: [f64; 2],
        /// Half ranges of the force along x and y \[N\], in place of the displacement; zero along y leaves y to `transverse`.
        #[serde(skip_serializing_if = "Option::is_none")]
        force: Option<[f64; 2]>,
        /// What turns the upper body about z, in phase with cos(2πt/T).
        #[serde(flatten, skip_serializing_if = "Option::is_none")]
        torsion: Option<Torsion>,
        /// Phases along x and y \[rad\].
        phase: [f64; 2],
        /// Half range of the normal load \[N\].
        normal_load_amplitude: f64,
    },
    /// One cycle as a table in a file.
    History {
        /// The file, absolute.
        path: PathBuf,
    },
}

/// `[motion] rotation` or `moment`: about z, through the middle of the joint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Torsion {
    /// Half range of the rotation \[rad\].
    Rotation(f64),
    /// Half range of the moment \[N m\].
    Moment(f64),
}

/// `[fidelity]`
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fidelity {
    /// The set of defaults that the other values come from.
    pub preset: Preset,
    /// The error that the knobs were chosen for in place of the preset's: a bound on the error bar of the worn volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// How a cycle is marched; none: the plan decides.
    pub cycle: Option<March>,
    /// Time steps of a stepped cycle.
    pub steps_per_cycle: usize,
    /// Relative error of a normal contact solve.
    pub normal_tolerance: f64,
    /// Relative duality gap of a tangential contact solve.
    pub tangential_tolerance: f64,
    /// Relative closure of a steady cycle.
    pub cycle_tolerance: f64,
    /// Whether a stepped cycle has steps of second order, and is extrapolated to steps of no length from them and half as many.
    pub cycle_extrapolation: bool,
    /// Steps in which the load rises on bodies that slip under it, since they differ elastically; none: those of the preset.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_steps: Option<usize>,
    /// Samples of a vibration cycle at which contact elements are evaluated.
    pub aft_samples: usize,
    /// Relative error by harmonics left out, up to which they are extended; none where the scene says which there are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub harmonic_tolerance: Option<f64>,
}

/// A set of defaults.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// The published algorithm.
    Paper,
    /// Within 5 % of `reference`.
    Fast,
    /// Within 1 % of `reference`.
    Balanced,
    /// As exact as is practical.
    Reference,
}

/// Reads the scene in the file at `path` with `sets` (`key=value` each) applied.
///
/// Paths inside a file are relative to that file, paths in `sets` to the working folder.
///
/// # Errors
/// [`SceneError`] with all faults of the scene: a file that cannot be read, unknown, missing or contradictory keys, values of the
/// wrong type, dimension or range. What follows from a fault is not judged.
pub fn load(path: &Path, sets: &[String]) -> Result<Scene, SceneError> {
    resolve::scene(&document::read(path, sets)?, name_of(path))
}

/// The document of the file at `path` with its bases and `sets` applied and paths made absolute, as TOML: what [`load_kept`] reads, also
/// with further `sets`. Whether it is a scene, nobody has looked.
///
/// # Errors
/// [`SceneError`] for a file that cannot be read or is no TOML, and a key that is no `key=value`.
pub fn text_of(path: &Path, sets: &[String]) -> Result<String, SceneError> {
    Ok(document::read(path, sets)?.to_table().to_string())
}

/// Whether the value of a key is the path of a file.
pub fn is_path(key: &str) -> bool {
    keys::find(key).is_some_and(|key| key.value.told().is_path)
}

/// As [`load`], from the text of the scene that a run keeps, whose file stands, or stood, at `path`. It has no `base`.
///
/// # Errors
/// As for [`load`].
pub fn load_kept(path: &Path, text: &str, sets: &[String]) -> Result<Scene, SceneError> {
    resolve::scene(&document::read_kept(path, text, sets)?, name_of(path))
}

/// The scene in the file at `path` as it was written, comments too, for people: below its text stand, as comments, those of the files
/// that it is based on, and `sets`. It is TOML, but loading it gives the scene only where there are no bases and no `sets`.
///
/// # Errors
/// As for [`load`], of files that cannot be read.
pub fn as_written(path: &Path, sets: &[String]) -> Result<String, SceneError> {
    document::written(path, sets)
}

fn name_of(path: &Path) -> String {
    path.file_stem()
        .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

impl Scene {
    /// The document with its bases and `--set` applied and paths made absolute: loading it again gives this scene.
    pub fn document(&self) -> &toml::Table {
        &self.document
    }

    /// What the document gives of a key of a section, as in `wear.tolerance`; none of one that has its default.
    fn given(&self, key: &str) -> Option<&toml::Value> {
        let (section, name) = key.split_once('.')?;
        self.document.get(section)?.get(name)
    }

    /// [`Scene::document`] as TOML.
    pub fn to_toml(&self) -> String {
        self.document.to_string()
    }

    /// The resolved values as nested objects with sorted keys: what a hash of the scene is made of.
    ///
    /// Scenes that mean the same in other units are equal here. Title, name and paths are left out, since they do not influence
    /// a result; the content of a file must be hashed beside.
    pub fn canonical(&self) -> serde_json::Value {
        canonical::canonical(self)
    }

    /// What its rough contact is made of, if it has one.
    pub fn rough(&self) -> Option<RoughJoint<'_>> {
        Some(RoughJoint {
            joint: self.joint.as_ref()?,
            material: self.material.as_ref()?,
            surface: self.surface.as_ref()?,
            contact: self.contact.as_ref()?,
            structure: self.structure.as_ref(),
            grid: Grid::over(self.joint.as_ref()?.size, self.joint.as_ref()?.grid?),
        })
    }
}

/// The sections of a scene that a rough contact is made of.
#[derive(Debug, Clone, Copy)]
pub struct RoughJoint<'a> {
    /// Extent and contact elements.
    pub joint: &'a Joint,
    /// The two bodies.
    pub material: &'a Bodies,
    /// The surface.
    pub surface: &'a Surface,
    /// Friction, load and boundary conditions.
    pub contact: &'a Contact,
    /// The structure whose contact elements the cells belong to.
    pub structure: Option<&'a Structure>,
    /// The grid of the joint.
    pub grid: Grid,
}

impl RoughJoint<'_> {
    /// The grid and the cells of it that belong to the joint: with a structure, those of its contact elements.
    pub fn patch(&self) -> Patch {
        match (self.elements(), self.joint.hole) {
            (Some(Ok(elements)), _) => elements.patch().clone(),
            (_, Some(hole)) => Patch::with_hole(self.grid, hole.diameter),
            _ => Patch::full(self.grid),
        }
    }

    /// The contact elements of the structure on this grid, if there is one and it is known where they are.
    ///
    /// # Errors
    /// [`ModelUpdateError`] where the grid is coarser than the elements.
    pub fn elements(&self) -> Option<Result<ContactElements, ModelUpdateError>> {
        let array = self.structure?.contact_array()?;
        Some(ContactElements::new(
            self.grid,
            array.counts,
            &array.cells(),
        ))
    }
}
