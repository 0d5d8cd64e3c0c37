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
    /// Loads and supports of the bodies.
    #[serde(flatten)]
    pub conditions: Conditions,
    /// Compliance of the bolt, computed from the dimensions of the bolt; `None` for a joint without such dimensions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bolt_compliance: Option<BoltCompliance>,
    /// Size of the grid on which fields are transformed.
    pub plane: [usize; 2],
    /// Coulomb's coefficient of friction; `None` if nothing moves.
    pub friction_coefficient: Option<f64>,
    /// Tangential tractions.
    pub shear: Shear,
    /// True if nothing drives y, so that the displacement along y follows from zero force.
    pub transverse_free: bool,
    /// Coupling of pressure and shear.
    pub coupling: Coupling,
    /// Mesh of the structure under the joint. In shear, the contact model subtracts the compliance of the mesh from the
    /// compliance of the half spaces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub structure_mesh: Option<StructureMesh>,
    /// Pressing of the joint by the structure; `None` if the bodies press each other as rigid punches on half spaces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressing: Option<StructurePressing>,
    /// True if kn and kt are computed in every iteration.
    pub stiffness: bool,
    /// Tolerances of solves and cycles.
    #[serde(flatten)]
    pub tolerances: Tolerances,
    /// Reasons for the choices.
    pub why: Reasons,
}

/// Compliances of a bolted joint according to VDI 2230 \[m/N\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BoltCompliance {
    /// The bolt, δ_S.
    pub bolt: f64,
    /// The clamped parts, δ_P.
    pub plates: f64,
    /// Part of the compliance of the clamped parts that the half spaces under the smooth patch already contain.
    /// `None` if the structure presses the joint and contains both compliances.
    pub patch: Option<f64>,
}

impl BoltCompliance {
    /// Returns the stiffness between both faces of the joint, without the contact \[N/m\].
    pub fn stiffness(self) -> f64 {
        let parts = self.patch.map_or(0.0, |patch| self.plates - patch);
        1.0 / (self.bolt + parts)
    }

    /// Describes the compliances, and the maximum loss of load by wear.
    fn describe(self) -> String {
        let um_per_kn = |compliance: f64| 1e9 * compliance;
        let (bolt, plates) = (um_per_kn(self.bolt), um_per_kn(self.plates));
        let total_stiffness = 1.0 / (self.bolt + self.plates);
        let patch = match self.patch {
            Some(patch) if patch > self.plates => format!(
                "; the half spaces under the joint give way by {:.4}, more than these parts, so that the bolt counts as too stiff",
                um_per_kn(patch)
            ),
            Some(patch) => format!(
                ", of which the half spaces already contain {:.4}",
                um_per_kn(patch)
            ),
            None => ", which the structure already contains".to_owned(),
        };
        format!(
            "delta_S {bolt:.4}, delta_P {plates:.4} um/kN{patch}; k_b {:.4} N/um; at most {:.3} N lost per um of even wear",
            1e-6 * self.stiffness(),
            1e-6 * total_stiffness
        )
    }
}

/// Loads and supports of the bodies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Conditions {
    /// Condition beyond the edges.
    pub boundary: Boundary,
    /// Largest pressure that a cell can carry \[Pa\], [A eq. 4.3]; `None` for an elastic contact.
    pub pressure_cap: Option<f64>,
    /// Static load \[N\], or the mean load of a history with its own loads; 0 for a prescribed approach.
    pub normal_load: f64,
    /// Prescribed approach of the bodies from height 0, in place of the load \[m\].
    pub approach: Option<f64>,
    /// Stiffness of the bolt and of the clamped parts \[N/m\]. The load falls as wear brings the bodies closer.
    /// `None` for a constant load.
    pub bolt_stiffness: Option<f64>,
    /// Condition for the rotations of the bodies.
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
    /// Closure of a sequence of tangential steps, relative to the largest µp. The sequence is a steady cycle or the
    /// steps up to a load.
    #[serde(rename = "cycle_tolerance")]
    pub cycle: f64,
}

