//! The rough contact of a joint.

use serde::{Deserialize, Serialize};

use super::decision::Decisions;
use super::pressing::{Preload, StructureMesh, StructurePressing};
use super::{Reasons, Surface};
use crate::contact::normal::{NormalOptions, Rotation};
use crate::contact::tangential::TangentialOptions;
use crate::contact::{Boundary, Coupling, HalfSpace, Pair, Shear};
use crate::grid::Patch;
use crate::model_update::ContactElements;
use crate::structure::StructureError;
use crate::wear::cycle::March;
use crate::wear::joint::FrettingOptions;
use crate::wear::{FrettingJoint, Motion};

/// A rough contact on half spaces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// The two bodies.
    pub bodies: Pair,
    /// What presses and holds them.
    #[serde(flatten)]
    pub conditions: Conditions,
    /// What gives way of a bolt by its dimensions; none of another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bolt_compliance: Option<BoltCompliance>,
    /// Points of the plane that fields are transformed on.
    pub plane: [usize; 2],
    /// Coulomb's coefficient of friction; none where nothing moves.
    pub friction_coefficient: Option<f64>,
    /// Tangential tractions.
    pub shear: Shear,
    /// What happens to y where nothing drives it: true finds its displacement from no force.
    pub transverse_free: bool,
    /// Coupling of pressure and shear.
    pub coupling: Coupling,
    /// The structure's mesh under the joint, where what it has of the bodies' compliance is left out in shear.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub structure_mesh: Option<StructureMesh>,
    /// How the structure presses the joint. `None` where the bodies press each other as rigid punches on half spaces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressing: Option<StructurePressing>,
    /// Whether kn and kt are computed at every iteration.
    pub stiffness: bool,
    /// At which its solves and cycles end.
    #[serde(flatten)]
    pub tolerances: Tolerances,
    /// The reasons.
    pub why: Reasons,
}

/// What gives way where a bolt clamps a joint, by VDI 2230 \[m/N\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BoltCompliance {
    /// The bolt, δ_S.
    pub bolt: f64,
    /// The clamped parts, δ_P.
    pub plates: f64,
    /// What of them the half spaces under the smooth patch have already; none where the structure presses the joint, which has all of it.
    pub patch: Option<f64>,
}

impl BoltCompliance {
    /// Stiffness between both faces of the joint, outside of the contact \[N/m\].
    pub fn stiffness(self) -> f64 {
        let parts = self.patch.map_or(0.0, |patch| self.plates - patch);
        1.0 / (self.bolt + parts)
    }

    /// In words, with the most that a joint loses while it wears.
    fn describe(self) -> String {
        let told = |compliance: f64| 1e9 * compliance;
        let (bolt, plates) = (told(self.bolt), told(self.plates));
        let all = 1.0 / (self.bolt + self.plates);
        let patch = match self.patch {
            Some(patch) if patch > self.plates => format!(
                "; the half spaces under the joint give way by {:.4}, more than these parts, and the bolt counts as stiffer than it is",
                told(patch)
            ),
            Some(patch) => format!(", of which half spaces have {:.4} already", told(patch)),
            None => ", which the structure has already".to_owned(),
        };
        format!(
            "delta_S {bolt:.4}, delta_P {plates:.4} um/kN{patch}; k_b {:.4} N/um; at most {:.3} N lost per um of even wear",
            1e-6 * self.stiffness(),
            1e-6 * all
        )
    }
}

/// What presses the bodies together, and what holds them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Conditions {
    /// What lies beyond the edges.
    pub boundary: Boundary,
    /// Largest pressure a cell can carry \[Pa\], [A eq. 4.3]; none: elastic.
    pub pressure_cap: Option<f64>,
    /// Static load \[N\], of a history with loads of its own their mean; 0 where the approach is given.
    pub normal_load: f64,
    /// Approach of the bodies from height 0, in place of the load \[m\].
    pub approach: Option<f64>,
    /// Stiffness of the bolt and of what it clamps \[N/m\]: the load falls as wear brings the bodies closer; none: it does not.
    pub bolt_stiffness: Option<f64>,
    /// What holds the bodies parallel.
    pub rotation: Rotation,
}

/// Tolerances at which contact solves and cycles end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Tolerances {
    /// Relative error of a normal contact solve.
    #[serde(rename = "normal_tolerance")]
    pub normal: f64,
    /// Relative duality gap of a tangential contact solve.
    #[serde(rename = "tangential_tolerance")]
    pub tangential: f64,
    /// Closure of a sequence of tangential steps, a steady cycle or the way up to a load, in parts of the largest µp.
    #[serde(rename = "cycle_tolerance")]
    pub cycle: f64,
}

/// Peak pressure over Young's modulus from which on metals yield: their hardness is some E/100 to E/25.
pub const YIELDS: f64 = 1.0 / 25.0;
/// Peak pressure over Young's modulus from which on a unit is wrong rather than a peak sharp.
const WRONG: f64 = 0.2;

impl Contact {
    /// Young's modulus of the softer body \[Pa\].
    pub fn least_modulus(&self) -> f64 {
        let (lower, upper) = (self.bodies.lower, self.bodies.upper);
        lower.youngs_modulus.min(upper.youngs_modulus)
    }

    /// True if wear takes load away: a bolt gives way, or the approach is held.
    pub fn load_falls(&self) -> bool {
        self.bolt_loses_load() || self.conditions.approach.is_some()
    }

