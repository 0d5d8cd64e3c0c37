//! The recipe of a run: everything that it will use, as plain data, with the reason beside each choice.
//!
//! A scene is what a user writes; `scene::decide` makes a recipe of it, and that is the only place that chooses. What is built from a
//! recipe ([`build`]) decides nothing, and no stage knows the scene. All quantities are SI.

pub mod build;
mod inputs;
mod parts;
mod told;

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::contact::normal::Rotation;
use crate::contact::{Boundary, Pair, Shear};
use crate::dynamics::FrictionLaw;
use crate::grid::Grid;
use crate::model_update::{Distribution, StiffnessKind};
use crate::structure::resonator::Resonator;
use crate::surface::prepare::{Detrend, Fill};
use crate::wear::Harmonic;
use crate::wear::cycle::March;

pub use crate::model_update::Criterion;
pub use crate::wear::joint::Scheme;
pub use inputs::{Identity, Inputs};
pub use parts::Part;
pub(crate) use told::why_computed;
pub use told::{Decision, told};

/// Everything that a run will use.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// What the user calls it.
    pub title: Option<String>,
    /// What vibrates; none without vibration.
    pub structure: Option<Structure>,
    /// The joints; none in a structure without contact.
    pub joints: Vec<Joint>,
    /// How the structure is made to vibrate, and what of its response is wanted; always together with `structure`.
    pub response: Option<Response>,
    /// Wear over many cycles; none for a single pass.
    pub wear: Option<Wear>,
    /// What a run keeps.
    pub output: Output,
    /// Bound that is asked for on the error bar of the worn volume; none: that of the other tolerances.
    pub asked_error: Option<f64>,
}

/// A joint: rough, or of given stiffness.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Its cells and unworn heights; none of a joint of given stiffness.
    pub surface: Option<Surface>,
    /// The rough contact; there whenever there is a surface.
    pub contact: Option<Contact>,
    /// The cycle that the rough contact goes through; none where nothing moves it.
    pub cycle: Option<Cycle>,
    /// Its contact elements; there whenever there is a structure.
    pub elements: Option<Elements>,
}

/// Why a choice was made, by the name of the field that holds it.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Reasons(BTreeMap<String, String>);

impl Reasons {
    /// Notes the reason of a choice.
    pub fn add(&mut self, choice: &str, why: impl Into<String>) {
        self.0.insert(choice.to_owned(), why.into());
    }

    /// The reason of a choice; empty if there is none.
    pub fn of(&self, choice: &str) -> &str {
        self.0.get(choice).map_or("", String::as_str)
    }
}

/// The cells of a rough joint and its unworn heights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// Side lengths along x and y \[m\].
    pub size: [f64; 2],
    /// Cells along x and y.
    pub grid: [usize; 2],
    /// Which of them belong to the joint.
    pub cells: Cells,
    /// How many that are; of a measured surface fewer may have a height.
    pub kept: usize,
    /// Where the heights come from.
    pub heights: Heights,
    /// Hash of the file that they come from; none of a surface that is generated.
    pub content: Option<String>,
    /// The reasons.
    pub why: Reasons,
}

impl Surface {
    /// The grid.
    pub fn grid(&self) -> Grid {
        Grid::over(self.size, self.grid)
    }
}

/// Which cells of a grid belong to a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Cells {
    /// All of them.
    All,
    /// Those whose centre lies outside of a round hole in the middle.
    Hole {
        /// Diameter \[m\].
        diameter: f64,
    },
    /// Those whose centre lies in a contact element.
    Elements {
        /// Elements along x and y, were there no hole.
        counts: [usize; 2],
        /// Those of them that are in the hole.
        absent: Vec<[usize; 2]>,
    },
}

