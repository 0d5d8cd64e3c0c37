//! The scene: the TOML of a user, resolved to SI with all defaults.
//!
//! [`load`] reads a scene file and its base files. [`load`] then applies the `--set` options of the command line.
//! [`load`] rejects unknown keys, and returns a [`Scene`]. A scene states the requested results. A [`Plan`] decides how
//! the program computes the results.
//!
//! ```
//! use std::path::Path;
//! use fretwear::scene::{self, Plan};
//!
//! let sets = ["joint.grid=[60, 48]".to_owned()];
//! let scene = scene::load(Path::new("pipelines/prescribed_fretting.toml"), &sets)?;
//! let plan = Plan::of(&scene)?;
//! // The recipe contains every number that a run would use, and the plan gives the reasons.
//! assert_eq!(plan.inputs.recipe.surface().map(|surface| surface.grid), Some([60, 48]));
//! for decision in &plan.decisions {
//!     println!("{decision:?}");
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod begun;
mod document;
mod error;
pub mod explain;
mod faults;
mod keys;
mod of_files;
pub mod plan;
mod reader;
mod record;
mod resolve;
pub mod variants;

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::contact::Pair;
use crate::grid::{Grid, Patch};
use crate::model_update::{BoltedJoint, ContactElements, ModelUpdateError};
use crate::recipe::element_table::ElementTable;
use crate::recipe::{Conditions, ElementStiffness, Recipe, Tolerances};
use crate::wear::HarmonicMotion;
use crate::wear::cycle::March;

pub use crate::contact::Boundary;
pub use crate::dynamics::{FrictionLaw, Rayleigh};
pub use crate::model_update::{Distribution, StiffnessKind as Stiffness};
pub use crate::recipe::{
    Base, BaseMotion, DampingBasis, Force, Heights as Surface, Keep, Output, Port,
    StructureSource as Structure, UpdateCriterion as Update, Updates, Wear,
};
pub use crate::structure::resonator::Resonator;
pub use crate::surface::prepare::{Detrend, Fill};
pub use crate::wear::Scheme;
pub use error::{Place, Problem, SceneError};
pub use faults::MOST as MOST_FAULTS;
pub use plan::{InputError, Plan, PlanError};
pub use record::{FOLLOWING_KEYS, is_relevant};

/// Complete and checked scene. All quantities are in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// File name of the scene without the extension.
    pub name: String,
    /// The recipe, as far as single keys determine it. [`Plan`] adds the values that depend on several keys, and the
    /// reasons.
    pub recipe: Recipe,
    /// Size, grid and contact elements of the joint; `None` for an oscillator.
    pub joint: Option<Joint>,
    /// Elastic constants and density of the bodies; `None` for an oscillator.
    pub material: Option<Bodies>,
    /// The rough surface (one composite surface against a flat); `None` if the contact stiffness is given, or without
    /// contact.
    pub surface: Option<Surface>,
    /// Friction, load and boundary conditions; `None` for a structure without contact.
    pub contact: Option<Contact>,
    /// The prescribed cyclic motion; `None` for a static contact, or if a structure moves the joint.
    pub motion: Option<Motion>,
    /// Friction law in the plane of the contact elements.
    pub friction_law: FrictionLaw,
    /// Criterion for updating the contact elements of the structure from the worn contact.
    pub update: Updates,
    /// Settings of accuracy and cost.
    pub fidelity: Fidelity,
    canonical: serde_json::Value,
    document: toml::Table,
}

/// `[joint]`
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Side lengths along x and y \[m\].
    pub size: [f64; 2],
    /// Cells along x and y; always given if there is a surface.
    pub grid: Option<[usize; 2]>,
    /// Contact elements along x and y; always given if there is a structure with a joint.
    pub elements: Option<[usize; 2]>,
    /// Diameter of a round hole in the middle of the joint \[m\].
    pub hole: Option<f64>,
}

/// `[material]`
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bodies {
    /// Elastic constants of both bodies.
    pub elastic: Pair,
    /// Density of the lower and the upper body \[kg/m³\]; only a structure needs them.
    pub density: [Option<f64>; 2],
}