    /// True if wear takes load from a bolt, in the mesh or outside of it.
    pub fn bolt_loses_load(&self) -> bool {
        let preload = self.pressing.as_ref().map(|of| &of.preload);
        self.conditions.bolt_stiffness.is_some() || preload.is_some_and(Preload::is_found)
    }

    /// What is to be said of the peak pressure \[Pa\] of a contact without a cap, if a real one would yield.
    pub fn peak_pressure_note(&self, peak: f64) -> Option<String> {
        let modulus = self.least_modulus();
        if self.conditions.pressure_cap.is_some() || peak <= YIELDS * modulus {
            return None;
        }
        let also = if peak > WRONG * modulus {
            ", or a unit of contact.normal_load, of the surface or of the material is wrong"
        } else {
            ""
        };
        Some(format!(
            "the largest pressure of {:.3} GPa is {:.2} of Young's modulus; metals yield at 0.01 to 0.04 of it: contact.pressure_cap limits it{also}",
            peak * 1e-9,
            peak / modulus
        ))
    }

    /// The joint on the given unworn heights, at rest, of which the structure's mesh has a part between its contact elements, if it has one. Its bodies
    /// are no structure's yet: see [`Contact::pressing`].
    ///
    /// # Errors
    /// [`StructureError`] for a [`Contact::structure_mesh`] without boxes.
    ///
    /// # Panics
    /// With such a mesh, without its contact elements.
    pub fn joint(
        &self,
        patch: Patch,
        height: Vec<f64>,
        elements: Option<&ContactElements>,
    ) -> Result<FrettingJoint, StructureError> {
        let mut half_space = HalfSpace::new(patch.grid, self.bodies, self.conditions.boundary);
        if let Some(mesh) = &self.structure_mesh {
            let elements = elements.expect("a structure's mesh has contact elements");
            let nodal = self.taken_away(mesh, elements)?;
            let set = half_space.set_nodal(Some(nodal.into()));
            set.expect("matrices of these nodes, over this grid");
        }
        Ok(FrettingJoint {
            half_space,
            patch,
            height,
            pressing: None,
            pressure_cap: self.conditions.pressure_cap,
            friction_coefficient: self.friction_coefficient.unwrap_or(0.0),
            rotation: self.conditions.rotation,
            motion: Motion::none(self.conditions.normal_load),
            course: None,
            march: March::Reversal,
            options: FrettingOptions {
                normal: NormalOptions {
                    tolerance: self.tolerances.normal,
                    ..NormalOptions::default()
                },
                tangential: TangentialOptions {
                    tolerance: self.tolerances.tangential,
                    ..TangentialOptions::default()
                },
                cycle_tolerance: self.tolerances.cycle,
                extrapolate: false,
            },
        })
    }

    /// Says what was decided about the contact and its cells.
    pub(super) fn explain(&self, surface: &Surface, decisions: &mut Decisions) {
        let why = &self.why;
        let [x, y] = self.plane;
        decisions.add("transforms", format!("real, {x} x {y}"), why.of("boundary"));
        let cells = format!("{} of {}", surface.kept, surface.grid().len());
        decisions.add("cells", cells, surface.why.of("cells"));
        if let Some(of) = &self.pressing {
            decisions.add("pressing", of.describe(), why.of("pressing"));
        } else if !why.of("pressing").is_empty() {
            decisions.add(
                "pressing",
                "as rigid punches on half spaces",
                why.of("pressing"),
            );
        }
        if let Some(bolt) = self.bolt_compliance {
            let why = "by VDI 2230; embedding and the scatter of tightening are in no bar";
            decisions.add("bolt", bolt.describe(), why);
        }
        let cap = self
            .conditions
            .pressure_cap
            .map(|cap| format!("at {cap:e} Pa"));
        let cap = cap.unwrap_or_else(|| "none".to_owned());
        decisions.add("pressure cap", cap, why.of("pressure_cap"));
        let coupling = match self.coupling {
            Coupling::None => "none".to_owned(),
            Coupling::Frictionless => "in kt alone".to_owned(),
            Coupling::Indented { load_steps } => {
                format!("pressure and shear together, in {load_steps} load steps")
            }
        };
        let kernels = "kernels normal-tangential (zx, zy)";
        decisions.add(kernels, coupling, why.of("coupling"));
        let shear = match (self.shear, self.transverse_free) {
            (Shear::AlongX, _) => "along x; kernel xx",
            (Shear::InPlane, false) => "along x and y; kernels xx, yy, xy",
            (Shear::InPlane, true) => "along x and y, without force along y; kernels xx, yy, xy",
        };
        decisions.add("shear", shear, why.of("shear"));
        let rotation = match self.conditions.rotation {
            _ if self.pressing.is_some() => "as the structure leaves them".to_owned(),
            Rotation::Given(_) => "held; the moments of the pressure are reported".to_owned(),
            Rotation::Free { moment: [0.0, 0.0] } => {
                "found such that the pressure has no moments, and reported".to_owned()
            }
            Rotation::Free { moment: [x, y] } => format!(
                "found such that the pressure has moments of {x:e} and {y:e} N m, and reported"
            ),
        };
        decisions.add("rotations about x and y", rotation, why.of("rotation"));
        if !self.stiffness {
            decisions.add("kn and kt", "left out", why.of("stiffness"));
        }
        if self.friction_coefficient == Some(0.0) {
            decisions.add("friction", "none", why.of("friction_coefficient"));
        }
    }
}