/// Where the heights come from: positive towards the other body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Heights {
    /// Gaussian heights with a Gaussian autocorrelation, exp(−(x²/clx² + y²/cly²)).
    Gaussian {
        /// Root mean square height \[m\].
        rq: f64,
        /// Lengths along x and y at which the autocorrelation is 1/e \[m\].
        correlation_length: [f64; 2],
        /// Seed of the random stream.
        seed: u64,
    },
    /// Gaussian heights with an exponential autocorrelation.
    Exponential {
        /// Root mean square height \[m\].
        rq: f64,
        /// Lengths along x and y at which the autocorrelation is 1/e \[m\].
        correlation_length: [f64; 2],
        /// Seed of the random stream.
        seed: u64,
    },
    /// Gaussian heights with a self-affine power spectrum.
    SelfAffine {
        /// Root mean square height \[m\].
        rq: f64,
        /// Hurst exponent.
        hurst: f64,
        /// Wavelength above which the spectrum is flat \[m\].
        rolloff_wavelength: f64,
        /// Wavelength below which there is no roughness \[m\]; none: down to the grid.
        cutoff_wavelength: Option<f64>,
        /// Seed of the random stream.
        seed: u64,
    },
    /// A perfectly flat surface.
    Flat,
    /// A sphere with its apex at height 0 in the middle of the joint.
    Sphere {
        /// Radius \[m\].
        radius: f64,
    },
    /// Heights from a file.
    File {
        /// The file, absolute; where it stands is not part of a recipe.
        #[serde(skip)]
        path: PathBuf,
        /// Metres per unit of height, for a file that does not carry its unit.
        unit: Option<f64>,
        /// What is subtracted from the heights.
        detrend: Detrend,
        /// What becomes of points without a height.
        fill: Fill,
        /// Distance of the points along x and y \[m\], in place of what the file says.
        spacing: Option<[f64; 2]>,
    },
}

impl Heights {
    /// Seed of the random stream, of a surface that has one.
    pub fn seed(&self) -> Option<u64> {
        match self {
            Heights::Gaussian { seed, .. }
            | Heights::Exponential { seed, .. }
            | Heights::SelfAffine { seed, .. } => Some(*seed),
            Heights::Flat | Heights::Sphere { .. } | Heights::File { .. } => None,
        }
    }
}

/// A rough contact on half spaces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// The two bodies.
    pub bodies: Pair,
    /// What lies beyond the edges.
    pub boundary: Boundary,
    /// Points of the plane that fields are transformed on.
    pub plane: [usize; 2],
    /// Largest pressure a cell can carry \[Pa\], [A eq. 4.3]; none: elastic.
    pub pressure_cap: Option<f64>,
    /// Coulomb's coefficient of friction; none where nothing moves.
    pub friction_coefficient: Option<f64>,
    /// Static load \[N\]; 0 where the approach is given.
    pub normal_load: f64,
    /// Approach of the bodies from height 0, in place of the load \[m\].
    pub approach: Option<f64>,
    /// Stiffness of the bolt and of what it clamps \[N/m\]: the load falls as wear brings the bodies closer; none: it does not.
    pub bolt_stiffness: Option<f64>,
    /// What holds the bodies parallel.
    pub rotation: Rotation,
    /// Tangential tractions.
    pub shear: Shear,
    /// What happens to y where nothing drives it: true finds its displacement from no force.
    pub transverse_free: bool,
    /// Coupling of pressure and shear.
    pub coupling: Coupling,
    /// Relative error of a normal contact solve.
    pub normal_tolerance: f64,
    /// Relative duality gap of a tangential contact solve.
    pub tangential_tolerance: f64,
    /// Closure of a sequence of tangential steps, a steady cycle or the way up to a load, in parts of the largest µp.
    pub cycle_tolerance: f64,
    /// The reasons.
    pub why: Reasons,
}

/// What elastically different bodies have of each other's tractions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Coupling {
    /// Nothing: they are alike, or nothing of it matters.
    None,
    /// No shear: only the tangential stiffness knows.
    Frictionless,
    /// Shear by pressing them together with friction.
    Indented {
        /// Steps in which the load rises.
        load_steps: usize,
    },
}