/// `[contact]`
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// Coulomb's coefficient of friction, zero or greater; always given if there is a motion or a structure.
    pub friction_coefficient: Option<f64>,
    /// Treatment of the in-plane direction y, across the motion.
    pub transverse: Transverse,
    /// Load and boundary conditions of the rough contact; `None` if the contact stiffness is given.
    pub conditions: Option<Conditions>,
    /// The points where the preload acts, if they are given.
    pub preload: Option<Preload>,
    /// The bolt whose compliance follows from its dimensions. The parts that the bolt clamps have the modulus of the
    /// lower body.
    pub bolt: Option<BoltedJoint>,
    /// How the bodies of a structure press each other, if both ways are possible. A scene without a structure has
    /// punches.
    pub pressed_by: Pressing,
    /// Stiffness that the contact elements of a structure get.
    pub elements: ElementStiffness,
    /// The file with a row for every contact element, and its content after reading.
    pub table: Option<ElementFile>,
}

/// File with a table of contact elements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ElementFile {
    /// The path of the file.
    #[serde(skip)]
    pub path: PathBuf,
    /// The content, once the file is read.
    #[serde(skip)]
    pub table: Option<ElementTable>,
}

/// Bolt preload: opposing forces at two places of a structure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Preload {
    /// The nodes of both places, given as node numbers and names of sets.
    pub ends: [String; 2],
    /// True if the bolt is a part of the structure's mesh. The force is then the load that the joint bears.
    pub in_mesh: bool,
}

/// Punch or structure: how the bodies of a joint press each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Pressing {
    /// The bodies deform as the structure bends.
    Structure,
    /// The bodies are rigid punches on half spaces.
    Punch,
}

/// Treatment of the in-plane direction y, across the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Transverse {
    /// No y direction: neither shear nor displacement along y.
    Absent,
    /// The mean displacement along y is fixed; local shear along y is possible.
    Fixed,
    /// The force along y is zero, and the mean displacement along y is solved for.
    Free,
}

/// `[motion]`: the drive of the joint in every cycle of period T.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// A harmonic motion.
    Harmonic(HarmonicMotion),
    /// One cycle as a table in a file.
    History {
        /// Absolute path of the file.
        path: PathBuf,
    },
}

/// `[fidelity]`
#[derive(Debug, Clone, PartialEq)]
pub struct Fidelity {
    /// Preset that determines the defaults of the other fields of [`Fidelity`].
    pub preset: Preset,
    /// Bound on the error of the worn volume from which the settings were chosen, in place of the preset.
    pub tolerance: Option<f64>,
    /// Method of marching through a cycle; `None` lets the plan decide.
    pub cycle: Option<March>,
    /// Time steps of a stepped cycle.
    pub steps_per_cycle: usize,
    /// Tolerances at which contact solves and cycles end.
    pub tolerances: Tolerances,
    /// True if the program extrapolates a stepped cycle to step length zero. The extrapolation uses steps of second
    /// order and a second cycle with half as many steps.
    pub cycle_extrapolation: bool,
    /// Number of load steps for bodies of different materials, which slip while the load rises.
    pub load_steps: usize,
    /// True if the program runs the scene on joint.grid and on half of joint.grid.
    pub grid_check: bool,
}

/// Set of defaults for accuracy and cost.
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

/// Reads the scene in the file at `path` and applies `sets` (`key=value` each).
///
/// Paths in a scene file are relative to the folder of the scene file. Paths in `sets` are relative to the working
/// folder.
///
/// # Errors
/// [`SceneError`] with all faults of the scene: an unreadable file, faulty keys and faulty values. A faulty key is
/// unknown, missing or in conflict with another key. A faulty value has the wrong type or dimension, or is out of
/// range. Consequences of a fault are not reported.
pub fn load(path: &Path, sets: &[String]) -> Result<Scene, SceneError> {
    resolve::scene(&document::read(path, sets)?, name_of(path))
}

/// Returns the document of the file at `path` as TOML, with its bases and `sets` applied and with absolute paths.
/// [`load_kept`] reads the returned text, and can apply further `sets` to the text. The function does not check whether
/// the document is a valid scene.
///
/// # Errors
/// [`SceneError`] if the file cannot be read, if the file is not TOML, or if a set is not `key=value`.
pub fn text_of(path: &Path, sets: &[String]) -> Result<String, SceneError> {
    Ok(document::read(path, sets)?.to_table().to_string())
}

/// True if the value of a key is the path of a file.
pub fn is_path(key: &str) -> bool {
    keys::find(key).is_some_and(|key| key.value.value_form().is_path)
}

/// As [`load`], but reads the text of a scene that a run stores. The argument `path` is the path of the stored scene
/// file. The scene file need not exist. The text must not have a `base`.
///
/// # Errors
/// As for [`load`].
pub fn load_kept(path: &Path, text: &str, sets: &[String]) -> Result<Scene, SceneError> {
    resolve::scene(&document::read_kept(path, text, sets)?, name_of(path))
}

