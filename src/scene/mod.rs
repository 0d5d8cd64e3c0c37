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

/// A complete, checked scene. All quantities are SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The name of its file without the extension.
    pub name: String,
    /// The recipe as far as one key decides each value; [`Plan`] adds joints and reasons.
    pub recipe: Recipe,
    /// Extent, grid and contact elements of the joint; none for an oscillator.
    pub joint: Option<Joint>,
    /// Elastic constants and density of the bodies; none for an oscillator.
    pub material: Option<Bodies>,
    /// The rough surface (one composite surface against a flat); none where the stiffness of the contact is given, or there
    /// is no contact.
    pub surface: Option<Surface>,
    /// Friction, load and boundary conditions; none for a structure without contact.
    pub contact: Option<Contact>,
    /// The prescribed cyclic motion; none for a static contact, or where a structure moves the joint.
    pub motion: Option<Motion>,
    /// Friction in the plane of the contact elements.
    pub friction_law: FrictionLaw,
    /// When the worn contact changes the contact elements of the structure.
    pub update: Updates,
    /// Accuracy against cost.
    pub fidelity: Fidelity,
    canonical: serde_json::Value,
    document: toml::Table,
}

/// `[joint]`
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Side lengths along x and y \[m\].
    pub size: [f64; 2],
    /// Cells along x and y; there whenever there is a surface.
    pub grid: Option<[usize; 2]>,
    /// Contact elements along x and y; there whenever there is a structure with a joint.
    pub elements: Option<[usize; 2]>,
    /// Diameter of a round hole in the middle \[m\].
    pub hole: Option<f64>,
}

/// `[material]`
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bodies {
    /// The elastic constants of both bodies.
    pub elastic: Pair,
    /// Density of the lower body and of the upper one \[kg/m³\]; only a structure needs them.
    pub density: [Option<f64>; 2],
}

/// `[contact]`
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// Coulomb's coefficient of friction, zero or greater; there whenever there is a motion or a structure.
    pub friction_coefficient: Option<f64>,
    /// What happens to the in-plane direction that is not driven.
    pub transverse: Transverse,
    /// What presses and holds the bodies; none of a contact of given stiffness.
    pub conditions: Option<Conditions>,
    /// Where the preload acts, if that is given.
    pub preload: Option<Preload>,
    /// The bolt whose compliance follows from its dimensions; its clamped parts have the modulus of the lower body.
    pub bolt: Option<BoltedJoint>,
    /// How the bodies of a structure are to press each other, if they can; a punch where there is none.
    pub pressed_by: PressedBy,
    /// What the contact elements of a structure get as stiffness.
    pub elements: ElementStiffness,
    /// The file that has each of them, and what it says once it is read.
    pub table: Option<ElementFile>,
}

/// A table of contact elements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ElementFile {
    /// The file.
    #[serde(skip)]
    pub path: PathBuf,
    /// What it says.
    #[serde(skip)]
    pub table: Option<ElementTable>,
}

/// Opposing forces at two places of a structure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Preload {
    /// The nodes of both places, by their numbers and names of sets.
    pub ends: [String; 2],
    /// The bolt is a part of the structure's mesh: the force is what the joint bears.
    pub in_mesh: bool,
}

/// How the bodies of a joint press each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum PressedBy {
    /// As the structure bends.
    Structure,
    /// As rigid punches on half spaces.
    Punch,
}

/// What happens to the in-plane direction that is not driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Transverse {
    /// It does not exist: neither shear nor displacement along y.
    Absent,
    /// The mean displacement along y is held; local shear along y is free to arise.
    Fixed,
    /// The force along y is zero, and the mean displacement along y found.
    Free,
}

/// `[motion]`: what drives the joint in every cycle of period T.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// It is harmonic.
    Harmonic(HarmonicMotion),
    /// One cycle as a table in a file.
    History {
        /// The file, absolute.
        path: PathBuf,
    },
}

/// `[fidelity]`
#[derive(Debug, Clone, PartialEq)]
pub struct Fidelity {
    /// The set of defaults that the other values come from.
    pub preset: Preset,
    /// The error that the knobs were chosen for in place of the preset's: a bound on the error bar of the worn volume.
    pub tolerance: Option<f64>,
    /// How a cycle is marched; none: the plan decides.
    pub cycle: Option<March>,
    /// Time steps of a stepped cycle.
    pub steps_per_cycle: usize,
    /// What solves of the contact and cycles are ended by.
    pub tolerances: Tolerances,
    /// Whether a stepped cycle has steps of second order, and is extrapolated to steps of no length from them and half as many.
    pub cycle_extrapolation: bool,
    /// Steps in which the load rises on bodies that slip under it, since they differ elastically.
    pub load_steps: usize,
    /// Whether the scene is run on half the grid too.
    pub grid_check: bool,
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
    keys::find(key).is_some_and(|key| key.value.value_form().is_path)
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
pub fn source_text(path: &Path, sets: &[String]) -> Result<String, SceneError> {
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

    /// The values of its keys as they were read, in SI, as nested objects with sorted keys: what a hash of the scene is made of.
    ///
    /// Scenes that mean the same in other units are equal here. Title, name and paths are left out, since they do not influence
    /// a result; the content of a file must be hashed beside.
    pub fn canonical(&self) -> serde_json::Value {
        self.canonical.clone()
    }

    /// What vibrates, if anything does.
    pub fn structure(&self) -> Option<&Structure> {
        self.recipe
            .structure
            .as_ref()
            .map(|structure| &structure.source)
    }

    /// What its rough contact is made of, if it has one.
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

/// The sections of a scene that a rough contact is made of.
#[derive(Debug, Clone, Copy)]
pub struct RoughJoint<'a> {
    /// Extent and contact elements.
    pub joint: &'a Joint,
    /// The two bodies.
    pub material: &'a Bodies,
    /// The surface.
    pub surface: &'a Surface,
    /// Friction.
    pub contact: &'a Contact,
    /// What presses and holds the bodies.
    pub conditions: &'a Conditions,
    /// The structure whose contact elements the cells belong to.
    pub structure: Option<&'a Structure>,
    /// The grid of the joint.
    pub grid: Grid,
}

impl Contact {
    /// Static load that presses the bodies together \[N\]; 0 where the approach is given.
    pub fn normal_load(&self) -> f64 {
        match (&self.conditions, self.elements) {
            (Some(conditions), _) => conditions.normal_load,
            (None, ElementStiffness::Given { normal_load, .. }) => normal_load,
            (None, ElementStiffness::Contact { .. }) => 0.0,
        }
    }
}

impl RoughJoint<'_> {
    /// The grid and the cells of it that belong to the joint: with a structure, those of its contact elements.
    pub fn patch(&self) -> Patch {
        match (self.elements(), self.joint.hole) {
            (Some(Ok(elements)), _) => elements.patch().clone(),
            (_, Some(diameter)) => Patch::with_hole(self.grid, diameter),
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