/// The cycle of a rough contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cycle {
    /// What moves the joint.
    pub motion: Motion,
    /// How the cycle is marched; none: decided from the motion that is computed, unless `asked` says so.
    pub march: Option<March>,
    /// How a computed motion is to be marched, if it allows it; none: between its reversals where it is straight and steady enough.
    pub asked: Option<March>,
    /// Time steps of a stepped cycle.
    pub steps: usize,
    /// Whether a stepped cycle is extrapolated to steps of no length, from its samples and half of them.
    pub extrapolate: bool,
    /// The reasons.
    pub why: Reasons,
}

/// What moves a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Motion {
    /// `amplitude · cos(2πt/T + phase)` of each channel, under `N(t) = normal_load + normal_load_amplitude · cos(2πt/T)`.
    Harmonic {
        /// Along x, and along y where there is shear.
        axes: Vec<Harmonic>,
        /// About z.
        rotation: Option<Harmonic>,
        /// Half range of the normal load \[N\].
        normal_load_amplitude: f64,
    },
    /// One cycle as a table in a file.
    History {
        /// Hash of its content.
        content: String,
        /// Samples of the cycle.
        samples: usize,
        /// Whether every other of them is one in the middle between those of the file.
        halved: bool,
    },
    /// What the response of the structure gives the joint.
    Computed,
}

/// The contact elements of a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Elements {
    /// How many there are.
    pub count: usize,
    /// Coulomb's coefficient of friction.
    pub friction_coefficient: f64,
    /// Friction in the plane.
    pub friction_law: FrictionLaw,
    /// What they get as load and stiffness.
    pub stiffness: ElementStiffness,
    /// When they are renewed.
    pub update: Criterion,
    /// The reasons.
    pub why: Reasons,
}

/// What contact elements get as load and stiffness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ElementStiffness {
    /// Totals over the joint, shared by area.
    Given {
        /// Normal stiffness \[N/m\].
        kn: f64,
        /// Tangential stiffness \[N/m\].
        kt: f64,
        /// Gap without load \[m\]; zero under load.
        gap: f64,
        /// Static load \[N\].
        normal_load: f64,
    },
    /// That of the rough contact.
    Contact {
        /// Which stiffness of it.
        stiffness: StiffnessKind,
        /// How a stiffness of the whole joint is shared.
        distribution: Distribution,
    },
}

impl ElementStiffness {
    /// True if each element has a stiffness of its own.
    pub fn is_tangent(&self) -> bool {
        let tangent = StiffnessKind::Tangent;
        matches!(self, ElementStiffness::Contact { stiffness, .. } if *stiffness == tangent)
    }
}

/// What vibrates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Structure {
    /// Where it comes from.
    pub source: StructureSource,
    /// Elastic modes that are kept of it.
    pub modes: usize,
    /// The reasons.
    pub why: Reasons,
}

impl Structure {
    /// True of a structure that is reduced to modes before it vibrates.
    pub fn is_reduced(&self) -> bool {
        matches!(self.source, StructureSource::Resonator { .. })
    }
}

/// Where a structure comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum StructureSource {
    /// The single-lap-joint resonator, bonded without a contact.
    Resonator {
        /// Its dimensions, mesh and material; the lap has the size and the elements of the joint.
        geometry: Box<Resonator>,
    },
    /// One mass on springs and dampers, and one contact element to the ground.
    Oscillator {
        /// Mass along x, y, z \[kg\].
        mass: [f64; 3],
        /// Damping along x, y, z \[N s/m\].
        damping: [f64; 3],
        /// Stiffness without the contact along x, y, z \[N/m\].
        stiffness: [f64; 3],
    },
}

/// A point of a structure and a direction.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Port {
    /// Name of the point.
    pub at: String,
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
}

