//! What a scene needs: the one place that decides what will exist.
//!
//! A [`Plan`] is data: what is built and why, what is not and why, and what it costs. Its cost is in cells, transform pairs and
//! bytes, never in seconds, so that equal scenes give equal plans on every machine.

mod bearing;
mod before;
mod cost;
mod course;
mod disk;
mod memory;
mod rough;
mod seconds;
mod solves;
mod stability;
mod vibration;
mod vibration_cost;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::Scene;
use crate::contact::Shear;
use crate::wear::Motion;
use crate::wear::cycle::March;

pub use before::Texture;
pub use rough::motion_of;
pub use seconds::{Rates, Seconds};
pub use vibration::Layout;

/// A scene that is well written and cannot be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
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
    /// `reversal` or `superposition` for another motion than they can march.
    #[error(
        "`fidelity.cycle` is \"{mode}\", which needs a straight motion about zero that turns at its ends only, under constant normal load; use \"stepped\""
    )]
    NotStraight {
        /// The value of `fidelity.cycle`.
        mode: &'static str,
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
    /// The load lifts off within the cycle.
    #[error(
        "the normal load falls to {load:.6e} N within the cycle; it must stay above zero: make `motion.normal_load_amplitude` smaller than `contact.normal_load`"
    )]
    LiftsOff {
        /// The least load \[N\].
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

/// One decision: what, whether it will exist, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decision {
    /// What it is about.
    pub what: String,
    /// What was decided.
    pub choice: String,
    /// Why.
    pub why: String,
}

/// What a plan decides, in the order in which it is told.
#[derive(Default)]
struct Decisions(Vec<Decision>);

impl Decisions {
    fn add(&mut self, what: &str, choice: impl Into<String>, why: impl Into<String>) {
        self.0.push(Decision {
            what: what.to_owned(),
            choice: choice.into(),
            why: why.into(),
        });
    }

    /// Tells the last decision after the one about this.
    fn move_last_after(&mut self, what: &str) {
        let place = self.0.iter().position(|d| d.what == what);
        if let (Some(place), Some(last)) = (place, self.0.pop()) {
            self.0.insert(place + 1, last);
        }
    }
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

/// What elastically different bodies have of each other's tractions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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

/// What exists in a run of a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// Tangential tractions.
    #[serde(skip)]
    pub shear: Shear,
    /// Coupling of pressure and shear.
    #[serde(skip)]
    pub coupling: Coupling,
    /// How cycles are marched; none without motion, and where the motion is computed: it decides itself then.
    pub march: Option<March>,
    /// What was decided from the scene alone, and what will be decided by a stated rule.
    pub decisions: Vec<Decision>,
    /// What the user should change or know before it runs.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// What it is expected to cost.
    pub cost: Cost,
}

impl Plan {
    /// Decides what a scene needs. `motion` is what `[motion]` says (see [`motion_of`]), `texture` that of a surface from a file:
    /// only what the run is expected to cost depends on it.
    ///
    /// # Errors
    /// [`PlanError`] for a scene that is well written and cannot be run.
    pub fn decide(
        scene: &Scene,
        motion: Option<&Motion>,
        texture: Option<Texture>,
    ) -> Result<Plan, PlanError> {
        let mut decisions = Decisions::default();
        let (mut shear, mut march, mut coupling) = (Shear::AlongX, None, Coupling::None);
        if let Some(rough) = scene.rough() {
            (shear, march, coupling) = rough::decide(scene, &rough, motion, &mut decisions)?;
        }
        vibration::decide(scene, &mut decisions)?;
        let decided = cost::Decided {
            shear,
            coupling,
            march,
        };
        let (cost, wearing) = cost::cost(scene, motion, texture, &decided);
        let warning = wearing.and_then(|wearing| stability::decide(&wearing, &mut decisions));
        Ok(Plan {
            shear,
            coupling,
            march,
            decisions: decisions.0,
            warnings: warning.into_iter().collect(),
            cost,
        })
    }
}