/// Returns the text of the scene file at `path`, with its comments, for display. The texts of the base files and the
/// `sets` follow as TOML comments. The result is TOML, but loading it gives the scene only if there are no bases and no
/// `sets`.
///
/// # Errors
/// As for [`load`], if a file cannot be read.
pub fn source_text(path: &Path, sets: &[String]) -> Result<String, SceneError> {
    document::source_text(path, sets)
}

fn name_of(path: &Path) -> String {
    path.file_stem()
        .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

impl Scene {
    /// Returns the document of the scene after applying base files and `--set` options, with absolute paths. Loading
    /// the document gives an equal scene.
    pub fn document(&self) -> &toml::Table {
        &self.document
    }

    /// Returns the value of a key such as `wear.tolerance` in the document. Returns `None` if the document does not
    /// give the key.
    fn given_value(&self, key: &str) -> Option<&toml::Value> {
        let (section, name) = key.split_once('.')?;
        self.document.get(section)?.get(name)
    }

    /// Writes [`Scene::document`] as TOML.
    pub fn to_toml(&self) -> String {
        self.document.to_string()
    }

    /// The values of the keys as they were read, in SI, as nested objects with sorted keys. The hash of a scene is a
    /// hash of the canonical value.
    ///
    /// Two scenes that differ only in the units of values have equal canonical values. Title, name and paths are
    /// omitted, because they do not affect results. The contents of files must be hashed separately.
    pub fn canonical(&self) -> serde_json::Value {
        self.canonical.clone()
    }

    /// The vibrating structure, if there is one.
    pub fn structure(&self) -> Option<&Structure> {
        self.recipe
            .structure
            .as_ref()
            .map(|structure| &structure.source)
    }

    /// The sections that define the rough contact, if the scene has one.
    pub fn rough(&self) -> Option<RoughJoint<'_>> {
        Some(RoughJoint {
            joint: self.joint.as_ref()?,
            material: self.material.as_ref()?,
            surface: self.surface.as_ref()?,
            contact: self.contact.as_ref()?,
            conditions: self.contact.as_ref()?.conditions.as_ref()?,
            structure: self.structure(),
            grid: Grid::over(self.joint.as_ref()?.size, self.joint.as_ref()?.grid?),
        })
    }
}

/// Sections of a scene that define a rough contact.
#[derive(Debug, Clone, Copy)]
pub struct RoughJoint<'a> {
    /// Size and contact elements of the joint.
    pub joint: &'a Joint,
    /// The two bodies.
    pub material: &'a Bodies,
    /// The surface.
    pub surface: &'a Surface,
    /// Friction and further contact keys.
    pub contact: &'a Contact,
    /// Load and boundary conditions.
    pub conditions: &'a Conditions,
    /// The structure whose contact elements contain the cells.
    pub structure: Option<&'a Structure>,
    /// The grid of the joint.
    pub grid: Grid,
}

impl Contact {
    /// Returns the static load that presses the bodies together \[N\]. Returns 0 if the scene gives contact.approach in
    /// place of a load.
    pub fn normal_load(&self) -> f64 {
        match (&self.conditions, self.elements) {
            (Some(conditions), _) => conditions.normal_load,
            (None, ElementStiffness::Given { normal_load, .. }) => normal_load,
            (None, ElementStiffness::Contact { .. }) => 0.0,
        }
    }
}

impl RoughJoint<'_> {
    /// Returns the grid and the cells that belong to the joint. If the scene has a structure, the contact elements of
    /// the structure determine the cells of the joint.
    pub fn patch(&self) -> Patch {
        match (self.elements(), self.joint.hole) {
            (Some(Ok(elements)), _) => elements.patch().clone(),
            (_, Some(diameter)) => Patch::with_hole(self.grid, diameter),
            _ => Patch::full(self.grid),
        }
    }

    /// Returns the contact elements of the structure on the grid of the joint. Returns `None` if the scene has no
    /// structure, or if the contact positions of the structure are unknown.
    ///
    /// # Errors
    /// [`ModelUpdateError`] if the grid is coarser than the elements.
    pub fn elements(&self) -> Option<Result<ContactElements, ModelUpdateError>> {
        let array = self.structure?.contact_array()?;
        Some(ContactElements::new(
            self.grid,
            array.counts,
            &array.cells(),
        ))
    }
}