/// A force on a structure: `amplitude · cos(k ω t + phase)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Force {
    /// Half range \[N\].
    pub amplitude: f64,
    /// Where it acts, and along which axis.
    #[serde(flatten)]
    pub port: Port,
    /// Lead \[rad\].
    pub phase: f64,
    /// k; 0 for a constant force.
    pub harmonic: u32,
}

/// Of which structure the damped modes are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DampingBasis {
    /// The unworn contact closed and stuck.
    Stuck,
    /// Without contact springs.
    Free,
}

/// How a structure is made to vibrate, and what of its response is wanted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Response {
    /// The forces; the first of harmonic 1 is the drive.
    pub forces: Vec<Force>,
    /// Whose displacement is the response.
    pub at: Port,
    /// Orders of the harmonics, 0 among them: all, or those to begin with if there is a `harmonic_tolerance`.
    pub harmonics: Vec<u32>,
    /// Relative error by harmonics left out, up to which they are extended; none: they are not.
    pub harmonic_tolerance: Option<f64>,
    /// Samples of a vibration cycle at which contact elements are evaluated.
    pub samples: usize,
    /// Modal damping ratio.
    pub damping_ratio: f64,
    /// Of which structure the damped modes are.
    pub damping_basis: DampingBasis,
    /// Range in which the resonance is looked for and the forced response is computed \[Hz\].
    pub frequency: [f64; 2],
    /// Equidistant points of the forced response; none: as continuation places them.
    pub points: Option<usize>,
    /// The reasons.
    pub why: Reasons,
}

/// Wear over many cycles. At least one of `cycles` and `volume` is there; the run ends at the first that is reached.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Wear {
    /// Worn volume per dissipated energy \[m³/J\], [A eq. 2.5].
    pub coefficient: f64,
    /// Number of cycles to reach.
    pub cycles: Option<u64>,
    /// Worn volume to reach \[m³\].
    pub volume: Option<f64>,
    /// How a wear step is taken.
    pub scheme: Scheme,
    /// Largest local wear depth of a step \[m\]; always there for an explicit scheme.
    pub depth_step: Option<f64>,
    /// Relative error that a wear step may make.
    pub tolerance: f64,
}

impl Wear {
    /// True if these cycles, or this worn volume \[m³\], end the run.
    pub fn is_reached(&self, cycles: u64, volume: f64) -> bool {
        self.cycles.is_some_and(|end| cycles >= end) || self.volume.is_some_and(|end| volume >= end)
    }
}

/// What a run keeps and writes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// Which iterations are kept.
    pub keep: Keep,
    /// Whether the fields at every step of a cycle are written.
    pub cycle_fields: bool,
    /// Indentation and hysteresis curves are written every so many iterations; 0: never.
    pub curves_every: u64,
    /// Cycles at which a forced response of the worn state is computed, without feeding it back.
    pub response_at: Vec<u64>,
}

/// Which iterations are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Keep {
    /// All of them.
    All,
    /// Some of them.
    #[serde(untagged)]
    Some {
        /// Every so many; none: only those below.
        every: Option<u64>,
        /// The last so many, at least one.
        last: u64,
        /// Those that updated the model.
        updates: bool,
    },
}

impl Recipe {
    /// The joint, where there is one: a run has one at most as yet.
    pub fn joint(&self) -> Option<&Joint> {
        self.joints.first()
    }

    /// Cells and heights of the joint, where it is rough.
    pub fn surface(&self) -> Option<&Surface> {
        self.joint()?.surface.as_ref()
    }

    /// The rough contact of the joint.
    pub fn contact(&self) -> Option<&Contact> {
        self.joint()?.contact.as_ref()
    }

    /// The cycle of the joint.
    pub fn cycle(&self) -> Option<&Cycle> {
        self.joint()?.cycle.as_ref()
    }

    /// The contact elements of the joint.
    pub fn elements(&self) -> Option<&Elements> {
        self.joint()?.elements.as_ref()
    }
}