/// Ratio of peak pressure to Young's modulus above which metals yield: their hardness is about E/100 to E/25.
pub const YIELD_PRESSURE: f64 = 1.0 / 25.0;
/// Ratio of peak pressure to Young's modulus above which a wrong unit is more likely than a sharp peak.
const WRONG_UNIT_PRESSURE: f64 = 0.2;

impl Contact {
    /// Returns Young's modulus of the softer body \[Pa\].
    pub fn least_modulus(&self) -> f64 {
        let (lower, upper) = (self.bodies.lower, self.bodies.upper);
        lower.youngs_modulus.min(upper.youngs_modulus)
    }

    /// Returns true if wear reduces the load: a bolt relaxes, or the approach is prescribed.
    pub fn load_falls(&self) -> bool {
        self.bolt_loses_load() || self.conditions.approach.is_some()
    }

    /// Returns true if wear reduces the load of a bolt, inside or outside the mesh.
    pub fn bolt_loses_load(&self) -> bool {
        let preload = self.pressing.as_ref().map(|pressing| &pressing.preload);
        self.conditions.bolt_stiffness.is_some() || preload.is_some_and(Preload::is_found)
    }

    /// Returns a note if a real contact would yield under the pressure `peak` \[Pa\] and the contact has no pressure
    /// cap.
    pub fn peak_pressure_note(&self, peak: f64) -> Option<String> {
        let modulus = self.least_modulus();
        if self.conditions.pressure_cap.is_some() || peak <= YIELD_PRESSURE * modulus {
            return None;
        }
        let also = if peak > WRONG_UNIT_PRESSURE * modulus {
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

    /// Creates the joint at rest on the given unworn heights. With a [`Contact::structure_mesh`], the function
    /// subtracts the compliance of the mesh between the contact elements from the half spaces. The joint does not yet
    /// include the pressing by a structure: see [`Contact::pressing`].
    ///
    /// # Errors
    /// [`StructureError`] for a [`Contact::structure_mesh`] without boxes.
    ///
    /// # Panics
    /// Panics if the contact has a [`Contact::structure_mesh`] but `elements` is `None`.
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
            let result = half_space.set_nodal(Some(nodal.into()));
            result.expect("matrices of these nodes, over this grid");
        }
        Ok(FrettingJoint {
            half_space,
            patch,
            height,
            pressing: None,
            pressure_cap: self.conditions.pressure_cap,
            friction_coefficient: self.friction_coefficient.unwrap_or(0.0),
            rotation: self.conditions.rotation,
            motion: Motion::at_rest(self.conditions.normal_load),
            evolving_motion: None,
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
                least_extrapolated: FrettingOptions::LEAST_EXTRAPOLATED,
                checks_per_span: FrettingOptions::CHECKS_PER_SPAN,
            },
        })
    }

    /// Explains the choices about the contact and its cells.
    pub(super) fn explain(&self, surface: &Surface, decisions: &mut Decisions) {
        let why = &self.why;
        let [x, y] = self.plane;
        decisions.add("transforms", format!("real, {x} x {y}"), why.of("boundary"));
        let cells = format!("{} of {}", surface.kept, surface.grid().len());
        decisions.add("cells", cells, surface.why.of("cells"));
        if let Some(pressing) = &self.pressing {
            decisions.add("pressing", pressing.describe(), why.of("pressing"));
        } else if !why.of("pressing").is_empty() {
            decisions.add(
                "pressing",
                "as rigid punches on half spaces",
                why.of("pressing"),
            );
        }
        if let Some(bolt) = self.bolt_compliance {
            let why = "by VDI 2230; no error bar covers embedding or the scatter of tightening";
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
            _ if self.pressing.is_some() => "determined by the structure".to_owned(),
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
